//! The functions that are printed into WGSL, over all they are defined for, against f64: errors in units in the last
//! place are those that their texts state.

use std::sync::Arc;

use tensormass_kernels::LawEntry;
use tensormass_kernels::RestPoint;
use tensormass_kernels::shader::{Argument, LawFunctions, PointFunction};
use tensormass_runtime::body::LawBatch;
use tensormass_runtime::gpu::{Gpu, GpuOptions};
use tensormass_runtime::laws;
use tensormass_testing::codegen::ir::Remainder;
use tensormass_testing::codegen::print::wgsl::helper_functions;
use tensormass_testing::random::Rng;
use tensormass_testing::rounding::printed;

use super::on_gpu;
use super::states::{Kernel, body, single};
use crate::support::gpu::test_device;

/// Arguments of each function.
const COUNT: usize = 200_000;

/// A law whose energy is nothing but a function of two constants.
fn law(function: &str) -> &'static LawEntry {
    let leaked = |text: String| -> &'static str { Box::leak(text.into_boxed_str()) };
    let density = "fn energy(c: array<f32, 2>) -> f32 {\n    let a = c[0];\n    let b = c[1];\n    return ";
    let text = leaked(format!("{}{density}{function};\n}}\n", helper_functions()));
    let energy = PointFunction { name: "energy", text, arguments: &[Argument::Constants], field: None };
    let like = laws()[0];
    let (force, dforce, diagonal, cauchy) = (energy, energy, energy, energy);
    let functions = LawFunctions { banner: "", energy, force, dforce, diagonal, cauchy };
    let mut info = like.info.clone();
    (info.name, info.constants, info.domain) = (leaked(function.to_string()), &["a", "b"], None);
    let mut entry = like;
    (entry.info, entry.functions) = (Box::leak(Box::new(info)), Box::leak(Box::new(functions)));
    Box::leak(Box::new(entry))
}

/// Evaluates a function of pairs on the device.
fn evaluated(gpu: &Arc<Gpu>, function: &str, arguments: &[[f64; 2]]) -> Vec<f64> {
    let rest = arguments.iter().map(|_| [RestPoint { inverse_jacobian: [0.0; 9], weight: 1.0 }]).collect();
    let batch = LawBatch {
        law: law(function),
        element: tensormass_kernels::linear_tetrahedron(),
        elements: (0..arguments.len() as u32).collect(),
        constants: arguments.as_flattened().to_vec(),
        per_element: true,
    };
    let elements = arguments.iter().map(|_| [0, 1, 2, 3]).collect();
    let body = body(elements, &rest, vec![batch], &mut Rng::new(0));
    let nodes = vec![[0.0; 3]; 4];
    on_gpu(gpu, &body, GpuOptions::default()).fresh(Kernel::Energy, &nodes, &nodes)
}

/// The distance of the numbers of f32 at a normal one.
fn unit(x: f64) -> f64 {
    let x = (x.abs() as f32).max(f32::MIN_POSITIVE);
    f64::from(f32::from_bits(x.to_bits() + 1)) - f64::from(x)
}

/// A function: WGSL, its exact value, the units within which the text says it is, arguments, and what divisions of 2.5
/// units may add to the units (see `tensormass_testing::rounding::Wgsl`).
struct Function {
    text: &'static str,
    exact: fn(f64, f64) -> f64,
    units: fn(f64, f64) -> f64,
    division: f64,
    argument: fn(&mut Rng) -> [f64; 2],
}

/// A number whose logarithm is uniform.
fn logarithmic(rng: &mut Rng, low: f64, high: f64) -> f64 {
    rng.uniform(low.ln(), high.ln()).exp()
}

fn signed(rng: &mut Rng, x: f64) -> f64 {
    if rng.uniform(0.0, 1.0) < 0.5 { -x } else { x }
}

/// One argument in two is near the place where a function vanishes.
fn near(rng: &mut Rng) -> bool {
    rng.uniform(0.0, 1.0) < 0.5
}

const FUNCTIONS: [Function; 7] = [
    Function {
        text: "ln_(a)",
        exact: |a, _| a.ln(),
        units: |_, _| printed::LN,
        division: 1.0,
        argument: |rng| {
            let far = [f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)];
            let [low, high] = if near(rng) { [0.5, 2.0] } else { far };
            [logarithmic(rng, low, high).clamp(low, high), 0.0]
        },
    },
    Function {
        text: "log1p_(a)",
        exact: |a, _| a.ln_1p(),
        units: |_, _| printed::LOG1P,
        division: 2.0,
        argument: |rng| {
            let x = logarithmic(rng, 1e-30, 1e38);
            [if near(rng) { signed(rng, 1.0) * logarithmic(rng, 1e-9, 0.999_999) } else { x }, 0.0]
        },
    },
    Function {
        text: "exp_(a)",
        exact: |a, _| a.exp(),
        units: |_, _| printed::EXP,
        division: 0.0,
        argument: |rng| [if near(rng) { rng.uniform(-1.0, 1.0) } else { rng.uniform(-87.33, 88.72) }, 0.0],
    },
    Function {
        text: "expm1_(a)",
        exact: |a, _| a.exp_m1(),
        units: |_, _| printed::EXPM1,
        division: 0.0,
        argument: |rng| {
            let x = logarithmic(rng, 1e-30, 2.0);
            [if near(rng) { signed(rng, x) } else { rng.uniform(-100.0, 88.72) }, 0.0]
        },
    },
    Function {
        text: "log1pmx_(a)",
        exact: |a, _| Remainder::log1pmx(a),
        units: |_, _| printed::LOG1PMX,
        division: 3.0,
        argument: |rng| {
            let x = logarithmic(rng, 1e-15, 1e30);
            [if near(rng) { signed(rng, 1.0) * logarithmic(rng, 1e-9, 0.999_999) } else { x }, 0.0]
        },
    },
    Function {
        text: "expm1mx_(a)",
        exact: |a, _| Remainder::expm1mx(a),
        units: |_, _| printed::EXPM1MX,
        division: 0.0,
        argument: |rng| {
            let x = logarithmic(rng, 1e-15, 2.0);
            [if near(rng) { signed(rng, x) } else { rng.uniform(-80.0, 80.0) }, 0.0]
        },
    },
    Function {
        text: "powf_(a, b)",
        exact: f64::powf,
        units: |a, b| printed::powf((b * a.ln()).abs()),
        // One unit of the logarithm; its text leaves more than that.
        division: 0.0,
        argument: |rng| {
            let a = if near(rng) { rng.uniform(0.5, 2.0) } else { logarithmic(rng, 1e-30, 1e30) };
            let logarithm = rng.uniform(-80.0, 80.0);
            let b = rng.uniform(-3.0, 3.0);
            [a, if (b * a.ln()).abs() < 80.0 { b } else { logarithm / a.ln() }]
        },
    },
];

#[test]
fn functions_are_as_accurate_as_their_texts_say() {
    let Some(gpu) = test_device() else { return };
    for Function { text, exact, units, division, argument } in FUNCTIONS {
        let mut rng = Rng::new(4);
        let arguments: Vec<[f64; 2]> = (0..COUNT).map(|_| argument(&mut rng).map(single)).collect();
        let found = evaluated(&gpu, text, &arguments);
        let mut worst = (0.0f64, [0.0; 2]);
        for (&[a, b], found) in arguments.iter().zip(found) {
            let wanted = exact(a, b);
            let off = (found - wanted).abs() / unit(wanted);
            let part = off / (units(a, b) + division);
            assert!(part.is_finite(), "{text} at {a:e}, {b:e} is {found:e}");
            if part > worst.0 {
                worst = (part, [a, b]);
            }
        }
        let (part, [a, b]) = worst;
        println!("{text}: {part:.2} of the units allowed, at {a:e}, {b:e}");
        assert!(part <= 1.0, "{text}: {part} times the units allowed, at {a:e}, {b:e}");
    }
}

#[test]
fn exponentials_beyond_f32_are_its_largest_number_and_zero() {
    let Some(gpu) = test_device() else { return };
    let found = |text, a: &[f64]| evaluated(&gpu, text, &a.iter().map(|&a| [single(a), 0.0]).collect::<Vec<_>>());
    let largest = found("exp_(a)", &[88.722_83, 89.0, 1000.0, 1e38]);
    let near = |x: &f64| *x >= 0.999 * f64::from(f32::MAX) && *x <= f64::from(f32::MAX);
    assert!(largest.iter().all(near), "{largest:?}");
    assert_eq!(found("exp_(a)", &[-87.4, -104.0, -1000.0, -1e38]), [0.0; 4]);
    assert_eq!(found("expm1_(a)", &[-20.0, -104.0, -1e38]), [-1.0; 3]);
    assert_eq!(found("exp_(a)", &[0.0]), [1.0]);
    assert_eq!([found("expm1_(a)", &[0.0]), found("log1p_(a)", &[0.0]), found("ln_(a)", &[1.0])].concat(), [0.0; 3]);
}

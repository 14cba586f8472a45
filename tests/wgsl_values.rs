//! The WGSL of every law computes what its derivation says, and its own functions are as accurate as they state.
//!
//! The texts run on the host, operation by operation in f32: no tolerance is needed for kernels. What a device makes of
//! them is compared where one is used.

use std::sync::LazyLock;

use tensormass_kernels::shader::PASSES;
use tensormass_kernels::{LawEntry, elements, laws};
use tensormass_testing::codegen::derivation::{Derivation, PointKernel};
use tensormass_testing::codegen::element::{declarations, kernels};
use tensormass_testing::codegen::ir::{Builder, Input, Number, Op, Output, Rational, Remainder, ValidKernel, ValueId};
use tensormass_testing::codegen::print::wgsl;
use tensormass_testing::derivation;
use tensormass_testing::evaluate::{Functions, Value};
use tensormass_testing::random::Rng;
use tensormass_testing::rounding::printed;

const STATES: u64 = 30;

/// Every helper function, as a text.
static HELPERS: LazyLock<Functions> = LazyLock::new(|| {
    let all = kernel(|b, [x, y, z]| {
        [Op::Log1p(x), Op::Expm1(y), Op::Powf(x, z), Op::Log1pmx(x), Op::Expm1mx(y)].map(|op| b.push(op)).to_vec()
    });
    Functions::parse(&wgsl::function(&all))
});

/// Calls a helper function.
fn helper(name: &str, arguments: &[f32]) -> f32 {
    let arguments: Vec<Value> = arguments.iter().copied().map(Value::F32).collect();
    HELPERS.call(name, &arguments).numbers()[0]
}

/// An f32 whose functions are the helpers: what a kernel means to a device, bit for bit.
#[derive(Debug, Clone, Copy)]
struct OnDevice(f32);

impl Number for OnDevice {
    fn from_rational(q: Rational) -> Self {
        Self(f32::from_rational(q))
    }
    fn add(&self, b: &Self) -> Self {
        Self(self.0 + b.0)
    }
    fn sub(&self, b: &Self) -> Self {
        Self(self.0 - b.0)
    }
    fn mul(&self, b: &Self) -> Self {
        Self(self.0 * b.0)
    }
    fn div(&self, b: &Self) -> Self {
        Self(self.0 / b.0)
    }
    fn neg(&self) -> Self {
        Self(-self.0)
    }
    fn fma(&self, b: &Self, c: &Self) -> Self {
        Self(self.0.mul_add(b.0, c.0))
    }
    fn sqrt(&self) -> Self {
        Self(self.0.sqrt())
    }
    fn ln(&self) -> Self {
        Self(helper("ln_", &[self.0]))
    }
    fn exp(&self) -> Self {
        Self(helper("exp_", &[self.0]))
    }
    fn log1p(&self) -> Self {
        Self(helper("log1p_", &[self.0]))
    }
    fn expm1(&self) -> Self {
        Self(helper("expm1_", &[self.0]))
    }
    fn log1pmx(&self) -> Self {
        Self(helper("log1pmx_", &[self.0]))
    }
    fn expm1mx(&self) -> Self {
        Self(helper("expm1mx_", &[self.0]))
    }
    fn powf(&self, b: &Self) -> Self {
        Self(helper("powf_", &[self.0, b.0]))
    }
    fn greater(&self, b: &Self) -> bool {
        self.0 > b.0
    }
}

/// Compares one function of a text with the kernel that it was printed from, bit for bit.
fn check(what: &str, functions: &Functions, kernel: PointKernel<'_>, inputs: &[(Input, Vec<f32>)]) {
    let of = |role: Input| &inputs.iter().find(|(r, _)| *r == role).expect("an input of each role").1;
    let declared = kernel.near.ir().inputs.iter().map(|&(role, _)| role);
    let read: Vec<Value> = declared
        .clone()
        .filter(|role| kernel.reads(*role))
        .map(|role| if role == Input::Weight { Value::F32(of(role)[0]) } else { Value::array(of(role)) })
        .collect();
    let actual = functions.call(kernel.name(), &read).numbers();
    let wrapped: Vec<(Input, Vec<OnDevice>)> =
        declared.map(|role| (role, of(role).iter().copied().map(OnDevice).collect())).collect();
    let wrapped: Vec<(Input, &[OnDevice])> = wrapped.iter().map(|(role, values)| (*role, values.as_slice())).collect();
    let expected = kernel.interpret(&wrapped).expect("inputs of each role").concat();
    assert_eq!(actual.len(), expected.len(), "{what}");
    for (k, (a, e)) in actual.iter().zip(&expected).enumerate() {
        let same = *a == e.0 || (a.is_nan() && e.0.is_nan());
        assert!(same, "{what} {k}: {a:e}, by the derivation {:e}; {inputs:?}", e.0);
    }
}

fn check_law(law: &LawEntry, ir: &Derivation, seed: u64) {
    let mut rng = Rng::new(seed);
    let constants: Vec<f32> = law.constants(&rng.parameters(law.info)).iter().map(|&c| c as f32).collect();
    let single = |values: &[f64]| values.iter().map(|&x| x as f32).collect::<Vec<f32>>();
    let inputs = [
        (Input::Constants, constants),
        // Near rest, and far from it.
        (
            Input::DisplacementGradient,
            single(&if seed.is_multiple_of(3) { rng.gradient(0.1, 10.0) } else { rng.gradient(0.5, 2.0) }),
        ),
        (Input::GradientIncrement, single(&rng.direction())),
        (Input::NodeGradient, single(&rng.direction()[..3])),
        (Input::GradientRate, single(&rng.direction())),
    ];
    for function in PASSES.iter().filter_map(|pass| pass.function(law)) {
        let what = format!("{}, {}, seed {seed}", law.info.name, function.name);
        check(&what, &Functions::parse(function.text), ir.point(function.name), &inputs);
    }
}

#[test]
fn point_kernels_of_every_law() {
    for law in laws() {
        let ir = derivation(env!("TENSORMASS_GENERATED"), law.info.name);
        (0..STATES).for_each(|seed| check_law(law, &ir, seed));
    }
}

#[test]
fn functions_of_every_element() {
    let mut rng = Rng::new(1);
    for declaration in declarations().expect("the build has read them") {
        let entry = elements().iter().find(|e| e.info.name == declaration.name).expect("an element of this build");
        let kernels = kernels(&declaration).expect("the element is well-formed");
        let texts = entry.functions;
        let cases = [
            (&kernels.gradient, texts.gradient),
            (&kernels.contract, texts.contract),
            (&kernels.node_gradients, texts.node_gradients),
        ];
        for (kernel, text) in cases {
            let mut random = |n: u32| (0..n).map(|_| rng.uniform(-1.0, 1.0) as f32).collect::<Vec<f32>>();
            let inputs: Vec<_> = kernel.ir().inputs.iter().map(|&(role, n)| (role, random(n))).collect();
            let what = format!("{}, {}", declaration.name, kernel.ir().name);
            check(&what, &Functions::parse(text), PointKernel { near: kernel, far: None }, &inputs);
        }
    }
}

/// A kernel of three constants, with these values as outputs and the first of them as a margin.
fn kernel(values: impl FnOnce(&mut Builder, [ValueId; 3]) -> Vec<ValueId>) -> ValidKernel {
    let mut b = Builder::new();
    let inputs = [0, 1, 2].map(|k| b.input(Input::Constants, k));
    let values = values(&mut b, inputs);
    let outputs = vec![(Output::DomainMargin, vec![values[0]]), (Output::Constants, values)];
    b.finish("all", vec![(Input::Constants, 3)], outputs).validate().expect("a kernel of the test")
}

#[test]
fn every_operation() {
    let exact = kernel(|b, [x, y, z]| {
        let third = b.number(Rational::new(-1, 3));
        let (product, quotient, negative) = (b.mul(x, third), b.div(y, z), b.neg(z));
        let ops =
            [Op::Fma(x, y, z), Op::Select(x, y, z, third), Op::Select(y, x, z, third), Op::Sub(x, y), Op::Add(y, z)];
        ops.into_iter().map(|op| b.push(op)).chain([product, quotient, negative]).collect()
    });
    let functions = kernel(|b, [x, y, z]| {
        let ops = [Op::Sqrt(x), Op::Ln(y), Op::Exp(z), Op::Log1p(x), Op::Expm1(y), Op::Powf(x, z)];
        let ops = ops.into_iter().chain([Op::Log1pmx(z), Op::Expm1mx(x)]);
        ops.map(|op| b.push(op)).collect()
    });
    for kernel in [exact, functions] {
        let text = Functions::parse(&wgsl::function(&kernel));
        for values in [[1.7, 0.4, 2.3], [0.1, 3.0, -0.7]] {
            check(
                "every operation",
                &text,
                PointKernel { near: &kernel, far: None },
                &[(Input::Constants, values.to_vec())],
            );
        }
    }
}

/// The greatest error of a function over arguments as a share of what is allowed, in units in the last place of the
/// exact result.
fn worst(
    name: &str,
    arguments: impl Iterator<Item = Vec<f32>>,
    exact: impl Fn(&[f64]) -> f64,
    allowed: impl Fn(&[f64]) -> f64,
) -> f64 {
    let mut worst = 0.0f64;
    for a in arguments {
        let actual = f64::from(helper(name, &a));
        let exact_at: Vec<f64> = a.iter().map(|&x| x.into()).collect();
        let expected = exact(&exact_at);
        let unit = f64::from(f32::EPSILON) * 2f64.powi(expected.abs().log2().floor().max(-126.0) as i32);
        let error = (actual - expected).abs() / if expected == 0.0 { f64::from(f32::MIN_POSITIVE) } else { unit };
        assert!(error <= allowed(&exact_at), "{name}({a:?}) = {actual:e}, exactly {expected:e}: {error} units");
        worst = worst.max(error / allowed(&exact_at));
    }
    worst
}

/// Numbers between two, by equal steps of the numbers' bits: as many in each octave. Both have one sign.
fn octaves(low: f32, high: f32, steps: u32) -> impl Iterator<Item = f32> {
    let (from, to) = (low.to_bits().min(high.to_bits()), low.to_bits().max(high.to_bits()));
    (0..=steps).map(move |k| f32::from_bits(from + ((u64::from(to - from) * u64::from(k)) / u64::from(steps)) as u32))
}

/// Numbers between two, by equal steps.
fn evenly(low: f32, high: f32, steps: u32) -> impl Iterator<Item = f32> {
    (0..=steps).map(move |k| low + (high - low) * (k as f32 / steps as f32))
}

#[test]
fn own_functions_are_as_accurate_as_stated() {
    let one = |x: f32| vec![x];
    const N: u32 = 20_000;
    let small = || octaves(1e-30, 1.0, N).chain(octaves(-1e-30, -0.9999, N));
    let found = [
        worst(
            "ln_",
            octaves(f32::MIN_POSITIVE, f32::MAX, N).chain(evenly(0.5, 2.0, N)).map(one),
            |x| x[0].ln(),
            |_| 2.0,
        ),
        worst(
            "log1p_",
            small().chain(octaves(1.0, 1e30, N)).chain(evenly(-0.6, 1.1, N)).map(one),
            |x| x[0].ln_1p(),
            |_| 2.0,
        ),
        worst("exp_", evenly(-87.33, 88.72, N).chain(small()).map(one), |x| x[0].exp(), |_| 2.0),
        worst(
            "expm1_",
            evenly(-30.0, 88.72, N).chain(small()).chain(evenly(-1.0, 1.0, N)).map(one),
            |x| x[0].exp_m1(),
            |_| 3.0,
        ),
        worst(
            "powf_",
            [-2.0f32, -2.0 / 3.0, -1.0 / 3.0, 0.25, 0.5, 1.5, 3.0]
                .into_iter()
                .flat_map(|b| octaves(1e-12, 1e12, N / 4).chain(evenly(0.5, 2.0, N / 4)).map(move |a| vec![a, b])),
            |x| x[0].powf(x[1]),
            |x| 3.0 + 5.0 * (x[1] * x[0].ln()).abs(),
        ),
        worst(
            "log1pmx_",
            octaves(1e-15, 1e30, N).chain(octaves(-1e-15, -0.9999, N)).chain(evenly(-0.6, 1.1, N)).map(one),
            |x| Remainder::log1pmx(x[0]),
            |_| printed::LOG1PMX,
        ),
        worst(
            "expm1mx_",
            octaves(1e-15, 80.0, N).chain(octaves(-1e-15, -80.0, N)).chain(evenly(-1.1, 1.1, N)).map(one),
            |x| Remainder::expm1mx(x[0]),
            |_| printed::EXPM1MX,
        ),
    ];
    eprintln!(
        "greatest errors of ln, log1p, exp, expm1, powf, log1pmx, expm1mx as shares of what they state: {found:.2?}"
    );
    // Outside: saturation, not infinity.
    let exp = |x: f32| helper("exp_", &[x]);
    assert_eq!(exp(-1e30), 0.0);
    assert!(exp(1e30).is_finite() && exp(1e30) > 3.4e38);
}

//! What guards find in the gradients of displacements: against closed forms, and against measured errors of a linear law.

use serde_json::Value;
use tensormass_runtime::guard::Guards;
use tensormass_runtime::mesh::beam_of;
use tensormass_runtime::scene::Precision;
use tensormass_runtime::simulate::{Ending, Observer, Outcome, Sample, run};
use tensormass_runtime::step_limit::StepLimits;
use tensormass_runtime::{element, elements, law};

use super::{guard, warnings};
use crate::support::{self, CANTILEVER, body, number, parameters, scene};

/// What [`Guards`] say of a body of one law, made of two cells, with this displacement gradient everywhere.
fn homogeneous(law_name: &str, element_name: &str, g: [[f64; 3]; 3]) -> Value {
    let law = law(law_name).expect("a law of the build");
    let element = element(element_name).expect("an element of the build");
    let cells = if element.info.dimension == 2 { [2, 1, 1] } else { [2, 1, 2] };
    let mesh = beam_of(element, [1.0, 0.5, 1.0], cells, [3.0, -1.0, 0.0]).expect("a beam");
    let body = body(&mesh, law, &parameters(law), &[]);
    let u: Vec<[f64; 3]> =
        mesh.nodes().iter().map(|x| g.map(|row| row.iter().zip(x).map(|(g, x)| g * x).sum::<f64>() + 100.0)).collect();
    let mut guards = Guards::new(&body, Precision::F64, 1);
    assert!(guards.is_due(1) && !guards.is_due(0));
    guards.look(&body, &u, 1, 0.5);
    guards.to_json()
}

/// Rotation about z by an angle, minus 1.
fn turned(angle: f64) -> [[f64; 3]; 3] {
    let (s, c) = angle.sin_cos();
    [[c - 1.0, -s, 0.0], [s, c - 1.0, 0.0], [0.0; 3]]
}

/// The product of two deformations F = 1 + G, minus 1.
fn after(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let at = |g: &[[f64; 3]; 3], i: usize, k: usize| g[i][k] + f64::from(u8::from(i == k));
    std::array::from_fn(|i| {
        std::array::from_fn(|k| (0..3).map(|m| at(&a, i, m) * at(&b, m, k)).sum::<f64>() - f64::from(u8::from(i == k)))
    })
}

fn stretched(by: [f64; 3]) -> [[f64; 3]; 3] {
    [[by[0], 0.0, 0.0], [0.0, by[1], 0.0], [0.0, 0.0, by[2]]]
}

/// Homogeneous deformations on every element: a rotation R by phi has G'G = -(G + G'), so that the indicator is 1, the error
/// sin(phi/2), the small strain cos phi - 1 and the angle phi; a uniaxial stretch 1 + e has e/2 twice, e and 0; a skew G of w has
/// no strain, the error w/2 and the angle atan w. Stretches are those of U in F = R U, and the least is negative where det F is.
#[test]
fn homogeneous_deformations_have_closed_forms() {
    let pure = |w: f64| [[0.0, -w, 0.0], [w, 0.0, 0.0], [0.0; 3]];
    let plain = stretched([0.25, -0.125, 0.0]);
    for element in elements().iter().filter(|e| e.info.dimension > 1) {
        let name = element.info.name;
        let of_plain = 0.5 * 0.25_f64.powi(2).hypot(0.125_f64.powi(2)) / 0.25_f64.hypot(0.125);
        // Gradient; estimated error, indicator, greatest strain and rotation.
        for (g, [error, indicator, strain, rotation]) in [
            (turned(0.3), [0.15_f64.sin(), 1.0, 1.0 - 0.3_f64.cos(), 0.3]),
            (turned(-2.5), [1.25_f64.sin(), 1.0, 1.0 - 2.5_f64.cos(), 2.5]),
            (stretched([0.25, 0.0, 0.0]), [0.125, 0.125, 0.25, 0.0]),
            (stretched([-0.25, 0.0, 0.0]), [0.125, 0.125, 0.25, 0.0]),
            (pure(0.5), [0.25, 1e3, 0.0, 0.5_f64.atan()]),
            (plain, [of_plain, of_plain, 0.25, 0.0]),
        ] {
            let found = &homogeneous("hooke", name, g)["linear"];
            let close = |value: &Value, wanted: f64| (number(value) - wanted).abs() < 1e-11 * wanted.max(1.0);
            assert!(close(&found["indicator"], indicator), "{name}, {g:?}: {found}");
            assert!(close(&found["greatest_strain"]["value"], strain), "{name}, {g:?}: {found}");
            assert!(close(&found["greatest_rotation_rad"]["value"], rotation), "{name}, {g:?}: {found}");
            assert!(close(&found["estimated_error"], error), "{name}, {g:?}: {found}");
            assert_eq!(number(&found["time_s"]), 0.5);
        }
        for (g, [least, greatest]) in [
            (turned(0.3), [1.0, 1.0]),
            (plain, [0.875, 1.25]),
            (after(turned(2.0), plain), [0.875, 1.25]),
            (after(plain, turned(2.0)), [0.875, 1.25]),
            (stretched([1e-7, -2e-7, 0.0]), [1.0 - 2e-7, 1.0 + 1e-7]),
            (after(turned(1.0), stretched([-1.5, 0.0, 0.0])), [-0.5, 1.0]),
        ] {
            let found = &homogeneous("st_venant_kirchhoff", name, g)["stretches"][0];
            let close = |value: &Value, wanted: f64| (number(value) - wanted).abs() < 1e-12;
            assert!(close(&found["least"]["value"], least), "{name}, {g:?}: {found}");
            assert!(close(&found["greatest"]["value"], greatest), "{name}, {g:?}: {found}");
        }
    }
}

/// One element of many that is strained is the one that is named, the latest of equals is not, and the greatest of several
/// states is kept.
#[test]
fn the_worst_element_and_time_are_named() {
    let svk = law("st_venant_kirchhoff").expect("a law of the build");
    let mesh =
        beam_of(element("tetrahedron_p1").expect("an element"), [12.0, 12.0, 12.0], [12; 3], [0.0; 3]).expect("a beam");
    let body = body(&mesh, svk, &parameters(svk), &[]);
    let mut guards = Guards::new(&body, Precision::F64, 3);
    // The corner belongs to one element alone, or to a few: which have it by themselves?
    let corner = mesh.nodes().iter().position(|x| *x == [12.0, 0.0, 0.0]).expect("a corner");
    let owners: Vec<u64> =
        body.elements.iter().enumerate().filter(|(_, n)| n.contains(&(corner as u32))).map(|(e, _)| e as u64).collect();
    for (step, by) in [(1, 0.1), (2, 0.5), (3, 0.2)] {
        let mut u = vec![[0.0; 3]; mesh.nodes().len()];
        u[corner] = [by, 0.0, 0.0];
        guards.look(&body, &u, step, step as f64);
    }
    let found = &guards.to_json()["stretches"][0];
    let greatest = &found["greatest"];
    assert!(owners.contains(&greatest["element"].as_u64().expect("a number")), "{owners:?}: {found}");
    assert_eq!(number(&greatest["time_s"]), 2.0);
    assert_eq!(guards.after().len(), 1, "{found}");
}

/// What grows slowly is followed: bounds that save eigenvalues leave out nothing.
#[test]
fn slow_growth_is_followed() {
    let mesh = beam_of(element("tetrahedron_p1").expect("an element"), [1.0; 3], [1; 3], [0.0; 3]).expect("a beam");
    for sign in [1.0, -1.0] {
        let [mut linear, mut finite] = ["hooke", "st_venant_kirchhoff"].map(|name| {
            let law = law(name).expect("a law of the build");
            let body = body(&mesh, law, &parameters(law), &[]);
            (Guards::new(&body, Precision::F64, 100), body)
        });
        for step in 1..=100 {
            let strain = 0.002 * step as f64;
            let u: Vec<[f64; 3]> = mesh.nodes().iter().map(|x| [0.0, sign * strain * x[1], 0.0]).collect();
            for (guards, body) in [&mut linear, &mut finite] {
                guards.look(body, &u, step, step as f64);
            }
            let of_linear = &linear.0.to_json()["linear"]["greatest_strain"];
            let of_finite = &finite.0.to_json()["stretches"][0][if sign > 0.0 { "greatest" } else { "least" }];
            for (found, wanted) in [(of_linear, strain), (of_finite, 1.0 + sign * strain)] {
                assert!((number(&found["value"]) - wanted).abs() < 1e-12, "{strain}: {found}");
                assert_eq!(number(&found["time_s"]), step as f64);
            }
        }
    }
}

/// However many steps are recorded, at most 16 are looked at, evenly; of few, each.
#[test]
fn looks_are_few() {
    let hooke = law("hooke").expect("a law of the build");
    let mesh = beam_of(element("tetrahedron_p1").expect("an element"), [1.0; 3], [1; 3], [0.0; 3]).expect("a beam");
    let body = body(&mesh, hooke, &parameters(hooke), &[]);
    let u = vec![[0.0; 3]; mesh.nodes().len()];
    for (steps, every, looks) in
        [(10, 1, 10), (16, 1, 16), (17, 1, 16), (100_000, 1, 16), (100_000, 50_000, 2), (u64::MAX, u64::MAX / 4, 5)]
    {
        let mut guards = Guards::new(&body, Precision::F64, steps);
        let mut found = 0;
        let mut step = 0;
        while step < steps {
            step = step.saturating_add(every).min(steps);
            if guards.is_due(step) {
                guards.look(&body, &u, step, 1.0);
                found += 1;
            }
        }
        assert_eq!((found, guards.is_due_at_end(steps)), (looks, false), "{steps} steps, each {every}");
    }
    // A body of other laws is not looked at.
    let other = law("neo_hookean").expect("a law of the build");
    let guards = Guards::new(&support::body(&mesh, other, &parameters(other), &[]), Precision::F64, 10);
    assert!(!guards.is_due(5) && !guards.is_due_at_end(10));
}

/// Keeps the displacements of the last state.
#[derive(Default)]
struct Last(Vec<[f64; 3]>);

impl Observer for Last {
    fn warning(&mut self, _: &str) {}
    fn limits(&mut self, _: StepLimits) {}
    fn progress(&mut self, _: u64, _: u64) {}
    fn interrupted(&self) -> bool {
        false
    }
    fn samples(&self, steps: u64) -> Vec<u64> {
        vec![steps]
    }
    fn sample(&mut self, sample: Sample) {
        self.0 = sample.displacement;
    }
}

/// The equilibrium of a bent beam of a law, and its nodes' displacements.
fn bent(length: u32, load: f64, law: &str) -> (Outcome, Vec<[f64; 3]>) {
    let set = [
        format!("mesh.beam.size=[{length}, 1, 1]"),
        format!("mesh.beam.cells=[{length}, 1, 1]"),
        "mesh.beam.element=hexahedron_s2".to_owned(),
        format!("material.0.law={law}"),
        // The slope at the tip that linear theory gives is 1.2 degrees for a load of 35 Pa.
        format!("load.0.value=[0.0, 0.0, {:?}]", load * (10.0 / f64::from(length)).powi(2)),
        "load.0.ramp=[[0.0, 0.0], [1.0, 1.0]]".to_owned(),
        "solver.duration=1.0".to_owned(),
        "solver.step=0.25".to_owned(),
        "solver.newton.tolerance=1e-7".to_owned(),
    ];
    let mut last = Last::default();
    let outcome = run(&scene(CANTILEVER, &set), None, &mut last).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(outcome.ending, Ending::Done, "{length}, {load}, {law}");
    (outcome, last.0)
}

/// What is estimated of a linear law is what a law of large deformation shows, within a factor of two, of stout beams and slender
/// ones, at 1, 12 and 56 degrees. A beam of 4:1 at 1.2 degrees is wrong by .7 %, at 12 degrees by 7 %.
#[test]
fn a_linear_laws_error_is_estimated() {
    for length in [2, 4, 10, 20] {
        for load in [35.0, 350.0, 2500.0] {
            let (outcome, linear) = bent(length, load, "hooke");
            let (_, finite) = bent(length, load, "neo_hookean");
            let norm =
                |x: &mut dyn Iterator<Item = [f64; 3]>| x.map(|x| x.iter().map(|x| x * x).sum::<f64>()).sum::<f64>();
            let mut off = linear.iter().zip(&finite).map(|(a, b)| std::array::from_fn(|i| a[i] - b[i]));
            let error = (norm(&mut off) / norm(&mut finite.iter().copied())).sqrt();
            let found = guard(&outcome, "linear");
            let ratio = number(&found["estimated_error"]) / error;
            eprintln!("{length}:1, load {load}: error {error:.4}, estimated {ratio:.2} times as large, {found}");
            assert!((0.5..2.0).contains(&ratio), "{length}:1, load {load}: error {error:.4}, {found}");
        }
    }
}

/// A linear law's guard is linear in the load: it warns just above the load at which it reaches its threshold, and not just below.
#[test]
fn a_linear_law_is_warned_of_from_its_threshold_on() {
    let at = |load: f64| bent(4, load, "hooke").0;
    let found = at(35.0);
    let limit =
        35.0 * number(&guard(&found, "linear")["threshold"]) / number(&guard(&found, "linear")["estimated_error"]);
    let words = "law `hooke` is linear and holds for small rotations and strains only: at 1.0000 s displacements are wrong by about 1 %";
    assert_eq!(warnings(&at(1.001 * limit), words).len(), 1);
    assert_eq!(warnings(&at(0.999 * limit), "is linear"), [""; 0]);
    let cure = "take a law of large deformation (";
    assert_eq!(warnings(&at(2.0 * limit), cure).len(), 1);
}

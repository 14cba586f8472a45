//! Guards: their values against closed forms and measured errors, and that each warns where it has to and nowhere else.

mod gradients;
mod residual;

use serde_json::Value;
use tensormass_runtime::simulate::{Ending, Outcome};

use crate::support::{self, done, number, scene};

/// A block between rollers, pulled along x: its strain is the same everywhere.
const BLOCK: &str = r#"
[mesh]
beam = { size = [1, 1, 1], cells = [2, 2, 2] }

[[material]]
law = "st_venant_kirchhoff"
density = 1000.0
parameters = { young = 1e6, poisson = 0.3 }

[[boundary]]
nodes = "near(x, xmin)"
fix = ["x"]

[[boundary]]
nodes = "near(y, ymin)"
fix = ["y"]

[[boundary]]
nodes = "near(z, zmin)"
fix = ["z"]

[[boundary]]
nodes = "near(x, xmax)"
move = { x = { ramp = [[0.0, 0.0], [1.0, 0.01]] } }

[solver]
integrator = "static"
"#;

/// A beam that sags, stepped implicitly, one linear solution a step.
const SAGGING: &str = r#"
[mesh]
beam = { size = [4, 1, 1], cells = [8, 2, 2] }

[[material]]
law = "hooke"
density = 1000.0
parameters = { young = 1e7, poisson = 0.3 }

[[boundary]]
nodes = "near(x, xmin)"
fix = ["x", "y", "z"]

[[load]]
kind = "gravity"
acceleration = [0.0, 0.0, -9.81]

[solver]
integrator = "implicit-euler"
step = 0.05
duration = 0.5
newton = { max_iterations = 1 }

[output]
frames = 5
"#;

/// A beam that sags in equilibrium, its outer half of another material.
const HALVES: &str = r#"
[mesh]
beam = { size = [4, 1, 1], cells = [4, 2, 2] }

[[material]]
law = "neo_hookean"
density = 1000.0
parameters = { young = 1e6, poisson = 0.3 }
elements = "x < 2"

[[material]]
law = "neo_hookean"
density = 1000.0
parameters = { young = 1e6, poisson = 0.3 }
elements = "x > 2"

[[boundary]]
nodes = "near(x, xmin)"
fix = ["x", "y", "z"]

[[load]]
kind = "gravity"
acceleration = [0.0, 0.0, -1.0]

[solver]
integrator = "static"
precision = "f32"
newton = { tolerance = 1e-6 }
"#;

fn guard<'a>(outcome: &'a Outcome, name: &str) -> &'a Value {
    &outcome.summary["guards"][name]
}

/// The warnings with these words.
fn warnings<'a>(outcome: &'a Outcome, words: &str) -> Vec<&'a String> {
    outcome.warnings.iter().filter(|w| w.contains(words)).collect()
}

/// A guard in a scene: what its warning says, settings in which it warns, and others just below its threshold.
struct Case {
    guard: &'static str,
    words: &'static str,
    text: &'static str,
    beyond: &'static [&'static str],
    below: &'static [&'static str],
}

const CASES: &[Case] = &[
    Case {
        guard: "stretches",
        words: "is trusted from 0.8 to 1.3; take a law of larger strains (",
        text: BLOCK,
        beyond: &["boundary.3.move.x.ramp=[[0.0, 0.0], [1.0, 0.3001]]"],
        below: &["boundary.3.move.x.ramp=[[0.0, 0.0], [1.0, 0.2999]]"],
    },
    Case {
        guard: "stretches",
        words: "is trusted from 0.8 to 1.3",
        text: BLOCK,
        beyond: &["boundary.3.move.x.ramp=[[0.0, 0.0], [1.0, -0.2001]]"],
        below: &["boundary.3.move.x.ramp=[[0.0, 0.0], [1.0, -0.1999]]"],
    },
    Case {
        guard: "rounding",
        words: "so nearly incompressible",
        text: BLOCK,
        // lambda/mu = 2 nu / (1 - 2 nu): 846 and 832, times 1.19e-7.
        beyond: &["solver.precision=f32", "material.0.parameters.poisson=0.49941"],
        below: &["solver.precision=f32", "material.0.parameters.poisson=0.4994"],
    },
    Case {
        guard: "rounding",
        words: "take solver.precision = \"f64\", or a smaller bulk modulus",
        text: BLOCK,
        beyond: &["solver.precision=f32", "material.0.parameters.poisson=0.4999"],
        below: &["solver.precision=f64", "material.0.parameters.poisson=0.4999"],
    },
    Case {
        guard: "locking",
        words: "`tetrahedron_p1` lock where volume hardly changes",
        text: BLOCK,
        beyond: &["material.0.parameters.poisson=0.4501"],
        below: &["material.0.parameters.poisson=0.4499"],
    },
    Case {
        guard: "locking",
        words: "take elements of another kind (hexahedron_q1, hexahedron_s2, tetrahedron_p2)",
        text: BLOCK,
        beyond: &["material.0.parameters.poisson=0.49"],
        below: &["material.0.parameters.poisson=0.49", "mesh.beam.element=hexahedron_q1"],
    },
    Case {
        guard: "locking",
        words: "take elements of another kind (quadrangle_q1, quadrangle_s2, triangle_p2)",
        text: BLOCK,
        beyond: &["material.0.parameters.poisson=0.46", "mesh.beam.element=triangle_p1", "mesh.beam.cells=[2, 2, 1]"],
        below: &["material.0.parameters.poisson=0.46", "mesh.beam.element=triangle_p2", "mesh.beam.cells=[2, 2, 1]"],
    },
    Case {
        guard: "inverted",
        words: "elements are inside out",
        text: BLOCK,
        beyond: &["material.0.law=hooke", "boundary.3.move.x.ramp=[[0.0, 0.0], [1.0, -1.001]]"],
        below: &["material.0.law=hooke", "boundary.3.move.x.ramp=[[0.0, 0.0], [1.0, -0.999]]"],
    },
    Case {
        guard: "residual",
        words: "displacements of the equilibrium are off by about",
        text: HALVES,
        beyond: &["material.1.parameters.young=1e10", "solver.newton.tolerance=1e-3"],
        below: &["material.1.parameters.young=1e6", "solver.newton.tolerance=1e-3"],
    },
    Case {
        // St Venant-Kirchhoff's energy is not convex below a stretch of 0.58.
        guard: "curvature",
        words: "met a direction of negative curvature",
        text: SAGGING,
        beyond: &["material.0.law=st_venant_kirchhoff", "initial.gradient=[[0, 0, 0], [0, 0, 0], [0, 0, -0.6]]"],
        below: &["material.0.law=st_venant_kirchhoff", "initial.gradient=[[0, 0, 0], [0, 0, 0], [0, 0, -0.01]]"],
    },
    Case {
        guard: "linear",
        words: "is linear and holds for small rotations and strains only",
        text: SAGGING,
        beyond: &["material.0.parameters.young=1e6"],
        below: &["material.0.parameters.young=1e6", "material.0.law=neo_hookean"],
    },
];

#[test]
fn guards_warn_beyond_their_thresholds_and_not_below() {
    for Case { guard: name, words, text, beyond, below } in CASES {
        let outcome = done(&scene(text, beyond));
        assert_eq!(warnings(&outcome, words).len(), 1, "{beyond:?}: {:?}", outcome.warnings);
        assert!(!guard(&outcome, name).is_null(), "{name}: {}", outcome.summary["guards"]);
        assert_eq!(outcome.summary["warnings"], serde_json::json!(outcome.warnings));
        let silent = done(&scene(text, below));
        assert_eq!(warnings(&silent, words), [""; 0], "{below:?}");
    }
}

/// An explicit step of this part of the critical one.
fn stepped(part: f64) -> Outcome {
    let set = [
        "solver.integrator=semi-implicit-euler".to_owned(),
        "solver.step=1e-4".to_owned(),
        "solver.duration=1e-3".to_owned(),
    ];
    let limit = done(&scene(SAGGING, &set)).limits.expect("explicit runs have limits").power;
    let set = [
        set[0].clone(),
        format!("solver.step={:?}", part * limit),
        format!("solver.duration={:?}", 3.5 * part * limit),
    ];
    done(&scene(SAGGING, &set))
}

#[test]
fn explicit_steps_are_measured_by_the_critical_one() {
    for (part, warned) in [(0.25, 0), (0.999, 0), (1.001, 1)] {
        let outcome = stepped(part);
        let found = guard(&outcome, "step");
        assert!((number(&found["over_critical"]) - part).abs() < 1e-9, "{found}");
        assert_eq!(warnings(&outcome, "is above the critical step").len(), warned, "{part}");
    }
    let implicit = done(&scene::<&str>(SAGGING, &[]));
    assert!(guard(&implicit, "step").is_null());
}

/// States of a simulation that blew up say nothing of its laws.
#[test]
fn a_blow_up_is_not_the_laws_fault() {
    let set = ["solver.integrator=semi-implicit-euler", "solver.step=0.05", "solver.duration=5.0"];
    let outcome = support::outcome(&scene(SAGGING, &set));
    assert!(matches!(outcome.ending, Ending::Failed(_)));
    assert_eq!(warnings(&outcome, "is linear"), [""; 0]);
    assert!(!guard(&outcome, "linear").is_null());
}

/// A device's states are judged like the CPU's.
#[cfg(feature = "gpu")]
#[test]
fn a_device_is_judged_alike() {
    use std::sync::Arc;
    use tensormass_runtime::gpu::GpuOptions;
    use tensormass_runtime::simulate::{Silent, run_on};
    use tensormass_runtime::target::Target;
    let Some(gpu) = support::gpu::test_device() else { return };
    let target = Target::Gpu(Arc::clone(&gpu), GpuOptions::default());
    for (text, set) in [
        (SAGGING, &["material.0.parameters.young=1e6"][..]),
        (SAGGING, &["solver.integrator=central-difference", "solver.step=1e-3", "solver.duration=0.3"]),
        (BLOCK, &["boundary.3.move.x.ramp=[[0.0, 0.0], [1.0, 0.4]]", "material.0.parameters.poisson=0.46"]),
    ] {
        let mut set: Vec<&str> = set.to_vec();
        set.push("solver.precision=f32");
        let scene = scene(text, &set);
        let device = run_on(&target, &scene, None, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
        let host = done(&scene);
        assert_eq!(device.ending, Ending::Done);
        let alike = |a: &Value, b: &Value| (number(a) - number(b)).abs() <= 1e-3 * number(b).abs();
        for (guard_name, keys) in [
            ("linear", &["estimated_error", "indicator", "/greatest_strain/value", "/greatest_rotation_rad/value"][..]),
            ("stretches", &["/0/least/value", "/0/greatest/value"]),
            ("rounding", &["estimated_error"]),
            ("locking", &["poisson"]),
            ("step", &["over_critical"]),
        ] {
            let [a, b] = [&device, &host].map(|outcome| guard(outcome, guard_name));
            let at = |v: &Value, key: &str| v.pointer(key).or_else(|| v.get(key)).cloned();
            for key in keys {
                match (at(a, key), at(b, key)) {
                    (Some(a), Some(b)) => assert!(alike(&a, &b), "{set:?}, {guard_name}, {key}: {a} and {b}"),
                    (a, b) => assert_eq!(a, b, "{set:?}, {guard_name}, {key}"),
                }
            }
        }
        assert_eq!(guard(&device, "residual").is_null(), guard(&host, "residual").is_null());
        // A software device is warned of besides.
        let own = target.warning();
        let words = |outcome: &Outcome| {
            let guards = outcome.warnings.iter().filter(|w| own.as_ref() != Some(*w));
            guards.map(|w| w[..12].to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(words(&device), words(&host), "{set:?}");
    }
}

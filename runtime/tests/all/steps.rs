//! Critical steps: both limits against DT_2012 and against each other, and what a run does just below and above them.

use std::fs;

use crate::support::{self, Random, body, case, number, numbers, parameters, scene, system};
use serde_json::Value;
use tensormass_runtime::backend::Backend;
use tensormass_runtime::laws;
use tensormass_runtime::mesh::{Groups, Mesh, beam};
use tensormass_runtime::model::build;
use tensormass_runtime::simulate::{Ending, Observer, run};
use tensormass_runtime::step_limit::{StepLimits, element_limit, power_limit};
use tensormass_runtime::system::SolveError;

const FIXED_ENDS: &str = r#"
[mesh]
beam = { size = [5, 1, 1], cells = [1, 1, 1] }

[[material]]
law = "hooke"
density = 1000.0
parameters = { young = 1e8, poisson = 0.3 }

[[boundary]]
nodes = "near(x, xmin) || near(x, xmax)"
fix = ["x", "y", "z"]

# A blow on one node: it excites short waves too.
[[load]]
kind = "force"
nodes = "near(x, 2.5) && near(y, ymin) && near(z, zmin)"
value = [1e4, 2e4, 3e4]
ramp = [[0.0, 1.0], [1e-3, 0.0]]

[solver]
integrator = "central-difference"
step = 1e-5
duration = 1e-5

[[probe]]
name = "largest"
kind = "displacement"
nodes = "all"
component = "magnitude"
statistic = "max"
"#;

/// One case of DT_2012. The element bound is an eigenvalue of a 9 x 9 matrix, wanted to 1e-6; the power iteration is
/// wanted to 1 % and ends when it moves by 1e-4.
fn check(c: &Value) {
    let cells = numbers::<3>(&c["mesh"]).map(|x| x as u32);
    let poisson = number(&c["nu"]);
    let set = [format!("mesh.beam.cells={cells:?}"), format!("material.0.parameters.poisson={poisson:?}")];
    let scene = scene(&FIXED_ENDS.replace("near(x, 2.5)", "near(x, xmin)"), &set);
    let model = build(&scene).unwrap_or_else(|e| panic!("{e}"));
    let element = element_limit(&model.body) * model.scale.time;
    let mut system = system::<f64>(model.body);
    let rest = system.backend.zeros();
    let power = power_limit(&mut system, &rest) * model.scale.time;
    let error = |value: f64, key: &str| value / number(&c[key]) - 1.0;
    let (of_power, of_element) = (error(power, "dt_crit"), error(element, "dt_element"));
    println!("{cells:?}, nu {poisson}: power {of_power:.1e}, element {of_element:.1e}");
    assert!(of_power.abs() <= 0.01, "{cells:?}, nu {poisson}: power iteration {power:.6e} s is off by {of_power:.1e}");
    assert!(
        of_element.abs() <= 1e-6,
        "{cells:?}, nu {poisson}: element bound {element:.6e} s is off by {of_element:.1e}"
    );
}

#[test]
fn limits_of_the_2012_beam() {
    for c in case("DT_2012")["expected"].as_array().expect("a list") {
        check(c);
    }
}

/// The largest element eigenvalue bounds that of the body, whatever the mesh and the supports (Irons and Treharne); the
/// power iteration approaches its value from below. So the order is strict but for rounding.
#[test]
fn the_element_bound_is_below_the_limit() {
    for law in laws() {
        for seed in 0..8 {
            let mut random = Random(seed);
            let regular = beam([1.0, 0.7, 0.4], [3, 2, 2], [0.0; 3]).expect("a beam");
            let moved = regular.nodes().iter().map(|p| {
                let d = random.vector(0.04);
                std::array::from_fn(|c| p[c] + d[c])
            });
            let mesh =
                Mesh::tetrahedra(moved.collect(), regular.tets().to_vec(), Groups::default()).expect("a valid mesh");
            let nodes = mesh.nodes().len() as u32;
            let fixed: Vec<_> = (0..nodes).filter(|n| (u64::from(*n) * 7 + seed) % 5 < seed % 3).collect();
            let fixed: Vec<_> = fixed.iter().flat_map(|&n| (0..3).map(move |c| (n, c, 0.0))).collect();
            let body = body(&mesh, law, &parameters(law), &fixed);
            let element = element_limit(&body);
            let mut system = system::<f64>(body);
            let rest = system.backend.zeros();
            let power = power_limit(&mut system, &rest);
            let ratio = element / power;
            assert!(ratio <= 1.0 + 1e-12 && ratio > 0.4, "{}, seed {seed}: {element:e} / {power:e}", law.info.name);
        }
    }
}

/// Notes in which order things are told.
#[derive(Default)]
struct Listener {
    told: Vec<String>,
    limits: Option<StepLimits>,
    steps: u64,
}

impl Observer for Listener {
    fn warning(&mut self, text: &str) {
        self.told.push(format!("step {}: {text}", self.steps));
    }
    fn limits(&mut self, limits: StepLimits) {
        self.limits = Some(limits);
    }
    fn progress(&mut self, step: u64, _: u64) {
        self.steps = step;
    }
    fn interrupted(&self) -> bool {
        false
    }
}

/// Runs at a fraction of the power limit for up to 3000 steps.
fn run_at(fraction: f64, integrator: &str) {
    let mut set = vec![format!("solver.integrator={integrator}"), "mesh.beam.cells=[10, 2, 2]".to_owned()];
    let limits = support::done(&scene(FIXED_ENDS, &set)).limits.expect("explicit runs have limits");
    let step = fraction * limits.power;
    set.extend([format!("solver.step={step:?}"), format!("solver.duration={:?}", 3000.0 * step)]);
    set.push("output.every=10".to_owned());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut listener = Listener::default();
    let outcome = run(&scene(FIXED_ENDS, &set), Some(folder.path()), &mut listener).unwrap_or_else(|e| panic!("{e}"));
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let summary: Value = serde_json::from_str(&read("summary.json")).expect("summary.json is JSON");
    let rows = read("probes.csv").lines().count() - 1;
    let frames = read("frames.pvd").matches("<DataSet").count();
    let largest = support::probe(&outcome, "largest");
    println!("{integrator} at {fraction}: {rows} rows, {frames} frames, largest {largest:.1e} m, {:?}", outcome.ending);
    assert_eq!(listener.limits, Some(limits));
    if fraction < 1.0 {
        assert_eq!(outcome.ending, Ending::Done);
        assert_eq!((listener.told.as_slice(), summary["status"].as_str()), (&[][..], Some("done")));
        // A blow of 19 N s on a beam of 5 t: anything near 1 m has grown by itself.
        assert!(largest < 1.0, "{integrator} at {fraction}: the beam moves {largest} m");
        assert_eq!(rows, 3001);
    } else {
        assert!(matches!(outcome.ending, Ending::Failed(SolveError::Diverged { .. })), "{:?}", outcome.ending);
        // Told before the first step, with both limits.
        assert_eq!(listener.told.len(), 1, "{:?}", listener.told);
        let numbers = [step, limits.power, limits.element].map(|x| format!("{x:.4e} s"));
        assert!(listener.told[0].starts_with("step 0: the step "), "{}", listener.told[0]);
        assert!(numbers.iter().all(|n| listener.told[0].contains(n)), "{} lacks one of {numbers:?}", listener.told[0]);
        assert_eq!(summary["status"], "failed");
        assert!(summary["error"].as_str().is_some_and(|e| e.starts_with("the simulation diverged")), "{summary}");
        // Every step but the last, which is the one that was refused; a frame each ten, the first and the last.
        let steps = summary["steps"].as_u64().expect("a number") as usize;
        // The fastest mode grows by 1.49 a step; from rounding (1e-16 m) to 1e4 times the body takes at most 120.
        assert!((10..150).contains(&steps), "{steps} steps");
        assert_eq!((rows, frames), (steps, (steps - 1) / 10 + 2));
    }
}

#[test]
fn stable_below_and_unstable_above_the_limit() {
    for integrator in ["central-difference", "semi-implicit-euler"] {
        for fraction in [0.98, 1.02] {
            run_at(fraction, integrator);
        }
    }
}

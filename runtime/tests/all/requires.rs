//! Only what a scene requires: what is left out of a scene has no kernel, no buffer, no vector and no dispatch, on the CPU and
//! on a GPU; and plans say what runs hold.

use std::path::Path;

use crate::support::{self, parameters, scene, table, viscous};
use serde_json::Value;
use tensormass_runtime::backend::Backend;
use tensormass_runtime::cpu::{CpuBackend, CpuField};
use tensormass_runtime::integrate::CentralDifference;
use tensormass_runtime::inventory::Inventory;
use tensormass_runtime::law;
use tensormass_runtime::model::build;
use tensormass_runtime::plan::{Layout, Plan};
use tensormass_runtime::scene::Scene;
use tensormass_runtime::simulate::{Ending, Silent, run_on};
use tensormass_runtime::step_limit::power_limit;
use tensormass_runtime::system::{Integrator, System};
use tensormass_runtime::target::Target;

/// The buffer of vectors.
const VECTORS: &str = "vectors over the nodes";

/// What a run held and ran, as its summary says.
struct Ran {
    summary: Value,
    plan: Plan,
    nodes: usize,
    on_gpu: bool,
}

impl Ran {
    fn new(target: &Target, scene: &Scene) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let out = (scene.output.frames != Some(0)).then(|| folder.path().join("out"));
        let outcome = run_on(target, scene, out.as_deref(), &mut Silent).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(outcome.ending, Ending::Done, "{}", outcome.summary["error"]);
        let model = build(scene).unwrap_or_else(|e| panic!("{e}"));
        let on_gpu = !matches!(target, Target::Cpu);
        let layout = if on_gpu { Layout::Gpu } else { Layout::Cpu };
        let nodes = model.mesh.nodes().len();
        Self { plan: Plan::new(scene, &model, layout), summary: outcome.summary, nodes, on_gpu }
    }

    /// How often the kernels of a name ran; none where there is none.
    fn runs(&self, kernel: &str) -> Option<u64> {
        let all = self.summary["inventory"]["kernel_runs"].as_object().expect("kernels");
        let is_of = |name: &String| name.strip_prefix(kernel).is_some_and(|n| n.is_empty() || n.starts_with(':'));
        let of: Vec<u64> = all.iter().filter(|(name, _)| is_of(name)).filter_map(|(_, runs)| runs.as_u64()).collect();
        (!of.is_empty()).then(|| of.iter().sum())
    }

    /// The bytes of a buffer; none where there is none.
    fn bytes(&self, buffer: &str) -> Option<usize> {
        self.summary["inventory"]["buffers_bytes"][buffer].as_u64().map(|bytes| bytes as usize)
    }

    /// Vectors that are held after the last step; on a GPU with those that are kept for others to come.
    fn vectors(&self) -> usize {
        let real = if self.summary["precision"] == "f32" { 4 } else { 8 };
        let each = self.nodes * if self.on_gpu { 16 } else { 3 * real };
        let bytes = self.summary["inventory"]["held_bytes"][VECTORS].as_u64().expect("vectors") as usize;
        assert_eq!(bytes % each, 0, "whole vectors");
        bytes / each
    }

    #[cfg(feature = "gpu")]
    fn count(&self, what: &str) -> u64 {
        self.summary["device_counts"][what].as_u64().expect("a device counts")
    }

    /// The plan's buffers are those of the run: not one more, not one less, and with the same bytes. Of what is only made
    /// where something is met, or does not suffice, a plan says the most, and of a matrix the part that no filling adds to.
    fn check_plan(&self, name: &str, contact: bool) {
        let held = self.summary["inventory"]["buffers_bytes"].as_object().expect("buffers");
        for (buffer, planned) in &self.plan.buffers {
            let found = self.bytes(buffer).unwrap_or(0);
            let (least, most) = match *buffer {
                "assembled tangent" => (*planned, planned + planned / 4),
                VECTORS | "held nodes" | "results" if contact => (0, *planned),
                // Two for corrections, if the first solution of linear equations in f32 is not good enough.
                VECTORS if self.on_gpu => (planned - 2 * 16 * self.nodes, *planned),
                _ => (*planned, *planned),
            };
            assert!((least..=most).contains(&found), "{name}: {found} bytes of {buffer}, planned are {planned}");
        }
        for buffer in held.keys() {
            assert!(self.plan.buffers.iter().any(|(n, _)| n == buffer), "{name}: {buffer} is not planned");
        }
        if !self.on_gpu && !contact {
            assert_eq!(self.vectors(), self.plan.vectors[0], "{name}: vectors from step to step");
        }
        let allocated = self.summary["inventory"]["allocated_bytes"].as_u64().expect("bytes");
        let sum: u64 = held.values().filter_map(Value::as_u64).sum();
        assert!(allocated <= sum && allocated > 0, "{name}: {allocated} bytes at once, {sum} in all");
    }
}

/// A scene with something and the same scene without it.
struct Case {
    name: &'static str,
    with: String,
    without: String,
    /// Kernels that run with it, and do not exist without.
    kernels: &'static [&'static str],
    /// Those of a GPU, which may have others.
    gpu_kernels: &'static [&'static str],
    /// Buffers that are held with it, and not without.
    buffers: &'static [&'static str],
    gpu_buffers: &'static [&'static str],
    /// Vectors over the nodes that it takes on a CPU, and on a GPU.
    vectors: [usize; 2],
}

fn check(target: &Target, case: &Case) {
    let on_gpu = !matches!(target, Target::Cpu);
    let name = format!("{}, {}", case.name, target.name());
    let ran = |text: &str| {
        let set: &[&str] = if on_gpu { &["solver.precision=f32"] } else { &[] };
        let scene = scene(text, set);
        let ran = Ran::new(target, &scene);
        ran.check_plan(&name, !scene.obstacle.is_empty());
        ran
    };
    let (with, without) = (ran(&case.with), ran(&case.without));
    let (kernels, buffers) = if on_gpu { (case.gpu_kernels, case.gpu_buffers) } else { (case.kernels, case.buffers) };
    for kernel in kernels {
        assert!(with.runs(kernel).is_some_and(|runs| runs > 0), "{name}: {kernel} does not run");
        assert_eq!(without.runs(kernel), None, "{name}: {kernel} is there without it");
    }
    for buffer in buffers {
        assert!(with.bytes(buffer).is_some(), "{name}: no {buffer}");
        assert_eq!(without.bytes(buffer), None, "{name}: {buffer} without it");
    }
    let vectors = case.vectors[usize::from(on_gpu)];
    assert_eq!(with.vectors(), without.vectors() + vectors, "{name}: vectors over the nodes");
}

/// A beam of a law, in some parts of a scene's text.
fn beam(law_name: &str, parts: &[&str]) -> String {
    let entry = law(law_name).expect("a law of this build");
    let values = if entry.damping.is_some() { viscous(entry, 3e3) } else { parameters(entry) };
    format!(
        "[mesh]\nbeam = {{ size = [4, 1, 1], cells = [8, 2, 2] }}\n[[material]]\nlaw = \"{law_name}\"\n\
         density = 1000.0\nparameters = {}\n{}\n",
        table(entry, &values),
        parts.join("\n")
    )
}

const CLAMPED: &str = "[[boundary]]\nnodes = \"near(x, xmin)\"\nfix = [\"x\", \"y\", \"z\"]";
const MOVED: &str = "[[boundary]]\nnodes = \"near(x, xmax)\"\nmove = { y = { ramp = [[0.0, 0.0], [0.05, 0.1]] } }";
const FALLS: &str = "[[load]]\nkind = \"gravity\"\nacceleration = [0, 0, -9.81]";
const PRESSED: &str = "[[load]]\nkind = \"pressure\"\nfaces = \"near(z, zmax)\"\nvalue = 100.0";
const SILENT: &str = "[output]\nframes = 0\nprobe_every = 20";
const EXPLICIT: &str =
    "[solver]\nintegrator = \"semi-implicit-euler\"\nprecision = \"f64\"\nstep = 5e-4\nduration = 0.01";
const IMPLICIT: &str = "[solver]\nintegrator = \"implicit-euler\"\nprecision = \"f64\"\nstep = 0.01\nduration = 0.03\n\
                        cg = { tolerance = 1e-6, tangent = \"stored\" }\nnewton = { tolerance = 1e-4, max_iterations = 20 }";
const LINEARISED: &str = "[solver]\nintegrator = \"implicit-euler\"\nprecision = \"f64\"\nstep = 0.01\nduration = 0.03\n\
                          cg = { tolerance = 1e-6, tangent = \"stored\" }\nnewton = { max_iterations = 1 }";
const STATIC: &str = "[solver]\nintegrator = \"static\"\nprecision = \"f64\"\n\
                      cg = { tolerance = 1e-6, tangent = \"stored\" }\nnewton = { tolerance = 1e-4, max_iterations = 20 }";
const FLOOR: &str = "[[obstacle]]\nshape = { plane = { point = [0, 0, -0.001], normal = [0, 0, 1] } }";
const FAR_FLOOR: &str = "[[obstacle]]\nshape = { plane = { point = [0, 0, -100], normal = [0, 0, 1] } }";
const PUSH: &str = "[[probe]]\nname = \"push\"\nkind = \"contact_force\"\ncomponent = \"z\"";
const STRESS: &str = "[[probe]]\nname = \"stress\"\nkind = \"stress\"\ncomponent = \"von_mises\"";

/// A line more in the solver's table, which comes last in the scene.
fn damped(solver: &str, line: &str) -> String {
    format!("{solver}\n{line}")
}

fn cases() -> Vec<Case> {
    let linear = |parts: &[&str]| beam("hooke", parts);
    let case = |name, with, without| Case {
        name,
        with,
        without,
        kernels: &[],
        gpu_kernels: &[],
        buffers: &[],
        gpu_buffers: &[],
        vectors: [0, 0],
    };
    let falling = ["semi-implicit-euler", "step = 5e-4", "duration = 0.025"];
    let falling =
        format!("[solver]\nintegrator = \"{}\"\nprecision = \"f64\"\n{}\n{}", falling[0], falling[1], falling[2]);
    let falls = |more: &[&str]| linear(&[&[FALLS, falling.as_str(), SILENT], more].concat());
    let beta = damped(IMPLICIT, "stiffness_damping = 1e-3");
    let beta_explicit = damped(EXPLICIT, "stiffness_damping = 1e-5");
    let alpha = damped(IMPLICIT, "mass_damping = 1.0");
    let consistent = damped(IMPLICIT, "mass = \"consistent\"");
    vec![
        Case {
            kernels: &["contact", "gap"],
            gpu_kernels: &["contact", "gap"],
            buffers: &["nodes of the surface"],
            gpu_buffers: &["nodes of the surface", "values of motions"],
            ..case("contact", falls(&[FLOOR]), falls(&[]))
        },
        Case {
            kernels: &["contact"],
            gpu_kernels: &["contact"],
            ..case("a gap that cannot close", falls(&[FLOOR]), falls(&[FAR_FLOOR]))
        },
        Case { vectors: [1, 1], ..case("forces of contact", falls(&[FLOOR, PUSH]), falls(&[FLOOR])) },
        Case {
            vectors: [1, 1],
            ..case("forces of contact, never met", falls(&[FLOOR, PUSH]), falls(&[FAR_FLOOR, PUSH]))
        },
        Case {
            // What is stored of the tangent, and where it is taken.
            kernels: &["linearize"],
            buffers: &["stored tangent"],
            vectors: [1, 1],
            ..case(
                "a tangent that depends on the state",
                beam("st_venant_kirchhoff", &[CLAMPED, FALLS, SILENT, LINEARISED]),
                linear(&[CLAMPED, FALLS, SILENT, LINEARISED]),
            )
        },
        Case {
            kernels: &["diagonal", "apply"],
            gpu_kernels: &["diagonal", "Descend", "Turn"],
            // Eleven of solver and integrator, where explicit steps have a force; a GPU keeps one in which the kinetic energy is
            // summed, where explicit steps there have two to go back to.
            vectors: [10, 9],
            ..case(
                "the tangent in steps",
                linear(&[CLAMPED, FALLS, SILENT, IMPLICIT]),
                linear(&[CLAMPED, FALLS, SILENT, EXPLICIT]),
            )
        },
        Case {
            // Velocity and masses; a GPU keeps that in which the kinetic energy is summed, but in f32 statics take two for a
            // correction.
            vectors: [2, 1],
            ..case("motion", linear(&[CLAMPED, FALLS, SILENT, IMPLICIT]), linear(&[CLAMPED, FALLS, SILENT, STATIC]))
        },
        Case {
            kernels: &["damping", "ddamping", "damping_diagonal"],
            gpu_kernels: &["damping", "ddamping", "damping_diagonal"],
            vectors: [2, 2],
            ..case(
                "viscosity, implicit",
                beam("kelvin_voigt", &[CLAMPED, FALLS, SILENT, IMPLICIT]),
                beam("neo_hookean", &[CLAMPED, FALLS, SILENT, IMPLICIT]),
            )
        },
        Case {
            kernels: &["damping"],
            gpu_kernels: &["damping"],
            ..case(
                "viscosity, explicit",
                beam("kelvin_voigt", &[CLAMPED, FALLS, SILENT, EXPLICIT]),
                beam("neo_hookean", &[CLAMPED, FALLS, SILENT, EXPLICIT]),
            )
        },
        Case {
            kernels: &["damping", "ddamping"],
            gpu_kernels: &["damping", "ddamping"],
            // Velocity, masses, the rate and the elastic diagonal.
            vectors: [4, 4],
            ..case(
                "viscosity in statics",
                beam("kelvin_voigt", &[CLAMPED, FALLS, SILENT, IMPLICIT]),
                beam("kelvin_voigt", &[CLAMPED, FALLS, SILENT, STATIC]),
            )
        },
        Case {
            kernels: &["dforce"],
            vectors: [2, 2],
            ..case(
                "stiffness damping, implicit",
                beam("neo_hookean", &[CLAMPED, FALLS, SILENT, &beta]),
                beam("neo_hookean", &[CLAMPED, FALLS, SILENT, IMPLICIT]),
            )
        },
        Case {
            kernels: &["apply"],
            ..case(
                "stiffness damping, explicit",
                linear(&[CLAMPED, FALLS, SILENT, &beta_explicit]),
                linear(&[CLAMPED, FALLS, SILENT, EXPLICIT]),
            )
        },
        Case {
            vectors: [1, 1],
            ..case(
                "mass damping",
                linear(&[CLAMPED, FALLS, SILENT, &alpha]),
                linear(&[CLAMPED, FALLS, SILENT, IMPLICIT]),
            )
        },
        Case {
            kernels: &["product with the consistent mass"],
            gpu_kernels: &["Product"],
            buffers: &["consistent mass"],
            gpu_buffers: &["consistent mass"],
            ..case(
                "consistent masses",
                linear(&[CLAMPED, FALLS, SILENT, &consistent]),
                linear(&[CLAMPED, FALLS, SILENT, IMPLICIT]),
            )
        },
        Case {
            gpu_kernels: &["Impose"],
            buffers: &["constrained nodes"],
            gpu_buffers: &["constrained nodes", "values of motions"],
            ..case("imposed motion", linear(&[CLAMPED, MOVED, SILENT, EXPLICIT]), linear(&[SILENT, EXPLICIT]))
        },
        Case {
            kernels: &["pressure"],
            gpu_kernels: &["pressure"],
            buffers: &["faces under pressure"],
            gpu_buffers: &["faces under pressure"],
            ..case("pressure", linear(&[CLAMPED, PRESSED, SILENT, EXPLICIT]), linear(&[CLAMPED, SILENT, EXPLICIT]))
        },
        Case { vectors: [1, 1], ..case("loads", linear(&[FALLS, SILENT, EXPLICIT]), linear(&[SILENT, EXPLICIT])) },
        Case {
            kernels: &["cauchy"],
            gpu_kernels: &["cauchy"],
            gpu_buffers: &["values of elements"],
            ..case(
                "stresses in records",
                linear(&[CLAMPED, FALLS, SILENT, STRESS, EXPLICIT]),
                linear(&[CLAMPED, FALLS, SILENT, EXPLICIT]),
            )
        },
        Case {
            gpu_kernels: &["Outside"],
            gpu_buffers: &["margins of elements"],
            ..case(
                "a domain",
                beam("neo_hookean", &[CLAMPED, FALLS, SILENT, EXPLICIT]),
                beam("stable_neo_hookean", &[CLAMPED, FALLS, SILENT, EXPLICIT]),
            )
        },
    ]
}

#[test]
fn what_a_scene_leaves_out_is_not_there() {
    cases().iter().for_each(|case| check(&Target::Cpu, case));
}

#[cfg(feature = "gpu")]
mod on_a_gpu {
    use std::sync::Arc;

    use super::*;
    use crate::support::gpu::test_device;
    use tensormass_runtime::gpu::{GpuBackend, GpuField, GpuOptions};

    fn target() -> Option<Target> {
        test_device().map(|gpu| Target::Gpu(gpu, GpuOptions::default()))
    }

    #[test]
    fn what_a_scene_leaves_out_is_not_there() {
        let Some(target) = target() else { return };
        cases().iter().for_each(|case| check(&target, case));
    }

    #[test]
    fn explicit_steps_have_no_tangent() {
        let Some(gpu) = test_device() else { return };
        // The zero vector, displacement, velocity, masses and load.
        for_explicit_steps(5, |body| {
            let backend = GpuBackend::new(Arc::clone(&gpu), body, GpuOptions::default()).expect("it fits");
            let field = GpuField::new(&backend, body).expect("it fits");
            (backend, field)
        });
    }

    #[test]
    fn steps_that_are_not_recorded_are_not_read() {
        let Some(target) = target() else { return };
        let readbacks = |parts: &[&str], steps: u32| {
            let all = [&[CLAMPED, FALLS, SILENT, EXPLICIT], parts].concat();
            let text = beam("hooke", &all);
            let duration = format!("solver.duration={}", 5e-4 * f64::from(steps));
            let set = ["solver.precision=f32", "output.probe_every=1", &duration];
            Ran::new(&target, &scene(&text, &set)).count("readbacks")
        };
        // After the first step 32, or 64; the state is looked at once a stretch.
        assert_eq!(readbacks(&[], 65) - readbacks(&[], 33), 1);
        // A reading of the state and one of the stresses a step.
        assert_eq!(readbacks(&[STRESS], 65) - readbacks(&[STRESS], 33), 2 * 32);
    }

    #[test]
    fn directions_cost_what_they_say() {
        let Some(target) = target() else { return };
        check_fibres(&target);
    }

    #[test]
    fn what_does_not_change_is_computed_once() {
        let Some(target) = target() else { return };
        check_repeats(&target);
    }
}

/// A body with a law that depends on the state, its critical step measured and its tangent let go: then explicit steps run
/// nothing but forces, and hold nothing of the tangent. At the start there are so many vectors.
fn for_explicit_steps<B: Backend, F: tensormass_runtime::backend::ForceField<B>>(
    at_start: usize,
    on: impl Fn(&tensormass_runtime::body::Body) -> (B, F),
) {
    let text = beam("st_venant_kirchhoff", &[CLAMPED, FALLS, SILENT, EXPLICIT]);
    let model = build(&scene::<&str>(&text, &[])).expect("a model");
    let (backend, field) = on(&model.body);
    let mut system = System::new(backend, field, model.body);
    let mut state = system.initial_state([0.0; 3]);
    let now = |system: &System<B, F>| -> Inventory { system.backend.ledger().inventory() };
    let at_rest = now(&system);
    let h = 0.5 * power_limit(&mut system, &state.u);
    let measured = now(&system);
    let tangent = |inventory: &Inventory| ["dforce", "apply", "multiply"].map(|kernel| inventory.runs(kernel));
    assert!(tangent(&measured).iter().sum::<u64>() > 5, "the critical step takes products");
    assert!(measured.all.bytes > at_rest.all.bytes, "and holds the state");
    system.field.forget_tangent(&system.backend);
    system.backend.trim();
    let mut integrator = CentralDifference::new(&system.backend);
    for _ in 0..5 {
        integrator.step(&mut system, &mut state, h).expect("a step");
    }
    let stepped = now(&system);
    assert_eq!(tangent(&stepped), tangent(&measured), "no product in a step");
    assert_eq!(stepped.runs("force"), measured.runs("force") + 5);
    for gone in ["dforce", "diagonal", "product at nodes"] {
        assert!(!stepped.is_ready(gone), "{gone} is kept");
    }
    let vector = at_rest.buffers[VECTORS].bytes / at_start;
    let bytes = |inventory: &Inventory, name: &str| inventory.buffers.get(name).map_or(0, |held| held.bytes);
    for name in ["stored tangent", "assembled tangent"] {
        assert_eq!(bytes(&stepped, name), 0, "{name}");
    }
    assert_eq!(bytes(&stepped, VECTORS) - bytes(&at_rest, VECTORS), vector, "the integrator's force alone");
}

#[test]
fn explicit_steps_have_no_tangent() {
    for_explicit_steps(4, |body| {
        let backend = CpuBackend::<f64>::new(body);
        let field = CpuField::new(&backend, body);
        (backend, field)
    });
}

/// A direction costs its constants: one set, or a set an element where each has its own; nothing where there is none.
fn check_fibres(target: &Target) {
    let with = law("transversely_isotropic").expect("a law of this build");
    let constants = with.info.constants.len();
    let elements = 8 * 2 * 2 * 6;
    let one = beam("transversely_isotropic", &[CLAMPED, FALLS, SILENT, EXPLICIT]);
    let values: Vec<String> = (0..elements).map(|e| format!("[1.0, {:?}, 0.0]", f64::from(e) / 1000.0)).collect();
    let each = format!("material.0.parameters.fibre={{ per_element = [{}] }}", values.join(", "));
    let precision = "solver.precision=f32";
    let name = "constants of materials";
    let bytes = |set: &[&str]| {
        let ran = Ran::new(target, &scene(&one, set));
        ran.check_plan("fibres", false);
        ran.bytes(name).expect("constants")
    };
    assert_eq!(bytes(&[precision]), 4 * constants);
    let many = bytes(&[precision, &each]);
    let least = 4 * constants * elements as usize;
    // Blocks of lanes are filled up.
    assert!((least..least + 4 * constants * 16 * 2).contains(&many), "{many} bytes, {least} are needed");
    let without = beam("hooke", &[CLAMPED, FALLS, SILENT, EXPLICIT]);
    let without = Ran::new(target, &scene(&without, &[precision]));
    let few = law("hooke").expect("a law of this build").info.constants.len();
    assert_eq!(without.bytes(name), Some((4 * few).max(if without.on_gpu { 16 } else { 0 })));
}

#[test]
fn directions_cost_what_they_say() {
    check_fibres(&Target::Cpu);
}

/// Of a linear law nothing is linearized, whatever the number of steps, and a matrix is assembled once; of another law with
/// each solution. What is not recorded has no energies but those of the end.
fn check_repeats(target: &Target) {
    let on_gpu = !matches!(target, Target::Cpu);
    let ran = |law: &str, tangent: &str, steps: u32| {
        let text = beam(law, &[CLAMPED, FALLS, SILENT, LINEARISED]);
        let precision = if on_gpu { "f32" } else { "f64" };
        let set = [
            format!("solver.precision={precision}"),
            format!("solver.cg.tangent={tangent}"),
            format!("solver.duration={}", 0.01 * f64::from(steps)),
        ];
        Ran::new(target, &scene(&text, &set))
    };
    let growth = |law: &str, tangent: &str, kernel: &str| {
        let of = |steps| ran(law, tangent, steps).runs(kernel).unwrap_or(0);
        of(6) - of(3)
    };
    assert_eq!(growth("hooke", "auto", "energy"), 0);
    assert_eq!(growth("hooke", "auto", "force"), 3);
    assert_eq!(ran("hooke", "auto", 3).runs("energy"), Some(1));
    if on_gpu {
        // The state at which the tangent is taken is copied with each solution.
        assert_eq!(growth("st_venant_kirchhoff", "auto", "Copy") - growth("hooke", "auto", "Copy"), 3);
        return;
    }
    assert_eq!(growth("hooke", "stored", "linearize"), 0);
    assert_eq!(growth("hooke", "assembled", "assemble"), 0);
    assert_eq!(ran("hooke", "assembled", 3).runs("assemble"), Some(1));
    assert_eq!(growth("st_venant_kirchhoff", "stored", "linearize"), 3);
    assert_eq!(growth("st_venant_kirchhoff", "assembled", "assemble"), 3);
}

#[test]
fn what_does_not_change_is_computed_once() {
    check_repeats(&Target::Cpu);
}

/// The scenes of the repository, coarser and shorter: plans are what runs hold.
#[test]
fn plans_of_the_repository_are_what_runs_hold() {
    let folder = support::repository("scenes");
    let scenes = ["traction", "gravity-hooke", "gravity-svk", "torsion", "bending"];
    for name in scenes {
        let file: &Path = &folder.join(format!("{name}.toml"));
        let text = std::fs::read_to_string(file).expect("a scene of the repository");
        let set = ["mesh.beam.cells=[10, 4, 4]", "solver.duration=0.32", "output.frames=0"];
        for integrator in ["implicit-euler", "semi-implicit-euler", "static"] {
            let step = if integrator == "semi-implicit-euler" { "1e-4" } else { "0.16" };
            let duration = if integrator == "semi-implicit-euler" { "0.001" } else { "0.32" };
            let more = [
                format!("solver.integrator={integrator}"),
                format!("solver.step={step}"),
                format!("solver.duration={duration}"),
            ];
            let all: Vec<&str> = set.iter().copied().chain(more.iter().map(String::as_str)).collect();
            let ran = Ran::new(&Target::Cpu, &scene(&text, &all));
            ran.check_plan(&format!("{name}, {integrator}"), false);
        }
    }
}

//! Whole runs on a GPU: against the CPU in the same precision, what they ask of the device, and a device that fails.
#![cfg(feature = "gpu")]

use std::sync::Arc;

use crate::support::elements::boxes_beside_wedges;
use crate::support::gpu::test_device;
use crate::support::{body, done, outcome, parameters, repository, scene, table, viscous};
use tensormass_kernels::elements;
use tensormass_runtime::backend::{Backend, Counts, ForceField, Operator};
use tensormass_runtime::cg::{CgLimits, CgOutcome, ConjugateGradient};
use tensormass_runtime::device::DeviceError;
use tensormass_runtime::gpu::{Gpu, GpuBackend, GpuField, GpuOptions};
use tensormass_runtime::laws;
use tensormass_runtime::mass::Masses;
use tensormass_runtime::mesh::beam;
use tensormass_runtime::scene::Scene;
use tensormass_runtime::simulate::{Ending, Observer, Outcome, RunError, Silent, run_on};
use tensormass_runtime::step_limit::StepLimits;
use tensormass_runtime::system::SolveError;
use tensormass_runtime::target::Target;

fn target(gpu: &Arc<Gpu>) -> Target {
    Target::Gpu(Arc::clone(gpu), GpuOptions::default())
}

fn on_gpu(gpu: &Arc<Gpu>, scene: &Scene) -> Outcome {
    let outcome = run_on(&target(gpu), scene, None, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(outcome.ending, Ending::Done, "{}", outcome.summary["error"]);
    assert_eq!(outcome.summary["device"], gpu.info().name.as_str());
    outcome
}

/// Runs a scene on both in f32. A probe may differ by `tolerance` of its value, or of the `size` given for its name.
fn check(gpu: &Arc<Gpu>, name: &str, scene: &Scene, tolerance: f64, sizes: &[(&str, f64)]) {
    let (device, cpu) = (on_gpu(gpu, scene), done(scene));
    for ((probe, _, value), (_, _, wanted)) in device.probes.iter().zip(&cpu.probes) {
        let size = sizes.iter().find(|(n, _)| n == probe).map_or(wanted.abs(), |(_, size)| *size);
        let error = (value - wanted).abs() / size;
        eprintln!("{name}, {probe}: {value:e} on the device, {wanted:e} on the CPU, {error:.1e} of {size:e}");
        assert!(error <= tolerance, "{name}, {probe}: {value:e} on the device, {wanted:e} on the CPU");
    }
}

/// The scenes of the repository, coarser and shorter; whole ones take minutes on a software device. The beam's point
/// supports carry nothing: that probe is compared with the force that stretches the beam.
#[test]
fn scenes_of_the_repository() {
    let Some(gpu) = test_device() else { return };
    let coarse = "mesh.beam.cells=[10, 4, 4]";
    type Case<'a> = (&'a str, &'a [&'a str], &'a [(&'a str, f64)]);
    let cases: [Case; 6] = [
        ("traction", &[coarse, "solver.duration=0.32"], &[("support", 1e6)]),
        ("traction", &[coarse, "solver.integrator=static", "solver.newton.max_iterations=5"], &[("support", 5e6)]),
        ("gravity-hooke", &[coarse, "solver.duration=1.0", "solver.precision=f32"], &[]),
        ("gravity-svk", &[coarse, "solver.duration=1.0", "solver.precision=f32"], &[]),
        ("torsion", &[coarse, "solver.duration=0.4", "solver.precision=f32"], &[]),
        ("bending", &[coarse, "solver.duration=0.4", "solver.precision=f32"], &[]),
    ];
    for (file, set, sizes) in cases {
        let text =
            std::fs::read_to_string(repository(&format!("scenes/{file}.toml"))).expect("a scene of the repository");
        check(&gpu, file, &scene(&text, set), 1e-4, sizes);
    }
}

/// A beam of a law, clamped at one end and pulled sideways at the other.
fn bent(law: &tensormass_runtime::LawEntry, solver: &str) -> String {
    format!(
        "[mesh]\nbeam = {{ size = [4, 1, 1], cells = [8, 2, 2] }}\n[[material]]\nlaw = \"{}\"\ndensity = 1000.0\n\
         parameters = {}\n[[boundary]]\nnodes = \"near(x, xmin)\"\nfix = [\"x\", \"y\", \"z\"]\n[[boundary]]\n\
         nodes = \"near(x, xmax)\"\nmove = {{ y = {{ ramp = [[0.0, 0.0], [0.05, 0.4]] }} }}\n[solver]\n\
         precision = \"f32\"\n{solver}\n[[probe]]\nname = \"force\"\nkind = \"reaction\"\nnodes = \"near(x, xmax)\"\n\
         component = \"y\"\n[[probe]]\nname = \"sag\"\nkind = \"displacement\"\nnodes = \"near(x, xmax)\"\n\
         component = \"x\"\n[[probe]]\nname = \"energy\"\nkind = \"energy\"\npart = \"total\"\n[[probe]]\n\
         name = \"stress\"\nkind = \"stress\"\ncomponent = \"von_mises\"\nstatistic = \"mean\"\n",
        law.info.name,
        table(law, &viscous(law, 3e3))
    )
}

/// Every law with every integrator. Both sides round to f32 in another order; what textbook stresses lose at these
/// strains is 1e-5 (docs/testing.md), and no more is asked.
#[test]
fn every_law_with_every_integrator() {
    let Some(gpu) = test_device() else { return };
    let implicit = "step = 0.01\nduration = 0.06\ncg = { tolerance = 1e-6, max_iterations = 2000 }";
    let solvers = [
        "integrator = \"semi-implicit-euler\"\nstep = 5e-4\nduration = 0.06\nstiffness_damping = 1e-3".to_string(),
        "integrator = \"central-difference\"\nstep = 5e-4\nduration = 0.06\nmass_damping = 2.0".to_string(),
        format!("integrator = \"implicit-euler\"\n{implicit}\nnewton = {{ max_iterations = 1 }}"),
        format!(
            "integrator = \"implicit-euler\"\nstiffness_damping = 0.01\n{implicit}\nnewton = {{ tolerance = 1e-5, \
             max_iterations = 20 }}"
        ),
        format!("integrator = \"static\"\n{implicit}\nnewton = {{ tolerance = 1e-5, max_iterations = 20 }}"),
    ];
    for law in laws() {
        for solver in &solvers {
            let name = format!("{}, {}", law.info.name, solver.lines().next().unwrap_or_default());
            // A small sag is a difference of large strains.
            check(&gpu, &name, &scene::<&str>(&bent(law, solver), &[]), 1e-4, &[("sag", 0.4)]);
        }
    }
}

/// Every element with every kind of integrator, as [`every_law_with_every_integrator`].
#[test]
fn every_element_with_every_kind_of_integrator() {
    let Some(gpu) = test_device() else { return };
    let implicit = "step = 0.01\nduration = 0.04\ncg = { tolerance = 1e-6, max_iterations = 2000 }";
    let newton = "newton = { tolerance = 1e-5, max_iterations = 20 }";
    let solvers = [
        "integrator = \"semi-implicit-euler\"\nstep = 1e-4\nduration = 0.01\nstiffness_damping = 1e-4".to_string(),
        format!("integrator = \"implicit-euler\"\nmass = \"consistent\"\nmass_damping = 1.0\n{implicit}\n{newton}"),
        format!("integrator = \"static\"\n{implicit}\n{newton}"),
    ];
    let law = laws().iter().find(|law| law.damping.is_some() || law.info.domain.is_some()).expect("such a law");
    for element in elements().iter().filter(|e| e.info.dimension > 1) {
        let cells = if element.info.dimension == 2 { "cells=[8, 2, 1]" } else { "cells=[6, 1, 1]" };
        let set = [format!("mesh.beam.{cells}"), format!("mesh.beam.element={}", element.info.name)];
        for solver in &solvers {
            let name = format!("{}, {}", element.info.name, solver.lines().next().unwrap_or_default());
            check(&gpu, &name, &scene(&bent(law, solver), &set), 1e-4, &[("sag", 0.4)]);
        }
    }
}

/// A device compiles the passes that a scene needs, of the laws and elements that it has: an explicit step of two kinds
/// has two passes over elements, an implicit solve brings the differential and the diagonal of both.
#[test]
fn passes_are_those_that_a_scene_needs() {
    let Some(gpu) = test_device() else { return };
    let mesh = boxes_beside_wedges(3);
    let law = laws().iter().find(|law| !law.info.structure.linear && law.damping.is_none()).expect("such a law");
    let body = body(&mesh, law, &parameters(law), &[]);
    let backend = GpuBackend::new(Arc::clone(&gpu), &body, GpuOptions::default()).expect("it fits");
    let mut field = GpuField::new(&backend, &body).expect("it fits");
    let (u, mut f) = (backend.zeros(), backend.zeros());
    assert_eq!(field.compiled_element_passes(), 0);
    for _ in 0..2 {
        field.add_force(&backend, &u, &mut f).expect("at rest");
        assert_eq!(field.compiled_element_passes(), 2);
    }
    field.prepare(&backend, &u);
    field.add_diagonal(&backend, 1.0, &mut f);
    field.add_dforce(&backend, &u, 1.0, &mut f);
    assert_eq!(field.compiled_element_passes(), 6);
}

/// The same run twice gives the same bits.
#[test]
fn reruns_are_identical() {
    let Some(gpu) = test_device() else { return };
    let solver = "integrator = \"implicit-euler\"\nstep = 0.01\nduration = 0.03";
    for law in laws() {
        let scene = scene::<&str>(&bent(law, solver), &[]);
        let (first, second) = (on_gpu(&gpu, &scene), on_gpu(&gpu, &scene));
        let bits = |o: &Outcome| o.probes.iter().map(|(_, _, v)| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&first), bits(&second), "{}", law.info.name);
        assert_eq!(first.summary["device_counts"], second.summary["device_counts"], "{}", law.info.name);
    }
}

/// What the device is asked for between two moments.
fn since(backend: &GpuBackend, before: Counts) -> Counts {
    let now = backend.counts();
    Counts {
        dispatches: now.dispatches - before.dispatches,
        submissions: now.submissions - before.submissions,
        readbacks: now.readbacks - before.readbacks,
        bytes_read: now.bytes_read - before.bytes_read,
    }
}

/// k iterations of conjugate gradients are one submission with no reading within it: six dispatches an iteration, one
/// status of 64 bytes at the end. Iterations after the last are submitted and do nothing.
#[test]
fn the_solver_reads_once_a_submission() {
    let Some(gpu) = test_device() else { return };
    let mesh = beam([3.0, 1.0, 1.0], [6, 2, 2], [0.0; 3]).expect("a beam");
    let held: Vec<_> = (0..9).flat_map(|n| (0..3).map(move |c| (n, c, 0.0))).collect();
    for law in laws() {
        let body = body(&mesh, law, &parameters(law), &held);
        for k in [5, 20] {
            let options = GpuOptions { iterations_per_submission: k, ..GpuOptions::default() };
            let backend = GpuBackend::new(Arc::clone(&gpu), &body, options).expect("it fits");
            let mut field = GpuField::new(&backend, &body).expect("it fits");
            let masses = Masses::lumped(backend.upload(&body.masses.iter().map(|&m| [m; 3]).collect::<Vec<_>>()));
            let b = backend.upload(&vec![[0.0, 0.0, -1e3]; body.masses.len()]);
            let ones = backend.upload(&vec![[1.0; 3]; body.masses.len()]);
            let rest = backend.zeros();
            field.prepare(&backend, &rest);
            let operator = Operator { masses: &masses, mass: 0.0, stiffness: 1.0, damping: None };
            let mut cg = ConjugateGradient::new(&backend);
            let mut solve = |tolerance, max_iterations| {
                let mut x = backend.zeros();
                let before = backend.counts();
                let limits = CgLimits { tolerance, max_iterations };
                let report = cg.solve(&backend, &mut field, &operator, &ones, &b, &mut x, limits);
                (report, since(&backend, before), backend.download(&x))
            };
            let name = law.info.name;
            let (report, few, _) = solve(1e-20, 20);
            assert_eq!((report.outcome, report.iterations), (CgOutcome::IterationCap, 20), "{name}");
            let (report, many, _) = solve(1e-20, 40);
            assert_eq!((report.outcome, report.iterations), (CgOutcome::IterationCap, 40), "{name}");
            let readings = u64::from(20 / k);
            assert_eq!(few.readbacks, readings, "{name}");
            assert_eq!(many.readbacks - few.readbacks, readings, "{name}");
            assert_eq!(many.submissions - few.submissions, readings, "{name}");
            assert_eq!(many.bytes_read - few.bytes_read, 64 * readings, "{name}");
            assert_eq!(many.dispatches - few.dispatches, 6 * 20, "{name}");
            // A cap on the way and the same cap within a submission: the same solution.
            let (report, counts, x) = solve(1e-3, 2000);
            assert_eq!(report.outcome, CgOutcome::Converged, "{name}");
            assert_eq!(counts.readbacks, u64::from(report.iterations.div_ceil(k)), "{name}");
            let (capped, _, same) = solve(1e-20, report.iterations);
            assert_eq!((capped.iterations, &same), (report.iterations, &x), "{name}: work after the last iteration");
        }
    }
}

/// Explicit steps between which nothing is recorded read what says whether all went well: once for many of them, and
/// besides, of a law with a domain, whether elements were inside.
#[test]
fn explicit_steps_read_once_a_stretch() {
    let Some(gpu) = test_device() else { return };
    let solver = "integrator = \"semi-implicit-euler\"\nstep = 5e-4\nduration = ";
    for law in laws() {
        let reads_and_submits = |duration: &str| {
            let text = bent(law, &format!("{solver}{duration}"));
            let without_probes = text.split("[[probe]]").next().expect("the scene before its probes");
            let summary = on_gpu(&gpu, &scene::<&str>(without_probes, &[])).summary;
            ["readbacks", "submissions"].map(|count| summary["device_counts"][count].as_u64().expect("counted"))
        };
        // After the first step 32, or 64.
        let ([few, _], [more, _]) = (reads_and_submits("0.0165"), reads_and_submits("0.0325"));
        let each = if law.info.domain.is_some() { 2 } else { 1 };
        assert_eq!(more - few, each, "{}", law.info.name);
    }
}

/// A run that looks at the device's state after so many explicit steps.
fn looking(gpu: &Arc<Gpu>, scene: &Scene, steps_between_checks: u32) -> Outcome {
    let target = Target::Gpu(Arc::clone(gpu), GpuOptions { steps_between_checks, ..GpuOptions::default() });
    run_on(&target, scene, None, &mut Silent).unwrap_or_else(|e| panic!("{e}"))
}

/// A run ends as it does where every state is looked at: with the same numbers, or with the same error at the same step.
#[test]
fn steps_that_nobody_looks_at_are_the_same() {
    let Some(gpu) = test_device() else { return };
    let mut failed = 0;
    for law in laws() {
        for integrator in ["semi-implicit-euler", "central-difference"] {
            // The second blows up.
            for step in ["5e-4", "2e-2"] {
                let solver = format!("integrator = \"{integrator}\"\nstep = {step}\nduration = {step}");
                let text = bent(law, &solver) + "[output]\nprobe_every = 17\n";
                let duration = format!("solver.duration={}", 60.0 * step.parse::<f64>().expect("a number"));
                let scene = scene(&text, &[duration]);
                let (one, many) = (looking(&gpu, &scene, 1), looking(&gpu, &scene, 32));
                let name = format!("{}, {integrator}, {step} s", law.info.name);
                assert_eq!(one.ending, many.ending, "{name}");
                for key in ["steps", "simulated_time_s", "probes", "solver", "error"] {
                    assert_eq!(one.summary[key], many.summary[key], "{name}: {key}");
                }
                failed += usize::from(one.ending != Ending::Done);
                let submissions = |outcome: &Outcome| outcome.summary["device_counts"]["submissions"].as_u64();
                assert!(one.ending != Ending::Done || submissions(&many) < submissions(&one), "{name}");
            }
        }
    }
    assert!(failed >= laws().len(), "{failed} runs failed");
}

/// Closes the device after a step.
struct Unplug<'a>(&'a Gpu, u64);

impl Observer for Unplug<'_> {
    fn warning(&mut self, _: &str) {}
    fn limits(&mut self, _: StepLimits) {}
    fn progress(&mut self, step: u64, _: u64) {
        if step == self.1 {
            self.0.destroy();
        }
    }
    fn interrupted(&self) -> bool {
        false
    }
}

/// A device that is lost after three steps of six: the run fails, says so, and keeps the three.
#[test]
fn a_lost_device_keeps_the_results() {
    let solvers = [
        "integrator = \"semi-implicit-euler\"\nstep = 5e-4\nduration = 3e-3",
        "integrator = \"implicit-euler\"\nstep = 0.01\nduration = 0.06",
        "integrator = \"static\"\nstep = 0.01\nduration = 0.06",
    ];
    for law in laws() {
        for solver in solvers {
            let Some(gpu) = test_device() else { return };
            let scene = scene::<&str>(&bent(law, solver), &[]);
            let folder = tempfile::tempdir().expect("a temporary folder");
            let mut observer = Unplug(&gpu, 3);
            let lost =
                run_on(&target(&gpu), &scene, Some(folder.path()), &mut observer).unwrap_or_else(|e| panic!("{e}"));
            let Ending::Failed(SolveError::Device(DeviceError::Lost { .. })) = &lost.ending else {
                panic!("{}, {solver}: {:?}", law.info.name, lost.ending);
            };
            let read = |file: &str| std::fs::read_to_string(folder.path().join(file)).expect(file);
            let summary: serde_json::Value = serde_json::from_str(&read("summary.json")).expect("JSON");
            assert_eq!((&summary["status"], &summary["steps"]), (&"failed".into(), &3.into()), "{summary}");
            assert!(summary["error"].as_str().is_some_and(|e| e.contains("--device cpu")), "{summary}");
            // The header, the start, and three steps; nothing that the lost device returned.
            let table = read("probes.csv");
            assert_eq!(table.lines().count(), 5, "{table}");
            assert!(!table.contains("NaN"), "{table}");
            let cut = outcome(&scene).probes.len();
            assert_eq!(lost.probes.len(), cut);
        }
    }
}

/// Options that no device takes: the run is the same as with the nearest that all do.
#[test]
fn options_are_made_valid() {
    let Some(gpu) = test_device() else { return };
    let scene = scene::<&str>(&bent(&laws()[0], "integrator = \"implicit-euler\"\nstep = 0.01\nduration = 0.02"), &[]);
    let probes = |work_group_size, least| {
        let (elements_per_invocation, iterations_per_submission) = (least, least);
        let steps_between_checks = least;
        let options = GpuOptions {
            work_group_size,
            elements_per_invocation,
            iterations_per_submission,
            steps_between_checks,
            binding_bytes: None,
        };
        let target = Target::Gpu(Arc::clone(&gpu), options);
        run_on(&target, &scene, None, &mut Silent).unwrap_or_else(|e| panic!("{e}")).probes
    };
    assert_eq!(probes(0, 0), probes(1, 1));
    assert_eq!(probes(100, 1), probes(128, 1));
    assert_eq!(probes(u32::MAX, 1), probes(256, 1));
}

#[test]
fn f64_is_refused() {
    let Some(gpu) = test_device() else { return };
    let scene =
        scene(&bent(&laws()[0], "integrator = \"static\"\nstep = 0.01\nduration = 0.06"), &["solver.precision=f64"]);
    let refused = run_on(&target(&gpu), &scene, None, &mut Silent);
    assert!(matches!(refused, Err(RunError::Device(DeviceError::Precision))));
}

/// A vector over the nodes that the device cannot bind.
#[test]
fn a_body_beyond_the_limits_is_refused() {
    let Some(gpu) = test_device() else { return };
    let limit = gpu.limits().storage_binding_bytes;
    // A device that binds more than this machine's memory holds has no such body to refuse.
    if limit > 1 << 30 {
        return;
    }
    let mesh = beam([1.0; 3], [1; 3], [0.0; 3]).expect("a beam");
    let mut body = body(&mesh, &laws()[0], &parameters(&laws()[0]), &[]);
    body.masses = vec![1.0; limit as usize / 16 + 1];
    let bytes = 16 * body.masses.len() as u64;
    let refused = GpuBackend::new(gpu, &body, GpuOptions::default()).map(|_| ());
    assert_eq!(refused, Err(DeviceError::TooLarge { what: "a vector over the nodes".to_string(), bytes, limit }));
}

/// A kernel's text is compiled once for a device: another run of the same laws adds none, whatever its material, mesh and step; another
/// law does.
#[test]
fn kernels_are_compiled_once_for_a_device() {
    let Some(gpu) = test_device() else { return };
    let compiled = |name: &str, set: &[&str]| {
        let law = laws().iter().find(|law| law.info.name == name).expect("a law of the build");
        let shorter = ["solver.step=0.01", "solver.duration=0.02"];
        on_gpu(&gpu, &scene(&bent(law, "integrator = \"implicit-euler\""), &[&shorter[..], set].concat()));
        gpu.kernels()
    };
    let first = compiled("neo_hookean", &[]);
    assert!(first > 0);
    let others = ["material.0.parameters.young=2e6", "mesh.beam.cells=[6, 3, 2]", "solver.step=0.005"];
    assert_eq!(compiled("neo_hookean", &others), first);
    assert!(compiled("st_venant_kirchhoff", &[]) > first);
}

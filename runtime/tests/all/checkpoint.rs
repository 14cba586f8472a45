//! Checkpoints: a run in two parts is the run in one, bit for bit; what is of another run, or torn, is refused.

use std::path::Path;

use crate::support::contact::{BELOW, CUBE, falling_text};
use crate::support::{overrides, scene};
use tensormass_runtime::scene::{Scene, parse};
use tensormass_runtime::simulate::{Checkpoint, Ending, RunError, Silent, run_from};
use tensormass_runtime::target::Target;

/// A cube that falls on a sphere and is looked at every 7 steps, so that a checkpoint comes between two records.
fn bouncing(law: &str, precision: &str) -> String {
    let text = falling_text(CUBE, BELOW[1], law, precision, 2e-4, 0.04);
    text.replace("probe_every = 100", "probe_every = 7\nfields = [\"displacement\", \"contact\"]")
        .replace("frames = 0", "frames = 4")
        + "[[probe]]\nname = \"force\"\nkind = \"contact_force\"\ncomponent = \"z\"\n"
}

fn run(target: &Target, scene: &Scene, out: &Path, from: Option<&Checkpoint>) {
    let outcome = run_from(target, scene, Some(out), from, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(outcome.ending, Ending::Done, "{}", outcome.summary["error"]);
}

fn read(out: &Path) -> Checkpoint {
    Checkpoint::read(&out.join("checkpoint.tmc")).unwrap_or_else(|e| panic!("{e}"))
}

/// 200 steps in one run, and 100 and 100: the last checkpoint and all records are the same bits.
fn check(target: &Target, text: &str, set: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [whole, parts] = ["whole", "parts"].map(|name| folder.path().join(name));
    let with = |more: &[&str]| scene(text, &[set, more].concat());
    let all = with(&["output.checkpoint_every=1000"]);
    assert_eq!(all.solver.steps(), 200);
    run(target, &all, &whole, None);
    run(target, &with(&["solver.duration=0.02", "output.checkpoint_every=100"]), &parts, None);
    let middle = read(&parts);
    assert_eq!(middle.step(), 100);
    run(target, &all, &parts, Some(&middle));
    let bytes = |out: &Path, file: &str| std::fs::read(out.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
    assert!(bytes(&whole, "checkpoint.tmc") == bytes(&parts, "checkpoint.tmc"), "{set:?}: the states differ");
    let [one, two] = [&whole, &parts].map(|out| String::from_utf8(bytes(out, "probes.csv")).expect("text"));
    // The first part recorded its own end, which is between two records of the whole.
    let two: Vec<&str> = two.lines().filter(|line| !line.starts_with("0.02,")).collect();
    assert_eq!(one.lines().collect::<Vec<_>>(), two, "{set:?}");
    // The first part's frames, then the others: its own ones are at quarters of its time.
    let frames = std::fs::read_to_string(parts.join("frames.pvd")).expect("an index");
    assert_eq!(frames.matches("<DataSet").count(), 5 + 2, "{frames}");
}

#[test]
fn two_parts_are_the_whole() {
    let cases: [&[&str]; 6] = [
        &[],
        &["solver.integrator=semi-implicit-euler", "solver.stiffness_damping=1e-5"],
        &["solver.mass_damping=3.0"],
        &["solver.integrator=implicit-euler", "solver.newton.tolerance=1e-5"],
        &["solver.integrator=implicit-euler", "solver.newton.max_iterations=1", "solver.mass=consistent"],
        &["solver.integrator=implicit-euler", "solver.cg.tangent=assembled", "solver.newton.tolerance=1e-5"],
    ];
    for set in cases {
        for (law, precision) in [("neo_hookean", "f64"), ("st_venant_kirchhoff", "f32"), ("hooke", "f64")] {
            check(&Target::Cpu, &bouncing(law, precision), set);
        }
    }
}

#[cfg(feature = "gpu")]
#[test]
fn two_parts_are_the_whole_on_a_gpu() {
    use tensormass_runtime::gpu::GpuOptions;
    let Some(gpu) = crate::support::gpu::test_device() else { return };
    let target = Target::Gpu(gpu, GpuOptions::default());
    let text = bouncing("neo_hookean", "f32");
    check(&target, &text, &[]);
    check(&target, &text, &["solver.integrator=implicit-euler", "solver.newton.tolerance=1e-4"]);
}

/// What a run from a changed checkpoint, or of a changed scene, says.
#[test]
fn others_and_torn_ones_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path();
    let text = bouncing("neo_hookean", "f64");
    run(&Target::Cpu, &scene(&text, &["solver.duration=0.02", "output.checkpoint_every=100"]), out, None);
    let path = out.join("checkpoint.tmc");
    let good = std::fs::read(&path).expect("a checkpoint");
    let refused = |set: &[&str]| {
        let scene = parse(&text, "scene.toml", &overrides(set)).unwrap_or_else(|e| panic!("{e}"));
        let ended = Checkpoint::read(&path)
            .map_err(RunError::from)
            .and_then(|from| run_from(&Target::Cpu, &scene, None, Some(&from), &mut Silent));
        match ended {
            Ok(outcome) => format!("{:?}", outcome.ending),
            Err(e) => e.to_string().replace(&path.display().to_string(), "FILE"),
        }
    };
    assert_eq!(refused(&[]), "Done");
    assert_eq!(refused(&["solver.threads=1", "output.frames=0"]), "Done");
    let scene_differs = "FILE: the checkpoint is of another scene; give the scene with which it was written; only \
                         solver.duration, solver.threads, [output] and [scene] may differ";
    assert_eq!(refused(&["solver.step=1e-4"]), scene_differs);
    assert_eq!(refused(&["obstacle.0.friction=0.3"]), scene_differs);
    assert_eq!(refused(&["solver.precision=f32"]), scene_differs);
    assert_eq!(
        refused(&["solver.duration=0.02"]),
        "FILE: the checkpoint is at step 100, and the run ends with step 100; there is nothing left to do; lengthen \
         solver.duration to go on"
    );
    let again = "resume from another checkpoint, or run the scene from the beginning";
    let torn = format!("FILE: the checkpoint is torn: its checksum is not that of its content; {again}");
    for (at, bit) in [(40, 1), (good.len() / 2, 128), (good.len() - 1, 4)] {
        let mut bytes = good.clone();
        bytes[at] ^= bit;
        std::fs::write(&path, bytes).expect("a file");
        assert_eq!(refused(&[]), torn);
    }
    for length in [good.len() - 1, good.len() - 8, good.len() / 2, 30] {
        std::fs::write(&path, &good[..length]).expect("a file");
        assert_eq!(refused(&[]), torn);
    }
    let none = format!("FILE: this is no checkpoint that this version can read; {again}");
    for bytes in [&b""[..], b"tensormass checkpoint 2\n0123456789abcdef", &good[1..]] {
        std::fs::write(&path, bytes).expect("a file");
        assert_eq!(refused(&[]), none);
    }
    std::fs::remove_file(&path).expect("a file");
    assert!(refused(&[]).starts_with("FILE: the checkpoint cannot be read: "));
}

//! `tensormass run` and `tensormass plan`, called as a user calls them: results, messages and exit statuses.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// A small beam pulled at one end; tests change it with --set.
const SCENE: &str = r#"[mesh]
beam = { size = [2, 1, 1], cells = [4, 2, 2] }

[[material]]
law = "hooke"
density = 1000.0
parameters = { young = 1e6, poisson = 0.3 }

[[boundary]]
nodes = "near(x, xmin)"
fix = ["x", "y", "z"]

[[load]]
kind = "gravity"
acceleration = [0.0, 0.0, -9.81]

[solver]
integrator = "implicit-euler"
step = 0.01
duration = 0.1

[[probe]]
name = "tip"
kind = "displacement"
nodes = "near(x, xmax)"
component = "z"
"#;

struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("beam.toml"), SCENE).expect("written");
        Self { folder }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("results")
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tensormass"));
        command.args(arguments).current_dir(self.folder.path());
        command
    }

    /// Runs the scene with changes: exit status, standard output, error output.
    fn run(&self, arguments: &[&str]) -> (Option<i32>, String, String) {
        let mut all = vec!["run", "beam.toml", "--out", "results"];
        all.extend(arguments);
        parts(&self.command(&all).output().expect("the binary starts"))
    }

    fn summary(&self) -> Value {
        read_json(&self.out().join("summary.json"))
    }
}

fn parts(output: &Output) -> (Option<i32>, String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn read_json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("the file is there")).expect("JSON")
}

fn lines(path: &Path) -> usize {
    std::fs::read_to_string(path).expect("the file is there").lines().count()
}

#[test]
fn a_run_writes_its_results_and_prints_its_probes() {
    let case = Case::new();
    let (status, out, err) = case.run(&[]);
    assert_eq!(status, Some(0), "{err}");
    assert!(out.starts_with("done: 10 steps, 0.1 s simulated in "), "{out}");
    assert!(out.contains("\n  tip  -"), "{out}");
    assert!(err.starts_with("critical step of explicit integrators: "), "{err}");
    let summary = case.summary();
    for (key, value) in [("status", "done"), ("device", "cpu"), ("precision", "f64"), ("integrator", "implicit-euler")]
    {
        assert_eq!(summary[key], value, "{key}");
    }
    for (key, value) in [("nodes", 45), ("elements", 96), ("steps", 10)] {
        assert_eq!(summary[key], value, "{key}");
    }
    // The beam turns by two degrees, which a linear law gets wrong by more than 1 %.
    let warnings = summary["warnings"].as_array().expect("a list");
    let [Value::String(warning)] = warnings.as_slice() else { panic!("one warning: {warnings:?}") };
    assert!(warning.contains("is linear and holds for small rotations"), "{warning}");
    assert!(err.contains(&format!("warning: {warning}")), "{err}");
    assert_eq!(summary["guards"]["linear"]["threshold"], 0.01);
    assert_eq!(lines(&case.out().join("probes.csv")), 12, "a header, the start and ten steps");
    assert!(case.out().join("frames.pvd").exists() && case.out().join("frames/frame_000001.vtu").exists());
}

#[test]
fn quiet_prints_nothing_and_json_prints_the_summary() {
    let case = Case::new();
    assert_eq!(case.run(&["--quiet"]), (Some(0), String::new(), String::new()));
    let (status, out, _) = case.run(&["--json"]);
    let printed: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((status, &printed), (Some(0), &case.summary()));
}

#[test]
fn a_later_run_leaves_nothing_of_an_earlier_one() {
    let case = Case::new();
    assert_eq!(case.run(&["--set", "output.frames=5"]).0, Some(0));
    assert!(case.out().join("frames/frame_000005.vtu").exists());
    assert_eq!(case.run(&["--set", "output.frames=2"]).0, Some(0));
    assert!(!case.out().join("frames/frame_000003.vtu").exists());
}

#[test]
fn bad_input_ends_with_2_a_place_and_a_remedy() {
    let case = Case::new();
    let cases = [
        (
            &["--set", "solver.integrater=static"][..],
            "error: --set solver.integrater=static: unknown key `integrater` in `solver`\n  = help: did you mean `integrator`?",
        ),
        (
            &["--set", "material.0.law=hook"],
            "error: --set material.0.law=hook: there is no law \"hook\"\n  = help: did you mean \"hooke\"?",
        ),
        (
            &["--set", "material.0.parameters.poisson=0.5"],
            "error: --set material.0.parameters.poisson=0.5: `poisson` is 0.5, outside the range of law `hooke`\n  = help: \
             choose a value from -0.9 to 0.4999\n",
        ),
        (
            &["--device", "gpu"],
            "error: --device gpu: a GPU computes in f32, and f64 is asked for\n  = help: choose --precision f32, or \
             --device cpu\n",
        ),
        (
            &["--device", "cuda"],
            "error: invalid value 'cuda' for '--device <auto|cpu|gpu|gpu:NAME>': `cuda` is not a device; choose auto, ",
        ),
        (&["--precision", "f16"], "error: --set solver.precision=f16: "),
    ];
    for (arguments, message) in cases {
        let (status, out, err) = case.run(arguments);
        assert_eq!((status, out.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(err.starts_with(message), "{arguments:?}\n{err}\n{message}");
        assert!(!case.out().join("summary.json").exists(), "{arguments:?}");
    }
    let missing = parts(&case.command(&["run", "none.toml"]).output().expect("the binary starts"));
    assert_eq!(missing.0, Some(2));
    assert!(missing.2.starts_with("error: none.toml: the scene cannot be read: "), "{}", missing.2);
    std::fs::write(case.folder.path().join("blocked"), "a file where a folder is needed").expect("written");
    let blocked = parts(&case.command(&["run", "beam.toml", "--out", "blocked"]).output().expect("the binary starts"));
    assert_eq!(blocked.0, Some(2));
    assert!(blocked.2.contains("a file stands where a folder is needed"), "{}", blocked.2);
}

#[test]
fn a_step_above_the_limit_is_warned_of_and_its_blow_up_ends_with_3_and_keeps_the_results() {
    let case = Case::new();
    let explicit =
        ["--set", "solver.integrator=semi-implicit-euler", "--set", "solver.step=0.02", "--set", "solver.duration=2.0"];
    let (status, out, err) = case.run(&explicit);
    assert_eq!(status, Some(3), "{err}");
    let (warning, error) =
        (err.find("warning: the step 2.0000e-2 s is above"), err.find("error: the simulation diverged"));
    assert!(warning.is_some() && warning < error, "{err}");
    assert!(out.starts_with("failed: "), "{out}");
    let summary = case.summary();
    assert_eq!(summary["status"], "failed");
    assert!(summary["error"].as_str().is_some_and(|e| e.contains("diverged")));
    assert_eq!(summary["warnings"].as_array().map(Vec::len), Some(1));
    assert!(lines(&case.out().join("probes.csv")) > 2);
    assert!(case.out().join("frames/frame_000000.vtu").exists());
}

#[test]
fn an_element_that_leaves_its_laws_domain_ends_with_3_and_a_case_to_replay() {
    let case = Case::new();
    let crush = [
        "--set",
        "material.0.law=neo_hookean",
        "--set",
        "solver.integrator=semi-implicit-euler",
        "--set",
        "solver.step=1e-3",
        "--set",
        "load.0.acceleration=[-9e4, 0.0, 0.0]",
    ];
    let (status, _, err) = case.run(&crush);
    assert_eq!(status, Some(3), "{err}");
    assert!(err.contains("has left the domain of law `neo_hookean` (J > 0.0)"), "{err}");
    let failure = read_json(&case.out().join("failure.json"));
    assert_eq!(failure["law"], "neo_hookean");
    assert_eq!(failure["rest_positions_m"].as_array().map(Vec::len), Some(4));
    assert_eq!(case.summary()["status"], "failed");
}

#[cfg(unix)]
#[test]
fn an_interruption_ends_the_step_writes_the_results_and_exits_with_130() {
    use std::io::{BufRead, BufReader};
    let case = Case::new();
    let mut child = case
        .command(&["run", "beam.toml", "--out", "results", "--set", "solver.duration=5000.0"])
        .stderr(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let mut first = String::new();
    let mut errors = BufReader::new(child.stderr.take().expect("piped"));
    errors.read_line(&mut first).expect("the critical steps are printed before the first step");
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(kill.success());
    // The pipe stays open until the process ends.
    let rest: Vec<String> = errors.lines().map_while(Result::ok).collect();
    let status = child.wait().expect("the process ends");
    assert_eq!(status.code(), Some(130), "{rest:?}");
    let summary = case.summary();
    assert_eq!(summary["status"], "interrupted");
    assert!(rest.iter().any(|line| line.contains("--resume results/checkpoint.tmc")), "{rest:?}");
    // Ten steps more, from where it stopped.
    let (taken, step) = (summary["steps"].as_u64().expect("steps"), summary["step_s"].as_f64().expect("a step"));
    let duration = format!("solver.duration={}", (taken + 10) as f64 * step);
    let (status, _, err) = case.run(&["--resume", "results/checkpoint.tmc", "--set", &duration]);
    assert_eq!(status, Some(0), "{err}");
    assert_eq!(case.summary()["steps"], taken + 10);
    // Every row of both parts, and its header.
    let rows = std::fs::read_to_string(case.out().join("probes.csv")).expect("probes").lines().count() as u64;
    assert_eq!(rows, 1 + 1 + taken + 10);
    let (status, _, err) = case.run(&["--resume", "beam.toml"]);
    assert_eq!(status, Some(2), "{err}");
    assert!(err.contains("--resume beam.toml: this is no checkpoint that this version can read"), "{err}");
}

#[test]
fn plan_says_what_is_computed_and_what_is_left_out() {
    let case = Case::new();
    let plan = |arguments: &[&str]| {
        let mut all = vec!["plan", "beam.toml", "--json"];
        all.extend(arguments);
        let (status, out, err) = parts(&case.command(&all).output().expect("the binary starts"));
        assert_eq!(status, Some(0), "{err}");
        serde_json::from_str::<Value>(&out).expect("JSON")
    };
    let kernels = |plan: &Value| plan["laws"][0]["operations_per_element"].as_object().expect("an object").len();
    let implicit = plan(&[]);
    let names = |plan: &Value| {
        let kernels = plan["laws"][0]["operations_per_element"].as_object().expect("an object");
        kernels.keys().cloned().collect::<Vec<_>>().join(" ")
    };
    assert_eq!(names(&implicit), "apply diagonal force", "nothing of a linear law's tangent is stored");
    let explicit = plan(&["--set", "solver.integrator=central-difference", "--set", "solver.step=1e-5"]);
    assert_eq!(kernels(&explicit), 1, "an explicit integrator needs no tangent");
    assert!(explicit["bytes_per_element"].as_f64() < implicit["bytes_per_element"].as_f64());
    // A GPU keeps more bytes an element, and six kernels an iteration; none has to be there to plan for it.
    let on_gpu = plan(&["--device", "gpu", "--precision", "f32"]);
    let on_cpu = plan(&["--device", "cpu", "--precision", "f32"]);
    assert_eq!(names(&on_gpu), "dforce diagonal force");
    assert!(on_gpu["bytes_per_element"].as_f64() > on_cpu["bytes_per_element"].as_f64(), "{on_gpu}");
    assert_eq!(on_gpu["passes"].to_string().matches("CG iteration").count(), 6, "{on_gpu}");
    let left_out = explicit["left_out"].to_string();
    for what in ["tangent stiffness", "contact: no obstacle", "fibres: no law has a direction", "stresses of elements"]
    {
        assert!(left_out.contains(what), "{what}: {left_out}");
    }
    // What passes compute and move: an explicit step has no solution and no iterations.
    let total = |plan: &Value, per: &str, what: &str| plan["totals"][per][what].as_f64().expect("a total");
    for what in ["flops_per_element", "bytes_per_element"] {
        let of_passes: f64 =
            implicit["passes"].as_array().expect("passes").iter().filter_map(|p| p[what].as_f64()).sum();
        let of_totals: f64 =
            ["step", "solution", "iteration", "record"].map(|per| total(&implicit, per, what)).iter().sum();
        assert!((of_passes - of_totals).abs() <= 1e-9 * of_totals, "{what}: {of_passes} for {of_totals}");
        assert!(total(&explicit, "step", what) > 0.0 && total(&implicit, "iteration", what) > 0.0);
        assert_eq!(total(&explicit, "solution", what) + total(&explicit, "iteration", what), 0.0);
    }
    let vectors = |plan: &Value| plan["vectors"]["in_steps"].as_u64().expect("a number");
    let still = plan(&["--set", "solver.integrator=static"]);
    assert!(vectors(&explicit) < vectors(&implicit));
    assert!(still["left_out"].to_string().contains("velocities"), "{still}");
    // As text: each pass with what it computes and moves, and what is left out.
    let (status, text, err) = parts(&case.command(&["plan", "beam.toml"]).output().expect("the binary starts"));
    assert_eq!(status, Some(0), "{err}");
    for what in ["passes of each step", "passes of each linear solution", "vectors over the nodes", "left out"] {
        assert!(text.contains(what), "{what}: {text}");
    }
}

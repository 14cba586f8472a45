//! Scenes that cannot be computed, each with its whole message, and runs that fail on their way and keep their results.

use std::fs;
use std::path::Path;

use crate::support::{numbers, parameters, parameters_text};
use serde_json::Value;
use tensormass_runtime::scene::parse;
use tensormass_runtime::simulate::{Ending, Outcome, RunError, Silent, run};
use tensormass_runtime::system::SolveError;
use tensormass_runtime::{LawEntry, laws};

/// A scene without fault, of which each case spoils one thing.
const RIGHT: &str = r#"[mesh]
beam = { size = [4, 1, 1], cells = [4, 1, 1] }

[[material]]
name = "beam"
law = "hooke"
density = 1000.0
parameters = { young = 1e6, poisson = 0.3 }

[[boundary]]
nodes = "near(x, xmin)"
fix = ["x", "y", "z"]

[[load]]
kind = "traction"
faces = "near(x, xmax)"
value = [0, 0, 10]

[solver]
integrator = "static"

[[probe]]
name = "support"
kind = "reaction"
nodes = "near(x, xmin)"
component = "z"
"#;

/// One tetrahedron inside out, for `file = "inverted.msh"`.
const INVERTED: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n\
                        $Elements\n1\n1 4 2 1 1 1 3 2 4\n$EndElements\n";

/// Young's modulus of the pushed half, in Pa.
const SOFTER: f64 = 0.9e6;

fn attempt(text: &str, folder: &Path, out: &Path) -> Result<Outcome, String> {
    let scene = parse(text, folder.join("scene.toml"), &[]).map_err(|e| e.to_string())?;
    run(&scene, Some(out), &mut Silent).map_err(|e: RunError| e.to_string())
}

/// Refuses the scene with exactly this message (DIR stands for the scene's folder, LAWS for the build's laws), and leaves nothing behind;
/// the message is given back.
fn check(text: &str, out: &str, expected: &str) -> String {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    fs::write(at.join("inverted.msh"), INVERTED).expect("a mesh file");
    fs::write(at.join("open.obj"), "v 0 0 -1\nv 1 0 -1\nv 0 1 -1\nf 1 2 3\n").expect("a surface");
    fs::write(at.join("values.csv"), "1e6\n".repeat(24)).expect("a table");
    fs::write(at.join("zero.csv"), format!("{}0, 0, -0.0\n", "0, 0, 1  # upright\n".repeat(23))).expect("a table");
    let out = at.join(out);
    let before = fs::read_dir(at).expect("a folder").count();
    let names = laws().iter().map(|l| l.info.name).collect::<Vec<_>>().join(", ");
    let message = match attempt(text, at, &out) {
        Ok(outcome) => format!("accepted: {:?}", outcome.ending),
        Err(message) => message.replace(&at.display().to_string(), "DIR").replace(&names, "LAWS"),
    };
    let accepts = std::env::var_os("UPDATE_MESSAGES").is_some();
    assert!(accepts || message == expected, "\n--- expected\n{expected}\n--- found\n{message}\n--- for\n{text}");
    assert_eq!(fs::read_dir(at).expect("a folder").count(), before, "something was written: {message}");
    message
}

/// With UPDATE_MESSAGES set, the messages found replace those of the file, to be read before they are kept.
#[test]
fn each_has_its_message() {
    let right = tempfile::tempdir().expect("a temporary folder");
    let outcome = attempt(RIGHT, right.path(), &right.path().join("out")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(outcome.ending, Ending::Done, "the scene to spoil must be right");
    let (head, cases) = include_str!("failures.txt").split_once("\n## ").expect("cases");
    let (mut count, mut all) = (0, head.to_string());
    for case in cases.split("\n## ") {
        let (header, expected) = case.split_once('\n').expect("a header and a message");
        let expected = expected.trim_end();
        let found = match (header.strip_prefix("out "), header.split_once(" => ")) {
            (Some(out), _) => check(RIGHT, out, expected),
            (None, Some((from, to))) => {
                let [from, to] = [from, to].map(|part| part.replace("\\n", "\n"));
                assert!(RIGHT.contains(&from), "the right scene has no {from:?}");
                check(&RIGHT.replacen(&from, &to, 1), "out", expected)
            }
            (None, None) => panic!("what is `{header}`?"),
        };
        all += &format!("\n## {header}\n{found}\n");
        count += 1;
    }
    assert!(count > 15, "failures.txt has {count} cases");
    if std::env::var_os("UPDATE_MESSAGES").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/failures.txt");
        fs::write(path, all).expect("the file of cases can be written");
    }
}

/// A beam pushed inside out by an imposed motion too fast for its elements to follow. The half that is pushed is softer.
fn pushed(law: &LawEntry) -> String {
    let (law, parameters) = (law.info.name, parameters_text(law));
    let softer = parameters.replace("1000000.0", &format!("{SOFTER:?}"));
    format!(
        r#"[mesh]
beam = {{ size = [4, 1, 1], cells = [4, 1, 1] }}
[[material]]
law = "{law}"
density = 1000.0
elements = "x < 2"
parameters = {parameters}
[[material]]
law = "{law}"
density = 1000.0
elements = "x > 2"
parameters = {softer}
[[boundary]]
nodes = "near(x, xmin)"
fix = ["x", "y", "z"]
[[boundary]]
nodes = "near(x, xmax)"
move = {{ x = {{ ramp = [[0.0, 0.0], [0.004, 0.0], [0.0042, -2.5]] }} }}
[solver]
integrator = "central-difference"
step = 1e-4
duration = 0.02
[[probe]]
name = "end"
kind = "displacement"
nodes = "near(x, xmax)"
component = "x"
[output]
every = 10
"#
    )
}

/// Every law that has a domain: the run ends where an element leaves it, names the element, and keeps all before.
#[test]
fn an_element_that_leaves_its_domain_is_named() {
    let mut checked = 0;
    for law in laws() {
        // The motion turns elements inside out; a narrower domain would be left at another step.
        let Some(domain @ "J > 0.0") = law.info.domain else { continue };
        let name = law.info.name;
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scene = pushed(law);
        let outcome = attempt(&scene, folder.path(), folder.path()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let Ending::Failed(SolveError::LeftDomain(left)) = &outcome.ending else {
            panic!("{name}: {:?}", outcome.ending);
        };
        assert_eq!((left.law.as_str(), left.domain.as_str()), (name, domain));
        let read = |file: &str| fs::read_to_string(folder.path().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        let json = |file: &str| serde_json::from_str::<Value>(&read(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        let (summary, failure) = (json("summary.json"), json("failure.json"));
        assert_eq!(summary["status"], "failed", "{name}");
        let steps = summary["steps"].as_u64().expect("a count") as usize;
        // 40 steps of rest, then two of 1.25 m each against a cell of 1 m.
        assert!((41..=43).contains(&steps), "{name}: {steps} steps");
        assert_eq!(read("probes.csv").lines().count(), steps + 2, "{name}: a header, a row at rest and one a step");
        let frames = read("frames.pvd").matches("<DataSet").count();
        assert_eq!(frames, 6, "{name}: four, the one at rest and the last state");
        // The case file has all that its element needs to be evaluated again, and with it the element is inside out.
        assert_eq!(failure["law"], name);
        assert_eq!(failure["element"], left.element);
        let mut own = parameters(law);
        own.iter_mut().filter(|p| **p == 1e6).for_each(|p| *p = SOFTER);
        assert_eq!(failure["parameters"], serde_json::json!(own), "{name}");
        let place = |key: &str, node: usize| numbers::<3>(&failure[key][node]);
        let corner = |n| {
            let (x, u) = (place("rest_positions_m", n), place("last_displacements_m", n));
            nalgebra::Vector3::from_fn(|c, _| x[c] + u[c])
        };
        let edges = [1, 2, 3].map(|n| corner(n) - corner(0));
        let volume = edges[0].cross(&edges[1]).dot(&edges[2]) / 6.0;
        assert!(volume <= 0.0, "{name}: the last state's volume is {volume}");
        checked += 1;
    }
    assert!(checked > 0, "no law of this build has a domain");
}

/// The same motion is nothing to a law without a domain.
#[test]
fn a_law_without_a_domain_goes_on() {
    let law = laws().iter().find(|l| l.info.structure.linear).expect("a linear law");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = pushed(law);
    let outcome = attempt(&scene, folder.path(), folder.path()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(outcome.ending, Ending::Done);
    assert!(!folder.path().join("failure.json").exists());
}

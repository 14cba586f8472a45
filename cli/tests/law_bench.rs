//! The commands that examine laws, called as a user calls them: what they print, write and refuse, and with which status.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// A law whose derivation beside it, written by hand, loses digits.
const LOSSY: &str = "lawbench/tests/data/loses_digits.rs";
/// A linear law: there is nothing to lose.
const LINEAR: &str = "hooke";

fn call(arguments: &[&str]) -> Output {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let mut command = Command::new(env!("CARGO_BIN_EXE_tensormass"));
    command.arg("law").args(arguments).current_dir(root).output().expect("the binary starts")
}

/// Standard and error output of a call that has to end with this status.
fn check(status: i32, arguments: &[&str]) -> (String, String) {
    let output = call(arguments);
    let [out, error] = [&output.stdout, &output.stderr].map(|t| String::from_utf8_lossy(t).into_owned());
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {out}{error}");
    (out, error)
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn extremes_passes_or_fails_by_the_gate() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("new/results");
    let out = out.to_str().expect("UTF-8");
    let (text, _) = check(0, &["extremes", LINEAR, "--samples", "1", "--device", "cpu", "--out", out]);
    assert!(text.contains("within the gate everywhere") && text.contains("wgsl: skipped"), "{text}");
    for (file, start) in [("hooke.csv", "machine,quantity,"), ("hooke.svg", "<svg ")] {
        let written = std::fs::read_to_string(Path::new(out).join(file)).expect(file);
        assert!(written.starts_with(start), "{file}");
    }
    let (text, error) = check(3, &["extremes", LOSSY, "--samples", "1", "--device", "cpu"]);
    assert!(
        text.contains("above the gate: P in f32") && error.starts_with("error: above the gate: loses_digits"),
        "{error}"
    );
    let (text, _) = check(3, &["extremes", LOSSY, "--samples", "1", "--device", "cpu", "--json"]);
    let data = json(&text);
    let law = &data[0];
    assert_eq!(law["law"], "loses_digits");
    assert!(law["failures"].as_array().is_some_and(|f| !f.is_empty()) && law["wgsl"]["skipped"].is_string());
    assert!(law["cells"].as_array().is_some_and(|c| c.iter().any(|c| c["gate"].as_f64() > Some(1e5))));
}

/// What extremes prints above the gate is a command, and gives the same number again.
#[test]
fn replay_shows_a_state_again() {
    let (text, _) = check(3, &["extremes", LOSSY, "--samples", "1", "--device", "cpu"]);
    let (failure, line) = (text.find("above the gate: P in f32: "), text.find("tensormass law replay "));
    let times = text[failure.expect("a failure") + 26..].split(' ').next().expect("a number");
    let line = text[line.expect("a command") + 15..].lines().next().expect("a line");
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let (text, error) = check(3, &[&arguments[..], &["--json"]].concat());
    assert!(error.starts_with("error: above the gate: P in f32"), "{error}");
    let rows = json(&text);
    let row = rows.as_array().expect("a list").iter().find(|r| r["machine"] == "f32" && r["quantity"] == "P");
    let gate = row.and_then(|r| r["gate"].as_f64()).expect("a number");
    assert_eq!(format!("{gate:.3e}"), times);
    // The roundings explain it: they are listed by weight, and their sum is of the error's size.
    let row = row.expect("found above");
    let expected = row["expected"].as_f64().expect("a number");
    assert!(expected > gate / 10.0, "{expected} of {gate}");
    let weights = row["roundings"].as_array().expect("a list").iter().map(|r| r[1].as_f64().expect("a weight"));
    assert!(weights.is_sorted_by(|a, b| a >= b), "{row}");
    let (text, _) = check(3, &arguments);
    assert!(text.contains("quantity  in") && text.contains(" only "), "{text}");
    assert!(text.contains("by the roundings of"), "{text}");
    let few = check(2, &["replay", LINEAR, "--gradient=1,2"]).1;
    assert!(few.contains("--gradient has 2 numbers"), "{few}");
    let outside = check(2, &["replay", "neo_hookean", "--gradient=-2,0,0,0,0,0,0,0,0"]).1;
    assert!(outside.contains("J > 0.0"), "{outside}");
    check(0, &["replay", "neo_hookean", "--set", "poisson=0.3", "--gradient=1e-3,0,0,0,-1e-4,0,0,2e-3,0"]);
}

#[test]
fn check_lists_findings() {
    let (text, _) = check(0, &["check", LINEAR, "--samples", "1", "--device", "cpu"]);
    for words in ["symmetric tangent", "small-strain moduli", "as every law of the small strain"] {
        assert!(text.contains(words), "{text}");
    }
    assert!(!text.contains("FAILED"), "{text}");
    let (text, error) = check(3, &["check", LOSSY, "--samples", "1", "--device", "cpu", "--json"]);
    let report = json(&text);
    let failed: Vec<&Value> =
        report["findings"].as_array().expect("a list").iter().filter(|f| f["verdict"] == "failed").collect();
    assert_eq!(failed.len(), 1, "{text}");
    assert!(error.contains("accurate in f32"), "{error}");
}

#[test]
fn drive_prints_or_writes_a_curve() {
    let set = ["--set", "young=2e5", "--set", "poisson=0.25"];
    let arguments = ["drive", "uniaxial", LINEAR, "--from", "0.9", "--to", "1.1", "--points", "3"];
    let (text, _) = check(0, &[&arguments[..], &set].concat());
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|l| l.split(',').map(|x| x.parse().expect("a number")).collect()).collect();
    assert_eq!(rows.len(), 3);
    for row in rows {
        // P11 = E eps, G22 = -nu eps; columns: stretch, nominal stress, ..., then G.
        let strain = row[0] - 1.0;
        assert!((row[1] - 2e5 * strain).abs() < 1e-6, "{text}");
        assert!((row[6 + 4] + 0.25 * strain).abs() < 1e-12, "{text}");
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().to_str().expect("UTF-8");
    check(0, &["drive", "cyclic", LINEAR, "--points", "5", "--out", out]);
    for file in ["hooke-cyclic.csv", "hooke-cyclic.svg"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
    let (text, _) = check(0, &["drive", "shear", LINEAR, "--points", "2", "--json"]);
    assert_eq!(json(&text)["points"].as_array().map(Vec::len), Some(2));
}

#[test]
fn explain_shows_formulas() {
    let (text, _) = check(0, &["explain", LINEAR]);
    assert!(text.contains("c0 = ") && text.contains("force: ") && text.contains("dforce: "), "{text}");
}

#[test]
fn what_is_wrong_is_said() {
    let cases: [(&[&str], &str); 9] = [
        (&["extremes", "hoke"], "did you mean `hooke`"),
        (&["extremes"], "NAME_OR_FILE"),
        (&["extremes", "hooke", "--all"], "--all"),
        (&["extremes", "hooke", "--samples", "0"], "--samples"),
        (&["check", "nowhere/law.rs"], "nowhere/law.rs"),
        (&["drive", "sideways", "hooke"], "uniaxial, biaxial"),
        (&["drive", "uniaxial", "hooke", "--set", "yung=1"], "`young`"),
        (&["drive", "uniaxial", "hooke", "--set", "young=-1"], "1000000000000.0"),
        (&["drive", "uniaxial", "hooke", "--from", "2", "--to", "1"], "--from below --to"),
    ];
    for (arguments, word) in cases {
        let (_, error) = check(2, arguments);
        assert!(error.contains(word), "{arguments:?}: {error}");
    }
}

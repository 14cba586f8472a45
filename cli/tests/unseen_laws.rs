//! Laws of the literature that this workspace does not build in, each written as its source prints it: derived by the
//! program, hyperelastic, of the moduli that they declare, and within the gate.

use std::path::Path;
use std::process::Command;

use tensormass_lawbench::check::{Verdict, check};
use tensormass_lawbench::extremes::{Options, extremes};
use tensormass_lawbench::subject::Subject;

/// Laws that spend up to three times the bounds of the gate: in the textbook form of their stress and of their tangent at rest,
/// numbers up to ten times the sum cancel (I2/I3 is tr C^-1, which no part of the one knows).
const BEYOND: [&str; 2] = ["blatz_ko", "veronda_westmann"];

/// What is examined of a law, as a user's `law check` and `law extremes` do with fewer states.
fn faults(path: &Path) -> Vec<String> {
    let subject = Subject::open(path.to_str().expect("UTF-8")).expect("derived beside it");
    let name = subject.name().to_string();
    let report = check(&subject, Options { samples: 0, seed: 2 }, Err("not asked for".into())).expect("a material");
    let mut faults: Vec<String> = report.failed().iter().map(|f| format!("{name}: {f}")).collect();
    let compared = report.findings.iter().filter(|f| f.name == "declared small-strain moduli");
    let compared = compared.filter(|f| f.verdict == Verdict::Passed).count();
    assert_eq!(compared, usize::from(subject.law.moduli.is_some()), "{name}: its moduli are compared");
    let measured = extremes(&subject, Options { samples: 1, seed: 2 }, Err("not asked for".into()));
    let failures = measured.expect("a material").failures();
    if !BEYOND.contains(&name.as_str()) {
        faults.extend(failures.iter().map(|f| format!("{name}: {f}")));
    }
    faults
}

#[test]
fn laws_of_the_literature_pass() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/laws");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut names: Vec<String> = vec![];
    for entry in std::fs::read_dir(&data).expect("the data") {
        let name = entry.expect("an entry").file_name().into_string().expect("UTF-8");
        std::fs::copy(data.join(&name), folder.path().join(&name)).expect("copied");
        names.push(name);
    }
    // Nearly linear in (I1bar - 3) / J_m: the digits of its energy far from rest are kept, too.
    let gent = data.join("../../../../examples/custom-law/laws/gent.rs");
    std::fs::copy(gent, folder.path().join("gent.rs")).expect("copied");
    names.push("gent.rs".into());
    names.sort();
    assert!(names.len() > 6, "only {names:?}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_tensormass"));
    command.current_dir(folder.path()).args(["law", "derive", "--out", "derived"]).args(&names);
    let output = command.output().expect("the binary starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let faults: Vec<String> = names.iter().flat_map(|name| faults(&folder.path().join(name))).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A modulus that is declared wrongly fails `law check`, which names it.
#[test]
fn a_wrong_modulus_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = include_str!("data/laws/blatz_ko.rs").replace("lame_lambda = mu", "lame_lambda = 2.0 * mu");
    std::fs::write(folder.path().join("wrong.rs"), text).expect("written");
    let mut command = Command::new(env!("CARGO_BIN_EXE_tensormass"));
    command.current_dir(folder.path()).args(["law", "check", "wrong.rs", "--samples", "1", "--device", "cpu"]);
    let output = command.output().expect("the binary starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("law `wrong` fails: ") && said.contains("declared small-strain moduli"), "{said}");
}

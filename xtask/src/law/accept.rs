//! `cargo xtask law accept NAME`: writes what makes a law part of the default build, for review and commit.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::process::{Failure, UNOPTIMISED, cargo, files, program, root, run, say, stems};

/// The Python packages of the SymPy script, as .ci/run pins them.
const PYTHON_PACKAGES: &str = "sympy==1.14.0 mpmath==1.3.0";

/// Derivation, then snapshots, then SymPy values: each needs those before it.
///
/// # Errors
/// The law file is missing, a step fails, or Python is missing, so that a step is left to do.
pub fn call(name: &str) -> Result<(), Failure> {
    let laws = stems("laws", "rs");
    if !laws.iter().any(|law| law == name) {
        return Err(Failure::Usage(format!("there is no laws/{name}.rs; the laws are: {}", laws.join(", "))));
    }
    let before = contents();
    let tensormass = ["run", "--package", "tensormass", "--features", "derive"];
    let derive = ["--", "law", "derive", name, "--out", "laws/derived"];
    run("derivation", cargo(&[&tensormass[..], &UNOPTIMISED, &derive].concat()))?;
    let mut snapshots = cargo(&["test", "--package", "tensormass-kernels", "--test", "snapshots"]);
    // What differs is what is to be reviewed: it is written, and no reason to fail.
    snapshots.env("INSTA_UPDATE", "always").env("INSTA_FORCE_PASS", "1");
    run("snapshots", snapshots)?;
    let left_to_do = sympy(name)?;
    report(name, &before);
    left_to_do.map_or(Ok(()), |message| Err(Failure::Step(message)))
}

/// Writes the SymPy values; if that cannot be done here, says what to do.
fn sympy(name: &str) -> Result<Option<String>, Failure> {
    let script = ["tests/python/sympy_reference.py", name];
    let has_sympy = program("python3", &["-c", "import sympy, mpmath"]).output().is_ok_and(|o| o.status.success());
    if has_sympy {
        run("SymPy values", program("python3", &script))?;
        return Ok(None);
    }
    Ok(Some(format!(
        "left to do: the SymPy values, since there is no python3 with sympy and mpmath here. Run\n  \
         python3 -m pip install {PYTHON_PACKAGES}   (in a virtual environment)\n  python3 {}",
        script.join(" ")
    )))
}

/// What each file that may be written holds.
fn contents() -> BTreeMap<PathBuf, Vec<u8>> {
    let mut contents = BTreeMap::new();
    for folder in ["laws/derived", "tests"] {
        for path in files(&root().join(folder)) {
            if let Ok(bytes) = std::fs::read(&path) {
                contents.insert(path, bytes);
            }
        }
    }
    contents
}

fn report(name: &str, before: &BTreeMap<PathBuf, Vec<u8>>) {
    let after = contents();
    let written: Vec<_> = after.iter().filter(|(path, bytes)| before.get(*path) != Some(*bytes)).collect();
    if written.is_empty() {
        return say(&format!("\nNothing changed: what is there for `{name}` fits laws/{name}.rs."));
    }
    say("\nWritten:");
    for (path, _) in &written {
        let verb = if before.contains_key(*path) { "changed" } else { "new" };
        say(&format!("  {verb:<8}{}", path.strip_prefix(root()).unwrap_or(path).display()));
    }
    say(&format!(
        "\nPlease review these files (`git diff`), above all those of laws other than `{name}`: their change is yours \
         to explain.\nThen commit them together with laws/{name}.rs."
    ));
}

//! Faults planted into a copy of the workspace, and the cells of the short suite that they turn wrong.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Stdio;

use crate::process::{Failure, cargo, program, read, root, say};

/// A fault: what it is, and the one place that is changed.
struct Fault {
    what: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
}

const FAULTS: [Fault; 4] = [
    Fault {
        what: "constraint: the first one is left out",
        file: "runtime/src/cpu/vectors.rs",
        from: "let constraints = placed_constraints(body, &places);",
        to: "let constraints: Vec<_> = placed_constraints(body, &places).into_iter().skip(1).collect();",
    },
    Fault {
        what: "kernel: printed constants have four digits",
        file: "codegen/src/print/rust/kernel.rs",
        from: "    signed(<f64 as crate::ir::Number>::from_rational(q))\n",
        to: "    let exact = <f64 as crate::ir::Number>::from_rational(q);\n    signed(format!(\"{exact:.3e}\").parse().unwrap_or(exact))\n",
    },
    Fault {
        what: "series: the second coefficient of the logarithm is .49",
        file: "kernels/src/lanes/functions.rs",
        from: "let half_square = V::from_f64(0.5) * f * f;",
        to: "let half_square = V::from_f64(0.49) * f * f;",
    },
    Fault {
        what: "exit of conjugate gradients: a thousand times too early",
        file: "runtime/src/cg.rs",
        from: "s[TARGET] = s[TARGET] * s[REFERENCE];",
        to: "s[TARGET] = S::number(1e6) * s[TARGET] * s[REFERENCE];",
    },
];

/// The section: what each fault turns wrong.
///
/// # Errors
/// The workspace cannot be copied or built, or a fault's place is not there once.
pub fn section() -> Result<String, Failure> {
    let place = root().join("target/planted");
    let tree = place.join("tree");
    copy(&tree)?;
    let mut text = "\nEach is planted into a copy of the workspace, where the short suite has to find it \
                    (`cargo xtask extremes --planted`):\n\n| fault | cells that turn wrong |\n|---|---|\n"
        .to_string();
    for fault in &FAULTS {
        say(&format!("== planted: {}", fault.what));
        let found = plant(fault, &tree, &place.join("target"))?;
        if found.is_empty() {
            return Err(Failure::Step(format!("planted: no cell finds this fault: {}", fault.what)));
        }
        say(&format!("{} cells are wrong", found.len()));
        let _ = writeln!(text, "| {} | {} |", fault.what, words(&found));
    }
    Ok(text)
}

fn copy(tree: &Path) -> Result<(), Failure> {
    let files = read("git ls-files", program("git", &["ls-files"]))?;
    let failed = |what: &str, e: std::io::Error| Failure::Step(format!("planted: {what}: {e}"));
    if tree.exists() {
        std::fs::remove_dir_all(tree).map_err(|e| failed("cannot remove the copy of before", e))?;
    }
    for file in files.lines() {
        let to = tree.join(file);
        let folder = to.parent().unwrap_or(tree);
        std::fs::create_dir_all(folder).map_err(|e| failed(file, e))?;
        std::fs::copy(root().join(file), &to).map_err(|e| failed(file, e))?;
    }
    Ok(())
}

/// The lines of the suite that name what is wrong.
fn plant(fault: &Fault, tree: &Path, target: &Path) -> Result<Vec<String>, Failure> {
    let path = tree.join(fault.file);
    let failed = |e: std::io::Error| Failure::Step(format!("planted: {}: {e}", fault.file));
    let text = std::fs::read_to_string(&path).map_err(failed)?;
    if text.matches(fault.from).count() != 1 {
        return Err(Failure::Step(format!("planted: {} has not once: {}", fault.file, fault.from)));
    }
    std::fs::write(&path, text.replacen(fault.from, fault.to, 1)).map_err(failed)?;
    let arguments = ["run", "--release", "--quiet", "--package", "tensormass-stability", "--", "--short"];
    let mut command = cargo(&arguments);
    let output = command.current_dir(tree).env("CARGO_TARGET_DIR", target).stdout(Stdio::null()).output();
    std::fs::write(&path, text).map_err(failed)?;
    let output = output.map_err(failed)?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.code() != Some(super::WRONG) && !output.status.success() {
        return Err(Failure::Step(format!("planted: {}: {}\n{said}", fault.what, output.status)));
    }
    Ok(said.lines().filter_map(|line| line.strip_prefix("wrong: ")).map(str::to_string).collect())
}

/// How many cells of each extreme are wrong, with the first of them.
fn words(found: &[String]) -> String {
    let mut each: BTreeMap<&str, usize> = BTreeMap::new();
    for line in found {
        *each.entry(line.split(' ').next().unwrap_or_default()).or_default() += 1;
    }
    let counts: Vec<String> = each.iter().map(|(extreme, n)| format!("{extreme} {n}")).collect();
    format!("{} ({}), such as: {}", found.len(), counts.join(", "), found[0])
}

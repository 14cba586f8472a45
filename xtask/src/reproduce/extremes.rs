//! `cargo xtask reproduce extremes`: makes docs/extremes.md from `tensormass law extremes` of every law.

use std::process::Stdio;

use crate::process::{Failure, cargo, root, say};

/// The exit status of the program where a law is above the gate: a result too.
const ABOVE: i32 = 3;

const INTRODUCTION: &str = "\
<!-- Made by `cargo xtask reproduce extremes`. Do not edit: change xtask/src/reproduce/extremes.rs and make it again. -->
# Accuracy of every law, from strains of 1e-8 to 10

`cargo xtask reproduce extremes` writes this page from `tensormass law extremes --all`. Each law is measured at random
principal stretches of each strain, unrotated and turned by 0.001, 0.1, 0.5 and 2 rad, at a usual material and at nearly
incompressible ones. Errors are against exact values, computed in 448 bits from the law's textbook form for G as rounded
to the precision and for the parameters as given.

With u the unit round-off and Frobenius norms, the *gate* is the greatest error as a part of its bound:

- P: 4 u (|dP/dG| |G| + |P|)
- W: 8 u (|P| |G| + |W|) + (8 u)^2 |dP/dG| |G|^2 / 2
- dP in the direction D: 4 u (|d2P/dG2[D]| |G| + |dP/dG| |D|)

and twice as much for WGSL. *relative* is the greatest error as a part of the value where nothing is rotated, *turned*
where it is: what rounding the input costs cannot be won back, and this column says how much it is.
";

/// Runs all and writes the page.
///
/// # Errors
/// The program does not build or run; the page cannot be written.
pub fn call() -> Result<(), Failure> {
    say("== tensormass law extremes --all");
    let arguments = ["run", "--release", "--quiet", "--package", "tensormass", "--", "law", "extremes", "--all"];
    let mut command = cargo(&arguments);
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| Failure::Step(format!("law extremes: cannot run cargo: {error}")))?;
    if !output.status.success() && output.status.code() != Some(ABOVE) {
        return Err(Failure::Step(format!("law extremes: {}; see above", output.status)));
    }
    let text = String::from_utf8(output.stdout).map_err(|error| Failure::Step(format!("law extremes: {error}")))?;
    std::fs::write(root().join("docs/extremes.md"), page(&text))
        .map_err(|e| Failure::Step(format!("cannot write docs/extremes.md: {e}; make the folder writable")))?;
    say("wrote docs/extremes.md: review and commit it");
    Ok(())
}

/// The page: a section a law. A law's name stands alone on a line, after an empty one.
fn page(text: &str) -> String {
    let mut page = INTRODUCTION.to_string();
    let mut lines = text.lines().peekable();
    let mut open = false;
    let mut before = "";
    while let Some(line) = lines.next() {
        let law = !line.is_empty() && !line.contains(' ') && before.is_empty();
        if law && lines.peek().is_some_and(|next| next.starts_with("  nu = ")) {
            page += if open { "```\n" } else { "" };
            page += &format!("\n## {line}\n\n```text\n");
            open = true;
        } else if !(line.is_empty() && lines.peek().is_none_or(|next| !next.contains(' '))) {
            page += line;
            page.push('\n');
        }
        before = line;
    }
    page + if open { "```\n" } else { "" }
}

#[cfg(test)]
mod tests {
    use super::page;

    #[test]
    fn every_law_has_a_section() {
        let text = "one\n  nu = 0.3000: c = 1.0\n\nf32: worst\nstrain P\n\nwithin the gate everywhere\n\ntwo\n  nu = 0.3000: d = 1.0\n";
        let page = page(text);
        assert!(page.contains("\n## one\n\n```text\n  nu = 0.3000: c = 1.0\n\nf32: worst\n"), "{page}");
        assert!(page.contains("everywhere\n```\n\n## two\n\n```text\n  nu = 0.3000: d = 1.0\n```\n"), "{page}");
    }
}

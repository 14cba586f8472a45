//! `cargo xtask law unreviewed`: refuses committed laws whose derivation was not reviewed and committed with them.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::process::{Failure, UNOPTIMISED, cargo, program, read, say};

/// Compares the committed files with what `tensormass law list --json` says of each law.
///
/// # Errors
/// A law is unreviewed, a derivation is not committed or has no law, or a program cannot be run.
pub fn call() -> Result<(), Failure> {
    let laws = committed("laws", "rs")?;
    let derivations = committed("laws/derived", "ir")?;
    let run = ["run", "--quiet", "--package", "tensormass", "--features", "derive"];
    let list = [&run[..], &UNOPTIMISED, &["--", "law", "list", "--json"]].concat();
    let reviewed = reviewed(&read("law list", cargo(&list))?)?;
    let mut faults = Vec::new();
    for law in &laws {
        if !reviewed.contains(law) {
            faults.push(format!("laws/{law}.rs is unreviewed: laws/derived/{law}.ir is missing or of another text"));
        } else if !derivations.contains(law) {
            faults.push(format!("laws/derived/{law}.ir is not committed"));
        }
    }
    for name in derivations.difference(&laws) {
        faults.push(format!("laws/derived/{name}.ir has no laws/{name}.rs: delete it"));
    }
    if faults.is_empty() {
        say(&format!("{} laws, all reviewed", laws.len()));
        return Ok(());
    }
    let remedy = "Remedy for a law: `cargo xtask law accept NAME`, review what it writes, commit that too.";
    Err(Failure::Step(format!("{}\n{remedy}", faults.join("\n"))))
}

/// The stems of the files that git has in a folder, itself only.
fn committed(folder: &str, extension: &str) -> Result<BTreeSet<String>, Failure> {
    let listed = read("git ls-files", program("git", &["ls-files", "-z", "--", folder]))?;
    let wanted =
        |path: &&Path| path.parent() == Some(Path::new(folder)) && path.extension().is_some_and(|e| e == extension);
    Ok(listed
        .split('\0')
        .map(Path::new)
        .filter(wanted)
        .filter_map(|path| Some(path.file_stem()?.to_str()?.to_string()))
        .collect())
}

/// The names of the laws that the list calls reviewed.
fn reviewed(list: &str) -> Result<BTreeSet<String>, Failure> {
    let unreadable = |what: &str| Failure::Step(format!("law list --json: {what}"));
    let list: Value = serde_json::from_str(list).map_err(|error| unreadable(&error.to_string()))?;
    let laws = list.as_array().ok_or_else(|| unreadable("not an array"))?;
    let mut names = BTreeSet::new();
    for law in laws {
        let name = law["name"].as_str().ok_or_else(|| unreadable("a law without a name"))?;
        if law["reviewed"].as_bool().ok_or_else(|| unreadable("a law without `reviewed`"))? {
            names.insert(name.to_string());
        }
    }
    Ok(names)
}

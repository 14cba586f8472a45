//! `tensormass law`, called as a user calls it: what it prints, writes and refuses, and with which exit status.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tensormass_codegen::derivation::{self, Derivation};

/// A law that this workspace does not build in, and its reviewed derivation.
const GENT: &str = include_str!("../../examples/custom-law/laws/gent.rs");
const GENT_DERIVED: &str = include_str!("../../examples/custom-law/laws/derived/gent.ir");

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn tensormass(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tensormass"));
    command.args(arguments).current_dir(root());
    command
}

/// Standard output of a call that has to succeed without a word on the error output.
fn succeed(arguments: &[&str]) -> String {
    let output = tensormass(arguments).output().expect("the binary starts");
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()), "{arguments:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Error output of a call that has to end with exit status 2 and print nothing else.
fn refused(arguments: &[&str]) -> String {
    let output = tensormass(arguments).output().expect("the binary starts");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
    assert!(output.stdout.is_empty(), "{arguments:?}");
    stderr(&output)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&succeed(arguments)).expect("JSON")
}

/// The built-in laws, as `law list --json` gives them.
fn laws() -> Vec<Value> {
    json(&["law", "list", "--json"]).as_array().expect("an array").clone()
}

fn text<'v>(value: &'v Value, key: &str) -> &'v str {
    value[key].as_str().unwrap_or_else(|| panic!("`{key}` is not a text in {value}"))
}

/// A folder with one law file in it.
fn law_file(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("written");
    (folder, path)
}

fn utf8(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[test]
fn list_has_every_law_file() {
    let list = succeed(&["law", "list"]);
    let mut files = 0;
    for entry in std::fs::read_dir(root().join("laws")).expect("laws/") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|e| e == "rs") {
            files += 1;
            let name = path.file_stem().and_then(|s| s.to_str()).expect("UTF-8");
            let law = std::fs::read_to_string(&path).expect("readable");
            let title = law.lines().next().and_then(|l| l.strip_prefix("//! ")).expect("a doc comment");
            let line = list.lines().find(|l| l.split_whitespace().next() == Some(name)).expect(name);
            assert!(line.ends_with(title), "{line}");
        }
    }
    assert_eq!(list.lines().count(), files);
    assert_eq!(laws().len(), files);
}

#[test]
fn reviewed_is_a_law_with_a_fresh_committed_derivation() {
    let list = succeed(&["law", "list"]);
    for law in laws() {
        let name = text(&law, "name");
        let committed = std::fs::read_to_string(root().join(format!("laws/derived/{name}.ir"))).unwrap_or_default();
        let fresh = committed.lines().any(|l| l == format!("hash {}", text(&law, "hash")));
        assert_eq!(law["reviewed"], fresh, "{name}");
        let mut words = list.lines().find(|l| l.starts_with(&format!("{name} "))).expect(name).split_whitespace();
        assert_eq!(words.nth(1), Some(if fresh { "reviewed" } else { "unreviewed" }), "{name}");
    }
}

#[test]
fn show_prints_what_json_has() {
    for law in laws() {
        let name = text(&law, "name");
        assert_eq!(json(&["law", "show", name, "--json"]), law);
        let page = succeed(&["law", "show", name]);
        let shows = |what: &str| assert!(page.contains(what), "`law show {name}` lacks `{what}`:\n{page}");
        text(&law, "docs").lines().for_each(|line| shows(line.trim()));
        shows(law["domain"].as_str().unwrap_or("everywhere"));
        shows(law["moduli"].as_str().unwrap_or("not declared"));
        let trusted = law["valid_stretches"].as_array();
        shows(&trusted.map_or("not declared".to_owned(), |range| format!("{} to {}", range[0], range[1])));
        for parameter in law["parameters"].as_array().expect("an array") {
            ["name", "unit", "docs"].iter().for_each(|key| shows(text(parameter, key).trim()));
        }
        law["constants"].as_array().expect("an array").iter().for_each(|c| shows(c.as_str().expect("a text")));
        for operations in law["operations"].as_array().expect("an array") {
            let kernel = text(operations, "kernel");
            let line = page.lines().rfind(|l| l.split_whitespace().next() == Some(kernel)).expect(kernel);
            let sum = operations["arithmetic"].to_string();
            assert_eq!(line.split_whitespace().nth(4), Some(sum.as_str()), "{name}: {line}");
        }
    }
}

#[test]
fn show_gives_units_ranges_and_structure() {
    let law = json(&["law", "show", "neo_hookean", "--json"]);
    let poisson = &law["parameters"][1];
    assert_eq!(poisson["range"], serde_json::json!([-0.9, 0.4999]));
    assert_eq!((text(poisson, "unit"), &poisson["default"]), ("1", &Value::Null));
    assert_eq!(law["domain"], "J > 0.0");
    let structure = serde_json::json!({
        "linear": false, "isotropic": true, "uses_j": true, "uses_fibres": false, "polynomial": false
    });
    assert_eq!(law["structure"], structure);
    assert_eq!(json(&["law", "show", "hooke", "--json"])["structure"]["linear"], true);
    assert!(succeed(&["law", "show", "neo_hookean"]).contains("1 to 1e12"));
}

#[test]
fn show_tells_directions_from_arrays() {
    let mut found = 0;
    for law in laws() {
        let name = text(&law, "name");
        let page = succeed(&["law", "show", name]);
        let parameters = law["parameters"].as_array().expect("an array");
        let direction = |p: &&Value| p["direction"] == true;
        for p in parameters.iter().filter(direction) {
            let line = page.lines().find(|l| l.trim().starts_with(text(p, "name"))).expect("a line a parameter");
            assert!(line.contains(" direction ") && !line.contains('['), "{name}: {line}");
            assert_eq!(p["components"], 3, "{name}");
            found += 1;
        }
        let uses = parameters.iter().any(|p| direction(&p));
        assert_eq!(law["structure"]["uses_fibres"], uses, "{name}");
        let says = |fact: &str, yes: bool| {
            let line = page.lines().find(|l| l.starts_with(fact)).unwrap_or_else(|| panic!("{name}: no `{fact}`"));
            assert!(line.ends_with(if yes { "yes" } else { "no" }), "{name}: {line}");
        };
        says("uses fibres", uses);
        says("isotropic", !uses);
    }
    assert!(found > 0, "no law of this build has a direction");
}

#[test]
fn an_unknown_law_is_refused_with_a_suggestion_and_the_list() {
    let near = refused(&["law", "show", "neo_hokean"]);
    assert!(near.starts_with("error: there is no law `neo_hokean`; did you mean `neo_hookean`? "), "{near}");
    let far = refused(&["law", "show", "zzz"]);
    assert!(!far.contains("did you mean"), "{far}");
    for law in laws() {
        assert!(near.contains(text(&law, "name")) && far.contains(text(&law, "name")), "{near}{far}");
    }
    let name = refused(&["law", "derive", "hoke", "--out", "target"]);
    assert!(name.contains("laws/hoke.rs") && name.contains("did you mean `hooke`?"), "{name}");
}

#[test]
fn a_new_law_file_is_derived() {
    let (folder, path) = law_file("gent.rs", GENT);
    let out = folder.path().join("new/derived");
    let said = succeed(&["law", "derive", utf8(&path), "--out", utf8(&out)]);
    let written = std::fs::read_to_string(out.join("gent.ir")).expect("the derivation");
    assert!(said.contains("gent.ir"), "{said}");
    let derivation = Derivation::from_text(&written).expect("a derivation");
    assert_eq!((derivation.law.as_str(), derivation.hash), ("gent", derivation::hash(GENT)));
    assert_eq!(written, GENT_DERIVED, "the committed derivation of examples/custom-law is not a fresh one");
    let left: Vec<_> = std::fs::read_dir(&out).expect("readable").map(|e| e.expect("an entry").file_name()).collect();
    assert_eq!(left, ["gent.ir"]);
}

#[test]
fn a_law_is_derived_by_name() {
    let out = tempfile::tempdir().expect("a temporary folder");
    succeed(&["law", "derive", "hooke", "--out", utf8(out.path())]);
    let committed = std::fs::read_to_string(root().join("laws/derived/hooke.ir")).expect("committed");
    assert_eq!(std::fs::read_to_string(out.path().join("hooke.ir")).expect("written"), committed);
}

/// A process that lets the next one start a moment too early makes it abort now and then: many rounds show it.
#[test]
fn derivations_at_once_wait_for_each_other() {
    let (folder, path) = law_file("gent.rs", GENT);
    for _ in 0..8 {
        let outs: Vec<PathBuf> = (0..8).map(|k| folder.path().join(k.to_string())).collect();
        let start = |out: &PathBuf| {
            let mut command = tensormass(&["law", "derive", utf8(&path), "--out", utf8(out)]);
            command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the binary starts")
        };
        let running: Vec<_> = outs.iter().map(start).collect();
        for (process, out) in running.into_iter().zip(&outs) {
            let output = process.wait_with_output().expect("it ends");
            assert!(output.status.success(), "{}", stderr(&output));
            assert_eq!(std::fs::read_to_string(out.join("gent.ir")).expect("written"), GENT_DERIVED);
        }
    }
}

#[test]
fn errors_of_a_law_file_pass_through() {
    let wrong = GENT.replace("s.I1bar", "s.I1ba").replace("powi(2)", "pow(2)");
    let (folder, path) = law_file("wrong.rs", &wrong);
    let out = folder.path().join("out");
    let errors = refused(&["law", "derive", utf8(&path), "--out", utf8(&out)]);
    for (start, word) in [("s.I1ba", "I1ba"), ("pow(2)", "pow")] {
        let (line, found) = wrong.lines().enumerate().find(|(_, l)| l.contains(start)).expect(start);
        let column = found.find(word).expect(word) + 1;
        let place = format!("error: {}:{}:{column}: ", path.display(), line + 1);
        assert!(errors.contains(&place), "no `{place}` in\n{errors}");
    }
    assert!(!out.exists(), "a refused law leaves nothing behind");
}

#[test]
fn files_that_cannot_be_read_or_written_are_bad_input() {
    let (folder, path) = law_file("gent.rs", GENT);
    let missing = folder.path().join("missing.rs");
    assert!(refused(&["law", "derive", utf8(&missing), "--out", "target"]).contains(utf8(&missing)));
    // A file where the folder should be.
    let error = refused(&["law", "derive", utf8(&path), "--out", utf8(&path)]);
    assert!(error.starts_with(&format!("error: {}: ", path.display())), "{error}");
    let (_folder, binary) = law_file("binary.rs", "");
    std::fs::write(&binary, [0xff, 0xfe, 0x00]).expect("written");
    assert!(refused(&["law", "derive", utf8(&binary), "--out", "target"]).contains("binary.rs"));
}

#[test]
fn wrong_arguments_are_bad_input() {
    for arguments in [&["law", "lisst"][..], &["law", "show"], &["law", "list", "--jsn"], &["nothing"], &[]] {
        let error = refused(arguments);
        assert!(error.contains("Usage"), "{arguments:?}: {error}");
    }
}

#[test]
fn a_closed_pipe_ends_quietly() {
    for arguments in [&["law", "list"][..], &["law", "list", "--json"], &["law", "show", "hooke"], &["--help"]] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = tensormass(arguments).stdout(writer).stderr(Stdio::piped()).output().expect("the binary starts");
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()), "{arguments:?}");
    }
}

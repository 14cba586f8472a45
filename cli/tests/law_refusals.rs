//! Laws that the derivation refuses: the whole message of each, with its place; and what an author may accept.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The parameters that a case may use.
const PARAMETERS: [&str; 6] = [
    "/// Shear modulus.\n    #[unit(\"Pa\")] #[range(1e0, 1e12)] mu: f64",
    "/// Bulk modulus.\n    #[unit(\"Pa\")] #[range(1e0, 1e12)] kappa: f64",
    "/// Of either sign.\n    #[unit(\"1\")] #[range(-1.0, 1.0)] #[default(0.5)] a: f64",
    "/// Of either sign.\n    #[unit(\"1\")] #[range(-1.0, 1.0)] #[default(0.25)] b: f64",
    "/// Positive.\n    #[unit(\"1\")] #[range(0.5, 2.0)] #[default(0.75)] c: f64",
    "/// Positive.\n    #[unit(\"1\")] #[range(0.5, 2.0)] #[default(1.5)] d: f64",
];

fn tensormass(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tensormass"));
    command.current_dir(folder).args(arguments).output().expect("the binary starts")
}

/// A case as a law file: its attributes above the struct, and its last lines as the energy.
fn law(case: &str) -> String {
    let (attributes, energy): (Vec<&str>, Vec<&str>) = case.lines().partition(|line| line.starts_with("#["));
    let mut text = String::from("//! A law.\n#[domain(J > 0.0)]\n");
    attributes.iter().for_each(|line| text += &format!("{line}\n"));
    text += "struct Parameters {\n";
    let used = |field: &&&str| {
        let name = field.rsplit(' ').nth(1).expect("name: f64").trim_end_matches(':');
        case.match_indices(&format!("p.{name}"))
            .any(|(at, found)| !case[at + found.len()..].starts_with(|c: char| c.is_alphanumeric()))
    };
    PARAMETERS.iter().filter(used).for_each(|field| text += &format!("    {field},\n"));
    text += "}\nfn energy_density(s: Strain, p: Parameters) -> f64 {\n";
    energy.iter().for_each(|line| text += &format!("    {line}\n"));
    text + "}\n"
}

/// Derives laws in one call, given as texts; gives exit status and error output.
fn derive(laws: &[(String, String)]) -> (Option<i32>, String, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut arguments = vec!["law", "derive", "--out", "derived"];
    for (name, text) in laws {
        std::fs::write(folder.path().join(name), text).expect("written");
        arguments.push(name);
    }
    let output = tensormass(folder.path(), &arguments);
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned(), folder)
}

/// Every case of the file, derived in one process, is refused with exactly its message.
fn check(path: &Path, update: bool) {
    let text = std::fs::read_to_string(path).expect("a text file");
    let cases: Vec<(&str, &str, &str)> = format!("\n{text}")
        .leak()
        .split("\n==== ")
        .skip(1)
        .map(|case| {
            let (title, case) = case.split_once('\n').expect("a title, then an energy");
            let (energy, message) = case.split_once("\n----\n").expect("an energy, ----, a message");
            (title, energy, message.trim_end())
        })
        .collect();
    assert!(cases.len() > 12, "only {} cases were found", cases.len());
    let laws: Vec<(String, String)> =
        cases.iter().enumerate().map(|(k, (_, energy, _))| (format!("case_{k:02}.rs"), law(energy))).collect();
    let (status, said, folder) = derive(&laws);
    assert_eq!(status, Some(2), "{said}");
    assert!(!update || !said.is_empty());
    let left = std::fs::read_dir(folder.path().join("derived")).map_or(0, |files| files.count());
    assert_eq!(left, 0, "a refused law leaves nothing behind");
    let mut written = String::new();
    for (k, (title, energy, message)) in cases.iter().enumerate() {
        let start = format!("case_{k:02}.rs:");
        let begins = |line: &&str| line.trim_start_matches("error: ").starts_with("case_");
        let lines = said.lines().skip_while(|line| !line.trim_start_matches("error: ").starts_with(&start));
        let own: Vec<&str> = lines
            .enumerate()
            .take_while(|(at, line)| *at == 0 || !begins(line))
            .map(|(_, line)| line.trim_start_matches("error: "))
            .collect();
        let found = own.join("\n").replace(&start, "law.rs:");
        assert!(update || found == *message, "{title}\n\nfound:\n{found}\n\nexpected:\n{message}");
        written += &format!("{}==== {title}\n{energy}\n----\n{found}\n", if k == 0 { "" } else { "\n" });
    }
    if update {
        std::fs::write(path, written).expect("written");
    }
}

#[test]
fn what_cannot_be_expanded_at_rest_is_refused_with_its_place() {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/law_refusals/rest.txt"));
    check(&path, std::env::var_os("UPDATE").is_some());
}

/// What an author may accept: its kind, its constant, and a law that needs it.
const ACCEPTED: [(&str, &str, &str); 3] = [
    ("sign", "1 + a", "p.mu * (s.I1bar - 3.0) + p.kappa * (s.J - 1.0).powi(2) / (p.a + s.J)"),
    ("sign", "1 + a", "p.mu * (s.I1bar - 3.0) + p.kappa * (s.J - 1.0).powi(2) * (p.a + s.J).powf(p.c)"),
    (
        "cancellation",
        "-mu * ln(c * d) / 2 + mu * ln(c) / 2 + mu * ln(d) / 2",
        "p.mu / 2.0 * (s.I1 - 3.0) - p.mu * (1.0 + ln(p.c * p.d) - ln(p.c) - ln(p.d)) * ln(s.J) \
         + p.kappa * ln(s.J).powi(2)",
    ),
];

/// With its acceptance a law that is refused without it derives, is exact, and says what was accepted.
#[test]
fn what_is_accepted_is_split_and_told() {
    let laws = ACCEPTED.iter().enumerate().map(|(k, (kind, constant, energy))| {
        let accept = format!("#[accept({kind} = \"{constant}\", reason = \"by measurement {k}\")]");
        (format!("accepted_{k}.rs"), law(&format!("{accept}\n{energy}")))
    });
    let laws: Vec<(String, String)> = laws.collect();
    let (status, said, folder) = derive(&laws);
    assert_eq!((status, said.as_str()), (Some(0), ""));
    for (k, ((name, _), (kind, constant, _))) in laws.iter().zip(ACCEPTED).enumerate() {
        let told = format!("accepted without proof: the {kind} of `{constant}`, because: by measurement {k}");
        for command in [&["explain"][..], &["extremes", "--samples", "1", "--device", "cpu"]] {
            let output = tensormass(folder.path(), &[&["law"], command, &[name]].concat());
            let text = String::from_utf8_lossy(&output.stdout);
            assert!(output.status.success() && text.contains(&told), "{name} {command:?}: {text}");
        }
        let derived = std::fs::read_to_string(folder.path().join(format!("derived/accepted_{k}.ir"))).expect("written");
        assert!(derived.contains("kernel force_far"), "{name}: the stress is split");
    }
}

//! Wrong law files: every message, whole, and that no text whatsoever makes the parser panic.
//!
//! The cases are the files of `law_errors/`: `==== KIND`, a text, `----`, the message. KIND says what the text is:
//! a `file`, a file but for its doc comment (`documented`), the functions and constants below the struct (`items`),
//! or the body of the energy, of one parameter mu (`energy`), of mu, kappa and n (`moduli`), or of mu and a fibre direction a
//! (`fibres`); or the functions below an energy of mu, beside a viscosity eta (`viscous`). With UPDATE=1 the messages are written instead of compared, for review.

use std::path::{Path, PathBuf};

use tensormass_codegen::law::{LawError, parse};

const DOCS: &str = "//! Test law.\n";
const STRUCT: &str = "struct Parameters {\n    /// Stiffness.\n    #[unit(\"Pa\")] #[range(0.0, 1e9)] mu: f64,\n}\n";
const MODULI: &str = "struct Parameters {\n    /// Shear modulus.\n    #[unit(\"Pa\")] #[range(0.0, 1e9)] mu: f64,\n    \
                      /// Bulk modulus.\n    #[unit(\"Pa\")] #[range(0.0, 1e9)] kappa: f64,\n    \
                      /// A pure number.\n    #[unit(\"1\")] #[range(1.0, 2.0)] n: f64,\n}\n";
const FIBRES: &str = "struct Parameters {\n    /// Stiffness.\n    #[unit(\"Pa\")] #[range(0.0, 1e9)] mu: f64,\n    \
                      /// Fibres.\n    a: Direction,\n}\n";
/// A domain keeps strains from being 0, and no rate.
const VISCOUS: &str = "#[domain(J > 0.0)]\nstruct Parameters {\n    /// Stiffness.\n    #[unit(\"Pa\")] #[range(0.0, 1e9)] mu: f64,\n    \
                       /// Viscosity.\n    #[unit(\"Pa s\")] #[range(0.0, 1e9)] eta: f64,\n}\n\
                       fn energy_density(s: Strain, p: Parameters) -> f64 {\n    p.mu * ddot(s.E, s.E)\n}\n";
const SIGNATURE: &str = "fn energy_density(s: Strain, p: Parameters) -> f64 {\n    ";

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The texts of a folder's files with the extension, by name.
fn texts(folder: &Path, extension: &str) -> Vec<(String, String)> {
    let entries = std::fs::read_dir(folder).expect("a folder of the repository");
    let paths = entries.map(|entry| entry.expect("a readable entry").path());
    let mut texts: Vec<(String, String)> = paths
        .filter(|path| path.extension().is_some_and(|found| found == extension))
        .map(|path| (path.display().to_string(), std::fs::read_to_string(&path).expect("a text file")))
        .collect();
    texts.sort();
    texts
}

fn message(errors: &[LawError]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// What the law file `text` is refused with.
fn refusal(text: &str) -> String {
    message(&parse("laws/test.rs", text).err().unwrap_or_else(|| panic!("accepted:\n{text}")))
}

/// Every case of a file `text` is refused with exactly its message. Returns the file with the messages found, and the
/// number of cases.
fn check(name: &str, text: &str, update: bool) -> (String, usize) {
    let (mut written, mut cases) = (String::new(), 0);
    for case in format!("\n{text}").split("\n==== ").skip(1) {
        let (kind, case) = case.split_once('\n').expect("a kind, then a text");
        let (text, expected) = case.split_once("\n----\n").expect("a text, ----, a message");
        let file = match kind {
            "file" => text.to_owned(),
            "documented" => format!("{DOCS}{text}"),
            "items" => format!("{DOCS}{STRUCT}{text}"),
            "energy" => format!("{DOCS}{STRUCT}{SIGNATURE}{text}\n}}\n"),
            "fibres" => format!("{DOCS}{FIBRES}{SIGNATURE}{text}\n}}\n"),
            "viscous" => format!("{DOCS}{VISCOUS}{text}\n"),
            "moduli" => format!("{DOCS}{MODULI}{SIGNATURE}{text}\n}}\n"),
            _ => panic!("{name}: unknown kind {kind}"),
        };
        let (found, expected) = (refusal(&file), expected.trim_end());
        assert!(update || found == expected, "\nfound:\n{found}\n\nexpected:\n{expected}\n\nfor:\n{file}");
        written += &format!("{}==== {kind}\n{text}\n----\n{found}\n", if cases == 0 { "" } else { "\n" });
        cases += 1;
    }
    (written, cases)
}

#[test]
fn every_wrong_file_has_its_message() {
    let update = std::env::var_os("UPDATE").is_some();
    let mut cases = 0;
    for (name, text) in texts(&folder("tests/law_errors"), "txt") {
        let (written, count) = check(&name, &text, update);
        cases += count;
        if written != text {
            assert!(update, "{name} has another layout than UPDATE=1 writes");
            std::fs::write(&name, written).expect("written");
        }
    }
    assert!(cases > 230, "only {cases} cases were found");
}

#[test]
fn the_file_names_the_law() {
    let text = &texts(&folder("../laws"), "rs")[0].1;
    for path in ["", "laws/Hooke.rs", "laws/2d.rs", "laws/neo-hookean.rs", "laws/fn.rs", "laws/..", "_.rs", "é.rs"] {
        let errors = parse(path, text).expect_err("the name is refused");
        assert!(errors[0].reason.starts_with("the file's name `"), "{path}: {}", errors[0]);
        assert_eq!((errors.len(), errors[0].file.as_str()), (1, path));
    }
}

/// Parses `text`, and checks that every error lies in it.
fn check_places(text: &str) {
    let Err(errors) = parse("laws/test.rs", text) else { return };
    assert!(!errors.is_empty(), "refused without a reason:\n{text}");
    for error in &errors {
        let line = text.lines().nth(error.line.wrapping_sub(1));
        let line = line.unwrap_or_else(|| {
            assert_eq!((error.line, error.column), (1, 1), "outside of an empty file");
            ""
        });
        assert!(
            (1..=line.chars().count() + 1).contains(&error.column) && error.source_line == line,
            "{error}\n\nlies outside of\n{text}"
        );
        assert!(!error.reason.is_empty() && !error.remedy.is_empty(), "{error:?}");
    }
}

/// Start and end of each token: a word, a number, or one sign.
fn tokens(text: &str) -> Vec<(usize, usize)> {
    let mut tokens: Vec<(usize, usize)> = Vec::new();
    let mut in_word = false;
    for (start, c) in text.char_indices() {
        let wordlike = c.is_alphanumeric() || c == '_';
        let end = start + c.len_utf8();
        match tokens.last_mut() {
            Some(last) if wordlike && in_word => last.1 = end,
            _ if c.is_whitespace() => {}
            _ => tokens.push((start, end)),
        }
        in_word = wordlike;
    }
    tokens
}

#[test]
fn mutated_laws_never_panic() {
    const REPLACEMENTS: &[&str] = &[
        "(",
        ")",
        "{",
        "}",
        "[",
        "]",
        "\"",
        "'",
        "#",
        "!",
        "-",
        "..",
        "|i|",
        "0",
        "1.5",
        "1e999",
        "s",
        "p",
        "sum",
        "if",
        "f64",
        "\u{e9}",
        "\\",
        "/*",
        "//",
        "\r",
        "\t",
        "\u{0}",
        "r#\"",
        "=",
        ";",
        ",",
        "<",
        "energy_density",
        "as",
    ];
    // A file that uses all of the language, beside a shipped one, which uses little of it.
    let full = "//! All.\n#[domain(ln(J) > -c[0] / 2.0)]\n#[small_strain]\nstruct Parameters {\n/// A.\n#[unit(\"N m^-2\")] #[range(-0.5, 1e0)] \
                #[default(0.25)] #[per_element] a: f64,\n/// C.\n#[unit(\"1\")] #[range(0.0, 1.0)] c: [f64; 2],\n}\n\
                const N: usize = 2;\nconst H: f64 = 1.0 / 2.0;\nfn f(x: f64, s: Strain) -> f64 { let y: f64 = x * H; y * s.J }\n\
                fn energy_density(s: Strain, p: Parameters) -> f64 {\n\
                let d = s.E - tr(s.E) / 3.0 * identity();\nf(p.a, s) * ddot(d, s.C) + select(s.J >= 1.0, pos(s.I1) * p.a, 2.0 * p.a)\n\
                + p.a * sum(0..N, |i| p.c[i] * i as f64 * s.J.powi(i as i32 + 1)) + p.a * powf(s.I3, p.c[1]).sqrt() * tr(s.eps) }\n";
    let mut laws = texts(&folder("../laws"), "rs");
    laws.truncate(1);
    laws.push((String::from("full"), full.to_owned()));
    for (name, text) in &laws {
        assert!(parse("laws/test.rs", text).is_ok(), "{name}: {}", message(&parse("laws/test.rs", text).unwrap_err()));
        for (i, &(start, end)) in tokens(text).iter().enumerate() {
            let (before, token, after) = (&text[..start], &text[start..end], &text[end..]);
            check_places(&format!("{before}{after}"));
            check_places(&format!("{before}{token} {token}{after}"));
            check_places(before);
            // A seventh of the replacements at each token, all of them over seven tokens.
            for replacement in REPLACEMENTS.iter().skip(i % 7).step_by(7) {
                check_places(&format!("{before}{replacement}{after}"));
                check_places(&format!("{before}{replacement}{token}{after}"));
            }
        }
    }
}

#[test]
fn deep_and_long_texts_never_exhaust_the_stack() {
    let mut bodies: Vec<String> = Vec::new();
    for n in [10, 60, 250, 399, 500, 5_000] {
        let repeated = |text: &str| text.repeat(n);
        bodies.push(format!("{}s.J{} * p.mu", repeated("("), repeated(")")));
        bodies.push(format!("{}s.J{} * p.mu", repeated("exp("), repeated(")")));
        bodies.push(format!("{}s.J{} * p.mu", repeated("sum(0..2, |i| "), repeated(")")));
        bodies.push(format!("{}s.J{} * p.mu", repeated("{"), repeated("}")));
        bodies.push(format!("{}s.J{} * p.mu", repeated("["), repeated("]")));
        bodies.push(format!("{}s.J * p.mu", repeated("- ")));
        bodies.push(format!("{}s.J * p.mu", repeated("-1.0 * ")));
        bodies.push(format!("{}s.J * p.mu", repeated("* ")));
        bodies.push(format!("{}s.J * p.mu", repeated("|i| ")));
        bodies.push(format!("{}s.J * p.mu", repeated(".. ")));
        bodies.push(format!("{}s.J * p.mu", repeated("0 .. ")));
        bodies.push(format!("{}s.J * p.mu", repeated("s.J = ")));
        bodies.push(format!("{}s.J * p.mu", repeated("{ s.J } = ")));
        bodies.push(format!("{}s.J * p.mu", repeated("{ s.J } ")));
        bodies.push(format!("p.mu{}", repeated(" + s.J")));
        bodies.push(format!("p.mu{}", repeated(" < s.J")));
        bodies.push(format!("p.mu * s.J{}", repeated(".exp()")));
        bodies.push(format!("p.mu * s.J{}", repeated(".a")));
        bodies.push(format!("p.mu * s.J{}", repeated("[0]")));
        bodies.push(format!("p.mu * s{}", repeated("()")));
        bodies.push(format!("p.mu * s.J{}", repeated(" as f64")));
        bodies.push(format!("p.mu * s.J as {}", repeated("fn() -> ")));
        bodies.push(format!("p.mu * {}s.J", repeated("A::<")));
        bodies.push(format!("p.mu * s.J as {}f64{}", repeated("A<"), repeated(">")));
        bodies.push(format!("let {} = s.J; p.mu", repeated("a @ ")));
        bodies.push(format!("let {}a = s.J; p.mu", repeated("a | ")));
        bodies.push(format!("{}s.J", repeated("let a = ")));
        let names = (1..n).map(|i| format!("let x{i} = x{} * x{};\n", i - 1, i - 1));
        bodies.push(format!("let x0 = s.J * p.mu;\n{}x{}", names.collect::<String>(), n - 1));
    }
    for body in bodies {
        check_places(&format!("{DOCS}{STRUCT}{SIGNATURE}{body}\n}}\n"));
        check_places(&format!("{DOCS}{STRUCT}const A: f64 = {body};\n"));
    }
    // Helpers that call one another twice: 2^n calls when written out.
    let helpers = (1..60).map(|i| format!("fn f{i}(x: f64) -> f64 {{ f{}(x) + f{}(x) }}\n", i - 1, i - 1));
    let helpers: String = std::iter::once(String::from("fn f0(x: f64) -> f64 { x }\n")).chain(helpers).collect();
    check_places(&format!("{DOCS}{STRUCT}{helpers}{SIGNATURE}f59(s.J) * p.mu\n}}\n"));
    // Calls and brackets together.
    let nested =
        |i: usize| format!("fn f{}(x: f64) -> f64 {{ {}f{i}(x){} }}\n", i + 1, "exp(".repeat(20), ")".repeat(20));
    let helpers: String = (0..20).map(nested).collect();
    for last in 0..20 {
        let energy = format!("{SIGNATURE}f{last}(s.J) * p.mu\n}}\n");
        check_places(&format!("{DOCS}{STRUCT}fn f0(x: f64) -> f64 {{ x }}\n{helpers}{energy}"));
    }
}

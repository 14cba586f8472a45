//! Wrong scenes: each with its whole message, and garbled scenes, which must be refused with a place and never panic.

use tensormass_runtime::scene::{Override, parse};

/// A scene without fault, of which each case spoils one thing.
const RIGHT: &str = r#"[mesh]
beam = { size = [5, 1, 1], cells = [20, 10, 10] }

[[material]]
law = "hooke"
density = 1000.0
parameters = { young = 1e8, poisson = 0.3 }

[[boundary]]
nodes = "x < 1e-6"
fix = ["x", "y", "z"]

[[boundary]]
nodes = { box = { min = [4.9, 0, 0], max = [5, 1, 1] } }
move = { x = { ramp = [[0.0, 0.0], [1.0, 0.25]] } }

[[load]]
kind = "force"
nodes = "near(x, xmax)"
total = [0, 0, -1]

[solver]
integrator = "implicit-euler"
step = 1e-3
duration = 1.0

[[probe]]
name = "tip"
kind = "displacement"
nodes = "near(x, xmax)"
component = "x"

[output]
frames = 10
"#;

/// Refuses the scene with exactly this message, which is given back.
fn check(text: &str, overrides: &[&str], expected: &str) -> String {
    let overrides = overrides.iter().map(|text| Override::parse(text)).collect::<Result<Vec<_>, _>>();
    let message = match overrides.and_then(|overrides| parse(text, "scene.toml", &overrides)) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    };
    let accepts = std::env::var_os("UPDATE_MESSAGES").is_some();
    assert!(accepts || message == expected, "\n--- expected\n{expected}\n--- found\n{message}\n--- for\n{text}");
    message
}

/// With UPDATE_MESSAGES set, the messages found replace those of the file, to be read before they are kept.
#[test]
fn each_wrong_scene_has_its_message() {
    parse(RIGHT, "scene.toml", &[]).unwrap_or_else(|error| panic!("the scene to spoil must be right:\n{error}"));
    let (head, cases) = include_str!("scene_errors.txt").split_once("\n## ").expect("cases");
    let (mut count, mut all) = (0, head.to_string());
    for case in cases.split("\n## ") {
        let (header, expected) = case.split_once('\n').expect("a header and a message");
        let expected = expected.trim_end();
        let found = if let Some(argument) = header.strip_prefix("--set ") {
            check(RIGHT, &[argument], expected)
        } else {
            let (from, to) = header.split_once(" =>").expect("TEXT => OTHER");
            let to = to.strip_prefix(' ').unwrap_or(to);
            let (from, to) = (from.replace("\\n", "\n"), to.replace("\\n", "\n"));
            let text = if from == "*" { to } else { RIGHT.replacen(&from, &to, 1) };
            assert_ne!(text, RIGHT, "the case changes nothing: {header}");
            check(&text, &[], expected)
        };
        all += &format!("\n## {header}\n{found}\n");
        count += 1;
    }
    if std::env::var_os("UPDATE_MESSAGES").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/scene_errors.txt");
        std::fs::write(path, all).expect("the file of cases can be written");
    }
    assert!(count >= 40, "only {count} cases were read");
}

/// A text is read, or refused at a place inside it.
fn survives(text: &str, overrides: &[Override]) {
    let Err(error) = parse(text, "scene.toml", overrides) else { return };
    let at = error.location().unwrap_or_else(|| panic!("no place in: {error}"));
    if at.is_override() {
        assert!(overrides.iter().any(|change| change.text() == at.source_line), "names no override: {error}");
        assert!(error.to_string().starts_with("--set "), "{error}");
        return;
    }
    let lines = if text.is_empty() { "\n" } else { text };
    let line = lines.lines().nth(at.line.wrapping_sub(1)).unwrap_or_else(|| panic!("no such line: {error}"));
    assert_eq!(line.trim_end(), at.source_line, "another line: {error}");
    assert!((1..=line.chars().count() + 1).contains(&at.column), "no such column: {error}");
    assert!(error.to_string().contains("= help: "), "no remedy: {error}");
    assert!(!error.to_string().contains("what is expected here"), "the schema let pass what serde refuses: {error}");
}

#[test]
fn garbled_scenes_are_refused_at_a_place() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let garble = ["", "\"", "[", "}", "=", "\n", "-", "9", "é", ".", "#", "\0", "nan", "x", " ", "(", "{", "'"];
    for name in ["traction", "gravity-hooke", "gravity-svk"] {
        let text = std::fs::read_to_string(root.join(name).with_extension("toml")).expect("a shipped scene");
        let ends: Vec<usize> = text.char_indices().map(|(i, _)| i).collect();
        for (turn, &at) in ends.iter().enumerate() {
            // Delete one character, delete to the end, put something in.
            let after = at + text[at..].chars().next().map_or(0, char::len_utf8);
            survives(&format!("{}{}", &text[..at], &text[after..]), &[]);
            survives(&text[..at], &[]);
            survives(&format!("{}{}{}", &text[..at], garble[turn % garble.len()], &text[after..]), &[]);
        }
        // Lines left out and doubled.
        let lines: Vec<&str> = text.lines().collect();
        for i in 0..lines.len() {
            survives(&[&lines[..i], &lines[i + 1..]].concat().join("\n"), &[]);
            survives(&[&lines[..i], &lines[i..=i], &lines[i..]].concat().join("\r\n"), &[]);
        }
    }
}

#[test]
fn garbled_overrides_are_refused_by_name() {
    let arguments = [
        "solver.step=1e-4",
        "material.0.parameters={ young = 1e7, poisson = [1, 2] }",
        "boundary.0.nodes=\"x < 1\"",
        "boundary.1.move.x.ramp.1.1=0.5",
        "output={ every = 5, fields = ['J'] }",
        "load.0.kind=gravity",
    ];
    for argument in arguments {
        for (at, c) in argument.char_indices() {
            for new in ["", "=", ".", "é", "9", "{", "\"", "\n", "]"] {
                let garbled = format!("{}{new}{}", &argument[..at], &argument[at + c.len_utf8()..]);
                match Override::parse(&garbled) {
                    Ok(change) => survives(RIGHT, &[change]),
                    Err(error) => assert!(error.to_string().starts_with("--set "), "{error}"),
                }
            }
        }
    }
}

/// What would exhaust the stack of a careless parser.
#[test]
fn depth_is_limited() {
    let many = |text: &str| text.repeat(20_000);
    survives(&format!("a = {}", many("[")), &[]);
    survives(&format!("a = {}1{}", many("["), many("]")), &[]);
    survives(&format!("a = {}", many("{a = ")), &[]);
    survives(&format!("{}a = 1", many("a.")), &[]);
    survives(&format!("[{}a]", many("a.")), &[]);
    for condition in [
        format!("{}x{} < 1", "(".repeat(400), ")".repeat(400)),
        format!("{}x < 1", "-".repeat(900)),
        format!("{}x < 1", "- ".repeat(400)),
        format!("{}(x < 1)", "!".repeat(900)),
        format!("{}x < 1", "||".repeat(400)),
        format!("{}x < 1", "& ".repeat(400)),
        format!("{}1 < 1", "x+".repeat(497)),
        format!("x<1{}", "||x<1".repeat(199)),
        format!("{}1{} < 1", "abs(".repeat(32), ")".repeat(32)),
        many("x"),
    ] {
        survives(&RIGHT.replacen("x < 1e-6", &condition, 1), &[]);
    }
}

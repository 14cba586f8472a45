//! `tensormass bench`, called as a user calls it: what it measures and how it counts, never how fast a machine is.

use std::process::Command;

use serde_json::Value;

/// Exit status, standard output and error output.
fn call(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_tensormass")).arg("bench").args(arguments).output();
    let output = output.expect("the binary starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn json(arguments: &[&str]) -> Value {
    let (status, out, err) = call(&[arguments, &["--json"]].concat());
    assert_eq!(status, Some(0), "{err}");
    serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out}"))
}

const SMALL: [&str; 6] = ["--elements", "200", "--repeats", "3", "--device", "cpu"];
const OPERATIONS: [&str; 8] =
    ["energy", "force", "dforce", "linearize", "apply", "diagonal", "explicit step", "50 iterations of CG"];

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn every_operation_is_measured_and_counted() {
    let precisions = ["--precision", "f32", "--precision", "f64"];
    let laws = ["--law", "hooke", "--law", "st_venant_kirchhoff"];
    let found = json(&[&SMALL[..], &precisions, &laws, &["--tangent", "stored"]].concat());
    assert!(number(&found["triad_bytes_per_s"]) > 0.0 && number(&found["threads"]) >= 1.0);
    let measured = found["measured"].as_array().expect("a list");
    assert_eq!(measured.len(), 4, "two laws in two precisions");
    for one in measured {
        let elements = number(&one["elements"]);
        // 5 n^3 cells of six tetrahedra: n = 2.
        assert_eq!((elements, number(&one["nodes"]), one["device"].as_str()), (240.0, 99.0, Some("cpu")));
        let timings = one["timings"].as_array().expect("a list");
        let names: Vec<_> = timings.iter().map(|t| t["operation"].as_str().expect("a name")).collect();
        assert_eq!(names, OPERATIONS);
        for timing in timings {
            let seconds: Vec<f64> = timing["seconds"].as_array().expect("a list").iter().map(number).collect();
            assert!(seconds.len() == 3 && seconds[0] > 0.0 && seconds.is_sorted(), "{timing}");
            assert_eq!(number(&timing["median_s"]), seconds[1]);
            let each = if timing["operation"] == OPERATIONS[7] { 50.0 } else { 1.0 };
            assert!(
                (number(&timing["elements_per_s"]) * seconds[1] / (each * elements) - 1.0).abs() < 1e-12,
                "{timing}"
            );
        }
        // docs/reproduction.md: operations of the paper's Force and DForce with Hooke's law, of which nothing is stored.
        let flops = |k: usize| number(&timings[k]["flops_per_element"]);
        if one["law"] == "hooke" {
            assert_eq!([1, 2, 3, 4].map(flops), [129.0, 129.0, 0.0, 129.0]);
        } else {
            assert!(flops(4) < flops(2), "what is stored is not computed again");
        }
        // All elements are in strips of three, which have six places of 2 bytes; all are one cluster, to which no node is
        // foreign.
        let bytes = |k: usize| number(&timings[k]["bytes_per_element"]);
        let real = if one["precision"] == "f64" { 8.0 } else { 4.0 };
        let of_nodes = 99.0 / 240.0 * (2.0 * 3.0 * real + 3.0 * 3.0 * real);
        assert!((bytes(1) - (4.0 + 10.0 * real + of_nodes)).abs() < 1e-9, "{}", bytes(1));
        let stored = if one["law"] == "hooke" { 0.0 } else { 12.0 };
        assert!((bytes(4) - bytes(1) - stored * real).abs() < 1e-9, "{}", bytes(4));
    }
}

/// Nodes are joined by 222 edges along the axes, 164 diagonals of faces and 40 of cells: blocks of 9 numbers and a place,
/// each of which serves two nodes.
#[test]
fn products_with_a_matrix_are_counted_by_its_blocks() {
    let found = json(&[&SMALL[..], &["--law", "st_venant_kirchhoff", "--tangent", "assembled"]].concat());
    let timings = &found["measured"][0]["timings"];
    assert!(timings[3]["flops_per_element"].is_null(), "assembly is more than kernels");
    let blocks = f64::from(222 + 164 + 40);
    let flops = (39.0 * blocks / 240.0).round();
    assert_eq!(number(&timings[4]["flops_per_element"]), flops);
    let bytes = (38.0 * blocks + 99.0 * 5.0 * 12.0) / 240.0;
    assert!((number(&timings[4]["bytes_per_element"]) - bytes).abs() < 1e-9, "{}", timings[4]);
}

#[test]
fn elements_of_every_dimension() {
    for (element, elements) in [("hexahedron_q1", 135.0), ("quadrangle_s2", 180.0), ("tetrahedron_p2", 240.0)] {
        let found = json(&[&SMALL[..], &["--law", "hooke", "--element", element]].concat());
        let one = &found["measured"][0];
        assert_eq!((one["element"].as_str(), number(&one["elements"])), (Some(element), elements));
    }
    let (status, text, err) = call(&[&SMALL[..], &["--law", "hooke"]].concat());
    assert_eq!((status, err.as_str()), (Some(0), ""));
    for word in ["memory triad", "Melements/s", "of the triad", "hooke, 240 tetrahedron_p1, 99 nodes, f32, cpu"] {
        assert!(text.contains(word), "no `{word}`: {text}");
    }
}

#[test]
fn what_cannot_be_measured_is_bad_input() {
    let cases: [(&[&str], &str); 14] = [
        (&["--law", "hoke"], "error: there is no law `hoke`; did you mean `hooke`?"),
        (&["--element", "segment_p1"], "error: there is no element `segment_p1`"),
        (&["--precision", "f16"], "precisions are f32 and f64"),
        (&["--elements", "0"], "0 is not in 1..=50000000"),
        (&["--device", "gpu", "--precision", "f64"], "a GPU computes in f32"),
        (&["--cells", "20x10"], "cells are three numbers from 1 to 10000"),
        (&["--stiffness-ratio", "0"], "a ratio is a number from 1e-9 to 1e9"),
        (&["--device", "cpu", "--work-group", "32"], "--work-group and --per-invocation are of GPUs"),
        (&["--work-group", "512"], "512 is not in 1..=256"),
        (&["--implicit", "--baseline", "echo"], "cannot be used with"),
        (
            &["--law", "hooke", "--elements", "30", "--repeats", "1", "--device", "cpu", "--roofline", "/"],
            "--roofline /: ",
        ),
        (&["--baseline", "no-such-program", "--law", "hooke", "--elements", "30"], "it does not start"),
        (&["--baseline", "false", "--law", "hooke", "--elements", "30"], "it ended with exit status: 1"),
        (&["--baseline", "echo", "--law", "hooke", "--elements", "30"], "it has to print JSON"),
    ];
    for (arguments, message) in cases {
        let (status, out, err) = call(arguments);
        assert_eq!((status, out.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(err.contains(message), "{arguments:?}: {err}");
    }
}

/// A mesh file: its elements are counted, and have to be of the kind that is measured.
#[test]
fn mesh_files_are_measured() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../runtime/tests/data/ball_2.msh");
    let element = |name: &'static str| {
        call(&["--repeats", "1", "--device", "cpu", "--law", "hooke", "--mesh", file, "--element", name])
    };
    let (status, text, err) = element("tetrahedron_p2");
    assert_eq!((status, err.as_str()), (Some(0), ""));
    assert!(text.contains("hooke, 50 tetrahedron_p2, "), "{text}");
    let (status, _, err) = element("hexahedron_q1");
    assert_eq!(status, Some(2));
    assert!(err.contains("the mesh has elements of kind tetrahedron_p2, and hexahedron_q1 is measured"), "{err}");
}

/// An implicit step: which preconditioners, what they reach, and what a step consists of.
#[test]
fn an_implicit_step_is_solved_to_a_true_residual() {
    let subject = ["--law", "hooke", "--cells", "10x2x2", "--repeats", "1", "--device", "cpu", "--precision", "f64"];
    let iterations = |ratio: &str| {
        let found = json(&[&subject[..], &["--implicit", "--stiffness-ratio", ratio]].concat());
        let step = &found["measured"][0]["implicit_step"];
        assert_eq!(
            (number(&step["stiffness_ratio"]), number(&step["tolerance"])),
            (ratio.parse().expect("a number"), 1e-5)
        );
        let parts: Vec<_> = step["parts_s"].as_object().expect("parts").keys().cloned().collect();
        assert_eq!(parts.len(), 5, "{parts:?}");
        let solutions = step["solutions"].as_array().expect("a list");
        let names: Vec<_> = solutions.iter().map(|s| s["preconditioner"].as_str().expect("a name")).collect();
        assert_eq!(names, ["jacobi", "none"]);
        for solution in solutions {
            assert!(number(&solution["residual"]) <= 1e-5 && number(&solution["median_s"]) > 0.0, "{solution}");
        }
        [0, 1].map(|k| number(&solutions[k]["iterations"]))
    };
    // What stiffnesses differ by, a diagonal knows: it gains more where they do.
    let ([jacobi, none], [jacobi_of_unlike, none_of_unlike]) = (iterations("1"), iterations("1000"));
    let (gain, gain_of_unlike) = (none / jacobi, none_of_unlike / jacobi_of_unlike);
    assert!(gain_of_unlike >= 3.0 && gain_of_unlike > gain, "fewer iterations by {gain_of_unlike}, alike by {gain}");
    assert!(none_of_unlike > none, "{none_of_unlike} iterations without a preconditioner, {none} alike");
}

#[test]
fn a_roofline_has_roofs_and_every_counted_operation() {
    let folder = std::env::temp_dir().join(format!("tensormass-roofline-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join("roof.svg");
    let found = json(&[&SMALL[..], &["--law", "yeoh", "--roofline", file.to_str().expect("a path")]].concat());
    let peak = number(&found["peak_flops_per_s"]["f32"]);
    assert!(peak > number(&found["triad_bytes_per_s"]) / 8.0, "{peak} operations a second");
    let picture = std::fs::read_to_string(&file).expect("a picture");
    std::fs::remove_dir_all(&folder).expect("a folder of ours");
    assert_eq!(picture.matches("<circle").count(), 6, "{picture}");
    for word in ["triad", "Gflop/s, f32", "apply of yeoh, f32, 240"] {
        assert!(picture.contains(word), "no `{word}`: {picture}");
    }
    assert!(!picture.contains("NaN") && !picture.contains("inf"), "{picture}");
}

/// This program beside itself: it is called with the same arguments, and every operation of both is compared.
#[test]
fn a_baseline_is_measured_in_turn() {
    let program = env!("CARGO_BIN_EXE_tensormass");
    let subject = ["--law", "hooke", "--cells", "2x1x1", "--repeats", "1", "--device", "cpu"];
    let found = json(&[&subject[..], &["--baseline", program, "--rounds", "3"]].concat());
    let compared = found["compared"].as_array().expect("a list");
    let operations: Vec<_> = compared.iter().map(|row| row["operation"].as_str().expect("a name")).collect();
    assert_eq!((operations, &found["rounds"]), (OPERATIONS.to_vec(), &Value::from(3)));
    for row in compared {
        let ratios: Vec<f64> = row["ratios"].as_array().expect("a list").iter().map(number).collect();
        assert!(ratios.len() == 3 && ratios[0] > 0.0 && ratios.is_sorted(), "{row}");
        assert_eq!((&row["law"], &row["elements"]), (&Value::from("hooke"), &Value::from("12")));
    }
    let (status, text, err) = call(&[&subject[..], &["--baseline", program, "--rounds=1"]].concat());
    assert_eq!((status, err.as_str()), (Some(0), ""));
    assert!(text.starts_with("speed as a multiple of the other's: medians of 1 rounds in turn"), "{text}");
}

/// What omissions gain is measured in turn: scenes with something run what those without do not, and never hold less.
#[test]
fn omissions_are_measured_in_turn() {
    let arguments = ["--omissions", "--cells", "5x1x1", "--repeats", "2", "--device", "cpu"];
    let found = json(&arguments);
    let measured = found["omissions"][0]["measured"].as_array().expect("a list");
    let of = |name: &str| measured.iter().find(|m| m["name"] == name).unwrap_or_else(|| panic!("no {name}"));
    for one in measured {
        for side in ["with", "without"] {
            let seconds = one[side]["step_seconds"].as_array().expect("a list");
            assert!(seconds.len() == 2 && seconds.iter().all(|s| number(s) > 0.0), "{one}");
            assert!(number(&one[side]["allocated_bytes"]) > 0.0, "{one}");
        }
        assert!(number(&one["ratio"]) > 0.0);
    }
    let kernels = |name: &str| of(name)["with"]["own_kernels"].to_string();
    for (name, kernel) in [
        ("contact", "contact"),
        ("contact while the gap cannot close", "contact"),
        ("viscosity, explicit", "damping"),
        ("viscosity, implicit", "ddamping"),
        ("stiffness damping, explicit", "dforce"),
        ("consistent masses, implicit", "consistent mass"),
        ("a probe of stresses in each step", "cauchy"),
    ] {
        assert!(kernels(name).contains(kernel), "{name}: {}", kernels(name));
    }
    let bytes = |name: &str, side: &str| number(&of(name)[side]["allocated_bytes"]);
    for name in ["double precision", "a direction for each element", "the tangent (explicit)"] {
        assert!(bytes(name, "with") > bytes(name, "without"), "{name}");
    }
    for name in measured.iter().filter_map(|m| m["name"].as_str()) {
        assert!(bytes(name, "with") >= bytes(name, "without"), "{name}");
    }
    let (status, out, err) = call(&arguments);
    assert_eq!(status, Some(0), "{err}");
    assert!(out.contains("what is left out") && out.contains("while the gap cannot close"), "{out}");
}

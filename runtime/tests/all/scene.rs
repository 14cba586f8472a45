//! Scenes that are right: what is read from them, and that schema, documentation and shipped scenes agree with the code.

use serde_json::Value;
use std::path::{Path, PathBuf};
use tensormass_runtime::scene::*;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn shipped(name: &str, overrides: &[&str]) -> Scene {
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().expect("a right override")).collect();
    load(root().join("scenes").join(name), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

const SMALL: &str = r#"
[mesh]
file = "meshes/cube.msh"

[[material]]
law = "mooney"
density = 1
parameters.young = { per_element = [1, 2.5] }
parameters.fibre = [0, 0, 1]
parameters.alpha = { per_element = "alpha.csv" }

[solver]
integrator = "static"
"#;

/// Where the moved end of the traction scene is along x at a time.
fn pulled(scene: &Scene, time: f64) -> f64 {
    match &scene.boundary[3] {
        Boundary::Moved { motion, .. } => motion.x.as_ref().expect("moved along x").table().at(time),
        other => panic!("{other:?}"),
    }
}

#[test]
fn shipped_scenes_say_what_the_paper_says() {
    let scene = shipped("traction.toml", &[]);
    let beam = Beam { size: [5.0, 1.0, 1.0], cells: [20, 10, 10], origin: [0.0; 3], element: "tetrahedron_p1".into() };
    assert_eq!(scene.mesh, Mesh::Beam { beam });
    assert_eq!((scene.material[0].law.as_str(), scene.material[0].density), ("hooke", 1000.0));
    assert_eq!(scene.material[0].parameters["young"], Parameter::Constant(ParameterValue::Number(1e8)));
    assert_eq!([0.8, 9.0].map(|t| pulled(&scene, t)), [0.125, 0.25]);
    assert_eq!(scene.solver.integrator, Integrator::ImplicitEuler);
    assert_eq!(scene.solver.precision, Precision::F32);
    // Every step of Table 2 divides the duration.
    for (step, steps) in [("0.04", 80), ("0.08", 40), ("0.16", 20)] {
        assert_eq!(shipped("traction.toml", &[&format!("solver.step={step}")]).solver.steps(), steps);
    }
    let (mut hooke, svk) = (shipped("gravity-hooke.toml", &[]), shipped("gravity-svk.toml", &[]));
    assert_eq!(hooke.load, svk.load);
    hooke = shipped("gravity-hooke.toml", &["material.0.law=st_venant_kirchhoff", "scene.title=x"]);
    let mut twin = SceneData::clone(&hooke);
    twin.scene = svk.scene.clone();
    assert_eq!(twin, *svk, "the twins differ in more than the law");
}

#[test]
fn defaults_and_all_forms_of_parameters() {
    let scene = parse(SMALL, "folder/small.toml", &[]).unwrap_or_else(|error| panic!("{error}"));
    let Mesh::File { file, orient, scale, refine } = &scene.mesh else { panic!("a mesh file") };
    assert_eq!((scene.resolve(file), *orient, *scale), (PathBuf::from("folder/meshes/cube.msh"), false, 1.0));
    assert_eq!(*refine, 1);
    let parameters = &scene.material[0].parameters;
    let numbers = [1.0, 2.5].map(ParameterValue::Number).to_vec();
    assert_eq!(parameters["young"], Parameter::PerElement { per_element: PerElement::Values(numbers) });
    assert_eq!(parameters["fibre"], Parameter::Constant(ParameterValue::Array(vec![0.0, 0.0, 1.0])));
    assert_eq!(parameters["alpha"], Parameter::PerElement { per_element: PerElement::File("alpha.csv".into()) });
    assert_eq!(*scene.material[0].elements.kind(), SelectionKind::All);
    assert_eq!(scene.solver.cg, ConjugateGradient::default());
    assert_eq!((scene.solver.steps(), scene.solver.precision), (1, Precision::F64));
    assert_eq!(scene.output, Output::default());
    assert!(scene.boundary.is_empty() && scene.load.is_empty() && scene.probe.is_empty());
}

#[test]
fn overrides_take_toml_values_and_words() {
    let scene = shipped(
        "traction.toml",
        &[
            "solver.integrator=semi-implicit-euler",
            "solver.step = 2e-4",
            "solver.precision=\"f64\"",
            "material.0.density=900",
            "boundary.3.move.x.ramp.1.1=0.5",
            "boundary.0.nodes=x < 0.1 && y > 0",
            "output={ every = 5, fields = ['J'] }",
            "initial.velocity=[1, 2, 3]",
        ],
    );
    assert_eq!(scene.solver.integrator, Integrator::SemiImplicitEuler);
    assert_eq!((scene.solver.step, scene.solver.precision), (Some(2e-4), Precision::F64));
    assert_eq!(scene.material[0].density, 900.0);
    assert_eq!(pulled(&scene, 9.0), 0.5);
    assert!(matches!(scene.boundary[0].nodes().kind(), SelectionKind::Where(_)));
    assert_eq!((scene.output.every, scene.output.fields.as_slice()), (Some(5), [Field::J].as_slice()));
    assert_eq!(scene.initial.velocity, [1.0, 2.0, 3.0]);
    // A later override wins.
    assert_eq!(shipped("traction.toml", &["solver.step=1", "solver.step=0.5"]).solver.step, Some(0.5));
    // What has become pointless is said.
    let warned = scene.warnings();
    assert_eq!(warned.len(), 2, "{warned:?}");
    assert!(warned[0].contains("solver.cg") && warned[1].contains("solver.newton"), "{warned:?}");
    assert!(shipped("traction.toml", &[]).warnings().is_empty());
}

#[test]
fn places_are_those_of_the_text() {
    let change: Override = "material.0.parameters.fibre=[1, 0, 0]".parse().expect("a right override");
    let scene = parse(SMALL, "small.toml", &[change]).unwrap_or_else(|error| panic!("{error}"));
    for (path, line, column, width) in [
        ("material.0.law", 6, 7, 8),
        ("material.0.parameters.young", 8, 20, 26),
        ("material.0.parameters.young.per_element.1", 8, 40, 3),
        // What was left out is at what should hold it.
        ("material.0.name", 5, 1, 12),
        ("solver.step", 12, 1, 8),
        ("output.frames", 1, 1, 1),
    ] {
        let at = scene.locate(path);
        assert_eq!((at.file.as_str(), at.line, at.column, at.width), ("small.toml", line, column, width), "{path}");
        assert_eq!(at.source_line, SMALL.lines().nth(line - 1).expect("a line"), "{path}");
    }
    let key = scene.locate_key("material.0.parameters.young");
    assert_eq!((key.line, key.column, key.width), (8, 12, 5));
    let at = scene.locate("material.0.parameters.fibre.1");
    assert_eq!((at.file.as_str(), at.column), ("--set", 33));
    let error = SceneError::at(key, "`mooney` has no parameter `young`", "its parameters are c1, c2");
    assert_eq!(
        error.to_string(),
        "small.toml:8:12: `mooney` has no parameter `young`\n  |\n8 | parameters.young = { per_element = [1, 2.5] }\n  \
         |            ^^^^^\n  = help: its parameters are c1, c2"
    );
    let missing = load("no/such/scene.toml", &[]).expect_err("there is no such file").to_string();
    assert!(missing.starts_with("no/such/scene.toml: the scene cannot be read: "), "{missing}");
}

/// Which of the points are selected in a body from (0, 0, 0) to (5, 1, 1); its `near` is within 5.2e-6.
fn check(selection: &str, expected: &[bool]) {
    let points = [[0.0; 3], [5.0, 1.0, 1.0], [2.5, 0.5, 0.25], [4e-6, 0.9, 0.1]];
    let bbox = BoundingBox::around(points).expect("there are points");
    assert_eq!((bbox.min, bbox.max), ([0.0; 3], [5.0, 1.0, 1.0]));
    let text = format!("s = {selection}");
    let selection: Selection = toml_value(&text);
    let found: Vec<bool> = points.iter().map(|&point| selection.matches(point, &bbox)).collect();
    assert_eq!(found, expected, "{text}");
    let members = selection.select(&points, &bbox, |_| None).expect("no group is asked for");
    assert_eq!(members, (0..points.len()).filter(|&i| expected[i]).collect::<Vec<_>>(), "{text}");
}

fn toml_value(text: &str) -> Selection {
    #[derive(serde::Deserialize)]
    struct Holder {
        s: Selection,
    }
    toml::from_str::<Holder>(text).unwrap_or_else(|error| panic!("{error}")).s
}

#[test]
fn selections_select() {
    let (t, f) = (true, false);
    for (selection, expected) in [
        ("'all'", [t, t, t, t]),
        ("'x < 1'", [t, f, f, t]),
        ("'x <= 0'", [t, f, f, f]),
        ("'x > 2.5'", [f, t, f, f]),
        ("'x >= 2.5'", [f, t, t, f]),
        ("'near(x, xmin)'", [t, f, f, t]),
        ("'near(x, xmax) || near(z, zmin)'", [t, t, f, f]),
        ("'!near(y, ymin) && !(y >= ymax)'", [f, f, t, t]),
        // && binds stronger than ||, * stronger than +, - to the left.
        ("'x < 1 || x > 2 && y < 0.6'", [t, f, t, t]),
        ("'x + 2 * y < 3.6'", [t, f, t, t]),
        ("'x - 1 - 1 > 0'", [f, t, t, f]),
        ("'x / 5 > 0.4'", [f, t, t, f]),
        ("'abs(x - 2.5) < 1'", [f, f, t, f]),
        ("'sqrt(x * x + y * y) > 5'", [f, t, f, f]),
        ("'min(x, y) > 0.4 && max(y, z) < 1'", [f, f, t, f]),
        ("'-x > -1e-9'", [t, f, f, f]),
        ("'x < (xmin + xmax) / 2'", [t, f, f, t]),
        ("'sqrt(0 - x) >= 0'", [t, f, f, f]),
        ("'x / x > 0'", [f, t, t, t]),
        ("{ where = 'z > 0.2' }", [f, t, t, f]),
        ("{ box = { min = [0, 0, 0], max = [2.5, 0.5, 0.25] } }", [t, f, t, f]),
    ] {
        check(selection, &expected);
    }
    let bbox = BoundingBox { min: [0.0; 3], max: [1.0; 3] };
    for group in ["'group:top'", "{ group = 'top' }"] {
        let group = toml_value(&format!("s = {group}"));
        let known = |name: &str| (name == "top").then(|| vec![7, 3, 7]);
        assert_eq!(group.select(&[], &bbox, known), Some(vec![3, 7]));
        assert_eq!(group.select(&[], &bbox, |_| None), None);
    }
}

#[test]
fn frames_are_evenly_spread_and_hold_both_ends() {
    let steps = |frames, every, steps| {
        let output = Output { frames, every, ..Output::default() };
        (0..=steps).filter(|&step| output.wants_frame(step, steps)).collect::<Vec<u64>>()
    };
    assert_eq!(steps(Some(4), None, 8), [0, 2, 4, 6, 8]);
    assert_eq!(steps(Some(3), None, 8), [0, 3, 6, 8]);
    assert_eq!(steps(Some(99), None, 3), [0, 1, 2, 3]);
    assert_eq!(steps(Some(0), None, 3), Vec::<u64>::new());
    assert_eq!(steps(None, Some(3), 7), [0, 3, 6, 7]);
    assert_eq!(steps(None, None, 7), [0, 7]);
}

#[test]
fn committed_schema_is_current() {
    let path = root().join("docs/scene.schema.json");
    let schema = json_schema();
    if std::env::var_os("UPDATE_SCHEMA").is_some() {
        let text = serde_json::to_string_pretty(&schema).expect("a JSON value") + "\n";
        std::fs::write(&path, text).expect("docs/ is writable");
    }
    let committed: Value =
        serde_json::from_str(&std::fs::read_to_string(&path).unwrap_or_default()).unwrap_or_default();
    assert!(committed == schema, "docs/scene.schema.json is stale: UPDATE_SCHEMA=1 cargo test -p tensormass-runtime");
}

/// Visits every schema inside a schema; `path` is for messages.
fn visit(schema: &Value, path: &str, see: &mut impl FnMut(&Value, &str)) {
    see(schema, path);
    for (holder, many) in [("properties", true), ("$defs", true), ("items", false), ("additionalProperties", false)] {
        match schema.get(holder) {
            Some(Value::Object(inside)) if many => {
                inside.iter().for_each(|(key, schema)| visit(schema, &format!("{path}/{key}"), see));
            }
            Some(inside @ Value::Object(_)) => visit(inside, &format!("{path}/{holder}"), see),
            _ => {}
        }
    }
    for holder in ["oneOf", "anyOf", "prefixItems"] {
        let branches = schema.get(holder).and_then(Value::as_array).into_iter().flatten();
        branches.enumerate().for_each(|(i, schema)| visit(schema, &format!("{path}/{holder}/{i}"), see));
    }
}

/// The loader checks scenes by this schema: it must be closed, bounded, described, and of words that the loader knows.
#[test]
fn schema_is_one_that_the_loader_can_check() {
    let known = "$schema $defs $ref title description type format const enum default oneOf anyOf properties required \
                 additionalProperties items prefixItems minItems maxItems minLength minimum maximum exclusiveMinimum \
                 exclusiveMaximum";
    let known: Vec<&str> = known.split_whitespace().collect();
    let docs = std::fs::read_to_string(root().join("docs/scenes.md")).expect("docs/scenes.md");
    let mut numbers = 0;
    visit(&json_schema(), "", &mut |schema, path| {
        for word in schema.as_object().expect("a schema is an object").keys() {
            assert!(known.contains(&word.as_str()), "{path}: shape.rs does not know `{word}`");
        }
        match schema["type"].as_str() {
            Some("number" | "integer") => {
                numbers += 1;
                let bounded = |bounds: [&str; 2]| bounds.iter().any(|bound| schema[*bound].is_number());
                assert!(bounded(["minimum", "exclusiveMinimum"]), "{path}: no least value");
                assert!(bounded(["maximum", "exclusiveMaximum"]), "{path}: no greatest value");
            }
            Some("object") => {
                let extra = &schema["additionalProperties"];
                assert!(extra == false || extra.is_object(), "{path}: accepts any key");
                for (key, value) in schema["properties"].as_object().into_iter().flatten() {
                    assert!(docs.contains(&format!("`{key}`")), "{path}/{key} is not in docs/scenes.md");
                    let tag = !value["const"].is_null();
                    let inner = schema["description"].is_string() && schema["required"] == serde_json::json!([key]);
                    assert!(tag || inner || value["description"].is_string(), "{path}/{key}: no description");
                }
            }
            Some("string") => {
                for name in schema["enum"].as_array().into_iter().flatten().chain(schema.get("const")) {
                    let name = name.as_str().expect("a name");
                    assert!(docs.contains(&format!("`{name}`")), "{path}: `{name}` is not in docs/scenes.md");
                }
            }
            _ => {}
        }
    });
    assert!(numbers > 20, "only {numbers} numbers were seen");
}

//! Published and 30-digit values of homogeneous states: stretching, shear, inversion, and the patch test's state.
//!
//! `tests/reference/cases.json` and `patch_mesh.json` came with the project and are not edited. In f64 each value has
//! its case's tolerance, relative to the state's largest stress; in f32 the rounding bound of the kernel, which starts
//! from the state's own rounding. A law of the file that this build does not have is counted and printed.

use serde_json::Value;
use tensormass_kernels::law;
use tensormass_testing::point::Point;
use tensormass_testing::root;
use tensormass_testing::rounding::{DOUBLE, Rounded, SINGLE};
use tensormass_testing::tensor::{Matrix, exact, magnitude, shifted};

/// The file's law keys, and the names of this project.
const LAWS: [(&str, &str); 6] = [
    ("hooke", "hooke"),
    ("svk", "st_venant_kirchhoff"),
    ("nh_log", "neo_hookean"),
    ("iso_nh", "neo_hookean_isochoric"),
    ("stable_nh", "stable_neo_hookean"),
    ("mooney", "mooney_rivlin"),
];
/// The cases' own tolerance in f64, relative.
const TOLERANCE: f64 = 1e-12;

/// One value of a case: what it is, what the kernels give, what the file says.
struct Expected {
    what: String,
    double: Rounded,
    single: f32,
    value: f64,
}

fn json(name: &str) -> Value {
    let path = root().join("tests/reference").join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).expect("JSON")
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("a number, not {v}"))
}

fn matrix(v: &Value) -> [f64; 9] {
    let rows = v.as_array().expect("an array");
    let flat: Vec<f64> = match rows[0].as_array() {
        Some(_) => rows.iter().flat_map(|r| r.as_array().expect("a row").iter().map(number)).collect(),
        None => rows.iter().map(number).collect(),
    };
    flat.try_into().expect("nine components")
}

/// The law's point with the file's material, if this build has the law.
fn point(key: &str, skipped: &mut Vec<String>) -> Option<Point> {
    let entry = LAWS.iter().find(|(k, _)| *k == key).and_then(|(_, name)| law(name));
    if entry.is_none() && !skipped.contains(&key.to_string()) {
        skipped.push(key.to_string());
    }
    let entry = entry?;
    let (young, poisson) = (1e6, 0.3);
    let mu = young / (2.0 * (1.0 + poisson));
    let named = |p: &str| match p {
        "young" => young,
        "poisson" => poisson,
        "mu1" => 0.75 * mu,
        "mu2" => 0.25 * mu,
        "lambda" => young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)) - mu / 2.0,
        other => panic!("the cases give no `{other}`"),
    };
    let parameters = entry.info.parameters.iter().map(|p| named(p.name)).collect();
    Some(Point::new(env!("TENSORMASS_GENERATED"), entry, parameters))
}

/// G = F - 1 of a state whose components the file gives rounded to f64; in f32 they are rounded once more.
fn gradient(f: &[f64; 9]) -> (Matrix, [f32; 9]) {
    let g = shifted(&f.map(|x| if x == x.round() { Rounded::exact(x) } else { Rounded::nearest(x) }), -1.0);
    (g, g.map(|x| x.value as f32))
}

fn stresses(point: &Point, f: &[f64; 9], stress: &[f64; 9]) -> Vec<Expected> {
    let (g, g32) = gradient(f);
    let (double, (single, outside)) = (point.force(&g), point.single.force(&g32));
    assert!(!outside && !point.double.force(&g.map(|x| x.value)).1, "inside the domain: {f:?}");
    let each = |k: usize| Expected { what: format!("P{k}"), double: double[k], single: single[k], value: stress[k] };
    (0..9).map(each).collect()
}

/// Compares the values of one state; `least` is the magnitude below which relative errors have no meaning.
fn check(context: &str, least: f64, expected: &[Expected]) {
    let scale = expected.iter().fold(least, |m, e| m.max(e.value.abs()));
    for Expected { what, double, single, value } in expected {
        let difference = (double.value - value).abs();
        assert!(difference <= TOLERANCE * scale, "{context}: {what} is {}, not {value}", double.value);
        // The file's value is itself rounded to f64.
        let bound = double.bound(SINGLE) + DOUBLE * value.abs();
        let difference = (f64::from(*single) - value).abs();
        assert!(difference <= bound, "{context}: {what} in f32 is {single}, not {value}; tolerance {bound:e}");
        assert!(bound <= 1e-4 * scale.max(1e6), "{context}: {what} in f32: the tolerance {bound:e} proves nothing");
    }
}

fn each_state(id: &str, mut run: impl FnMut(&Point, &Value, String)) {
    let cases = json("cases.json");
    let case = cases["cases"].as_array().expect("cases").iter().find(|c| c["id"] == id).expect("the case");
    let (mut skipped, mut count) = (vec![], 0);
    for state in case["expected"].as_array().expect("states") {
        if let Some(point) = point(state["law"].as_str().expect("a law"), &mut skipped) {
            count += 1;
            run(&point, state, format!("{id} {state}"));
        }
    }
    assert!(count > 0, "{id}: no state was tested");
    eprintln!("{id}: {count} states; laws of the file that this build does not have: {skipped:?}");
}

#[test]
fn uniaxial_stretch() {
    each_state("H_uniaxial", |point, state, context| {
        let (stretch, lateral) = (number(&state["stretch"]), number(&state["lateral"]));
        let f = [stretch, 0.0, 0.0, 0.0, lateral, 0.0, 0.0, 0.0, lateral];
        let p11 = number(&state["P11"]);
        // The lateral faces are free: every other component is zero. What the lateral stretch's last digit changes is
        // of the order of E, not of P11.
        let stress = std::array::from_fn(|k| if k == 0 { p11 } else { 0.0 });
        check(&context, 1e6, &stresses(point, &f, &stress));
        let (g, g32) = gradient(&f);
        let sigma = Expected {
            what: "sigma11".into(),
            double: point.cauchy(&g)[0],
            single: point.single.cauchy(&g32)[0],
            value: number(&state["sigma11"]),
        };
        check(&context, 1e6, &[sigma]);
    });
}

#[test]
fn simple_shear() {
    each_state("H_simple_shear", |point, state, context| {
        let f = [1.0, number(&state["gamma"]), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let expected = stresses(point, &f, &matrix(&state["P"]));
        assert_eq!(expected[1].value, number(&state["P12"]));
        check(&context, 0.0, &expected);
    });
}

#[test]
fn inverted() {
    each_state("H_inverted", |point, state, context| {
        let f = matrix(&state["F"]);
        if state["P"].is_null() {
            let (g, g32) = gradient(&f);
            let g = g.map(|x| x.value);
            let (double, single) = (&point.double, &point.single);
            assert!(double.force(&g).1 && double.energy(&g).1, "{context}: not reported in f64");
            assert!(single.force(&g32).1 && single.energy(&g32).1, "{context}: not reported in f32");
        } else {
            check(&context, 1e6, &stresses(point, &f, &matrix(&state["P"])));
        }
    });
}

#[test]
fn patch() {
    let (cases, mesh) = (json("cases.json"), json("patch_mesh.json"));
    let case = cases["cases"].as_array().expect("cases").iter().find(|c| c["id"] == "PATCH").expect("the case");
    let g = matrix(&mesh["G"]);
    let (bounded, g32) = (g.map(Rounded::nearest), g.map(|x| x as f32));
    let mut skipped = vec![];
    for (key, expected) in case["expected"].as_object().expect("laws") {
        let Some(point) = point(key, &mut skipped) else { continue };
        let stress = matrix(&expected["P"]);
        let (double, single) = (point.force(&bounded), point.single.force(&g32).0);
        let each =
            |k: usize| Expected { what: format!("P{k}"), double: double[k], single: single[k], value: stress[k] };
        check(&format!("PATCH {key}"), 0.0, &(0..9).map(each).collect::<Vec<_>>());
        // W counts from rest.
        let rest = [0.0; 9];
        let energy = Expected {
            what: "energy of the unit cube".into(),
            double: point.energy(&bounded) - point.energy(&exact(&rest)),
            single: point.single.energy(&g32).0 - point.single.energy(&rest.map(|x| x as f32)).0,
            value: number(&expected["energy"]),
        };
        check(&format!("PATCH {key}"), 0.0, &[energy]);
        assert!(magnitude(&double) > 0.0);
    }
    assert!(skipped.len() < case["expected"].as_object().expect("laws").len(), "no law was tested");
    eprintln!("PATCH: laws of the file that this build does not have: {skipped:?}");
}

//! Reviewed laws against SymPy: 25-digit values of W, P, dP and the Cauchy stress, and where there is a dissipation of D,
//! P_v and dP_v, differentiated by another system.
//!
//! `tests/python/sympy_reference.py` wrote `tests/reference/sympy/NAME.json` with a parser of its own; all states and
//! materials are exact in f32. The tolerance is the kernel's rounding bound, in f64 and in f32. W counts from rest.

use serde_json::Value;
use tensormass_kernels::{LawEntry, laws};
use tensormass_testing::point::Point;
use tensormass_testing::root;
use tensormass_testing::rounding::{DOUBLE, Rounded, SINGLE};
use tensormass_testing::tensor::exact;

fn numbers(v: &Value) -> Vec<f64> {
    let number = |v: &Value| v.as_str().expect("a decimal").parse::<f64>().expect("a decimal");
    v.as_array().map_or_else(|| vec![number(v)], |all| all.iter().map(number).collect())
}

fn nine(v: &Value) -> [f64; 9] {
    numbers(v).try_into().expect("nine components")
}

/// Compares the kernels of a law with the values of one state.
fn check(law: &'static LawEntry, state: &Value, context: &str) {
    let point = Point::new(env!("TENSORMASS_GENERATED"), law, numbers(&state["parameters"]));
    let (g, d) = (nine(&state["G"]), nine(&state["dG"]));
    let (g32, d32) = (g.map(|x| x as f32), d.map(|x| x as f32));
    assert_eq!(g32.map(f64::from), g, "{context}: G is exact in f32");
    let (bounded, rest, single) = (exact(&g), exact(&[0.0; 9]), &point.single);
    let dp = point.dforce(&bounded, &exact(&d));
    // Of the tangent's magnitude is what a tolerance may be at most without proving nothing.
    let scale = dp.iter().fold(0.0f64, |m, x| m.max(x.value.abs()));
    let energy = point.energy(&bounded) - point.energy(&rest);
    let energy32 = f64::from(single.energy(&g32).0) - f64::from(single.energy(&[0.0; 9]).0);
    let wide = |x: &[f32]| x.iter().copied().map(f64::from).collect::<Vec<f64>>();
    let mut compared: Vec<(&str, Vec<Rounded>, Vec<f64>, f64)> = vec![
        ("W", vec![energy], vec![energy32], scale),
        ("P", point.force(&bounded).into(), wide(&single.force(&g32).0), scale),
        ("dP", dp.into(), wide(&single.dforce(&g32, &d32)), scale),
        ("cauchy", point.cauchy(&bounded).into(), wide(&single.cauchy(&g32)), scale),
    ];
    if law.damping.is_some() {
        let rate = nine(&state["rate"]);
        let (r32, moving) = (rate.map(|x| x as f32), exact(&rate));
        let dp = point.ddamping(&bounded, &moving, &exact(&d));
        let scale = dp.iter().fold(0.0f64, |m, x| m.max(x.value.abs()));
        let density = f64::from(single.dissipation(&g32, &r32));
        compared.push(("D", vec![point.dissipation(&bounded, &moving)], vec![density], scale));
        compared.push(("P_v", point.damping(&bounded, &moving).into(), wide(&single.damping(&g32, &r32)), scale));
        compared.push(("dP_v", dp.into(), wide(&single.ddamping(&g32, &r32, &d32)), scale));
    }
    for (what, double, single, scale) in compared {
        let expected = numbers(&state[what]);
        assert_eq!(expected.len(), double.len(), "{context}: {what}");
        for (k, value) in expected.iter().enumerate() {
            // The 25 digits are rounded to f64 here.
            for (kind, actual, u, most) in [("f64", double[k].value, DOUBLE, 1e-12), ("f32", single[k], SINGLE, 5e-4)] {
                // A bound beyond the most would prove nothing: running bounds of rotations, which do not know that the
                // results are the same in any frame, may be beyond.
                let tolerance = (double[k].bound(u) + DOUBLE * value.abs()).min(most * scale);
                let difference = (actual - value).abs();
                assert!(
                    difference <= tolerance,
                    "{context}: {what} {k} in {kind} is {actual}, not {value}, tolerance {tolerance:e}"
                );
            }
        }
    }
}

#[test]
fn kernels_have_the_values_of_sympy() {
    let mut unreviewed = 0;
    for law in laws() {
        let name = law.info.name;
        if !law.info.reviewed {
            unreviewed += 1;
            continue;
        }
        let path = root().join(format!("tests/reference/sympy/{name}.json"));
        let remedy = "run tests/python/sympy_reference.py";
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}; {remedy}", path.display()));
        let file: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(file["law"], name);
        let states = file["states"].as_array().expect("states");
        assert!(states.len() >= 10, "{name}: {} states", states.len());
        for (k, state) in states.iter().enumerate() {
            check(law, state, &format!("{name}, state {k} of {}", path.display()));
        }
    }
    eprintln!("skipped {unreviewed} unreviewed laws");
}

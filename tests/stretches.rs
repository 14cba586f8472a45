//! Laws in the principal stretches where stretches are nearly equal, by 1e-2 to 1e-8 of them, or equal: the plain
//! relative errors of P and dP, in f32 and f64, against 25-digit values that know no eigenvectors.
//!
//! `tests/python/sympy_reference.py` wrote `tests/reference/stretches/NAME.json` by differences with 160 digits, at the
//! law's default parameters. The tolerance is 1e-5 in f32, and as many units of round-off, 168, in f64: the decomposition
//! rounds each eigenvector up to 2 * 12 * 4 = 96 times and P and dP, which are sums of dyads, some tens of times more.

use serde_json::Value;
use tensormass_kernels::{LawEntry, laws};
use tensormass_testing::point::Compiled;
use tensormass_testing::root;
use tensormass_testing::rounding::{DOUBLE, SINGLE};

/// 1e-5 in f32.
const UNITS: f64 = 1e-5 / SINGLE;

fn numbers(v: &Value) -> Vec<f64> {
    let all = v.as_array().expect("an array").iter();
    all.map(|v| v.as_str().expect("a decimal").parse().expect("a decimal")).collect()
}

/// |a - b| / |b|, Frobenius norms.
fn relative(a: &[f64], b: &[f64]) -> f64 {
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>();
    (square(&mut a.iter().zip(b).map(|(x, y)| x - y)) / square(&mut b.iter().copied())).sqrt()
}

/// Compares P and dP of one state; returns the errors of both in f32, then in f64.
fn check(law: &LawEntry, state: &Value, context: &str) -> [f64; 4] {
    let constants = law.constants(&numbers(&state["parameters"]));
    let nine = |key: &str| <[f64; 9]>::try_from(numbers(&state[key])).expect("nine components");
    let (g, d, expected) = (nine("G"), nine("dG"), [nine("P"), nine("dP")]);
    let (g32, d32) = (g.map(|x| x as f32), d.map(|x| x as f32));
    let (single, double) = (Compiled::<f32>::new(law, &constants), Compiled::<f64>::new(law, &constants));
    let wide = |x: [f32; 9]| x.map(f64::from);
    let found = [
        (wide(single.force(&g32).0), SINGLE),
        (wide(single.dforce(&g32, &d32)), SINGLE),
        (double.force(&g).0, DOUBLE),
        (double.dforce(&g, &d), DOUBLE),
    ];
    std::array::from_fn(|k| {
        let (values, u) = &found[k];
        let error = relative(values, &expected[k % 2]);
        let what = ["P in f32", "dP in f32", "P in f64", "dP in f64"][k];
        assert!(error <= UNITS * u, "{context}: {what} is wrong by {error:e} of it: {values:?}");
        error
    })
}

#[test]
fn nearly_equal_stretches_are_no_exception() {
    let folder = root().join("tests/reference/stretches");
    let mut worst = [0.0f64; 4];
    let mut states = 0;
    for law in laws() {
        let path = folder.join(format!("{}.json", law.info.name));
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        let file: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(file["law"], law.info.name);
        for (k, state) in file["states"].as_array().expect("states").iter().enumerate() {
            let errors = check(law, state, &format!("state {k} of {}", path.display()));
            worst = std::array::from_fn(|i| worst[i].max(errors[i]));
            states += 1;
        }
    }
    // Each file of the folder has at least two states for each of five gaps.
    let files = std::fs::read_dir(&folder).expect("the folder").count();
    assert!(files > 0 && states >= 20 * files, "{states} states in {files} files");
    let worst = worst.map(|x| format!("{x:.1e}"));
    eprintln!("worst relative errors of P and dP in f32, and in f64: {worst:?}");
}

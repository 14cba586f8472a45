//! Runs the crate's own law: its energy against the closed form, its derivatives against differences.

use custom_law::MooneyRivlin;
use custom_law::generated::LAWS;
use tensormass_kernels::Law;

/// c10, c01 and the bulk modulus (Pa).
const PARAMETERS: [f64; 3] = [2.0e5, 0.5e5, 3.0e6];

fn constants() -> Vec<f64> {
    let mut constants = vec![0.0; MooneyRivlin::info().constants.len()];
    MooneyRivlin::material(&PARAMETERS, &mut constants);
    constants
}

/// Displacement gradients: rest, moderate, and one far from both.
const STATES: [[f64; 9]; 3] = [
    [0.0; 9],
    [0.1, 0.05, -0.02, 0.03, -0.08, 0.04, 0.01, -0.06, 0.12],
    [0.6, 0.3, -0.2, -0.4, -0.3, 0.5, 0.2, 0.1, 0.4],
];

fn stepped(g: &[f64; 9], direction: &[f64; 9], h: f64) -> [f64; 9] {
    std::array::from_fn(|k| g[k] + h * direction[k])
}

#[test]
fn the_table_lists_the_law() {
    assert_eq!(LAWS.len(), 1);
    assert_eq!(LAWS[0].info.name, "mooney_rivlin");
    assert!(LAWS[0].info.reviewed, "laws/derived/mooney_rivlin.ir is missing or of another text of the law");
}

/// F = diag(a, b, c): I1 = a^2 + b^2 + c^2, I2 = a^2 b^2 + b^2 c^2 + c^2 a^2, J = a b c.
#[test]
fn energy_is_the_closed_form() {
    let [c10, c01, bulk] = PARAMETERS;
    for [a, b, c] in [[1.0, 1.0, 1.0], [1.3, 0.9, 0.8], [0.5, 1.5, 1.1]] {
        let j: f64 = a * b * c;
        let i1bar = (a * a + b * b + c * c) / j.powf(2.0 / 3.0);
        let i2bar = (a * a * b * b + b * b * c * c + c * c * a * a) / j.powf(4.0 / 3.0);
        let expected = c10 * (i1bar - 3.0) + c01 * (i2bar - 3.0) + bulk / 2.0 * (j - 1.0) * (j - 1.0);
        let g = [a - 1.0, 0.0, 0.0, 0.0, b - 1.0, 0.0, 0.0, 0.0, c - 1.0];
        let (energy, margin) = MooneyRivlin::energy(&constants(), &g);
        // A few roundings of terms of the size of the parameters times the strain, which is about 1.
        let tolerance = 100.0 * f64::EPSILON * (c10 + c01 + bulk);
        assert!((energy - expected).abs() < tolerance, "F = diag({a}, {b}, {c}): W = {energy}, expected {expected}");
        assert!(margin > 0.0);
    }
}

/// Central differences err by h^2 times a third derivative, of the size of the bulk modulus times about 10 here, and by
/// epsilon / h times the differenced value: both are about 1e-9 of it at h = 1e-5.
#[test]
fn force_and_dforce_are_derivatives() {
    let (constants, h) = (constants(), 1e-5);
    let tolerance = 1e-8 * PARAMETERS[2];
    for g in &STATES {
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let direction: [f64; 9] = std::array::from_fn(|k| STATES[to][k] - STATES[from][k]);
            let (ahead, behind) = (stepped(g, &direction, h), stepped(g, &direction, -h));
            let (stress, _) = MooneyRivlin::force(&constants, g);
            let work: f64 = stress.iter().zip(&direction).map(|(p, d)| p * d).sum();
            let slope =
                (MooneyRivlin::energy(&constants, &ahead).0 - MooneyRivlin::energy(&constants, &behind).0) / (2.0 * h);
            assert!((work - slope).abs() < tolerance, "G = {g:?}: P : dG = {work}, dW = {slope}");
            let differential = MooneyRivlin::dforce(&constants, g, &direction);
            let (p, q) = (MooneyRivlin::force(&constants, &ahead).0, MooneyRivlin::force(&constants, &behind).0);
            for k in 0..9 {
                let slope = (p[k] - q[k]) / (2.0 * h);
                assert!(
                    (differential[k] - slope).abs() < tolerance,
                    "G = {g:?}, component {k}: {}, {slope}",
                    differential[k]
                );
            }
        }
    }
}

#[test]
fn outside_the_domain_is_reported() {
    let inverted = [-2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(MooneyRivlin::force(&constants(), &inverted).1 <= 0.0);
}

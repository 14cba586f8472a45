//! Runs the crate's own law: its energy against the closed form, its derivatives against differences.

use custom_law::Gent;
use custom_law::generated::LAWS;
use tensormass_kernels::Law;

/// Shear modulus (Pa), the limit of I1bar - 3, and bulk modulus (Pa).
const PARAMETERS: [f64; 3] = [4.0e5, 5.0, 3.0e6];

fn constants() -> Vec<f64> {
    let mut constants = vec![0.0; Gent::info().constants.len()];
    Gent::material(&PARAMETERS, &mut constants);
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
    assert_eq!(LAWS[0].info.name, "gent");
    assert!(LAWS[0].info.reviewed, "laws/derived/gent.ir is missing or of another text of the law");
}

/// F = diag(a, b, c): I1 = a^2 + b^2 + c^2, J = a b c.
#[test]
fn energy_is_the_closed_form() {
    let [mu, j_m, kappa] = PARAMETERS;
    for [a, b, c] in [[1.0, 1.0, 1.0], [1.3, 0.9, 0.8], [0.5, 1.5, 1.1]] {
        let j: f64 = a * b * c;
        let i1bar = (a * a + b * b + c * c) / j.powf(2.0 / 3.0);
        let expected = -mu * j_m / 2.0 * (1.0 - (i1bar - 3.0) / j_m).ln() + kappa / 2.0 * (j - 1.0) * (j - 1.0);
        let g = [a - 1.0, 0.0, 0.0, 0.0, b - 1.0, 0.0, 0.0, 0.0, c - 1.0];
        let (energy, margin) = Gent::energy(&constants(), &g);
        // A few roundings of terms of the size of the parameters times the strain, which is about 1.
        let tolerance = 100.0 * f64::EPSILON * (mu * j_m + kappa);
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
            let (stress, _) = Gent::force(&constants, g);
            let work: f64 = stress.iter().zip(&direction).map(|(p, d)| p * d).sum();
            let slope = (Gent::energy(&constants, &ahead).0 - Gent::energy(&constants, &behind).0) / (2.0 * h);
            assert!((work - slope).abs() < tolerance, "G = {g:?}: P : dG = {work}, dW = {slope}");
            let differential = Gent::dforce(&constants, g, &direction);
            let (p, q) = (Gent::force(&constants, &ahead).0, Gent::force(&constants, &behind).0);
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

/// Inverted; and stretched, at constant volume, beyond the limit: I1bar - 3 = 3^2 + 2/3 - 3 = 6.7 > 5.
#[test]
fn outside_the_domain_is_reported() {
    let inverted = [-2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let across = 1.0 / 3f64.sqrt() - 1.0;
    let stretched = [2.0, 0.0, 0.0, 0.0, across, 0.0, 0.0, 0.0, across];
    for g in [inverted, stretched] {
        assert!(Gent::force(&constants(), &g).1 <= 0.0, "{g:?}");
        assert!(Gent::energy(&constants(), &g).1 <= 0.0, "{g:?}");
    }
}

//! Elastic moduli of a law at rest, from its tangent there.

use tensormass_kernels::LawEntry;

use crate::cpu::One;

/// A tangent at rest is isotropic if it deviates by less than this part of itself.
const ISOTROPIC: f64 = 1e-6;

/// Lame's constants of a law at rest, in the unit of stress of its constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lame {
    /// lambda.
    pub lambda: f64,
    /// mu, the shear modulus.
    pub mu: f64,
}

impl Lame {
    /// Of the average of a law's tangent at rest over all directions (Voigt 1889): of an isotropic law its own.
    pub fn at_rest(law: &LawEntry, constants: &[f64]) -> Self {
        let tangent = tangent_at_rest(law, constants);
        let sum = |entry: &dyn Fn(usize, usize) -> f64| (0..9).map(|n| entry(n / 3, n % 3)).sum::<f64>();
        // C_iikk = 9 lambda + 6 mu, C_ikik = 3 lambda + 12 mu.
        let (bulk, all) = (sum(&|i, k| tangent[4 * i][4 * k]), sum(&|i, k| tangent[3 * i + k][3 * i + k]));
        Self { lambda: (2.0 * bulk - all) / 15.0, mu: (3.0 * all - bulk) / 30.0 }
    }

    /// Poisson's ratio.
    pub fn poisson(&self) -> f64 {
        0.5 * self.lambda / (self.lambda + self.mu)
    }
}

/// Young's modulus (Pa) and Poisson's ratio of a law at rest, if it is isotropic there; its constants are in SI units.
pub fn moduli(law: &LawEntry, constants: &[f64]) -> Option<[f64; 2]> {
    let tangent = tangent_at_rest(law, constants);
    let (lambda, mu) = (tangent[0][4], 0.5 * (tangent[1][1] + tangent[1][3]));
    let largest = tangent.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    let delta = |a: usize, b: usize| f64::from(u8::from(a == b));
    for p in 0..9 {
        for q in 0..9 {
            let (i, j, k, l) = (p / 3, p % 3, q / 3, q % 3);
            let wanted =
                lambda * delta(i, j) * delta(k, l) + mu * (delta(i, k) * delta(j, l) + delta(i, l) * delta(j, k));
            if (tangent[p][q] - wanted).abs() > ISOTROPIC * largest {
                return None;
            }
        }
    }
    (mu > 0.0 && lambda + mu > 0.0)
        .then(|| [mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu), 0.5 * lambda / (lambda + mu)])
}

/// dP at rest for each unit gradient, row by row.
fn tangent_at_rest(law: &LawEntry, constants: &[f64]) -> Vec<[f64; 9]> {
    let point = One::point(law, constants);
    let unit = |k: usize| std::array::from_fn(|n| f64::from(u8::from(n == k)));
    (0..9).map(|k| point.stress_differential(&[0.0; 9], &unit(k))).collect()
}

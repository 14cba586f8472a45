//! Laws that answer small strains alike: what a scene's law can be exchanged for.

use tensormass_runtime::cpu::One;
use tensormass_runtime::{LawEntry, laws};

/// A tangent at rest is isotropic if it deviates by less than this part of itself.
const ISOTROPIC: f64 = 1e-6;

/// Young's modulus (Pa) and Poisson's ratio of a law at rest, if it is isotropic there; its constants are in SI units.
pub fn moduli(law: &LawEntry, constants: &[f64]) -> Option<[f64; 2]> {
    let point = One::point(law, constants);
    // dP for each unit gradient: row by row.
    let tangent: Vec<[f64; 9]> = (0..9)
        .map(|k| {
            let mut unit = [0.0; 9];
            unit[k] = 1.0;
            point.stress_differential(&[0.0; 9], &unit)
        })
        .collect();
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

/// The laws of this build that are given by Young's modulus and Poisson's ratio alone, and answer small strains by them.
pub fn by_moduli() -> impl Iterator<Item = &'static LawEntry> {
    let trial = [1e6, 0.3];
    laws().iter().filter(move |law| {
        let names: Vec<&str> = law.info.parameters.iter().filter(|p| p.len == 1).map(|p| p.name).collect();
        law.info.parameters.len() == 2
            && names == ["young", "poisson"]
            && moduli(law, &law.constants(&trial))
                .is_some_and(|found| found.iter().zip(trial).all(|(a, b)| (a - b).abs() < 1e-6 * b))
    })
}

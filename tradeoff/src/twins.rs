//! Laws that answer small strains alike: what a scene's law can be exchanged for.

use tensormass_runtime::moduli::moduli;
use tensormass_runtime::{LawEntry, laws};

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

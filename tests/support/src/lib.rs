//! What the kernel tests share: random states, one-element batches, derivations, and the tolerance of every comparison.
//!
//! No tolerance is chosen: [`rounding`] carries a bound of the rounding error along with every value.

pub mod evaluate;
pub mod point;
pub mod random;
pub mod rounding;
pub mod tensor;
pub mod wgsl;

/// The generator, without Symbolica.
pub use tensormass_codegen as codegen;

use std::path::{Path, PathBuf};

use codegen::derivation::Derivation;

/// The root package's folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The text of the derivation from which this build printed a law: fresh in `generated` where the build differentiated,
/// otherwise the committed one.
///
/// # Panics
/// There is none.
pub fn derivation_text(generated: &str, law: &str) -> String {
    let fresh = Path::new(generated).join("derived").join(format!("{law}.ir"));
    let path = if fresh.exists() { fresh } else { root().join("laws/derived").join(format!("{law}.ir")) };
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The derivation from which this build printed a law.
///
/// # Panics
/// There is none, or it is not a derivation.
pub fn derivation(generated: &str, law: &str) -> Derivation {
    Derivation::from_text(&derivation_text(generated, law)).unwrap_or_else(|e| panic!("{law}: {e}"))
}

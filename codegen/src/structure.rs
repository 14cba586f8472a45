//! What a derivation reveals of its law: detected from the kernels, never declared.

use crate::derivation::Derivation;
use crate::ir::{Input, Op};

/// The structure that specialisation may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Structure {
    /// dP does not depend on G: one linear solve gives the static equilibrium.
    pub linear: bool,
    /// The stress divides by, takes the logarithm of or multiplies with cofactors of F.
    pub uses_j: bool,
    /// Force and force differential are polynomials in G: no division, no function, no selection.
    pub polynomial: bool,
}

/// Detects the structure of a law.
pub fn detect(derivation: &Derivation) -> Structure {
    let (force, dforce) = (derivation.kernel("force"), derivation.kernel("dforce"));
    let linear = !dforce.reads(Input::DisplacementGradient);
    let uses_j = force.ir().values.iter().any(|d| d.name.as_deref() == Some("K00"));
    let polynomial = [force, dforce].iter().all(|k| {
        k.ir().values.iter().all(|d| match d.op {
            Op::Input(..) | Op::Const(_) | Op::Add(..) | Op::Sub(..) | Op::Mul(..) | Op::Neg(_) | Op::Fma(..) => true,
            Op::Div(..) | Op::Sqrt(_) | Op::Ln(_) | Op::Exp(_) | Op::Log1p(_) | Op::Expm1(_) => false,
            Op::Log1pmx(_) | Op::Expm1mx(_) | Op::Powf(..) | Op::Select(..) => false,
        })
    });
    Structure { linear, uses_j, polynomial }
}

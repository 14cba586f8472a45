//! What a derivation reveals of its law: detected from the kernels, never declared.

use crate::derivation::Derivation;
use crate::ir::{Input, Op, ValidKernel};
use crate::law::ast::Law;

/// The structure that specialisation may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Structure {
    /// dP does not depend on G: one linear solve gives the static equilibrium.
    pub linear: bool,
    /// No direction of the body at rest is preferred: nothing but fibres could make a difference.
    pub isotropic: bool,
    /// The stress divides by, takes the logarithm of or multiplies with cofactors of F.
    pub uses_j: bool,
    /// The energy, the stress or its differential depends on a fibre direction.
    pub uses_fibres: bool,
    /// Force and force differential are polynomials in G: no division, no function, no selection.
    pub polynomial: bool,
}

/// Detects the structure of a law; of the law itself only the parameters' types are read.
pub fn detect(law: &Law, derivation: &Derivation) -> Structure {
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
    let fibres = fibre_constants(law, derivation.kernel("material"));
    let damping = derivation.is_dissipative().then(|| derivation.kernel("damping"));
    let uses_fibres = [derivation.kernel("energy"), force, dforce].into_iter().chain(damping).any(|kernel| {
        let read = kernel.ir().values.iter().filter_map(|d| match d.op {
            Op::Input(Input::Constants, k) => Some(k as usize),
            _ => None,
        });
        read.into_iter().any(|k| fibres[k])
    });
    // The law language has no other tensor of the body at rest than the identity and the directions.
    Structure { linear, isotropic: !uses_fibres, uses_j, uses_fibres, polynomial }
}

/// Of each constant, whether a direction's component enters it.
fn fibre_constants(law: &Law, material: &ValidKernel) -> Vec<bool> {
    let components: Vec<bool> = law.parameters.iter().flat_map(|p| vec![p.direction; p.len]).collect();
    let mut depends: Vec<bool> = Vec::new();
    for definition in &material.ir().values {
        depends.push(match definition.op {
            Op::Input(Input::Parameters, k) => components[k as usize],
            op => op.operands().iter().any(|v| depends[v.index()]),
        });
    }
    let outputs = material.ir().outputs.iter().flat_map(|(_, values)| values);
    outputs.map(|v| depends[v.index()]).collect()
}

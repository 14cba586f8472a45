//! Which parameters a law uses: one that it does not use would be silently ignored.

use std::collections::BTreeSet;
use std::rc::Rc;

use super::ast::{Domain, Scalar, ScalarNode, Tensor, TensorNode};
use super::error::{LawError, Source};
use super::metadata::Metadata;

/// Parameters, and components of array parameters, that none of the energy, `others` and the domain uses.
pub(super) fn unused(
    source: &Source,
    metadata: &Metadata,
    energy: &Scalar,
    others: &[&Scalar],
    domain: Option<&Domain>,
) -> Vec<LawError> {
    let mut uses = Uses::default();
    uses.scalar(energy);
    for other in others {
        uses.scalar(other);
    }
    for side in domain.iter().flat_map(|domain| [&domain.left, &domain.right]) {
        uses.scalar(side);
    }
    let mut errors = Vec::new();
    for (i, (parameter, span)) in metadata.parameters.iter().zip(&metadata.spans).enumerate() {
        let missing: Vec<usize> = (0..parameter.len).filter(|c| !uses.found.contains(&(i, *c))).collect();
        let reason = match missing[..] {
            [] => continue,
            [component, ..] if missing.len() < parameter.len => {
                format!("component {component} of the parameter `{}` is never used", parameter.name)
            }
            _ => format!("the parameter `{}` is never used", parameter.name),
        };
        errors.push(source.error(*span, reason, "use it in the energy, or delete it: it would be silently ignored"));
    }
    errors
}

/// The parameters of a tree, each shared node visited once.
#[derive(Default)]
struct Uses {
    found: BTreeSet<(usize, usize)>,
    scalars: BTreeSet<*const ScalarNode>,
    tensors: BTreeSet<*const TensorNode>,
}

impl Uses {
    fn scalar(&mut self, scalar: &Scalar) {
        if !self.scalars.insert(Rc::as_ptr(scalar)) {
            return;
        }
        match &**scalar {
            ScalarNode::Number(_) => {}
            ScalarNode::Invariant(invariant) => {
                for direction in invariant.directions() {
                    self.found.extend((0..3).map(|component| (direction, component)));
                }
            }
            ScalarNode::Parameter { parameter, component } => {
                self.found.insert((*parameter, *component));
            }
            ScalarNode::Trace(a) | ScalarNode::Det(a) => self.tensor(a),
            ScalarNode::Ddot(a, b) => {
                self.tensor(a);
                self.tensor(b);
            }
            ScalarNode::Add(a, b)
            | ScalarNode::Sub(a, b)
            | ScalarNode::Mul(a, b)
            | ScalarNode::Div(a, b)
            | ScalarNode::Powf(a, b) => {
                self.scalar(a);
                self.scalar(b);
            }
            ScalarNode::Neg(a)
            | ScalarNode::StretchSum(a)
            | ScalarNode::Powi(a, _)
            | ScalarNode::Ln(a)
            | ScalarNode::Exp(a)
            | ScalarNode::Sqrt(a)
            | ScalarNode::Named(_, a)
            | ScalarNode::Rate(a) => self.scalar(a),
            ScalarNode::Select { left, right, then, otherwise } => {
                for side in [left, right, then, otherwise] {
                    self.scalar(side);
                }
            }
        }
    }

    fn tensor(&mut self, tensor: &Tensor) {
        if !self.tensors.insert(Rc::as_ptr(tensor)) {
            return;
        }
        match &**tensor {
            TensorNode::Eps | TensorNode::E | TensorNode::C | TensorNode::Identity => {}
            TensorNode::Add(a, b) | TensorNode::Sub(a, b) => {
                self.tensor(a);
                self.tensor(b);
            }
            TensorNode::Scale(s, a) => {
                self.scalar(s);
                self.tensor(a);
            }
            TensorNode::Rate(a) => self.tensor(a),
        }
    }
}

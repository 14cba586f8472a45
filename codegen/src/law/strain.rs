//! The strain: the fields that it offers, and those that it does not.

use proc_macro2::Span;

use super::ast::{Invariant, ScalarNode, TensorNode};
use super::dimension::Dimension;
use super::expr::Lowering;
use super::interval::Values;
use super::value::{ScalarValue, TensorValue, Value};
use super::words;

impl Lowering<'_> {
    /// `s.name`.
    pub(super) fn strain_field(&mut self, name: &str, span: Span) -> Value {
        if let Some(value) = strain(name) {
            self.measured(name, span);
            return value;
        }
        if let Some(remedy) = words::fibre_remedy(name) {
            return self.broken(span, format!("the strain has no field `{name}`"), remedy);
        }
        let intro = "the strain offers";
        if let Some(remedy) = words::stretch_remedy(name) {
            return self.broken(span, format!("the strain has no field `{name}`"), remedy);
        }
        if matches!(name, "F" | "G") {
            let reason = format!("the strain does not offer `{name}`: an energy of it could change under rotation");
            return self.broken(span, reason, "write the energy in C, E or the invariants");
        }
        self.broken(span, format!("the strain has no field `{name}`"), words::suggest(name, words::STRAIN, intro))
    }
}

/// The strain's field of that name.
pub(super) fn strain(name: &str) -> Option<Value> {
    let invariant = |i| {
        let (node, values) = (ScalarNode::Invariant(i), Values::of_invariant(i));
        Some(Value::Scalar(ScalarValue::leaf(node, true, Some(Dimension::ONE), values)))
    };
    let tensor = |node| Some(Value::Tensor(TensorValue::leaf(node)));
    match name {
        "eps" => tensor(TensorNode::Eps),
        "E" => tensor(TensorNode::E),
        "C" => tensor(TensorNode::C),
        "I1" => invariant(Invariant::I1),
        "I2" => invariant(Invariant::I2),
        "I3" => invariant(Invariant::I3),
        "J" => invariant(Invariant::J),
        "I1bar" => invariant(Invariant::I1bar),
        "I2bar" => invariant(Invariant::I2bar),
        _ => None,
    }
}

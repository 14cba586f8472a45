//! The dissipation, and the strain rate that it is a function of: the rates of what the strain offers.

use std::rc::Rc;

use proc_macro2::Span;

use super::ast::{Scalar, ScalarNode, TensorNode};
use super::dimension::Dimension;
use super::expr::Lowering;
use super::functions::{ArgumentType, DISSIPATION_SIGNATURE, Function, is_dissipation};
use super::interval::Values;
use super::strain::strain;
use super::value::{Facts, ScalarValue, TensorValue, Value};
use super::words;

const DISSIPATION: &str = "dissipation_density";

impl Lowering<'_> {
    /// D, the sum of its parts; `None` if the law has none, or if an error was noted.
    pub(super) fn dissipation(&mut self, has_parameters: bool) -> Option<Scalar> {
        let functions = self.densities(is_dissipation);
        if functions.len() > 1
            && let Some((_, span)) = functions.iter().find(|(name, _)| name == DISSIPATION)
        {
            let reason = format!("the law has both `{DISSIPATION}` and parts of it");
            self.error(*span, reason, "keep one or the other: the parts' sum is D");
            return None;
        }
        let parts: Vec<ScalarValue> =
            functions.iter().filter_map(|(name, span)| self.dissipation_part(name, *span, has_parameters)).collect();
        parts.into_iter().reduce(|total, part| total.add(&part)).map(|total| total.node)
    }

    /// The dissipation, or one part of it.
    fn dissipation_part(&mut self, name: &str, span: Span, has_parameters: bool) -> Option<ScalarValue> {
        let arguments = self.functions.get(name)?.arguments.clone()?;
        let kinds: Vec<ArgumentType> = arguments.iter().map(|argument| argument.kind).collect();
        if kinds != [ArgumentType::Strain, ArgumentType::StrainRate, ArgumentType::Parameters] {
            let reason = format!("`{name}` takes the strain, its rate and the parameters");
            self.error(span, reason, format!("write `fn {name}{DISSIPATION_SIGNATURE}`"));
            return None;
        }
        if !has_parameters {
            return None;
        }
        let known = self.errors.len();
        let value = self.inline(name, vec![Value::Strain, Value::StrainRate, Value::Parameters], span);
        let Value::Scalar(value) = value else { return None };
        if self.errors.len() > known {
            return None;
        }
        if !value.facts.rate {
            let remedy = "use fields of the strain rate, such as `r.E` or `r.J`: without them nothing is dissipated";
            self.error(span, format!("`{name}` does not depend on the strain rate"), remedy);
            return None;
        }
        let place = self.functions.get(name).map_or(span, Function::value_place);
        if !self.parameters.is_empty() {
            self.dissipation_dimension(name, value.facts.dimension, place);
        }
        Some(value)
    }

    /// `r.name`.
    pub(super) fn rate_field(&mut self, name: &str, span: Span) -> Value {
        if let Some(value) = strain(name) {
            self.measured(name, span);
            return rate(value);
        }
        let reason = format!("the strain rate has no field `{name}`");
        if let Some(remedy) = words::fibre_remedy(name).or(words::stretch_remedy(name).map(str::to_owned)) {
            return self.broken(span, reason, remedy.replace("`s.", "`r."));
        }
        if matches!(name, "F" | "G") {
            let reason = format!("the strain rate does not offer `{name}`: a rigid rotation has such a rate too");
            return self.broken(span, reason, "write the dissipation in the rates of E, C or the invariants");
        }
        self.broken(span, reason, words::suggest(name, words::STRAIN, "the strain rate offers the rates of"))
    }
}

/// The rate of a value of the strain.
pub(super) fn rate(value: Value) -> Value {
    let of = |facts: Facts| Facts {
        strain: true,
        rate: true,
        depth: facts.depth + 1,
        dimension: facts.dimension.and_then(|d| d.times(Dimension::FREQUENCY)),
    };
    match value {
        Value::Scalar(value) => Value::Scalar(ScalarValue {
            node: Rc::new(ScalarNode::Rate(value.node)),
            facts: of(value.facts),
            untyped: false,
            constant: None,
            values: Values::ALL,
        }),
        Value::Tensor(value) => {
            Value::Tensor(TensorValue { node: Rc::new(TensorNode::Rate(value.node)), facts: of(value.facts) })
        }
        other => other,
    }
}

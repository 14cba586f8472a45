//! Fibre directions: the parameters' type `Direction`, and the strain's invariants with them.

use proc_macro2::Span;
use syn::ExprMethodCall;
use syn::spanned::Spanned;

use super::ast::{Invariant, Parameter, ScalarNode};
use super::dimension::Dimension;
use super::error::{LawError, Source};
use super::expr::{Lowering, Scope};
use super::interval::Values;
use super::value::{ScalarValue, Value};
use super::words;

/// What the attributes of a direction gave: their places, and the default's values.
pub(super) struct Given<'a> {
    pub(super) unit: Option<(&'a str, Span)>,
    pub(super) range: Option<Span>,
    pub(super) default: Option<(&'a [f64], Span)>,
}

/// Makes `parameter` a direction: three components of a unit vector, without a unit or a range of its own.
pub(super) fn direction(source: &Source, parameter: &mut Parameter, given: &Given, errors: &mut Vec<LawError>) {
    if let Some((_, place)) = given.unit.filter(|(text, _)| *text != "1") {
        let remedy = "write `#[unit(\"1\")]`, or leave it out";
        errors.push(source.error(place, "a direction is a unit vector and has no unit", remedy));
    }
    if let Some(place) = given.range {
        errors.push(source.error(place, "a direction is a unit vector and has no range", "remove it"));
    }
    (parameter.direction, parameter.len, parameter.range) = (true, 3, (-1.0, 1.0));
    let Some((values, place)) = given.default else { return };
    // As a scene's directions: of any length.
    let largest = values.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if values.len() != 3 || largest == 0.0 {
        let remedy = "give the components of a vector that is not zero: `#[default(1.0, 0.0, 0.0)]`";
        errors.push(source.error(place, "the default of a direction is a vector with a direction", remedy));
        return;
    }
    let scaled: Vec<f64> = values.iter().map(|x| x / largest).collect();
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    parameter.default = Some(scaled.iter().map(|x| x / length).collect());
}

impl Lowering<'_> {
    /// `s.I4(p.a)` and its like, written as `usage` says.
    pub(super) fn fibre_invariant(&mut self, usage: &str, call: &ExprMethodCall, scope: &Scope) -> Value {
        let name = call.method.to_string();
        if let Some(turbofish) = &call.turbofish {
            return self.broken(turbofish.span(), "methods of a law have no generics", format!("write `s.{usage}`"));
        }
        if call.args.len() != words::arity(usage) {
            let usage = format!("s.{usage}");
            return self.wrong_count(&name, call.method.span(), &usage, words::arity(&usage), call.args.len());
        }
        let mut directions = Vec::new();
        for argument in &call.args {
            match self.expr(argument, scope) {
                Value::Direction(index) => directions.push(index),
                Value::Broken => return Value::Broken,
                other => {
                    let reason = format!("`{name}` takes a direction, and this is {}", other.kind());
                    let remedy = format!("write `s.{usage}`, with a parameter `a: Direction`");
                    return self.broken(argument.span(), reason, remedy);
                }
            }
        }
        let invariant = match (name.as_str(), directions.as_slice()) {
            ("I4", &[a]) => Invariant::I4(a),
            ("I5", &[a]) => Invariant::I5(a),
            ("I4bar", &[a]) => Invariant::I4bar(a),
            ("I5bar", &[a]) => Invariant::I5bar(a),
            // C is symmetric: one invariant, however it is written.
            ("I8", &[a, b]) if a == b => Invariant::I4(a),
            ("I8", &[a, b]) => Invariant::I8(a.min(b), a.max(b)),
            _ => return self.broken(call.method.span(), format!("unknown method `{name}`"), "see laws/README.md"),
        };
        let (dimension, values) = (Some(Dimension::ONE), Values::of_invariant(invariant));
        Value::Scalar(ScalarValue::leaf(ScalarNode::Invariant(invariant), true, dimension, values))
    }
}

//! Where a law holds: what needs `#[domain(..)]` or `#[small_strain]`, and is refused without.

use proc_macro2::Span;

use super::expr::Lowering;
use super::interval::{Interval, Values};
use super::value::ScalarValue;

/// What a law's attributes declare, as far as expressions depend on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Declared {
    /// `#[domain(..)]`
    pub(super) domain: bool,
    /// `#[small_strain]`
    pub(super) small_strain: bool,
}

impl Lowering<'_> {
    /// Notes the use of the strain's field `name`.
    pub(super) fn measured(&mut self, name: &str, span: Span) {
        if name == "eps" {
            if !self.uses_eps && !self.declared.small_strain {
                let reason = "`eps` changes under rotation, and the law does not say so";
                let remedy =
                    "write `#[small_strain]` above `struct Parameters`, or the energy in `s.E`, which does not";
                self.error(span, reason, remedy);
            }
            self.uses_eps = true;
        }
        if matches!(name, "I1bar" | "I2bar") && self.unprotected() {
            let reason =
                format!("`{name}` divides by a power of J, which can be 0 or negative, and the law has no domain");
            self.error(span, reason, "write `#[domain(J > 0.0)]` above `struct Parameters`");
        }
    }

    /// Refuses `function` of a strain expression that can be 0 or negative, if the law declares no domain.
    pub(super) fn positive(&mut self, function: &str, x: &ScalarValue, span: Span) {
        if x.facts.rate {
            return self.at_every_rate(&format!("`{function}` of"), x, span, |values| values.is_positive());
        }
        if x.facts.strain && self.unprotected() && !x.values.anywhere.is_positive() {
            let reason = format!("`{function}` of a value that can be 0 or negative, and the law has no domain");
            self.error(span, reason, remedy(x.values, |values| values.upright.is_positive()));
        }
    }

    /// Refuses a strain expression as a divisor if it can be 0 and the law declares no domain.
    pub(super) fn divides(&mut self, x: &ScalarValue, span: Span) {
        if x.facts.rate {
            return self.at_every_rate("division by", x, span, |values| values.is_nonzero());
        }
        if x.facts.strain && self.unprotected() && !x.values.anywhere.is_nonzero() {
            let reason = "division by a value that can be 0, and the law has no domain";
            self.error(span, reason, remedy(x.values, |values| values.upright.is_nonzero()));
        }
    }

    /// Refuses a function of rates that is not defined at all of them: no domain keeps a body from being at rest.
    fn at_every_rate(&mut self, function: &str, x: &ScalarValue, span: Span, holds: fn(Interval) -> bool) {
        let values = if self.unprotected() { x.values.anywhere } else { x.values.upright };
        if !holds(values) {
            let reason = format!("{function} a value that can be 0 or negative at some rate");
            let remedy = "add what keeps it positive also at rest, as in `(1.0 + ddot(r.E, r.E) / p.reference.powi(2)).powf(p.m)`";
            self.error(span, reason, remedy);
        }
    }

    /// Whether nothing is said of the strains at which the law holds. A domain's own expression is not asked.
    fn unprotected(&self) -> bool {
        !self.declared.domain && !self.in_domain
    }
}

/// What to write: J > 0 where that is enough.
fn remedy(values: Values, holds: fn(Values) -> bool) -> &'static str {
    if holds(values) {
        "write `#[domain(J > 0.0)]` above `struct Parameters`"
    } else {
        "write `#[domain(..)]` above `struct Parameters`: the inequality that keeps it positive, as in \
         `#[domain(j_m - (I1 - 3.0) > 0.0)]`"
    }
}

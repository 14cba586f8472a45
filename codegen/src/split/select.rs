//! Choices: branches that agree at rest, or a condition that is decided there; what jumps may be multiplied by what vanishes.

use crate::expr::{Expr, Symbol};
use crate::quantity::{Kind, Value};

use super::{Jump, Second, Split, SplitError, Splitter};

impl Splitter<'_> {
    /// A choice: both branches have to have the same constant at rest, unless the condition is decided there.
    pub(super) fn select(&mut self, s: Symbol, parts: [&Expr; 4]) -> Result<Split, SplitError> {
        let [left, right, then, otherwise] = parts;
        let condition = self.split(&(left.clone() - right.clone()))?;
        let (then_, otherwise_) = (self.part(then)?, self.part(otherwise)?);
        if let Some(jump) = then_.jump.clone().or_else(|| otherwise_.jump.clone()) {
            return Ok(self.jumping(s.into(), jump));
        }
        let threshold = self.simplify(Expr::int(-1) * condition.rest.clone())?;
        let difference = self.simplify(then_.rest.clone() - otherwise_.rest.clone())?;
        let name = self.quantities.get(s).name.clone();
        // At rest the condition compares 0 with the threshold.
        let decided = self.sign(&threshold)?.map(|positive| !positive);
        let (rest, then_change, otherwise_change) = if difference.is_zero() {
            (then_.rest.clone(), then_.change.clone(), otherwise_.change.clone())
        } else {
            match decided {
                Some(true) => (then_.rest.clone(), then_.change.clone(), otherwise_.value.clone() - then_.rest.clone()),
                Some(false) => {
                    (otherwise_.rest.clone(), then_.value.clone() - otherwise_.rest.clone(), otherwise_.change.clone())
                }
                None => {
                    let (then, otherwise) = (self.text(&then_.rest), self.text(&otherwise_.rest));
                    let reason =
                        format!("jumps at rest from {otherwise} to {then}, and which of the two counts is open");
                    let left = condition.change;
                    let (then, otherwise) = (then_.value, otherwise_.value);
                    let value = Value::Select { left, right: threshold, then, otherwise };
                    let value = self.quantities.add(name, Kind::Stage { value, partials: None });
                    return Ok(self.jumping(value.into(), Jump { term: s.into(), reason }));
                }
            }
        };
        let rewritten =
            (condition.rewritten.0 || !condition.rest.is_zero() || then_.rewritten.0 || otherwise_.rewritten.0, false);
        let choose = |splitter: &mut Self, name: String, then: Expr, otherwise: Expr| -> Expr {
            if then == otherwise {
                return then;
            }
            let value = Value::Select { left: condition.change.clone(), right: threshold.clone(), then, otherwise };
            splitter.quantities.add(name, Kind::Stage { value, partials: None }).into()
        };
        let second = match (then_.second, otherwise_.second) {
            (Some(a), Some(b)) if difference.is_zero() && a.linear == b.linear => {
                let remainder = choose(self, format!("{name}_remainder"), a.remainder, b.remainder);
                let order = a.order.min(b.order);
                Some(Second { linear: a.linear, remainder, order, is_whole: a.is_whole && b.is_whole })
            }
            (Some(a), Some(b)) => {
                // A decided condition takes one branch in a neighbourhood of rest.
                let taken = match decided {
                    Some(true) => Some(a),
                    Some(false) => Some(b),
                    None => None,
                };
                match taken {
                    Some(near) => {
                        let linear = near.linear.clone();
                        let form = near.linear_form();
                        let then = then_change.clone() - form.clone();
                        let otherwise = otherwise_change.clone() - form;
                        let (then, otherwise) = match decided {
                            Some(true) => (near.remainder.clone(), otherwise),
                            _ => (then, near.remainder.clone()),
                        };
                        let remainder = choose(self, format!("{name}_remainder"), then, otherwise);
                        Some(Second { linear, remainder, order: near.order, is_whole: false })
                    }
                    None => {
                        let change =
                            choose(self, format!("{name}_change"), then_change.clone(), otherwise_change.clone());
                        Some(Second::of_first_order(change))
                    }
                }
            }
            _ => None,
        };
        let change = choose(self, format!("{name}_change"), then_change, otherwise_change);
        let value = rest.clone() + change.clone();
        Ok(Split { rest, change, value, rewritten, second, jump: None })
    }
}

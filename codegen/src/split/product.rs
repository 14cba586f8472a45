//! Products: (a + x)(b + y) = a b + (a y + x (b + y)).

use crate::expr::Expr;

use super::{Order, Second, Split, SplitError, Splitter};

impl Splitter<'_> {
    pub(super) fn product(&mut self, factors: &[Expr]) -> Result<Split, SplitError> {
        let mut result: Option<Split> = None;
        // Constants first: they scale.
        let (constant, varying): (Vec<_>, Vec<_>) = factors.iter().partition(|f| self.quantities.is_constant_expr(f));
        if !constant.is_empty() {
            let scale = Expr::Product(constant.into_iter().cloned().collect());
            result = Some(self.constant(scale)?);
        }
        for f in varying {
            let f = self.part(f)?;
            result = Some(match result {
                None => f,
                Some(product) => self.times(&product, &f)?,
            });
        }
        match result {
            Some(product) => Ok(product),
            None => self.constant(Expr::int(1)),
        }
    }

    /// What vanishes at rest times a value that is bounded there.
    fn vanishing(&self, a: &Split, bounded: &Expr) -> Split {
        let change = a.change.clone() * bounded.clone();
        let second = a.second.as_ref().map(|s| match s.is_whole {
            true => Second { remainder: change.clone(), ..s.clone() },
            false => Second::of_first_order(change.clone()),
        });
        let (rest, value) = (Expr::int(0), change.clone());
        Split { rest, change, value, rewritten: (true, true), second, jump: None }
    }

    pub(super) fn times(&mut self, a: &Split, b: &Split) -> Result<Split, SplitError> {
        let product = |x: &Expr, y: &Expr| x.clone() * y.clone();
        match (&a.jump, &b.jump) {
            (None, None) => {}
            // What jumps is bounded: times what vanishes it vanishes.
            (None, Some(_)) if a.rest.is_zero() => return Ok(self.vanishing(a, &b.value)),
            (Some(_), None) if b.rest.is_zero() => return Ok(self.vanishing(b, &a.value)),
            (jump, other) => {
                let jump = jump.as_ref().or(other.as_ref()).expect("one of the two jumps").clone();
                return Ok(self.jumping(product(&a.value, &b.value), jump));
            }
        }
        let rest = product(&a.rest, &b.rest);
        let rest = self.simplify(rest)?;
        let (change, change_rewritten) = if a.is_constant() {
            (product(&a.rest, &b.change), b.rewritten.0)
        } else if b.is_constant() {
            (product(&b.rest, &a.change), a.rewritten.0)
        } else if a.rest.is_zero() {
            (product(&a.change, &b.value), a.rewritten.0 || b.rewritten.1)
        } else if b.rest.is_zero() {
            (product(&a.value, &b.change), a.rewritten.1 || b.rewritten.0)
        } else {
            (super::total([product(&a.rest, &b.change), product(&a.change, &b.value)].into_iter()), true)
        };
        let (value, value_rewritten) = if rest.is_zero() {
            (change.clone(), change_rewritten)
        } else {
            (product(&a.value, &b.value), a.rewritten.1 || b.rewritten.1)
        };
        let second = match self.order {
            Order::First => None,
            Order::Second => Some(self.second_of_product(a, b, &change)?),
        };
        Ok(Split { rest, change, value, rewritten: (change_rewritten, value_rewritten), second, jump: None })
    }
}

//! Logarithms and exponentials: ln(a + x) = ln a + log1p(x / a), exp(a + x) = e^a + e^a expm1(x).

use crate::expr::Expr;

use super::{Order, Split, SplitError, Splitter};

impl Splitter<'_> {
    pub(super) fn ln(&mut self, e: &Expr, argument: &Expr) -> Result<Split, SplitError> {
        // ln J = ln(1 + p) / 2.
        if let (Some((j, p)), Expr::Symbol(s)) = (self.jacobian, argument)
            && *s == j
        {
            let ln = Expr::Ln(Box::new(Expr::int(1) + p.into()));
            return self.split(&(Expr::ratio(1, 2) * ln));
        }
        let a = self.part(argument)?;
        if let Some(jump) = a.jump {
            return Ok(self.jumping(Expr::Ln(Box::new(a.value)), jump));
        }
        self.require_positive(e, &a.rest)?;
        let ratio = self.ratio(&a);
        let rest = if a.rest.is_one() { Expr::int(0) } else { self.simplify(Expr::Ln(Box::new(a.rest.clone())))? };
        let change = Expr::Log1p(Box::new(ratio.clone()));
        let second = match self.order {
            Order::First => None,
            Order::Second => {
                let curved = Expr::int(-1) * Expr::Log1pmx(Box::new(ratio));
                let slope = self.reciprocal_of(&a.rest)?;
                Some(self.second_of_function(&a, &slope, curved, &change)?)
            }
        };
        let value = rest.clone() + change.clone();
        let split = Split { rest, change, value, rewritten: (true, true), second, jump: None };
        self.note_split(e, &split);
        Ok(split)
    }

    pub(super) fn exp(&mut self, e: &Expr, argument: &Expr) -> Result<Split, SplitError> {
        let a = self.part(argument)?;
        if let Some(jump) = a.jump {
            return Ok(self.jumping(Expr::Exp(Box::new(a.value)), jump));
        }
        let rest = if a.rest.is_zero() { Expr::int(1) } else { self.simplify(Expr::Exp(Box::new(a.rest.clone())))? };
        let change = rest.clone() * Expr::Expm1(Box::new(a.change.clone()));
        let second = match self.order {
            Order::First => None,
            Order::Second => {
                let curved = rest.clone() * Expr::Expm1mx(Box::new(a.change.clone()));
                Some(self.second_of_function(&a, &rest, curved, &change)?)
            }
        };
        let value = rest.clone() + change.clone();
        let split = Split { rest, change, value, rewritten: (true, true), second, jump: None };
        self.note_split(e, &split);
        Ok(split)
    }

    /// x / a.
    pub(super) fn ratio(&mut self, a: &Split) -> Expr {
        if a.rest.is_one() { a.change.clone() } else { a.change.clone() / a.rest.clone() }
    }

    pub(super) fn reciprocal_of(&mut self, constant: &Expr) -> Result<Expr, SplitError> {
        if constant.is_one() { Ok(Expr::int(1)) } else { self.simplify(Expr::int(1) / constant.clone()) }
    }

    /// What stands under a logarithm, a root or a real power has to be positive at rest, for every material.
    pub(super) fn require_positive(&mut self, e: &Expr, rest: &Expr) -> Result<(), SplitError> {
        if rest.is_zero() {
            return self.refuse(
                e,
                "has no expansion at rest: what it is taken of is 0 there",
                "write the law so that the term is smooth at rest",
            );
        }
        match self.sign(rest)? {
            Some(true) => Ok(()),
            Some(false) => self.refuse(
                e,
                &format!("is undefined at rest: what it is taken of is {} there, which is negative", self.text(rest)),
                "check the formula against its source",
            ),
            None => self.require_sign(e, "is taken of", rest),
        }
    }
}

//! Second order, for energies: value = c + l + x with l a linear form in the strain and x of second order.
//!
//! An energy is of second order at rest; what is of first order in its terms has to cancel exactly, in the generator.

use std::collections::{BTreeMap, HashMap};

use crate::cas::Cas;
use crate::expr::{Expr, Symbol};
use crate::quantity::Quantities;

use super::{Order, Rest, Split, SplitError, Splitter, total};

/// The change of a value, to second order.
#[derive(Debug, Clone, PartialEq)]
pub struct Second {
    /// The linear form: a constant for each linear invariant of the strain.
    pub linear: BTreeMap<Symbol, Expr>,
    /// What is left: of the order `order`.
    pub remainder: Expr,
    /// 2, or 1 for what is not smooth at rest (`pos(x)`).
    pub order: u8,
    /// Whether the remainder is the whole change.
    pub is_whole: bool,
}

impl Second {
    /// No change.
    pub(super) fn zero() -> Self {
        Self { linear: BTreeMap::new(), remainder: Expr::int(0), order: 2, is_whole: true }
    }

    /// A change that is of second order as a whole.
    pub(super) fn whole(change: Expr) -> Self {
        Self { linear: BTreeMap::new(), remainder: change, order: 2, is_whole: true }
    }

    /// A change that is known.
    pub(super) fn known(invariant: Symbol, coefficient: Expr, remainder: Symbol) -> Self {
        Self {
            linear: BTreeMap::from([(invariant, coefficient)]),
            remainder: remainder.into(),
            order: 2,
            is_whole: false,
        }
    }

    /// A change that is a linear invariant.
    pub(super) fn linear(invariant: Symbol) -> Self {
        let linear = BTreeMap::from([(invariant, Expr::int(1))]);
        Self { linear, remainder: Expr::int(0), order: 2, is_whole: false }
    }

    /// A change of first order that is no linear form.
    pub(super) fn of_first_order(change: Expr) -> Self {
        Self { order: 1, ..Self::whole(change) }
    }

    /// The linear form as an expression.
    pub(super) fn linear_form(&self) -> Expr {
        total(self.linear.iter().map(|(s, c)| c.clone() * Expr::from(*s)))
    }
}

/// Invariants of the strain at which a second-order splitting ends.
#[derive(Debug, Default)]
pub struct Leaves {
    /// Linear in the strain.
    pub linear: Vec<Symbol>,
    /// Of second or higher order.
    pub quadratic: Vec<Symbol>,
    /// J; p, with J = sqrt(1 + p); its linear part; and the rest of p.
    pub jacobian: Option<(Symbol, Symbol, Symbol, Expr)>,
    /// Others, already split.
    pub others: Vec<(Symbol, Split)>,
}

impl<'a> Splitter<'a> {
    /// Splits to second order over the strain, whose invariants are given: for energies.
    pub fn of_energy(
        cas: &'a mut Cas,
        quantities: &'a mut Quantities,
        rest: &'a mut Rest,
        kernel: &'static str,
        leaves: Leaves,
    ) -> Self {
        let leaf = |s: Symbol, second: Second| Split {
            rest: Expr::int(0),
            change: s.into(),
            value: s.into(),
            rewritten: (false, false),
            second: Some(second),
            jump: None,
        };
        let linear = |s: Symbol, remainder: Expr| Second {
            linear: BTreeMap::from([(s, Expr::int(1))]),
            remainder,
            order: 2,
            is_whole: false,
        };
        let mut known = HashMap::new();
        for s in leaves.linear {
            known.insert(s, leaf(s, linear(s, Expr::int(0))));
        }
        for s in leaves.quadratic {
            known.insert(s, leaf(s, Second::whole(s.into())));
        }
        let jacobian = leaves.jacobian.map(|(j, p, trace, remainder)| {
            let mut split = leaf(p, linear(trace, remainder));
            split.rewritten = (true, true);
            known.insert(p, split);
            (j, p)
        });
        known.extend(leaves.others);
        Self { cas, quantities, rest, kernel, known, jacobian, order: Order::Second }
    }

    /// The energy counted from rest, or `None` where no rule applies; and the energy at rest.
    ///
    /// # Errors
    /// A term that cannot be split, or a stress at rest.
    pub fn energy(mut self, energy: &Expr) -> Result<(Option<Expr>, Expr), SplitError> {
        let split = self.split(energy)?;
        let second = split.second.expect("an energy is split to second order");
        if !second.linear.is_empty() {
            let constants: Vec<Expr> = second.linear.values().cloned().collect();
            return Err(self.stressed(&second.linear_form(), &constants));
        }
        if second.order < 2 {
            return self.refuse(
                energy,
                "is of first order at rest, and not smooth there",
                "write it so that it begins with a square",
            );
        }
        let rewritten = split.rewritten.0 || !split.rest.is_zero();
        Ok((rewritten.then_some(second.remainder), split.rest))
    }

    /// The value counted from rest, where it is of second order there and a rule applies; and its constant.
    pub fn of_second_order(mut self, e: &Expr) -> Option<(Expr, Expr)> {
        let split = self.split(e).ok()?;
        let second = split.second.filter(|s| s.linear.is_empty() && s.order == 2)?;
        split.rewritten.0.then_some((second.remainder, split.rest))
    }

    pub(super) fn second_of_sum(&mut self, parts: &[Split], change: &Expr) -> Result<Second, SplitError> {
        let seconds: Vec<&Second> = parts.iter().filter_map(|p| p.second.as_ref()).collect();
        let mut linear: BTreeMap<Symbol, Vec<Expr>> = BTreeMap::new();
        for s in &seconds {
            for (symbol, c) in &s.linear {
                linear.entry(*symbol).or_default().push(c.clone());
            }
        }
        let linear = self.linear(linear.into_iter().map(|(s, cs)| (s, Expr::Sum(cs))))?;
        let order = seconds.iter().map(|s| s.order).min().unwrap_or(2);
        if seconds.iter().all(|s| s.is_whole) {
            return Ok(Second { linear, remainder: change.clone(), order, is_whole: true });
        }
        let remainder = self.merged(total(seconds.iter().map(|s| s.remainder.clone())))?;
        Ok(Second { linear, remainder, order, is_whole: false })
    }

    pub(super) fn second_of_product(&mut self, a: &Split, b: &Split, change: &Expr) -> Result<Second, SplitError> {
        let (Some(second_a), Some(second_b)) = (&a.second, &b.second) else {
            unreachable!("energies are split to second order throughout")
        };
        let scaled =
            |c: &Expr, s: &Second| s.linear.iter().map(|(x, k)| (*x, c.clone() * k.clone())).collect::<Vec<_>>();
        let mut linear: BTreeMap<Symbol, Vec<Expr>> = BTreeMap::new();
        for (c, s) in [(&a.rest, second_b), (&b.rest, second_a)] {
            for (x, k) in scaled(c, s) {
                linear.entry(x).or_default().push(k);
            }
        }
        let linear = self.linear(linear.into_iter().map(|(s, cs)| (s, Expr::Sum(cs))))?;
        // Both vanish at rest: the change is a product of changes.
        if a.rest.is_zero() && b.rest.is_zero() && !a.is_constant() && !b.is_constant() {
            return Ok(Second::whole(change.clone()));
        }
        let whole = second_a.is_whole && second_b.is_whole;
        let vanishing = |x: &Split, s: &Second| x.rest.is_zero() && s.is_whole;
        if whole && (a.is_constant() || b.is_constant() || (second_a.order == 2 && second_b.order == 2))
            || vanishing(a, second_a)
            || vanishing(b, second_b)
        {
            let order = if whole {
                second_a.order.min(second_b.order)
            } else if vanishing(a, second_a) {
                second_a.order
            } else {
                second_b.order
            };
            return Ok(Second { linear, remainder: change.clone(), order, is_whole: true });
        }
        let terms = [
            a.rest.clone() * second_b.remainder.clone(),
            b.rest.clone() * second_a.remainder.clone(),
            a.change.clone() * b.change.clone(),
        ];
        let order = second_a.order.min(second_b.order);
        Ok(Second { linear, remainder: total(terms.into_iter()), order, is_whole: false })
    }

    /// f(c + y) = f(c) + slope y + curved(y).
    pub(super) fn second_of_function(
        &mut self,
        a: &Split,
        slope: &Expr,
        curved: Expr,
        change: &Expr,
    ) -> Result<Second, SplitError> {
        let Some(second) = &a.second else { unreachable!("energies are split to second order throughout") };
        if second.is_whole {
            return Ok(Second {
                linear: BTreeMap::new(),
                remainder: change.clone(),
                order: second.order,
                is_whole: true,
            });
        }
        let linear = second.linear.iter().map(|(s, c)| (*s, slope.clone() * c.clone())).collect::<Vec<_>>();
        let (order, remainder) = (second.order, slope.clone() * second.remainder.clone());
        let linear = self.linear(linear.into_iter())?;
        Ok(Second { linear, remainder: total([remainder, curved].into_iter()), order, is_whole: false })
    }

    /// A sum with equal terms merged: the constants before them cancel here, not when they are computed.
    fn merged(&mut self, e: Expr) -> Result<Expr, SplitError> {
        let terms = gathered(&e, &|e: &Expr| self.quantities.is_constant_expr(e));
        if terms.iter().all(|(factors, _)| factors.len() == 1) {
            return Ok(e);
        }
        let mut merged = vec![];
        for (factors, varying) in terms {
            let factor = self.simplify(Expr::Sum(factors))?;
            if !factor.is_zero() {
                merged.push(factor * varying);
            }
        }
        Ok(total(merged.into_iter()))
    }

    fn linear(&mut self, terms: impl Iterator<Item = (Symbol, Expr)>) -> Result<BTreeMap<Symbol, Expr>, SplitError> {
        let mut linear = BTreeMap::new();
        for (s, c) in terms {
            let c = self.simplify(c)?;
            if !c.is_zero() {
                linear.insert(s, c);
            }
        }
        Ok(linear)
    }
}

/// The terms of a sum, each as its constant factor and what varies, equal ones of which are merged.
fn gathered(e: &Expr, is_constant: &impl Fn(&Expr) -> bool) -> Vec<(Vec<Expr>, Expr)> {
    fn collect(e: &Expr, factor: &Expr, is_constant: &impl Fn(&Expr) -> bool, terms: &mut Vec<(Vec<Expr>, Expr)>) {
        let (factor, varying) = match e {
            Expr::Sum(parts) => return parts.iter().for_each(|part| collect(part, factor, is_constant, terms)),
            Expr::Product(factors) => {
                let (constants, varying): (Vec<Expr>, Vec<Expr>) = factors.iter().cloned().partition(is_constant);
                let factor = constants.into_iter().fold(factor.clone(), |product, c| product * c);
                match varying.as_slice() {
                    // One that varies may be a sum or a product itself.
                    [one] => return collect(one, &factor, is_constant, terms),
                    _ => (factor, Expr::Product(varying)),
                }
            }
            e if is_constant(e) => (factor.clone() * e.clone(), Expr::int(1)),
            _ => (factor.clone(), e.clone()),
        };
        match terms.iter_mut().find(|(_, x)| *x == varying) {
            Some((factors, _)) => factors.push(factor),
            None => terms.push((vec![factor], varying)),
        }
    }
    let mut terms = vec![];
    collect(e, &Expr::int(1), is_constant, &mut terms);
    terms
}

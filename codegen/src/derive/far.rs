//! The energy far from rest: textbook but for ln(1 + z), exp(z) - 1 and (1 + z)^r - 1, whose small z would lose digits
//! wherever a law is nearly linear in it, as Gent's is in (I1bar - 3) / J_m; and but for volumetric parts at J = 1.

use crate::expr::Expr;
use crate::ir::Input;
use crate::quantity::{Kind, Value};
use crate::split::{self, Leaves, Splitter};

use super::strain::Invariant;
use super::{DeriveError, Session};

/// An expression as a constant and what is added to it.
struct Parted {
    constant: Expr,
    rest: Expr,
}

impl Session {
    /// The textbook energy with its volumetric part, if this vanishes to second order where J = 1, split there: a body
    /// may keep its volume far from rest, and nearly incompressible ones do.
    pub(super) fn split_at_unit_volume(&mut self, energy: Expr) -> Expr {
        let (Some(j), Expr::Sum(terms)) = (self.strain.used(Invariant::J), &energy) else { return energy };
        let volumetric = |t: &Expr| {
            let mut varying = t.symbols().into_iter().filter(|s| !self.quantities.is_constant(*s)).peekable();
            varying.peek().is_some() && varying.all(|s| s == j)
        };
        let (volumetric, mut others): (Vec<Expr>, Vec<Expr>) = terms.iter().cloned().partition(volumetric);
        let volumetric = Expr::Sum(volumetric);
        // Polynomials in J - 1 lose nothing.
        if self.quantities.is_polynomial(&volumetric) {
            return energy;
        }
        let less_one = self.quantities.stage("J_less_1", Expr::from(j) - Expr::int(1));
        let leaves = Leaves { others: vec![(j, split::linear(Expr::int(1), less_one))], ..Leaves::default() };
        let splitter = Splitter::of_energy(&mut self.cas, &mut self.quantities, &mut self.rest, "energy_far", leaves);
        let noted = splitter.rewrites();
        let Some((value, rest)) = splitter.of_second_order(&volumetric) else {
            self.rest.rewrites.truncate(noted);
            return energy;
        };
        // Below 1/2 the differences from 1 would cancel.
        let value = Value::Select {
            left: j.into(),
            right: Expr::ratio(1, 2),
            then: value,
            otherwise: volumetric - rest.clone(),
        };
        others.push(self.quantities.add("volumetric", Kind::Stage { value, partials: None }).into());
        others.push(rest);
        Expr::Sum(others)
    }

    /// The energy counted from rest, with its functions of 1 + z computed from z; as it stands where there is none.
    pub(super) fn far_from(&mut self, energy: Expr, at_rest: &Expr) -> Result<Expr, DeriveError> {
        let mut found = false;
        let parted = self.parted(&energy, &mut found)?;
        if !found {
            return Ok(if at_rest.is_zero() { energy } else { energy - at_rest.clone() });
        }
        let constant = self.rest.simplify(&mut self.cas, &self.quantities, parted.constant - at_rest.clone())?;
        Ok(constant + parted.rest)
    }

    fn parted(&mut self, e: &Expr, found: &mut bool) -> Result<Parted, DeriveError> {
        let whole = |rest: Expr| Parted { constant: Expr::int(0), rest };
        if self.quantities.is_constant_expr(e) {
            return Ok(Parted { constant: e.clone(), rest: Expr::int(0) });
        }
        Ok(match e {
            Expr::Sum(terms) => {
                let mut sum = whole(Expr::int(0));
                for term in terms {
                    let term = self.parted(term, found)?;
                    sum = Parted { constant: sum.constant + term.constant, rest: sum.rest + term.rest };
                }
                sum
            }
            Expr::Product(factors) => {
                let (constants, varying): (Vec<_>, Vec<_>) =
                    factors.iter().cloned().partition(|f| self.quantities.is_constant_expr(f));
                let scale = if constants.is_empty() { Expr::int(1) } else { Expr::Product(constants) };
                match varying.as_slice() {
                    [one] => {
                        let one = self.parted(one, found)?;
                        Parted { constant: scale.clone() * one.constant, rest: scale * one.rest }
                    }
                    _ => whole(e.clone()),
                }
            }
            Expr::Ln(a) => match self.beyond(a, 1)? {
                Some(z) => {
                    *found = true;
                    whole(Expr::Log1p(Box::new(z)))
                }
                None => whole(e.clone()),
            },
            Expr::Exp(a) => match self.beyond(a, 0)? {
                Some(z) => {
                    *found = true;
                    Parted { constant: Expr::int(1), rest: Expr::Expm1(Box::new(z)) }
                }
                None => whole(e.clone()),
            },
            Expr::Power(a, r) if !matches!(**r, Expr::Number(q) if q.is_integer()) => match self.beyond(a, 1)? {
                Some(z) => {
                    *found = true;
                    let logarithm = (**r).clone() * Expr::Log1p(Box::new(z));
                    Parted { constant: Expr::int(1), rest: Expr::Expm1(Box::new(logarithm)) }
                }
                None => whole(e.clone()),
            },
            _ => whole(e.clone()),
        })
    }

    /// z of an argument n + z that is n at rest; `None` where it is something else, or a single value, such as J, whose
    /// difference from n would lose digits where it is small.
    fn beyond(&mut self, argument: &Expr, n: i128) -> Result<Option<Expr>, DeriveError> {
        let is_sum = matches!(argument, Expr::Sum(_));
        if !is_sum && n != 0 {
            return Ok(None);
        }
        let Some(rest) = self.at_rest(argument) else { return Ok(None) };
        let rest = self.rest.simplify(&mut self.cas, &self.quantities, rest)?;
        if rest != Expr::int(n) {
            return Ok(None);
        }
        Ok(Some(self.cas.normalize(&(argument.clone() - Expr::int(n)))?))
    }

    /// The expression with what it reads of the strain at its value at rest; `None` where a selection decides.
    fn at_rest(&self, e: &Expr) -> Option<Expr> {
        let each = |xs: &[Expr]| xs.iter().map(|x| self.at_rest(x)).collect::<Option<Vec<_>>>();
        Some(match e {
            Expr::Number(_) => e.clone(),
            Expr::Symbol(s) => {
                // Three stretches, which are 1; their stages choose between rotations.
                if matches!(self.strain.invariants().iter().find(|(_, q)| q == s), Some((Invariant::StretchSum(_), _)))
                {
                    return Some(Expr::int(3));
                }
                match &self.quantities.get(*s).kind {
                    Kind::Input(Input::DisplacementGradient, _) => Expr::int(0),
                    Kind::Stage { value: Value::Expr(value), .. } => self.at_rest(value)?,
                    Kind::Stage { value: Value::Select { .. }, .. } => return None,
                    Kind::Constant(_) | Kind::Input(..) => e.clone(),
                }
            }
            Expr::Sum(xs) => Expr::Sum(each(xs)?),
            Expr::Product(xs) => Expr::Product(each(xs)?),
            Expr::Power(a, b) => Expr::Power(Box::new(self.at_rest(a)?), Box::new(self.at_rest(b)?)),
            Expr::Ln(a) => Expr::Ln(Box::new(self.at_rest(a)?)),
            Expr::Exp(a) => Expr::Exp(Box::new(self.at_rest(a)?)),
            Expr::Log1p(_) | Expr::Expm1(_) | Expr::Log1pmx(_) | Expr::Expm1mx(_) => return None,
        })
    }
}

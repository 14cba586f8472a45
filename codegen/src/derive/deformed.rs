//! Far from rest, strains by the right Cauchy-Green tensor C itself: where a body is compressed to almost nothing, A = C - I
//! computed from G has errors of I, and 3 + tr A loses tr C.

use std::collections::HashMap;

use crate::expr::{Expr, Symbol};
use crate::quantity::{Kind, Value};

use super::strain::{Base, Invariant, SYMMETRIC};
use super::{DeriveError, Session};

impl Session {
    /// The expressions with A = C - I and its isotropic invariants written in C, through all stages that they read.
    pub(super) fn of_deformation(&mut self, expressions: &[Expr]) -> Result<Vec<Expr>, DeriveError> {
        let mut known = self.strains_of_deformation()?;
        expressions.iter().map(|e| self.rewritten(e, &mut known)).collect()
    }

    /// What to read for A and its invariants.
    fn strains_of_deformation(&mut self) -> Result<HashMap<Symbol, Expr>, DeriveError> {
        let mut known = HashMap::new();
        let Some(a) = self.strain.components(Base::A) else { return Ok(known) };
        let (cas, quantities) = (&mut self.cas, &mut self.quantities);
        let c = self.strain.tensor(cas, quantities, Base::C)?.map(Expr::from);
        for ((a, c), (i, j)) in a.into_iter().zip(c).zip(SYMMETRIC) {
            known.insert(a, if i == j { c - Expr::int(1) } else { c });
        }
        if let Some(trace) = self.strain.used(Invariant::Trace(Base::A)) {
            let of_c = self.strain.invariant(cas, quantities, Invariant::Trace(Base::C))?;
            known.insert(trace, Expr::from(of_c) - Expr::int(3));
        }
        Ok(known)
    }

    fn rewritten(&mut self, e: &Expr, known: &mut HashMap<Symbol, Expr>) -> Result<Expr, DeriveError> {
        let mut replaced = false;
        for s in e.symbols() {
            replaced |= self.replacement(s, known)? != Expr::from(s);
        }
        // What does not change keeps its form, and so its operations.
        if !replaced {
            return Ok(e.clone());
        }
        let e = substituted(e, known);
        Ok(self.cas.normalize(&e)?)
    }

    /// What is read for a symbol: the symbol itself, where nothing below it changes.
    fn replacement(&mut self, s: Symbol, known: &mut HashMap<Symbol, Expr>) -> Result<Expr, DeriveError> {
        if let Some(e) = known.get(&s) {
            return Ok(e.clone());
        }
        let quantity = self.quantities.get(s).clone();
        let value = match &quantity.kind {
            Kind::Input(..) | Kind::Constant(_) => None,
            Kind::Stage { value: Value::Expr(e), .. } => {
                let new = self.rewritten(e, known)?;
                (new != *e).then_some(Value::Expr(new))
            }
            Kind::Stage { value: Value::Select { left, right, then, otherwise }, .. } => {
                let old = [left, right, then, otherwise];
                let mut new = vec![];
                for e in old {
                    new.push(self.rewritten(e, known)?);
                }
                let changed = new.iter().zip(old).any(|(new, old)| new != old);
                let [left, right, then, otherwise]: [Expr; 4] = new.try_into().expect("four were pushed");
                changed.then_some(Value::Select { left, right, then, otherwise })
            }
        };
        let e = match value {
            None => s.into(),
            Some(Value::Expr(e)) if self.quantities.is_simple(&e) => e,
            Some(value) => self.quantities.add(quantity.name, Kind::Stage { value, partials: None }).into(),
        };
        known.insert(s, e.clone());
        Ok(e)
    }
}

fn substituted(e: &Expr, known: &HashMap<Symbol, Expr>) -> Expr {
    let one = |x: &Expr| Box::new(substituted(x, known));
    let each = |xs: &[Expr]| xs.iter().map(|x| substituted(x, known)).collect();
    match e {
        Expr::Number(_) => e.clone(),
        Expr::Symbol(s) => known.get(s).unwrap_or(e).clone(),
        Expr::Sum(xs) => Expr::Sum(each(xs)),
        Expr::Product(xs) => Expr::Product(each(xs)),
        Expr::Power(a, b) => Expr::Power(one(a), one(b)),
        Expr::Ln(a) => Expr::Ln(one(a)),
        Expr::Exp(a) => Expr::Exp(one(a)),
        Expr::Log1p(a) => Expr::Log1p(one(a)),
        Expr::Expm1(a) => Expr::Expm1(one(a)),
        Expr::Log1pmx(a) => Expr::Log1pmx(one(a)),
        Expr::Expm1mx(a) => Expr::Expm1mx(one(a)),
    }
}

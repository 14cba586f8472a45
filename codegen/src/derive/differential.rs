//! Staged tangents: the differential of each stage is the sum of its partial derivatives times the differentials of
//! what it reads.

use std::collections::{BTreeMap, HashMap};

use crate::cas::{Cas, UnexpectedTerm};
use crate::expr::{Expr, Symbol};
use crate::quantity::{Kind, Quantities, Value};

/// Differentiates in one direction, given by the differentials of some quantities.
pub struct Differential<'a> {
    cas: &'a mut Cas,
    quantities: &'a mut Quantities,
    prefix: &'a str,
    seeds: BTreeMap<Symbol, Expr>,
    /// Quantities that are independent here: their differential is their seed or 0.
    stop: Vec<Symbol>,
    /// Quantities that differ from others by constants: their differential is the other's.
    same: BTreeMap<Symbol, Symbol>,
    known: HashMap<Symbol, Expr>,
    /// The partial derivatives that are not polynomials, if they are to be stages of their own.
    slopes: Option<Vec<Symbol>>,
}

impl<'a> Differential<'a> {
    /// The direction in which the quantities in `seeds` change as given, and those in `stop` do not otherwise.
    pub fn new(
        cas: &'a mut Cas,
        quantities: &'a mut Quantities,
        prefix: &'a str,
        seeds: BTreeMap<Symbol, Expr>,
        stop: Vec<Symbol>,
    ) -> Self {
        Self { cas, quantities, prefix, seeds, stop, same: BTreeMap::new(), known: HashMap::new(), slopes: None }
    }

    /// Gives each first quantity the differential of its second.
    pub fn with_same(self, same: BTreeMap<Symbol, Symbol>) -> Self {
        Self { same, ..self }
    }

    /// Makes every partial derivative that is not a polynomial a stage of its own: a slope.
    pub fn with_slopes(self) -> Self {
        Self { slopes: Some(vec![]), ..self }
    }

    /// The slopes that were met.
    pub fn into_slopes(self) -> Vec<Symbol> {
        self.slopes.unwrap_or_default()
    }

    /// The differential of an expression.
    pub fn of(&mut self, e: &Expr) -> Result<Expr, UnexpectedTerm> {
        let mut terms = Vec::new();
        for s in e.symbols() {
            let ds = self.symbol(s)?;
            if !ds.is_zero() {
                let mut partial = self.cas.derivative(e, s)?;
                if let Some(slopes) = &mut self.slopes
                    && !self.quantities.is_polynomial(&partial)
                {
                    let slope = self.quantities.stage("slope", partial);
                    slopes.push(slope);
                    partial = slope.into();
                }
                terms.push(partial * ds);
            }
        }
        self.cas.normalize(&Expr::Sum(terms))
    }

    fn symbol(&mut self, s: Symbol) -> Result<Expr, UnexpectedTerm> {
        if let Some(seed) = self.seeds.get(&s) {
            return Ok(seed.clone());
        }
        if let Some(known) = self.known.get(&s) {
            return Ok(known.clone());
        }
        if let Some(&other) = self.same.get(&s) {
            return self.symbol(other);
        }
        let quantity = self.quantities.get(s).clone();
        let d = match quantity.kind {
            _ if self.stop.contains(&s) => Expr::int(0),
            Kind::Input(..) | Kind::Constant(_) => Expr::int(0),
            Kind::Stage { partials: Some(partials), .. } => {
                let mut terms = Vec::new();
                for (by, partial) in partials {
                    terms.push(partial * self.symbol(by)?);
                }
                let sum = self.cas.normalize(&Expr::Sum(terms))?;
                self.named(&quantity.name, Value::Expr(sum))
            }
            Kind::Stage { value: Value::Expr(e), partials: None } => {
                let d = self.of(&e)?;
                self.named(&quantity.name, Value::Expr(d))
            }
            Kind::Stage { value: Value::Select { left, right, then, otherwise }, partials: None } => {
                let (then, otherwise) = (self.of(&then)?, self.of(&otherwise)?);
                let value =
                    if then == otherwise { Value::Expr(then) } else { Value::Select { left, right, then, otherwise } };
                self.named(&quantity.name, value)
            }
        };
        self.known.insert(s, d.clone());
        Ok(d)
    }

    fn named(&mut self, name: &str, value: Value) -> Expr {
        match value {
            Value::Expr(e) if self.quantities.is_simple(&e) => e,
            value => {
                let name = format!("{}{name}", self.prefix);
                self.quantities.add(name, Kind::Stage { value, partials: None }).into()
            }
        }
    }
}

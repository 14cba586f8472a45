//! The damping kernels of a law with a dissipation: P_v = dD/d(dG/dt), its differential by dG/dt, and D itself.
//!
//! As for the energy, P_v is collected backwards over the stages: first dD/d(dE/dt), then P_v = F dD/d(dE/dt) + .. .
//! Nothing is split at rest: D is differentiated by rates, in which it has no constant to cancel against, and strains
//! enter it as they are.

use std::collections::{BTreeMap, HashMap};

use num_traits::Signed;

use crate::expr::{Expr, Symbol};
use crate::ir::{Input, KernelIr, Output};
use crate::law::ast::Scalar;
use crate::quantity::{Kind, Value};

use super::differential::Differential;
use super::energy::Energy;
use super::strain::{Base, SYMMETRIC};
use super::{DeriveError, Session};

/// A rate that D is a function of, beside the strain.
struct Rate {
    symbol: Symbol,
    /// The name of the stress that does its work.
    name: String,
    /// That stress as a multiple of dD by the rate: an off-diagonal component stands for two.
    factor: (i128, i128),
}

impl Session {
    /// The kernels of a dissipation; their inputs beside the constants are G, its rate, and the direction `dgradient` in
    /// which the rate changes, or the gradient `node` of one node's interpolation function.
    pub(super) fn damping(
        &mut self,
        dissipation: &Scalar,
        dgradient: &[Symbol],
        node: &[Symbol],
    ) -> Result<Vec<KernelIr>, DeriveError> {
        let parameters = self.parameters.clone();
        let mut reader = Energy::with(parameters, &mut self.cas, &mut self.quantities, &mut self.strain);
        let density = reader.scalar(dissipation)?;
        let density = self.cas.normalize(&density)?;
        let rates = self.rates();
        self.check_rest(&density, &rates)?;
        let at_zero = self.at_zero_rate(&density)?;
        let stress = self.damping_stress(&density, &rates)?;
        let by = self.strain.gradient_rate(&mut self.quantities);
        let increment = self.stress_increment(&stress, &by, dgradient)?;
        let diagonal = self.diagonal(&stress, &by, node)?;
        let density = if at_zero.is_zero() { density } else { self.cas.normalize(&(density - at_zero))? };
        use Input::{DisplacementGradient as G, GradientIncrement, GradientRate, NodeGradient};
        let kernels = [
            ("dissipation", vec![G, GradientRate], (Output::DissipationDensity, vec![density])),
            ("damping", vec![G, GradientRate], (Output::Stress, stress.to_vec())),
            ("ddamping", vec![G, GradientRate, GradientIncrement], (Output::StressIncrement, increment)),
            ("damping_diagonal", vec![G, GradientRate, NodeGradient], (Output::Diagonal, diagonal)),
        ];
        Ok(kernels.into_iter().map(|(name, inputs, output)| self.lower(name, &inputs, vec![output])).collect())
    }

    /// The rates in use.
    fn rates(&self) -> Vec<Rate> {
        let mut rates = Vec::new();
        for (base, name, scale) in [(Base::RateA, "Sv", 2), (Base::RateEps, "Nv", 1)] {
            for (&(a, b), symbol) in SYMMETRIC.iter().zip(self.strain.components(base).into_iter().flatten()) {
                let factor = if a == b { (scale, 1) } else { (scale, 2) };
                rates.push(Rate { symbol, name: format!("{name}{a}{b}"), factor });
            }
        }
        let jacobian = self.strain.rate_of_jacobian().into_iter();
        rates.extend(jacobian.map(|symbol| Rate { symbol, name: "D_Jt".into(), factor: (1, 1) }));
        rates
    }

    /// dD by one of the rates, the others held.
    fn by_rate(&mut self, density: &Expr, rate: &Rate, rates: &[Rate]) -> Result<Expr, DeriveError> {
        let seeds = BTreeMap::from([(rate.symbol, Expr::int(1))]);
        let all = rates.iter().map(|r| r.symbol).collect();
        Ok(Differential::new(&mut self.cas, &mut self.quantities, "D_", seeds, all).of(density)?)
    }

    /// P_v, collected backwards over the rates.
    fn damping_stress(&mut self, density: &Expr, rates: &[Rate]) -> Result<[Expr; 9], DeriveError> {
        let mut p: [Vec<Expr>; 9] = std::array::from_fn(|_| vec![]);
        for rate in rates {
            let derivative = self.by_rate(density, rate, rates)?;
            let (n, d) = rate.factor;
            let s = self.cas.expand(&(Expr::ratio(n, d) * derivative))?;
            if s.is_zero() {
                continue;
            }
            let simple = self.quantities.is_simple(&s);
            let s = if simple { s } else { self.quantities.stage(rate.name.clone(), s).into() };
            for (ij, partial) in self.strain.by_gradient_rate(&mut self.cas, &self.quantities, rate.symbol)? {
                p[ij].push(Expr::ratio(d, n) * s.clone() * partial);
            }
        }
        let mut stress: [Expr; 9] = std::array::from_fn(|_| Expr::int(0));
        for (ij, terms) in p.into_iter().enumerate() {
            let e = self.cas.normalize(&Expr::Sum(terms))?;
            let simple = self.quantities.is_simple(&e);
            let name = format!("Pv{}{}", ij / 3, ij % 3);
            stress[ij] = if simple { e } else { self.quantities.stage(name, e).into() };
        }
        Ok(stress)
    }

    /// Refuses a dissipation with a stress at zero rate, naming the first term that has one.
    fn check_rest(&mut self, density: &Expr, rates: &[Rate]) -> Result<(), DeriveError> {
        if !self.has_stress_at_rest(density, rates)? {
            return Ok(());
        }
        let expanded = self.cas.expand(density)?;
        let terms = if let Expr::Sum(terms) = &expanded { terms.as_slice() } else { std::slice::from_ref(&expanded) };
        let mut named = &expanded;
        for term in terms {
            if self.has_stress_at_rest(term, rates)? {
                named = term;
                break;
            }
        }
        Err(DeriveError::DampingAtRest(crate::print::expression(named, &self.quantities)))
    }

    fn has_stress_at_rest(&mut self, e: &Expr, rates: &[Rate]) -> Result<bool, DeriveError> {
        for rate in rates {
            let derivative = self.by_rate(e, rate, rates)?;
            if !self.at_zero_rate(&derivative)?.is_zero() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The expression where dG/dt = 0.
    fn at_zero_rate(&mut self, e: &Expr) -> Result<Expr, DeriveError> {
        let e = self.still(e, &mut HashMap::new());
        Ok(self.cas.normalize(&e)?)
    }

    fn still(&self, e: &Expr, known: &mut HashMap<Symbol, Expr>) -> Expr {
        let mut of = |e: &Expr| self.still(e, known);
        match e {
            Expr::Number(_) => e.clone(),
            Expr::Symbol(s) => self.still_symbol(*s, known),
            Expr::Sum(terms) => Expr::Sum(terms.iter().map(of).filter(|t| !t.is_zero()).collect()),
            Expr::Product(factors) => {
                let factors: Vec<Expr> = factors.iter().map(of).collect();
                if factors.iter().any(Expr::is_zero) { Expr::int(0) } else { Expr::Product(factors) }
            }
            Expr::Power(base, exponent) => match (of(base), of(exponent)) {
                // A power of 0 that is not positive is refused by the law language, or a parameter's.
                (base, Expr::Number(r)) if base.is_zero() && r.is_positive() => Expr::int(0),
                (base, exponent) => Expr::Power(Box::new(base), Box::new(exponent)),
            },
            Expr::Ln(a) => Expr::Ln(Box::new(of(a))),
            Expr::Exp(a) => Expr::Exp(Box::new(of(a))),
            Expr::Log1p(_) | Expr::Expm1(_) | Expr::Log1pmx(_) | Expr::Expm1mx(_) => e.clone(),
        }
    }

    fn still_symbol(&self, s: Symbol, known: &mut HashMap<Symbol, Expr>) -> Expr {
        if let Some(e) = known.get(&s) {
            return e.clone();
        }
        // What does not depend on rates keeps its name.
        let kept = |value: Expr, e: &Expr| if value == *e { Expr::from(s) } else { value };
        let value = match &self.quantities.get(s).kind {
            Kind::Input(Input::GradientRate, _) => Expr::int(0),
            Kind::Input(..) | Kind::Constant(_) => Expr::from(s),
            Kind::Stage { value: Value::Expr(e), .. } => kept(self.still(e, known), e),
            Kind::Stage { value: Value::Select { left, right, then, otherwise }, .. } => {
                let [l, r, t, o] = [left, right, then, otherwise].map(|e| self.still(e, known));
                match (l, r) {
                    _ if t == o => kept(t, then),
                    (Expr::Number(l), Expr::Number(r)) => {
                        if l > r {
                            t
                        } else {
                            o
                        }
                    }
                    _ => Expr::from(s),
                }
            }
        };
        // An empty sum is 0.
        let value = if matches!(&value, Expr::Sum(terms) if terms.is_empty()) { Expr::int(0) } else { value };
        known.insert(s, value.clone());
        value
    }
}

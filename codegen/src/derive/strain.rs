//! The kinematic stages: F, C - I, eps, the cofactors and J over G, and the invariants over those.
//!
//! C - I is computed as G + G' + G'G (Faure et al. 2012, eq. 10, doubled), which keeps its digits at small strain, and
//! differentiated as F'F - I, which is equal and shorter. J is computed by the first row's cofactors; the cofactors
//! are themselves the derivatives of the determinant.

use std::collections::BTreeMap;

use crate::cas::{Cas, UnexpectedTerm};
use crate::expr::{Expr, Rational, Symbol};
use crate::ir::Input;
use crate::quantity::{Kind, Quantities, Value};

use super::fibre;
use super::spectral::{self, Spectrum};

/// The six components of a symmetric tensor, in the order in which they are stored.
pub const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// A symmetric tensor of strain from which invariants are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Base {
    /// A = C - I = 2 E.
    A,
    /// The small strain.
    Eps,
    /// C = F'F: where nothing is differentiated and the body is far from rest.
    C,
    /// The rate of A, F' dF/dt + (dF/dt)' F.
    RateA,
    /// The rate of the small strain.
    RateEps,
}

impl Base {
    /// The tensor's name in generated text.
    fn label(self) -> &'static str {
        match self {
            Base::A => "A",
            Base::Eps => "eps",
            Base::C => "C",
            Base::RateA => "At",
            Base::RateEps => "epst",
        }
    }
}

/// A scalar function of the strain from which energies are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Invariant {
    /// tr of a base tensor.
    Trace(Base),
    /// A : B of two base tensors, the lesser first.
    Ddot(Base, Base),
    /// det of a base tensor.
    Det(Base),
    /// I2 = tr cof C, of the right Cauchy-Green tensor: computed as K:K with the cofactors K of F, in which nothing
    /// cancels, and differentiated as a function of A.
    Second,
    /// det F.
    J,
    /// The sum of the principal stretches to a power, by its number among those in use.
    StretchSum(usize),
    /// a . A . a of a direction a.
    Fibre(Direction),
    /// a . A^2 . a.
    FibreSquare(Direction),
    /// a . A . b of two directions.
    FibrePair(Direction, Direction),
}

/// The components of a unit vector of the body at rest: parameters, hence constants of the material.
pub type Direction = [Symbol; 3];

impl Invariant {
    /// The base over which S = dW/dE is collected.
    pub const OF_C: Base = Base::A;
    /// The base over which dW/deps is collected.
    pub const OF_EPS: Base = Base::Eps;

    /// Whether the invariant is made from this base.
    pub fn depends_on(self, base: Base) -> bool {
        match self {
            Invariant::Trace(b) | Invariant::Det(b) => b == base,
            Invariant::Ddot(a, b) => a == base || b == base,
            Invariant::StretchSum(_) | Invariant::Second => base == Base::A,
            Invariant::J => false,
            Invariant::Fibre(_) | Invariant::FibreSquare(_) | Invariant::FibrePair(..) => base == Base::A,
        }
    }

    /// Whether the invariant is made with a direction.
    pub fn is_fibre(self) -> bool {
        matches!(self, Invariant::Fibre(..) | Invariant::FibreSquare(..) | Invariant::FibrePair(..))
    }
}

/// T_a = tr C^(a/2), split at rest: T_a = 3 + change = 3 + (a/2) tr A + remainder, M = C^(a/2 - 1) = I + moment_change.
#[derive(Debug, Clone)]
pub struct NearStretchSum {
    /// T_a.
    pub sum: Symbol,
    /// a/2.
    pub half: Expr,
    /// T_a - 3.
    pub change: Symbol,
    /// Its part of second order.
    pub remainder: Symbol,
    /// M, six components, by which T_a is differentiated.
    pub moment: [Symbol; 6],
    /// M - I.
    pub moment_change: [Symbol; 6],
}

/// The kinematic stages of one derivation; a stage exists once something asks for it.
pub struct Strain {
    gradient: [Symbol; 9],
    deformation: [Symbol; 9],
    bases: BTreeMap<Base, [Symbol; 6]>,
    jacobian: Option<Symbol>,
    /// dG/dt, and dJ/dt, where something asks for rates.
    rate: Option<[Symbol; 9]>,
    jacobian_rate: Option<Symbol>,
    cofactors: Option<[Symbol; 9]>,
    /// The exponents of the sums of principal stretches, and the decomposition that they share.
    exponents: Vec<Expr>,
    spectrum: Option<Spectrum>,
    /// The sums in forms that are split at rest.
    near_sums: Vec<NearStretchSum>,
    invariants: BTreeMap<Invariant, Symbol>,
}

fn name(k: usize, prefix: &str) -> String {
    format!("{prefix}{}{}", k / 3, k % 3)
}

impl Strain {
    /// G, and F = I + G.
    pub fn new(quantities: &mut Quantities) -> Self {
        let gradient: [Symbol; 9] =
            std::array::from_fn(|k| quantities.add(name(k, "G"), Kind::Input(Input::DisplacementGradient, k as u32)));
        // Off the diagonal F and G are the same numbers, hence the same symbols.
        let deformation = std::array::from_fn(|k| {
            if k % 4 == 0 { quantities.stage(name(k, "F"), Expr::int(1) + gradient[k].into()) } else { gradient[k] }
        });
        Self {
            gradient,
            deformation,
            bases: BTreeMap::new(),
            jacobian: None,
            rate: None,
            jacobian_rate: None,
            cofactors: None,
            exponents: vec![],
            spectrum: None,
            near_sums: vec![],
            invariants: BTreeMap::new(),
        }
    }

    /// G, row by row.
    pub fn gradient(&self) -> &[Symbol; 9] {
        &self.gradient
    }

    /// F, row by row.
    pub fn deformation(&self) -> &[Symbol; 9] {
        &self.deformation
    }

    /// The invariants in use, in a fixed order.
    pub fn invariants(&self) -> Vec<(Invariant, Symbol)> {
        self.invariants.iter().map(|(&i, &s)| (i, s)).collect()
    }

    /// The components of a base tensor, if in use.
    pub fn components(&self, base: Base) -> Option<[Symbol; 6]> {
        self.bases.get(&base).copied()
    }

    /// The components of a base tensor, made on first use.
    pub fn tensor(
        &mut self,
        cas: &mut Cas,
        quantities: &mut Quantities,
        base: Base,
    ) -> Result<[Symbol; 6], UnexpectedTerm> {
        if let Some(&components) = self.bases.get(&base) {
            return Ok(components);
        }
        let (g, f) = (self.gradient.map(Expr::from), self.deformation.map(Expr::from));
        let rate = match base {
            Base::RateA | Base::RateEps => self.gradient_rate(quantities).map(Expr::from),
            Base::A | Base::Eps | Base::C => std::array::from_fn(|_| Expr::int(0)),
        };
        let mut components = Vec::with_capacity(6);
        for (a, b) in SYMMETRIC {
            let symmetric = g[3 * a + b].clone() + g[3 * b + a].clone();
            let square =
                |x: &[Expr; 9]| Expr::Sum((0..3).map(|k| x[3 * k + a].clone() * x[3 * k + b].clone()).collect());
            let label = base.label();
            let (value, definition) = match base {
                Base::Eps => (Expr::ratio(1, 2) * symmetric.clone(), Expr::ratio(1, 2) * symmetric),
                Base::A => (symmetric + square(&g), square(&f)),
                Base::C => (square(&f), square(&f)),
                Base::RateA => {
                    let term = |k: usize| {
                        f[3 * k + a].clone() * rate[3 * k + b].clone() + rate[3 * k + a].clone() * f[3 * k + b].clone()
                    };
                    let sum = Expr::Sum((0..3).map(term).collect());
                    (sum.clone(), sum)
                }
                Base::RateEps => {
                    let mean = Expr::ratio(1, 2) * (rate[3 * a + b].clone() + rate[3 * b + a].clone());
                    (mean.clone(), mean)
                }
            };
            let mut partials = Vec::new();
            for s in definition.symbols() {
                partials.push((s, cas.derivative(&definition, s)?));
            }
            let value = Value::Expr(cas.normalize(&value)?);
            let symbol = quantities.add(format!("{label}{a}{b}"), Kind::Stage { value, partials: Some(partials) });
            components.push(symbol);
        }
        let components: [Symbol; 6] = components.try_into().expect("six components were pushed");
        self.bases.insert(base, components);
        Ok(components)
    }

    /// The symbol of an invariant, if in use.
    pub fn used(&self, invariant: Invariant) -> Option<Symbol> {
        self.invariants.get(&invariant).copied()
    }

    /// The cofactors K = dJ/dF.
    fn cofactors(&mut self, cas: &mut Cas, quantities: &mut Quantities) -> [Symbol; 9] {
        self.jacobian(cas, quantities);
        self.cofactors.expect("J has made them")
    }

    /// J = det F, and with it the cofactors K = dJ/dF.
    pub fn jacobian(&mut self, cas: &mut Cas, quantities: &mut Quantities) -> Symbol {
        if let Some(j) = self.jacobian {
            return j;
        }
        let f = self.deformation;
        // Leibniz's formula: even permutations plus, odd ones minus.
        let permutations = [(0, 1, 2, 1), (1, 2, 0, 1), (2, 0, 1, 1), (0, 2, 1, -1), (1, 0, 2, -1), (2, 1, 0, -1)];
        let det = Expr::Sum(
            permutations
                .iter()
                .map(|&(a, b, c, sign)| {
                    Expr::Product(vec![Expr::int(sign), f[a].into(), f[3 + b].into(), f[6 + c].into()])
                })
                .collect(),
        );
        let cofactors: [Symbol; 9] = std::array::from_fn(|k| {
            let e = cas.derivative(&det, f[k]).expect("the derivative of a polynomial is a polynomial");
            quantities.stage(name(k, "K"), e)
        });
        let value = Expr::Sum((0..3).map(|k| Expr::from(f[k]) * cofactors[k].into()).collect());
        let partials = f.iter().zip(cofactors).map(|(&s, k)| (s, k.into())).collect();
        let j = quantities.add("J", Kind::Stage { value: Value::Expr(value), partials: Some(partials) });
        (self.jacobian, self.cofactors) = (Some(j), Some(cofactors));
        j
    }

    /// dG/dt, row by row.
    pub fn gradient_rate(&mut self, quantities: &mut Quantities) -> [Symbol; 9] {
        *self.rate.get_or_insert_with(|| {
            std::array::from_fn(|k| quantities.add(name(k, "Gt"), Kind::Input(Input::GradientRate, k as u32)))
        })
    }

    /// dJ/dt = K : dG/dt.
    fn jacobian_rate(&mut self, cas: &mut Cas, quantities: &mut Quantities) -> Symbol {
        if let Some(rate) = self.jacobian_rate {
            return rate;
        }
        let (cofactors, rate) = (self.cofactors(cas, quantities), self.gradient_rate(quantities));
        let terms = cofactors.iter().zip(rate).map(|(&k, g)| Expr::from(k) * g.into());
        let symbol = quantities.stage("Jt", Expr::Sum(terms.collect()));
        self.jacobian_rate = Some(symbol);
        symbol
    }

    /// The rates of the strains and of J, as far as those are in use: the rate of any invariant is a sum over them.
    pub fn rates(
        &mut self,
        cas: &mut Cas,
        quantities: &mut Quantities,
    ) -> Result<BTreeMap<Symbol, Expr>, UnexpectedTerm> {
        let mut rates = BTreeMap::new();
        for (base, rate) in [(Base::A, Base::RateA), (Base::Eps, Base::RateEps)] {
            if let Some(components) = self.components(base) {
                let rate = self.tensor(cas, quantities, rate)?;
                rates.extend(components.into_iter().zip(rate.map(Expr::from)));
            }
        }
        if let Some(j) = self.jacobian {
            rates.insert(j, self.jacobian_rate(cas, quantities).into());
        }
        Ok(rates)
    }

    /// The rate of J, if in use.
    pub fn rate_of_jacobian(&self) -> Option<Symbol> {
        self.jacobian_rate
    }

    /// The symbol of an invariant, made on first use.
    pub fn invariant(
        &mut self,
        cas: &mut Cas,
        quantities: &mut Quantities,
        invariant: Invariant,
    ) -> Result<Symbol, UnexpectedTerm> {
        if let Some(&s) = self.invariants.get(&invariant) {
            return Ok(s);
        }
        let label = Base::label;
        let symbol = match invariant {
            Invariant::J => self.jacobian(cas, quantities),
            Invariant::Second => {
                let trace = self.invariant(cas, quantities, Invariant::Trace(Base::A))?;
                let a = self.tensor(cas, quantities, Base::A)?;
                let cofactors = self.cofactors(cas, quantities);
                // dI2/dC = I1 I - C = (2 + tr A) I - A; an off-diagonal component stands for two.
                let partials = SYMMETRIC.iter().zip(a).map(|(&(i, j), component)| {
                    let e = if i == j {
                        Expr::Sum(vec![Expr::int(2), trace.into(), Expr::int(-1) * component.into()])
                    } else {
                        Expr::int(-2) * component.into()
                    };
                    (component, e)
                });
                let partials = Some(partials.collect());
                let squares = cofactors.iter().map(|&k| Expr::from(k).pow(Rational::from_integer(2)));
                let value = Value::Expr(Expr::Sum(squares.collect()));
                quantities.add("I2", Kind::Stage { value, partials })
            }
            Invariant::StretchSum(k) => {
                let c = self.tensor(cas, quantities, Base::A)?;
                let spectrum =
                    self.spectrum.get_or_insert_with(|| Spectrum::of_deformation(quantities, self.deformation, c));
                spectrum.stretch_sum(quantities, &self.exponents[k])
            }
            Invariant::Fibre(d) => {
                let c = self.tensor(cas, quantities, Base::A)?;
                fibre::pair(quantities, &c, d, d)
            }
            Invariant::FibrePair(d, e) => {
                let c = self.tensor(cas, quantities, Base::A)?;
                fibre::pair(quantities, &c, d, e)
            }
            Invariant::FibreSquare(d) => {
                let c = self.tensor(cas, quantities, Base::A)?;
                fibre::square(quantities, &c, d)
            }
            Invariant::Trace(b) => {
                let c = self.tensor(cas, quantities, b)?;
                quantities.stage(format!("tr{}", label(b)), Expr::Sum(c[..3].iter().map(|&s| s.into()).collect()))
            }
            Invariant::Ddot(x, y) => {
                let (a, b) = (self.tensor(cas, quantities, x)?, self.tensor(cas, quantities, y)?);
                let term = |k: usize| {
                    let twice = if SYMMETRIC[k].0 == SYMMETRIC[k].1 { 1 } else { 2 };
                    Expr::Product(vec![Expr::int(twice), a[k].into(), b[k].into()])
                };
                let e = cas.normalize(&Expr::Sum((0..6).map(term).collect()))?;
                quantities.stage(format!("{}_{}", label(x), label(y)), e)
            }
            Invariant::Det(b) => {
                let c = self.tensor(cas, quantities, b)?.map(Expr::from);
                let [xx, yy, zz, xy, xz, yz] = c;
                let two = Rational::from_integer(2);
                let e = xx.clone() * yy.clone() * zz.clone() + Expr::int(2) * (xy.clone() * xz.clone() * yz.clone())
                    - xx * yz.pow(two)
                    - yy * xz.pow(two)
                    - zz * xy.pow(two);
                let e = cas.normalize(&e)?;
                quantities.stage(format!("det{}", label(b)), e)
            }
        };
        self.invariants.insert(invariant, symbol);
        Ok(symbol)
    }

    /// The symbol of the sum of the principal stretches to a power that depends on the parameters alone.
    pub fn stretch_sum(
        &mut self,
        cas: &mut Cas,
        quantities: &mut Quantities,
        exponent: Expr,
    ) -> Result<Symbol, UnexpectedTerm> {
        let k = self.exponents.iter().position(|e| *e == exponent).unwrap_or_else(|| {
            self.exponents.push(exponent);
            self.exponents.len() - 1
        });
        self.invariant(cas, quantities, Invariant::StretchSum(k))
    }

    /// Whether a sum of powers of the principal stretches is in use.
    pub fn has_stretch_sums(&self) -> bool {
        self.spectrum.is_some()
    }

    /// The sums of powers of the principal stretches in use, in forms that are split at rest.
    pub fn near_stretch_sums(&mut self, quantities: &mut Quantities) -> Vec<NearStretchSum> {
        let (Some(spectrum), Some(strain)) = (&self.spectrum, self.bases.get(&Base::A)) else { return vec![] };
        if self.near_sums.is_empty() {
            let mut near = Spectrum::near_rest(quantities, *strain);
            for (k, exponent) in self.exponents.iter().enumerate() {
                let Some(&sum) = self.invariants.get(&Invariant::StretchSum(k)) else { continue };
                let moment_change = near.moment_from_rest(quantities, exponent);
                self.near_sums.push(NearStretchSum {
                    sum,
                    half: spectral::half(exponent),
                    change: near.first_order(quantities, exponent, &moment_change),
                    remainder: near.second_order(quantities, exponent),
                    moment: spectrum.moment(k),
                    moment_change,
                });
            }
        }
        self.near_sums.clone()
    }

    /// The derivatives of a rate of strain or of J by the components of dG/dt, as (3 i + j, derivative).
    pub fn by_gradient_rate(
        &self,
        cas: &mut Cas,
        quantities: &Quantities,
        s: Symbol,
    ) -> Result<Vec<(usize, Expr)>, UnexpectedTerm> {
        let (Some(rate), Kind::Stage { value: Value::Expr(e), .. }) = (self.rate, &quantities.get(s).kind) else {
            return Ok(vec![]);
        };
        let mut derivatives = Vec::new();
        for (ij, by) in rate.into_iter().enumerate().filter(|(_, by)| e.symbols().contains(by)) {
            derivatives.push((ij, cas.derivative(e, by)?));
        }
        Ok(derivatives)
    }

    /// The derivatives of a strain component or of J by the components of G, as (3 i + j, derivative).
    pub fn by_gradient(&self, quantities: &Quantities, s: Symbol) -> Vec<(usize, Expr)> {
        // Where F and G differ, on the diagonal, dF = dG.
        let index = |x: Symbol| self.deformation.iter().chain(&self.gradient).position(|&y| y == x).map(|k| k % 9);
        match &quantities.get(s).kind {
            Kind::Stage { partials: Some(partials), .. } => {
                partials.iter().filter_map(|(by, e)| index(*by).map(|ij| (ij, e.clone()))).collect()
            }
            _ => vec![],
        }
    }
}

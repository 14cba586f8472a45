//! Reads a law's energy into an expression over invariants, constants and stages.

use std::collections::HashMap;
use std::rc::Rc;

use num_traits::Zero;

use crate::cas::Cas;
use crate::expr::{Expr, Rational, Symbol};
use crate::ir::Input;
use crate::law::ast::{self, Law, Scalar, ScalarNode, Tensor, TensorNode};
use crate::quantity::{Kind, Quantities, Value};

use super::DeriveError;
use super::differential::Differential;
use super::strain::{Base, Direction, Invariant, Strain};

/// A named value with more nodes than this becomes a stage of its own instead of being repeated where it is used.
const INLINE_NODES: usize = 24;

/// A symmetric tensor as a combination of the base tensors and the identity.
#[derive(Clone)]
struct Combination {
    bases: Vec<(Base, Expr)>,
    identity: Expr,
}

/// Reads expressions of one law.
pub struct Energy<'a> {
    cas: &'a mut Cas,
    quantities: &'a mut Quantities,
    strain: &'a mut Strain,
    /// The symbols of the parameters' components, parameter by parameter.
    pub parameters: Vec<Vec<Symbol>>,
    known: HashMap<*const ScalarNode, Expr>,
    /// The comparisons of the law's selections.
    pub conditions: Vec<(Expr, Expr)>,
    /// Whether a broken power of J multiplies what depends on the strain.
    pub isochoric: bool,
    /// The tensor in which finite strains are expressed.
    finite: Base,
}

impl<'a> Energy<'a> {
    /// Registers the law's parameters.
    pub fn new(law: &Law, cas: &'a mut Cas, quantities: &'a mut Quantities, strain: &'a mut Strain) -> Self {
        let mut k = 0;
        let mut parameters = Vec::new();
        for p in &law.parameters {
            let mut components = Vec::new();
            for i in 0..p.len {
                let name = if p.len == 1 { p.name.clone() } else { format!("{}{i}", p.name) };
                components.push(quantities.add(name, Kind::Input(Input::Parameters, k)));
                k += 1;
            }
            parameters.push(components);
        }
        Self::with(parameters, cas, quantities, strain)
    }

    /// As [`Energy::new`], with parameters that are registered.
    pub fn with(
        parameters: Vec<Vec<Symbol>>,
        cas: &'a mut Cas,
        quantities: &'a mut Quantities,
        strain: &'a mut Strain,
    ) -> Self {
        let (known, finite) = (HashMap::new(), Base::A);
        Self { cas, quantities, strain, parameters, known, conditions: vec![], isochoric: false, finite }
    }

    /// The declared ranges, by the parameters' symbols.
    pub fn ranges(&self, law: &Law) -> HashMap<Symbol, (f64, f64)> {
        let each = self.parameters.iter().zip(&law.parameters);
        each.flat_map(|(symbols, p)| symbols.iter().map(|&s| (s, p.range))).collect()
    }

    /// From here on isotropic invariants of finite strains are expressed in C itself instead of A = C - I: the textbook form, which keeps its
    /// digits where a body is compressed to almost nothing.
    pub fn far_from_rest(&mut self) {
        self.finite = Base::C;
        self.known.retain(|_, e| self.quantities.is_constant_expr(e));
    }

    /// The expression of a scalar.
    pub fn scalar(&mut self, node: &Scalar) -> Result<Expr, DeriveError> {
        let key = Rc::as_ptr(node);
        if let Some(e) = self.known.get(&key) {
            return Ok(e.clone());
        }
        let e = self.read(node)?;
        self.known.insert(key, e.clone());
        Ok(e)
    }

    fn read(&mut self, node: &Scalar) -> Result<Expr, DeriveError> {
        let one = |n: i128| Rational::from_integer(n);
        Ok(match &**node {
            ScalarNode::Number(q) => Expr::Number(*q),
            ScalarNode::Parameter { parameter, component } => self.parameters[*parameter][*component].into(),
            ScalarNode::Invariant(i) => self.invariant(*i)?,
            ScalarNode::Trace(t) => self.trace(t)?,
            ScalarNode::Ddot(a, b) => self.ddot(a, b)?,
            ScalarNode::Det(t) => self.det(t)?,
            ScalarNode::StretchSum(exponent) => {
                let exponent = self.scalar(exponent)?;
                let exponent = self.cas.normalize(&exponent)?;
                if !self.quantities.is_constant_expr(&exponent) {
                    return Err(DeriveError::Unsupported("the exponent of `stretch_sum` depends on the strain".into()));
                }
                self.strain.stretch_sum(self.cas, self.quantities, exponent)?.into()
            }
            ScalarNode::Add(a, b) => self.scalar(a)? + self.scalar(b)?,
            ScalarNode::Sub(a, b) => self.scalar(a)? - self.scalar(b)?,
            ScalarNode::Mul(a, b) => {
                let (a, b) = (self.scalar(a)?, self.scalar(b)?);
                self.product(a, b, "isochoric")?
            }
            ScalarNode::Div(a, b) => self.scalar(a)? / self.scalar(b)?,
            ScalarNode::Neg(a) => Expr::int(-1) * self.scalar(a)?,
            ScalarNode::Powi(a, n) => self.scalar(a)?.pow(one((*n).into())),
            ScalarNode::Powf(a, b) => {
                let (a, b) = (self.scalar(a)?, self.scalar(b)?);
                if !self.quantities.is_constant_expr(&b) {
                    return Err(DeriveError::Unsupported(
                        "an exponent depends on the strain; write the power as exp(exponent * ln(base))".into(),
                    ));
                }
                Expr::Power(Box::new(a), Box::new(b))
            }
            ScalarNode::Ln(a) => Expr::Ln(Box::new(self.scalar(a)?)),
            ScalarNode::Exp(a) => Expr::Exp(Box::new(self.scalar(a)?)),
            ScalarNode::Sqrt(a) => self.scalar(a)?.pow(Rational::new(1, 2)),
            ScalarNode::Select { left, right, then, otherwise } => {
                let [left, right, then, otherwise] = [left, right, then, otherwise].map(|x| self.scalar(x));
                let (left, right) = (left?, right?);
                self.conditions.push((left.clone(), right.clone()));
                let value = Value::Select { left, right, then: then?, otherwise: otherwise? };
                self.quantity("select", value)
            }
            ScalarNode::Rate(a) => self.rate(a)?,
            ScalarNode::Named(name, value) => {
                let e = self.scalar(value)?;
                let e = self.cas.normalize(&e)?;
                if matches!(e, Expr::Number(_) | Expr::Symbol(_)) {
                    e
                } else if self.quantities.is_constant_expr(&e) || nodes(&e) > INLINE_NODES {
                    self.quantity(name, Value::Expr(e))
                } else {
                    e
                }
            }
        })
    }

    /// The rate of an invariant: the sum of its derivatives by the strains and J times their rates.
    fn rate(&mut self, invariant: &Scalar) -> Result<Expr, DeriveError> {
        let e = self.scalar(invariant)?;
        let rates = self.strain.rates(self.cas, self.quantities)?;
        Ok(Differential::new(self.cas, self.quantities, "rate_", rates, vec![]).of(&e)?)
    }

    /// A new quantity: constant if everything that it reads is.
    fn quantity(&mut self, name: &str, value: Value) -> Expr {
        let constant = value.operands().into_iter().all(|e| self.quantities.is_constant_expr(e));
        let kind = if constant { Kind::Constant(value) } else { Kind::Stage { value, partials: None } };
        self.quantities.add(name, kind).into()
    }

    fn basic(&mut self, invariant: Invariant) -> Result<Expr, DeriveError> {
        Ok(self.strain.invariant(self.cas, self.quantities, invariant)?.into())
    }

    /// J^r times an invariant.
    fn isochoric(&mut self, r: Rational, i: ast::Invariant) -> Result<Expr, DeriveError> {
        let power = self.basic(Invariant::J)?.pow(r);
        let invariant = self.invariant(i)?;
        let name = match i {
            ast::Invariant::I1 => "I1bar",
            ast::Invariant::I2 => "I2bar",
            ast::Invariant::I4(_) => "I4bar",
            _ => "I5bar",
        };
        self.product(power, invariant, name)
    }

    /// a b. A broken power of J times what depends on the strain is a stage x = J^r b with dx = J^r db + r x dJ / J:
    /// its two parts nearly cancel in every isochoric change, once, instead of in each second derivative by J.
    fn product(&mut self, a: Expr, b: Expr, name: &str) -> Result<Expr, DeriveError> {
        let broken_power = |e: &Expr| match e {
            Expr::Power(base, exponent) => match (&**base, &**exponent) {
                (Expr::Symbol(_), Expr::Number(r)) if r.is_integer() => None,
                (Expr::Symbol(j), exponent) => Some((*j, exponent.clone())),
                _ => None,
            },
            _ => None,
        };
        let j = self.strain.used(Invariant::J);
        let (power, r, other) = match (broken_power(&a), broken_power(&b)) {
            (Some((s, r)), _) if Some(s) == j => (a.clone(), r, b.clone()),
            (_, Some((s, r))) if Some(s) == j => (b.clone(), r, a.clone()),
            _ => return Ok(a * b),
        };
        let varying: Vec<Symbol> = other.symbols().into_iter().filter(|s| !self.quantities.is_constant(*s)).collect();
        if varying.is_empty() || j.is_some_and(|j| varying.contains(&j)) {
            return Ok(a * b);
        }
        let name = match &other {
            Expr::Symbol(s) => format!("{}bar", self.quantities.get(*s).name),
            _ => name.to_string(),
        };
        let value = self.cas.normalize(&(power.clone() * other.clone()))?;
        let stage = self.quantities.stage(name, value);
        let mut partials = vec![];
        for s in varying {
            let partial = self.cas.derivative(&other, s)?;
            partials.push((s, self.cas.normalize(&(power.clone() * partial))?));
        }
        let j = j.expect("a power of it was found");
        partials.push((j, r * stage.into() * Expr::from(j).pow(Rational::from_integer(-1))));
        self.quantities.differentiate_by(stage, partials);
        self.isochoric = true;
        Ok(stage.into())
    }

    /// The components of a direction, by its parameter.
    fn direction(&self, parameter: usize) -> Direction {
        std::array::from_fn(|k| self.parameters[parameter][k])
    }

    fn invariant(&mut self, i: ast::Invariant) -> Result<Expr, DeriveError> {
        let c: Tensor = Rc::new(TensorNode::C);
        let two = Rational::from_integer(2);
        Ok(match i {
            ast::Invariant::I1 => self.trace(&c)?,
            ast::Invariant::I2 => self.basic(Invariant::Second)?,
            ast::Invariant::I3 => self.basic(Invariant::J)?.pow(two),
            ast::Invariant::J => self.basic(Invariant::J)?,
            ast::Invariant::I1bar => self.isochoric(Rational::new(-2, 3), ast::Invariant::I1)?,
            ast::Invariant::I2bar => self.isochoric(Rational::new(-4, 3), ast::Invariant::I2)?,
            ast::Invariant::I4(a) => Expr::int(1) + self.basic(Invariant::Fibre(self.direction(a)))?,
            ast::Invariant::I5(a) => {
                let a = self.direction(a);
                let linear = self.basic(Invariant::Fibre(a))?;
                Expr::Sum(vec![Expr::int(1), Expr::int(2) * linear, self.basic(Invariant::FibreSquare(a))?])
            }
            ast::Invariant::I8(a, b) => {
                let (a, b) = (self.direction(a), self.direction(b));
                let cosine = Expr::Sum(a.iter().zip(&b).map(|(&x, &y)| Expr::from(x) * y.into()).collect());
                let cosine = self.quantity("cosine", Value::Expr(cosine));
                cosine + self.basic(Invariant::FibrePair(a, b))?
            }
            ast::Invariant::I4bar(a) => self.isochoric(Rational::new(-2, 3), ast::Invariant::I4(a))?,
            ast::Invariant::I5bar(a) => self.isochoric(Rational::new(-4, 3), ast::Invariant::I5(a))?,
        })
    }

    fn tensor(&mut self, t: &Tensor) -> Result<Combination, DeriveError> {
        let single = |base, factor| Combination { bases: vec![(base, factor)], identity: Expr::int(0) };
        Ok(match &**t {
            TensorNode::Eps => single(Base::Eps, Expr::int(1)),
            TensorNode::E if self.finite == Base::C => {
                Combination { identity: Expr::ratio(-1, 2), ..single(Base::C, Expr::ratio(1, 2)) }
            }
            TensorNode::C if self.finite == Base::C => single(Base::C, Expr::int(1)),
            TensorNode::E => single(Base::A, Expr::ratio(1, 2)),
            TensorNode::C => Combination { identity: Expr::int(1), ..single(Base::A, Expr::int(1)) },
            TensorNode::Rate(a) => match &**a {
                TensorNode::Eps => single(Base::RateEps, Expr::int(1)),
                TensorNode::E => single(Base::RateA, Expr::ratio(1, 2)),
                TensorNode::C => single(Base::RateA, Expr::int(1)),
                // The law language has no rate of anything else.
                _ => return Err(DeriveError::Unsupported("a rate of what is no strain".into())),
            },
            TensorNode::Identity => Combination { bases: vec![], identity: Expr::int(1) },
            TensorNode::Add(a, b) => {
                let (a, b) = (self.tensor(a)?, self.tensor(b)?);
                combine(a, b)
            }
            TensorNode::Sub(a, b) => {
                let (a, b) = (self.tensor(a)?, self.tensor(b)?);
                combine(a, scale(&Expr::int(-1), b))
            }
            TensorNode::Scale(s, a) => {
                let s = self.scalar(s)?;
                scale(&s, self.tensor(a)?)
            }
        })
    }

    fn trace(&mut self, t: &Tensor) -> Result<Expr, DeriveError> {
        let t = self.tensor(t)?;
        let mut sum = vec![Expr::int(3) * t.identity];
        for (base, factor) in t.bases {
            sum.push(factor * self.basic(Invariant::Trace(base))?);
        }
        Ok(self.cas.normalize(&Expr::Sum(sum))?)
    }

    fn ddot(&mut self, a: &Tensor, b: &Tensor) -> Result<Expr, DeriveError> {
        let (a, b) = (self.tensor(a)?, self.tensor(b)?);
        let mut sum = vec![Expr::int(3) * (a.identity.clone() * b.identity.clone())];
        for (x, fx) in &a.bases {
            sum.push(fx.clone() * b.identity.clone() * self.basic(Invariant::Trace(*x))?);
            for (y, fy) in &b.bases {
                let (low, high) = (*x.min(y), *x.max(y));
                sum.push(fx.clone() * fy.clone() * self.basic(Invariant::Ddot(low, high))?);
            }
        }
        for (y, fy) in &b.bases {
            sum.push(fy.clone() * a.identity.clone() * self.basic(Invariant::Trace(*y))?);
        }
        Ok(self.cas.normalize(&Expr::Sum(sum))?)
    }

    /// det (c I + s X) = c^3 + c^2 s tr X + c s^2 (tr(X)^2 - X:X) / 2 + s^3 det X.
    fn det(&mut self, t: &Tensor) -> Result<Expr, DeriveError> {
        if matches!(**t, TensorNode::C) {
            return self.invariant(ast::Invariant::I3);
        }
        let t = self.tensor(t)?;
        let power = |e: &Expr, n: i128| if n == 0 { Expr::int(1) } else { e.clone().pow(Rational::from_integer(n)) };
        let c = t.identity;
        let e = match t.bases.as_slice() {
            [] => power(&c, 3),
            [(base, s)] => {
                let trace = self.basic(Invariant::Trace(*base))?;
                let square = self.basic(Invariant::Ddot(*base, *base))?;
                let det = self.basic(Invariant::Det(*base))?;
                let second = Expr::ratio(1, 2) * (power(&trace, 2) - square);
                power(&c, 3) + power(&c, 2) * s.clone() * trace + c.clone() * power(s, 2) * second + power(s, 3) * det
            }
            _ => {
                return Err(DeriveError::Unsupported(
                    "det of a sum of the small strain and a finite strain; write it by invariants of one of them"
                        .into(),
                ));
            }
        };
        Ok(self.cas.normalize(&e)?)
    }
}

fn scale(s: &Expr, t: Combination) -> Combination {
    Combination {
        bases: t.bases.into_iter().map(|(b, f)| (b, s.clone() * f)).collect(),
        identity: s.clone() * t.identity,
    }
}

fn combine(a: Combination, b: Combination) -> Combination {
    let mut bases = a.bases;
    for (base, factor) in b.bases {
        match bases.iter_mut().find(|(x, _)| *x == base) {
            Some((_, f)) => *f = f.clone() + factor,
            None => bases.push((base, factor)),
        }
    }
    bases.retain(|(_, f)| !matches!(f, Expr::Number(q) if q.is_zero()));
    Combination { bases, identity: a.identity + b.identity }
}

fn nodes(e: &Expr) -> usize {
    match e {
        Expr::Number(_) | Expr::Symbol(_) => 1,
        Expr::Sum(xs) | Expr::Product(xs) => 1 + xs.iter().map(nodes).sum::<usize>(),
        Expr::Power(a, b) => 1 + nodes(a) + nodes(b),
        Expr::Ln(a) | Expr::Exp(a) => 1 + nodes(a),
        Expr::Log1p(a) | Expr::Expm1(a) | Expr::Log1pmx(a) | Expr::Expm1mx(a) => 1 + nodes(a),
    }
}

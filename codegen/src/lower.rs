//! From symbolic stages to a kernel: shares, factors and orders the arithmetic, and hoists what depends on the
//! material alone.
//!
//! A sum of products becomes few operations by three rules, applied in a fixed order: a factor common to most terms is
//! taken out (Horner's rule in several variables), coefficients common to several terms are taken out, and what is
//! left is added in the order of its values. Numeric coefficients travel with a value until something needs the
//! number itself, so that `2 mu * (1/2 (a + b))` costs one multiplication.

use std::collections::{BTreeMap, HashMap};

use num_traits::{One, Signed, Zero};

use crate::expr::{Expr, Rational, Symbol};
use crate::ir::{Builder, Input, KernelIr, Op, Output, ValueId};
use crate::quantity::{Kind, Quantities, Value};

/// Expressions in the parameters alone, in the order in which kernels asked for them; shared by a law's kernels.
#[derive(Debug, Default)]
pub struct Constants(Vec<Expr>);

impl Constants {
    fn index(&mut self, e: Expr) -> u32 {
        let i = self.0.iter().position(|x| *x == e).unwrap_or_else(|| {
            self.0.push(e);
            self.0.len() - 1
        });
        i as u32
    }

    /// The expressions.
    pub fn expressions(&self) -> &[Expr] {
        &self.0
    }
}

/// From this power on the reciprocal of a power is computed instead of the power of a reciprocal.
const SHARED_RECIPROCAL: i128 = 5;

/// A factor that costs nothing at run time: a number times expressions in the parameters.
#[derive(Debug, Clone, PartialEq)]
struct Coefficient {
    number: Rational,
    constants: Vec<Expr>,
}

impl Coefficient {
    fn number(number: Rational) -> Self {
        Self { number, constants: vec![] }
    }

    fn one() -> Self {
        Self::number(Rational::one())
    }

    fn times(mut self, other: &Coefficient) -> Self {
        self.number *= other.number;
        self.constants.extend(other.constants.iter().cloned());
        self.constants.sort();
        self
    }

    fn pow(&self, n: i32) -> Self {
        let constants = self
            .constants
            .iter()
            .map(|c| if n == 1 { c.clone() } else { c.clone().pow(Rational::from_integer(n.into())) })
            .collect();
        Self { number: self.number.pow(n), constants }
    }

    fn is_one(&self) -> bool {
        self.number.is_one() && self.constants.is_empty()
    }

    fn expr(&self) -> Expr {
        let mut factors = vec![Expr::Number(self.number)];
        factors.extend(self.constants.iter().cloned());
        Expr::Product(factors)
    }
}

/// A coefficient times a value; without a value, a constant.
#[derive(Debug, Clone)]
struct Scaled {
    coefficient: Coefficient,
    value: Option<ValueId>,
}

/// A coefficient times powers of values.
#[derive(Debug, Clone)]
struct Monomial {
    coefficient: Coefficient,
    powers: BTreeMap<ValueId, Rational>,
}

/// Lowers the stages that some outputs need into one kernel.
pub struct Lowering<'a, N: FnMut(&Expr) -> Expr> {
    quantities: &'a Quantities,
    /// `None` in the material kernel itself, where everything is computed from the parameters.
    constants: Option<&'a mut Constants>,
    /// Merges like terms in a constant expression, so that equal constants are one.
    normalize: N,
    builder: Builder,
    lowered: HashMap<Symbol, Scaled>,
    /// Quantities in whose place others are computed, which are equal.
    instead: HashMap<Symbol, Symbol>,
}

impl<'a, N: FnMut(&Expr) -> Expr> Lowering<'a, N> {
    /// A kernel over these quantities. `constants` is `None` for the kernel that computes the constants.
    pub fn new(quantities: &'a Quantities, constants: Option<&'a mut Constants>, normalize: N) -> Self {
        Self {
            quantities,
            constants,
            normalize,
            builder: Builder::new(),
            lowered: HashMap::new(),
            instead: HashMap::new(),
        }
    }

    /// Computes `other` wherever `s` is read.
    pub fn compute_instead(&mut self, s: Symbol, other: Symbol) {
        self.instead.insert(s, other);
    }

    /// The value of an expression.
    pub fn value(&mut self, e: &Expr) -> ValueId {
        let scaled = self.lower(e);
        self.emit(&scaled)
    }

    /// Ends the kernel.
    pub fn finish(self, name: &str, inputs: Vec<(Input, u32)>, outputs: Vec<(Output, Vec<ValueId>)>) -> KernelIr {
        self.builder.finish(name, inputs, outputs)
    }

    fn is_constant(&self, e: &Expr) -> bool {
        self.constants.is_some() && self.quantities.is_constant_expr(e)
    }

    fn symbol(&mut self, s: Symbol) -> Scaled {
        if let Some(scaled) = self.lowered.get(&s) {
            return scaled.clone();
        }
        if let Some(other) = self.instead.remove(&s) {
            // Once: what is computed instead may itself fall back on `s`.
            let scaled = self.symbol(other);
            self.lowered.insert(s, scaled.clone());
            return scaled;
        }
        let quantities = self.quantities;
        let quantity = quantities.get(s);
        let scaled = match &quantity.kind {
            Kind::Input(role, k) => {
                let value = self.builder.input(*role, *k);
                Scaled { coefficient: Coefficient::one(), value: Some(value) }
            }
            Kind::Constant(value) | Kind::Stage { value, .. } => match value {
                Value::Expr(e) => self.lower(e),
                Value::Select { left, right, then, otherwise } => {
                    let [l, r, t, o] = [left, right, then, otherwise].map(|e| self.value(e));
                    let value = self.builder.push(Op::Select(l, r, t, o));
                    Scaled { coefficient: Coefficient::one(), value: Some(value) }
                }
            },
        };
        // A stage times constants is used in several places: multiply once, here. A mere number travels on, because the
        // next stage usually has a constant to merge it with.
        let scaled = match scaled.value {
            Some(_) if !scaled.coefficient.constants.is_empty() => {
                Scaled { value: Some(self.emit(&scaled)), coefficient: Coefficient::one() }
            }
            _ => scaled,
        };
        if let (true, Some(value)) = (scaled.coefficient.is_one(), scaled.value) {
            self.builder.name(value, &quantity.name);
        }
        self.lowered.insert(s, scaled.clone());
        scaled
    }

    fn lower(&mut self, e: &Expr) -> Scaled {
        match e {
            Expr::Sum(terms) => {
                let monomials = terms.iter().map(|t| self.monomial(t)).collect();
                self.sum(monomials)
            }
            _ => {
                let monomial = self.monomial(e);
                self.product(&monomial)
            }
        }
    }

    fn monomial(&mut self, e: &Expr) -> Monomial {
        let mut m = Monomial { coefficient: Coefficient::one(), powers: BTreeMap::new() };
        self.factor(e, Rational::one(), &mut m);
        m.powers.retain(|_, r| !r.is_zero());
        m
    }

    /// Multiplies `m` by e to the power r.
    fn factor(&mut self, e: &Expr, r: Rational, m: &mut Monomial) {
        let integer = r.is_integer().then(|| i32::try_from(r.to_integer()).ok()).flatten();
        match (e, integer) {
            (Expr::Number(q), Some(n)) => m.coefficient.number *= q.pow(n),
            _ if self.is_constant(e) => {
                let power = if r.is_one() { e.clone() } else { e.clone().pow(r) };
                m.coefficient =
                    m.coefficient.clone().times(&Coefficient { number: Rational::one(), constants: vec![power] });
            }
            (Expr::Product(factors), Some(_)) => {
                for f in factors {
                    self.factor(f, r, m);
                }
            }
            (Expr::Power(base, exponent), _) if matches!(**exponent, Expr::Number(_)) => {
                let Expr::Number(q) = **exponent else { unreachable!("matched above") };
                self.factor(base, r * q, m);
            }
            (Expr::Power(base, exponent), _) => {
                let (base, exponent) = (self.value(base), self.value(exponent));
                let value = self.builder.push(Op::Powf(base, exponent));
                *m.powers.entry(value).or_insert_with(Rational::zero) += r;
            }
            (Expr::Ln(a) | Expr::Exp(a) | Expr::Log1p(a) | Expr::Expm1(a) | Expr::Log1pmx(a) | Expr::Expm1mx(a), _) => {
                let a = self.value(a);
                let value = self.builder.push(match e {
                    Expr::Ln(_) => Op::Ln(a),
                    Expr::Exp(_) => Op::Exp(a),
                    Expr::Log1p(_) => Op::Log1p(a),
                    Expr::Expm1(_) => Op::Expm1(a),
                    Expr::Log1pmx(_) => Op::Log1pmx(a),
                    _ => Op::Expm1mx(a),
                });
                *m.powers.entry(value).or_insert_with(Rational::zero) += r;
            }
            (Expr::Number(_) | Expr::Symbol(_) | Expr::Sum(_) | Expr::Product(_), _) => {
                let scaled = match e {
                    Expr::Symbol(s) => self.symbol(*s),
                    Expr::Number(q) => Scaled { coefficient: Coefficient::one(), value: Some(self.builder.number(*q)) },
                    _ => self.lower(e),
                };
                match (scaled.value, integer) {
                    (Some(value), Some(n)) => {
                        m.coefficient = m.coefficient.clone().times(&scaled.coefficient.pow(n));
                        *m.powers.entry(value).or_insert_with(Rational::zero) += r;
                    }
                    (None, Some(n)) => m.coefficient = m.coefficient.clone().times(&scaled.coefficient.pow(n)),
                    (_, None) => {
                        let value = self.emit(&scaled);
                        *m.powers.entry(value).or_insert_with(Rational::zero) += r;
                    }
                }
            }
        }
    }

    /// The value of a constant coefficient, and whether its sign was left out.
    fn coefficient(&mut self, c: &Coefficient) -> (ValueId, bool) {
        let positive = Coefficient { number: c.number.abs(), constants: c.constants.clone() };
        let value = if c.constants.is_empty() {
            self.builder.number(positive.number)
        } else {
            let e = (self.normalize)(&positive.expr());
            match (e, &mut self.constants) {
                (Expr::Number(q), _) => self.builder.number(q),
                (e, Some(constants)) => {
                    let k = constants.index(e);
                    self.builder.input(Input::Constants, k)
                }
                (_, None) => unreachable!("the material kernel has no constant coefficients"),
            }
        };
        (value, c.number.is_negative())
    }

    fn emit(&mut self, s: &Scaled) -> ValueId {
        let Some(value) = s.value else {
            let (c, negative) = self.coefficient(&s.coefficient);
            return if negative { self.builder.neg(c) } else { c };
        };
        let (magnitude, negative) = self.times(&s.coefficient, value);
        if negative { self.builder.neg(magnitude) } else { magnitude }
    }

    /// |c| v, and whether the sign was left out.
    fn times(&mut self, c: &Coefficient, value: ValueId) -> (ValueId, bool) {
        if c.constants.is_empty() && c.number.abs().is_one() {
            return (value, c.number.is_negative());
        }
        let (c, negative) = self.coefficient(c);
        (self.builder.mul(c, value), negative)
    }

    fn product(&mut self, m: &Monomial) -> Scaled {
        if m.coefficient.number.is_zero() {
            return Scaled { coefficient: Coefficient::number(Rational::zero()), value: None };
        }
        Scaled { coefficient: m.coefficient.clone(), value: self.powers(&m.powers) }
    }

    fn powers(&mut self, powers: &BTreeMap<ValueId, Rational>) -> Option<ValueId> {
        let (mut numerator, mut reciprocals) = (vec![], vec![]);
        for (&base, &r) in powers {
            let half = Rational::new(1, 2);
            let (mut n, fraction) = (r.trunc().to_integer(), r.fract());
            if fraction.abs() == half {
                // x^(n + 1/2) = x^n sqrt x, so that every half power shares one root.
                let root = self.builder.push(Op::Sqrt(base));
                if r.is_positive() { numerator.push(root) } else { reciprocals.push(self.builder.recip(root)) }
            } else if !fraction.is_zero() {
                // The fraction keeps the sign of r: x^(1/3) is 0 at 0, and J^(-5/3) shares J^(-2/3).
                let exponent = self.builder.number(fraction);
                numerator.push(self.builder.push(Op::Powf(base, exponent)));
            }
            if n > 0 {
                numerator.push(self.integer_power(base, n as u128));
            } else if n < 0 {
                n = -n;
                // One reciprocal is shared by low powers, whose errors it makes alike; in high ones its rounding counts n
                // times.
                reciprocals.push(if n < SHARED_RECIPROCAL {
                    let reciprocal = self.builder.recip(base);
                    self.integer_power(reciprocal, n as u128)
                } else {
                    let power = self.integer_power(base, n as u128);
                    self.builder.recip(power)
                });
            }
        }
        let mut factors = numerator.into_iter().chain(reciprocals);
        let first = factors.next()?;
        Some(factors.fold(first, |product, f| self.builder.mul(product, f)))
    }

    fn integer_power(&mut self, base: ValueId, n: u128) -> ValueId {
        if n == 1 {
            return base;
        }
        let half = self.integer_power(base, n / 2);
        let square = self.builder.mul(half, half);
        if n % 2 == 1 { self.builder.mul(square, base) } else { square }
    }

    fn sum(&mut self, terms: Vec<Monomial>) -> Scaled {
        let mut terms = self.merge(terms);
        while let Some((base, power)) = common_factor(&terms) {
            let (mut inside, outside): (Vec<_>, Vec<_>) =
                terms.into_iter().partition(|t| t.powers.get(&base).is_some_and(|r| r.signum() == power.signum()));
            for t in &mut inside {
                let r = t.powers.remove(&base).expect("partitioned above") - power;
                if !r.is_zero() {
                    t.powers.insert(base, r);
                }
            }
            let inner = self.sum(inside);
            let mut product = Monomial { coefficient: inner.coefficient, powers: BTreeMap::from([(base, power)]) };
            if let Some(value) = inner.value {
                *product.powers.entry(value).or_insert_with(Rational::zero) += Rational::one();
            }
            terms = outside;
            terms.push(product);
            terms = self.merge(terms);
        }
        match terms.as_slice() {
            [] => Scaled { coefficient: Coefficient::number(Rational::zero()), value: None },
            [single] => self.product(&single.clone()),
            _ => self.add_up(terms),
        }
    }

    /// Merges terms in the same powers.
    fn merge(&mut self, terms: Vec<Monomial>) -> Vec<Monomial> {
        let mut merged: Vec<Monomial> = Vec::new();
        for t in terms {
            match merged.iter_mut().find(|m| m.powers == t.powers) {
                Some(m) if m.coefficient.constants == t.coefficient.constants => {
                    m.coefficient.number += t.coefficient.number;
                }
                Some(m) => {
                    let e = (self.normalize)(&Expr::Sum(vec![m.coefficient.expr(), t.coefficient.expr()]));
                    m.coefficient = match e {
                        Expr::Number(q) => Coefficient::number(q),
                        e => Coefficient { number: Rational::one(), constants: vec![e] },
                    };
                }
                None => merged.push(t),
            }
        }
        merged.retain(|m| !m.coefficient.number.is_zero());
        merged
    }

    /// Adds terms that share no factor: coefficients shared by several terms are applied to their sum.
    fn add_up(&mut self, terms: Vec<Monomial>) -> Scaled {
        let magnitude = |c: &Coefficient| Coefficient { number: c.number.abs(), constants: c.constants.clone() };
        let shared = magnitude(&terms[0].coefficient);
        if terms.iter().all(|t| !t.powers.is_empty() && magnitude(&t.coefficient) == shared) {
            let signed =
                terms.iter().map(|t| (self.powers(&t.powers).expect("not empty"), t.coefficient.number.is_negative()));
            let signed: Vec<_> = signed.collect();
            let (value, negative) = self.signed_sum(&signed);
            let sign = Coefficient::number(if negative { -Rational::one() } else { Rational::one() });
            return Scaled { coefficient: shared.times(&sign), value: Some(value) };
        }
        let mut groups: Vec<(Coefficient, Vec<(ValueId, bool)>)> = Vec::new();
        let mut constant = None;
        for t in &terms {
            let Some(value) = self.powers(&t.powers) else {
                constant = Some(t.coefficient.clone());
                continue;
            };
            let entry = (value, t.coefficient.number.is_negative());
            let key = magnitude(&t.coefficient);
            match groups.iter_mut().find(|(c, _)| *c == key) {
                Some((_, members)) => members.push(entry),
                None => groups.push((key, vec![entry])),
            }
        }
        let mut summands = Vec::new();
        if let Some(c) = constant {
            summands.push(self.coefficient(&c));
        }
        for (c, members) in groups {
            if c.is_one() {
                summands.extend(members);
            } else {
                let (value, negative) = self.signed_sum(&members);
                let (value, _) = self.times(&c, value);
                summands.push((value, negative));
            }
        }
        let (value, negative) = self.signed_sum(&summands);
        let sign = Coefficient::number(if negative { -Rational::one() } else { Rational::one() });
        Scaled { coefficient: sign, value: Some(value) }
    }

    /// The sum of values with signs (`true` is minus); the result's own sign is returned where it was left out. Halves
    /// are added first: fewer roundings lie on top of each other, and a processor can add them at once.
    fn signed_sum(&mut self, summands: &[(ValueId, bool)]) -> (ValueId, bool) {
        if let [single] = summands {
            return *single;
        }
        let (left, right) = summands.split_at(summands.len().div_ceil(2));
        let ((a, minus_a), (b, minus_b)) = (self.signed_sum(left), self.signed_sum(right));
        match (minus_a, minus_b) {
            (false, true) => (self.builder.sub(a, b), false),
            (true, false) => (self.builder.sub(b, a), false),
            _ => (self.builder.add(a, b), minus_a),
        }
    }
}

/// The factor that most terms share, if two or more do: its base and the power to take out.
fn common_factor(terms: &[Monomial]) -> Option<(ValueId, Rational)> {
    let mut best: Option<(usize, ValueId, Rational)> = None;
    let bases: std::collections::BTreeSet<ValueId> = terms.iter().flat_map(|t| t.powers.keys().copied()).collect();
    for base in bases {
        for sign in [1, -1] {
            let powers: Vec<Rational> = terms
                .iter()
                .filter_map(|t| t.powers.get(&base).copied())
                .filter(|r| r.signum() == Rational::from_integer(sign))
                .collect();
            if powers.len() < 2 || best.is_some_and(|(count, _, _)| count >= powers.len()) {
                continue;
            }
            let least = powers.iter().copied().min_by(|a, b| a.abs().cmp(&b.abs())).expect("two or more");
            best = Some((powers.len(), base, least));
        }
    }
    best.map(|(_, base, power)| (base, power))
}

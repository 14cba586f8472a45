//! Constants at rest: expressions in the parameters alone, simplified exactly, recognised as zero, and their signs
//! decided over the parameters' declared ranges.

use std::collections::HashMap;

use num_traits::{Signed, ToPrimitive, Zero};

use crate::cas::{Cas, UnexpectedTerm};
use crate::expr::{Expr, Rational, Symbol};
use crate::ir::Number;
use crate::law::ast::{Acceptance, Accepted};
use crate::quantity::{Kind, Quantities, Value};

use super::roots::canonical;

/// What is known of constants: the parameters' ranges, and what was simplified before.
#[derive(Debug, Default)]
pub struct Constants {
    ranges: HashMap<Symbol, (f64, f64)>,
    simple: HashMap<Expr, Expr>,
    /// What the law's author vouches for, and whether it was needed.
    accepted: Vec<(Acceptance, bool)>,
    /// Whether what seems to be 0 counts as such: constants of the stress are made of those that were accepted in the energy.
    trusting: bool,
}

/// A closed interval that holds every value that an expression takes.
type Interval = (f64, f64);

/// Materials at which a constant that may be zero is evaluated: positions within each parameter's range.
const PROBES: [f64; 3] = [0.314_159, 0.577_216, 0.836_207];
/// Constants that are numbers are multiples of 1 over this.
const SIMPLE: f64 = 12.0;

impl Constants {
    /// Constants over parameters with these ranges.
    pub fn new(ranges: HashMap<Symbol, (f64, f64)>, accepted: &[Acceptance]) -> Self {
        let accepted = accepted.iter().map(|a| (a.clone(), false)).collect();
        Self { ranges, accepted, ..Self::default() }
    }

    /// The first acceptance that nothing needed.
    pub fn unused(&self) -> Option<&Acceptance> {
        self.accepted.iter().find(|(_, used)| !used).map(|(a, _)| a)
    }

    /// Whether the author vouches for this of the constant.
    pub fn accepts(&mut self, kind: Accepted, quantities: &Quantities, e: &Expr) -> bool {
        let bare = |text: &str| text.split_whitespace().collect::<String>();
        let text = bare(&crate::print::expression(e, quantities));
        let found = self.accepted.iter_mut().find(|(a, _)| a.kind == kind && bare(&a.constant) == text);
        if let Some((_, used)) = found {
            *used = true;
            self.trusting |= kind == Accepted::Cancellation;
            return true;
        }
        false
    }

    /// The shortest equal form found by writing out named constants one after the other; the number 0 where the
    /// constant is 0 for every material.
    ///
    /// # Errors
    /// The computer algebra system answered in unknown terms.
    pub fn simplify(&mut self, cas: &mut Cas, quantities: &Quantities, e: Expr) -> Result<Expr, UnexpectedTerm> {
        if matches!(e, Expr::Number(_) | Expr::Symbol(_)) {
            return Ok(e);
        }
        if let Some(known) = self.simple.get(&e) {
            return Ok(known.clone());
        }
        let mut best = cas.normalize(&e)?;
        let mut written = expanded(cas, &e)?;
        loop {
            if size(&written) < size(&best) {
                best = written.clone();
            }
            // The latest constant is defined by earlier ones.
            let latest = written.symbols().into_iter().rev().find_map(|s| match &quantities.get(s).kind {
                Kind::Constant(Value::Expr(value)) => Some((s, value.clone())),
                _ => None,
            });
            match latest {
                Some((s, value)) => written = expanded(cas, &replace(&written, s, &value))?,
                None => break,
            }
        }
        if !matches!(best, Expr::Number(_)) && self.seems_zero(quantities, &written) {
            let vouched = |of: &mut Self| of.trusting || of.accepts(Accepted::Cancellation, quantities, &best);
            if vanishes(cas, &written)? || self.is_near_zero(quantities, &written) && vouched(self) {
                best = Expr::int(0);
            }
        }
        if !matches!(best, Expr::Number(_))
            && let Some(q) = self.seems_number(quantities, &written)
            && vanishes(cas, &(written.clone() - Expr::Number(q)))?
        {
            best = Expr::Number(q);
        }
        self.simple.insert(e, best.clone());
        Ok(best)
    }

    /// As `seems_zero`, and finite.
    pub fn is_near_zero(&self, quantities: &Quantities, e: &Expr) -> bool {
        self.seems_zero(quantities, e) && self.probed(quantities, e).all(|(value, _)| value.is_finite())
    }

    /// Whether the constant is 0, to rounding, or infinite at a few materials.
    fn seems_zero(&self, quantities: &Quantities, e: &Expr) -> bool {
        self.probed(quantities, e).all(|(value, magnitude)| !value.is_finite() || value.abs() <= 1e-9 * magnitude)
    }

    /// The simple number other than 0 that the constant is, to rounding, at a few materials.
    fn seems_number(&self, quantities: &Quantities, e: &Expr) -> Option<Rational> {
        let mut values = self.probed(quantities, e).map(|(value, _)| value);
        let first = values.next().filter(|value| value.is_finite() && value.abs() < 1e6)?;
        let near = |value: f64| (value - first).abs() <= 1e-9 * first.abs();
        let q = Rational::new((first * SIMPLE).round() as i128, SIMPLE as i128);
        (values.all(near) && !q.is_zero() && near(<f64 as Number>::from_rational(q))).then_some(q)
    }

    /// The value at each of a few materials, and the sum of the magnitudes of what was added to it.
    fn probed<'a>(&'a self, quantities: &'a Quantities, e: &'a Expr) -> impl Iterator<Item = (f64, f64)> + 'a {
        PROBES.iter().map(|t| {
            let at = |s: Symbol, k: usize| {
                let (low, high) = self.ranges.get(&s).copied().unwrap_or((0.5, 2.0));
                let t = (t + 0.618_034 * k as f64).fract();
                if low > 0.0 { low * (high / low).powf(t) } else { low + (high - low) * t }
            };
            evaluate(quantities, e, &at)
        })
    }

    /// Whether the constant is greater (`true`) or less (`false`) than 0 for every material; `None` if that is open.
    pub fn is_positive(&self, quantities: &Quantities, e: &Expr) -> Option<bool> {
        let (low, high) = self.interval(quantities, e)?;
        if low > 0.0 {
            Some(true)
        } else if high < 0.0 {
            Some(false)
        } else {
            None
        }
    }

    fn interval(&self, quantities: &Quantities, e: &Expr) -> Option<Interval> {
        let of = |x: &Expr| self.interval(quantities, x);
        let interval = match e {
            Expr::Number(q) => {
                let x = <f64 as Number>::from_rational(*q);
                (x, x)
            }
            Expr::Symbol(s) => match &quantities.get(*s).kind {
                Kind::Constant(Value::Expr(value)) => of(value)?,
                _ => *self.ranges.get(s)?,
            },
            Expr::Sum(xs) => xs.iter().try_fold((0.0, 0.0), |(l, h), x| of(x).map(|(a, b)| (l + a, h + b)))?,
            Expr::Product(xs) => xs.iter().try_fold((1.0, 1.0), |product, x| of(x).map(|b| times(product, b)))?,
            Expr::Power(base, exponent) => match **exponent {
                Expr::Number(q) => power(of(base)?, q)?,
                _ => {
                    let ((low, high), exponent) = (of(base)?, of(exponent)?);
                    if low <= 0.0 {
                        return None;
                    }
                    let (a, b) = times((low.ln(), high.ln()), exponent);
                    (a.exp(), b.exp())
                }
            },
            Expr::Ln(a) => {
                let (low, high) = of(a)?;
                if low <= 0.0 {
                    return None;
                }
                (low.ln(), high.ln())
            }
            Expr::Exp(a) => {
                let (low, high) = of(a)?;
                (low.exp(), high.exp())
            }
            Expr::Log1p(_) | Expr::Expm1(_) | Expr::Log1pmx(_) | Expr::Expm1mx(_) => return None,
        };
        (interval.0.is_finite() && interval.1.is_finite()).then_some(interval)
    }
}

fn times(a: Interval, b: Interval) -> Interval {
    let products = [a.0 * b.0, a.0 * b.1, a.1 * b.0, a.1 * b.1];
    (products.iter().copied().fold(f64::INFINITY, f64::min), products.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

fn power((low, high): Interval, q: Rational) -> Option<Interval> {
    let x = <f64 as Number>::from_rational(q);
    if low > 0.0 {
        let (a, b) = (low.powf(x), high.powf(x));
        return Some((a.min(b), a.max(b)));
    }
    let n = q.is_integer().then(|| q.to_integer().to_i32()).flatten()?;
    if high < 0.0 || n > 0 {
        let (a, b) = (low.powi(n), high.powi(n));
        let least = if n % 2 == 0 && high >= 0.0 { 0.0 } else { a.min(b) };
        return Some((least, a.max(b)));
    }
    None
}

/// The value, and the sum of the magnitudes of what was added to it.
fn evaluate(quantities: &Quantities, e: &Expr, at: &impl Fn(Symbol, usize) -> f64) -> (f64, f64) {
    let of = |x: &Expr| evaluate(quantities, x, at);
    let exactly = |x: f64| (x, x.abs());
    match e {
        Expr::Number(q) => exactly(<f64 as Number>::from_rational(*q)),
        Expr::Symbol(s) => match &quantities.get(*s).kind {
            Kind::Constant(Value::Expr(value)) => of(value),
            _ => exactly(at(*s, s.0 as usize)),
        },
        Expr::Sum(xs) => xs.iter().map(of).fold((0.0, 0.0), |(v, m), (x, y)| (v + x, m + y)),
        Expr::Product(xs) => xs.iter().map(of).fold((1.0, 1.0), |(v, m), (x, y)| (v * x, m * y)),
        Expr::Power(a, b) => {
            let (a, b) = (of(a).0, of(b).0);
            exactly(if b.fract() == 0.0 { a.powi(b as i32) } else { a.powf(b) })
        }
        Expr::Ln(a) => exactly(of(a).0.ln()),
        Expr::Exp(a) => exactly(of(a).0.exp()),
        Expr::Log1p(a) => exactly(of(a).0.ln_1p()),
        Expr::Expm1(a) => exactly(of(a).0.exp_m1()),
        Expr::Log1pmx(_) | Expr::Expm1mx(_) => (f64::NAN, f64::NAN),
    }
}

/// Whether the constant is 0 on one denominator.
fn vanishes(cas: &mut Cas, e: &Expr) -> Result<bool, UnexpectedTerm> {
    let common = cas.together(e)?;
    let common = cas.expand(&common)?;
    Ok(common.is_zero() || cas.expand(&numerator(&common))?.is_zero())
}

/// What a quotient has above: the factors that are no negative powers.
fn numerator(e: &Expr) -> Expr {
    match e {
        Expr::Product(factors) => Expr::Product(
            factors
                .iter()
                .filter(|f| !matches!(f, Expr::Power(_, b) if matches!(**b, Expr::Number(q) if q.is_negative())))
                .cloned()
                .collect(),
        ),
        _ => e.clone(),
    }
}

/// How long an expression is; sums count more, because terms may cancel in them.
fn size(e: &Expr) -> usize {
    match e {
        Expr::Sum(xs) => 4 * xs.len() + xs.iter().map(size).sum::<usize>(),
        Expr::Number(q) if q.is_zero() => 0,
        Expr::Number(_) | Expr::Symbol(_) => 1,
        Expr::Product(xs) => 1 + xs.iter().map(size).sum::<usize>(),
        Expr::Power(a, b) => 1 + size(a) + size(b),
        Expr::Ln(a) | Expr::Exp(a) => 2 + size(a),
        Expr::Log1p(a) | Expr::Expm1(a) | Expr::Log1pmx(a) | Expr::Expm1mx(a) => 2 + size(a),
    }
}

/// The expression written out, within functions too, and with powers of numbers in one form.
fn expanded(cas: &mut Cas, e: &Expr) -> Result<Expr, UnexpectedTerm> {
    let within = canonical(&inside(cas, e)?);
    let once = canonical(&cas.expand(&within)?);
    // What is in one form now may cancel now.
    cas.expand(&once)
}

/// The expression with the arguments of its functions written out.
fn inside(cas: &mut Cas, e: &Expr) -> Result<Expr, UnexpectedTerm> {
    Ok(match e {
        Expr::Number(_) | Expr::Symbol(_) => e.clone(),
        Expr::Sum(xs) => Expr::Sum(xs.iter().map(|x| inside(cas, x)).collect::<Result<_, _>>()?),
        Expr::Product(xs) => Expr::Product(xs.iter().map(|x| inside(cas, x)).collect::<Result<_, _>>()?),
        Expr::Power(a, b) => {
            // An integer power of a sum is written out with the rest.
            let a = if matches!(**b, Expr::Number(q) if q.is_integer()) { inside(cas, a)? } else { expanded(cas, a)? };
            Expr::Power(Box::new(a), Box::new(inside(cas, b)?))
        }
        Expr::Ln(a) => Expr::Ln(Box::new(expanded(cas, a)?)),
        Expr::Exp(a) => Expr::Exp(Box::new(expanded(cas, a)?)),
        Expr::Log1p(_) | Expr::Expm1(_) | Expr::Log1pmx(_) | Expr::Expm1mx(_) => e.clone(),
    })
}

fn replace(e: &Expr, s: Symbol, by: &Expr) -> Expr {
    let boxed = |x: &Expr| Box::new(replace(x, s, by));
    match e {
        Expr::Symbol(x) if *x == s => by.clone(),
        Expr::Number(_) | Expr::Symbol(_) => e.clone(),
        Expr::Sum(xs) => Expr::Sum(xs.iter().map(|x| replace(x, s, by)).collect()),
        Expr::Product(xs) => Expr::Product(xs.iter().map(|x| replace(x, s, by)).collect()),
        Expr::Power(a, b) => Expr::Power(boxed(a), boxed(b)),
        Expr::Ln(a) => Expr::Ln(boxed(a)),
        Expr::Exp(a) => Expr::Exp(boxed(a)),
        Expr::Log1p(a) => Expr::Log1p(boxed(a)),
        Expr::Expm1(a) => Expr::Expm1(boxed(a)),
        Expr::Log1pmx(a) => Expr::Log1pmx(boxed(a)),
        Expr::Expm1mx(a) => Expr::Expm1mx(boxed(a)),
    }
}

//! Polynomials in the reference coordinates x, y, z with exact coefficients, and numbers such as sqrt(3 / 5), read from text.

use std::collections::BTreeMap;

use num_traits::{One, Pow, Zero};
use syn::{BinOp, Expr, Lit, UnOp};

use crate::ir::{Number, Rational};

/// A polynomial: the coefficient of each monomial x^a y^b z^c, by (a, b, c); none is 0.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Polynomial(BTreeMap<[u32; 3], Rational>);

impl Polynomial {
    /// A constant.
    pub fn constant(q: Rational) -> Self {
        Self::monomial(q, [0; 3])
    }

    /// q x^a y^b z^c.
    pub fn monomial(q: Rational, exponents: [u32; 3]) -> Self {
        Self(std::iter::once((exponents, q)).filter(|(_, q)| !q.is_zero()).collect())
    }

    /// The coefficients and exponents of its terms.
    pub fn terms(&self) -> impl Iterator<Item = (Rational, [u32; 3])> {
        self.0.iter().map(|(e, q)| (*q, *e))
    }

    /// Its value where it is constant.
    pub fn as_constant(&self) -> Option<Rational> {
        self.0.keys().all(|e| *e == [0; 3]).then(|| self.0.values().sum())
    }

    /// The sum.
    pub fn plus(&self, other: &Self) -> Self {
        let mut sum = self.0.clone();
        for (e, q) in &other.0 {
            *sum.entry(*e).or_insert_with(Rational::zero) += q;
        }
        sum.retain(|_, q| !q.is_zero());
        Self(sum)
    }

    /// The product with a number.
    pub fn times(&self, q: Rational) -> Self {
        if q.is_zero() { Self::default() } else { Self(self.0.iter().map(|(e, c)| (*e, c * q)).collect()) }
    }

    /// The product.
    pub fn product(&self, other: &Self) -> Self {
        let mut product = Self::default();
        for (a, q) in &self.0 {
            for (b, r) in &other.0 {
                let e = std::array::from_fn(|k| a[k] + b[k]);
                product = product.plus(&Self::monomial(q * r, e));
            }
        }
        product
    }

    /// The derivative by coordinate k.
    pub fn derivative(&self, k: usize) -> Self {
        let terms = self.0.iter().filter(|(e, _)| e[k] > 0).map(|(e, q)| {
            let mut lower = *e;
            lower[k] -= 1;
            (lower, q * Rational::from_integer(e[k].into()))
        });
        Self(terms.collect())
    }

    /// The value at a point.
    pub fn at(&self, x: &[Rational; 3]) -> Rational {
        let term = |(e, q): (&[u32; 3], &Rational)| (0..3).fold(*q, |product, k| product * Pow::pow(x[k], e[k]));
        self.0.iter().map(term).sum()
    }

    /// The value at a point, in f64.
    pub fn at_f64(&self, x: &[f64; 3]) -> f64 {
        let term = |(e, q): (&[u32; 3], &Rational)| {
            (0..3).fold(f64::from_rational(*q), |product, k| product * x[k].powi(e[k] as i32))
        };
        self.0.iter().map(term).sum()
    }

    /// From text: sums, differences and products of numbers and x, y, z, and quotients by whole numbers.
    ///
    /// # Errors
    /// What is not one of these.
    pub fn parse(text: &str) -> Result<Self, String> {
        let e = syn::parse_str::<Expr>(text).map_err(|e| format!("`{text}`: {e}"))?;
        read(&e).ok_or_else(|| {
            format!("`{text}`: write sums and products of x, y, z and whole numbers, divided by whole numbers")
        })
    }
}

fn read(e: &Expr) -> Option<Polynomial> {
    Some(match e {
        Expr::Paren(p) => read(&p.expr)?,
        Expr::Group(g) => read(&g.expr)?,
        Expr::Lit(l) => match &l.lit {
            Lit::Int(n) => Polynomial::constant(Rational::from_integer(n.base10_parse().ok()?)),
            _ => return None,
        },
        Expr::Path(p) => {
            let name = p.path.get_ident()?.to_string();
            let k = ["x", "y", "z"].iter().position(|x| *x == name)?;
            Polynomial::monomial(Rational::one(), std::array::from_fn(|i| u32::from(i == k)))
        }
        Expr::Unary(u) if matches!(u.op, UnOp::Neg(_)) => read(&u.expr)?.times(-Rational::one()),
        Expr::Binary(b) => {
            let (left, right) = (read(&b.left)?, read(&b.right)?);
            match b.op {
                BinOp::Add(_) => left.plus(&right),
                BinOp::Sub(_) => left.plus(&right.times(-Rational::one())),
                BinOp::Mul(_) => left.product(&right),
                BinOp::Div(_) => left.times(right.as_constant().filter(|q| !q.is_zero())?.recip()),
                _ => return None,
            }
        }
        _ => return None,
    })
}

/// Exact numbers with commas between them.
///
/// # Errors
/// What is none.
pub fn rationals(text: &str) -> Result<Vec<Rational>, String> {
    let exact = |part: &str| Polynomial::parse(part)?.as_constant().ok_or_else(|| format!("`{part}` is no number"));
    text.split(',').map(exact).collect()
}

/// Numbers with commas between them, in which `sqrt(..)` may stand.
///
/// # Errors
/// What is none.
pub fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let one = |part: &str| {
        let e = syn::parse_str::<Expr>(part).map_err(|e| format!("`{part}`: {e}"))?;
        number(&e).filter(|x| x.is_finite()).ok_or_else(|| format!("`{part}` is no number"))
    };
    text.split(',').map(one).collect()
}

fn number(e: &Expr) -> Option<f64> {
    Some(match e {
        Expr::Paren(p) => number(&p.expr)?,
        Expr::Group(g) => number(&g.expr)?,
        Expr::Lit(l) => match &l.lit {
            Lit::Int(n) => n.base10_parse::<u32>().ok()?.into(),
            Lit::Float(x) => x.base10_parse().ok()?,
            _ => return None,
        },
        Expr::Unary(u) if matches!(u.op, UnOp::Neg(_)) => -number(&u.expr)?,
        Expr::Call(c) => match (&*c.func, c.args.first()) {
            (Expr::Path(p), Some(x)) if p.path.is_ident("sqrt") && c.args.len() == 1 => number(x)?.sqrt(),
            _ => return None,
        },
        Expr::Binary(b) => {
            let (left, right) = (number(&b.left)?, number(&b.right)?);
            match b.op {
                BinOp::Add(_) => left + right,
                BinOp::Sub(_) => left - right,
                BinOp::Mul(_) => left * right,
                BinOp::Div(_) => left / right,
                _ => return None,
            }
        }
        _ => return None,
    })
}

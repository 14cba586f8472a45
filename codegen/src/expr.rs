//! Expressions between the law and the kernel: exact, symbolic, over named symbols.

use num_traits::{One, Zero};

pub use crate::law::ast::Rational;

/// A named quantity of a derivation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Symbol(pub u32);

/// A symbolic expression. Not normalised: that is the computer algebra system's work.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Expr {
    /// An exact number.
    Number(Rational),
    /// A symbol.
    Symbol(Symbol),
    /// A sum.
    Sum(Vec<Expr>),
    /// A product.
    Product(Vec<Expr>),
    /// Base to the power exponent.
    Power(Box<Expr>, Box<Expr>),
    /// Natural logarithm.
    Ln(Box<Expr>),
    /// Exponential.
    Exp(Box<Expr>),
    /// ln(1 + x).
    Log1p(Box<Expr>),
    /// exp(x) - 1.
    Expm1(Box<Expr>),
}

impl Expr {
    /// An integer.
    pub fn int(n: i128) -> Expr {
        Expr::Number(Rational::from_integer(n))
    }

    /// A fraction; `d` is not zero.
    pub fn ratio(n: i128, d: i128) -> Expr {
        Expr::Number(Rational::new(n, d))
    }

    /// Whether this is the number 0.
    pub fn is_zero(&self) -> bool {
        matches!(self, Expr::Number(q) if q.is_zero())
    }

    /// Whether this is the number 1.
    pub fn is_one(&self) -> bool {
        matches!(self, Expr::Number(q) if q.is_one())
    }

    /// a to the power of an exact number.
    pub fn pow(self, exponent: Rational) -> Expr {
        Expr::Power(Box::new(self), Box::new(Expr::Number(exponent)))
    }

    /// Calls `f` on every symbol in the expression.
    pub fn for_each_symbol(&self, f: &mut impl FnMut(Symbol)) {
        match self {
            Expr::Number(_) => {}
            Expr::Symbol(s) => f(*s),
            Expr::Sum(xs) | Expr::Product(xs) => xs.iter().for_each(|x| x.for_each_symbol(f)),
            Expr::Power(a, b) => {
                a.for_each_symbol(f);
                b.for_each_symbol(f);
            }
            Expr::Ln(a) | Expr::Exp(a) | Expr::Log1p(a) | Expr::Expm1(a) => a.for_each_symbol(f),
        }
    }

    /// The symbols in the expression, each once, in order.
    pub fn symbols(&self) -> Vec<Symbol> {
        let mut found = std::collections::BTreeSet::new();
        self.for_each_symbol(&mut |s| {
            found.insert(s);
        });
        found.into_iter().collect()
    }
}

impl From<Symbol> for Expr {
    fn from(s: Symbol) -> Expr {
        Expr::Symbol(s)
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, |$a:ident, $b:ident| $body:expr) => {
        impl std::ops::$trait for Expr {
            type Output = Expr;
            fn $method(self, other: Expr) -> Expr {
                let ($a, $b) = (self, other);
                $body
            }
        }
    };
}
operator!(Add, add, |a, b| if a.is_zero() {
    b
} else if b.is_zero() {
    a
} else {
    Expr::Sum(vec![a, b])
});
operator!(Sub, sub, |a, b| if b.is_zero() { a } else { a + Expr::int(-1) * b });
operator!(Mul, mul, |a, b| if a.is_zero() || b.is_zero() {
    Expr::int(0)
} else if a.is_one() {
    b
} else if b.is_one() {
    a
} else {
    Expr::Product(vec![a, b])
});
operator!(Div, div, |a, b| a * b.pow(-Rational::one()));

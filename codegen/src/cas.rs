//! The one place that talks to Symbolica, the computer algebra system that differentiates.
//!
//! Expressions go in, are normalised or differentiated, and come back sorted by our own order, so that the text
//! generated from them does not depend on the order in which the system met the symbols. One live thread and one
//! process at a time: see [`crate::lock`].

use num_traits::One;
use symbolica::atom::{Atom, AtomCore, AtomView};

use crate::expr::{Expr, Rational, Symbol};

/// The session with the computer algebra system.
#[derive(Debug, Default)]
pub struct Cas {
    symbols: Vec<symbolica::atom::Symbol>,
}

/// A term that the computer algebra system and this generator do not both understand.
#[derive(Debug, Clone, thiserror::Error)]
#[error("`{0}` has no meaning to the computer algebra system and to this generator alike")]
pub struct UnexpectedTerm(pub String);

impl Cas {
    /// A new session.
    pub fn new() -> Self {
        Self::default()
    }

    fn symbol(&mut self, s: Symbol) -> symbolica::atom::Symbol {
        // Names are by number, registered in ascending order: the same in every process.
        while self.symbols.len() <= s.0 as usize {
            let name = format!("tensormass::s{}", self.symbols.len());
            self.symbols.push(symbolica::symbol!(name.as_str()));
        }
        self.symbols[s.0 as usize]
    }

    fn atom(&mut self, e: &Expr) -> Result<Atom, UnexpectedTerm> {
        Ok(match e {
            Expr::Number(q) => number(*q),
            Expr::Symbol(s) => Atom::var(self.symbol(*s)),
            Expr::Sum(xs) => xs.iter().try_fold(Atom::num(0), |sum, x| Ok(sum + self.atom(x)?))?,
            Expr::Product(xs) => xs.iter().try_fold(Atom::num(1), |product, x| Ok(product * self.atom(x)?))?,
            Expr::Power(a, b) => {
                let (a, b) = (self.atom(a)?, self.atom(b)?);
                a.pow(b)
            }
            Expr::Ln(a) => self.atom(a)?.log(),
            Expr::Exp(a) => self.atom(a)?.exp(),
            // What the splitting writes is not differentiated any more.
            Expr::Log1p(_) | Expr::Expm1(_) | Expr::Log1pmx(_) | Expr::Expm1mx(_) => {
                return Err(UnexpectedTerm("log1p, expm1 or a remainder".into()));
            }
        })
    }

    fn expr(&self, view: AtomView) -> Result<Expr, UnexpectedTerm> {
        let unexpected = || UnexpectedTerm(view.to_canonical_string());
        Ok(match view {
            AtomView::Num(_) => Expr::Number(rational(&view.to_canonical_string()).ok_or_else(unexpected)?),
            AtomView::Var(v) => {
                let symbol = v.get_symbol();
                let index = self.symbols.iter().position(|&s| s == symbol).ok_or_else(unexpected)?;
                Expr::Symbol(Symbol(index as u32))
            }
            AtomView::Fun(f) if f.get_symbol().get_stripped_name() == "log" => {
                let arguments: Vec<AtomView> = f.iter().collect();
                match arguments.as_slice() {
                    [a] => Expr::Ln(Box::new(self.expr(*a)?)),
                    _ => return Err(unexpected()),
                }
            }
            AtomView::Fun(_) => return Err(unexpected()),
            AtomView::Pow(p) => {
                let (base, exponent) = p.get_base_exp();
                // exp(x) is Euler's number to the power x there.
                if let AtomView::Var(v) = base
                    && !self.symbols.contains(&v.get_symbol())
                    && base.to_canonical_string().ends_with('𝑒')
                {
                    Expr::Exp(Box::new(self.expr(exponent)?))
                } else {
                    Expr::Power(Box::new(self.expr(base)?), Box::new(self.expr(exponent)?))
                }
            }
            AtomView::Mul(m) => {
                let mut factors = m.iter().map(|f| self.expr(f)).collect::<Result<Vec<_>, _>>()?;
                factors.sort();
                Expr::Product(factors)
            }
            AtomView::Add(a) => {
                let mut terms = a.iter().map(|t| self.expr(t)).collect::<Result<Vec<_>, _>>()?;
                terms.sort();
                Expr::Sum(terms)
            }
        })
    }

    /// The expression with like terms merged.
    ///
    /// # Errors
    /// The system answered in terms that have no meaning here.
    pub fn normalize(&mut self, e: &Expr) -> Result<Expr, UnexpectedTerm> {
        let atom = self.atom(e)?;
        self.expr(atom.as_view())
    }

    /// The expression with its products multiplied out and like terms merged.
    ///
    /// # Errors
    /// The system answered in terms that have no meaning here.
    pub fn expand(&mut self, e: &Expr) -> Result<Expr, UnexpectedTerm> {
        let atom = self.atom(e)?.expand();
        self.expr(atom.as_view())
    }

    /// The expression over a common denominator, which is 0 only where the expression is.
    ///
    /// # Errors
    /// The system answered in terms that have no meaning here.
    pub fn together(&mut self, e: &Expr) -> Result<Expr, UnexpectedTerm> {
        let atom = self.atom(e)?.together();
        self.expr(atom.as_view())
    }

    /// The expression as a product of factors that cannot be divided further.
    ///
    /// # Errors
    /// The system answered in terms that have no meaning here.
    pub fn factor(&mut self, e: &Expr) -> Result<Expr, UnexpectedTerm> {
        let atom = self.atom(e)?.factor();
        self.expr(atom.as_view())
    }

    /// The partial derivative by a symbol, every other symbol held.
    ///
    /// # Errors
    /// The system answered in terms that have no meaning here.
    pub fn derivative(&mut self, e: &Expr, by: Symbol) -> Result<Expr, UnexpectedTerm> {
        let atom = self.atom(e)?.derivative(self.symbol(by));
        self.expr(atom.as_view())
    }
}

fn number(q: Rational) -> Atom {
    match (i64::try_from(*q.numer()), i64::try_from(*q.denom())) {
        (Ok(n), Ok(d)) => Atom::num((n, d)),
        // Beyond 64 bits the text form is the documented way in.
        _ => symbolica::try_parse!(format!("{}/{}", q.numer(), q.denom())).expect("a quotient of integers parses"),
    }
}

fn rational(text: &str) -> Option<Rational> {
    let (n, d) = text.split_once('/').unwrap_or((text, "1"));
    let (n, d): (i128, i128) = (n.parse().ok()?, d.parse().ok()?);
    if d == 0 { None } else { Some(if d.is_one() { Rational::from_integer(n) } else { Rational::new(n, d) }) }
}

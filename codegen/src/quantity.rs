//! The named quantities of one derivation, in the order in which they were introduced.

use crate::expr::{Expr, Symbol};
use crate::ir::Input;

/// How a quantity is computed.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// By an expression in other quantities.
    Expr(Expr),
    /// By a comparison: `then` where `left > right`, `otherwise` elsewhere.
    Select {
        /// Left side.
        left: Expr,
        /// Right side.
        right: Expr,
        /// Value where left > right.
        then: Expr,
        /// Value elsewhere.
        otherwise: Expr,
    },
}

impl Value {
    /// The expressions that the value reads.
    pub fn operands(&self) -> Vec<&Expr> {
        match self {
            Value::Expr(e) => vec![e],
            Value::Select { left, right, then, otherwise } => vec![left, right, then, otherwise],
        }
    }
}

/// What a quantity is.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// A component of a kernel's input. Parameters are inputs too.
    Input(Input, u32),
    /// A function of the parameters alone: computed once a material.
    Constant(Value),
    /// A stage of the derivation.
    Stage {
        /// How it is computed.
        value: Value,
        /// Its partial derivatives by other quantities, where they are not those of `value`: a stage may be computed
        /// by one form and differentiated in another, equal one.
        partials: Option<Vec<(Symbol, Expr)>>,
    },
}

/// A quantity: its name for the reader, and what it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Name in generated text.
    pub name: String,
    /// What it is.
    pub kind: Kind,
}

/// All quantities of one derivation; a [`Symbol`] is an index here.
#[derive(Debug, Clone, Default)]
pub struct Quantities(Vec<Quantity>);

impl Quantities {
    /// Adds a quantity.
    pub fn add(&mut self, name: impl Into<String>, kind: Kind) -> Symbol {
        self.0.push(Quantity { name: name.into(), kind });
        Symbol(u32::try_from(self.0.len() - 1).expect("a derivation has fewer than 2^32 quantities"))
    }

    /// Adds a stage that is differentiated as it is computed.
    pub fn stage(&mut self, name: impl Into<String>, e: Expr) -> Symbol {
        self.add(name, Kind::Stage { value: Value::Expr(e), partials: None })
    }

    /// Gives a stage partial derivatives of its own, which may read the stage itself.
    pub fn differentiate_by(&mut self, s: Symbol, by: Vec<(Symbol, Expr)>) {
        if let Kind::Stage { partials, .. } = &mut self.0[s.0 as usize].kind {
            *partials = Some(by);
        }
    }

    /// The stages that are selections, with names and values.
    pub fn selections(&self) -> Vec<(Symbol, String, Value)> {
        let each = self.0.iter().enumerate().filter_map(|(i, q)| match &q.kind {
            Kind::Stage { value: value @ Value::Select { .. }, .. } => {
                Some((Symbol(i as u32), q.name.clone(), value.clone()))
            }
            _ => None,
        });
        each.collect()
    }

    /// The quantity of a symbol.
    pub fn get(&self, s: Symbol) -> &Quantity {
        &self.0[s.0 as usize]
    }

    /// Whether the symbol depends on the parameters alone.
    pub fn is_constant(&self, s: Symbol) -> bool {
        matches!(self.get(s).kind, Kind::Constant(_) | Kind::Input(Input::Parameters, _))
    }

    /// Whether the expression depends on the parameters alone.
    pub fn is_constant_expr(&self, e: &Expr) -> bool {
        e.symbols().into_iter().all(|s| self.is_constant(s))
    }

    /// Whether the expression is a polynomial in what is no constant.
    pub fn is_polynomial(&self, e: &Expr) -> bool {
        match e {
            Expr::Symbol(_) => true,
            Expr::Sum(parts) | Expr::Product(parts) => parts.iter().all(|part| self.is_polynomial(part)),
            Expr::Power(base, exponent) => {
                let whole = matches!(&**exponent, Expr::Number(q) if q.is_integer() && *q.numer() > 0);
                (whole && self.is_polynomial(base)) || self.is_constant_expr(e)
            }
            _ => self.is_constant_expr(e),
        }
    }

    /// Whether the expression is constant or a constant times one symbol.
    pub fn is_multiple(&self, e: &Expr) -> bool {
        match e {
            Expr::Symbol(_) => true,
            Expr::Product(factors) => {
                let mut varying = factors.iter().filter(|f| !self.is_constant_expr(f));
                matches!((varying.next(), varying.next()), (None | Some(Expr::Symbol(_)), None))
            }
            _ => self.is_constant_expr(e),
        }
    }

    /// Whether the expression is better repeated than named: a number, a symbol, a multiple of one, or constant.
    pub fn is_simple(&self, e: &Expr) -> bool {
        match e {
            Expr::Number(_) | Expr::Symbol(_) => true,
            Expr::Product(factors) => {
                matches!(factors.as_slice(), [Expr::Number(_), Expr::Symbol(_)]) || self.is_constant_expr(e)
            }
            _ => self.is_constant_expr(e),
        }
    }
}

//! Rest-state splitting: rewrites textbook formulas so that what vanishes at rest is computed without cancellation.
//!
//! Every value is written as its exact constant at rest, which the generator knows as an expression in the parameters,
//! and its change since, which alone is computed and vanishes at rest. Constants that cancel do so here, exactly; where
//! the sum of constants is 0, only the change is printed. The rules, for values c + x:
//!
//! | textbook | change |
//! |---|---|
//! | (a + x) + (b + y) | x + y |
//! | (a + x)(b + y) | a y + x (b + y) |
//! | (a + x)^n, n = 2, 3, .. | x ((a + x)^(n-1) + .. + a^(n-1)) |
//! | 1 / (a + x) | -x / (a (a + x)) |
//! | sqrt(a + x) | x / (sqrt(a + x) + sqrt(a)) |
//! | (a + x)^r | a^r expm1(r log1p(x / a)) |
//! | ln(a + x) | log1p(x / a) |
//! | exp(a + x) | e^a expm1(x) |
//!
//! Stresses are split over the displacement gradient ([`first`]). Energies are of second order at rest and are split
//! over the Green strain, into constant, linear form and remainder ([`second`]): split over G they would lose
//! their digits under rotation. Away from rest the changes cancel instead, and the textbook form counts: a kernel that
//! was rewritten says where it holds (`NearRest`), and has a sibling for elsewhere.

mod constant;
mod error;
mod functions;
mod powers;
mod product;
mod roots;
mod second;
mod select;

use std::collections::HashMap;

use crate::cas::{Cas, UnexpectedTerm};
use crate::derivation::Rewrite;
use crate::expr::{Expr, Symbol};
use crate::law::ast::{Acceptance, Accepted};
use crate::quantity::{Kind, Quantities, Value};

use constant::Constants;
pub use error::SplitError;
pub use second::{Leaves, Second};

/// A value as its constant at rest and its change since.
#[derive(Debug, Clone)]
pub struct Split {
    /// The constant at rest, in the parameters alone.
    pub rest: Expr,
    /// The change: 0 at rest.
    pub change: Expr,
    /// The value itself, where it is needed as a factor or divisor.
    pub value: Expr,
    /// Whether a rule rewrote something in `change` and in `value`: what was not, stays the author's.
    pub rewritten: (bool, bool),
    /// The change of second order, where energies are split.
    pub second: Option<Second>,
    /// Why there is no constant at rest: the value jumps there. Only `value` counts then, which may be multiplied by
    /// what vanishes.
    jump: Option<Jump>,
}

/// A value that jumps at rest.
#[derive(Debug, Clone)]
struct Jump {
    term: Expr,
    reason: String,
}

impl Split {
    fn is_constant(&self) -> bool {
        self.change.is_zero()
    }

    /// A value whose constant at rest and change are known.
    pub fn given(rest: Expr, change: Symbol) -> Self {
        let value = rest.clone() + change.into();
        Self { rest, change: change.into(), value, rewritten: (true, true), second: None, jump: None }
    }

    /// With its change to second order: `coefficient` times a linear invariant, and the remainder.
    pub fn with_second_order(self, invariant: Symbol, coefficient: Expr, remainder: Symbol) -> Self {
        Self { second: Some(Second::known(invariant, coefficient, remainder)), ..self }
    }
}

/// A value that is a constant and a linear invariant, to second order.
pub fn linear(rest: Expr, change: Symbol) -> Split {
    Split { second: Some(Second::linear(change)), ..Split::given(rest, change) }
}

/// What the kernels of one derivation share: known constants, and the rewrites for the reader.
#[derive(Debug, Default)]
pub struct Rest {
    constants: Constants,
    /// The rewrites, in the order in which they were made.
    pub rewrites: Vec<Rewrite>,
}

impl Rest {
    /// For parameters with these ranges, and what the law's author vouches for.
    pub fn new(ranges: HashMap<Symbol, (f64, f64)>, accepted: &[Acceptance]) -> Self {
        Self { constants: Constants::new(ranges, accepted), rewrites: vec![] }
    }

    /// A constant simplified: see [`Constants::simplify`].
    ///
    /// # Errors
    /// The computer algebra system answered in unknown terms.
    pub fn simplify(&mut self, cas: &mut Cas, quantities: &Quantities, e: Expr) -> Result<Expr, UnexpectedTerm> {
        self.constants.simplify(cas, quantities, e)
    }

    /// The first acceptance that nothing needed.
    pub fn unused(&self) -> Option<&Acceptance> {
        self.constants.unused()
    }
}

/// Splits the quantities of one kernel.
pub struct Splitter<'a> {
    cas: &'a mut Cas,
    quantities: &'a mut Quantities,
    rest: &'a mut Rest,
    kernel: &'static str,
    /// The splits of quantities; those given at the start are leaves.
    known: HashMap<Symbol, Split>,
    /// J and the quantity p with J = sqrt(1 + p), where J is to be written so.
    jacobian: Option<(Symbol, Symbol)>,
    order: Order,
}

/// To which order values are split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    First,
    Second,
}

impl<'a> Splitter<'a> {
    /// Splits to first order over G: for stresses.
    pub fn first(cas: &'a mut Cas, quantities: &'a mut Quantities, rest: &'a mut Rest, kernel: &'static str) -> Self {
        Self { cas, quantities, rest, kernel, known: HashMap::new(), jacobian: None, order: Order::First }
    }

    /// The split of an expression, whose constant at rest exists.
    ///
    /// # Errors
    /// See [`SplitError`].
    pub fn split(&mut self, e: &Expr) -> Result<Split, SplitError> {
        let split = self.part(e)?;
        match &split.jump {
            Some(Jump { term, reason }) => {
                self.refuse(term, reason, "let the branches agree where the condition changes, or narrow the ranges so that it is decided at rest")
            }
            None => Ok(split),
        }
    }

    /// The split of a part, which may jump at rest.
    fn part(&mut self, e: &Expr) -> Result<Split, SplitError> {
        if self.quantities.is_constant_expr(e) {
            return self.constant(e.clone());
        }
        match e {
            Expr::Number(_) => self.constant(e.clone()),
            Expr::Symbol(s) => self.symbol(*s),
            Expr::Sum(terms) => self.sum(e, terms),
            Expr::Product(factors) => self.product(factors),
            Expr::Power(base, exponent) => self.power(e, base, exponent),
            Expr::Ln(a) => self.ln(e, a),
            Expr::Exp(a) => self.exp(e, a),
            Expr::Log1p(_) | Expr::Expm1(_) | Expr::Log1pmx(_) | Expr::Expm1mx(_) => Ok(self.opaque(e.clone())),
        }
    }

    /// Ends the splitting at a quantity whose split is known.
    pub fn give(&mut self, s: Symbol, split: Split) {
        self.known.insert(s, split);
    }

    /// Whether the quantity took part in what was split so far.
    pub fn has_split(&self, s: Symbol) -> bool {
        self.known.contains_key(&s)
    }

    /// The quantities that were split, in order: each with the symbols of its change and of its value, where these are
    /// not the quantity itself.
    pub fn split_quantities(&self) -> Vec<(Symbol, Option<Symbol>, Option<Symbol>)> {
        let symbol = |e: &Expr, s: Symbol| match e {
            Expr::Symbol(x) if *x != s => Some(*x),
            _ => None,
        };
        let mut all: Vec<_> =
            self.known.iter().map(|(&s, split)| (s, symbol(&split.change, s), symbol(&split.value, s))).collect();
        all.sort();
        all
    }

    /// A comparison as the change of its difference and the threshold that this is compared with, if a rule applies.
    ///
    /// # Errors
    /// See [`SplitError`].
    pub fn condition(&mut self, left: &Expr, right: &Expr) -> Result<Option<(Expr, Expr)>, SplitError> {
        let difference = self.split(&(left.clone() - right.clone()))?;
        let threshold = self.simplify(Expr::int(-1) * difference.rest)?;
        Ok(difference.rewritten.0.then_some((difference.change, threshold)))
    }

    /// How many rewrites were noted so far.
    pub fn rewrites(&self) -> usize {
        self.rest.rewrites.len()
    }

    fn constant(&mut self, e: Expr) -> Result<Split, SplitError> {
        let rest = self.simplify(e)?;
        Ok(Split {
            rest: rest.clone(),
            change: Expr::int(0),
            value: rest,
            rewritten: (false, false),
            second: self.second(Second::zero),
            jump: None,
        })
    }

    /// A value that vanishes at rest and is computed as it stands.
    fn opaque(&self, e: Expr) -> Split {
        let second = self.second(|| Second::of_first_order(e.clone()));
        Split { rest: Expr::int(0), change: e.clone(), value: e, rewritten: (false, false), second, jump: None }
    }

    /// A value that jumps at rest.
    fn jumping(&self, value: Expr, jump: Jump) -> Split {
        let second = self.second(Second::zero);
        Split { rest: Expr::int(0), change: Expr::int(0), value, rewritten: (true, true), second, jump: Some(jump) }
    }

    fn second(&self, second: impl FnOnce() -> Second) -> Option<Second> {
        (self.order == Order::Second).then(second)
    }

    fn simplify(&mut self, e: Expr) -> Result<Expr, SplitError> {
        Ok(self.rest.constants.simplify(self.cas, self.quantities, e)?)
    }

    fn text(&self, e: &Expr) -> String {
        crate::print::expression(e, self.quantities)
    }

    /// Notes a rewrite for the reader.
    fn note_split(&mut self, term: &Expr, split: &Split) {
        let form = split.second.as_ref().map_or(&split.change, |s| &s.remainder);
        let [term, rest, form] = [term, &split.rest, form].map(|e| self.text(e));
        let rewrite = Rewrite { kernel: self.kernel.to_string(), term, rest, form };
        if !self.rest.rewrites.contains(&rewrite) {
            self.rest.rewrites.push(rewrite);
        }
    }

    /// Whether the constant is positive (`true`) or negative (`false`) for every material; `None` if that is open.
    fn sign(&mut self, constant: &Expr) -> Result<Option<bool>, SplitError> {
        if let Some(sign) = self.rest.constants.is_positive(self.quantities, constant) {
            return Ok(Some(sign));
        }
        // Written out, a power of a difference hides its sign: (j - 1)^3.
        let factored = self.cas.factor(constant)?;
        Ok(self.rest.constants.is_positive(self.quantities, &factored))
    }

    /// Refuses a term that depends on the sign of a constant which is open, unless the author vouches for it.
    fn require_sign(&mut self, term: &Expr, does: &str, constant: &Expr) -> Result<(), SplitError> {
        if self.rest.constants.accepts(Accepted::Sign, self.quantities, constant) {
            return Ok(());
        }
        let constant = self.text(constant);
        let remedy = format!(
            "narrow a parameter's `#[range(..)]` so that the sign is decided, or say why it is: `#[accept(sign = \
             \"{constant}\", reason = \"..\")]`"
        );
        let reason = format!("{does} `{constant}` at rest, whose sign the declared ranges leave open");
        self.refuse(term, &reason, &remedy)
    }

    /// The refusal of a stress at rest, which begins with `e`.
    pub fn stressed(&self, e: &Expr, constants: &[Expr]) -> SplitError {
        match constants.iter().find(|c| self.rest.constants.is_near_zero(self.quantities, c)) {
            Some(c) if constants.iter().all(|c| self.rest.constants.is_near_zero(self.quantities, c)) => {
                SplitError::Cancellation(self.text(c))
            }
            _ => SplitError::StressAtRest(self.text(e)),
        }
    }

    fn refuse<T>(&self, term: &Expr, reason: &str, remedy: &str) -> Result<T, SplitError> {
        Err(SplitError::Term { term: self.text(term), reason: reason.into(), remedy: remedy.into() })
    }

    /// A name for an expression that is better not repeated.
    fn named(&mut self, name: String, e: Expr) -> Expr {
        if self.quantities.is_simple(&e) { e } else { self.quantities.stage(name, e).into() }
    }

    fn symbol(&mut self, s: Symbol) -> Result<Split, SplitError> {
        if let Some(known) = self.known.get(&s) {
            return Ok(known.clone());
        }
        if let Some((j, p)) = self.jacobian
            && s == j
        {
            let form = (Expr::int(1) + p.into()).pow(crate::expr::Rational::new(1, 2));
            let split = self.split(&form)?;
            let split = self.name_parts(s, split);
            self.known.insert(s, split.clone());
            return Ok(split);
        }
        let quantity = self.quantities.get(s).clone();
        let split = match &quantity.kind {
            Kind::Constant(_) => self.constant(s.into())?,
            Kind::Input(..) => self.opaque(s.into()),
            Kind::Stage { value: Value::Expr(e), .. } => {
                let split = self.part(e)?;
                if split.jump.is_some() { split } else { self.stage(s, e, split) }
            }
            Kind::Stage { value: Value::Select { left, right, then, otherwise }, .. } => {
                let split = self.select(s, [left, right, then, otherwise])?;
                if split.jump.is_some() { split } else { self.name_parts(s, split) }
            }
        };
        self.known.insert(s, split.clone());
        Ok(split)
    }

    /// The split of a stage, computed by `e`, from that of `e`: what was not rewritten stays the stage.
    fn stage(&mut self, s: Symbol, e: &Expr, split: Split) -> Split {
        let unchanged = split.rest.is_zero() && !split.rewritten.0;
        let value = split.rest.clone() + split.change.clone();
        if unchanged || value == *e {
            let mut split = split;
            if unchanged {
                split.change = s.into();
            }
            split.value = s.into();
            split.rewritten.1 = false;
            if let Some(second) = &mut split.second
                && unchanged
                && second.linear.is_empty()
            {
                second.remainder = s.into();
            }
            return split;
        }
        self.name_parts(s, split)
    }

    /// Names the parts of a stage's split after it; the value is the constant and the change.
    fn name_parts(&mut self, s: Symbol, mut split: Split) -> Split {
        let name = self.quantities.get(s).name.clone();
        if !split.rest.is_zero() {
            self.note_split(&s.into(), &split);
        }
        split.change = self.named(format!("{name}_change"), split.change);
        split.value = if split.rest.is_zero() {
            split.change.clone()
        } else {
            let value = split.rest.clone() + split.change.clone();
            self.named(name.clone(), value)
        };
        if let Some(second) = &mut split.second {
            second.remainder = if second.linear.is_empty() && second.is_whole {
                split.change.clone()
            } else {
                let remainder = second.remainder.clone();
                if self.quantities.is_simple(&remainder) {
                    remainder
                } else {
                    self.quantities.stage(format!("{name}_remainder"), remainder).into()
                }
            };
        }
        split
    }

    fn sum(&mut self, e: &Expr, terms: &[Expr]) -> Result<Split, SplitError> {
        let mut parts = Vec::new();
        for t in terms {
            parts.push(self.part(t)?);
        }
        if let Some(jump) = parts.iter().find_map(|p| p.jump.clone()) {
            return Ok(self.jumping(total(parts.into_iter().map(|p| p.value)), jump));
        }
        let rests: Vec<Expr> = parts.iter().map(|p| p.rest.clone()).collect();
        let had_rest = parts.iter().filter(|p| !p.is_constant()).any(|p| !p.rest.is_zero());
        let rest = self.simplify(Expr::Sum(rests))?;
        let change = total(parts.iter().map(|p| p.change.clone()));
        let rewritten = parts.iter().any(|p| p.rewritten.0) || had_rest;
        let values_rewritten = parts.iter().any(|p| p.rewritten.1);
        let (value, value_rewritten) = if rest.is_zero() {
            (change.clone(), rewritten)
        } else {
            (total(parts.iter().map(|p| p.value.clone())), values_rewritten)
        };
        let second = match self.order {
            Order::First => None,
            Order::Second => Some(self.second_of_sum(&parts, &change)?),
        };
        let cancelled = rest.is_zero() && had_rest;
        let split = Split { rest, change, value, rewritten: (rewritten, value_rewritten), second, jump: None };
        if cancelled {
            self.note_split(e, &split);
        }
        Ok(split)
    }
}

/// The sum of terms, without those that are 0.
fn total(terms: impl Iterator<Item = Expr>) -> Expr {
    let mut flat = Vec::new();
    for t in terms {
        match t {
            Expr::Sum(xs) => flat.extend(xs),
            t if t.is_zero() => {}
            t => flat.push(t),
        }
    }
    match flat.len() {
        0 => Expr::int(0),
        1 => flat.remove(0),
        _ => Expr::Sum(flat),
    }
}

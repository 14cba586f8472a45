//! Expressions: names, fields, literals and arithmetic of a law to typed values.

use std::collections::{BTreeMap, BTreeSet};

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::{Expr, Lit, Member};

use super::ast::{Parameter, Scalar, ScalarNode};
use super::defined::Declared;
use super::dimension::Dimension;
use super::error::{LawError, Place, Source};
use super::functions::Function;
use super::interval::{Interval, Values};
use super::literals;
use super::metadata::Metadata;
use super::value::{Facts, Integer, IntegerType, ScalarValue, TensorValue, Value};
use super::words;

/// Levels of expressions and calls that the parser follows: it recurses.
const MAX_LEVELS: usize = 200;
/// Levels of the checked tree: the passes over it recurse.
const MAX_TREE_DEPTH: usize = 800;
/// Expressions that a law may have with its helper functions and sums written out.
const MAX_STEPS: usize = 100_000;

/// The names that are visible at a place, with their values.
pub(super) type Scope = Vec<(String, Value)>;

/// Turns expressions into values, and collects what is wrong with them.
pub(super) struct Lowering<'a> {
    pub(super) source: Source<'a>,
    pub(super) errors: Vec<LawError>,
    pub(super) parameters: &'a [Parameter],
    /// Parameters of any dimension, by index: their units were refused.
    unknown_units: &'a BTreeSet<usize>,
    pub(super) functions: BTreeMap<String, Function<'a>>,
    pub(super) constants: BTreeMap<String, Value>,
    /// Functions that are being inlined, outermost first.
    pub(super) stack: Vec<String>,
    /// Functions that were called.
    pub(super) called: BTreeSet<String>,
    /// What the struct's attributes say of the law.
    pub(super) declared: Declared,
    /// Whether `eps` was used.
    pub(super) uses_eps: bool,
    /// Whether the expression is the domain's: names are then those of the strain's fields.
    pub(super) in_domain: bool,
    /// Where the energy's expressions stand, each after those that it is made of.
    pub(super) places: Vec<(Scalar, Place)>,
    levels: usize,
    steps: usize,
}

impl<'a> Lowering<'a> {
    pub(super) fn new(source: Source<'a>, metadata: &'a Metadata) -> Self {
        Lowering {
            source,
            errors: Vec::new(),
            parameters: &metadata.parameters,
            unknown_units: &metadata.unknown_units,
            functions: BTreeMap::new(),
            constants: BTreeMap::new(),
            stack: Vec::new(),
            called: BTreeSet::new(),
            declared: Declared { domain: metadata.has_domain, small_strain: metadata.small_strain.is_some() },
            uses_eps: false,
            in_domain: false,
            places: Vec::new(),
            levels: 0,
            steps: 0,
        }
    }

    /// Notes an error.
    pub(super) fn error(&mut self, span: Span, reason: impl Into<String>, remedy: impl Into<String>) {
        self.errors.push(self.source.error(span, reason, remedy));
    }

    /// Notes an error, and gives the value that is not reported again.
    pub(super) fn broken(&mut self, span: Span, reason: impl Into<String>, remedy: impl Into<String>) -> Value {
        self.error(span, reason, remedy);
        Value::Broken
    }

    /// The value of an expression.
    pub(super) fn expr(&mut self, expr: &Expr, scope: &Scope) -> Value {
        if self.steps == MAX_STEPS {
            let reason =
                format!("the law has more than {MAX_STEPS} operations with its functions and sums written out");
            self.error(expr.span(), reason, "write a shorter form, and name repeated values by `let`");
        }
        self.steps += 1;
        if self.steps > MAX_STEPS {
            return Value::Broken;
        }
        if self.levels == MAX_LEVELS {
            let reason = format!("expressions and calls are nested more than {MAX_LEVELS} deep");
            return self.broken(expr.span(), reason, "name inner values by `let`");
        }
        self.levels += 1;
        let value = self.kind_of_expr(expr, scope);
        self.levels -= 1;
        if let (Value::Scalar(scalar), false) = (&value, self.in_domain) {
            self.places.push((scalar.node.clone(), Place::from(expr.span())));
        }
        let deep = |facts: Facts| facts.depth > MAX_TREE_DEPTH;
        match value {
            Value::Scalar(ScalarValue { facts, .. }) | Value::Tensor(TensorValue { facts, .. }) if deep(facts) => {
                let reason = format!("operations depend on one another more than {MAX_TREE_DEPTH} deep");
                self.broken(expr.span(), reason, "write a shorter form")
            }
            value => value,
        }
    }

    fn kind_of_expr(&mut self, expr: &Expr, scope: &Scope) -> Value {
        match expr {
            Expr::Paren(inner) => self.expr(&inner.expr, scope),
            Expr::Group(inner) => self.expr(&inner.expr, scope),
            Expr::Lit(literal) => self.literal(&literal.lit),
            Expr::Path(path) => match path.path.get_ident() {
                Some(name) => self.name(&name.to_string(), name.span(), scope),
                None => self.broken(
                    expr.span(),
                    "a path `a::b` is not part of the law language",
                    "write the function's plain name, or the number itself",
                ),
            },
            Expr::Field(field) => self.field(field, scope),
            Expr::Index(index) => self.index(index, scope),
            Expr::Unary(unary) => self.unary(unary, scope),
            Expr::Binary(binary) => self.chain(binary, scope),
            Expr::Call(call) => self.call(call, scope),
            Expr::MethodCall(call) => self.method(call, scope),
            Expr::Cast(cast) => self.cast(cast, scope),
            Expr::Assign(assign) => self.mutation(assign.eq_token.span),
            Expr::Closure(_) | Expr::Range(_) => self.broken(
                expr.span(),
                "ranges and closures belong to `sum` only",
                "write `sum(0..N, |i| ..)`, with N a literal or a constant",
            ),
            Expr::Block(_) => self.broken(
                expr.span(),
                "a block `{ .. }` is no expression of the law language",
                "write its `let`s before this statement, or a helper function",
            ),
            Expr::Array(_) | Expr::Repeat(_) | Expr::Tuple(_) | Expr::Struct(_) => self.broken(
                expr.span(),
                "arrays, tuples and structs cannot be made in a law",
                "arrays come from the parameters: `#[unit(\"Pa\")] #[range(0.0, 1e9)] mu: [f64; 3]`",
            ),
            // `syn::Expr` may grow: whatever is not listed above is not part of the language.
            _ => self.broken(
                expr.span(),
                "this expression is not part of the law language",
                "a law is arithmetic, calls and methods on the strain and the parameters: see laws/README.md",
            ),
        }
    }

    /// The value of an expression that has to be a scalar; `None` if an error was noted.
    pub(super) fn scalar(&mut self, expr: &Expr, scope: &Scope) -> Option<ScalarValue> {
        let value = self.expr(expr, scope);
        self.as_scalar(value, expr)
    }

    /// `value` of `expr` as a scalar; `None` if an error was noted.
    pub(super) fn as_scalar(&mut self, value: Value, expr: &Expr) -> Option<ScalarValue> {
        match value {
            Value::Scalar(scalar) => return Some(scalar),
            Value::Broken => {}
            Value::Integer(integer) => self.integer_as_scalar(integer, expr),
            Value::Tensor(_) => {
                let remedy = "make a scalar of it: `tr(A)`, `ddot(A, B)` or `det(A)`";
                self.error(expr.span(), "a scalar is needed here, and this is a tensor", remedy);
            }
            Value::Strain => {
                let remedy = "take one of its fields, such as `s.I1` or `s.J`";
                self.error(expr.span(), "a scalar is needed here, and this is the strain", remedy);
            }
            Value::StrainRate => {
                let remedy = "take one of its fields, such as `r.J`, or `ddot(r.E, r.E)`";
                self.error(expr.span(), "a scalar is needed here, and this is the strain rate", remedy);
            }
            Value::Parameters => {
                let remedy = "take one of its fields, as in `p.name`";
                self.error(expr.span(), "a scalar is needed here, and this is the parameters", remedy);
            }
            Value::Direction(_) => {
                let remedy = "take an invariant of the strain with it, such as `s.I4(p.a)`";
                self.error(expr.span(), "a scalar is needed here, and this is a direction", remedy);
            }
            Value::Array(_) => {
                let remedy = "take a component, as in `p.mu[0]`, or `sum(0..N, |i| p.mu[i])`";
                self.error(expr.span(), "a scalar is needed here, and this is an array", remedy);
            }
        }
        None
    }

    fn integer_as_scalar(&mut self, integer: Integer, expr: &Expr) {
        let (reason, remedy) = match (integer.kind, expr) {
            (IntegerType::Literal, Expr::Lit(_)) => (
                format!("`{}` is an integer, and a real number is needed here", integer.value),
                format!("write `{}.0`", integer.value),
            ),
            (IntegerType::Literal, _) => (
                String::from("this is an integer, and a real number is needed here"),
                String::from("write its numbers with a dot, as in `2.0`"),
            ),
            (IntegerType::Usize | IntegerType::I32, _) => (
                String::from("this is an integer, and a real number is needed here"),
                String::from("convert it, as in `i as f64`"),
            ),
        };
        self.error(expr.span(), reason, remedy);
    }

    /// The value of an expression that has to be a tensor; `None` if an error was noted.
    pub(super) fn tensor(&mut self, expr: &Expr, scope: &Scope) -> Option<TensorValue> {
        match self.expr(expr, scope) {
            Value::Tensor(tensor) => Some(tensor),
            Value::Broken => None,
            other => {
                let reason = format!("a tensor is needed here, and this is {}", other.kind());
                self.error(expr.span(), reason, "the tensors are `s.eps`, `s.E`, `s.C` and `identity()`");
                None
            }
        }
    }

    /// The value of an expression that has to be an integer; `None` if an error was noted.
    pub(super) fn integer(&mut self, expr: &Expr, kind: IntegerType, scope: &Scope) -> Option<i64> {
        let remedy = match kind {
            IntegerType::I32 => "write an integer, as in `x.powi(2)`; for other powers there is `x.powf(1.5)`",
            IntegerType::Usize | IntegerType::Literal => "write an integer literal or a `const N: usize = 3;`",
        };
        match self.expr(expr, scope) {
            Value::Integer(integer) if integer.kind == kind || integer.kind == IntegerType::Literal => {
                return Some(integer.value);
            }
            Value::Integer(_) => {
                let name = if kind == IntegerType::I32 { "i32" } else { "usize" };
                self.error(
                    expr.span(),
                    format!("an integer of type {name} is needed here"),
                    format!("write `i as {name}`"),
                );
            }
            Value::Broken => {}
            other => {
                let reason = format!("an integer is needed here, and this is {}", other.kind());
                self.error(expr.span(), reason, remedy);
            }
        }
        None
    }

    fn literal(&mut self, literal: &Lit) -> Value {
        let span = literal.span();
        match literal {
            Lit::Float(float) if float.suffix().is_empty() => match literals::exact(float.base10_digits()) {
                Some(value) => Value::Scalar(ScalarValue::number(value, true)),
                None => self.broken(
                    span,
                    format!("the number `{float}` is beyond the 38 digits of an exact constant"),
                    "write it with fewer digits or a smaller exponent, or as a product of two numbers",
                ),
            },
            Lit::Int(int) if int.suffix().is_empty() => match int.base10_parse::<i64>() {
                Ok(value) => Value::Integer(Integer { value, kind: IntegerType::Literal }),
                Err(_) => self.broken(
                    span,
                    format!("the integer `{int}` is too large"),
                    "integers are indices, bounds of sums and powers; real numbers have a dot",
                ),
            },
            Lit::Float(_) | Lit::Int(_) => {
                self.broken(span, "a number takes no type suffix", "write `2.0` for a real number, `2` for an integer")
            }
            // `syn::Lit` may grow: texts, characters and whatever else is not a number.
            _ => self.broken(span, "this is not a number", "a law computes with numbers only"),
        }
    }

    fn name(&mut self, name: &str, span: Span, scope: &Scope) -> Value {
        if let Some((_, value)) = scope.iter().rev().find(|(known, _)| known == name) {
            let value = value.clone();
            if self.in_domain && words::STRAIN.contains(&name) {
                self.measured(name, span);
            }
            return value;
        }
        if let Some(value) = self.constants.get(name) {
            return value.clone();
        }
        if self.functions.contains_key(name) || words::function(name).is_some() {
            return self.broken(span, format!("`{name}` is a function"), format!("call it: `{name}(..)`"));
        }
        let known: Vec<String> =
            scope.iter().map(|(name, _)| name).chain(self.constants.keys()).map(String::clone).collect();
        let offered: Vec<&str> = known.iter().map(String::as_str).collect();
        let remedy = words::suggest(name, &offered, "the names known here are");
        self.broken(span, format!("unknown name `{name}`"), remedy)
    }

    fn field(&mut self, field: &syn::ExprField, scope: &Scope) -> Value {
        let base = self.expr(&field.base, scope);
        let (name, span) = match &field.member {
            Member::Named(name) => (name.to_string(), name.span()),
            Member::Unnamed(index) => (index.index.to_string(), index.span),
        };
        match base {
            Value::Strain => self.strain_field(&name, span),
            Value::StrainRate => self.rate_field(&name, span),
            Value::Parameters => self.parameter_field(&name, span),
            Value::Broken => Value::Broken,
            other => {
                let remedy = "fields belong to the strain (`s.J`) and the parameters (`p.name`)";
                self.broken(span, format!("{} has no field `{name}`", other.kind()), remedy)
            }
        }
    }

    fn parameter_field(&mut self, name: &str, span: Span) -> Value {
        if let Some(index) = self.parameters.iter().position(|parameter| parameter.name == name) {
            return self.parameter(index);
        }
        let offered: Vec<&str> = self.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        let remedy = words::suggest(name, &offered, "the parameters are");
        self.broken(span, format!("there is no parameter `{name}`"), remedy)
    }

    /// Parameter number `index`, a scalar, an array or a direction.
    pub(super) fn parameter(&self, index: usize) -> Value {
        if self.parameters[index].direction {
            return Value::Direction(index);
        }
        // `[f64; 1]` is refused: a longer length means an array.
        if self.parameters[index].len > 1 { Value::Array(index) } else { Value::Scalar(self.component(index, 0)) }
    }

    /// A component of a parameter.
    fn component(&self, parameter: usize, component: usize) -> ScalarValue {
        let Parameter { unit, range: (low, high), .. } = &self.parameters[parameter];
        let values = Values::of(Interval::new(*low, *high));
        let dimension = (!self.unknown_units.contains(&parameter)).then(|| Dimension::of(unit));
        ScalarValue::leaf(ScalarNode::Parameter { parameter, component }, false, dimension, values)
    }

    fn index(&mut self, index: &syn::ExprIndex, scope: &Scope) -> Value {
        let base = self.expr(&index.expr, scope);
        let component = self.integer(&index.index, IntegerType::Usize, scope);
        match (base, component) {
            (Value::Array(parameter), Some(component)) => {
                let Parameter { name, len, .. } = &self.parameters[parameter];
                match usize::try_from(component) {
                    Ok(component) if component < *len => Value::Scalar(self.component(parameter, component)),
                    _ => {
                        let reason = format!("`{name}` has no component {component}");
                        let remedy = format!("its components are 0 to {}", len - 1);
                        self.broken(index.index.span(), reason, remedy)
                    }
                }
            }
            (Value::Array(_) | Value::Broken, _) => Value::Broken,
            (other, _) => {
                let reason = format!("{} has no components", other.kind());
                self.broken(index.span(), reason, "only array parameters do, as in `p.mu[0]`")
            }
        }
    }

    fn cast(&mut self, cast: &syn::ExprCast, scope: &Scope) -> Value {
        let value = self.expr(&cast.expr, scope);
        let target = super::metadata::type_name(&cast.ty).unwrap_or_default();
        match (value, target.as_str()) {
            (Value::Broken, _) => Value::Broken,
            (Value::Integer(integer), "f64") => {
                Value::Scalar(ScalarValue::number(num_rational::Ratio::from_integer(i128::from(integer.value)), false))
            }
            (Value::Integer(Integer { value, .. }), "i32") => Value::Integer(Integer { value, kind: IntegerType::I32 }),
            (Value::Integer(Integer { value, .. }), "usize") => {
                Value::Integer(Integer { value, kind: IntegerType::Usize })
            }
            (Value::Integer(_), _) => {
                self.broken(cast.ty.span(), "unknown type after `as`", "write `as f64`, or `as i32` for a power")
            }
            (other, _) => {
                let reason = format!("`as` converts integers, and this is {}", other.kind());
                self.broken(cast.expr.span(), reason, "remove the `as`")
            }
        }
    }
}

//! Calls: built-in functions, methods of scalars, sums, and helper functions of the law file.

use std::rc::Rc;

use proc_macro2::Span;
use syn::punctuated::Punctuated;
use syn::spanned::Spanned;
use syn::{BinOp, Expr, ExprCall, ExprMethodCall, RangeLimits, Token};

use super::ast::{ScalarNode, TensorNode};
use super::dimension::Dimension;
use super::expr::{Lowering, Scope};
use super::functions::{ArgumentType, is_dissipation, is_energy, plain_name};
use super::interval::{Interval, Values};
use super::rate::rate;
use super::value::{Integer, IntegerType, ScalarValue, TensorValue, Value};
use super::words;

/// Terms that one sum may have.
const MAX_TERMS: i64 = 64;

const FIELDS: &str = "a domain takes the strain's fields:";

type Arguments = Punctuated<Expr, Token![,]>;

impl Lowering<'_> {
    /// `name(a, b, ..)`.
    pub(super) fn call(&mut self, call: &ExprCall, scope: &Scope) -> Value {
        let name = match &*call.func {
            Expr::Path(path) => path.path.get_ident(),
            _ => None,
        };
        let Some(name) = name else {
            let remedy = "write `name(..)` with the plain name of a function";
            return self.broken(call.func.span(), "only functions are called, by their plain name", remedy);
        };
        let (name, span) = (name.to_string(), name.span());
        if scope.iter().any(|(known, _)| *known == name) || self.constants.contains_key(&name) {
            let remedy = "write `*` for a product, or give the `let` another name";
            return self.broken(span, format!("`{name}` is a value here, not a function"), remedy);
        }
        if self.functions.contains_key(&name) {
            return self.helper(&name, span, &call.args, scope);
        }
        match words::function(&name) {
            Some(usage) if call.args.len() == words::arity(usage) => self.builtin(&name, span, &call.args, scope),
            Some(usage) => self.wrong_count(&name, span, usage, words::arity(usage), call.args.len()),
            None if words::fibre_remedy(&name).is_some() => {
                let remedy = words::fibre_remedy(&name).unwrap_or_default();
                // The domain is written without `s.` and `p.`: it has the strain's fields only.
                let remedy = if self.stack.is_empty() { words::suggest("", words::STRAIN, FIELDS) } else { remedy };
                self.broken(span, format!("`{name}` is no function by itself"), remedy)
            }
            None if let Some(remedy) = words::stretch_remedy(&name) => {
                self.broken(span, format!("unknown function `{name}`"), remedy)
            }
            None => {
                let own: Vec<String> = self.functions.keys().map(|name| format!("{name}(..)")).collect();
                let density = |name: &str| is_energy(name) || is_dissipation(name);
                let own = own.iter().map(String::as_str).filter(|usage| !density(words::bare(usage)));
                let offered: Vec<&str> = words::FUNCTIONS.iter().copied().chain(own).collect();
                let remedy = words::suggest(&name, &offered, "the functions are");
                self.broken(span, format!("unknown function `{name}`"), remedy)
            }
        }
    }

    pub(super) fn wrong_count(&mut self, name: &str, span: Span, usage: &str, expected: usize, found: usize) -> Value {
        let plural = if expected == 1 { "" } else { "s" };
        let reason = format!("`{name}` takes {expected} argument{plural}, and here it is given {found}");
        self.broken(span, reason, format!("write `{usage}`"))
    }

    /// A function of the law file.
    fn helper(&mut self, name: &str, span: Span, arguments: &Arguments, scope: &Scope) -> Value {
        if is_energy(name) || is_dissipation(name) {
            let what = if is_energy(name) { "energy" } else { "dissipation" };
            let remedy = "move what they share into a helper function";
            return self.broken(span, format!("`{name}` is the {what} itself, and is not called"), remedy);
        }
        let expected = self.functions.get(name).and_then(|function| function.arguments.clone());
        let Some(expected) = expected else {
            self.called.insert(name.to_owned());
            return Value::Broken;
        };
        if expected.len() != arguments.len() {
            self.called.insert(name.to_owned());
            let names: Vec<&str> = expected.iter().map(|argument| argument.name.as_str()).collect();
            let usage = format!("{name}({})", names.join(", "));
            return self.wrong_count(name, span, &usage, expected.len(), arguments.len());
        }
        let mut values = Vec::new();
        for (argument, expr) in expected.iter().zip(arguments) {
            let value = self.expr(expr, scope);
            values.push(match (argument.kind, value) {
                (_, Value::Broken) => Value::Broken,
                (ArgumentType::Strain, Value::Strain) => Value::Strain,
                (ArgumentType::StrainRate, Value::StrainRate) => Value::StrainRate,
                (ArgumentType::Parameters, Value::Parameters) => Value::Parameters,
                // The argument's declared f64 gives a literal its type.
                (ArgumentType::Scalar, value) => self
                    .as_scalar(value, expr)
                    .map_or(Value::Broken, |value| Value::Scalar(ScalarValue { untyped: false, ..value })),
                (kind, other) => {
                    let wanted = match kind {
                        ArgumentType::Strain => "Strain",
                        ArgumentType::StrainRate => "StrainRate",
                        ArgumentType::Parameters | ArgumentType::Scalar => "Parameters",
                    };
                    let reason = format!("`{}` of `{name}` is a {wanted}, and this is {}", argument.name, other.kind());
                    self.broken(expr.span(), reason, "pass the argument of the energy function itself")
                }
            });
        }
        self.inline(name, values, span)
    }

    /// A built-in function, with the right number of arguments.
    fn builtin(&mut self, name: &str, span: Span, arguments: &Arguments, scope: &Scope) -> Value {
        let scalars = |law: &mut Self| -> Option<Vec<ScalarValue>> {
            let values: Vec<_> = arguments.iter().map(|argument| law.scalar(argument, scope)).collect();
            values.into_iter().collect()
        };
        match name {
            "powi" => self.powi(&arguments[0], &arguments[1], scope),
            "powf" => self.powf(&arguments[0], &arguments[1], scope),
            "select" => self.select(arguments, scope),
            "sum" => self.sum(arguments, scope),
            "identity" => Value::Tensor(TensorValue::leaf(TensorNode::Identity)),
            "tr" | "det" => match self.tensor(&arguments[0], scope) {
                Some(a) if name == "tr" => Value::Scalar(a.trace()),
                Some(a) => Value::Scalar(a.det()),
                None => Value::Broken,
            },
            "ddot" => {
                let (a, b) = (self.tensor(&arguments[0], scope), self.tensor(&arguments[1], scope));
                a.zip(b).map_or(Value::Broken, |(a, b)| Value::Scalar(a.ddot(&b)))
            }
            _ => match scalars(self) {
                Some(values) => {
                    let places: Vec<Span> = arguments.iter().map(Spanned::span).collect();
                    self.scalar_function(name, span, &values, &places)
                }
                None => Value::Broken,
            },
        }
    }

    /// A function of scalars alone. `span` is the call's place, `places` are those of its arguments.
    fn scalar_function(&mut self, name: &str, span: Span, values: &[ScalarValue], places: &[Span]) -> Value {
        let number = ScalarValue::whole;
        let first = places[0];
        match (name, values) {
            ("ln" | "exp", [x]) => self.pure(&format!("`{name}` takes"), x.facts.dimension, first),
            ("shear_modulus" | "lame_lambda" | "bulk_modulus", [_, poisson]) => {
                self.pure(&format!("the second argument of `{name}` is"), poisson.facts.dimension, places[1]);
            }
            _ => {}
        }
        let value = match (name, values) {
            ("ln" | "sqrt", [x]) if x.is_non_positive() => {
                let reason = format!("`{name}` of a constant that is not positive");
                return self.broken(first, reason, "give it a positive number");
            }
            ("ln", [x]) => {
                self.positive("ln", x, first);
                x.transcendental(ScalarNode::Ln, Interval::ln)
            }
            ("sqrt", [x]) => {
                self.positive("sqrt", x, first);
                x.sqrt()
            }
            ("exp", [x]) => x.transcendental(ScalarNode::Exp, Interval::exp),
            ("pos", [x]) => x.pos(),
            // mu = E / (2 (1 + nu))
            ("shear_modulus", [young, poisson]) => {
                let divisor = number(2).mul(&number(1).add(poisson));
                return self.modulus(name, span, young, &divisor);
            }
            // lambda = E nu / ((1 + nu) (1 - 2 nu))
            ("lame_lambda", [young, poisson]) => {
                let divisor = number(1).add(poisson).mul(&number(1).sub(&number(2).mul(poisson)));
                return self.modulus(name, span, &young.mul(poisson), &divisor);
            }
            // K = E / (3 (1 - 2 nu))
            ("bulk_modulus", [young, poisson]) => {
                let divisor = number(3).mul(&number(1).sub(&number(2).mul(poisson)));
                return self.modulus(name, span, young, &divisor);
            }
            _ => return self.broken(span, format!("unknown function `{name}`"), "see laws/README.md"),
        };
        Value::Scalar(value)
    }

    fn modulus(&mut self, name: &str, span: Span, over: &ScalarValue, under: &ScalarValue) -> Value {
        if under.is_zero() {
            let reason = format!("`{name}` is infinite for this Poisson's ratio");
            return self.broken(span, reason, "give it a ratio above -1 and below 0.5");
        }
        Value::Scalar(over.div(under))
    }

    /// `x.name(..)`.
    pub(super) fn method(&mut self, call: &ExprMethodCall, scope: &Scope) -> Value {
        let (name, span) = (call.method.to_string(), call.method.span());
        let receiver = match self.expr(&call.receiver, scope) {
            Value::Scalar(scalar) => scalar,
            Value::Broken => return Value::Broken,
            Value::Strain if name == "stretch_sum" => return self.stretch_sum(call, scope),
            Value::StrainRate if name == "stretch_sum" => return rate(self.stretch_sum(call, scope)),
            Value::StrainRate => {
                if let Some(usage) = words::fibre_invariant(&name) {
                    return rate(self.fibre_invariant(usage, call, scope));
                }
                let remedy = if words::STRAIN.contains(&name.as_str()) {
                    format!("write `r.{name}` without the brackets")
                } else {
                    words::suggest(&name, words::STRAIN, "take a field of it:")
                };
                return self.broken(span, format!("the strain rate has no method `{name}`"), remedy);
            }
            Value::Strain => {
                if let Some(usage) = words::fibre_invariant(&name) {
                    return self.fibre_invariant(usage, call, scope);
                }
                let remedy = if let Some(remedy) = words::stretch_remedy(&name) {
                    remedy.to_owned()
                } else if words::STRAIN.contains(&name.as_str()) {
                    format!("write `s.{name}` without the brackets")
                } else {
                    let fields = words::suggest(&name, words::STRAIN, "take a field of it:");
                    words::fibre_remedy(&name).unwrap_or(fields)
                };
                let reason = format!("the strain has no method `{name}`");
                return self.broken(span, reason, remedy);
            }
            Value::Parameters => {
                let remedy = "write `p.name` without brackets, and `*` for a product";
                return self.broken(span, "the parameters have fields, not methods", remedy);
            }
            Value::Tensor(_) => {
                let remedy = "the functions of tensors are `tr(A)`, `ddot(A, B)` and `det(A)`";
                return self.broken(span, "a tensor has no methods", remedy);
            }
            other => {
                self.as_scalar(other, &call.receiver);
                return Value::Broken;
            }
        };
        let Some(usage) = words::METHODS.iter().copied().find(|usage| words::bare(usage) == name) else {
            let offered: Vec<&str> = words::METHODS.to_vec();
            let remedy = words::suggest(&name, &offered, "the methods of a scalar are");
            return self.broken(span, format!("a scalar has no method `{name}`"), remedy);
        };
        if let Some(turbofish) = &call.turbofish {
            return self.broken(turbofish.span(), "methods of a law have no generics", format!("write `x.{usage}`"));
        }
        if receiver.untyped {
            let reason = "rustc calls no method on a number whose type is not declared";
            return self.broken(call.receiver.span(), reason, format!("write `{name}(..)` as a function"));
        }
        if call.args.len() != words::arity(usage) {
            return self.wrong_count(&name, span, &format!("x.{usage}"), words::arity(usage), call.args.len());
        }
        match name.as_str() {
            "powi" => {
                let power = self.integer(&call.args[0], IntegerType::I32, scope);
                self.integer_power(Some(receiver), power, call.receiver.span(), call.args[0].span())
            }
            "powf" => {
                let power = self.scalar(&call.args[0], scope);
                self.real_power(Some(receiver), power, call.receiver.span(), call.args[0].span())
            }
            _ => self.scalar_function(&name, span, &[receiver], &[call.receiver.span()]),
        }
    }

    /// `s.stretch_sum(a)`.
    fn stretch_sum(&mut self, call: &ExprMethodCall, scope: &Scope) -> Value {
        let (name, usage) = ("stretch_sum", words::STRAIN_METHODS[0]);
        if let Some(turbofish) = &call.turbofish {
            return self.broken(turbofish.span(), "methods of a law have no generics", format!("write `s.{usage}`"));
        }
        if call.args.len() != words::arity(usage) {
            let usage = format!("s.{usage}");
            return self.wrong_count(name, call.method.span(), &usage, 1, call.args.len());
        }
        let span = call.args[0].span();
        let Some(exponent) = self.scalar(&call.args[0], scope) else { return Value::Broken };
        if exponent.facts.strain {
            let remedy = "give it a number, or an expression in the parameters";
            return self.broken(span, "the exponent of `stretch_sum` depends on the strain", remedy);
        }
        if exponent.is_zero() {
            let reason = "the exponent of `stretch_sum` is zero: the sum is 3, whatever the strain";
            return self.broken(span, reason, "write the number 3.0, or another exponent");
        }
        self.pure("the exponent of `stretch_sum` is", exponent.facts.dimension, span);
        let node = ScalarNode::StretchSum(Rc::clone(&exponent.node));
        let mut value = ScalarValue::over(node, &[exponent.facts], Some(Dimension::ONE), Values::of_stretch_sum());
        value.facts.strain = true;
        Value::Scalar(value)
    }

    /// `select(a > b, x, y)`, for all four comparisons by the one that the tree has.
    fn select(&mut self, arguments: &Arguments, scope: &Scope) -> Value {
        let mut condition = &arguments[0];
        while let Expr::Paren(inner) = condition {
            condition = &inner.expr;
        }
        let comparison = match condition {
            Expr::Binary(b) if is_comparison(&b.op) => Some(b),
            _ => None,
        };
        let Some(comparison) = comparison else {
            let remedy = "write `select(a > b, x, y)`: x where a > b, y elsewhere";
            return self.broken(condition.span(), "the first argument of `select` is a comparison", remedy);
        };
        let a = self.scalar(&comparison.left, scope);
        let b = self.scalar(&comparison.right, scope);
        let x = self.scalar(&arguments[1], scope);
        let y = self.scalar(&arguments[2], scope);
        let (Some(a), Some(b), Some(x), Some(y)) = (a, b, x, y) else { return Value::Broken };
        self.same("what it is compared with", a.facts.dimension, b.facts.dimension, comparison.right.span());
        let fits = self.same("the other branch", x.facts.dimension, y.facts.dimension, arguments[2].span());
        let selected = match comparison.op {
            BinOp::Lt(_) => ScalarValue::select(&b, &a, &x, &y),
            // a >= b is not b > a.
            BinOp::Ge(_) => ScalarValue::select(&b, &a, &y, &x),
            BinOp::Le(_) => ScalarValue::select(&a, &b, &y, &x),
            _ => ScalarValue::select(&a, &b, &x, &y),
        };
        Value::Scalar(if fits { selected } else { selected.of_any_dimension() })
    }

    /// `sum(0..N, |i| term)`, written out.
    fn sum(&mut self, arguments: &Arguments, scope: &Scope) -> Value {
        let remedy = "write `sum(0..N, |i| ..)`, with N a literal or a constant";
        let Expr::Range(range) = &arguments[0] else {
            return self.broken(arguments[0].span(), "the first argument of `sum` is a range", remedy);
        };
        let (Some(start), Some(end), RangeLimits::HalfOpen(_)) = (&range.start, &range.end, range.limits) else {
            return self.broken(range.span(), "the range of `sum` has a start and an excluded end", remedy);
        };
        let closure = match &arguments[1] {
            Expr::Closure(closure) if closure.inputs.len() == 1 && closure.lifetimes.is_none() => Some(closure),
            _ => None,
        };
        let index = closure.and_then(|closure| plain_name(&closure.inputs[0]));
        let Some((closure, (name, span))) = closure.zip(index) else {
            return self.broken(arguments[1].span(), "the second argument of `sum` is a closure `|i| ..`", remedy);
        };
        if !matches!(closure.output, syn::ReturnType::Default) {
            return self.broken(closure.output.span(), "the closure of `sum` declares no type", remedy);
        }
        self.fresh(&name, span, scope);
        let start = self.integer(start, IntegerType::Usize, scope);
        let end = self.integer(end, IntegerType::Usize, scope);
        let Some((start, end)) = start.zip(end) else { return Value::Broken };
        match end.checked_sub(start) {
            Some(terms) if start >= 0 && (1..=MAX_TERMS).contains(&terms) => {}
            _ => {
                let reason = format!("the range {start}..{end} of `sum` does not have 1 to {MAX_TERMS} terms");
                return self.broken(range.span(), reason, remedy);
            }
        }
        let body = closure.body.span();
        let mut total: Option<ScalarValue> = None;
        for value in start..end {
            let mut inner = scope.clone();
            inner.push((name.clone(), Value::Integer(Integer { value, kind: IntegerType::Usize })));
            let Some(term) = self.scalar(&closure.body, &inner) else { return Value::Broken };
            if let Some(total) = &total
                && !self.same("the sum of the terms before it", total.facts.dimension, term.facts.dimension, body)
            {
                return Value::Broken;
            }
            total = Some(total.map_or_else(|| term.clone(), |total| total.add(&term)));
        }
        // The declared result type of `sum` gives literals their type.
        total.map_or(Value::Broken, |total| Value::Scalar(ScalarValue { untyped: false, ..total }))
    }
}

/// Whether the operator is one of the four comparisons that `select` takes.
pub(super) fn is_comparison(op: &BinOp) -> bool {
    matches!(op, BinOp::Lt(_) | BinOp::Gt(_) | BinOp::Le(_) | BinOp::Ge(_))
}

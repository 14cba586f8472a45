//! Functions of a law file: their signatures, and their bodies written out where they are called.

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::{Block, Expr, FnArg, ItemFn, Pat, ReturnType, Stmt};

use super::error::{LawError, Source};
use super::expr::{Lowering, Scope};
use super::metadata::type_name;
use super::value::{ScalarValue, Value};

/// The type of an argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ArgumentType {
    Scalar,
    Strain,
    StrainRate,
    Parameters,
}

/// An argument of a function.
#[derive(Debug, Clone)]
pub(super) struct Argument {
    pub(super) name: String,
    pub(super) span: Span,
    pub(super) kind: ArgumentType,
}

/// A function of the law file.
#[derive(Debug, Clone)]
pub(super) struct Function<'a> {
    pub(super) name: String,
    pub(super) span: Span,
    /// The arguments; `None` if the signature was refused.
    pub(super) arguments: Option<Vec<Argument>>,
    body: &'a Block,
}

impl Function<'_> {
    /// The place of the value with which the body ends.
    pub(super) fn value_place(&self) -> Span {
        self.body.stmts.last().map_or(self.span, Spanned::span)
    }
}

/// The signature that the energy has to have.
pub(super) const ENERGY_SIGNATURE: &str = "(s: Strain, p: Parameters) -> f64";

/// The signature that the dissipation has to have.
pub(super) const DISSIPATION_SIGNATURE: &str = "(s: Strain, r: StrainRate, p: Parameters) -> f64";

/// Whether a function of this name is the energy, or a part of it.
pub(super) fn is_energy(name: &str) -> bool {
    is_part_of("energy_density", name)
}

/// Whether a function of this name is the dissipation, or a part of it.
pub(super) fn is_dissipation(name: &str) -> bool {
    is_part_of("dissipation_density", name)
}

fn is_part_of(whole: &str, name: &str) -> bool {
    let rest = name.strip_prefix(whole);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('_') && rest.len() > 1)
}

impl<'a> Function<'a> {
    /// Reads a signature; what is wrong with it is added to `errors`.
    pub(super) fn new(source: &Source, item: &'a ItemFn, errors: &mut Vec<LawError>) -> Function<'a> {
        let signature = &item.sig;
        let known = errors.len();
        let mut error = |span: Span, reason: &str, remedy: &str| errors.push(source.error(span, reason, remedy));
        for attribute in item.attrs.iter().filter(|attribute| !attribute.path().is_ident("doc")) {
            error(attribute.span(), "a function takes no attribute but `///`", "remove it");
        }
        if let Some(word) = &signature.constness {
            error(word.span, "functions of a law are not `const`", "remove `const`");
        }
        if !signature.generics.params.is_empty() {
            error(signature.generics.span(), "functions of a law have no generics", "arguments are f64");
        }
        if let Some(variadic) = &signature.variadic {
            error(variadic.span(), "functions of a law have a fixed number of arguments", "name every argument");
        }
        let mut arguments: Vec<Argument> = Vec::new();
        for input in &signature.inputs {
            let FnArg::Typed(typed) = input else {
                error(input.span(), "functions of a law have no `self`", "name every argument: `x: f64`");
                continue;
            };
            let name = plain_name(&typed.pat);
            let kind = match type_name(&typed.ty).as_deref() {
                Some("f64") => Some(ArgumentType::Scalar),
                Some("Strain") => Some(ArgumentType::Strain),
                Some("StrainRate") => Some(ArgumentType::StrainRate),
                Some("Parameters") => Some(ArgumentType::Parameters),
                _ => None,
            };
            match (name, kind) {
                (None, _) => error(typed.pat.span(), "an argument is a plain name", "write `x: f64`"),
                (_, None) => {
                    let reason = "unknown type of an argument";
                    error(typed.ty.span(), reason, "the types are f64, Strain, StrainRate and Parameters");
                }
                (Some((name, span)), Some(_)) if arguments.iter().any(|known| known.name == name) => {
                    error(span, "two arguments have this name", "give each argument its own name");
                }
                (Some((name, span)), Some(kind)) => arguments.push(Argument { name, span, kind }),
            }
        }
        let returns_scalar = match &signature.output {
            ReturnType::Type(_, ty) => type_name(ty).as_deref() == Some("f64"),
            ReturnType::Default => false,
        };
        if !returns_scalar {
            error(signature.ident.span(), "a function of a law returns f64", "write `-> f64` after its arguments");
        }
        let arguments = (errors.len() == known).then_some(arguments);
        Function { name: signature.ident.to_string(), span: signature.ident.span(), arguments, body: &item.block }
    }
}

/// The name that a pattern binds, if it is a plain one.
pub(super) fn plain_name(pattern: &Pat) -> Option<(String, Span)> {
    match pattern {
        Pat::Ident(pattern) if pattern.by_ref.is_none() && pattern.mutability.is_none() && pattern.subpat.is_none() => {
            Some((pattern.ident.to_string(), pattern.ident.span()))
        }
        _ => None,
    }
}

impl Lowering<'_> {
    /// The value of function `name` with its arguments bound; at `span` it is called.
    pub(super) fn inline(&mut self, name: &str, arguments: Vec<Value>, span: Span) -> Value {
        self.called.insert(name.to_owned());
        if self.stack.iter().any(|active| active == name) {
            let reason = format!("the function `{name}` calls itself");
            return self.broken(span, reason, "write the formula out: a law has no recursion");
        }
        let Some(function) = self.functions.get(name).cloned() else { return Value::Broken };
        let Some(expected) = function.arguments else { return Value::Broken };
        let names = expected.into_iter().map(|argument| argument.name);
        let scope: Scope = names.zip(arguments).collect();
        self.stack.push(name.to_owned());
        let value = self.body(function.body, function.span, scope);
        self.stack.pop();
        value
    }

    /// The value of a function's body: `let`s, then an expression.
    fn body(&mut self, body: &Block, function: Span, mut scope: Scope) -> Value {
        let mut value = None;
        for (i, statement) in body.stmts.iter().enumerate() {
            let last = i + 1 == body.stmts.len();
            match statement {
                Stmt::Local(local) => self.binding(local, &mut scope),
                Stmt::Expr(expr, None) if last => value = Some(self.result(expr, &scope)),
                Stmt::Expr(Expr::Assign(assign), _) => {
                    self.expr(&Expr::Assign(assign.clone()), &scope);
                    value = Some(Value::Broken);
                }
                Stmt::Expr(expr, semicolon) => {
                    let known = self.errors.len();
                    self.expr(expr, &scope);
                    if self.errors.len() > known {
                        value = Some(Value::Broken);
                    } else if last && semicolon.is_some() {
                        let remedy = "remove the `;` after its last expression";
                        self.error(semicolon.span(), "the function ends without a value", remedy);
                        value = Some(Value::Broken);
                    } else {
                        self.error(expr.span(), "this value is not used", "remove it, or name it by `let`");
                    }
                }
                Stmt::Item(item) => {
                    let remedy = "move it out of the function";
                    self.error(item.span(), "a function's body holds `let`s and an expression only", remedy);
                }
                Stmt::Macro(stmt) => {
                    self.error(stmt.span(), "laws have no macros", "write the formula out");
                    value = Some(Value::Broken);
                }
            }
        }
        match value {
            Some(value) => value,
            None => {
                self.broken(function, "the function ends without a value", "end it with an expression, without `;`")
            }
        }
    }

    fn result(&mut self, expr: &Expr, scope: &Scope) -> Value {
        self.scalar(expr, scope).map_or(Value::Broken, |value| {
            // The declared `-> f64` gives a literal its type.
            Value::Scalar(ScalarValue { untyped: false, ..value })
        })
    }

    /// `let name = value;` or `let name: f64 = value;`.
    fn binding(&mut self, local: &syn::Local, scope: &mut Scope) {
        let (pattern, declared) = match &local.pat {
            Pat::Type(typed) => (&*typed.pat, Some(&*typed.ty)),
            pattern => (pattern, None),
        };
        if let Some(ty) = declared.filter(|ty| type_name(ty).as_deref() != Some("f64")) {
            self.error(ty.span(), "the only type that a `let` declares is f64", "write `: f64`, or leave the type out");
        }
        let Some((name, span)) = plain_name(pattern) else {
            self.error(pattern.span(), "a `let` gives one plain name", "write `let x = ..;`");
            return;
        };
        let Some(init) = &local.init else {
            self.error(span, format!("`{name}` has no value"), format!("write `let {name} = ..;`"));
            scope.push((name, Value::Broken));
            return;
        };
        self.fresh(&name, span, scope);
        let value = match self.expr(&init.expr, scope) {
            Value::Scalar(scalar) => Value::Scalar(scalar.named(&name, declared.is_none())),
            Value::Tensor(_) if declared.is_some() => {
                let remedy = "leave the type out";
                self.broken(init.expr.span(), "this is a tensor, and the `let` declares f64", remedy)
            }
            value @ (Value::Tensor(_) | Value::Broken) => value,
            other => {
                // Says what the value is, and what to take of it.
                self.as_scalar(other, &init.expr);
                Value::Broken
            }
        };
        scope.push((name, value));
    }

    /// Refuses a name that is taken where it would be bound.
    pub(super) fn fresh(&mut self, name: &str, span: Span, scope: &Scope) {
        if scope.iter().any(|(known, _)| known == name) || self.constants.contains_key(name) {
            let reason = format!("the name `{name}` is taken");
            self.error(span, reason, "choose another: one name means one value in a function");
        }
    }
}

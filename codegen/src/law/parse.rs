//! From the text of a law file to a checked [`Law`].

use std::collections::BTreeSet;
use std::path::Path;

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::{Expr, Item, ItemConst};

use super::ast::{Domain, Law, Scalar};
use super::error::{LawError, Place, Source};
use super::expr::{Lowering, Scope};
use super::functions::{ArgumentType, ENERGY_SIGNATURE, Function, is_dissipation, is_energy};
use super::metadata::{self, Metadata, type_name};
use super::strain::strain;
use super::uses::unused;
use super::value::{Integer, IntegerType, ScalarValue, Value};
use super::{brackets, calls, limits, words};

/// Characters of a law file: a hundred times what a law needs.
const MAX_SIZE: usize = 256 * 1024;

const START: Place = Place { line: 1, column: 1 };
const ENERGY: &str = "energy_density";
const SHAPE: &str = "a law file holds `struct Parameters`, functions and constants only";

/// Parses and checks the law file `text`; `path` names it in messages, and its stem names the law.
///
/// # Errors
/// Everything that is wrong with the file, by position. Never panics, whatever the text.
pub fn parse(path: &str, text: &str) -> Result<Law, Vec<LawError>> {
    let source = Source { path, text };
    let name = stem(&source)?;
    if text.len() > MAX_SIZE {
        let reason = format!("the file is longer than {MAX_SIZE} bytes");
        return Err(vec![source.error(START, reason, "a law is a page of text: is this the right file?")]);
    }
    brackets::check(&source).map_err(|error| vec![error])?;
    let refused = match text.parse() {
        Ok(tokens) => limits::check(&source, tokens),
        Err(error) => vec![not_rust(&source, &syn::Error::from(error))],
    };
    if !refused.is_empty() {
        return Err(sorted(refused));
    }
    let file = syn::parse_file(text).map_err(|error| vec![not_rust(&source, &error)])?;
    let mut errors = Vec::new();
    let docs = metadata::docs(&file.attrs);
    if docs.is_empty() {
        let remedy = "begin the file with `//!`: what the law is, and its source (book or DOI, equation)";
        errors.push(source.error(START, "the law has no doc comment", remedy));
    }
    for attribute in file.attrs.iter().filter(|attribute| !attribute.path().is_ident("doc")) {
        errors.push(source.error(attribute.span(), "a law file takes no attribute but `//!`", "remove it"));
    }
    let items = Items::sort(&source, &file.items, &mut errors);
    let metadata = items.metadata.unwrap_or_default();
    let mut lowering = Lowering::new(source, &metadata);
    lowering.errors = errors;
    for function in items.functions {
        lowering.functions.insert(function.name.clone(), function);
    }
    for constant in items.constants {
        lowering.constant(constant);
    }
    lowering.arguments();
    let energy = lowering.energy(items.has_parameters);
    let dissipation = lowering.dissipation(items.has_parameters);
    let domain = metadata.domain.as_ref().and_then(|(expr, span)| lowering.domain(expr, *span));
    if lowering.errors.is_empty()
        && let Some((energy, parts)) = &energy
    {
        lowering.uncalled();
        if let Some(place) = metadata.small_strain.filter(|_| !lowering.uses_eps) {
            let reason = "the law says `small_strain`, and does not use `eps`";
            lowering.error(place, reason, "remove the attribute: the law does not change under rotation");
        }
        let others: Vec<&Scalar> = parts.iter().map(|(_, part)| part).chain(&dissipation).collect();
        let unused = unused(&source, &metadata, energy, &others, domain.as_ref());
        lowering.errors.extend(unused);
    }
    let moduli = metadata.moduli.as_ref().and_then(|given| lowering.moduli(given));
    let places = std::mem::take(&mut lowering.places);
    let errors = lowering.errors;
    match energy {
        Some((energy, parts)) if errors.is_empty() => {
            let (path, text) = (path.to_owned(), text.to_owned());
            let small_strain = metadata.small_strain.is_some();
            let (parameters, acceptances) = (metadata.parameters, metadata.acceptances);
            Ok(Law {
                name,
                path,
                text,
                docs,
                parameters,
                domain,
                small_strain,
                energy,
                parts,
                acceptances,
                moduli,
                valid_stretches: metadata.valid_stretches,
                places,
                dissipation,
            })
        }
        _ => Err(sorted(errors)),
    }
}

/// The errors by position, each once: a helper function may be written out, and refused, several times.
fn sorted(mut errors: Vec<LawError>) -> Vec<LawError> {
    errors.sort_by(|a, b| (a.line, a.column, &a.reason).cmp(&(b.line, b.column, &b.reason)));
    errors.dedup();
    errors
}

/// The law's name, from its file's.
fn stem(source: &Source) -> Result<String, Vec<LawError>> {
    let stem = Path::new(source.path).file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let plain = stem.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if plain && stem.starts_with(|c: char| c.is_ascii_lowercase()) && syn::parse_str::<syn::Ident>(stem).is_ok() {
        return Ok(stem.to_owned());
    }
    let reason = format!("the file's name `{stem}` cannot name a law");
    let remedy = "name the file in lower case, digits and `_`, as in `my_law.rs`";
    Err(vec![source.error(START, reason, remedy)])
}

/// What syn refuses.
fn not_rust(source: &Source, error: &syn::Error) -> LawError {
    let remedy = "a law file has Rust's syntax: check the signs at this place";
    source.error(error.span(), format!("this cannot be read: {error}"), remedy)
}

/// A file's items by kind.
struct Items<'a> {
    metadata: Option<Metadata>,
    has_parameters: bool,
    functions: Vec<Function<'a>>,
    constants: Vec<&'a ItemConst>,
}

impl<'a> Items<'a> {
    fn sort(source: &Source, items: &'a [Item], errors: &mut Vec<LawError>) -> Items<'a> {
        let mut sorted = Items { metadata: None, has_parameters: false, functions: Vec::new(), constants: Vec::new() };
        let mut names = BTreeSet::new();
        for item in items {
            match item {
                Item::Struct(item) if item.ident == "Parameters" => {
                    if sorted.has_parameters {
                        let reason = "there are two structs `Parameters`";
                        errors.push(source.error(item.ident.span(), reason, "put all fields into one"));
                    } else {
                        sorted.metadata = Some(metadata::read(source, item, errors));
                    }
                    sorted.has_parameters = true;
                }
                Item::Struct(item) => {
                    let reason = format!("the only struct of a law is `Parameters`, not `{}`", item.ident);
                    errors.push(source.error(item.ident.span(), reason, "make its fields parameters or arguments"));
                }
                Item::Fn(item) => {
                    let function = Function::new(source, item, errors);
                    if taken(source, &function.name, function.span, &mut names, errors) {
                        sorted.functions.push(function);
                    }
                }
                Item::Const(item) => {
                    if taken(source, &item.ident.to_string(), item.ident.span(), &mut names, errors) {
                        sorted.constants.push(item);
                    }
                }
                // `syn::Item` may grow: whatever else there is does not belong to a law.
                item => errors.push(source.error(item.span(), "this does not belong in a law file", SHAPE)),
            }
        }
        if !sorted.has_parameters {
            let remedy = "write `struct Parameters { .. }`, one field a parameter";
            errors.push(source.error(START, "the law has no `struct Parameters`", remedy));
        }
        sorted
    }
}

/// Whether a function's or constant's name is free; if not, an error is noted.
fn taken(source: &Source, name: &str, span: Span, names: &mut BTreeSet<String>, errors: &mut Vec<LawError>) -> bool {
    if words::function(name).is_some() {
        let reason = format!("`{name}` is a function of the law language");
        errors.push(source.error(span, reason, "choose another name"));
        return false;
    }
    if !names.insert(name.to_owned()) {
        let reason = format!("the name `{name}` is given twice");
        errors.push(source.error(span, reason, "rename one of them"));
        return false;
    }
    true
}

impl Lowering<'_> {
    /// `const NAME: f64 = ..;` or `const N: usize = 3;`.
    fn constant(&mut self, item: &ItemConst) {
        for attribute in item.attrs.iter().filter(|attribute| !attribute.path().is_ident("doc")) {
            self.error(attribute.span(), "a constant takes no attribute but `///`", "remove it");
        }
        if !item.generics.params.is_empty() {
            self.error(item.generics.span(), "constants have no generics", "remove them");
        }
        let nothing = Scope::new();
        let value = match type_name(&item.ty).as_deref() {
            Some("f64") => self.scalar(&item.expr, &nothing).map(|value| {
                if let Some(place) = first_call(&item.expr) {
                    let remedy = "write the number, or move the formula into a function";
                    self.error(place, "a constant is arithmetic on numbers, without calls", remedy);
                }
                Value::Scalar(ScalarValue { untyped: false, ..value })
            }),
            Some("usize") => {
                let value = self.integer(&item.expr, IntegerType::Usize, &nothing);
                value.map(|value| Value::Integer(Integer { value, kind: IntegerType::Usize }))
            }
            _ => {
                let remedy = "write `const NAME: f64 = 2.0;`, or `const N: usize = 3;` for a length";
                Some(self.broken(item.ty.span(), "a constant is an f64 or a usize", remedy))
            }
        };
        self.constants.insert(item.ident.to_string(), value.unwrap_or(Value::Broken));
    }

    /// Refuses arguments that have a constant's name: rustc would read them as patterns.
    fn arguments(&mut self) {
        let arguments = self.functions.values().flat_map(|function| function.arguments.iter().flatten());
        let arguments: Vec<(String, Span)> = arguments.map(|argument| (argument.name.clone(), argument.span)).collect();
        for (name, span) in arguments {
            self.fresh(&name, span, &Scope::new());
        }
    }

    /// W and its parts; `None` if an error was noted.
    fn energy(&mut self, has_parameters: bool) -> Option<(Scalar, Vec<(String, Scalar)>)> {
        let functions = self.densities(is_energy);
        if functions.is_empty() {
            let names: Vec<&str> = self.functions.keys().map(String::as_str).collect();
            let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            let reason = format!("the law has no `fn {ENERGY}`");
            let remedy =
                format!("write `fn {ENERGY}{ENERGY_SIGNATURE}`, the energy density W; the functions here are: {found}");
            self.errors.push(self.source.error(START, reason, remedy));
            return None;
        }
        if functions.len() > 1
            && let Some((_, span)) = functions.iter().find(|(name, _)| name == ENERGY)
        {
            let reason = format!("the law has both `{ENERGY}` and parts of it");
            self.error(*span, reason, "keep one or the other: the parts' sum is W");
            return None;
        }
        let mut parts = Vec::new();
        for (name, span) in functions {
            match self.part(&name, span, has_parameters) {
                Some(value) => parts.push((name, value)),
                None => continue,
            }
        }
        let total = parts.iter().map(|(_, part)| part.clone()).reduce(|total, part| total.add(&part))?;
        if parts.len() == 1 && parts[0].0 == ENERGY {
            parts.clear();
        }
        Some((total.node, parts.into_iter().map(|(name, value)| (name, value.node)).collect()))
    }

    /// The functions of these names, in the order of the file, which is the order of their sum.
    pub(super) fn densities(&self, named: fn(&str) -> bool) -> Vec<(String, Span)> {
        let found = self.functions.values().filter(|function| named(&function.name));
        let mut found: Vec<(String, Span)> = found.map(|function| (function.name.clone(), function.span)).collect();
        found.sort_by_key(|(_, span)| Place::from(*span));
        found
    }

    /// The energy, or one part of it.
    fn part(&mut self, name: &str, span: Span, has_parameters: bool) -> Option<ScalarValue> {
        let arguments = self.functions.get(name)?.arguments.clone()?;
        let kinds: Vec<ArgumentType> = arguments.iter().map(|argument| argument.kind).collect();
        if kinds != [ArgumentType::Strain, ArgumentType::Parameters] {
            let reason = format!("`{name}` takes the strain and the parameters");
            self.error(span, reason, format!("write `fn {name}{ENERGY_SIGNATURE}`"));
            return None;
        }
        if !has_parameters {
            // Reported as missing: every `p.name` would be reported again.
            return None;
        }
        let known = self.errors.len();
        let value = self.inline(name, vec![Value::Strain, Value::Parameters], span);
        let Value::Scalar(value) = value else { return None };
        if self.errors.len() > known {
            return None;
        }
        if !value.facts.strain {
            let remedy = "use fields of the strain, such as `s.I1` or `s.E`: without them there is no force";
            self.error(span, format!("`{name}` does not depend on the strain"), remedy);
            return None;
        }
        let place = self.functions.get(name).map_or(span, Function::value_place);
        // A struct without fields was refused: no energy is in Pa without them.
        if !self.parameters.is_empty() {
            self.energy_dimension(name, value.facts.dimension, place);
        }
        Some(value)
    }

    /// `#[domain(left > right)]`, in the names of the strain and of the parameters.
    fn domain(&mut self, expr: &Expr, span: Span) -> Option<Domain> {
        let remedy = "write `#[domain(J > 0.0)]`: an expression of the strain, `>` or `<`, and a bound";
        let comparison = match expr {
            Expr::Binary(binary) if calls::is_comparison(&binary.op) => binary,
            _ => {
                self.error(span, "`domain` takes a comparison", remedy);
                return None;
            }
        };
        let swapped = match comparison.op {
            syn::BinOp::Gt(_) => false,
            syn::BinOp::Lt(_) => true,
            _ => {
                self.error(comparison.op.span(), "the domain is open: its bound does not belong to it", remedy);
                return None;
            }
        };
        let measures = words::STRAIN.iter().filter_map(|name| Some(((*name).to_owned(), strain(name)?)));
        let parameters = self.parameters.iter().enumerate().map(|(i, p)| (p.name.clone(), self.parameter(i)));
        let scope: Scope = parameters.chain(measures).collect();
        self.in_domain = true;
        let left = self.scalar(&comparison.left, &scope);
        let right = self.scalar(&comparison.right, &scope);
        self.in_domain = false;
        let (left, right) = left.zip(right)?;
        let place = comparison.right.span();
        self.same("what it is compared with", left.facts.dimension, right.facts.dimension, place);
        if !left.facts.strain && !right.facts.strain {
            self.error(span, "the domain does not depend on the strain", remedy);
            return None;
        }
        let text = expr.span().source_text().unwrap_or_else(|| String::from("(domain)"));
        let (left, right) = if swapped { (right, left) } else { (left, right) };
        Some(Domain { text, left: left.node, right: right.node })
    }

    /// Refuses helper functions that are never called: their bodies are checked only where they are written out.
    fn uncalled(&mut self) {
        let functions = self.functions.values();
        let density = |name: &str| is_energy(name) || is_dissipation(name);
        let uncalled = functions.filter(|f| !density(&f.name) && !self.called.contains(&f.name));
        let uncalled: Vec<(String, Span)> = uncalled.map(|f| (f.name.clone(), f.span)).collect();
        for (name, span) in uncalled {
            self.error(span, format!("the function `{name}` is never called"), "call it in the energy, or delete it");
        }
    }
}

/// The first call in a constant's expression: rustc evaluates none there.
fn first_call(expr: &Expr) -> Option<Span> {
    match expr {
        Expr::Call(call) => Some(call.func.span()),
        Expr::MethodCall(call) => Some(call.method.span()),
        Expr::Paren(inner) => first_call(&inner.expr),
        Expr::Unary(inner) => first_call(&inner.expr),
        Expr::Binary(inner) => first_call(&inner.left).or_else(|| first_call(&inner.right)),
        // `syn::Expr` may grow; the others were refused, or hold no expression.
        _ => None,
    }
}

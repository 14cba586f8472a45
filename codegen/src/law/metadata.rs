//! The metadata of a law: doc comments, and `struct Parameters` with its attributes.

use std::collections::BTreeSet;

use proc_macro2::Span;
use syn::punctuated::Punctuated;
use syn::spanned::Spanned;
use syn::{Attribute, Expr, Fields, ItemStruct, Lit, LitStr, Meta, Token, Type, UnOp};

use super::ast::{Acceptance, Parameter};
use super::claims;
use super::error::{LawError, Source};
use super::fibres::{self, Given};
use super::units;
use super::words;

/// Components that an array parameter may have.
const MAX_COMPONENTS: usize = 64;

const ON_STRUCT: &[&str] = &["domain", "small_strain", "small_strain_moduli", "valid_stretches", "accept"];
const ON_FIELD: &[&str] = &["unit", "range", "default", "per_element"];

/// `struct Parameters`, read.
#[derive(Default)]
pub(super) struct Metadata {
    pub(super) parameters: Vec<Parameter>,
    /// The place of each parameter's name.
    pub(super) spans: Vec<Span>,
    /// Parameters whose unit is missing or was refused, by index: they fit any dimension.
    pub(super) unknown_units: BTreeSet<usize>,
    /// The expression of `#[domain(..)]` and its place.
    pub(super) domain: Option<(Expr, Span)>,
    /// Whether there is a `#[domain(..)]`, be it readable or not.
    pub(super) has_domain: bool,
    /// The place of `#[small_strain]`.
    pub(super) small_strain: Option<Span>,
    /// `#[accept(..)]`, each.
    pub(super) acceptances: Vec<Acceptance>,
    /// The arguments of `#[small_strain_moduli(..)]`.
    pub(super) moduli: Option<claims::Given>,
    /// The numbers of `#[valid_stretches(..)]`.
    pub(super) valid_stretches: Option<(f64, f64)>,
}

/// The name of a type that is a plain name.
pub(super) fn type_name(ty: &Type) -> Option<String> {
    match ty {
        Type::Path(path) if path.qself.is_none() => path.path.get_ident().map(ToString::to_string),
        _ => None,
    }
}

/// The text of doc comments, one line a comment, without the space after the slashes.
pub(super) fn docs(attributes: &[Attribute]) -> String {
    let mut text = String::new();
    for attribute in attributes {
        if let Meta::NameValue(meta) = &attribute.meta
            && let Expr::Lit(literal) = &meta.value
            && let (Lit::Str(line), true) = (&literal.lit, meta.path.is_ident("doc"))
        {
            for line in line.value().split('\n') {
                text.push_str(line.strip_prefix(' ').unwrap_or(line).trim_end());
                text.push('\n');
            }
        }
    }
    text.trim().to_owned()
}

/// Reads `struct Parameters`; what is wrong with it is added to `errors`.
pub(super) fn read(source: &Source, item: &ItemStruct, errors: &mut Vec<LawError>) -> Metadata {
    let mut metadata = Metadata::default();
    if !item.generics.params.is_empty() {
        errors.push(source.error(item.generics.span(), "`Parameters` has no generics", "its fields are f64"));
    }
    for attribute in known(source, &item.attrs, ON_STRUCT, "the struct", errors) {
        if attribute.path().is_ident("small_strain") {
            metadata.small_strain = Some(attribute.span());
            if !matches!(attribute.meta, Meta::Path(_)) {
                let reason = "`small_strain` takes nothing";
                errors.push(source.error(attribute.span(), reason, "write `#[small_strain]`"));
            }
            continue;
        }
        if attribute.path().is_ident("accept") {
            metadata.acceptances.extend(claims::acceptance(source, attribute, errors));
            continue;
        }
        if attribute.path().is_ident("small_strain_moduli") {
            metadata.moduli = claims::moduli(source, attribute, errors);
            continue;
        }
        if attribute.path().is_ident("valid_stretches") {
            metadata.valid_stretches = claims::stretches(source, attribute, errors);
            continue;
        }
        metadata.has_domain = true;
        match attribute.parse_args::<Expr>() {
            Ok(expr) => metadata.domain = Some((expr, attribute.span())),
            Err(_) => {
                let reason = "`domain` takes a comparison";
                errors.push(source.error(attribute.span(), reason, "write `#[domain(J > 0.0)]`"));
            }
        }
    }
    let fields = match &item.fields {
        Fields::Named(fields) => &fields.named,
        Fields::Unnamed(_) | Fields::Unit => {
            let remedy = "write `struct Parameters { .. }`, one field a parameter";
            errors.push(source.error(item.ident.span(), "the fields of `Parameters` have names", remedy));
            return metadata;
        }
    };
    if fields.is_empty() {
        let remedy = "an energy needs at least a stiffness in Pa";
        errors.push(source.error(item.ident.span(), "`Parameters` has no field", remedy));
    }
    for field in fields {
        let Some(name) = &field.ident else { continue };
        let span = name.span();
        let name = name.to_string();
        if metadata.parameters.iter().any(|known| known.name == name) {
            errors.push(source.error(span, format!("two parameters are named `{name}`"), "rename one of them"));
        } else if words::STRAIN.contains(&name.as_str()) {
            let reason = format!("`{name}` is a measure of the strain");
            errors.push(source.error(span, reason, "give the parameter another name, such as `young`"));
        }
        let (parameter, has_unit) = parameter(source, field, name, span, errors);
        if !has_unit {
            metadata.unknown_units.insert(metadata.parameters.len());
        }
        metadata.parameters.push(parameter);
        metadata.spans.push(span);
    }
    metadata
}

/// The attributes that are not doc comments, once each; the others are refused.
fn known<'a>(
    source: &Source,
    attributes: &'a [Attribute],
    offered: &[&str],
    owner: &str,
    errors: &mut Vec<LawError>,
) -> Vec<&'a Attribute> {
    let mut found: Vec<&Attribute> = Vec::new();
    for attribute in attributes.iter().filter(|attribute| !attribute.path().is_ident("doc")) {
        let name = attribute.path().get_ident().map(ToString::to_string).unwrap_or_default();
        if !offered.contains(&name.as_str()) {
            let remedy = words::suggest(&name, offered, &format!("the attributes of {owner} are"));
            errors.push(source.error(
                attribute.path().span(),
                format!("unknown attribute `{name}` of {owner}"),
                remedy,
            ));
        } else if name != "accept" && found.iter().any(|other| other.path() == attribute.path()) {
            let reason = format!("the attribute `{name}` is given twice");
            errors.push(source.error(attribute.path().span(), reason, "remove one of them"));
        } else {
            found.push(attribute);
        }
    }
    found
}

/// A parameter, and whether its unit could be read.
fn parameter(
    source: &Source,
    field: &syn::Field,
    name: String,
    span: Span,
    errors: &mut Vec<LawError>,
) -> (Parameter, bool) {
    let mut error = |span: Span, reason: String, remedy: &str| errors.push(source.error(span, reason, remedy));
    let len = match length(&field.ty) {
        Ok(len) => len,
        Err((reason, remedy)) => {
            error(field.ty.span(), reason, remedy);
            1
        }
    };
    let is_direction = type_name(&field.ty).as_deref() == Some("Direction");
    let text = docs(&field.attrs);
    if text.is_empty() {
        error(
            span,
            format!("the parameter `{name}` has no doc comment"),
            "say what it is, above it: `/// Young's modulus.`",
        );
    }
    let (mut unit, mut range, mut default, mut per_element) = (None, None, None, false);
    let mut unit_given = false;
    let (mut unit_place, mut range_place) = (None, None);
    for attribute in known(source, &field.attrs, ON_FIELD, "a parameter", errors) {
        let mut error = |span: Span, reason: String, remedy: &str| errors.push(source.error(span, reason, remedy));
        let place = attribute.span();
        if attribute.path().is_ident("unit") {
            (unit_given, unit_place) = (true, Some(place));
            let parsed = attribute.parse_args::<LitStr>();
            match parsed.map_err(|_| String::from("`unit` takes a text")).and_then(|text| units::parse(&text.value())) {
                Ok(parsed) => unit = Some(parsed),
                Err(reason) => {
                    error(place, reason, "write `#[unit(\"Pa\")]`: products of powers of 1, Pa, m, s, N, J and rad");
                }
            }
        } else if attribute.path().is_ident("range") {
            let remedy = "write `#[range(0.0, 1e9)]`: the least and the greatest value allowed";
            range = Some((f64::NEG_INFINITY, f64::INFINITY));
            range_place = Some(place);
            match numbers(attribute) {
                Ok(values) => match values[..] {
                    [low, high] if low < high => range = Some((low, high)),
                    [low, high] => error(place, format!("the range {low} to {high} is empty"), remedy),
                    _ => error(place, String::from("`range` takes two numbers"), remedy),
                },
                Err((span, reason, advice)) => error(span, reason, &advice),
            }
        } else if attribute.path().is_ident("default") {
            match numbers(attribute) {
                Ok(values) => default = Some((values, place)),
                Err((span, reason, advice)) => error(span, reason, &advice),
            }
        } else if matches!(attribute.meta, Meta::Path(_)) {
            per_element = true;
        } else {
            error(place, String::from("`per_element` takes nothing"), "write `#[per_element]`");
        }
    }
    let mut error = |span: Span, reason: String, remedy: &str| errors.push(source.error(span, reason, remedy));
    if !unit_given && !is_direction {
        error(
            span,
            format!("the parameter `{name}` has no unit"),
            "write `#[unit(\"Pa\")]`, or `#[unit(\"1\")]` for none",
        );
    }
    if range.is_none() && !is_direction {
        error(span, format!("the parameter `{name}` has no range"), "write `#[range(0.0, 1e9)]`");
    }
    let range = range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    if let Some((values, place)) = default.as_ref().filter(|_| !is_direction) {
        if values.len() != len {
            let reason = format!("the number of values that `default` gives is {}, not {len}", values.len());
            error(*place, reason, "give one value a component: `#[default(1.0, 2.0)]`");
        } else if let Some(value) = values.iter().find(|value| !(range.0..=range.1).contains(*value)) {
            let reason = format!("the default {value} is outside the range {} to {}", range.0, range.1);
            error(*place, reason, "change the default or the range");
        }
    }
    let has_unit = unit.is_some();
    let unit = unit.unwrap_or(super::ast::Unit { text: String::from("1"), length: 0, stress: 0, time: 0 });
    let given = Given {
        unit: unit_place.map(|place| (unit.text.as_str(), place)),
        range: range_place,
        default: default.as_ref().map(|(values, place)| (values.as_slice(), *place)),
    };
    let default = given.default.map(|(values, _)| values.to_vec());
    let mut parameter =
        Parameter { name, docs: text, unit: unit.clone(), range, default, per_element, len, direction: false };
    if is_direction {
        fibres::direction(source, &mut parameter, &given, errors);
    }
    (parameter, has_unit || is_direction)
}

/// The number of components of a parameter's type.
fn length(ty: &Type) -> Result<usize, (String, &'static str)> {
    if let Type::Array(array) = ty {
        let len = match &array.len {
            Expr::Lit(literal) => match &literal.lit {
                Lit::Int(int) if int.suffix().is_empty() => int.base10_parse::<usize>().ok(),
                _ => None,
            },
            _ => None,
        };
        if type_name(&array.elem).as_deref() == Some("f64") {
            return match len {
                Some(len) if (2..=MAX_COMPONENTS).contains(&len) => Ok(len),
                _ => {
                    let reason = format!("an array has 2 to {MAX_COMPONENTS} components, as a literal");
                    Err((reason, "write `[f64; 3]`, or `f64` for one"))
                }
            };
        }
    }
    match type_name(ty).as_deref() {
        Some("f64") => Ok(1),
        Some("Direction") => Ok(3),
        _ => Err((String::from("unknown type of a parameter"), "the types are `f64`, `[f64; 3]` and `Direction`")),
    }
}

/// Span, reason and remedy of a refused number.
type Refusal = (Span, String, String);

/// The numbers of an attribute: `range(-0.9, 1e0)`.
pub(super) fn numbers(attribute: &Attribute) -> Result<Vec<f64>, Refusal> {
    let arguments = attribute.parse_args_with(Punctuated::<Expr, Token![,]>::parse_terminated);
    let arguments = arguments.map_err(|_| {
        (
            attribute.span(),
            String::from("numbers are missing here"),
            String::from("write numbers between commas: `(-0.9, 1e3)`"),
        )
    })?;
    arguments.iter().map(number).collect()
}

fn number(expr: &Expr) -> Result<f64, Refusal> {
    let refusal = |reason: &str, remedy: String| (expr.span(), reason.to_owned(), remedy);
    match expr {
        Expr::Unary(unary) if matches!((&unary.op, &*unary.expr), (UnOp::Neg(_), Expr::Lit(_))) => {
            number(&unary.expr).map(|value| -value)
        }
        Expr::Lit(literal) => match &literal.lit {
            Lit::Float(float) if float.suffix().is_empty() => match float.base10_parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(refusal("this number is too large", String::from("write one that an f64 holds"))),
            },
            Lit::Int(int) => {
                let remedy = format!("write `{}.0`", int.base10_digits());
                Err(refusal("this is an integer, and a real number is needed here", remedy))
            }
            _ => Err(refusal("this is not a number", String::from("write it as in `-0.9` or `1e3`"))),
        },
        _ => Err(refusal("this is not a number", String::from("write it as in `-0.9` or `1e3`"))),
    }
}

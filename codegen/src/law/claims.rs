//! What an author claims of a law: constants at rest that the generator cannot decide, moduli of small strains, and the
//! stretches between which it is trusted.

use proc_macro2::Span;
use syn::punctuated::Punctuated;
use syn::spanned::Spanned;
use syn::{Attribute, Expr, Lit, MetaNameValue, Token};

use super::ast::{Acceptance, Accepted, DeclaredModuli};
use super::dimension::PRESSURE;
use super::error::{LawError, Place, Source};
use super::expr::{Lowering, Scope};
use super::metadata::numbers;
use super::value::ScalarValue;

const ACCEPT: &str = "write `#[accept(sign = \"c - d\", reason = \"..\")]`, or `cancellation`, with the constant that a \
                      refusal names";
const STRETCHES: &str = "write `#[valid_stretches(0.8, 1.3)]`: the least and the greatest principal stretch, around the 1 of the body \
                         at rest";
const MODULI: &str = "write `#[small_strain_moduli(shear = mu, bulk = kappa)]`, or `lame_lambda` for `bulk`";

/// The arguments of `#[small_strain_moduli(..)]`: each name, its place and its expression.
pub(super) struct Given {
    text: String,
    shear: Expr,
    volumetric: Expr,
    /// Whether `volumetric` is Lame's first constant, and no bulk modulus.
    is_lambda: bool,
}

/// `name = value, ..`; `None` if it is something else.
fn pairs(attribute: &Attribute) -> Option<Vec<(String, Span, Expr)>> {
    let pairs = attribute.parse_args_with(Punctuated::<MetaNameValue, Token![,]>::parse_terminated).ok()?;
    let pair = |pair: MetaNameValue| {
        let name = pair.path.get_ident()?.to_string();
        Some((name, pair.path.span(), pair.value))
    };
    pairs.into_iter().map(pair).collect()
}

/// `#[accept(sign = "c - d", reason = "..")]`; `None` if an error was noted.
pub(super) fn acceptance(source: &Source, attribute: &Attribute, errors: &mut Vec<LawError>) -> Option<Acceptance> {
    let mut error = |span: Span, reason: &str| errors.push(source.error(span, reason, ACCEPT));
    let texts: Option<Vec<(String, Span, String)>> = pairs(attribute).and_then(|pairs| {
        let text = |(name, span, value): (String, Span, Expr)| match value {
            Expr::Lit(literal) => match literal.lit {
                Lit::Str(text) => Some((name, span, text.value().trim().to_owned())),
                _ => None,
            },
            _ => None,
        };
        pairs.into_iter().map(text).collect()
    });
    let Some(texts) = texts else {
        error(attribute.span(), "`accept` takes what is accepted and a reason, as texts");
        return None;
    };
    let [(kind, span, constant), (second, other, reason)] = texts.as_slice() else {
        error(attribute.span(), "`accept` takes one constant and a reason");
        return None;
    };
    let kind = match kind.as_str() {
        "sign" => Accepted::Sign,
        "cancellation" => Accepted::Cancellation,
        _ => {
            error(*span, "what is accepted is a `sign` or a `cancellation`");
            return None;
        }
    };
    if second != "reason" {
        error(*other, "what follows the constant is the `reason`");
        return None;
    }
    if constant.is_empty() || reason.is_empty() {
        error(attribute.span(), "an acceptance names a constant and says why it is right");
        return None;
    }
    let place = Place::from(attribute.span());
    Some(Acceptance { kind, constant: constant.clone(), reason: reason.clone(), place })
}

/// The arguments of `#[small_strain_moduli(shear = .., bulk = ..)]`; `None` if an error was noted.
pub(super) fn moduli(source: &Source, attribute: &Attribute, errors: &mut Vec<LawError>) -> Option<Given> {
    let mut pairs = pairs(attribute).unwrap_or_default();
    let names: Vec<&str> = pairs.iter().map(|(name, _, _)| name.as_str()).collect();
    let is_lambda = match names.as_slice() {
        ["shear", "bulk"] => false,
        ["shear", "lame_lambda"] => true,
        _ => {
            let reason =
                "`small_strain_moduli` takes the shear modulus, then the bulk modulus or Lame's first constant";
            errors.push(source.error(attribute.span(), reason, MODULI));
            return None;
        }
    };
    let text = |span: Span| span.source_text().unwrap_or_default();
    let text = pairs.iter().map(|(name, _, value)| format!("{name} = {}", text(value.span())));
    let text = text.collect::<Vec<_>>().join(", ");
    let volumetric = pairs.pop()?.2;
    let shear = pairs.pop()?.2;
    Some(Given { text, shear, volumetric, is_lambda })
}

/// The numbers of `#[valid_stretches(0.8, 1.3)]`; `None` if an error was noted.
pub(super) fn stretches(source: &Source, attribute: &Attribute, errors: &mut Vec<LawError>) -> Option<(f64, f64)> {
    let mut error = |span: Span, reason: String, remedy: &str| errors.push(source.error(span, reason, remedy));
    match numbers(attribute).as_deref() {
        Ok(&[least, greatest]) if 0.0 < least && least < 1.0 && 1.0 < greatest => return Some((least, greatest)),
        Ok(&[least, greatest]) => {
            let reason = format!("the stretches {least} to {greatest} are not positive and around 1");
            error(attribute.span(), reason, STRETCHES);
        }
        Ok(_) => error(attribute.span(), String::from("`valid_stretches` takes two numbers"), STRETCHES),
        Err((span, reason, remedy)) => error(*span, reason.clone(), remedy),
    }
    None
}

impl Lowering<'_> {
    /// The declared moduli, in the names of the parameters; `None` if an error was noted.
    pub(super) fn moduli(&mut self, given: &Given) -> Option<DeclaredModuli> {
        if let Some(direction) = self.parameters.iter().find(|p| p.direction) {
            let reason =
                format!("the law has the direction `{}`, and two moduli describe isotropic laws", direction.name);
            self.error(given.shear.span(), reason, "remove `small_strain_moduli`");
            return None;
        }
        let names = self.parameters.iter().enumerate().map(|(i, p)| (p.name.clone(), self.parameter(i)));
        let scope: Scope = names.collect();
        self.in_domain = true;
        let shear = self.declared_modulus(&given.shear, &scope);
        let volumetric = self.declared_modulus(&given.volumetric, &scope);
        self.in_domain = false;
        let (shear, volumetric) = shear.zip(volumetric)?;
        // K = lambda + 2/3 mu.
        let two_thirds = || ScalarValue::whole(2).div(&ScalarValue::whole(3));
        let bulk = if given.is_lambda { volumetric.add(&two_thirds().mul(&shear)) } else { volumetric };
        Some(DeclaredModuli { text: given.text.clone(), shear: shear.node, bulk: bulk.node })
    }

    fn declared_modulus(&mut self, expr: &Expr, scope: &Scope) -> Option<ScalarValue> {
        let value = self.scalar(expr, scope)?;
        if let Some(found) = value.facts.dimension.filter(|found| *found != PRESSURE) {
            let remedy = "moduli are made of parameters with `#[unit(\"Pa\")]`";
            self.error(expr.span(), format!("a modulus is in Pa, and this is {found}"), remedy);
            return None;
        }
        Some(value)
    }
}

//! Refuses, before syn sees them, the words and signs that no law uses, and statements too long for recursive passes.

use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};

use super::error::{LawError, Source};

/// Operators (signs, brackets and `as`) that one statement may have.
const MAX_OPERATORS: usize = 600;
/// Signs in a row, as in `- - - x`.
const MAX_RUN: usize = 8;
/// Signs and words of one statement after each of which syn recurses: `=`, `<`, `|`, `>`, `let`, `fn`.
const MAX_RECURSIVE: usize = 48;

/// Words of Rust that are not part of the law language, with what to write instead.
fn refused_word(word: &str) -> Option<&'static str> {
    Some(match word {
        "if" | "else" | "match" | "true" | "false" => {
            "write `select(a > b, x, y)`: x where a > b, y elsewhere; a derivation needs both branches"
        }
        "for" | "while" | "loop" | "break" | "continue" | "in" => {
            "write `sum(0..N, |i| ..)`: a sum over a fixed range is the only repetition"
        }
        "mut" => "nothing changes in a law: give each value its own `let`",
        "return" => "end the function with the value itself, without `return` and `;`",
        "pub" => "remove it: a law file has no callers",
        "static" => "write `const NAME: f64 = ..;`",
        "ref" | "dyn" | "move" => "remove it: values are passed as they are",
        "use" | "mod" | "extern" | "crate" | "self" | "Self" | "super" => {
            "a law file stands alone: write the helper function or constant in the file itself"
        }
        "enum" | "trait" | "impl" | "type" => "a law file holds `struct Parameters`, functions and constants only",
        "unsafe" | "async" | "await" | "where" | "yield" | "try" | "abstract" | "become" | "box" | "do" | "final"
        | "gen" | "macro" | "override" | "priv" | "typeof" | "unsized" | "virtual" => {
            "remove it: a law is arithmetic on the strain and the parameters"
        }
        _ => return None,
    })
}

/// Signs of Rust that are not part of the law language, with what to write instead.
fn refused_sign(sign: char) -> Option<&'static str> {
    Some(match sign {
        '&' => "pass values as they are, without references; for two conditions write one `select` inside another",
        '!' => "laws have no macros and no negation: write the formula, or swap the branches of `select`",
        '?' | '@' | '$' | '~' | '\'' => "remove it: a law is arithmetic on the strain and the parameters",
        '%' => "there is no remainder: write a smooth function of the strain",
        '^' => "for a power write `x.powi(2)` or `x.powf(1.5)`",
        _ => return None,
    })
}

/// What a group of tokens is: it decides whether an attribute may stand in it.
#[derive(Clone, Copy, PartialEq)]
enum Where {
    File,
    Struct,
    Attribute,
    Elsewhere,
}

/// All refused words and signs of `tokens`, and the first statement that is too long.
pub(super) fn check(source: &Source, tokens: TokenStream) -> Vec<LawError> {
    let mut errors = Vec::new();
    walk(source, tokens, Where::File, &mut errors);
    errors
}

/// Counts of one statement: from one `;` to the next.
#[derive(Default)]
struct Counts {
    operators: usize,
    recursive: usize,
    run: usize,
    told: bool,
}

fn walk(source: &Source, tokens: TokenStream, place: Where, errors: &mut Vec<LawError>) {
    let mut counts = Counts::default();
    // The two tokens before: a `#` announces an attribute, `struct NAME` a struct's body, `fn NAME` an item.
    let mut last = (String::new(), String::new());
    for token in tokens {
        let span = token.span();
        let text = match &token {
            TokenTree::Ident(ident) => ident.to_string(),
            TokenTree::Punct(punct) => punct.as_char().to_string(),
            TokenTree::Group(_) => String::from("()"),
            TokenTree::Literal(_) => String::from("0"),
        };
        match &token {
            TokenTree::Ident(_) => word(source, &text, &last.1, span, &mut counts, errors),
            TokenTree::Punct(punct) => sign(source, punct.as_char(), &last, place, span, &mut counts, errors),
            TokenTree::Literal(_) => counts.run = 0,
            TokenTree::Group(group) => {
                counts.run = 0;
                let attribute = last.1 == "#" || last == (String::from("#"), String::from("!"));
                let within = match group.delimiter() {
                    Delimiter::Bracket if attribute => Where::Attribute,
                    Delimiter::Brace if place == Where::File && last.0 == "struct" => Where::Struct,
                    _ => Where::Elsewhere,
                };
                counts.operators += usize::from(!attribute);
                walk(source, group.stream(), within, errors);
            }
        }
        let long = counts.operators > MAX_OPERATORS || counts.recursive > MAX_RECURSIVE || counts.run > MAX_RUN;
        if long && !counts.told {
            counts.told = true;
            errors.push(source.error(span, "this statement is too long", "name parts of it by `let`"));
        }
        last = (last.1, text);
    }
}

fn word(source: &Source, text: &str, before: &str, span: Span, counts: &mut Counts, errors: &mut Vec<LawError>) {
    if before == "fn" {
        // `fn NAME` begins an item; as a type, `fn` is followed by a bracket.
        *counts = Counts { told: counts.told, ..Counts::default() };
    }
    counts.run = 0;
    counts.operators += usize::from(text == "as");
    counts.recursive += usize::from(matches!(text, "let" | "fn"));
    if text.starts_with("r#") || !text.is_ascii() {
        let reason = format!("the name `{text}` is not plain");
        errors.push(source.error(
            span,
            reason,
            "use letters a to z, digits and `_`: names reach the generated kernels",
        ));
    } else if let Some(remedy) = refused_word(text) {
        errors.push(source.error(span, format!("`{text}` is not part of the law language"), remedy));
    }
}

fn sign(
    source: &Source,
    c: char,
    last: &(String, String),
    place: Where,
    span: Span,
    counts: &mut Counts,
    errors: &mut Vec<LawError>,
) {
    match c {
        ';' => *counts = Counts { told: counts.told, ..Counts::default() },
        '#' | ',' | ':' => counts.run = 0,
        _ => {
            counts.run += 1;
            counts.operators += 1;
            counts.recursive += usize::from(matches!(c, '=' | '<' | '>' | '|'));
        }
    }
    if c == '#' && !matches!(place, Where::File | Where::Struct) {
        let remedy = "attributes and `///` belong to the struct, its fields and the functions; comment by `//`";
        errors.push(source.error(span, "an attribute or a doc comment has no place here", remedy));
    }
    let inner_attribute = c == '!' && last.1 == "#";
    let told = c == '&' && last.1 == "&";
    if let Some(remedy) = refused_sign(c).filter(|_| !inner_attribute && !told) {
        errors.push(source.error(span, format!("`{c}` is not part of the law language"), remedy));
    }
}

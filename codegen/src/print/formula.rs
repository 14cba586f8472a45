//! Expressions for the reader, as one would write them by hand: `mu / 2 * (trA - 3)`.

use num_traits::{One, Signed};

use crate::expr::{Expr, Rational};
use crate::quantity::Quantities;

/// An expression as text.
pub fn expression(e: &Expr, quantities: &Quantities) -> String {
    match e {
        Expr::Sum(terms) => {
            let mut out = String::new();
            for t in terms {
                let text = expression(t, quantities);
                match (out.is_empty(), text.strip_prefix('-')) {
                    (true, _) => out = text,
                    (false, Some(rest)) => out += &format!(" - {rest}"),
                    (false, None) => out += &format!(" + {text}"),
                }
            }
            out
        }
        Expr::Product(_) | Expr::Power(..) => product(e, quantities),
        Expr::Number(q) => q.to_string(),
        Expr::Symbol(s) => quantities.get(*s).name.clone(),
        Expr::Ln(a) => format!("ln({})", expression(a, quantities)),
        Expr::Exp(a) => format!("exp({})", expression(a, quantities)),
        Expr::Log1p(a) => format!("log1p({})", expression(a, quantities)),
        Expr::Expm1(a) => format!("expm1({})", expression(a, quantities)),
        Expr::Log1pmx(a) => format!("log1pmx({})", expression(a, quantities)),
        Expr::Expm1mx(a) => format!("expm1mx({})", expression(a, quantities)),
    }
}

/// A product: its number first, then what is above and what is below the line.
fn product(e: &Expr, quantities: &Quantities) -> String {
    let mut number = Rational::one();
    let (mut above, mut below) = (vec![], vec![]);
    collect(e, quantities, &mut number, &mut above, &mut below);
    let sign = if number.is_negative() { "-" } else { "" };
    let (numerator, denominator) = (number.numer().abs(), *number.denom());
    if numerator != 1 || above.is_empty() {
        above.insert(0, numerator.to_string());
    }
    if denominator != 1 {
        below.insert(0, denominator.to_string());
    }
    let above = above.join(" * ");
    match below.as_slice() {
        [] => format!("{sign}{above}"),
        [single] => format!("{sign}{above} / {single}"),
        several => format!("{sign}{above} / ({})", several.join(" * ")),
    }
}

fn collect(e: &Expr, quantities: &Quantities, number: &mut Rational, above: &mut Vec<String>, below: &mut Vec<String>) {
    match e {
        Expr::Number(q) => *number *= q,
        Expr::Product(factors) => factors.iter().for_each(|f| collect(f, quantities, number, above, below)),
        Expr::Power(base, exponent) => match **exponent {
            Expr::Number(q) if q.is_negative() && q.is_integer() => {
                below.push(power(base, &Expr::Number(-q), quantities))
            }
            _ => above.push(power(base, exponent, quantities)),
        },
        _ => above.push(tight(e, quantities)),
    }
}

fn power(base: &Expr, exponent: &Expr, quantities: &Quantities) -> String {
    let base = match base {
        Expr::Product(_) | Expr::Power(..) => format!("({})", expression(base, quantities)),
        _ => tight(base, quantities),
    };
    match exponent {
        Expr::Number(q) if q.is_one() => base,
        Expr::Number(q) if q.is_integer() && q.is_positive() => format!("{base}^{q}"),
        Expr::Symbol(_) => format!("{base}^{}", expression(exponent, quantities)),
        _ => format!("{base}^({})", expression(exponent, quantities)),
    }
}

/// A text that a factor may stand beside.
fn tight(e: &Expr, quantities: &Quantities) -> String {
    let text = expression(e, quantities);
    match e {
        Expr::Sum(_) => format!("({text})"),
        Expr::Number(q) if q.is_negative() || !q.is_integer() => format!("({text})"),
        _ => text,
    }
}

//! The stages of the invariants with fibre directions, over the strain A = C - I.
//!
//! What depends on the directions alone, the components of sym(a (x) b), is a constant of the material and computed
//! once. A direction is a unit vector: a . C . a = 1 + a . A . a, and the 1 cancels exactly where it has to.

use crate::expr::{Expr, Rational, Symbol};
use crate::quantity::{Kind, Quantities, Value};

use super::strain::{Direction, SYMMETRIC};

/// The name of the parameter that a direction is.
fn name(quantities: &Quantities, d: Direction) -> String {
    quantities.get(d[0]).name.trim_end_matches('0').to_string()
}

/// a . A . b, with the six components of A. The sum over the off-diagonal components is a stage of its own: so the
/// constants that multiply A are those that multiply the stress, six in all.
pub fn pair(quantities: &mut Quantities, strain: &[Symbol; 6], a: Direction, b: Direction) -> Symbol {
    let (first, second) = (name(quantities, a), name(quantities, b));
    let label = format!("{first}_A_{second}");
    let product = if a == b { first } else { format!("{first}_{second}") };
    let mut terms = Vec::new();
    for (&(i, j), &component) in SYMMETRIC.iter().zip(strain) {
        let of = |i: usize, j: usize| Expr::from(a[i]) * b[j].into();
        let value = match (a == b, i == j) {
            (true, true) => Expr::from(a[i]).pow(Rational::from_integer(2)),
            (true, false) | (false, true) => of(i, j),
            (false, false) => Expr::ratio(1, 2) * (of(i, j) + of(j, i)),
        };
        let constant = quantities.add(format!("{product}{i}{j}"), Kind::Constant(Value::Expr(value)));
        terms.push(Expr::from(constant) * component.into());
    }
    let off_diagonal = quantities.stage(format!("{label}_off"), Expr::Sum(terms.split_off(3)));
    terms.push(Expr::int(2) * off_diagonal.into());
    quantities.stage(label, Expr::Sum(terms))
}

/// a . A^2 . a = |A a|^2.
pub fn square(quantities: &mut Quantities, strain: &[Symbol; 6], a: Direction) -> Symbol {
    let label = name(quantities, a);
    let at = |i: usize, j: usize| {
        let k = SYMMETRIC.iter().position(|&(x, y)| (x, y) == (i.min(j), i.max(j)));
        Expr::from(strain[k.expect("SYMMETRIC has every pair")])
    };
    let squares = [0, 1, 2].map(|i| {
        let row = (0..3).map(|j| Expr::from(a[j]) * at(i, j)).collect();
        let image = quantities.stage(format!("A{label}{i}"), Expr::Sum(row));
        Expr::from(image).pow(Rational::from_integer(2))
    });
    quantities.stage(format!("{label}_square"), Expr::Sum(squares.to_vec()))
}

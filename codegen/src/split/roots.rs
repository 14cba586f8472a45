//! Powers of numbers in one form: (1/9)^(1/3) is 3^(1/3) / 3, as is 3^(-2/3), so that equal constants cancel.

use std::collections::BTreeMap;

use num_traits::{One, Signed};

use crate::expr::{Expr, Rational};

/// Greatest prime that is looked for: constants of laws are products of small ones, and others stay as they are.
const GREATEST: i128 = 1000;

/// The expression with each rational power of a positive rational number as a rational number times powers of primes with
/// exponents between 0 and 1.
pub fn canonical(e: &Expr) -> Expr {
    let boxed = |x: &Expr| Box::new(canonical(x));
    match e {
        Expr::Number(_) | Expr::Symbol(_) => e.clone(),
        Expr::Sum(xs) => Expr::Sum(xs.iter().map(canonical).collect()),
        Expr::Product(xs) => product(xs.iter().map(canonical)),
        Expr::Power(a, b) => match (&**a, &**b) {
            (Expr::Number(q), Expr::Number(r)) if q.is_positive() && !r.is_integer() => {
                power(*q, *r).unwrap_or_else(|| e.clone())
            }
            _ => Expr::Power(boxed(a), boxed(b)),
        },
        Expr::Ln(a) => Expr::Ln(boxed(a)),
        Expr::Exp(a) => Expr::Exp(boxed(a)),
        Expr::Log1p(_) | Expr::Expm1(_) | Expr::Log1pmx(_) | Expr::Expm1mx(_) => e.clone(),
    }
}

/// A product in which the powers of each prime are one.
fn product(factors: impl Iterator<Item = Expr>) -> Expr {
    let mut flat = vec![];
    for factor in factors {
        match factor {
            Expr::Product(xs) => flat.extend(xs),
            x => flat.push(x),
        }
    }
    let mut roots: BTreeMap<Rational, Rational> = BTreeMap::new();
    flat.retain(|factor| match factor {
        Expr::Power(a, b) => match (&**a, &**b) {
            (Expr::Number(q), Expr::Number(r)) if q.is_positive() && q.is_integer() => {
                *roots.entry(*q).or_default() += r;
                false
            }
            _ => true,
        },
        _ => true,
    });
    for (q, r) in roots {
        let whole = r.floor().to_integer();
        let magnitude = u32::try_from(whole.unsigned_abs()).ok().and_then(|n| q.numer().checked_pow(n));
        let Some(magnitude) = magnitude.map(Rational::from_integer) else {
            flat.push(Expr::Number(q).pow(r));
            continue;
        };
        let rest = r - r.floor();
        flat.push(Expr::Number(if whole < 0 { magnitude.recip() } else { magnitude }));
        if *rest.numer() != 0 {
            flat.push(Expr::Number(q).pow(rest));
        }
    }
    Expr::Product(flat)
}

/// q^r; `None` where q has a prime that is not looked for, or a number does not fit.
fn power(q: Rational, r: Rational) -> Option<Expr> {
    let mut number = Rational::one();
    let mut roots = vec![];
    for (mut n, sign) in [(*q.numer(), 1), (*q.denom(), -1)] {
        let mut prime = 2;
        while n > 1 && prime <= GREATEST {
            let mut count = 0;
            while n % prime == 0 {
                n /= prime;
                count += sign;
            }
            if count != 0 {
                let exponent = r * Rational::from_integer(count);
                let whole = exponent.numer().div_euclid(*exponent.denom());
                let magnitude = prime.checked_pow(u32::try_from(whole.unsigned_abs()).ok()?)?;
                let factor = Rational::from_integer(magnitude);
                number = if whole < 0 { number / factor } else { number * factor };
                let root = exponent - Rational::from_integer(whole);
                if *root.numer() != 0 {
                    roots.push(Expr::int(prime).pow(root));
                }
            }
            prime += 1;
        }
        if n != 1 {
            return None;
        }
    }
    roots.insert(0, Expr::Number(number));
    Some(Expr::Product(roots))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_powers_are_the_same_text() {
        let power = |n: i128, d: i128, p: i128, q: i128| {
            let base = Box::new(Expr::Number(Rational::new(n, d)));
            format!("{:?}", canonical(&Expr::Power(base, Box::new(Expr::Number(Rational::new(p, q))))))
        };
        assert_eq!(power(1, 9, 1, 3), power(3, 1, -2, 3));
        assert_eq!(power(9, 1, 1, 4), power(3, 1, 1, 2));
        assert_eq!(power(8, 27, 1, 3), format!("{:?}", Expr::Product(vec![Expr::Number(Rational::new(2, 3))])));
        assert_ne!(power(2, 1, 1, 2), power(3, 1, 1, 2));
        // A great prime stays.
        assert!(power(1_000_003, 1, 1, 2).contains("Power"));
    }
}

//! Number literals, exactly: `0.3` is 3/10.

use num_rational::Ratio;

use super::ast::Rational;

/// The exact value of a decimal literal without sign or suffix (`2.0`, `1e-3`, `1_000.5`), if 128 bits hold it.
pub(super) fn exact(digits: &str) -> Option<Rational> {
    let digits: String = digits.chars().filter(|c| *c != '_').collect();
    let (mantissa, exponent) = match digits.split_once(['e', 'E']) {
        None => (digits.as_str(), 0),
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let fraction = fraction.trim_end_matches('0');
    let mut numerator: i128 = 0;
    for c in whole.chars().chain(fraction.chars()) {
        numerator = numerator.checked_mul(10)?.checked_add(i128::from(c.to_digit(10)?))?;
    }
    if numerator == 0 {
        return Some(Ratio::from_integer(0));
    }
    let shift = exponent.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    let power = 10_i128.checked_pow(shift.unsigned_abs())?;
    if shift >= 0 {
        Some(Ratio::from_integer(numerator.checked_mul(power)?))
    } else {
        Some(Ratio::new(numerator, power))
    }
}

#[cfg(test)]
mod tests {
    use super::{Ratio, exact};

    fn check(digits: &str, expected: Option<(i128, i128)>) {
        assert_eq!(exact(digits), expected.map(|(n, d)| Ratio::new(n, d)), "{digits}");
    }

    #[test]
    fn literals_are_exact_or_refused() {
        check("2.0", Some((2, 1)));
        check("2.", Some((2, 1)));
        check("0.3", Some((3, 10)));
        check("1e0", Some((1, 1)));
        check("1_000.5e-2", Some((2001, 200)));
        check("1e+3", Some((1000, 1)));
        check("0.0e999", Some((0, 1)));
        check("1e38", Some((10_i128.pow(38), 1)));
        check("1e39", None);
        check("1e-39", None);
        check("1e99999999999", None);
        check("340282366920938463463374607431768211456.0", None);
    }
}

//! Units of parameters: text to exponents of length, stress and time.

use super::ast::Unit;

/// Exponents of (length, stress, time) of a unit's name. N = Pa m^2 and J = Pa m^3.
fn base(name: &str) -> Option<[i32; 3]> {
    Some(match name {
        "1" | "rad" => [0, 0, 0],
        "m" => [1, 0, 0],
        "Pa" => [0, 1, 0],
        "s" => [0, 0, 1],
        "N" => [2, 1, 0],
        "J" => [3, 1, 0],
        _ => return None,
    })
}

/// Parses products (by a space, `*` or `.`) of powers (`m^2`, `s^-1`), with at most one `/`; what follows `/` divides.
///
/// # Errors
/// What is wrong with the text, in words.
pub(super) fn parse(text: &str) -> Result<Unit, String> {
    let mut sides = text.split('/');
    let over = sides.next().unwrap_or_default();
    let under = sides.next();
    if sides.next().is_some() {
        return Err(format!("the unit \"{text}\" has more than one `/`"));
    }
    let mut exponents = [0; 3];
    product(over, 1, &mut exponents)?;
    if let Some(under) = under {
        product(under, -1, &mut exponents)?;
    }
    let [length, stress, time] = exponents;
    Ok(Unit { text: text.to_owned(), length, stress, time })
}

fn product(text: &str, sign: i32, exponents: &mut [i32; 3]) -> Result<(), String> {
    let mut factors = text.split([' ', '*', '.']).filter(|factor| !factor.is_empty()).peekable();
    if factors.peek().is_none() {
        return Err(String::from("the unit is empty"));
    }
    for factor in factors {
        let (name, power) = match factor.split_once('^') {
            None => (factor, 1),
            Some((name, power)) => match power.parse::<i32>() {
                Ok(power) if power.abs() <= 9 => (name, power),
                _ => return Err(format!("the power of \"{factor}\" is not an integer from -9 to 9")),
            },
        };
        let base = base(name).ok_or_else(|| format!("unknown unit \"{name}\""))?;
        for (exponent, b) in exponents.iter_mut().zip(base) {
            *exponent = b
                .checked_mul(sign * power)
                .and_then(|change| exponent.checked_add(change))
                .ok_or_else(|| String::from("the unit's exponents are too large"))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    fn check(text: &str, expected: Result<[i32; 3], &str>) {
        let found = super::parse(text).map(|unit| [unit.length, unit.stress, unit.time]);
        assert_eq!(found, expected.map_err(String::from), "{text}");
    }

    #[test]
    fn exponents_of_length_stress_and_time() {
        check("1", Ok([0, 0, 0]));
        check("rad", Ok([0, 0, 0]));
        check("Pa", Ok([0, 1, 0]));
        check("Pa s", Ok([0, 1, 1]));
        check("1/m", Ok([-1, 0, 0]));
        check("N/m", Ok([1, 1, 0]));
        check("J/m^3", Ok([0, 1, 0]));
        check("N m^-2", Ok([0, 1, 0]));
        check("Pa*m.s^2 / m^2", Ok([-1, 1, 2]));
        check("", Err("the unit is empty"));
        check("Pa/", Err("the unit is empty"));
        check("Pa/m/s", Err("the unit \"Pa/m/s\" has more than one `/`"));
        check("kPa", Err("unknown unit \"kPa\""));
        check("m^x", Err("the power of \"m^x\" is not an integer from -9 to 9"));
        check("m^99999999999", Err("the power of \"m^99999999999\" is not an integer from -9 to 9"));
    }
}

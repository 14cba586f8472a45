//! Dimensions: which expressions of a law may be added, compared, and taken as arguments of functions.
//!
//! The base is that of [`super::units`]: length, stress, time. Strains and numbers are pure numbers; exponents are
//! rational, so that `sqrt` has a dimension always. `None` in place of a dimension fits anything: a constant zero, or a
//! value whose dimension was refused already.

use num_rational::Ratio;
use proc_macro2::Span;

use super::ast::Unit;
use super::expr::Lowering;

/// Exponents of length (m), stress (Pa) and time (s).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dimension([Ratio<i64>; 3]);

/// Exponents are followed below this size, where no sum or product of two of them leaves 64 bits.
const TRACKED: i64 = 1 << 20;

/// Energy densities.
pub(super) const PRESSURE: Dimension = Dimension([Ratio::new_raw(0, 1), Ratio::new_raw(1, 1), Ratio::new_raw(0, 1)]);

/// Dissipation densities: W/m^3.
const POWER: Dimension = Dimension([Ratio::new_raw(0, 1), Ratio::new_raw(1, 1), Ratio::new_raw(-1, 1)]);

impl Dimension {
    /// Rates of strain.
    pub(super) const FREQUENCY: Dimension =
        Dimension([Ratio::new_raw(0, 1), Ratio::new_raw(0, 1), Ratio::new_raw(-1, 1)]);

    /// A pure number.
    pub(super) const ONE: Dimension = Dimension([Ratio::new_raw(0, 1); 3]);

    /// The dimension of a parameter.
    pub(super) fn of(unit: &Unit) -> Dimension {
        Dimension([unit.length, unit.stress, unit.time].map(|n| Ratio::from_integer(i64::from(n))))
    }

    /// The dimension of a product.
    pub(super) fn times(self, other: Dimension) -> Option<Dimension> {
        self.with(|k, exponent| exponent + other.0[k])
    }

    /// The dimension of a quotient.
    pub(super) fn over(self, other: Dimension) -> Option<Dimension> {
        self.with(|k, exponent| exponent - other.0[k])
    }

    /// The dimension of a power.
    pub(super) fn power(self, n: Ratio<i64>) -> Option<Dimension> {
        let small = n.numer().unsigned_abs() <= u64::from(u32::MAX) && *n.denom() <= i64::from(u32::MAX);
        if self == Dimension::ONE {
            return Some(self);
        }
        if small { self.with(|_, exponent| exponent * n) } else { None }
    }

    /// New exponents; `None`, which is not checked further, where they are too large to follow.
    fn with(self, exponent: impl Fn(usize, Ratio<i64>) -> Ratio<i64>) -> Option<Dimension> {
        let exponents = [0, 1, 2].map(|k| exponent(k, self.0[k]));
        let tracked = exponents.iter().all(|n| n.numer().abs() < TRACKED && *n.denom() < TRACKED);
        tracked.then_some(Dimension(exponents))
    }
}

impl std::fmt::Display for Dimension {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let factors: Vec<String> = ["m", "Pa", "s"]
            .iter()
            .zip(self.0)
            .filter(|(_, exponent)| *exponent.numer() != 0)
            .map(|(unit, exponent)| match (exponent.is_integer(), *exponent.numer()) {
                (true, 1) => (*unit).to_owned(),
                (true, n) => format!("{unit}^{n}"),
                (false, _) => format!("{unit}^({exponent})"),
            })
            .collect();
        if factors.is_empty() { f.write_str("a pure number") } else { write!(f, "in {}", factors.join(" ")) }
    }
}

impl Lowering<'_> {
    /// Whether two dimensions are equal; if not, an error is noted. `span` is the place of the second value, and `first`
    /// says what the first one is to it.
    pub(super) fn same(&mut self, first: &str, a: Option<Dimension>, b: Option<Dimension>, span: Span) -> bool {
        let (Some(expected), Some(found)) = (a, b) else { return true };
        if expected != found {
            let reason = format!("this is {found}, and {first} is {expected}");
            let remedy = "bring both to one unit: multiply or divide by a parameter, or correct `#[unit(..)]`";
            self.error(span, reason, remedy);
        }
        expected == found
    }

    /// Refuses a value that is no pure number where `what`, such as "`ln` takes", wants one.
    pub(super) fn pure(&mut self, what: &str, dimension: Option<Dimension>, span: Span) {
        let Some(found) = dimension.filter(|found| *found != Dimension::ONE) else { return };
        let reason = format!("{what} a pure number, and this is {found}");
        self.error(span, reason, "divide it by a parameter of the same unit, or correct `#[unit(..)]`");
    }

    /// Refuses an energy density that is not in Pa.
    pub(super) fn energy_dimension(&mut self, name: &str, dimension: Option<Dimension>, span: Span) {
        let Some(found) = dimension.filter(|found| *found != PRESSURE) else { return };
        let reason = format!("`{name}` is an energy density, in Pa, and this is {found}");
        let remedy = "numbers have no unit: stiffnesses are parameters with `#[unit(\"Pa\")]`, one in each term";
        self.error(span, reason, remedy);
    }

    /// Refuses a dissipation density that is not in Pa/s.
    pub(super) fn dissipation_dimension(&mut self, name: &str, dimension: Option<Dimension>, span: Span) {
        let Some(found) = dimension.filter(|found| *found != POWER) else { return };
        let reason = format!("`{name}` is a dissipation density, in Pa/s (W/m^3), and this is {found}");
        let remedy = "numbers have no unit: viscosities are parameters with `#[unit(\"Pa s\")]`, times two rates each";
        self.error(span, reason, remedy);
    }
}

#[cfg(test)]
mod tests {
    use super::super::units;
    use super::{Dimension, Ratio};

    fn dimension(unit: &str) -> Dimension {
        Dimension::of(&units::parse(unit).expect("a unit"))
    }

    fn check(found: Option<Dimension>, expected: &str) {
        assert_eq!(found.map(|d| d.to_string()).unwrap_or_default(), expected);
    }

    #[test]
    fn dimensions_of_products_and_powers() {
        let [pa, metre] = ["Pa", "m"].map(dimension);
        check(Some(Dimension::ONE), "a pure number");
        check(pa.times(metre), "in m Pa");
        check(pa.over(metre), "in m^-1 Pa");
        check(pa.over(pa), "a pure number");
        check(pa.power(Ratio::new(-3, 2)), "in Pa^(-3/2)");
        check(pa.power(Ratio::new(1, 2)).and_then(|d| d.power(Ratio::from_integer(2))), "in Pa");
        check(Dimension::ONE.power(Ratio::new(i64::MAX, 2)), "a pure number");
        check(pa.power(Ratio::from_integer(1 << 30)), "");
        check(pa.power(Ratio::new(i64::MIN, 3)), "");
        assert_eq!(dimension("J/m^3"), super::PRESSURE);
    }
}

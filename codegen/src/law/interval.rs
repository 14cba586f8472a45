//! Intervals: what values an expression of a law can take, as far as its form tells.

use super::ast::Invariant;

/// Real numbers from `low` to `high`, and whether 0 is among them.
///
/// Bounds are rounded outwards where arithmetic rounds; they need not be attained.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    low: f64,
    high: f64,
    /// Whether the value can be 0; false also for an open bound 0, as in J > 0.
    zero: bool,
}

impl Interval {
    /// Every real number.
    pub(super) const ALL: Interval = Interval { low: f64::NEG_INFINITY, high: f64::INFINITY, zero: true };
    /// x > 0.
    pub(super) const POSITIVE: Interval = Interval { low: 0.0, high: f64::INFINITY, zero: false };
    /// x >= 0.
    pub(super) const NON_NEGATIVE: Interval = Interval { low: 0.0, high: f64::INFINITY, zero: true };

    /// The closed interval from `low` to `high`.
    pub(super) fn new(low: f64, high: f64) -> Interval {
        Interval { low, high, zero: low <= 0.0 && high >= 0.0 }
    }

    /// Whether every value is above 0.
    pub(super) fn is_positive(self) -> bool {
        self.low >= 0.0 && !self.zero
    }

    /// Whether no value is 0.
    pub(super) fn is_nonzero(self) -> bool {
        !self.zero
    }

    /// a + b.
    pub(super) fn add(self, other: Interval) -> Interval {
        let low = rounded(self.low, other.low, f64::next_down);
        let high = rounded(self.high, other.high, f64::next_up);
        let one_sided = (self.low >= 0.0 && other.low >= 0.0) || (self.high <= 0.0 && other.high <= 0.0);
        let zero = if one_sided { self.zero && other.zero } else { true };
        Interval { low, high, zero: zero && low <= 0.0 && high >= 0.0 }
    }

    /// -a.
    pub(super) fn neg(self) -> Interval {
        Interval { low: -self.high, high: -self.low, zero: self.zero }
    }

    /// a - b.
    pub(super) fn sub(self, other: Interval) -> Interval {
        self.add(other.neg())
    }

    /// a b.
    pub(super) fn mul(self, other: Interval) -> Interval {
        let mut product = Interval { low: f64::INFINITY, high: f64::NEG_INFINITY, zero: self.zero || other.zero };
        for a in [self.low, self.high] {
            for b in [other.low, other.high] {
                // A bound 0 stands for values near 0, whose product with values without bound has no bound: the other
                // three products say so.
                let p = if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
                let exact = a == 0.0 || b == 0.0 || a.is_infinite() || b.is_infinite() || a.mul_add(b, -p) == 0.0;
                product.low = product.low.min(if exact { p } else { towards(p, f64::NEG_INFINITY) });
                product.high = product.high.max(if exact { p } else { towards(p, f64::INFINITY) });
            }
        }
        product
    }

    /// The same values without 0, where that is an end.
    pub(super) fn without_end(self) -> Interval {
        Interval { zero: self.zero && self.low < 0.0 && self.high > 0.0, ..self }
    }

    /// 1 / a; everything where a can be 0.
    pub(super) fn reciprocal(self) -> Interval {
        if self.zero || (self.low < 0.0 && self.high > 0.0) {
            return Interval { zero: self.zero, ..Interval::ALL };
        }
        let inverse = |x: f64, sign: f64, end: f64| if x == 0.0 { sign * f64::INFINITY } else { towards(1.0 / x, end) };
        let sign = if self.low >= 0.0 { 1.0 } else { -1.0 };
        let low = inverse(self.high, sign, f64::NEG_INFINITY);
        let high = inverse(self.low, sign, f64::INFINITY);
        let (low, high) = if sign > 0.0 { (low.max(0.0), high) } else { (low, high.min(0.0)) };
        Interval { low, high, zero: false }
    }

    /// a to an integer power.
    pub(super) fn powi(self, n: i32) -> Interval {
        if n == 0 {
            return Interval::new(1.0, 1.0);
        }
        if n < 0 {
            return self.powi(n.saturating_neg()).reciprocal();
        }
        if n == 1 {
            return self;
        }
        let least = if self.low <= 0.0 && self.high >= 0.0 { 0.0 } else { self.low.abs().min(self.high.abs()) };
        // A bound that is not 0 is kept only as its side of 1: powers of numbers round.
        let least = if least >= 1.0 { 1.0 } else { 0.0 };
        let magnitude = Interval { low: least, high: f64::INFINITY, zero: self.zero };
        match (n % 2 == 0, self.low >= 0.0, self.high <= 0.0) {
            (true, ..) | (false, true, _) => magnitude,
            (false, false, true) => magnitude.neg(),
            (false, false, false) => Interval { zero: self.zero, ..Interval::ALL },
        }
    }

    /// The square root or another power of a positive number.
    pub(super) fn power(self) -> Interval {
        Interval { zero: self.zero && self.low <= 0.0, ..Interval::POSITIVE }
    }

    /// exp(a).
    pub(super) fn exp(self) -> Interval {
        Interval { low: if self.low >= 0.0 { 1.0 } else { 0.0 }, high: f64::INFINITY, zero: false }
    }

    /// ln(a).
    pub(super) fn ln(self) -> Interval {
        if self.low >= 1.0 { Interval::NON_NEGATIVE } else { Interval::ALL }
    }

    /// The values of both.
    pub(super) fn hull(self, other: Interval) -> Interval {
        let (low, high) = (self.low.min(other.low), self.high.max(other.high));
        Interval { low, high, zero: self.zero || other.zero }
    }

    /// The greater of a and 0.
    pub(super) fn pos(self) -> Interval {
        Interval { low: self.low.max(0.0), high: self.high.max(0.0), zero: self.zero || self.low < 0.0 }
    }
}

/// The values that a scalar can take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Values {
    /// Whatever the strain is.
    pub(super) anywhere: Interval,
    /// Where J > 0.
    pub(super) upright: Interval,
}

impl Values {
    /// Every real number.
    pub(super) const ALL: Values = Values::of(Interval::ALL);

    /// The same values wherever the strain is.
    pub(super) const fn of(interval: Interval) -> Values {
        Values { anywhere: interval, upright: interval }
    }

    /// The values of an invariant. No eigenvalue of C is negative, so that I2 and I3 can be 0 where J is. I1 is 0 only
    /// where an element has become a point, which is not counted. Where J > 0, I1bar and I2bar are least at rest.
    pub(super) fn of_invariant(invariant: Invariant) -> Values {
        let isochoric = Values { anywhere: Interval::ALL, upright: Interval::new(3.0, f64::INFINITY) };
        match invariant {
            Invariant::I1 => Values::of(Interval::POSITIVE),
            Invariant::I2 | Invariant::I3 => Values { anywhere: Interval::NON_NEGATIVE, upright: Interval::POSITIVE },
            Invariant::J => Values { anywhere: Interval::ALL, upright: Interval::POSITIVE },
            Invariant::I1bar | Invariant::I2bar => isochoric,
            // Squares of lengths of F a and C a, which vanish only with J.
            Invariant::I4(_) | Invariant::I5(_) => {
                Values { anywhere: Interval::NON_NEGATIVE, upright: Interval::POSITIVE }
            }
            Invariant::I4bar(_) | Invariant::I5bar(_) => {
                Values { anywhere: Interval::ALL, upright: Interval::POSITIVE }
            }
            Invariant::I8(..) => Values::ALL,
        }
    }

    /// The values of a sum of powers of the principal stretches.
    pub(super) fn of_stretch_sum() -> Values {
        Values { anywhere: Interval::NON_NEGATIVE, upright: Interval::POSITIVE }
    }

    /// A function of the values.
    pub(super) fn map(self, f: impl Fn(Interval) -> Interval) -> Values {
        Values { anywhere: f(self.anywhere), upright: f(self.upright) }
    }

    /// A function of two scalars' values.
    pub(super) fn zip(self, other: Values, f: impl Fn(Interval, Interval) -> Interval) -> Values {
        Values { anywhere: f(self.anywhere, other.anywhere), upright: f(self.upright, other.upright) }
    }
}

/// a + b, moved by one rounding where it is not exact.
fn rounded(a: f64, b: f64, outwards: fn(f64) -> f64) -> f64 {
    let sum = a + b;
    if a.is_infinite() || b.is_infinite() || (sum - a == b && sum - b == a) { sum } else { outwards(sum) }
}

/// The next number on the way to `end`.
fn towards(x: f64, end: f64) -> f64 {
    if end > 0.0 { x.next_up() } else { x.next_down() }
}

#[cfg(test)]
mod tests {
    use super::Interval;

    const INFINITY: f64 = f64::INFINITY;

    fn check(found: Interval, low: f64, high: f64, zero: bool) {
        let close = |a: f64, b: f64| a == b || (a - b).abs() <= 4.0 * f64::EPSILON * b.abs();
        assert!(close(found.low, low) && close(found.high, high) && found.zero == zero, "{found:?}");
    }

    #[test]
    fn bounds_follow_the_arithmetic() {
        let new = Interval::new;
        let positive = Interval::POSITIVE;
        check(positive.add(new(1.0, 1.0)), 1.0, INFINITY, false);
        check(positive.sub(new(3.0, 3.0)), -3.0, INFINITY, true);
        check(positive.add(positive), 0.0, INFINITY, false);
        check(Interval::NON_NEGATIVE.add(Interval::NON_NEGATIVE), 0.0, INFINITY, true);
        check(Interval::NON_NEGATIVE.add(positive), 0.0, INFINITY, false);
        check(new(2.0, 3.0).mul(new(-1.0, 4.0)), -3.0, 12.0, true);
        check(positive.mul(new(-2.0, -1.0)), -INFINITY, 0.0, false);
        check(positive.mul(Interval::NON_NEGATIVE), 0.0, INFINITY, true);
        check(new(2.0, 4.0).reciprocal(), 0.25, 0.5, false);
        check(positive.reciprocal(), 0.0, INFINITY, false);
        check(positive.neg().reciprocal(), -INFINITY, 0.0, false);
        check(new(0.0, 4.0).reciprocal(), -INFINITY, INFINITY, true);
        check(Interval::ALL.powi(2), 0.0, INFINITY, true);
        check(Interval::ALL.powi(3), -INFINITY, INFINITY, true);
        check(positive.powi(-2), 0.0, INFINITY, false);
        check(positive.powi(i32::MIN), 0.0, INFINITY, false);
        check(new(-3.0, -2.0).powi(3), -INFINITY, -1.0, false);
        check(new(2.0, 3.0).powi(0), 1.0, 1.0, false);
        check(Interval::ALL.exp(), 0.0, INFINITY, false);
        check(new(1.0, 2.0).ln(), 0.0, INFINITY, true);
        check(new(-3.0, 2.0).pos(), 0.0, 2.0, true);
        check(new(1.0, 2.0).hull(new(-1.0, -0.5)), -1.0, 2.0, false);
    }

    #[test]
    fn rounding_goes_outwards() {
        let tenth = Interval::new(0.1, 0.1);
        let sum = tenth.add(Interval::new(0.2, 0.2)).sub(Interval::new(0.3, 0.3));
        assert!(!sum.is_positive() && sum.zero, "0.1 + 0.2 - 0.3 is no positive number: {sum:?}");
        let third = Interval::new(3.0, 3.0).reciprocal();
        let rest = Interval::new(1.0, 1.0).sub(third.mul(Interval::new(3.0, 3.0)));
        assert!(!rest.is_positive() && rest.zero, "1 - 3/3 is no positive number: {rest:?}");
    }
}

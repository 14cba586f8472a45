//! Numbers of 448 bits as numbers of kernels: the exact references of everything that is measured here.

use std::cell::RefCell;

use astro_float::{BigFloat, Consts, RoundingMode, Sign};
use tensormass_codegen::ir::{Number, Rational};

/// Bits of the significand: 135 decimal digits. Strains of 1e-8 in energies of second order, differences over steps of
/// 1e-40 and cancellation in textbook forms leave more than 60 of them.
pub const BITS: usize = 448;

/// Truncation is the cheapest, and 400 bits away from what is measured.
const ROUNDING: RoundingMode = RoundingMode::None;

thread_local! {
    /// Digits of ln 2 and the like, computed once a thread.
    static CONSTANTS: RefCell<Consts> = RefCell::new(Consts::new().expect("memory for a few constants"));
}

fn with_constants(f: impl FnOnce(&mut Consts) -> BigFloat) -> Exact {
    CONSTANTS.with(|c| Exact(f(&mut c.borrow_mut())))
}

/// A number of [`BITS`] bits. What is undefined (the logarithm of a negative number) is a NaN, as for `f64`.
#[derive(Debug, Clone)]
pub struct Exact(BigFloat);

impl Exact {
    /// Zero.
    pub fn zero() -> Self {
        Self::from(0.0)
    }

    /// 10 to an integer power, rounded.
    pub fn power_of_ten(exponent: i32) -> Self {
        let power = Self(BigFloat::from_f64(10.0, BITS).powi(exponent.unsigned_abs() as usize, BITS, ROUNDING));
        if exponent < 0 { Self::from(1.0).div(&power) } else { power }
    }

    /// |a|.
    pub fn abs(&self) -> Self {
        Self(self.0.abs())
    }

    /// Whether it is 0.
    pub fn is_zero(&self) -> bool {
        self.0.is_zero()
    }

    /// Whether it is neither NaN nor infinite.
    pub fn is_finite(&self) -> bool {
        !self.0.is_nan() && !self.0.is_inf()
    }

    /// Whether it is greater than 0.
    pub fn is_positive(&self) -> bool {
        self.greater(&Self::zero())
    }

    /// The nearest `f64`, to one unit in the last place; infinite or 0 where it is beyond the range of normal numbers.
    pub fn to_f64(&self) -> f64 {
        let Some((words, _, sign, exponent, _)) = self.0.as_raw_parts() else {
            return match (self.0.is_inf_pos(), self.0.is_inf_neg()) {
                (true, _) => f64::INFINITY,
                (_, true) => f64::NEG_INFINITY,
                _ => f64::NAN,
            };
        };
        if self.0.is_zero() {
            return 0.0;
        }
        // The value is 0.m * 2^exponent, and the last word is the leading one.
        let leading = words.last().map_or(0.0, |w| *w as f64 / 2f64.powi(64));
        let magnitude = match exponent {
            e if e > 1024 => f64::INFINITY,
            e if e < -1021 => 0.0,
            // In two steps, of which neither overflows alone.
            e => leading * 2f64.powi(e / 2) * 2f64.powi(e - e / 2),
        };
        if sign == Sign::Neg { -magnitude } else { magnitude }
    }

    /// The Euclidean norm of an array.
    pub fn norm<'a>(values: impl IntoIterator<Item = &'a Self>) -> Self {
        values.into_iter().fold(Self::zero(), |sum, x| x.fma(x, &sum)).sqrt()
    }
}

/// Exact: every `f64` is such a number.
impl From<f64> for Exact {
    fn from(x: f64) -> Self {
        Self(BigFloat::from_f64(x, BITS))
    }
}

impl Number for Exact {
    fn from_rational(q: Rational) -> Self {
        let [numerator, denominator] = [*q.numer(), *q.denom()].map(|n| Self(BigFloat::from_i128(n, BITS)));
        numerator.div(&denominator)
    }
    fn add(&self, b: &Self) -> Self {
        Self(self.0.add(&b.0, BITS, ROUNDING))
    }
    fn sub(&self, b: &Self) -> Self {
        Self(self.0.sub(&b.0, BITS, ROUNDING))
    }
    fn mul(&self, b: &Self) -> Self {
        Self(self.0.mul(&b.0, BITS, ROUNDING))
    }
    fn div(&self, b: &Self) -> Self {
        Self(self.0.div(&b.0, BITS, ROUNDING))
    }
    fn neg(&self) -> Self {
        Self(self.0.neg())
    }
    fn fma(&self, b: &Self, c: &Self) -> Self {
        self.mul(b).add(c)
    }
    fn sqrt(&self) -> Self {
        Self(self.0.sqrt(BITS, ROUNDING))
    }
    fn ln(&self) -> Self {
        with_constants(|c| self.0.ln(BITS, ROUNDING, c))
    }
    fn exp(&self) -> Self {
        with_constants(|c| self.0.exp(BITS, ROUNDING, c))
    }
    fn log1p(&self) -> Self {
        self.add(&Self::from(1.0)).ln()
    }
    fn expm1(&self) -> Self {
        self.exp().sub(&Self::from(1.0))
    }
    fn log1pmx(&self) -> Self {
        self.sub(&self.log1p())
    }
    fn expm1mx(&self) -> Self {
        self.expm1().sub(self)
    }
    fn powf(&self, b: &Self) -> Self {
        with_constants(|c| self.0.pow(&b.0, BITS, ROUNDING, c))
    }
    fn greater(&self, b: &Self) -> bool {
        self.0.cmp(&b.0).is_some_and(|order| order > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(what: &str, found: &Exact, wanted: &Exact) {
        let difference = found.sub(wanted).abs();
        // 40 bits for the operations of a case.
        let bound = wanted.abs().mul(&Exact::from(2f64.powi(40 - BITS as i32)));
        assert!(!difference.greater(&bound), "{what}: off by {:e}", difference.to_f64());
    }

    #[test]
    fn operations_keep_their_identities_to_400_bits() {
        let third = Exact::from_rational(Rational::new(1, 3));
        check("a third", &third.add(&third).add(&third), &Exact::from(1.0));
        let two = Exact::from(2.0);
        check("sqrt", &two.sqrt().mul(&two.sqrt()), &two);
        for x in [1e-3, 0.7, 3.0, 40.0] {
            let x = Exact::from(x);
            check("exp ln", &x.ln().exp(), &x);
            check("powf", &x.powf(&third).powf(&Exact::from(3.0)), &x);
            check("log1p expm1", &x.log1p().expm1(), &x);
        }
    }

    #[test]
    fn f64_come_back_and_others_are_rounded() {
        for x in [0.0, 1.0, -0.1, 1e300, -3e-300, f64::MAX, f64::MIN_POSITIVE] {
            assert_eq!(Exact::from(x).to_f64(), x);
        }
        assert_eq!(Exact::from(f64::MAX).mul(&Exact::from(4.0)).to_f64(), f64::INFINITY);
        assert_eq!(Exact::power_of_ten(-400).to_f64(), 0.0);
        assert!((Exact::power_of_ten(-40).to_f64() / 1e-40 - 1.0).abs() < 4.0 * f64::EPSILON);
        let undefined = Exact::from(-1.0).ln();
        assert!(!undefined.is_finite() && undefined.to_f64().is_nan() && !undefined.greater(&Exact::zero()));
    }
}

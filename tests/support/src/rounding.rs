//! A number that carries a bound of its own rounding error: where the tests' tolerances come from.
//!
//! Running error analysis (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., section 3.3): each operation
//! adds its own rounding, at most u |result|, to what its operands' errors become to first order. Bounds are kept in
//! units of the unit round-off u, so that one run of a kernel serves f32 and f64. Functions count 2 u: the standard
//! library's are within one unit in the last place.

use tensormass_codegen::ir::{Number, Rational};

/// The unit round-off of f32.
pub const SINGLE: f64 = 5.960_464_477_539_063e-8;
/// The unit round-off of f64.
pub const DOUBLE: f64 = 1.110_223_024_625_156_5e-16;
/// For what the first order leaves out.
const SLACK: f64 = 1.05;

/// A value, and a bound of its error in units of the unit round-off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounded {
    /// The value, as computed.
    pub value: f64,
    /// |value - exact value| <= error * u, to first order.
    pub error: f64,
}

impl Rounded {
    /// A number that is exact in the working precision.
    pub fn exact(value: f64) -> Self {
        Self { value, error: 0.0 }
    }

    /// The nearest number of the working precision to an exact one.
    pub fn nearest(value: f64) -> Self {
        Self { value, error: value.abs() }
    }

    /// The bound for unit round-off `u`.
    pub fn bound(self, u: f64) -> f64 {
        SLACK * u * self.error
    }

    fn function(self, value: f64, derivative: f64) -> Self {
        Self { value, error: derivative.abs() * self.error + 2.0 * value.abs() }
    }

    /// a to an integer power, by repeated multiplication.
    pub fn powi(self, n: i32) -> Self {
        match n {
            0 => Self::exact(1.0),
            n if n < 0 => Self::exact(1.0) / self.powi(-n),
            n => (1..n).fold(self, |product, _| product * self),
        }
    }
}

impl std::ops::Add for Rounded {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        let value = self.value + b.value;
        Self { value, error: self.error + b.error + value.abs() }
    }
}

impl std::ops::Sub for Rounded {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}

impl std::ops::Mul for Rounded {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        let value = self.value * b.value;
        // A factor 0 or 1 that is exact adds no rounding: without this, permuted rows would seem inexact.
        let exact = |x: Self| x.error == 0.0 && (x.value == 0.0 || x.value.abs() == 1.0);
        let own = if exact(self) || exact(b) { 0.0 } else { value.abs() };
        Self { value, error: self.value.abs() * b.error + b.value.abs() * self.error + own }
    }
}

impl std::ops::Div for Rounded {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        Self { value, error: (self.error + value.abs() * b.error) / b.value.abs() + value.abs() }
    }
}

impl std::ops::Neg for Rounded {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, error: self.error }
    }
}

impl std::iter::Sum for Rounded {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.reduce(|a, b| a + b).unwrap_or(Self::exact(0.0))
    }
}

impl Number for Rounded {
    fn from_rational(q: Rational) -> Self {
        let value = <f64 as Number>::from_rational(q);
        // Small numerators over powers of two are exact in f32 already.
        let exact = q.numer().unsigned_abs() < 1 << 24 && q.denom().unsigned_abs().is_power_of_two();
        if exact { Self::exact(value) } else { Self::nearest(value) }
    }
    fn add(&self, b: &Self) -> Self {
        *self + *b
    }
    fn sub(&self, b: &Self) -> Self {
        *self - *b
    }
    fn mul(&self, b: &Self) -> Self {
        *self * *b
    }
    fn div(&self, b: &Self) -> Self {
        *self / *b
    }
    fn neg(&self) -> Self {
        -*self
    }
    fn fma(&self, b: &Self, c: &Self) -> Self {
        let value = self.value.mul_add(b.value, c.value);
        let error = self.value.abs() * b.error + b.value.abs() * self.error + c.error + value.abs();
        Self { value, error }
    }
    fn sqrt(&self) -> Self {
        let value = self.value.sqrt();
        self.function(value, 0.5 / value)
    }
    fn ln(&self) -> Self {
        self.function(self.value.ln(), 1.0 / self.value)
    }
    fn exp(&self) -> Self {
        self.function(self.value.exp(), self.value.exp())
    }
    fn log1p(&self) -> Self {
        self.function(self.value.ln_1p(), 1.0 / (1.0 + self.value))
    }
    fn expm1(&self) -> Self {
        self.function(self.value.exp_m1(), self.value.exp())
    }
    fn powf(&self, b: &Self) -> Self {
        let value = self.value.powf(b.value);
        let base = self.function(value, b.value * self.value.powf(b.value - 1.0));
        Self { error: base.error + (value * self.value.ln()).abs() * b.error, ..base }
    }
    fn greater(&self, b: &Self) -> bool {
        self.value > b.value
    }
}

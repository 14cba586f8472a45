//! A number that carries a bound of its own rounding error: where the tests' tolerances come from.
//!
//! Running error analysis (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., section 3.3): each operation
//! adds its own rounding, at most u |result| for additions and multiplications, to what its operands' errors become to
//! first order. Bounds are kept in units of the unit round-off u, so that one run of a kernel serves f32 and f64. What
//! else a machine promises is its [`Accuracy`].

use std::marker::PhantomData;

use tensormass_codegen::ir::{Number, Rational, Remainder};

/// The unit round-off of f32.
pub const SINGLE: f64 = 5.960_464_477_539_063e-8;
/// The unit round-off of f64.
pub const DOUBLE: f64 = 1.110_223_024_625_156_5e-16;
/// For what the first order leaves out.
const SLACK: f64 = 1.05;

/// How accurate a machine's operations are: relative errors in units of the unit round-off. Additions, subtractions and
/// multiplications are rounded to nearest, or fused, which rounds less.
pub trait Accuracy: Copy + std::fmt::Debug + PartialEq {
    /// Whether it may add the terms of a sum in any order.
    const REORDERS: bool;
    /// Division.
    const DIVISION: f64;
    /// Square root.
    const SQRT: f64;
    /// Natural logarithm.
    const LN: f64;
    /// Exponential.
    const EXP: f64;
    /// ln(1 + x).
    const LOG1P: f64;
    /// exp(x) - 1.
    const EXPM1: f64;
    /// x - ln(1 + x).
    const LOG1PMX: f64;
    /// exp(x) - 1 - x.
    const EXPM1MX: f64;
    /// A power whose logarithm has this magnitude.
    fn powf(logarithm: f64) -> f64;
}

/// Rust on a CPU: IEEE 754 in the order of the text; the standard library's functions are within one unit in the last
/// place, which is at most 2 u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cpu;

impl Accuracy for Cpu {
    const REORDERS: bool = false;
    const DIVISION: f64 = 1.0;
    const SQRT: f64 = 2.0;
    const LN: f64 = 2.0;
    const EXP: f64 = 2.0;
    const LOG1P: f64 = 2.0;
    const EXPM1: f64 = 2.0;
    // Within 4 units, as their text says.
    const LOG1PMX: f64 = 8.0;
    const EXPM1MX: f64 = 8.0;
    fn powf(_: f64) -> f64 {
        2.0
    }
}

/// Units in the last place within which the functions that are printed into WGSL are said to be, where divisions round
/// as IEEE 754 says.
pub mod printed {
    /// `ln_`.
    pub const LN: f64 = 2.0;
    /// `log1p_`.
    pub const LOG1P: f64 = 2.0;
    /// `exp_`.
    pub const EXP: f64 = 2.0;
    /// `expm1_`.
    pub const EXPM1: f64 = 3.0;
    /// `log1pmx_`.
    pub const LOG1PMX: f64 = 6.0;
    /// `expm1mx_`.
    pub const EXPM1MX: f64 = 8.0;
    /// `powf_` of a power whose logarithm has this magnitude.
    pub fn powf(logarithm: f64) -> f64 {
        3.0 + 5.0 * logarithm
    }
}

/// WGSL in f32, and the functions that are printed into it.
///
/// The language's accuracies (W3C Candidate Recommendation, section 15.7.4) are: additions, subtractions and
/// multiplications correctly rounded, divisions within 2.5 units in the last place, square roots as 1 / inverseSqrt(x)
/// with 2 units for the latter; a unit is at most 2 u. It leaves open to which side is rounded: this assumes the nearest,
/// as IEEE 754 does. A compiler may reorder: this assumes that it does so within sums, within products (which costs
/// nothing, to first order) and by taking out common factors (which rounds less), and that it does not multiply out a
/// product of sums. Subnormal numbers may become 0: states are such that none occurs.
///
/// A division error of 4 u beyond IEEE 754's adds 4 u |y f| to a logarithm (y = f / (2 + f), see the printed text): for
/// `ln_`, |f| <= 0.414 and this is at most 0.82 u of it; for `log1p_`, f <= 1 and it is at most 1.92 u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wgsl;

impl Accuracy for Wgsl {
    const REORDERS: bool = true;
    const DIVISION: f64 = 2.0 * 2.5;
    const SQRT: f64 = 2.0 * (2.0 + 2.5);
    const LN: f64 = 2.0 * printed::LN + 1.0;
    const EXP: f64 = 2.0 * printed::EXP;
    const LOG1P: f64 = 2.0 * printed::LOG1P + 2.0;
    const EXPM1: f64 = 2.0 * printed::EXPM1;
    // y = x / (2 + x) enters as x y, and to the third power in what is subtracted, which is at most a quarter of that.
    const LOG1PMX: f64 = 2.0 * printed::LOG1PMX + 6.0;
    const EXPM1MX: f64 = 2.0 * printed::EXPM1MX;
    fn powf(logarithm: f64) -> f64 {
        // exp_(b * ln_(a)): the argument's relative error becomes |b ln a| times as large.
        Self::EXP + logarithm * (1.0 + Self::LN)
    }
}

/// A value, and a bound of its error in units of the unit round-off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounded<A: Accuracy> {
    /// The value, as computed.
    pub value: f64,
    /// |value - exact value| <= error * u, to first order.
    pub error: f64,
    /// How many terms it is the sum of, as far as a compiler that reorders sees them.
    terms: f64,
    /// The sum of the terms' magnitudes.
    magnitudes: f64,
    /// The sum of the terms' errors.
    inherited: f64,
    accuracy: PhantomData<A>,
}

/// A value as Rust computes it on a CPU.
pub type Rounded = Bounded<Cpu>;

impl<A: Accuracy> Bounded<A> {
    /// A value whose error is at most this many units of the unit round-off.
    pub fn new(value: f64, error: f64) -> Self {
        Self { value, error, terms: 1.0, magnitudes: value.abs(), inherited: error, accuracy: PhantomData }
    }

    /// A number that is exact in the working precision.
    pub fn exact(value: f64) -> Self {
        Self::new(value, 0.0)
    }

    /// The nearest number of the working precision to an exact one.
    pub fn nearest(value: f64) -> Self {
        Self::new(value, value.abs())
    }

    /// The bound for unit round-off `u`.
    pub fn bound(self, u: f64) -> f64 {
        SLACK * u * self.error
    }

    fn function(self, value: f64, derivative: f64, accuracy: f64) -> Self {
        Self::new(value, derivative.abs() * self.error + accuracy * value.abs())
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

impl<A: Accuracy> std::ops::Add for Bounded<A> {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        let value = self.value + b.value;
        let terms = self.terms + b.terms;
        let magnitudes = self.magnitudes + b.magnitudes;
        let inherited = self.inherited + b.inherited;
        // Added in any order, n terms take part in n - 1 roundings of partial sums, none greater than the magnitudes'
        // sum (Higham, section 4.2).
        let error =
            if A::REORDERS { inherited + (terms - 1.0) * magnitudes } else { self.error + b.error + value.abs() };
        Self { value, error, terms, magnitudes, inherited, accuracy: PhantomData }
    }
}

impl<A: Accuracy> std::ops::Sub for Bounded<A> {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}

impl<A: Accuracy> std::ops::Mul for Bounded<A> {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        let value = self.value * b.value;
        // A factor 0 or 1 that is exact adds no rounding: without this, permuted rows would seem inexact.
        let exact = |x: Self| x.error == 0.0 && (x.value == 0.0 || x.value.abs() == 1.0);
        let own = if exact(self) || exact(b) { 0.0 } else { value.abs() };
        Self::new(value, self.value.abs() * b.error + b.value.abs() * self.error + own)
    }
}

impl<A: Accuracy> std::ops::Div for Bounded<A> {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        Self::new(value, (self.error + value.abs() * b.error) / b.value.abs() + A::DIVISION * value.abs())
    }
}

impl<A: Accuracy> std::ops::Neg for Bounded<A> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, ..self }
    }
}

impl<A: Accuracy> std::iter::Sum for Bounded<A> {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.reduce(|a, b| a + b).unwrap_or(Self::exact(0.0))
    }
}

impl<A: Accuracy> Number for Bounded<A> {
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
        // Who reorders need not fuse: it may round the product, and add it in another place.
        if A::REORDERS {
            return *self * *b + *c;
        }
        let value = self.value.mul_add(b.value, c.value);
        Self::new(value, self.value.abs() * b.error + b.value.abs() * self.error + c.error + value.abs())
    }
    fn sqrt(&self) -> Self {
        let value = self.value.sqrt();
        self.function(value, 0.5 / value, A::SQRT)
    }
    fn ln(&self) -> Self {
        self.function(self.value.ln(), 1.0 / self.value, A::LN)
    }
    fn exp(&self) -> Self {
        self.function(self.value.exp(), self.value.exp(), A::EXP)
    }
    fn log1p(&self) -> Self {
        self.function(self.value.ln_1p(), 1.0 / (1.0 + self.value), A::LOG1P)
    }
    fn expm1(&self) -> Self {
        self.function(self.value.exp_m1(), self.value.exp(), A::EXPM1)
    }
    fn log1pmx(&self) -> Self {
        let x = self.value;
        self.function(Remainder::log1pmx(x), x / (1.0 + x), A::LOG1PMX)
    }
    fn expm1mx(&self) -> Self {
        self.function(Remainder::expm1mx(self.value), self.value.exp_m1(), A::EXPM1MX)
    }
    fn powf(&self, b: &Self) -> Self {
        let value = self.value.powf(b.value);
        let own = A::powf((b.value * self.value.ln()).abs());
        let base = self.function(value, b.value * self.value.powf(b.value - 1.0), own);
        Self::new(value, base.error + (value * self.value.ln()).abs() * b.error)
    }
    fn greater(&self, b: &Self) -> bool {
        self.value > b.value
    }
}

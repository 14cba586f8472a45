//! Logarithms and exponentials of lanes, within a unit in the last place or as [`Real`] says; in what is no ordinary
//! number, each lane's own.
//!
//! ln m = 2 artanh s with s = (m - 1) / (m + 1), for m within a factor of the square root of 2 of a power of 2, summed
//! such that the leading term, m - 1, is exact; exp x = 2^n exp r with |r| <= ln 2 / 2. Other sums are Taylor's.

use super::Lanes;
use crate::real::Real;

/// What logarithms and exponentials are made of.
pub(crate) trait Parts: Lanes<Scalar: Constants> {
    /// The exponent of a positive normal number: floor(log2 x).
    fn exponent(self) -> Self;
    /// x 2^k, of normal numbers.
    fn times_power(self, k: Self) -> Self;
    /// The nearest integer.
    fn round(self) -> Self;
    /// A function of one number, lane by lane.
    fn each(self, f: fn(Self::Scalar) -> Self::Scalar) -> Self;
}

/// What depends on the precision.
pub(crate) trait Constants: Real {
    /// ln 2 in so few digits that products with exponents are exact, and the rest of it.
    const LN_2: [f64; 2];
    /// The least and the greatest number whose logarithm is computed here.
    const LOGARITHM: [f64; 2];
    /// The greatest magnitude whose exponential is computed here.
    const EXPONENTIAL: f64;
    /// Coefficients of powers of s^2 in (2 artanh(s) / s - 2) / s^2, |s| <= 3 - 2 sqrt(2), as many as a pair has twice:
    /// Chebyshev's, within 2^-35 and 2^-64 of the logarithm.
    const LOGARITHM_SERIES: &'static [[f64; 2]];
    /// Terms of x - ln(1 + x), |s| <= 1/3.
    const LOG1PMX_TERMS: usize;
    /// The greatest power of r in its exponential.
    const EXP_TERMS: u32;
    /// The greatest power of x in exp x - 1 - x, |x| <= 1.
    const EXPM1MX_TERMS: u32;
}

impl Constants for f32 {
    // The rest of a truncation to 16 digits.
    const LN_2: [f64; 2] = {
        let high = f32::from_bits(std::f32::consts::LN_2.to_bits() & !0xff) as f64;
        [high, std::f64::consts::LN_2 - high]
    };
    const LOGARITHM: [f64; 2] = [f32::MIN_POSITIVE as f64, 8.507_059_173_023_462e37];
    const EXPONENTIAL: f64 = 87.0;
    const LOGARITHM_SERIES: &'static [[f64; 2]] =
        &[[0.6666666655449709, 0.40000121839806124], [0.28550820815960665, 0.23330467216303835]];
    const LOG1PMX_TERMS: usize = 8;
    const EXP_TERMS: u32 = 7;
    const EXPM1MX_TERMS: u32 = 12;
}

impl Constants for f64 {
    // 42 digits; what ln 2 has beyond the digits of the f64 is 2.319e-17.
    const LN_2: [f64; 2] = {
        let high = f64::from_bits(std::f64::consts::LN_2.to_bits() & !0x7ff);
        [high, (std::f64::consts::LN_2 - high) + 2.319_046_813_846_299_6e-17]
    };
    const LOGARITHM: [f64; 2] = [f64::MIN_POSITIVE, 4.494_232_837_155_79e307];
    const EXPONENTIAL: f64 = 708.0;
    const LOGARITHM_SERIES: &'static [[f64; 2]] = &[
        [0.6666666666666666, 0.4000000000000088],
        [0.28571428570803614, 0.22222222391713917],
        [0.18181795640132906, 0.15386239702814658],
        [0.13268773138656886, 0.13086626147840102],
    ];
    const LOG1PMX_TERMS: usize = 17;
    const EXP_TERMS: u32 = 13;
    const EXPM1MX_TERMS: u32 = 20;
}

/// Whether all lanes are between two numbers.
#[inline(always)]
fn between<V: Lanes>(x: V, low: f64, high: f64) -> bool {
    let (zero, one) = (V::from_f64(0.0), V::from_f64(1.0));
    V::select_greater(x, V::from_f64(low), V::select_greater(V::from_f64(high), x, one, zero), zero).is_positive()
}

/// f^2 / 2, and what s = f / (2 + f) multiplies in ln(1 + f) = f - f^2 / 2 + s (f^2 / 2 + s^2 (2/3 + 2/5 s^2 + ..)), for
/// 1 + f within a factor of the square root of 2 of 1; and s.
#[inline(always)]
fn parts<V: Parts>(f: V) -> [V; 3] {
    let s = f / (V::from_f64(2.0) + f);
    let z = s * s;
    // Even and odd powers beside each other: one chain would be twice as long.
    let (square, coefficients) = (z * z, <V::Scalar as Constants>::LOGARITHM_SERIES);
    let (mut even, mut odd) = (V::from_f64(0.0), V::from_f64(0.0));
    for n in (0..coefficients.len()).rev() {
        even = even.mul_add(square, V::from_f64(coefficients[n][0]));
        odd = odd.mul_add(square, V::from_f64(coefficients[n][1]));
    }
    let series = odd.mul_add(z, even);
    let half_square = V::from_f64(0.5) * f * f;
    [half_square, z.mul_add(series, half_square), s]
}

/// k ln 2 + ln(1 + f) + rest, for such an f.
#[inline(always)]
fn sum<V: Parts>(k: V, f: V, rest: V) -> V {
    let [half_square, factor, s] = parts(f);
    let [high, low] = <V::Scalar as Constants>::LN_2.map(V::from_f64);
    let small = s.mul_add(factor, k.mul_add(low, rest));
    k * high - ((half_square - small) - f)
}

/// The power of 2 to which x is nearest, within the square root of 2.
#[inline(always)]
fn nearest_power<V: Parts>(x: V) -> V {
    (x * V::from_f64(std::f64::consts::SQRT_2)).exponent()
}

#[inline(always)]
pub(crate) fn ln<V: Parts>(x: V) -> V {
    let [low, high] = <V::Scalar as Constants>::LOGARITHM;
    if !between(x, low, high) {
        return x.each(Real::ln);
    }
    let k = nearest_power(x);
    sum(k, x.times_power(-k) - V::from_f64(1.0), V::from_f64(0.0))
}

#[inline(always)]
pub(crate) fn ln_1p<V: Parts>(x: V) -> V {
    // Mostly all lanes are near 1: bit for bit what follows, where k is 0.
    if between(x, -0.29, 0.41) {
        let [half_square, factor, s] = parts(x);
        return x - (half_square - s * factor);
    }
    let [low, high] = <V::Scalar as Constants>::LOGARITHM;
    let (zero, one) = (V::from_f64(0.0), V::from_f64(1.0));
    let u = one + x;
    if !between(u, low, high) {
        return x.each(Real::ln_1p);
    }
    let k = nearest_power(u);
    // What u has lost of 1 + x, exactly; nothing is lost where the power is 1.
    let t = u - one;
    let lost = (one - (u - t)) + (x - t);
    let is_one = |then, otherwise| V::select_greater(V::from_f64(0.5), k * k, then, otherwise);
    sum(k, is_one(x, u.times_power(-k) - one), is_one(zero, lost / u))
}

#[inline(always)]
pub(crate) fn log1pmx<V: Parts>(x: V) -> V {
    // As for numbers: x - ln(1 + x) = x s - 2 s^3 (1/3 + s^2/5 + ..), s = x / (2 + x).
    let s = x / (V::from_f64(2.0) + x);
    let z = s * s;
    let mut series = V::from_f64(0.0);
    for n in (1..=<V::Scalar as Constants>::LOG1PMX_TERMS).rev() {
        series = series.mul_add(z, V::from_f64(1.0 / (2 * n + 1) as f64));
    }
    let near = s * (x - V::from_f64(2.0) * z * series);
    if between(x, -0.5, 1.0) {
        return near;
    }
    let far = x - ln_1p(x);
    V::select_greater(x, V::from_f64(-0.5), V::select_greater(V::from_f64(1.0), x, near, far), far)
}

/// x = n ln 2 + r: n, and exp(r) - 1.
#[inline(always)]
fn reduced<V: Parts>(x: V) -> [V; 2] {
    let n = (x * V::from_f64(std::f64::consts::LOG2_E)).round();
    let [high, low] = <V::Scalar as Constants>::LN_2.map(|l| V::from_f64(-l));
    let r = n.mul_add(low, n.mul_add(high, x));
    let series = exponential_series(r, <V::Scalar as Constants>::EXP_TERMS);
    [n, (r * r).mul_add(series, r)]
}

/// 1/2 + x/6 + x^2/24 + .., up to x^terms / terms! in the exponential.
#[inline(always)]
fn exponential_series<V: Lanes>(x: V, terms: u32) -> V {
    let mut series = V::from_f64(0.0);
    for n in (2..=terms).rev() {
        let factorial: f64 = (1..=n).map(f64::from).product();
        series = series.mul_add(x, V::from_f64(1.0 / factorial));
    }
    series
}

#[inline(always)]
pub(crate) fn exp<V: Parts>(x: V) -> V {
    let limit = <V::Scalar as Constants>::EXPONENTIAL;
    if !between(x, -limit, limit) {
        return x.each(Real::exp);
    }
    let [n, less_one] = reduced(x);
    (V::from_f64(1.0) + less_one).times_power(n)
}

#[inline(always)]
pub(crate) fn exp_m1<V: Parts>(x: V) -> V {
    let limit = <V::Scalar as Constants>::EXPONENTIAL;
    if !between(x, -limit, limit) {
        return x.each(Real::exp_m1);
    }
    let [n, less_one] = reduced(x);
    let one = V::from_f64(1.0);
    less_one.times_power(n) + (one.times_power(n) - one)
}

#[inline(always)]
pub(crate) fn expm1mx<V: Parts>(x: V) -> V {
    let near = x * x * exponential_series(x, <V::Scalar as Constants>::EXPM1MX_TERMS);
    if between(x, -1.0, 1.0) {
        return near;
    }
    let far = exp_m1(x) - x;
    let inside = V::select_greater(V::from_f64(1.0), x, near, far);
    V::select_greater(x, V::from_f64(-1.0), inside, far)
}

#[cfg(test)]
mod tests;

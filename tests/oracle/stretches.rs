//! tr C^s for the oracle, by quadrature: no eigenvalues, so that equal stretches are no exception.
//!
//! For 0 < f < 1, c^f = sin(pi f)/pi times the integral over u of e^(f u) c / (c + e^u) (Higham, Functions of Matrices,
//! section 7.1). In u the integrand is analytic in |Im u| < pi and the trapezoidal rule with step h is wrong by about
//! 2 exp(-2 pi^2 / h) of it; far out the terms are geometric series. Whole powers of C are multiplied out.

use std::f64::consts::PI;

use tensormass_testing::codegen::ir::Number as _;
use tensormass_testing::rounding::Rounded;

use super::{Number, Tensor, constant, ddot, det, identity, lit, tr};

/// 2 exp(-2 pi^2 / h) is 1.4e-17.
const STEP: f64 = 0.5;
/// Nodes on each side of u = 0; e^(-42) is 6e-19, where c / (c + x) is 1 or c / x for ordinary c.
const SIDE: i32 = 84;

fn product(a: Tensor, b: Tensor) -> Tensor {
    Tensor(std::array::from_fn(|k| {
        let term = |m: usize| a.0[3 * (k / 3) + m] * b.0[3 * m + k % 3];
        term(0) + term(1) + term(2)
    }))
}

/// The transposed cofactors; A is symmetric.
fn adjugate(a: Tensor) -> Tensor {
    let at = |i: usize, j: usize| a.0[3 * (i % 3) + j % 3];
    Tensor(std::array::from_fn(|k| {
        let (i, j) = (k / 3, k % 3);
        at(i + 1, j + 1) * at(i + 2, j + 2) - at(i + 1, j + 2) * at(i + 2, j + 1)
    }))
}

fn scaled(r: Rounded, x: Number) -> Number {
    constant(r) * x
}

/// tr C^s for a positive definite C.
pub fn trace_of_power(c: Tensor, s: Rounded) -> Number {
    if s.value < 0.0 {
        let j = det(c);
        return trace_of_power(adjugate(c) / j, -s);
    }
    let whole = s.value.floor();
    let f = s - Rounded::exact(whole);
    let power = (0..whole as usize).fold(identity(), |power, _| product(power, c));
    if f.value == 0.0 {
        return tr(power);
    }
    let next = product(power, c);
    let mut sum = lit(0.0);
    for k in -SIDE..=SIDE {
        let u = STEP * f64::from(k);
        let shifted = c + identity() * constant(Rounded::nearest(u.exp()));
        let weight = (f * Rounded::exact(u)).exp();
        sum = sum + scaled(weight, ddot(next, adjugate(shifted)) / det(shifted));
    }
    let end = Rounded::exact(STEP * f64::from(SIDE));
    // The sum over k > 0 of e^(-r (end + k h)).
    let tail = |r: Rounded| (-(r * end)).exp() / (r * Rounded::exact(STEP)).expm1();
    sum = sum + scaled(tail(f), tr(power)) + scaled(tail(Rounded::exact(1.0) - f), tr(next));
    let angle = PI * f.value;
    let sine = Rounded::new(angle.sin(), PI * (f.error + 2.0 * f.value) * angle.cos().abs() + 2.0 * angle.sin());
    scaled(sine * Rounded::exact(STEP) / Rounded::nearest(PI), sum)
}

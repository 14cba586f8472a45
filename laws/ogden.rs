//! Ogden solid of three terms in the modified principal stretches lambdabar_i = J^(-1/3) lambda_i:
//! W = sum_p mu_p/alpha_p (lambdabar_1^alpha_p + lambdabar_2^alpha_p + lambdabar_3^alpha_p - 3)
//!   + kappa/4 (J^2 - 1 - 2 ln J).
//! Ogden, Proc. R. Soc. Lond. A 326, 565-584, 1972 (defaults: its fit to Treloar's vulcanised rubber, in Pa as commonly
//! rounded); the volumetric part is that of Ogden, Proc. R. Soc. Lond. A 328, 567-583, 1972, with beta = -2 (Simo & Miehe
//! 1992; Holzapfel, Nonlinear Solid Mechanics, 2000, section 6.5): its beta = 9 for rubber passes the range of single
//! precision in strong compression.
//!
//! The shear modulus at rest is half the sum of mu_p alpha_p. Terms with a positive and with a negative exponent are
//! parameters apart, so that the range of neither holds 0, where mu/alpha is infinite. A term with mu = 0 is left out.
#[domain(J > 0.0)]
#[small_strain_moduli(
    shear = (mu[0] * alpha[0] + mu[1] * alpha[1] + mu_negative * alpha_negative) / 2.0,
    bulk = kappa
)]
struct Parameters {
    /// Moduli of the terms with positive exponents.
    #[unit("Pa")] #[range(0.0, 1e12)] #[default(6.3e5, 0.012e5)] mu: [f64; 2],
    /// Positive exponents.
    #[unit("1")] #[range(0.1, 30.0)] #[default(1.3, 5.0)] alpha: [f64; 2],
    /// Modulus of the term with a negative exponent.
    #[unit("Pa")] #[range(-1e12, 0.0)] #[default(-0.1e5)] mu_negative: f64,
    /// Negative exponent.
    #[unit("1")] #[range(-30.0, -0.1)] #[default(-2.0)] alpha_negative: f64,
    /// Bulk modulus at rest.
    #[unit("Pa")] #[range(1e0, 1e12)] kappa: f64,
}
fn term(s: Strain, mu: f64, alpha: f64) -> f64 {
    mu / alpha * (s.J.powf(-alpha / 3.0) * s.stretch_sum(alpha) - 3.0)
}
fn energy_density_isochoric(s: Strain, p: Parameters) -> f64 {
    sum(0..2, |i| term(s, p.mu[i], p.alpha[i])) + term(s, p.mu_negative, p.alpha_negative)
}
fn energy_density_volumetric(s: Strain, p: Parameters) -> f64 {
    p.kappa / 4.0 * (s.J.powi(2) - 1.0 - 2.0 * ln(s.J))
}

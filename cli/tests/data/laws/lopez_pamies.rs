//! Two powers of I1, W = sum_i 3^(1 - a_i)/(2 a_i) mu_i (I1^a_i - 3^a_i) - (mu1 + mu2) ln J + lambda/2 (J - 1)^2.
//! Lopez-Pamies, A new I1-based hyperelastic model for rubber elastic materials, Comptes Rendus Mecanique 338, 2010.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = mu1 + mu2, lame_lambda = lambda + 2.0 / 3.0 * (mu1 * (a1 - 1.0) + mu2 * (a2 - 1.0)))]
struct Parameters {
    /// First modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] mu1: f64,
    /// Second modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] mu2: f64,
    /// First exponent.
    #[unit("1")] #[range(0.5, 2.0)] #[default(1.026)] a1: f64,
    /// Second exponent.
    #[unit("1")] #[range(-3.0, -0.1)] #[default(-0.5)] a2: f64,
    /// Volumetric constant.
    #[unit("Pa")] #[range(1e0, 1e14)] lambda: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    powf(3.0, 1.0 - p.a1) / (2.0 * p.a1) * p.mu1 * (powf(s.I1, p.a1) - powf(3.0, p.a1))
        + powf(3.0, 1.0 - p.a2) / (2.0 * p.a2) * p.mu2 * (powf(s.I1, p.a2) - powf(3.0, p.a2))
        - (p.mu1 + p.mu2) * ln(s.J) + p.lambda / 2.0 * (s.J - 1.0).powi(2)
}

//! Exponential of a quadratic form of the Green strain, W = c/2 (exp(a1 (tr E)^2 + a2 E:E) - 1).
//! After Fung, Biomechanics: Mechanical Properties of Living Tissues, 2nd ed., 1993, chapter 7, for isotropy.
#[small_strain_moduli(shear = c * a2 / 2.0, lame_lambda = c * a1)]
struct Parameters {
    /// Stiffness.
    #[unit("Pa")] #[range(1e0, 1e12)] c: f64,
    /// Stiffening by volume.
    #[unit("1")] #[range(1e-2, 1e5)] a1: f64,
    /// Stiffening.
    #[unit("1")] #[range(1e-2, 1e2)] a2: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    let q = p.a1 * tr(s.E).powi(2) + p.a2 * ddot(s.E, s.E);
    p.c / 2.0 * (exp(q) - 1.0)
}

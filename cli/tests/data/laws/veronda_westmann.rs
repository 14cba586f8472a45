//! Skin, W = c1 (exp(c2 (I1bar - 3)) - 1) - c1 c2 / 2 (I2bar - 3) + kappa/2 (ln J)^2.
//! Veronda & Westmann, Mechanical characterization of skin - finite deformations, Journal of Biomechanics 3, 1970, with
//! the volumetric part of the FEBio theory manual.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = c1 * c2, bulk = kappa)]
struct Parameters {
    /// Stress-like parameter.
    #[unit("Pa")] #[range(1e0, 1e12)] c1: f64,
    /// Exponent.
    #[unit("1")] #[range(0.01, 10.0)] c2: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.c1 * ((p.c2 * (s.I1bar - 3.0)).exp() - 1.0) - p.c1 * p.c2 / 2.0 * (s.I2bar - 3.0) + p.kappa / 2.0 * s.J.ln().powi(2)
}

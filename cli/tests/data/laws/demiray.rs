//! Exponential solid, W = mu/(2 b) (exp(b (I1bar - 3)) - 1) + kappa/2 (J - 1)^2.
//! Demiray, A note on the elasticity of soft biological tissues, Journal of Biomechanics 5, 1972; incompressible there.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = mu, bulk = kappa)]
struct Parameters {
    /// Shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] mu: f64,
    /// Stiffening.
    #[unit("1")] #[range(1e-3, 1e2)] b: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.mu / (2.0 * p.b) * (exp(p.b * (s.I1bar - 3.0)) - 1.0) + p.kappa / 2.0 * (s.J - 1.0).powi(2)
}

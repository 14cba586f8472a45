//! Power law, W = mu/(2 b) ((1 + b/n (I1bar - 3))^n - 1) + kappa/2 (J - 1)^2.
//! Knowles, The finite anti-plane shear field near the tip of a crack for a class of incompressible elastic solids,
//! International Journal of Fracture 13, 1977; incompressible there.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = mu, bulk = kappa)]
struct Parameters {
    /// Shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] mu: f64,
    /// Scale of the strain.
    #[unit("1")] #[range(1e-3, 1e2)] b: f64,
    /// Exponent.
    #[unit("1")] #[range(0.3, 5.0)] #[default(0.75)] n: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.mu / (2.0 * p.b) * ((1.0 + p.b / p.n * (s.I1bar - 3.0)).powf(p.n) - 1.0) + p.kappa / 2.0 * (s.J - 1.0).powi(2)
}

//! Rational volumetric part beside a neo-Hookean isochoric one, W = mu/2 (I1bar - 3) + kappa/50 (J^5 + J^-5 - 2).
//! Hartmann & Neff, Polyconvexity of generalized polynomial-type hyperelastic strain energy functions for
//! near-incompressibility, International Journal of Solids and Structures 40, 2003.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = mu, bulk = kappa)]
struct Parameters {
    /// Shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] mu: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.mu / 2.0 * (s.I1bar - 3.0) + p.kappa / 50.0 * (s.J.powi(5) + s.J.powi(-5) - 2.0)
}

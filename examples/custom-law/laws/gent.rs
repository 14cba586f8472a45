//! Gent solid: rubber whose chains cannot be stretched beyond a limit.
//! W = -mu j_m/2 ln(1 - (I1bar - 3) / j_m) + kappa/2 (J - 1)^2.
//! Gent, A New Constitutive Relation for Rubber, Rubber Chemistry and Technology 69, 1996, doi:10.5254/1.3538357, for
//! incompressible rubber; here with I1bar for I1, and a quadratic penalty as the volumetric part.
#[domain(select(J > 0.0, j_m - (I1bar - 3.0), J) > 0.0)]
struct Parameters {
    /// Shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] mu: f64,
    /// Limit J_m of I1bar - 3, at which the chains are fully extended.
    #[unit("1")] #[range(1.0, 1e6)] j_m: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
}
fn energy_density_isochoric(s: Strain, p: Parameters) -> f64 {
    -p.mu * p.j_m / 2.0 * ln(1.0 - (s.I1bar - 3.0) / p.j_m)
}
fn energy_density_volumetric(s: Strain, p: Parameters) -> f64 {
    p.kappa / 2.0 * (s.J - 1.0).powi(2)
}

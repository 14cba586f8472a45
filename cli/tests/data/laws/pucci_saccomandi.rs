//! Gent's limit with a term in the second invariant, W = -mu jm/2 ln(1 - (I1bar - 3)/jm) + c2 ln(I2bar/3) + kappa/2 (J - 1)^2.
//! Pucci & Saccomandi, A note on the Gent model for rubber-like materials, Rubber Chemistry and Technology 75, 2002;
//! incompressible there.
#[domain(select(J > 0.0, jm - (I1bar - 3.0), J) > 0.0)]
#[small_strain_moduli(shear = mu + 2.0 / 3.0 * c2, bulk = kappa)]
struct Parameters {
    /// Shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] mu: f64,
    /// Limit of I1bar - 3.
    #[unit("1")] #[range(1.0, 1e4)] #[default(50.0)] jm: f64,
    /// Second constant.
    #[unit("Pa")] #[range(0.0, 1e12)] c2: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    -p.mu * p.jm / 2.0 * ln(1.0 - (s.I1bar - 3.0) / p.jm) + p.c2 * ln(s.I2bar / 3.0) + p.kappa / 2.0 * (s.J - 1.0).powi(2)
}

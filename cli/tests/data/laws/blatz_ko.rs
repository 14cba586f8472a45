//! Foamed rubber, W = mu/2 (I2/I3 + 2 sqrt(I3) - 5).
//! Blatz & Ko, Application of finite elastic theory to the deformation of rubbery materials, Transactions of the Society of
//! Rheology 6, 1962, f = 0 and nu = 1/4.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = mu, lame_lambda = mu)]
struct Parameters {
    /// Shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] mu: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.mu / 2.0 * (s.I2 / s.I3 + 2.0 * sqrt(s.I3) - 5.0)
}

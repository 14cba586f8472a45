//! Stable neo-Hookean solid: its energy stays finite where elements are inverted.
//! W = mu/2 (I1 - 3) + lambda/2 (J - alpha)^2 - mu/2 ln(I1 + 1) with alpha = 1 + 3 mu/(4 lambda).
//! Smith, de Goes & Kim, Stable Neo-Hookean Flesh Simulation, ACM Transactions on Graphics 37(2), 2018,
//! doi:10.1145/3180491, section 3: mu and lambda are those with which small strains agree with Hooke's law.
#[small_strain_moduli(shear = shear_modulus(young, poisson), bulk = bulk_modulus(young, poisson))]
struct Parameters {
    /// Young's modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] young: f64,
    /// Poisson's ratio.
    #[unit("1")] #[range(0.0, 0.4999)] poisson: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    let mu_lame = shear_modulus(p.young, p.poisson);
    let lambda_lame = lame_lambda(p.young, p.poisson);
    let mu = 4.0 / 3.0 * mu_lame;
    let lambda = lambda_lame + 5.0 / 6.0 * mu_lame;
    let alpha = 1.0 + mu / lambda - mu / (4.0 * lambda);
    mu / 2.0 * (s.I1 - 3.0) + lambda / 2.0 * (s.J - alpha).powi(2) - mu / 2.0 * ln(s.I1 + 1.0)
}

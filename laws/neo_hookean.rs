//! Compressible neo-Hookean solid with a logarithmic volumetric term.
//! Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed., eq. 6.27.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = shear_modulus(young, poisson), bulk = bulk_modulus(young, poisson))]
struct Parameters {
    /// Young's modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] young: f64,
    /// Poisson's ratio.
    #[unit("1")] #[range(-0.9, 0.4999)] poisson: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    let mu = shear_modulus(p.young, p.poisson);
    let lambda = lame_lambda(p.young, p.poisson);
    mu / 2.0 * (s.I1 - 3.0) - mu * ln(s.J) + lambda / 2.0 * ln(s.J).powi(2)
}

//! Kelvin-Voigt solid at finite strain: a logarithmic neo-Hookean spring beside a dashpot, whose stress is linear in
//! the rate of the Green strain, S_v = 2 eta dE/dt + (zeta - 2/3 eta) tr(dE/dt) I.
//! Spring: Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed., eq. 6.27. Dashpot: Landau &
//! Lifshitz, Theory of Elasticity, 3rd ed., section 34, in E for the small strain, so that rotation is free.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = shear_modulus(young, poisson), bulk = bulk_modulus(young, poisson))]
struct Parameters {
    /// Young's modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] young: f64,
    /// Poisson's ratio.
    #[unit("1")] #[range(-0.9, 0.4999)] poisson: f64,
    /// Shear viscosity eta.
    #[unit("Pa s")] #[range(0.0, 1e12)] shear_viscosity: f64,
    /// Bulk viscosity zeta.
    #[unit("Pa s")] #[range(0.0, 1e12)] #[default(0.0)] bulk_viscosity: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    let mu = shear_modulus(p.young, p.poisson);
    let lambda = lame_lambda(p.young, p.poisson);
    mu / 2.0 * (s.I1 - 3.0) - mu * ln(s.J) + lambda / 2.0 * ln(s.J).powi(2)
}
fn dissipation_density(s: Strain, r: StrainRate, p: Parameters) -> f64 {
    p.shear_viscosity * (ddot(r.E, r.E) - tr(r.E).powi(2) / 3.0) + p.bulk_viscosity / 2.0 * tr(r.E).powi(2)
}

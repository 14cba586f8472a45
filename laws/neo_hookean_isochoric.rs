//! Neo-Hookean solid with isochoric and volumetric parts apart, W = mu/2 (I1bar - 3) + K/2 (J - 1)^2.
//! The model that Li, Guo, Liu, Wang & Qin, A GPU-Accelerated Finite Element Solver for Simulation of Soft-Body
//! Deformation, 2014, take from Taylor, Cheng & Ourselin, IEEE Transactions on Medical Imaging 27(5), 2008.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = shear_modulus(young, poisson), bulk = bulk_modulus(young, poisson))]
struct Parameters {
    /// Young's modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] young: f64,
    /// Poisson's ratio.
    #[unit("1")] #[range(-0.9, 0.4999)] poisson: f64,
}
fn energy_density_isochoric(s: Strain, p: Parameters) -> f64 {
    shear_modulus(p.young, p.poisson) / 2.0 * (s.I1bar - 3.0)
}
fn energy_density_volumetric(s: Strain, p: Parameters) -> f64 {
    bulk_modulus(p.young, p.poisson) / 2.0 * (s.J - 1.0).powi(2)
}

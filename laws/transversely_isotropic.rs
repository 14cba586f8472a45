//! Transversely isotropic solid: a neo-Hookean ground and one family of fibres.
//! Bonet & Burton, A simple orthotropic, transversely isotropic hyperelastic constitutive equation for large strain
//! computations, Computer Methods in Applied Mechanics and Engineering 162, 1998. The constants are those with which
//! its linearisation has the moduli below, with n = E/E_A (eq. 55g prints its inverse); nu is the contraction across
//! for a stretch along the fibres, too. The material is stable at rest where 1 - nu > 2 nu^2 young / axial_young.
#[domain(J > 0.0)]
struct Parameters {
    /// Young's modulus across the fibres.
    #[unit("Pa")] #[range(1e0, 1e12)] young: f64,
    /// Young's modulus along the fibres.
    #[unit("Pa")] #[range(1e0, 1e12)] axial_young: f64,
    /// Shear modulus between the fibres' direction and those across.
    #[unit("Pa")] #[range(1e0, 1e12)] axial_shear: f64,
    /// Poisson's ratio.
    #[unit("1")] #[range(-0.9, 0.4999)] poisson: f64,
    /// Direction of the fibres at rest.
    #[per_element] fibre: Direction,
}
fn energy_density_isotropic(s: Strain, p: Parameters) -> f64 {
    let mu = shear_modulus(p.young, p.poisson);
    mu / 2.0 * (s.I1 - 3.0) - mu * ln(s.J) + lambda(p) / 2.0 * (s.J - 1.0).powi(2)
}
fn energy_density_fibre(s: Strain, p: Parameters) -> f64 {
    let n = p.young / p.axial_young;
    let m = 1.0 - p.poisson - 2.0 * n * p.poisson.powi(2);
    let mu = shear_modulus(p.young, p.poisson);
    let alpha = mu - p.axial_shear;
    let beta = p.young * p.poisson.powi(2) * (1.0 - n) / (4.0 * m * (1.0 + p.poisson));
    let gamma = p.axial_young * (1.0 - p.poisson) / (8.0 * m) - (lambda(p) + 2.0 * mu) / 8.0 + alpha / 2.0 - beta;
    let i4 = s.I4(p.fibre) - 1.0;
    (alpha + 2.0 * beta * ln(s.J) + gamma * i4) * i4 - alpha / 2.0 * (s.I5(p.fibre) - 1.0)
}
fn lambda(p: Parameters) -> f64 {
    let n = p.young / p.axial_young;
    let m = 1.0 - p.poisson - 2.0 * n * p.poisson.powi(2);
    p.young * (p.poisson + n * p.poisson.powi(2)) / (m * (1.0 + p.poisson))
}

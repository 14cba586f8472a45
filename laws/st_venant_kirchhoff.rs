//! St. Venant-Kirchhoff solid: Hooke's law in the Green strain, W = lambda/2 tr(E)^2 + mu E:E.
//! Faure, Zara, Jaillet & Moreau, An Implicit Tensor-Mass Solver on the GPU for Soft Bodies Simulation, VRIPHYS 2012,
//! eq. 10. It softens under compression (its stress turns at a stretch of 1/sqrt(3)): the range of stretches is the one in which
//! a bent beam of it agrees with a neo-Hookean one within some percent.
#[valid_stretches(0.8, 1.3)]
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
    lambda / 2.0 * tr(s.E).powi(2) + mu * ddot(s.E, s.E)
}

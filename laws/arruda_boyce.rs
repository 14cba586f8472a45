//! Arruda-Boyce solid: rubber as a network of chains of N rigid links, eight chains a cell.
//! Five terms of the series of the inverse Langevin function.
//! Arruda & Boyce, A Three-Dimensional Constitutive Model for the Large Stretch Behavior of Rubber Elastic Materials,
//! Journal of the Mechanics and Physics of Solids 41, 1993, doi:10.1016/0022-5096(93)90013-6, for incompressible
//! rubber; here with I1bar for I1, and a quadratic penalty as the volumetric part.
#[domain(J > 0.0)]
#[small_strain_moduli(
    shear = c_r * (1.0 + 3.0 / (5.0 * n) + 99.0 / (175.0 * n.powi(2)) + 513.0 / (875.0 * n.powi(3))
        + 42039.0 / (67375.0 * n.powi(4))),
    bulk = kappa
)]
struct Parameters {
    /// Rubbery modulus C_R: chain density times Boltzmann's constant times temperature.
    #[unit("Pa")] #[range(1e0, 1e12)] c_r: f64,
    /// Rigid links of a chain, the square of its locking stretch.
    #[unit("1")] #[range(1.0, 1e6)] n: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
}
fn energy_density_isochoric(s: Strain, p: Parameters) -> f64 {
    p.c_r * (1.0 / 2.0 * (s.I1bar - 3.0)
        + 1.0 / (20.0 * p.n) * (s.I1bar.powi(2) - 9.0)
        + 11.0 / (1050.0 * p.n.powi(2)) * (s.I1bar.powi(3) - 27.0)
        + 19.0 / (7000.0 * p.n.powi(3)) * (s.I1bar.powi(4) - 81.0)
        + 519.0 / (673750.0 * p.n.powi(4)) * (s.I1bar.powi(5) - 243.0))
}
fn energy_density_volumetric(s: Strain, p: Parameters) -> f64 {
    p.kappa / 2.0 * (s.J - 1.0).powi(2)
}

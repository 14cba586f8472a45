//! Mooney-Rivlin solid with isochoric and volumetric parts apart.
//! W = c10 (I1bar - 3) + c01 (I2bar - 3) + kappa/2 (J - 1)^2.
//! Mooney, Journal of Applied Physics 11, 1940, doi:10.1063/1.1712836, in the invariants of Rivlin, Philosophical
//! Transactions of the Royal Society A 241, 1948, doi:10.1098/rsta.1948.0024; the split is that of Holzapfel, Nonlinear
//! Solid Mechanics, 2000, section 6.4.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = 2.0 * (c10 + c01), bulk = kappa)]
struct Parameters {
    /// First Mooney-Rivlin constant; twice the sum of both is the shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] c10: f64,
    /// Second Mooney-Rivlin constant.
    #[unit("Pa")] #[range(0.0, 1e12)] c01: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
}
fn energy_density_isochoric(s: Strain, p: Parameters) -> f64 {
    p.c10 * (s.I1bar - 3.0) + p.c01 * (s.I2bar - 3.0)
}
fn energy_density_volumetric(s: Strain, p: Parameters) -> f64 {
    p.kappa / 2.0 * (s.J - 1.0).powi(2)
}

//! Compressible Mooney-Rivlin solid, with isochoric and volumetric parts.
//! Mooney, J. Appl. Phys. 11 (1940) 582, doi:10.1063/1.1712836, in the invariants of Rivlin, Phil. Trans. R. Soc. A 241
//! (1948) 379, doi:10.1098/rsta.1948.0024, of the isochoric part of C; the volumetric part is a quadratic penalty.
#[domain(J > 0.0)]
struct Parameters {
    /// First Mooney-Rivlin constant.
    #[unit("Pa")] #[range(1e0, 1e12)] c10: f64,
    /// Second Mooney-Rivlin constant.
    #[unit("Pa")] #[range(0.0, 1e12)] c01: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] bulk: f64,
}
fn energy_density_isochoric(s: Strain, p: Parameters) -> f64 {
    p.c10 * (s.I1bar - 3.0) + p.c01 * (s.I2bar - 3.0)
}
fn energy_density_volumetric(s: Strain, p: Parameters) -> f64 {
    p.bulk / 2.0 * (s.J - 1.0).powi(2)
}

//! Yeoh solid: three powers of the first isochoric invariant, and a volumetric part.
//! W = c10 (I1bar - 3) + c20 (I1bar - 3)^2 + c30 (I1bar - 3)^3 + kappa/2 (J - 1)^2.
//! Yeoh, Some Forms of the Strain Energy Function for Rubber, Rubber Chemistry and Technology 66, 1993,
//! doi:10.5254/1.3538343, for incompressible rubber; the volumetric part is a quadratic penalty.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = 2.0 * c10, bulk = kappa)]
struct Parameters {
    /// First constant, half the shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] c10: f64,
    /// Second constant, negative for most rubbers: they soften before they stiffen.
    #[unit("Pa")] #[range(-1e12, 1e12)] c20: f64,
    /// Third constant.
    #[unit("Pa")] #[range(0.0, 1e12)] c30: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
}
fn energy_density_isochoric(s: Strain, p: Parameters) -> f64 {
    p.c10 * (s.I1bar - 3.0) + p.c20 * (s.I1bar - 3.0).powi(2) + p.c30 * (s.I1bar - 3.0).powi(3)
}
fn energy_density_volumetric(s: Strain, p: Parameters) -> f64 {
    p.kappa / 2.0 * (s.J - 1.0).powi(2)
}

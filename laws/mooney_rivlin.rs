//! Compressible Mooney-Rivlin solid, W = mu1/2 (I1 - 3) + mu2/2 (I2 - 3) - (mu1 + 2 mu2) ln J + lambda/2 (ln J)^2.
//! Holzapfel, Nonlinear Solid Mechanics, 2000, section 6.5, with lambda/2 (ln J)^2 for its c (J - 1)^2; mu1 and mu2 are
//! twice its c1 and c2. Small strains have the shear modulus mu1 + mu2 and the first Lame constant lambda + 2 mu2.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = mu1 + mu2, lame_lambda = lambda + 2.0 * mu2)]
struct Parameters {
    /// First Mooney-Rivlin constant.
    #[unit("Pa")] #[range(1e0, 1e12)] mu1: f64,
    /// Second Mooney-Rivlin constant.
    #[unit("Pa")] #[range(0.0, 1e12)] mu2: f64,
    /// Volumetric constant.
    #[unit("Pa")] #[range(0.0, 1e14)] lambda: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.mu1 / 2.0 * (s.I1 - 3.0) + p.mu2 / 2.0 * (s.I2 - 3.0) - (p.mu1 + 2.0 * p.mu2) * ln(s.J)
        + p.lambda / 2.0 * ln(s.J).powi(2)
}

//! Solid of given Lame constants, W = a (I1 - 3) + b (I2 - 3) + c (I3 - 1) - d/2 ln I3 with a + b = mu/2,
//! c = lambda/4 - b, d = lambda/2 + mu; polyconvex where b is at most mu/2 and lambda/4.
//! Ciarlet, Mathematical Elasticity I, 1988, section 4.10.
#[domain(J > 0.0)]
#[small_strain_moduli(shear = mu, lame_lambda = lambda)]
struct Parameters {
    /// Shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] mu: f64,
    /// First Lame constant.
    #[unit("Pa")] #[range(1e0, 1e14)] lambda: f64,
    /// Part of I2.
    #[unit("Pa")] #[range(0.0, 1e11)] b: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    let a = p.mu / 2.0 - p.b;
    let c = p.lambda / 4.0 - p.b;
    let d = p.lambda / 2.0 + p.mu;
    a * (s.I1 - 3.0) + p.b * (s.I2 - 3.0) + c * (s.I3 - 1.0) - d / 2.0 * ln(s.I3)
}

//! Heart muscle, W = c (exp(b (I1bar - 3)) - 1) + a (exp(d (sqrt(I4bar) - 1)^2) - 1) + kappa/2 (J - 1)^2.
//! Humphrey & Yin, On constitutive relations and finite deformations of passive cardiac tissue, Journal of Biomechanical
//! Engineering 109, 1987; incompressible there.
#[domain(J > 0.0)]
struct Parameters {
    /// Stiffness of the matrix.
    #[unit("Pa")] #[range(1e0, 1e12)] c: f64,
    /// Its stiffening.
    #[unit("1")] #[range(1e-2, 1e2)] b: f64,
    /// Stiffness of the fibres.
    #[unit("Pa")] #[range(0.0, 1e12)] a: f64,
    /// Their stiffening.
    #[unit("1")] #[range(1e-2, 1e2)] d: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e14)] kappa: f64,
    /// Direction of the fibres.
    fibre: Direction,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.c * (exp(p.b * (s.I1bar - 3.0)) - 1.0) + p.a * (exp(p.d * (sqrt(s.I4bar(p.fibre)) - 1.0).powi(2)) - 1.0)
        + p.kappa / 2.0 * (s.J - 1.0).powi(2)
}

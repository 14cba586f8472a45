//! Test data: W = c/2 eps:eps, with a derivation by hand that computes the normal strains as (1 + G) - 1.
#[small_strain]
struct Parameters {
    /// Stiffness: twice the shear modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] c: f64,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.c / 2.0 * ddot(s.eps, s.eps)
}

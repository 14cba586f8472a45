//! Arterial wall: two families of dispersed collagen fibres, which bear tension only, in an isotropic ground.
//! Gasser, Ogden & Holzapfel, Hyperelastic modelling of arterial layers with distributed collagen fibre orientations,
//! Journal of the Royal Society Interface 3, 2006. Volumetric part: Simo & Miehe, Computer Methods in Applied Mechanics
//! and Engineering 98, 1992.
#[domain(J > 0.0)]
struct Parameters {
    /// Shear modulus c of the ground.
    #[unit("Pa")] #[range(0.0, 1e12)] c: f64,
    /// Stiffness k1 of the fibres.
    #[unit("Pa")] #[range(0.0, 1e12)] k1: f64,
    /// Exponent k2 of the fibres' stiffening.
    #[unit("1")] #[range(1e-3, 1e4)] k2: f64,
    /// Dispersion of the fibres: 0 is none, 1/3 is isotropy.
    #[unit("1")] #[range(0.0, 0.3333333333333333)] kappa: f64,
    /// Bulk modulus.
    #[unit("Pa")] #[range(1e0, 1e12)] bulk: f64,
    /// Mean direction of the first family at rest.
    #[per_element] fibre: Direction,
    /// Mean direction of the second family at rest.
    #[per_element] second_fibre: Direction,
}
fn energy_density_ground(s: Strain, p: Parameters) -> f64 {
    p.c / 2.0 * (s.I1bar - 3.0)
}
fn energy_density_fibres(s: Strain, p: Parameters) -> f64 {
    family(s, p, s.I4bar(p.fibre)) + family(s, p, s.I4bar(p.second_fibre))
}
fn energy_density_volumetric(s: Strain, p: Parameters) -> f64 {
    p.bulk / 4.0 * (s.J.powi(2) - 1.0 - 2.0 * ln(s.J))
}
fn family(s: Strain, p: Parameters, i4bar: f64) -> f64 {
    let strain = p.kappa * (s.I1bar - 3.0) + (1.0 - 3.0 * p.kappa) * (i4bar - 1.0);
    p.k1 / (2.0 * p.k2) * (exp(p.k2 * pos(strain).powi(2)) - 1.0)
}

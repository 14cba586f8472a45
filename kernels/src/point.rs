//! A law's point kernels over a range of quadrature points, whatever element these are of.

use crate::damping::Dissipative;
use crate::law::Law;
use crate::real::Real;

/// The constants of a material at a range of quadrature points.
#[derive(Debug, Clone, Copy)]
pub struct Material<'a, R> {
    /// The law's constants: one set, or one set after the other.
    pub constants: &'a [R],
    /// Constants between one element's set and the next: 0 where all share one.
    pub stride: usize,
    /// How many constants a set has.
    pub count: usize,
    /// Quadrature points of an element.
    pub points: usize,
}

impl<'a, R> Material<'a, R> {
    fn at(&self, point: usize) -> &'a [R] {
        &self.constants[point / self.points * self.stride..][..self.count]
    }
}

/// A tensor of nine components at each point, row by row.
pub type Tensors<R> = [[R; 9]];
/// Vectors at each point, those of one point after the other.
pub type Vectors<R> = [[R; 3]];
/// The first quadrature point that has left the law's domain, if any.
pub type PointOutside = Option<usize>;

/// From one tensor a point to another.
pub type TensorKernel<R> = fn(&Material<R>, &Tensors<R>, &mut Tensors<R>);
/// From one tensor a point to another, which may lie outside the law's domain.
pub type BoundedKernel<R> = fn(&Material<R>, &Tensors<R>, &mut Tensors<R>) -> PointOutside;
/// From two tensors a point to a third.
pub type TensorsKernel<R> = fn(&Material<R>, &Tensors<R>, &Tensors<R>, &mut Tensors<R>);
/// From three tensors a point to a fourth.
pub type ThreeTensorsKernel<R> = fn(&Material<R>, &Tensors<R>, &Tensors<R>, &Tensors<R>, &mut Tensors<R>);
/// From two tensors a point to a density.
pub type DensityKernel<R> = fn(&Material<R>, &Tensors<R>, &Tensors<R>, &mut [R]);
/// From a tensor and the gradients of the nodes' functions a point to the diagonals at the nodes, in their place.
pub type DiagonalKernel<R> = fn(&Material<R>, &Tensors<R>, &mut Vectors<R>);
/// As [`DiagonalKernel`], from two tensors a point.
pub type DampingDiagonalKernel<R> = fn(&Material<R>, &Tensors<R>, &Tensors<R>, &mut Vectors<R>);

/// A law's kernels at quadrature points, in one precision; arrays have one entry a point.
#[derive(Debug, Clone, Copy)]
pub struct PointKernels<R: Real> {
    /// G -> W.
    pub energy: fn(&Material<R>, &Tensors<R>, &mut [R]) -> PointOutside,
    /// G -> P.
    pub force: BoundedKernel<R>,
    /// G, dG -> dP.
    pub dforce: TensorsKernel<R>,
    /// G, and the gradients of the functions of each node -> the diagonal at each node.
    pub diagonal: DiagonalKernel<R>,
    /// G -> the Cauchy stress.
    pub cauchy: TensorKernel<R>,
}

impl<R: Real> PointKernels<R> {
    /// The kernels of a law.
    pub fn of<L: Law>() -> Self {
        Self {
            energy: energy::<L, R>,
            force: force::<L, R>,
            dforce: dforce::<L, R>,
            diagonal: diagonal::<L, R>,
            cauchy: cauchy::<L, R>,
        }
    }
}

/// A dissipative law's kernels at quadrature points, in one precision; the second array is the rate of G.
#[derive(Debug, Clone, Copy)]
pub struct DampingPointKernels<R: Real> {
    /// D, the dissipation density.
    pub dissipation: DensityKernel<R>,
    /// The stress of damping.
    pub damping: TensorsKernel<R>,
    /// Its differential, where the rate changes as the third array gives.
    pub ddamping: ThreeTensorsKernel<R>,
    /// As [`PointKernels::diagonal`].
    pub diagonal: DampingDiagonalKernel<R>,
}

impl<R: Real> DampingPointKernels<R> {
    /// The kernels of a law.
    pub fn of<L: Dissipative>() -> Self {
        Self {
            dissipation: dissipation::<L, R>,
            damping: damping::<L, R>,
            ddamping: ddamping::<L, R>,
            diagonal: damping_diagonal::<L, R>,
        }
    }
}

fn energy<L: Law, R: Real>(material: &Material<R>, g: &[[R; 9]], out: &mut [R]) -> PointOutside {
    let mut outside = None;
    for (q, (g, out)) in g.iter().zip(out).enumerate() {
        let (w, margin) = L::energy(material.at(q), g);
        *out = w;
        if !margin.is_positive() && outside.is_none() {
            outside = Some(q);
        }
    }
    outside
}

fn force<L: Law, R: Real>(material: &Material<R>, g: &[[R; 9]], out: &mut [[R; 9]]) -> PointOutside {
    let mut outside = None;
    for (q, (g, out)) in g.iter().zip(out).enumerate() {
        let (p, margin) = L::force(material.at(q), g);
        *out = p;
        if !margin.is_positive() && outside.is_none() {
            outside = Some(q);
        }
    }
    outside
}

fn dforce<L: Law, R: Real>(material: &Material<R>, g: &[[R; 9]], dg: &[[R; 9]], out: &mut [[R; 9]]) {
    for (q, ((g, dg), out)) in g.iter().zip(dg).zip(out).enumerate() {
        *out = L::dforce(material.at(q), g, dg);
    }
}

/// The gradients of the nodes' functions stand in `out`, and their diagonals after it.
fn diagonal<L: Law, R: Real>(material: &Material<R>, g: &[[R; 9]], out: &mut [[R; 3]]) {
    let nodes = out.len() / g.len();
    for (q, (g, out)) in g.iter().zip(out.chunks_exact_mut(nodes)).enumerate() {
        for n in out {
            *n = L::diagonal(material.at(q), g, n);
        }
    }
}

fn cauchy<L: Law, R: Real>(material: &Material<R>, g: &[[R; 9]], out: &mut [[R; 9]]) {
    for (q, (g, out)) in g.iter().zip(out).enumerate() {
        *out = L::cauchy(material.at(q), g);
    }
}

fn dissipation<L: Dissipative, R: Real>(material: &Material<R>, g: &[[R; 9]], rate: &[[R; 9]], out: &mut [R]) {
    for (q, ((g, rate), out)) in g.iter().zip(rate).zip(out).enumerate() {
        *out = L::dissipation(material.at(q), g, rate);
    }
}

fn damping<L: Dissipative, R: Real>(material: &Material<R>, g: &[[R; 9]], rate: &[[R; 9]], out: &mut [[R; 9]]) {
    for (q, ((g, rate), out)) in g.iter().zip(rate).zip(out).enumerate() {
        *out = L::damping(material.at(q), g, rate);
    }
}

fn ddamping<L: Dissipative, R: Real>(
    material: &Material<R>,
    g: &[[R; 9]],
    rate: &[[R; 9]],
    dg: &[[R; 9]],
    out: &mut [[R; 9]],
) {
    for (q, (((g, rate), dg), out)) in g.iter().zip(rate).zip(dg).zip(out).enumerate() {
        *out = L::ddamping(material.at(q), g, rate, dg);
    }
}

fn damping_diagonal<L: Dissipative, R: Real>(
    material: &Material<R>,
    g: &[[R; 9]],
    rate: &[[R; 9]],
    out: &mut [[R; 3]],
) {
    let nodes = out.len() / g.len();
    for (q, ((g, rate), out)) in g.iter().zip(rate).zip(out.chunks_exact_mut(nodes)).enumerate() {
        for n in out {
            *n = L::damping_diagonal(material.at(q), g, rate, n);
        }
    }
}

//! Point kernels composed with the linear tetrahedron over a range of elements: gather G, evaluate, contract.
//!
//! This is the element pass of Faure et al. 2012, Algorithm 1: each element writes the partial force of each of its
//! nodes into a slot of its own; who owns the nodes sums the slots. A law whose domain an element has left reports the
//! element's index instead of a NaN.

use crate::element::RestPoint;
use crate::generated::tetrahedron_p1::{NODES, contract, gradient, node_gradients};
use crate::law::Law;
use crate::real::Real;

/// Elements of one law, and their material.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a, R> {
    /// Node indices of each element, into the displacement array.
    pub nodes: &'a [[u32; NODES]],
    /// Rest data of each element.
    pub rest: &'a [RestPoint<R>],
    /// The law's constants: of the one material, or one set after the other, an element each.
    pub constants: &'a [R],
    /// Constants between one element's set and the next: 0 where all elements share one.
    pub stride: usize,
    /// How many constants a set has.
    pub count: usize,
}

impl<'a, R: Real> Batch<'a, R> {
    pub(crate) fn constants(&self, e: usize) -> &'a [R] {
        &self.constants[e * self.stride..e * self.stride + self.count]
    }

    /// The elements in a range, as a batch.
    pub fn range(&self, range: std::ops::Range<usize>) -> Batch<'a, R> {
        Batch {
            nodes: &self.nodes[range.clone()],
            rest: &self.rest[range.clone()],
            constants: &self.constants[range.start * self.stride..],
            stride: self.stride,
            count: self.count,
        }
    }
}

/// The first element of a batch that has left the law's domain, if any.
pub type Outside = Option<usize>;

/// Displacements u -> each element's strain energy (unit of stress times m^3).
pub type EnergyKernel<R> = fn(&Batch<R>, &[[R; 3]], &mut [R]) -> Outside;
/// Displacements u -> each element's nodal forces (or diagonals), one slot a node.
pub type ForceKernel<R> = fn(&Batch<R>, &[[R; 3]], &mut [[[R; 3]; NODES]]) -> Outside;
/// Displacements u and increments du -> each element's nodal force differentials, one slot a node.
pub type DForceKernel<R> = fn(&Batch<R>, &[[R; 3]], &[[R; 3]], &mut [[[R; 3]; NODES]]);
/// Displacements u -> each element's Cauchy stress.
pub type CauchyKernel<R> = fn(&Batch<R>, &[[R; 3]], &mut [[R; 9]]);

#[inline(always)]
pub(crate) fn gather<R: Real>(batch: &Batch<R>, e: usize, u: &[[R; 3]]) -> [R; 9] {
    let [a, b, c, d] = batch.nodes[e].map(|n| u[n as usize]);
    let nodal = [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], d[0], d[1], d[2]];
    gradient(&nodal, &batch.rest[e].inverse_jacobian)
}

#[inline(always)]
pub(crate) fn scatter<R: Real>(batch: &Batch<R>, e: usize, stress: &[R; 9], slots: &mut [[R; 3]; NODES]) {
    let rest = &batch.rest[e];
    let f = contract(stress, &rest.inverse_jacobian, rest.weight);
    for (node, slot) in slots.iter_mut().enumerate() {
        *slot = [f[3 * node], f[3 * node + 1], f[3 * node + 2]];
    }
}

/// See [`EnergyKernel`].
pub fn energy<L: Law, R: Real>(batch: &Batch<R>, u: &[[R; 3]], out: &mut [R]) -> Outside {
    let mut outside = None;
    for (e, out) in out.iter_mut().enumerate() {
        let g = gather(batch, e, u);
        let (w, margin) = L::energy(batch.constants(e), &g);
        *out = w * batch.rest[e].weight;
        if !margin.is_positive() && outside.is_none() {
            outside = Some(e);
        }
    }
    outside
}

/// See [`ForceKernel`]: nodal forces f_j = -V P grad Lambda_j (N, for parameters in Pa).
pub fn force<L: Law, R: Real>(batch: &Batch<R>, u: &[[R; 3]], out: &mut [[[R; 3]; NODES]]) -> Outside {
    let mut outside = None;
    for (e, slots) in out.iter_mut().enumerate() {
        let g = gather(batch, e, u);
        let (p, margin) = L::force(batch.constants(e), &g);
        scatter(batch, e, &p, slots);
        if !margin.is_positive() && outside.is_none() {
            outside = Some(e);
        }
    }
    outside
}

/// See [`DForceKernel`]: df_j = -V dP grad Lambda_j.
pub fn dforce<L: Law, R: Real>(batch: &Batch<R>, u: &[[R; 3]], du: &[[R; 3]], out: &mut [[[R; 3]; NODES]]) {
    for (e, slots) in out.iter_mut().enumerate() {
        let (g, dg) = (gather(batch, e, u), gather(batch, e, du));
        let dp = L::dforce(batch.constants(e), &g, &dg);
        scatter(batch, e, &dp, slots);
    }
}

/// See [`ForceKernel`]: the diagonal of the tangent stiffness -df/du at each node (N/m).
pub fn diagonal<L: Law, R: Real>(batch: &Batch<R>, u: &[[R; 3]], out: &mut [[[R; 3]; NODES]]) -> Outside {
    for (e, slots) in out.iter_mut().enumerate() {
        let g = gather(batch, e, u);
        let rest = &batch.rest[e];
        let gradients = node_gradients(&rest.inverse_jacobian);
        for (node, slot) in slots.iter_mut().enumerate() {
            let n = [gradients[3 * node], gradients[3 * node + 1], gradients[3 * node + 2]];
            *slot = L::diagonal(batch.constants(e), &g, &n).map(|d| d * rest.weight);
        }
    }
    None
}

/// See [`CauchyKernel`].
pub fn cauchy<L: Law, R: Real>(batch: &Batch<R>, u: &[[R; 3]], out: &mut [[R; 9]]) {
    for (e, out) in out.iter_mut().enumerate() {
        let g = gather(batch, e, u);
        *out = L::cauchy(batch.constants(e), &g);
    }
}

/// G of one element (for probes and output).
pub fn displacement_gradient<R: Real>(batch: &Batch<R>, e: usize, u: &[[R; 3]]) -> [R; 9] {
    gather(batch, e, u)
}

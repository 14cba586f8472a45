//! Laws with a dissipation density D: the stress of damping P_v = dD/d(dG/dt), alone and over a range of elements.
//!
//! D is a function of the strain and of its rate. Its differential by the rate is symmetric; by the strain nothing is
//! differentiated, since implicit steps take damping at the strain with which they begin.

use crate::batch::{Batch, gather, scatter};
use crate::generated::tetrahedron_p1::{NODES, node_gradients};
use crate::law::Law;
use crate::point::DampingPointKernels;
use crate::real::Real;
use crate::shader::DampingFunctions;

/// A constitutive law with damping: point kernels generated from its dissipation density D.
///
/// G = grad u, its rate is grad v; components as in [`Law`]. D is in the unit of stress over that of time.
pub trait Dissipative: Law {
    /// D, which is 0 at rate 0.
    fn dissipation<R: Real>(constants: &[R], displacement_gradient: &[R; 9], gradient_rate: &[R; 9]) -> R;
    /// P_v = dD/d(dG/dt), which is 0 at rate 0.
    fn damping<R: Real>(constants: &[R], displacement_gradient: &[R; 9], gradient_rate: &[R; 9]) -> [R; 9];
    /// The differential of P_v where the rate changes by `gradient_increment`.
    fn ddamping<R: Real>(
        constants: &[R],
        displacement_gradient: &[R; 9],
        gradient_rate: &[R; 9],
        gradient_increment: &[R; 9],
    ) -> [R; 9];
    /// n . (d2D / d(dG/dt)_i. d(dG/dt)_i.) . n for i = 0, 1, 2, where n is the gradient of one node's interpolation
    /// function.
    fn damping_diagonal<R: Real>(
        constants: &[R],
        displacement_gradient: &[R; 9],
        gradient_rate: &[R; 9],
        node_gradient: &[R; 3],
    ) -> [R; 3];
}

/// Displacements u and velocities v -> each element's dissipation potential (unit of stress over time, times m^3).
pub type DissipationKernel<R> = fn(&Batch<R>, &[[R; 3]], &[[R; 3]], &mut [R]);
/// Displacements u and velocities v -> each element's nodal damping forces (or diagonals), one slot a node.
pub type DampingKernel<R> = fn(&Batch<R>, &[[R; 3]], &[[R; 3]], &mut [[[R; 3]; NODES]]);
/// Displacements u, velocities v and increments dv -> each element's differentials of damping forces, one slot a node.
pub type DDampingKernel<R> = fn(&Batch<R>, &[[R; 3]], &[[R; 3]], &[[R; 3]], &mut [[[R; 3]; NODES]]);

/// A dissipative law's batched kernels on linear tetrahedra in one precision.
#[derive(Debug, Clone, Copy)]
pub struct DampingKernels<R: Real> {
    /// Dissipation potential of each element.
    pub dissipation: DissipationKernel<R>,
    /// Nodal damping forces of each element.
    pub damping: DampingKernel<R>,
    /// Their differentials by the velocity.
    pub ddamping: DDampingKernel<R>,
    /// Diagonal of minus that differential at each element's nodes.
    pub diagonal: DampingKernel<R>,
}

impl<R: Real> DampingKernels<R> {
    /// The kernels of a law.
    pub fn of<L: Dissipative>() -> Self {
        Self {
            dissipation: dissipation::<L, R>,
            damping: damping::<L, R>,
            ddamping: ddamping::<L, R>,
            diagonal: diagonal::<L, R>,
        }
    }
}

/// The damping of a law of this build.
#[derive(Debug, Clone, Copy)]
pub struct DampingEntry {
    /// The differential of P_v does not depend on the rate: D is quadratic in it.
    pub linear: bool,
    /// Batched kernels in single precision.
    pub f32: fn() -> DampingKernels<f32>,
    /// Batched kernels in double precision.
    pub f64: fn() -> DampingKernels<f64>,
    /// Kernels at quadrature points in single precision.
    pub point_f32: fn() -> DampingPointKernels<f32>,
    /// Kernels at quadrature points in double precision.
    pub point_f64: fn() -> DampingPointKernels<f64>,
    /// Point kernels as WGSL, in single precision.
    pub functions: &'static DampingFunctions,
}

impl DampingEntry {
    /// The damping of a law.
    pub const fn new<L: Dissipative>(linear: bool, functions: &'static DampingFunctions) -> Self {
        let (f32, f64) = (DampingKernels::<f32>::of::<L>, DampingKernels::<f64>::of::<L>);
        let (point_f32, point_f64) = (DampingPointKernels::<f32>::of::<L>, DampingPointKernels::<f64>::of::<L>);
        Self { linear, f32, f64, point_f32, point_f64, functions }
    }
}

/// See [`DissipationKernel`].
pub fn dissipation<L: Dissipative, R: Real>(batch: &Batch<R>, u: &[[R; 3]], v: &[[R; 3]], out: &mut [R]) {
    for (e, out) in out.iter_mut().enumerate() {
        let (g, rate) = (gather(batch, e, u), gather(batch, e, v));
        *out = L::dissipation(batch.constants(e), &g, &rate) * batch.rest[e].weight;
    }
}

/// See [`DampingKernel`]: nodal forces f_j = -V P_v grad Lambda_j (N, for parameters in Pa and s).
pub fn damping<L: Dissipative, R: Real>(batch: &Batch<R>, u: &[[R; 3]], v: &[[R; 3]], out: &mut [[[R; 3]; NODES]]) {
    for (e, slots) in out.iter_mut().enumerate() {
        let (g, rate) = (gather(batch, e, u), gather(batch, e, v));
        scatter(batch, e, &L::damping(batch.constants(e), &g, &rate), slots);
    }
}

/// See [`DDampingKernel`]: df_j = -V dP_v grad Lambda_j.
pub fn ddamping<L: Dissipative, R: Real>(
    batch: &Batch<R>,
    u: &[[R; 3]],
    v: &[[R; 3]],
    dv: &[[R; 3]],
    out: &mut [[[R; 3]; NODES]],
) {
    for (e, slots) in out.iter_mut().enumerate() {
        let (g, rate, dg) = (gather(batch, e, u), gather(batch, e, v), gather(batch, e, dv));
        scatter(batch, e, &L::ddamping(batch.constants(e), &g, &rate, &dg), slots);
    }
}

/// See [`DampingKernel`]: the diagonal of -df/dv at each node (N s/m).
pub fn diagonal<L: Dissipative, R: Real>(batch: &Batch<R>, u: &[[R; 3]], v: &[[R; 3]], out: &mut [[[R; 3]; NODES]]) {
    for (e, slots) in out.iter_mut().enumerate() {
        let (g, rate) = (gather(batch, e, u), gather(batch, e, v));
        let rest = &batch.rest[e];
        let gradients = node_gradients(&rest.inverse_jacobian);
        for (node, slot) in slots.iter_mut().enumerate() {
            let n = [gradients[3 * node], gradients[3 * node + 1], gradients[3 * node + 2]];
            *slot = L::damping_diagonal(batch.constants(e), &g, &rate, &n).map(|d| d * rest.weight);
        }
    }
}

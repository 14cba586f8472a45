//! Laws with a dissipation density D: the stress of damping P_v = dD/d(dG/dt), which steps take beside the elastic one.
//!
//! D is a function of the strain and of its rate. Its differential by the rate is symmetric; by the strain nothing is
//! differentiated, since implicit steps take damping at the strain with which they begin.

use crate::law::Law;
use crate::real::Real;
use crate::shader::DampingFunctions;
use crate::table::DampingTable;

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

/// The damping of a law of this build.
#[derive(Debug, Clone, Copy)]
pub struct DampingEntry {
    /// The differential of P_v does not depend on the rate: D is quadratic in it.
    pub linear: bool,
    /// Its kernels on all lanes.
    pub(crate) kernels: DampingTable,
    /// Point kernels as WGSL, in single precision.
    pub functions: &'static DampingFunctions,
}

impl DampingEntry {
    /// The damping of a law.
    pub const fn new<L: Dissipative>(linear: bool, functions: &'static DampingFunctions) -> Self {
        Self { linear, kernels: DampingTable::of::<L>(), functions }
    }
}

//! The CPU backend: vectors in memory, sums in fixed blocks, elements on all cores.

mod field;
mod kernels;
mod vectors;

pub use field::CpuField;
pub use kernels::{Kernels, Part};
pub use vectors::CpuBackend;

use tensormass_kernels::composed::Entry;
use tensormass_kernels::{BatchKernels, DampingKernels, LawEntry};

/// A precision of the CPU backend.
pub trait Precision: Entry + Default + std::iter::Sum {
    /// Unit round-off.
    const EPSILON: f64;
    /// The law's kernels in this precision.
    fn kernels(law: &LawEntry) -> BatchKernels<Self>;
    /// The kernels of the law's damping in this precision, if it has a dissipation.
    fn damping_kernels(law: &LawEntry) -> Option<DampingKernels<Self>>;
}

impl Precision for f32 {
    const EPSILON: f64 = f32::EPSILON as f64 / 2.0;
    fn kernels(law: &LawEntry) -> BatchKernels<Self> {
        (law.f32)()
    }
    fn damping_kernels(law: &LawEntry) -> Option<DampingKernels<Self>> {
        law.damping.map(|damping| (damping.f32)())
    }
}

impl Precision for f64 {
    const EPSILON: f64 = f64::EPSILON / 2.0;
    fn kernels(law: &LawEntry) -> BatchKernels<Self> {
        (law.f64)()
    }
    fn damping_kernels(law: &LawEntry) -> Option<DampingKernels<Self>> {
        law.damping.map(|damping| (damping.f64)())
    }
}

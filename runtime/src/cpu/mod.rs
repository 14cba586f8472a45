//! The CPU backend: vectors in memory, sums in fixed blocks, clusters of elements on all cores.

mod assembled;
mod cluster;
mod contact;
mod field;
mod one;
mod pressure;
mod products;
mod tune;
mod vectors;

pub use cluster::{ElementBytes, element_bytes};
pub use contact::{CpuContact, TOUCHING_BYTES};
pub use field::CpuField;
pub use one::One;
pub use pressure::{CpuPressure, pressed_bytes};
pub use tensormass_kernels::Engine;
pub use tune::fastest;
pub use vectors::{CpuBackend, CpuVector};

/// A precision of the CPU backend.
pub trait Precision: tensormass_kernels::Precision + std::iter::Sum {
    /// Unit round-off.
    const EPSILON: f64;
}

impl Precision for f32 {
    const EPSILON: f64 = f32::EPSILON as f64 / 2.0;
}

impl Precision for f64 {
    const EPSILON: f64 = f64::EPSILON / 2.0;
}

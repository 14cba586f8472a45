//! From a strain energy density to simulation kernels.

pub mod law;

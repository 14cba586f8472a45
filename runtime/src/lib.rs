//! Runtime.

pub mod mesh;
pub mod scene;
pub mod output;

pub use tensormass_kernels::{law, laws, LawEntry, LawInfo, Operations, ParameterInfo, Structure};

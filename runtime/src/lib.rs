//! Runtime.

pub mod mesh;
pub mod scene;
pub mod output;

pub use tensormass_kernels::{LawEntry, LawInfo, Operations, ParameterInfo, Structure, law, laws};

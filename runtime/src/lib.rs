//! Runtime.

pub mod mesh;
pub mod scene;
pub mod output;

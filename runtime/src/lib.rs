//! Soft bodies in motion: meshes, force fields, solvers, integrators, scenes and results.
//!
//! ```text
//! scene file --scene--> Scene --model--> Body (scaled units) --System--> Backend + ForceField --integrate--> results
//! ```
//!
//! Kernels come from `tensormass-kernels`; nothing here knows how they were derived. Integrators are written once over
//! [`backend::Backend`] and [`backend::ForceField`]; [`cpu`] is the first backend.

pub mod backend;
pub mod body;

pub mod cg;
pub mod contact;
pub mod cpu;
pub mod device;
mod device_memory;
mod frames;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod guard;
pub mod history;
pub mod integrate;
pub mod inventory;
pub mod mass;
pub mod measure;
pub mod mesh;
pub mod model;
pub mod moduli;
pub mod order;
pub mod output;
pub mod plan;
pub mod probe;
pub mod scale;
pub mod scene;
pub mod simulate;
pub mod step_limit;
pub mod strips;
pub mod system;
pub mod tangent;
pub mod target;

pub use tensormass_kernels::{
    Acceptance, ElementEntry, LawEntry, LawInfo, Operations, ParameterInfo, Structure, element, elements, law, laws,
    linear_tetrahedron,
};

//! Meshes: tetrahedra, their groups, incidence, shape gradients and quality, and where they come from.

mod beam;
mod error;
pub mod gmsh;
mod gradients;
mod incidence;
mod quality;
mod tet_mesh;
mod validate;

pub use beam::beam;
pub use error::{GroupKind, MeshError};
pub use gradients::{ShapeGradients, shape_gradients};
pub use incidence::Incidence;
pub use quality::Quality;
pub use tet_mesh::{ElementId, Groups, NodeId, Orientation, TetMesh};

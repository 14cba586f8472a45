//! Meshes: elements of any kinds, their groups, incidence, maps and quality, and where they come from.

mod beam;
mod enclosure;
mod error;
pub mod gmsh;
mod gradients;
mod incidence;
mod locate;
mod map;
mod parts;
mod quality;
mod refine;
pub mod surface;
mod topology;
mod torus;
mod validate;

pub use beam::{beam, beam_of};
pub use error::{GroupKind, MeshError};
pub use gradients::{ShapeGradients, shape_gradients};
pub use incidence::Incidence;
pub use locate::{Locator, MaterialPoint};
pub(crate) use map::point_volumes;
pub use map::{integrals, tangents};
pub use quality::Quality;
pub use topology::{Block, ElementId, FaceId, Groups, Mesh, NodeId, Orientation};
pub use torus::{Ring, torus_of};

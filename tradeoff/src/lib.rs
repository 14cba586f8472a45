//! What accuracy of a scene costs: settings run against a converged reference, their errors and costs, and which is the cheapest
//! that is accurate enough.
//!
//! | module | job |
//! |---|---|
//! | `space` | the choices that a scene leaves: axes, and settings as changes to the scene |
//! | `twins` | laws that answer small strains alike |
//! | `trajectory` | what is compared of a run: displacements at points, probes, energy, over time |
//! | `experiment` | runs a setting, and compares |
//! | `reference` | a reference, and how well it has converged |
//! | `search` | which setting to run next |
//! | `front` | settings that none beats, and recommendations |
//! | `study` | all of it within a budget, resumable |
//! | `report` | tables, diagrams, a page |

mod experiment;
mod front;
mod reference;
pub mod report;
mod search;
mod space;
mod study;
mod trajectory;
mod twins;

pub use experiment::{Measured, Status};
pub use front::{cheapest, front};
pub use reference::Reference;
pub use space::{Axis, Setting, Space, SpaceError};
pub use study::{Budget, Follow, Study, StudyError};
pub use trajectory::{Errors, Metric, Points, Trajectory};

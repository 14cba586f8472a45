//! Drives whole scenes to extremes, and judges what comes of each.
//!
//! ```text
//! Extreme, value, law, integrator -> Specimen -> Scene (in any units) -> run -> judge <- Reference (exact curve, or twin)
//! ```
//!
//! A cell is right within an error, told of by the program, stopped or refused by it with a reason, or wrong: a NaN, or an error
//! that nothing speaks of.

mod equations;
mod extreme;
mod reference;
pub mod report;
mod run;
mod sliver;
mod specimen;
mod suite;
mod verdict;

pub use extreme::Extreme;
pub use suite::{Cell, Choice, INTEGRATORS, Place};
pub use verdict::Verdict;

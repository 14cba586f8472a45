//! Examines constitutive laws: how accurate their kernels are, whether they are what a law should be, how they respond.
//!
//! ```text
//! Subject (law file + derivation) -> Material -> states, exact references -> gate -> extremes -> table, CSV, SVG
//! ```
//!
//! A [`subject::Subject`] is a law of this build or a law file. Its kernels are evaluated by interpreting the derivation
//! in f32, f64 and 448 bits ([`evaluate`], [`number`]), which performs the operations of the printed Rust, and by running
//! its WGSL on an adapter ([`wgsl`]).

pub mod check;
pub mod csv;
pub mod curve;
mod dissipation;
pub mod drive;
mod edge;
pub mod evaluate;
mod exact;
pub mod explain;
pub mod extremes;
pub mod gate;
pub mod heat_map;
mod identities;
mod lanes;
pub mod material;
pub mod number;
pub mod replay;
pub mod roundings;
pub mod states;
pub mod subject;
mod svg;
pub mod table;
pub mod undecided;
pub mod wgsl;

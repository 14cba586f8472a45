//! Soft-body kernels generated from the strain energy densities in `laws/`, and the traits that they implement.
//!
//! Generated code implements [`Law`] for any [`Real`]: strain energy density W, first Piola-Kirchhoff stress
//! P = dW/dG, its differential dP in a direction dG, the diagonal of the tangent, and the Cauchy stress. [`compose`] puts
//! a law and an element together, on the widest registers that the machine has. [`laws`] and [`elements`] list what this
//! build has.

// Generated text names this crate as any other crate would.
extern crate self as tensormass_kernels;

mod aligned;
mod assembly;
mod blocks;
mod composed;
pub mod damping;
pub mod element;
mod lanes;
mod law;
mod matrix;
pub mod point;
mod real;
pub mod shader;
pub mod strip;
mod table;

pub use assembly::{Pair, block_place, pairs};
pub use blocks::{Blocks, Cluster, Extent, Part, States, most_nodes};
pub use composed::{Compute, compose};
pub use damping::{DampingEntry, Dissipative};
pub use element::{Element, ElementEntry, ElementInfo, Face, Numbering, ReferencePoint, RestPoint, Term};
pub use lanes::{Chains, Engine, Lanes, Node, Place};
pub use law::{Acceptance, Law, LawEntry, LawInfo, LawSource, Operations, ParameterInfo, Structure};
pub use matrix::{Matrix, Rows};
pub use real::Real;
pub use table::Precision;
// Generated text computes constants in it.
#[doc(hidden)]
pub use real::twofold::Twofold;

/// The kernels printed by the generator for this build.
// Generated text: its generator is tested instead.
#[allow(missing_docs, unused_variables, clippy::all, unused_qualifications)]
// A law's own text is no rustdoc.
#[allow(rustdoc::broken_intra_doc_links, rustdoc::invalid_html_tags, rustdoc::bare_urls)]
pub mod generated {
    include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
}

/// The folder of this build's generated text: tests find there the derivations that it was printed from.
#[doc(hidden)]
pub const GENERATED: &str = env!("TENSORMASS_GENERATED");

/// Every law of this build, by name.
pub fn laws() -> &'static [LawEntry] {
    generated::LAWS
}

/// The law of this name.
pub fn law(name: &str) -> Option<&'static LawEntry> {
    laws().iter().find(|l| l.info.name == name)
}

/// Every element of this build, by name.
pub fn elements() -> &'static [ElementEntry] {
    generated::ELEMENTS
}

/// The element of this name.
pub fn element(name: &str) -> Option<&'static ElementEntry> {
    elements().iter().find(|e| e.info.name == name)
}

/// The linear tetrahedron.
///
/// # Panics
/// Never: the generator has its declaration.
pub fn linear_tetrahedron() -> &'static ElementEntry {
    elements().iter().find(|e| e.info.is_linear_simplex).expect("it is declared")
}

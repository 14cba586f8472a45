//! The WGSL of element and node passes: functions that the generator prints, of laws and of elements, put together.
//!
//! A law's point kernels and an element's gather and contraction are functions of values, printed once each. An element
//! pass ([`element_pass`]) is one of a law's functions, those of one element, and what moves their values from and to
//! buffers: a device compiles the pairs that a scene has, and a build has the sum of both, not the product. Node passes
//! ([`node_sum`], [`node_product`]) know neither.

mod binding;
mod element;
mod frame;
mod functions;
mod lines;
mod nodes;
mod strip;

pub use binding::Binding;
pub use element::{PASSES, Pass, Unit, element_pass};
pub use functions::{Argument, DampingFunctions, ElementFunctions, LawFunctions, PointFunction};
pub use nodes::{node_product, node_sum};

/// A compute shader with one entry point, `main`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shader {
    /// WGSL; its parameters are pipeline constants: `work_group_size`; in element passes `elements_per_invocation`; where
    /// it binds [`Binding::Constants`], `constants_stride`, constants between one element's set and the next, 0 where
    /// all share one.
    pub text: String,
    /// What it binds, in the order of the binding numbers in group 0, from 0: the uniform, then storage buffers.
    pub bindings: Vec<Binding>,
}

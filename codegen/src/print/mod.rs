//! Printers: text from validated kernels, and expressions for the reader.

mod naming;
pub mod rust;
pub mod wgsl;

#[cfg(feature = "derive")]
mod formula;
#[cfg(feature = "derive")]
pub(crate) use formula::expression;

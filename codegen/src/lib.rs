//! From a strain energy density to simulation kernels.
//!
//! ```text
//! law file --law::parse--> Law --derive--> Derivation (KernelIr -> ValidKernel) --print--> Rust text, WGSL text
//! ```
//!
//! A law file ([`law`]) is read and checked into a [`law::ast::Law`]. The derivation (feature `derive`) differentiates
//! its energy once for the stress and twice for the stress differential and lowers the stages into
//! [`ir::KernelIr`], which [`ir::KernelIr::validate`] turns into the [`ir::ValidKernel`] that printers accept. Without
//! the feature, [`derivation::Derivation`]s are read from the committed text. The printers ([`mod@print`]) write the same
//! kernels as Rust over any number type ([`print::rust`]) and as complete WGSL compute passes ([`print::wgsl`]), which
//! the Rust text holds as strings. [`build`] is what a build script calls.

#[cfg(feature = "derive")]
mod cas;
pub mod derivation;
#[cfg(feature = "derive")]
pub mod derive;
pub mod element;
#[cfg(feature = "derive")]
pub mod expr;
pub mod generate;
pub mod ir;
pub mod law;
pub mod lock;
#[cfg(feature = "derive")]
mod lower;
pub mod oracle;
pub mod print;
#[cfg(feature = "derive")]
mod quantity;
mod remainder;
#[cfg(feature = "derive")]
mod split;
pub mod structure;
mod twofold;
pub mod worker;

pub use generate::build;

//! A crate with a law of its own: `laws/gent.rs` is all that it states, the kernels are generated.
//!
//! To do the same in your crate: copy `build.rs`, the dependencies in `Cargo.toml`, and [`generated`]. Write
//! `laws/derived/` with `tensormass law derive laws/NAME.rs --out laws/derived` and commit it; your crate then builds
//! without the differentiation engine.

/// What the generator printed: one module a law, with its `Law`, and `LAWS`, the table of all.
#[allow(missing_docs, unused_variables, clippy::all, unused_qualifications)] // generated text
pub mod generated {
    include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
}

pub use generated::gent::Law as Gent;

//! Tasks about laws.

pub mod accept;
pub mod unreviewed;

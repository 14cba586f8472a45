//! Law files: text in, checked energy out.

mod arithmetic;
pub mod ast;
mod brackets;
mod calls;
mod claims;
mod defined;
mod dimension;
mod error;
pub mod evaluate;
mod expr;
mod fibres;
mod functions;
mod interval;
mod limits;
mod literals;
mod metadata;
mod parse;
mod powers;
mod rate;
mod strain;
mod units;
mod uses;
mod value;
mod words;

pub use error::{LawError, Place};
pub use parse::parse;

//! Law files: text in, checked energy out.

mod arithmetic;
pub mod ast;
mod brackets;
mod calls;
mod defined;
mod dimension;
mod error;
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

pub use error::LawError;
pub use parse::parse;

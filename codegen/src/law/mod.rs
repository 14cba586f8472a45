//! Law files: text in, checked energy out.

pub mod ast;

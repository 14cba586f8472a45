//! Prints validated kernels as WGSL: one module, with one entry point `main`, for each pass that a device runs.
//!
//! An element pass ([`law_shaders`]) is a law's point kernel between the element's functions; a node pass ([`node_sum`],
//! [`node_product`]) knows no law. Texts bind only what they read. All arithmetic is f32; WGSL lets a device reorder,
//! fuse and flush subnormal numbers to zero, and nothing here relies on what it does with infinities or NaN.

mod binding;
mod element;
mod function;
mod helpers;
mod nodes;
mod words;

use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

pub use binding::Binding;
pub use element::{DAMPING_NAMES, NAMES, damping_shaders, law_shaders};
pub use helpers::all as helper_functions;
pub use nodes::{node_product, node_sum};
pub use words::is_free;

/// A compute shader with one entry point, `main`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shader {
    /// WGSL.
    pub text: String,
    /// What it binds, in the order of the binding numbers in group 0, from 0.
    pub bindings: Vec<Binding>,
}

/// A kernel as a function of its name, with the helper functions that it calls: for tests of what a text computes.
pub fn function(kernel: &crate::ir::ValidKernel) -> String {
    let helpers = helpers::texts(&function::helpers(kernel).collect::<Vec<_>>());
    format!("{helpers}{}", function::function(kernel, &kernel.ir().name))
}

/// A shader as a Rust expression of the kernels crate's `Shader`.
pub fn expression(shader: &Shader) -> TokenStream {
    let bindings = shader.bindings.iter().map(|b| format_ident!("{b:?}"));
    let text = raw_string(&shader.text);
    quote! {
        ::tensormass_kernels::shader::Shader {
            text: #text,
            bindings: &[#(::tensormass_kernels::shader::Binding::#bindings),*],
        }
    }
}

/// A law's shaders as a Rust expression of the kernels crate's `LawShaders`.
pub fn law_expression(shaders: &[Shader; 5]) -> TokenStream {
    let names = NAMES.map(|name| format_ident!("{name}"));
    let shaders = shaders.each_ref().map(expression);
    quote!(::tensormass_kernels::shader::LawShaders { #(#names: #shaders),* })
}

/// The shaders of a law's damping as a Rust expression of the kernels crate's `DampingShaders`.
pub fn damping_expression(shaders: &[Shader; 3]) -> TokenStream {
    let names = ["damping", "ddamping", "diagonal"].map(|name| format_ident!("{name}"));
    let shaders = shaders.each_ref().map(expression);
    quote!(::tensormass_kernels::shader::DampingShaders { #(#names: #shaders),* })
}

/// A string literal that shows its lines; the text has no carriage return ([`comment`] lets none through).
fn raw_string(text: &str) -> Literal {
    let mut fence = String::from("#");
    while text.contains(&format!("\"{fence}")) {
        fence.push('#');
    }
    format!("r{fence}\"{text}\"{fence}").parse().expect("a raw string whose end is not in its text")
}

/// Text as `//` lines. What else WGSL takes for the end of a line becomes a space.
fn comment(text: &str) -> String {
    let breaks = ['\r', '\u{b}', '\u{c}', '\u{85}', '\u{2028}', '\u{2029}', '\0'];
    let line = |l: &str| format!("// {}", l.replace(breaks, " ")).trim_end().to_string() + "\n";
    text.lines().map(line).collect()
}

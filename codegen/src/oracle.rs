//! Law files as plain Rust: an oracle for tests, which compiles a law's own text with another number type.
//!
//! The text goes through `syn` and through nothing else of this crate, so that the oracle shares no code with the
//! parser or the derivation. `f64` becomes an alias of the test's number type, to which Rust converts no literal, no
//! constant and no cast. Those three are rewritten, token by token: `2.0` is `lit(2.0)`, `const A: f64 = 2.0;` is a
//! function `A()`, and `i as f64` is `from_index(i)`.

use std::collections::HashSet;

use proc_macro2::{Group, Ident, TokenStream, TokenTree};
use quote::{format_ident, quote};

/// A law file as a module's content: its items, and `oracle`, which evaluates the energy from all parameter components;
/// where there is a dissipation, `dissipation_oracle` evaluates that.
///
/// # Errors
/// The text is not Rust.
pub fn module(text: &str) -> Result<String, syn::Error> {
    let mut items = syn::parse_file(text)?.items;
    let mut constants = HashSet::new();
    let (mut fields, mut parts, mut damping) = (vec![], vec![], vec![]);
    let mut components = 0_usize;
    for item in &mut items {
        match item {
            syn::Item::Struct(s) => {
                // The law language has values only; rustc has to be told that they copy.
                s.attrs = vec![syn::parse_quote!(#[derive(Clone, Copy)])];
                for field in &mut s.fields {
                    field.attrs.clear();
                    let name = &field.ident;
                    if let syn::Type::Array(array) = &field.ty {
                        let length = &array.len;
                        let length: usize = syn::parse2::<syn::LitInt>(quote!(#length))?.base10_parse()?;
                        fields.push(quote!(#name: ::std::array::from_fn(|i| parameters[#components + i])));
                        components += length;
                    } else if matches!(&field.ty, syn::Type::Path(p) if p.path.is_ident("Direction")) {
                        let at = components..components + 3;
                        let at = at.map(|k| quote!(parameters[#k]));
                        fields.push(quote!(#name: Direction([#(#at),*])));
                        components += 3;
                    } else {
                        fields.push(quote!(#name: parameters[#components]));
                        components += 1;
                    }
                }
            }
            syn::Item::Fn(f) => {
                f.attrs.clear();
                if f.sig.ident.to_string().starts_with("energy_density") {
                    parts.push(f.sig.ident.clone());
                }
                if f.sig.ident.to_string().starts_with("dissipation_density") {
                    damping.push(f.sig.ident.clone());
                }
            }
            syn::Item::Const(c) => {
                c.attrs.clear();
                let (name, ty, value) = (&c.ident, &c.ty, &c.expr);
                if matches!(&**ty, syn::Type::Path(p) if p.path.is_ident("f64")) {
                    constants.insert(name.to_string());
                    *item = syn::parse_quote!(fn #name() -> f64 { #value });
                }
            }
            _ => {}
        }
    }
    let text: TokenStream = items
        .into_iter()
        .map(|item| {
            // A constant's own definition keeps its name; what it reads does not.
            let own = match &item {
                syn::Item::Fn(f) => f.sig.ident.to_string(),
                _ => String::new(),
            };
            let renamed = constants.iter().filter(|c| **c != own).cloned().collect();
            rewrite(quote!(#item), &renamed)
        })
        .collect();
    let dissipation = (!damping.is_empty()).then(|| {
        quote! {
            /// The dissipation density: the sum of the file's parts.
            pub fn dissipation_oracle(strain: Strain, rate: StrainRate, parameters: &[f64]) -> f64 {
                let parameters = Parameters { #(#fields),* };
                #(#damping(strain, rate, parameters))+*
            }
        }
    });
    let file = quote! {
        #text
        #dissipation
        /// The energy density: the sum of the file's parts.
        pub fn oracle(strain: Strain, parameters: &[f64]) -> f64 {
            let parameters = Parameters { #(#fields),* };
            #(#parts(strain, parameters))+*
        }
    };
    Ok(prettyplease::unparse(&syn::parse2(file)?))
}

/// One module a law, and the tables of their names and `oracle` functions, and of the `dissipative` ones. `super::prelude` is the includer's: `Number`
/// (the number type), `Strain`, `Direction` (three numbers) and the functions of the law language.
///
/// # Errors
/// A defect of this printer.
pub fn table(names: &[&str], dissipative: &[&str]) -> Result<String, syn::Error> {
    let damped = dissipative.iter().map(|n| format_ident!("{n}"));
    let damped_texts = dissipative.iter().map(ToString::to_string);
    let names: Vec<Ident> = names.iter().map(|n| format_ident!("{n}")).collect();
    let paths = names.iter().map(|n| format!("/oracle/{n}.rs"));
    let texts = names.iter().map(ToString::to_string);
    let file = quote! {
        #(
            #[allow(unused_imports, unused_variables, unused_qualifications, non_snake_case, clippy::identity_op)]
            mod #names {
                #[allow(non_camel_case_types)]
                type f64 = super::prelude::Number;
                use super::prelude::*;
                include!(concat!(env!("TENSORMASS_GENERATED"), #paths));
            }
        )*
        /// From the strain and all parameter components to the energy density.
        pub type Oracle = fn(prelude::Strain, &[prelude::Number]) -> prelude::Number;
        /// Every law's energy density by its own text, by name.
        pub const ORACLE: &[(&str, Oracle)] = &[#((#texts, #names::oracle)),*];
        /// From the strain, its rate and all parameter components to the dissipation density.
        pub type Dissipation = fn(prelude::Strain, prelude::StrainRate, &[prelude::Number]) -> prelude::Number;
        /// Every law's dissipation density by its own text, by name, where it has one.
        pub const DISSIPATION: &[(&str, Dissipation)] = &[#((#damped_texts, #damped::dissipation_oracle)),*];
    };
    Ok(prettyplease::unparse(&syn::parse2(file)?))
}

fn rewrite(tokens: TokenStream, constants: &HashSet<String>) -> TokenStream {
    let mut out: Vec<TokenTree> = Vec::new();
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Group(group) => {
                let mut inner = Group::new(group.delimiter(), rewrite(group.stream(), constants));
                inner.set_span(group.span());
                out.push(inner.into());
            }
            TokenTree::Literal(literal) if syn::parse_str::<syn::LitFloat>(&literal.to_string()).is_ok() => {
                out.extend(quote!(lit(#literal)));
            }
            TokenTree::Ident(ident) => {
                let field = matches!(out.last(), Some(TokenTree::Punct(p)) if p.as_char() == '.');
                let real = matches!(tokens.peek(), Some(TokenTree::Ident(target)) if target == "f64");
                if ident == "as" && real {
                    tokens.next();
                    let operand = cast_operand(&mut out);
                    out.extend(quote!(from_index(#(#operand)*)));
                } else if constants.contains(&ident.to_string()) && !field {
                    out.extend(quote!(#ident()));
                } else {
                    out.push(ident.into());
                }
            }
            other => out.push(other),
        }
    }
    out.into_iter().collect()
}

/// Takes the operand of a cast off the end: one token, or a chain of casts of one.
fn cast_operand(out: &mut Vec<TokenTree>) -> Vec<TokenTree> {
    let mut operand: Vec<TokenTree> = out.pop().into_iter().collect();
    while matches!(out.last(), Some(TokenTree::Ident(i)) if i == "as") {
        operand.extend(out.pop());
        operand.extend(out.pop());
    }
    operand.reverse();
    operand
}

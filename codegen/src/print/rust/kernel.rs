//! A kernel as a Rust function: its arguments, its statements, and what it returns.

use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::{ToTokens, format_ident, quote};

use super::doc_comment;
use crate::ir::{Input, Op, Output, Rational, ValidKernel, ValueId};
use crate::print::naming::{self, ValueName, kernel_docs, letter};

pub(super) fn arguments(kernel: &ValidKernel) -> Vec<TokenStream> {
    kernel.ir().inputs.iter().map(|&(role, len)| argument_type(role, kernel.reads(role), len)).collect()
}

pub(super) fn argument_type(role: Input, used: bool, len: u32) -> TokenStream {
    let name = argument(role, used);
    match role {
        Input::Constants => quote!(#name: &[R]),
        Input::Weight => quote!(#name: R),
        _ => {
            let len = plain(len as usize);
            quote!(#name: &[R; #len])
        }
    }
}

pub(super) fn array_type(len: usize) -> TokenStream {
    match len {
        1 => quote!(R),
        n => {
            let n = plain(n);
            quote!([R; #n])
        }
    }
}

pub(super) fn argument(role: Input, used: bool) -> Ident {
    if used { format_ident!("{}", letter(role)) } else { format_ident!("_{}", letter(role)) }
}

/// A length or an index without a type suffix.
pub(super) fn plain(n: usize) -> Literal {
    Literal::usize_unsuffixed(n)
}

pub(super) fn point_kernel(kernel: &ValidKernel, name: &str, needs_margin: bool) -> TokenStream {
    function(kernel, name, &arguments(kernel), needs_margin)
}

/// A kernel as a function with these arguments.
pub(super) fn function(kernel: &ValidKernel, name: &str, arguments: &[TokenStream], needs_margin: bool) -> TokenStream {
    let name = format_ident!("{name}");
    let (result, body) = (result(kernel, needs_margin), body(kernel, needs_margin));
    let docs = doc_comment(&kernel_docs(kernel));
    let constants = kernel.reads(Input::Constants).then(|| {
        let count = plain(kernel.ir().inputs[0].1 as usize);
        quote!(let c: &[R; #count] = c.try_into().expect("the material's constants");)
    });
    quote! {
        #docs
        #[inline(always)]
        fn #name<R: Real>(#(#arguments),*) -> #result {
            #constants
            #body
        }
    }
}

pub(super) fn result(kernel: &ValidKernel, needs_margin: bool) -> TokenStream {
    let type_of = |(role, ids): &(Output, Vec<ValueId>)| match is_array(*role, ids.len()) {
        true => {
            let n = plain(ids.len());
            quote!([R; #n])
        }
        false => quote!(R),
    };
    let mut types: Vec<TokenStream> = kernel.ir().outputs.iter().map(type_of).collect();
    if needs_margin {
        types.push(quote!(R));
    }
    match types.as_slice() {
        [single] => quote!(#single),
        _ => quote!((#(#types),*)),
    }
}

/// Whether an output is an array: what is stored may be one number, and is one all the same.
fn is_array(role: Output, len: usize) -> bool {
    len > 1 || role == Output::State
}

pub(super) fn body(kernel: &ValidKernel, needs_margin: bool) -> TokenStream {
    let names = value_names(kernel);
    let lets = statements(kernel, &names, false);
    let mut results: Vec<TokenStream> = kernel
        .ir()
        .outputs
        .iter()
        .map(|(role, ids)| {
            let values = ids.iter().map(|v| &names[v.index()]);
            if is_array(*role, ids.len()) { quote!([#(#values),*]) } else { quote!(#(#values)*) }
        })
        .collect();
    if needs_margin {
        results.push(quote!(R::from_f64(1.0)));
    }
    match results.as_slice() {
        [single] => quote!(#(#lets)* #single),
        _ => quote!(#(#lets)* (#(#results),*)),
    }
}

/// A token for each value: an identifier of its own, or an input in place.
pub(super) fn value_names(kernel: &ValidKernel) -> Vec<TokenStream> {
    // What parses as an identifier is no keyword.
    let names = naming::value_names(kernel, |name| syn::parse_str::<Ident>(name).is_ok());
    let token = |name| match name {
        ValueName::Input(Input::Weight, _) => argument(Input::Weight, true).into_token_stream(),
        ValueName::Input(role, k) => {
            let (array, k) = (argument(role, true), plain(k as usize));
            quote!(#array[#k])
        }
        ValueName::Local(name) => Ident::new(&name, Span::call_site()).into_token_stream(),
    };
    names.into_iter().map(token).collect()
}

pub(super) fn statements(kernel: &ValidKernel, names: &[TokenStream], host: bool) -> Vec<TokenStream> {
    let at = |v: ValueId| &names[v.index()];
    let call = |method: &str, v: &[ValueId]| {
        let method = Ident::new(method, Span::call_site());
        let values = v.iter().map(|v| at(*v));
        if host { quote!(<R as Real>::#method(#(#values),*)) } else { quote!(R::#method(#(#values),*)) }
    };
    // The host's constants are of a type that has no such instruction.
    let absorbed = if host { vec![None; names.len()] } else { absorbed_products(kernel) };
    let negative = |v: &TokenStream| quote!(-#v);
    let mut lets = Vec::new();
    for (i, d) in kernel.ir().values.iter().enumerate() {
        let product = |v: ValueId| match (absorbed[v.index()] == Some(i), kernel.ir().values[v.index()].op) {
            (true, Op::Mul(x, y)) => Some((at(x), at(y))),
            _ => None,
        };
        let value = match d.op {
            Op::Input(..) => continue,
            Op::Mul(..) if absorbed[i].is_some() => continue,
            Op::Add(a, b) if let Some((x, y)) = product(a) => fused(x, y, at(b)),
            Op::Add(a, b) if let Some((x, y)) = product(b) => fused(x, y, at(a)),
            Op::Sub(a, b) if let Some((x, y)) = product(b) => fused(&negative(x), y, at(a)),
            Op::Sub(a, b) if let Some((x, y)) = product(a) => fused(x, y, &negative(at(b))),
            Op::Const(q) if host && !q.is_integer() => {
                let [n, d] = [q.numer(), q.denom()].map(|x| float(Rational::from_integer(*x)));
                quote!(R::from_f64(#n) / R::from_f64(#d))
            }
            Op::Const(q) => {
                let q = float(q);
                quote!(R::from_f64(#q))
            }
            Op::Add(a, b) => binary(at(a), quote!(+), at(b)),
            Op::Sub(a, b) => binary(at(a), quote!(-), at(b)),
            Op::Mul(a, b) => binary(at(a), quote!(*), at(b)),
            Op::Div(a, b) => binary(at(a), quote!(/), at(b)),
            Op::Neg(a) => {
                let a = at(a);
                quote!(-#a)
            }
            Op::Fma(a, b, c) => call("mul_add", &[a, b, c]),
            Op::Sqrt(a) => call("sqrt", &[a]),
            Op::Ln(a) => call("ln", &[a]),
            Op::Exp(a) => call("exp", &[a]),
            Op::Log1p(a) => call("ln_1p", &[a]),
            Op::Expm1(a) => call("exp_m1", &[a]),
            Op::Log1pmx(a) => call("log1pmx", &[a]),
            Op::Expm1mx(a) => call("expm1mx", &[a]),
            Op::Powf(a, b) => call("powf", &[a, b]),
            Op::Select(l, r, a, b) => call("select_greater", &[l, r, a, b]),
        };
        let name = &names[i];
        lets.push(quote!(let #name = #value;));
    }
    lets
}

/// The sum or difference into which each product goes that is read nowhere else: one operation, where a machine has it.
fn absorbed_products(kernel: &ValidKernel) -> Vec<Option<usize>> {
    let values = &kernel.ir().values;
    let mut uses = vec![0_usize; values.len()];
    let operands = values.iter().flat_map(|d| d.op.operands());
    let outputs = kernel.ir().outputs.iter().flat_map(|(_, ids)| ids.iter().copied());
    operands.chain(outputs).for_each(|v| uses[v.index()] += 1);
    let mut absorbed = vec![None; values.len()];
    for (i, d) in values.iter().enumerate() {
        let is_product = |v: &ValueId| uses[v.index()] == 1 && matches!(values[v.index()].op, Op::Mul(..));
        let taken = match d.op {
            Op::Add(a, b) => [a, b].into_iter().find(is_product),
            Op::Sub(a, b) => [b, a].into_iter().find(is_product),
            _ => None,
        };
        if let Some(v) = taken {
            absorbed[v.index()] = Some(i);
        }
    }
    absorbed
}

fn fused(x: &TokenStream, y: &TokenStream, c: &TokenStream) -> TokenStream {
    quote!(R::multiply_add(#x, #y, #c))
}

fn binary(a: &TokenStream, op: TokenStream, b: &TokenStream) -> TokenStream {
    quote!(#a #op #b)
}

pub(super) fn float(q: Rational) -> TokenStream {
    signed(<f64 as crate::ir::Number>::from_rational(q))
}

/// A number as the language writes it: a literal has no sign.
pub(super) fn signed(value: f64) -> TokenStream {
    let magnitude = Literal::f64_unsuffixed(value.abs());
    if value < 0.0 { quote!(-#magnitude) } else { quote!(#magnitude) }
}

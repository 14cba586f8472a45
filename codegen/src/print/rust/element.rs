//! An element's module: what it is, and its kernels.

use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::doc_comment;
use super::kernel::{arguments, body, float, plain, result, signed};
use crate::element::ElementKernels;
use crate::ir::Input;
use crate::print::naming::kernel_docs;

/// An element's module: what it is, and its kernels.
pub fn element_module(element: &ElementKernels) -> TokenStream {
    let declaration = &element.declaration;
    let module = format_ident!("{}", declaration.name);
    let docs = doc_comment(&declaration.docs);
    let nodes = plain(element.nodes as usize);
    let kernels = [&element.gradient, &element.contract, &element.node_gradients];
    let functions = kernels.map(|kernel| {
        let name = format_ident!("{}", kernel.ir().name);
        let docs = doc_comment(&kernel_docs(kernel));
        let arguments = arguments(kernel);
        let (result, body) = (result(kernel, false), body(kernel, false));
        quote! {
            #docs
            #[inline(always)]
            pub fn #name<R: Real>(#(#arguments),*) -> #result { #body }
        }
    });
    let [gradient, contract, node_gradients] = kernels.map(|kernel| {
        let name = format_ident!("{}", kernel.ir().name);
        let arguments = kernel.ir().inputs.iter().map(|(role, _)| match role {
            Input::NodalDisplacement => quote!(u.as_flattened().try_into().expect("one vector a node")),
            // Of a linear simplex they are one.
            Input::ShapeGradients | Input::InverseJacobian => quote!(inverse_jacobian),
            Input::ReferenceGradients => quote!(slopes.try_into().expect("the element's table")),
            Input::StressIn => quote!(stress),
            _ => quote!(weight),
        });
        quote!(#name(#(#arguments),*))
    });
    let info = element_info(element);
    let each = (0..element.nodes as usize).map(plain);
    quote! {
        #docs
        pub mod #module {
            use ::tensormass_kernels::Real;
            /// Nodes of the element.
            pub const NODES: usize = #nodes;
            /// What the element is.
            pub static INFO: ::tensormass_kernels::ElementInfo = #info;
            /// The element.
            #[derive(Debug, Clone, Copy)]
            pub struct Element;
            impl ::tensormass_kernels::Element for Element {
                type Nodal<R: Real> = [[R; 3]; #nodes];
                fn info() -> &'static ::tensormass_kernels::ElementInfo { &INFO }
                fn nodal<R: Real>() -> [[R; 3]; #nodes] { [[R::from_f64(-0.0); 3]; #nodes] }
                #[inline(always)]
                fn gradient<R: Real>(u: &[[R; 3]; #nodes], slopes: &[R], inverse_jacobian: &[R; 9]) -> [R; 9] { #gradient }
                #[inline(always)]
                fn contract<R: Real>(
                    stress: &[R; 9], slopes: &[R], inverse_jacobian: &[R; 9], weight: R, forces: &mut [[R; 3]; #nodes],
                ) {
                    let f = #contract;
                    for (force, f) in forces.iter_mut().zip(f.as_chunks::<3>().0) {
                        for (force, f) in force.iter_mut().zip(f) {
                            *force = *force + *f;
                        }
                    }
                }
                #[inline(always)]
                fn node_gradients<R: Real>(slopes: &[R], inverse_jacobian: &[R; 9]) -> [[R; 3]; #nodes] {
                    let n = #node_gradients;
                    [#([n[3 * #each], n[3 * #each + 1], n[3 * #each + 2]]),*]
                }
            }
            #(#functions)*
        }
    }
}

/// An element's tables.
fn element_info(element: &ElementKernels) -> TokenStream {
    let d = &element.declaration;
    let (name, docs, source, linear) = (&d.name, d.docs.trim(), d.source.trim(), element.is_linear_simplex);
    let shape = d.shape.name();
    let (dimension, order) = (plain(d.shape.dimension()), Literal::u32_unsuffixed(d.order));
    let nodes = plain(d.nodes.len());
    let points = d.quadrature.points.iter().zip(&d.quadrature.weights).map(|(x, weight)| {
        let functions = d.functions.iter().map(|f| signed(f.at_f64(x)));
        let gradients = d.functions.iter().map(|f| {
            let row = [0, 1, 2].map(|k| signed(f.derivative(k).at_f64(x)));
            quote!([#(#row),*])
        });
        let weight = signed(*weight);
        quote! {
            ::tensormass_kernels::ReferencePoint {
                weight: #weight, functions: &[#(#functions),*], gradients: &[#(#gradients),*],
            }
        }
    });
    let terms = d.functions.iter().map(|f| {
        let terms = f.terms().map(|(q, e)| {
            let (coefficient, exponents) = (float(q), e.map(Literal::u32_unsuffixed));
            quote!(::tensormass_kernels::Term { coefficient: #coefficient, exponents: [#(#exponents),*] })
        });
        quote!(&[#(#terms),*])
    });
    let masses = d.mass_rule.points.iter().zip(&d.mass_rule.weights).map(|(x, weight)| {
        let (x, weight) = (x.map(signed), signed(*weight));
        quote!(([#(#x),*], #weight))
    });
    let reference = d.nodes.iter().map(|x| {
        let x = x.map(float);
        quote!([#(#x),*])
    });
    let lumping = d.lumping.iter().map(|q| float(*q));
    let [vtk, gmsh] = [&d.vtk, &d.gmsh].map(|numbering| {
        let (kind, order) = (Literal::u32_unsuffixed(numbering.kind), numbering.order.iter().map(|k| plain(*k)));
        quote!(::tensormass_kernels::Numbering { kind: #kind, order: &[#(#order),*] })
    });
    let faces = d.faces.iter().map(|face| {
        let (element, nodes) = (&face.element, face.nodes.iter().map(|k| plain(*k)));
        quote!(::tensormass_kernels::Face { element: #element, nodes: &[#(#nodes),*] })
    });
    let (gather, contract) = (element.gradient.count().arithmetic(), element.contract.count().arithmetic());
    quote! {
        ::tensormass_kernels::ElementInfo {
            name: #name, docs: #docs, source: #source, shape: #shape, dimension: #dimension, order: #order, nodes: #nodes,
            reference: &[#(#reference),*], is_linear_simplex: #linear, points: &[#(#points),*],
            functions: &[#(#terms),*], mass_rule: &[#(#masses),*], lumping: &[#(#lumping),*], vtk: #vtk, gmsh: #gmsh, faces: &[#(#faces),*],
            gradient_operations: #gather, contract_operations: #contract,
        }
    }
}

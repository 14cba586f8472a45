//! Kernels as functions that are compiled for a machine's registers.
//!
//! Bodies are generic and always inlined; each entry is one function that the compiler may use the machine's instructions
//! in. A closure or a function in between would be compiled for any machine, and call every instruction.
#![allow(unsafe_code)]

use super::{Lanes, Node, chains};
use crate::assembly::{self, Pair, Tangents};
use crate::damping::Dissipative;
use crate::element::{self, Element, ElementKernels, Elements};
use crate::law::Law;
use crate::matrix::{self, MultiplyKernel, Rows};
use crate::point::{self, DampingPointKernels, Material, Outside, PointKernels};

/// Lanes with entries for every law and element.
pub trait Entries: Lanes {
    /// A law's kernels at quadrature points.
    fn points<L: Law>() -> PointKernels<Self>;
    /// A dissipative law's.
    fn dampers<L: Dissipative>() -> DampingPointKernels<Self>;
    /// An element's kernels.
    fn elements<E: Element>() -> ElementKernels<Self>;
    /// See [`chains::chains`].
    fn chains() -> fn(usize) -> Self::Scalar;
    /// See [`matrix::multiply`].
    fn multiply() -> MultiplyKernel<Self>;
}

macro_rules! entry {
    (
        [$($feature:literal)?], $lanes:ty, $($module:ident)::+ <$($generic:ident: $bound:path),*>
        ($($argument:ident: $type:ty),*) $(-> $result:ty)?
    ) => {{
        fn entry<$($generic: $bound),*>($($argument: $type),*) $(-> $result)? {
            $(#[target_feature(enable = $feature)])?
            fn compiled<$($generic: $bound),*>($($argument: $type),*) $(-> $result)? {
                $($module)::+::<$($generic,)* $lanes>($($argument),*)
            }
            // SAFETY: who has kernels of these lanes has given evidence of the machine.
            #[allow(unused_unsafe)]
            unsafe {
                compiled::<$($generic),*>($($argument),*)
            }
        }
        entry::<$($generic),*>
    }};
}

macro_rules! entries {
    ($lanes:ty, $scalar:ty, [$($feature:literal)?]) => {
        impl Entries for $lanes {
            fn points<L: Law>() -> PointKernels<Self> {
                PointKernels {
                    energy: entry!([$($feature)?], $lanes, point::energy<L: Law>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], out: &mut [$lanes]) -> Outside),
                    force: entry!([$($feature)?], $lanes, point::force<L: Law>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], out: &mut [[$lanes; 9]]) -> Outside),
                    dforce: entry!([$($feature)?], $lanes, point::dforce<L: Law>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], dg: &[[$lanes; 9]], out: &mut [[$lanes; 9]])),
                    linearize: entry!([$($feature)?], $lanes, point::linearize<L: Law>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], out: &mut [$scalar])),
                    apply: entry!([$($feature)?], $lanes, point::apply<L: Law>(
                        m: &Material<$lanes>, states: &[$scalar], dg: &[[$lanes; 9]], out: &mut [[$lanes; 9]])),
                    diagonal: entry!([$($feature)?], $lanes, point::diagonal<L: Law>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], out: &mut [[$lanes; 3]])),
                    cauchy: entry!([$($feature)?], $lanes, point::cauchy<L: Law>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], out: &mut [[$lanes; 9]])),
                }
            }

            fn dampers<L: Dissipative>() -> DampingPointKernels<Self> {
                DampingPointKernels {
                    dissipation: entry!([$($feature)?], $lanes, point::dissipation<L: Dissipative>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], rate: &[[$lanes; 9]], out: &mut [$lanes])),
                    damping: entry!([$($feature)?], $lanes, point::damping<L: Dissipative>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], rate: &[[$lanes; 9]], out: &mut [[$lanes; 9]])),
                    ddamping: entry!([$($feature)?], $lanes, point::ddamping<L: Dissipative>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], rate: &[[$lanes; 9]], dg: &[[$lanes; 9]],
                        out: &mut [[$lanes; 9]])),
                    diagonal: entry!([$($feature)?], $lanes, point::damping_diagonal<L: Dissipative>(
                        m: &Material<$lanes>, g: &[[$lanes; 9]], rate: &[[$lanes; 9]], out: &mut [[$lanes; 3]])),
                }
            }

            fn chains() -> fn(usize) -> $scalar {
                entry!([$($feature)?], $lanes, chains::chains<>(rounds: usize) -> $scalar)
            }

            fn multiply() -> MultiplyKernel<Self> {
                entry!([$($feature)?], $lanes, matrix::multiply<>(
                    rows: &Rows<$scalar>, x: &[Node<$scalar>], y: &mut [Node<$scalar>]))
            }

            fn elements<E: Element>() -> ElementKernels<Self> {
                ElementKernels {
                    gradient: entry!([$($feature)?], $lanes, element::gradient<E: Element>(
                        elements: &Elements<$lanes>, u: [&[Node<$scalar>]; 1], out: [&mut [[$lanes; 9]]; 1])),
                    gradients: entry!([$($feature)?], $lanes, element::gradients<E: Element>(
                        elements: &Elements<$lanes>, u: [&[Node<$scalar>]; 2], out: [&mut [[$lanes; 9]]; 2])),
                    contract: entry!([$($feature)?], $lanes, element::contract<E: Element>(
                        elements: &Elements<$lanes>, stress: &[[$lanes; 9]], f: &mut [Node<$scalar>])),
                    node_gradients: entry!([$($feature)?], $lanes, element::node_gradients<E: Element>(
                        elements: &Elements<$lanes>, out: &mut [[$lanes; 3]])),
                    integrate_nodes: entry!([$($feature)?], $lanes, element::integrate_nodes<>(
                        elements: &Elements<$lanes>, at_points: &[[$lanes; 3]], f: &mut [Node<$scalar>])),
                    integrate: entry!([$($feature)?], $lanes, element::integrate<>(
                        elements: &Elements<$lanes>, densities: &[$lanes], out: &mut [$lanes])),
                    mean: entry!([$($feature)?], $lanes, element::mean<>(
                        elements: &Elements<$lanes>, tensors: &[[$lanes; 9]], out: &mut [[$lanes; 9]])),
                    assemble: entry!([$($feature)?], $lanes, assembly::assemble<>(
                        elements: &Elements<$lanes>, dimension: usize, tangents: &Tangents<$lanes>,
                        gradients: &[[$lanes; 3]], places: &[u32], out: &mut [Pair<$scalar>])),
                }
            }
        }
    };
}

entries!(f32, f32, []);
entries!(f64, f64, []);
#[cfg(target_arch = "x86_64")]
entries!(super::F32x8, f32, ["avx2,fma"]);
#[cfg(target_arch = "x86_64")]
entries!(super::F64x4, f64, ["avx2,fma"]);
#[cfg(target_arch = "x86_64")]
entries!(super::F32x16, f32, ["avx512f,avx512vl,avx512dq,avx512bw,avx2,fma"]);
#[cfg(target_arch = "x86_64")]
entries!(super::F64x8, f64, ["avx512f,avx512vl,avx512dq,avx512bw,avx2,fma"]);

//! Which kernels a law or an element has on each of the machine's lanes.
//!
//! Tables of makers: what is not asked for costs nothing at run time but its place in the program.

use crate::damping::Dissipative;
use crate::element::{Element, ElementKernels};
use crate::lanes::{Entries, Lanes};
#[cfg(target_arch = "x86_64")]
use crate::lanes::{F32x8, F32x16, F64x4, F64x8};
use crate::law::Law;
use crate::point::{DampingPointKernels, PointKernels};

/// A precision of the CPU: a number, and its lanes on each machine.
pub trait Precision: Tabled + Lanes<Scalar = Self> + Default {
    /// Its lanes on AVX2.
    #[cfg(target_arch = "x86_64")]
    type Avx2: Tabled + Lanes<Scalar = Self>;
    /// Its lanes on AVX-512.
    #[cfg(target_arch = "x86_64")]
    type Avx512: Tabled + Lanes<Scalar = Self>;
}

impl Precision for f32 {
    #[cfg(target_arch = "x86_64")]
    type Avx2 = F32x8;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = F32x16;
}

impl Precision for f64 {
    #[cfg(target_arch = "x86_64")]
    type Avx2 = F64x4;
    #[cfg(target_arch = "x86_64")]
    type Avx512 = F64x8;
}

/// Lanes that the tables have kernels of.
pub trait Tabled: Entries {
    /// A law's.
    fn law(table: &LawTable) -> PointKernels<Self>;
    /// Those of its damping.
    fn damping(table: &DampingTable) -> DampingPointKernels<Self>;
    /// An element's.
    fn element(table: &ElementTable) -> ElementKernels<Self>;
}

macro_rules! tables {
    ($($(#[$only:meta])? $name:ident: $lanes:ty),*) => {
        /// A law's kernels.
        #[derive(Debug, Clone, Copy)]
        pub struct LawTable { $($(#[$only])? $name: fn() -> PointKernels<$lanes>),* }

        /// A dissipative law's kernels of damping.
        #[derive(Debug, Clone, Copy)]
        pub struct DampingTable { $($(#[$only])? $name: fn() -> DampingPointKernels<$lanes>),* }

        /// An element's kernels.
        #[derive(Debug, Clone, Copy)]
        pub struct ElementTable { $($(#[$only])? $name: fn() -> ElementKernels<$lanes>),* }

        impl LawTable {
            pub(crate) const fn of<L: Law>() -> Self {
                Self { $($(#[$only])? $name: <$lanes as Entries>::points::<L>),* }
            }
        }

        impl DampingTable {
            pub(crate) const fn of<L: Dissipative>() -> Self {
                Self { $($(#[$only])? $name: <$lanes as Entries>::dampers::<L>),* }
            }
        }

        impl ElementTable {
            pub(crate) const fn of<E: Element>() -> Self {
                Self { $($(#[$only])? $name: <$lanes as Entries>::elements::<E>),* }
            }
        }

        $($(#[$only])? impl Tabled for $lanes {
            fn law(table: &LawTable) -> PointKernels<Self> {
                (table.$name)()
            }
            fn damping(table: &DampingTable) -> DampingPointKernels<Self> {
                (table.$name)()
            }
            fn element(table: &ElementTable) -> ElementKernels<Self> {
                (table.$name)()
            }
        })*
    };
}
tables!(
    f32: f32,
    f64: f64,
    #[cfg(target_arch = "x86_64")] f32x8: F32x8,
    #[cfg(target_arch = "x86_64")] f64x4: F64x4,
    #[cfg(target_arch = "x86_64")] f32x16: F32x16,
    #[cfg(target_arch = "x86_64")] f64x8: F64x8
);

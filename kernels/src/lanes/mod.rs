//! Several numbers side by side that kernels run on, one an element: a machine's registers, or a single number.
//!
//! Vectors at nodes have four numbers, so that a node is one load; kernels meet them in transposed blocks, a component of
//! as many elements as there are lanes. Which lanes a machine has is found out at run time ([`Engine`]); code for each is
//! compiled into functions of its own (`entries`), because an intrinsic outside of such a function is a call.
#![allow(unsafe_code)]

mod chains;
mod entries;
mod functions;
mod scalar;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use chains::Chains;
pub use entries::Entries;
#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512, F32x8, F32x16, F64x4, F64x8};

use crate::real::Real;

/// A vector at a node: three components, and one that pads it to a power of two.
pub type Node<R> = [R; 4];

/// A node's place among those of a cluster, in units of eight bytes: the scale of an address.
pub type Place = u16;

/// A place, or one among more nodes than a cluster has.
pub trait Index: Copy {
    /// In the same units.
    fn index(self) -> usize;
}

impl Index for Place {
    #[inline(always)]
    fn index(self) -> usize {
        usize::from(self)
    }
}

impl Index for u32 {
    #[inline(always)]
    fn index(self) -> usize {
        self as usize
    }
}

/// Places from one node to the next.
pub(crate) const fn stride<R>() -> usize {
    size_of::<Node<R>>() / 8
}

/// Numbers side by side.
pub trait Lanes: Real {
    /// One of them.
    type Scalar: Real + Default;
    /// Evidence that the machine has these registers.
    type Machine: Copy;
    /// How many they are.
    const COUNT: usize;
    /// One number in every lane.
    fn splat(x: Self::Scalar) -> Self;
    /// The first numbers of a slice, one a lane.
    fn load(from: &[Self::Scalar]) -> Self;
    /// The lanes, to the beginning of a slice.
    fn store(self, to: &mut [Self::Scalar]);
    /// The vectors at one node of as many elements as there are lanes, component by component.
    ///
    /// # Safety
    /// Each place is that of a node in `nodes`.
    unsafe fn gather(nodes: &[Node<Self::Scalar>], places: &[Place]) -> [Self; 3];
    /// Adds vectors to nodes, one lane after the other.
    ///
    /// # Safety
    /// As for [`Lanes::gather`].
    unsafe fn scatter<I: Index>(vectors: [Self; 3], nodes: &mut [Node<Self::Scalar>], places: &[I]);
    /// The first lane that is not > 0.
    fn first_not_positive(self) -> usize;
}

/// What a machine can compute on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Engine(Registers);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Registers {
    /// One number at a time.
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl Engine {
    /// One number at a time, on any machine.
    pub const SCALAR: Engine = Engine(Registers::Scalar);

    /// All that this machine has, the widest last.
    pub fn available() -> Vec<Engine> {
        let mut all = vec![Self::SCALAR];
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(Avx2::detect().map(|machine| Engine(Registers::Avx2(machine))));
            all.extend(Avx512::detect().map(|machine| Engine(Registers::Avx512(machine))));
        }
        all
    }

    /// The widest of this machine.
    pub fn best() -> Engine {
        Self::available().pop().unwrap_or(Self::SCALAR)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self.0 {
            Registers::Scalar => "scalar",
            #[cfg(target_arch = "x86_64")]
            Registers::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Registers::Avx512(_) => "avx512",
        }
    }

    pub(crate) fn registers(self) -> Registers {
        self.0
    }
}

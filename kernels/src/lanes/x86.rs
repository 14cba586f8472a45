//! Registers of x86-64: AVX-512 and AVX2, both with fused multiply-add.
//!
//! Each operation is one instruction. They are inlined into functions that are compiled for the machine (`entries`), and
//! no value of these types exists without evidence that the machine has them: the crate makes none elsewhere.
#![allow(unsafe_code)]

mod own;

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Index, Lanes, Node, Place, functions};
use crate::real::Real;
use own::{f32x8, f32x16, f64x4, f64x8};

/// Evidence of AVX2 and fused multiply-add.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx2(());

impl Avx2 {
    pub(crate) fn detect() -> Option<Self> {
        (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")).then_some(Self(()))
    }
}

/// Evidence of AVX-512 with its extensions VL, DQ and BW.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx512(());

impl Avx512 {
    pub(crate) fn detect() -> Option<Self> {
        let extensions = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw");
        (extensions && Avx2::detect().is_some()).then_some(Self(()))
    }
}

/// Sixteen single precision numbers.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub struct F32x16(__m512);
/// Eight double precision numbers.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub struct F64x8(__m512d);
/// Eight single precision numbers.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub struct F32x8(__m256);
/// Four double precision numbers.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub struct F64x4(__m256d);

macro_rules! operator {
    ($lanes:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the value is evidence of the machine.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

macro_rules! lanes {
    (
        $lanes:ident, $scalar:ty, $count:literal, $machine:ty,
        $add:ident $sub:ident $mul:ident $div:ident $fma:ident $sqrt:ident $splat:ident $load:ident $store:ident,
        $own:ident
    ) => {
        operator!($lanes, Add, add, $add);
        operator!($lanes, Sub, sub, $sub);
        operator!($lanes, Mul, mul, $mul);
        operator!($lanes, Div, div, $div);

        impl Neg for $lanes {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                // SAFETY: the value is evidence of the machine. (-0 - x is -x, and folds into a fused multiply-add.)
                Self(unsafe { $sub($splat(-0.0), self.0) })
            }
        }

        impl Real for $lanes {
            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                Self::splat(x as $scalar)
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                let mut all = [0.0; $count];
                self.store(&mut all);
                f64::from(all[0])
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                // SAFETY: the value is evidence of the machine.
                Self(unsafe { $fma(self.0, b.0, c.0) })
            }
            #[inline(always)]
            fn multiply_add(self, b: Self, c: Self) -> Self {
                self.mul_add(b, c)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: the value is evidence of the machine.
                Self(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn ln(self) -> Self {
                functions::ln(self)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                functions::exp(self)
            }
            #[inline(always)]
            fn ln_1p(self) -> Self {
                functions::ln_1p(self)
            }
            #[inline(always)]
            fn exp_m1(self) -> Self {
                functions::exp_m1(self)
            }
            #[inline(always)]
            fn log1pmx(self) -> Self {
                functions::log1pmx(self)
            }
            #[inline(always)]
            fn expm1mx(self) -> Self {
                functions::expm1mx(self)
            }
            #[inline(always)]
            fn powf(self, y: Self) -> Self {
                let (mut x, mut powers) = ([0.0; $count], [0.0; $count]);
                self.store(&mut x);
                y.store(&mut powers);
                for (x, y) in x.iter_mut().zip(powers) {
                    *x = <$scalar>::powf(*x, y);
                }
                Self::load(&x)
            }
            #[inline(always)]
            fn select_greater(left: Self, right: Self, then: Self, otherwise: Self) -> Self {
                // SAFETY: the value is evidence of the machine.
                Self(unsafe { $own::choose($own::greater(left.0, right.0), then.0, otherwise.0) })
            }
            #[inline(always)]
            fn is_positive(self) -> bool {
                // SAFETY: the value is evidence of the machine.
                unsafe { $own::all($own::greater(self.0, $splat(0.0))) }
            }
        }

        impl functions::Parts for $lanes {
            #[inline(always)]
            fn exponent(self) -> Self {
                // SAFETY: the value is evidence of the machine.
                Self(unsafe { $own::exponent(self.0) })
            }
            #[inline(always)]
            fn times_power(self, k: Self) -> Self {
                // SAFETY: the value is evidence of the machine.
                Self(unsafe { $own::times_power(self.0, k.0) })
            }
            #[inline(always)]
            fn round(self) -> Self {
                // SAFETY: the value is evidence of the machine.
                Self(unsafe { $own::round(self.0) })
            }
            #[cold]
            #[inline(never)]
            fn each(self, f: fn($scalar) -> $scalar) -> Self {
                let mut all = [0.0; $count];
                self.store(&mut all);
                all.iter_mut().for_each(|x| *x = f(*x));
                Self::load(&all)
            }
        }

        impl Lanes for $lanes {
            type Scalar = $scalar;
            type Machine = $machine;
            const COUNT: usize = $count;
            #[inline(always)]
            fn splat(x: $scalar) -> Self {
                // SAFETY: the crate makes values only where there is evidence of the machine.
                Self(unsafe { $splat(x) })
            }
            #[inline(always)]
            fn load(from: &[$scalar]) -> Self {
                let from: &[$scalar; $count] = from[..$count].try_into().expect("as many numbers as lanes");
                // SAFETY: as for `splat`; the array holds a register.
                Self(unsafe { $load(from.as_ptr()) })
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                let to: &mut [$scalar; $count] = (&mut to[..$count]).try_into().expect("as many numbers as lanes");
                // SAFETY: the value is evidence of the machine; the array holds a register.
                unsafe { $store(to.as_mut_ptr(), self.0) }
            }
            #[inline(always)]
            unsafe fn gather(nodes: &[Node<$scalar>], places: &[Place]) -> [Self; 3] {
                let places: &[Place; $count] = places[..$count].try_into().expect("as many places as lanes");
                // SAFETY: as for `splat`; the caller vouches for the places.
                let [x, y, z] = unsafe { $own::gather(nodes.as_ptr().cast(), places) };
                [Self(x), Self(y), Self(z)]
            }
            #[inline(always)]
            unsafe fn scatter<I: Index>([x, y, z]: [Self; 3], nodes: &mut [Node<$scalar>], places: &[I]) {
                let places: &[I; $count] = places[..$count].try_into().expect("as many places as lanes");
                // SAFETY: the value is evidence of the machine; the caller vouches for the places.
                unsafe { $own::scatter([x.0, y.0, z.0], nodes.as_mut_ptr().cast(), places) }
            }
            fn first_not_positive(self) -> usize {
                let mut all = [0.0; $count];
                self.store(&mut all);
                all.iter().position(|x| x.is_nan() || *x <= 0.0).unwrap_or(0)
            }
        }
    };
}

lanes!(
    F32x16, f32, 16, Avx512,
    _mm512_add_ps _mm512_sub_ps _mm512_mul_ps _mm512_div_ps _mm512_fmadd_ps _mm512_sqrt_ps _mm512_set1_ps _mm512_loadu_ps _mm512_storeu_ps,
    f32x16
);
lanes!(
    F64x8, f64, 8, Avx512,
    _mm512_add_pd _mm512_sub_pd _mm512_mul_pd _mm512_div_pd _mm512_fmadd_pd _mm512_sqrt_pd _mm512_set1_pd _mm512_loadu_pd _mm512_storeu_pd,
    f64x8
);
lanes!(
    F32x8, f32, 8, Avx2,
    _mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_fmadd_ps _mm256_sqrt_ps _mm256_set1_ps _mm256_loadu_ps _mm256_storeu_ps,
    f32x8
);
lanes!(
    F64x4, f64, 4, Avx2,
    _mm256_add_pd _mm256_sub_pd _mm256_mul_pd _mm256_div_pd _mm256_fmadd_pd _mm256_sqrt_pd _mm256_set1_pd _mm256_loadu_pd _mm256_storeu_pd,
    f64x4
);

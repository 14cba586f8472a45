//! Registers of x86-64: AVX-512 and AVX2, both with fused multiply-add.
//!
//! Each operation is one instruction. They are inlined into functions that are compiled for the machine (`entries`), and
//! no value of these types exists without evidence that the machine has them: the crate makes none elsewhere.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Lanes, Node, Place, functions};
use crate::real::Real;

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
            unsafe fn scatter([x, y, z]: [Self; 3], nodes: &mut [Node<$scalar>], places: &[Place]) {
                let places: &[Place; $count] = places[..$count].try_into().expect("as many places as lanes");
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

// What differs between the registers. No closures: these would be functions for any machine.

mod f32x16 {
    use super::*;

    const COUNT: usize = 16;

    #[inline(always)]
    pub(super) unsafe fn greater(a: __m512, b: __m512) -> __mmask16 {
        unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    pub(super) unsafe fn choose(k: __mmask16, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_mask_blend_ps(k, b, a) }
    }

    #[inline(always)]
    pub(super) unsafe fn all(k: __mmask16) -> bool {
        k == 0xffff
    }

    #[inline(always)]
    pub(super) unsafe fn exponent(x: __m512) -> __m512 {
        unsafe { _mm512_getexp_ps(x) }
    }

    #[inline(always)]
    pub(super) unsafe fn times_power(x: __m512, k: __m512) -> __m512 {
        unsafe { _mm512_scalef_ps(x, k) }
    }

    #[inline(always)]
    pub(super) unsafe fn round(x: __m512) -> __m512 {
        unsafe { _mm512_roundscale_ps::<_MM_FROUND_TO_NEAREST_INT>(x) }
    }

    /// Four rows of x, y, z, 0 of four numbers each -> x, y, z, 0, or back, within each quarter.
    #[inline(always)]
    pub(super) unsafe fn transpose([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
        unsafe {
            let (low, high) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let (low2, high2) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
            [
                _mm512_shuffle_ps::<0x44>(low, low2),
                _mm512_shuffle_ps::<0xee>(low, low2),
                _mm512_shuffle_ps::<0x44>(high, high2),
                _mm512_shuffle_ps::<0xee>(high, high2),
            ]
        }
    }

    /// Row k of a transposed block.
    #[inline(always)]
    pub(super) unsafe fn row(nodes: *const u64, places: &[Place; COUNT], k: usize) -> __m512 {
        unsafe {
            let row = _mm512_castps128_ps512(_mm_loadu_ps(at(nodes, places[k])));
            let row = _mm512_insertf32x4::<1>(row, _mm_loadu_ps(at(nodes, places[k + 4])));
            let row = _mm512_insertf32x4::<2>(row, _mm_loadu_ps(at(nodes, places[k + 8])));
            _mm512_insertf32x4::<3>(row, _mm_loadu_ps(at(nodes, places[k + 12])))
        }
    }

    #[inline(always)]
    pub(super) unsafe fn gather(nodes: *const u64, places: &[Place; COUNT]) -> [__m512; 3] {
        unsafe {
            let rows = [row(nodes, places, 0), row(nodes, places, 1), row(nodes, places, 2), row(nodes, places, 3)];
            let [x, y, z, _] = transpose(rows);
            [x, y, z]
        }
    }

    #[inline(always)]
    pub(super) unsafe fn scatter([x, y, z]: [__m512; 3], nodes: *mut u64, places: &[Place; COUNT]) {
        unsafe {
            let rows = transpose([x, y, z, _mm512_setzero_ps()]);
            for k in 0..4 {
                add_ps(at_mut(nodes, places[k]), _mm512_castps512_ps128(rows[k]));
            }
            for k in 0..4 {
                add_ps(at_mut(nodes, places[k + 4]), _mm512_extractf32x4_ps::<1>(rows[k]));
            }
            for k in 0..4 {
                add_ps(at_mut(nodes, places[k + 8]), _mm512_extractf32x4_ps::<2>(rows[k]));
            }
            for k in 0..4 {
                add_ps(at_mut(nodes, places[k + 12]), _mm512_extractf32x4_ps::<3>(rows[k]));
            }
        }
    }
}

mod f64x8 {
    use super::*;

    const COUNT: usize = 8;

    #[inline(always)]
    pub(super) unsafe fn greater(a: __m512d, b: __m512d) -> __mmask8 {
        unsafe { _mm512_cmp_pd_mask::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    pub(super) unsafe fn choose(k: __mmask8, a: __m512d, b: __m512d) -> __m512d {
        unsafe { _mm512_mask_blend_pd(k, b, a) }
    }

    #[inline(always)]
    pub(super) unsafe fn all(k: __mmask8) -> bool {
        k == 0xff
    }

    #[inline(always)]
    pub(super) unsafe fn exponent(x: __m512d) -> __m512d {
        unsafe { _mm512_getexp_pd(x) }
    }

    #[inline(always)]
    pub(super) unsafe fn times_power(x: __m512d, k: __m512d) -> __m512d {
        unsafe { _mm512_scalef_pd(x, k) }
    }

    #[inline(always)]
    pub(super) unsafe fn round(x: __m512d) -> __m512d {
        unsafe { _mm512_roundscale_pd::<_MM_FROUND_TO_NEAREST_INT>(x) }
    }

    /// Places of two rows' pairs of numbers in one row, within each half.
    #[inline(always)]
    pub(super) unsafe fn transpose([a, b, c, d]: [__m512d; 4]) -> [__m512d; 4] {
        unsafe {
            let (low, high) = (_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b));
            let (low2, high2) = (_mm512_unpacklo_pd(c, d), _mm512_unpackhi_pd(c, d));
            let first = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
            let second = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
            [
                _mm512_permutex2var_pd(low, first, low2),
                _mm512_permutex2var_pd(high, first, high2),
                _mm512_permutex2var_pd(low, second, low2),
                _mm512_permutex2var_pd(high, second, high2),
            ]
        }
    }

    /// Row k of a transposed block.
    #[inline(always)]
    pub(super) unsafe fn row(nodes: *const u64, places: &[Place; COUNT], k: usize) -> __m512d {
        unsafe {
            let row = _mm512_castpd256_pd512(_mm256_loadu_pd(at(nodes, places[k])));
            _mm512_insertf64x4::<1>(row, _mm256_loadu_pd(at(nodes, places[k + 4])))
        }
    }

    #[inline(always)]
    pub(super) unsafe fn gather(nodes: *const u64, places: &[Place; COUNT]) -> [__m512d; 3] {
        unsafe {
            let rows = [row(nodes, places, 0), row(nodes, places, 1), row(nodes, places, 2), row(nodes, places, 3)];
            let [x, y, z, _] = transpose(rows);
            [x, y, z]
        }
    }

    #[inline(always)]
    pub(super) unsafe fn scatter([x, y, z]: [__m512d; 3], nodes: *mut u64, places: &[Place; COUNT]) {
        unsafe {
            let rows = transpose([x, y, z, _mm512_setzero_pd()]);
            for k in 0..4 {
                add_pd(at_mut(nodes, places[k]), _mm512_castpd512_pd256(rows[k]));
            }
            for k in 0..4 {
                add_pd(at_mut(nodes, places[k + 4]), _mm512_extractf64x4_pd::<1>(rows[k]));
            }
        }
    }
}

mod f32x8 {
    use super::*;

    const COUNT: usize = 8;

    #[inline(always)]
    pub(super) unsafe fn greater(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    pub(super) unsafe fn choose(k: __m256, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_blendv_ps(b, a, k) }
    }

    #[inline(always)]
    pub(super) unsafe fn all(k: __m256) -> bool {
        unsafe { _mm256_movemask_ps(k) == 0xff }
    }

    #[inline(always)]
    pub(super) unsafe fn exponent(x: __m256) -> __m256 {
        unsafe {
            let bits = _mm256_srli_epi32::<23>(_mm256_castps_si256(x));
            _mm256_cvtepi32_ps(_mm256_sub_epi32(bits, _mm256_set1_epi32(127)))
        }
    }

    #[inline(always)]
    pub(super) unsafe fn times_power(x: __m256, k: __m256) -> __m256 {
        unsafe {
            let bits = _mm256_slli_epi32::<23>(_mm256_add_epi32(_mm256_cvtps_epi32(k), _mm256_set1_epi32(127)));
            _mm256_mul_ps(x, _mm256_castsi256_ps(bits))
        }
    }

    #[inline(always)]
    pub(super) unsafe fn round(x: __m256) -> __m256 {
        unsafe { _mm256_round_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(x) }
    }

    #[inline(always)]
    pub(super) unsafe fn transpose([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
        unsafe {
            let (low, high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            let (low2, high2) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
            [
                _mm256_shuffle_ps::<0x44>(low, low2),
                _mm256_shuffle_ps::<0xee>(low, low2),
                _mm256_shuffle_ps::<0x44>(high, high2),
                _mm256_shuffle_ps::<0xee>(high, high2),
            ]
        }
    }

    /// Row k of a transposed block.
    #[inline(always)]
    pub(super) unsafe fn row(nodes: *const u64, places: &[Place; COUNT], k: usize) -> __m256 {
        unsafe {
            let row = _mm256_castps128_ps256(_mm_loadu_ps(at(nodes, places[k])));
            _mm256_insertf128_ps::<1>(row, _mm_loadu_ps(at(nodes, places[k + 4])))
        }
    }

    #[inline(always)]
    pub(super) unsafe fn gather(nodes: *const u64, places: &[Place; COUNT]) -> [__m256; 3] {
        unsafe {
            let rows = [row(nodes, places, 0), row(nodes, places, 1), row(nodes, places, 2), row(nodes, places, 3)];
            let [x, y, z, _] = transpose(rows);
            [x, y, z]
        }
    }

    #[inline(always)]
    pub(super) unsafe fn scatter([x, y, z]: [__m256; 3], nodes: *mut u64, places: &[Place; COUNT]) {
        unsafe {
            let rows = transpose([x, y, z, _mm256_setzero_ps()]);
            for k in 0..4 {
                add_ps(at_mut(nodes, places[k]), _mm256_castps256_ps128(rows[k]));
            }
            for k in 0..4 {
                add_ps(at_mut(nodes, places[k + 4]), _mm256_extractf128_ps::<1>(rows[k]));
            }
        }
    }
}

mod f64x4 {
    use super::*;

    const COUNT: usize = 4;

    /// 1.5 x 2^52: a small integer added to it stands in its last bits.
    const SHIFTER: f64 = 6_755_399_441_055_744.0;

    #[inline(always)]
    pub(super) unsafe fn greater(a: __m256d, b: __m256d) -> __m256d {
        unsafe { _mm256_cmp_pd::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    pub(super) unsafe fn choose(k: __m256d, a: __m256d, b: __m256d) -> __m256d {
        unsafe { _mm256_blendv_pd(b, a, k) }
    }

    #[inline(always)]
    pub(super) unsafe fn all(k: __m256d) -> bool {
        unsafe { _mm256_movemask_pd(k) == 0xf }
    }

    #[inline(always)]
    pub(super) unsafe fn exponent(x: __m256d) -> __m256d {
        unsafe {
            let bits = _mm256_srli_epi64::<52>(_mm256_castpd_si256(x));
            let shifted = _mm256_add_epi64(bits, _mm256_castpd_si256(_mm256_set1_pd(SHIFTER)));
            _mm256_sub_pd(_mm256_castsi256_pd(shifted), _mm256_set1_pd(SHIFTER + 1023.0))
        }
    }

    #[inline(always)]
    pub(super) unsafe fn times_power(x: __m256d, k: __m256d) -> __m256d {
        unsafe {
            let biased = _mm256_castpd_si256(_mm256_add_pd(k, _mm256_set1_pd(SHIFTER + 1023.0)));
            _mm256_mul_pd(x, _mm256_castsi256_pd(_mm256_slli_epi64::<52>(biased)))
        }
    }

    #[inline(always)]
    pub(super) unsafe fn round(x: __m256d) -> __m256d {
        unsafe { _mm256_round_pd::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(x) }
    }

    #[inline(always)]
    pub(super) unsafe fn transpose([a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
        unsafe {
            let (low, high) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
            let (low2, high2) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
            [
                _mm256_permute2f128_pd::<0x20>(low, low2),
                _mm256_permute2f128_pd::<0x20>(high, high2),
                _mm256_permute2f128_pd::<0x31>(low, low2),
                _mm256_permute2f128_pd::<0x31>(high, high2),
            ]
        }
    }

    /// Row k of a transposed block.
    #[inline(always)]
    pub(super) unsafe fn row(nodes: *const u64, places: &[Place; COUNT], k: usize) -> __m256d {
        unsafe { _mm256_loadu_pd(at(nodes, places[k])) }
    }

    #[inline(always)]
    pub(super) unsafe fn gather(nodes: *const u64, places: &[Place; COUNT]) -> [__m256d; 3] {
        unsafe {
            let rows = [row(nodes, places, 0), row(nodes, places, 1), row(nodes, places, 2), row(nodes, places, 3)];
            let [x, y, z, _] = transpose(rows);
            [x, y, z]
        }
    }

    #[inline(always)]
    pub(super) unsafe fn scatter([x, y, z]: [__m256d; 3], nodes: *mut u64, places: &[Place; COUNT]) {
        unsafe {
            let rows = transpose([x, y, z, _mm256_setzero_pd()]);
            for k in 0..4 {
                add_pd(at_mut(nodes, places[k]), rows[k]);
            }
        }
    }
}

/// The number at a place.
#[inline(always)]
unsafe fn at<T>(nodes: *const u64, place: Place) -> *const T {
    unsafe { nodes.add(usize::from(place)).cast() }
}

#[inline(always)]
unsafe fn at_mut<T>(nodes: *mut u64, place: Place) -> *mut T {
    unsafe { nodes.add(usize::from(place)).cast() }
}

#[inline(always)]
unsafe fn add_ps(to: *mut f32, row: __m128) {
    unsafe { _mm_storeu_ps(to, _mm_add_ps(_mm_loadu_ps(to), row)) }
}

#[inline(always)]
unsafe fn add_pd(to: *mut f64, row: __m256d) {
    unsafe { _mm256_storeu_pd(to, _mm256_add_pd(_mm256_loadu_pd(to), row)) }
}

//! What differs between the registers: comparisons, exponents, and vectors at nodes, loaded and added by transposition.
//!
//! No closures: these would be functions for any machine.

use std::arch::x86_64::*;

use crate::lanes::{Index, Place};

pub(super) mod f32x16 {
    use super::*;

    const COUNT: usize = 16;

    #[inline(always)]
    pub(in crate::lanes) unsafe fn greater(a: __m512, b: __m512) -> __mmask16 {
        unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn choose(k: __mmask16, a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_mask_blend_ps(k, b, a) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn all(k: __mmask16) -> bool {
        k == 0xffff
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn exponent(x: __m512) -> __m512 {
        unsafe { _mm512_getexp_ps(x) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn times_power(x: __m512, k: __m512) -> __m512 {
        unsafe { _mm512_scalef_ps(x, k) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn round(x: __m512) -> __m512 {
        unsafe { _mm512_roundscale_ps::<_MM_FROUND_TO_NEAREST_INT>(x) }
    }

    /// Four rows of x, y, z, 0 of four numbers each -> x, y, z, 0, or back, within each quarter.
    #[inline(always)]
    pub(in crate::lanes) unsafe fn transpose([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
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
    pub(in crate::lanes) unsafe fn row(nodes: *const u64, places: &[Place; COUNT], k: usize) -> __m512 {
        unsafe {
            let row = _mm512_castps128_ps512(_mm_loadu_ps(at(nodes, places[k])));
            let row = _mm512_insertf32x4::<1>(row, _mm_loadu_ps(at(nodes, places[k + 4])));
            let row = _mm512_insertf32x4::<2>(row, _mm_loadu_ps(at(nodes, places[k + 8])));
            _mm512_insertf32x4::<3>(row, _mm_loadu_ps(at(nodes, places[k + 12])))
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn gather(nodes: *const u64, places: &[Place; COUNT]) -> [__m512; 3] {
        unsafe {
            let rows = [row(nodes, places, 0), row(nodes, places, 1), row(nodes, places, 2), row(nodes, places, 3)];
            let [x, y, z, _] = transpose(rows);
            [x, y, z]
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn scatter<I: Index>([x, y, z]: [__m512; 3], nodes: *mut u64, places: &[I; COUNT]) {
        unsafe {
            let rows = transpose([x, y, z, _mm512_setzero_ps()]);
            let rows = [whole_ps(rows[0]), whole_ps(rows[1]), whole_ps(rows[2]), whole_ps(rows[3])];
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

pub(super) mod f64x8 {
    use super::*;

    const COUNT: usize = 8;

    #[inline(always)]
    pub(in crate::lanes) unsafe fn greater(a: __m512d, b: __m512d) -> __mmask8 {
        unsafe { _mm512_cmp_pd_mask::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn choose(k: __mmask8, a: __m512d, b: __m512d) -> __m512d {
        unsafe { _mm512_mask_blend_pd(k, b, a) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn all(k: __mmask8) -> bool {
        k == 0xff
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn exponent(x: __m512d) -> __m512d {
        unsafe { _mm512_getexp_pd(x) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn times_power(x: __m512d, k: __m512d) -> __m512d {
        unsafe { _mm512_scalef_pd(x, k) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn round(x: __m512d) -> __m512d {
        unsafe { _mm512_roundscale_pd::<_MM_FROUND_TO_NEAREST_INT>(x) }
    }

    /// Places of two rows' pairs of numbers in one row, within each half.
    #[inline(always)]
    pub(in crate::lanes) unsafe fn transpose([a, b, c, d]: [__m512d; 4]) -> [__m512d; 4] {
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
    pub(in crate::lanes) unsafe fn row(nodes: *const u64, places: &[Place; COUNT], k: usize) -> __m512d {
        unsafe {
            let row = _mm512_castpd256_pd512(_mm256_loadu_pd(at(nodes, places[k])));
            _mm512_insertf64x4::<1>(row, _mm256_loadu_pd(at(nodes, places[k + 4])))
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn gather(nodes: *const u64, places: &[Place; COUNT]) -> [__m512d; 3] {
        unsafe {
            let rows = [row(nodes, places, 0), row(nodes, places, 1), row(nodes, places, 2), row(nodes, places, 3)];
            let [x, y, z, _] = transpose(rows);
            [x, y, z]
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn scatter<I: Index>([x, y, z]: [__m512d; 3], nodes: *mut u64, places: &[I; COUNT]) {
        unsafe {
            let rows = transpose([x, y, z, _mm512_setzero_pd()]);
            let rows = [whole_pd(rows[0]), whole_pd(rows[1]), whole_pd(rows[2]), whole_pd(rows[3])];
            for k in 0..4 {
                add_pd(at_mut(nodes, places[k]), _mm512_castpd512_pd256(rows[k]));
            }
            for k in 0..4 {
                add_pd(at_mut(nodes, places[k + 4]), _mm512_extractf64x4_pd::<1>(rows[k]));
            }
        }
    }
}

pub(super) mod f32x8 {
    use super::*;

    const COUNT: usize = 8;

    #[inline(always)]
    pub(in crate::lanes) unsafe fn greater(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn choose(k: __m256, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_blendv_ps(b, a, k) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn all(k: __m256) -> bool {
        unsafe { _mm256_movemask_ps(k) == 0xff }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn exponent(x: __m256) -> __m256 {
        unsafe {
            let bits = _mm256_srli_epi32::<23>(_mm256_castps_si256(x));
            _mm256_cvtepi32_ps(_mm256_sub_epi32(bits, _mm256_set1_epi32(127)))
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn times_power(x: __m256, k: __m256) -> __m256 {
        unsafe {
            let bits = _mm256_slli_epi32::<23>(_mm256_add_epi32(_mm256_cvtps_epi32(k), _mm256_set1_epi32(127)));
            _mm256_mul_ps(x, _mm256_castsi256_ps(bits))
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn round(x: __m256) -> __m256 {
        unsafe { _mm256_round_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(x) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn transpose([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
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
    pub(in crate::lanes) unsafe fn row(nodes: *const u64, places: &[Place; COUNT], k: usize) -> __m256 {
        unsafe {
            let row = _mm256_castps128_ps256(_mm_loadu_ps(at(nodes, places[k])));
            _mm256_insertf128_ps::<1>(row, _mm_loadu_ps(at(nodes, places[k + 4])))
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn gather(nodes: *const u64, places: &[Place; COUNT]) -> [__m256; 3] {
        unsafe {
            let rows = [row(nodes, places, 0), row(nodes, places, 1), row(nodes, places, 2), row(nodes, places, 3)];
            let [x, y, z, _] = transpose(rows);
            [x, y, z]
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn scatter<I: Index>([x, y, z]: [__m256; 3], nodes: *mut u64, places: &[I; COUNT]) {
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

pub(super) mod f64x4 {
    use super::*;

    const COUNT: usize = 4;

    /// 1.5 x 2^52: a small integer added to it stands in its last bits.
    const SHIFTER: f64 = 6_755_399_441_055_744.0;

    #[inline(always)]
    pub(in crate::lanes) unsafe fn greater(a: __m256d, b: __m256d) -> __m256d {
        unsafe { _mm256_cmp_pd::<_CMP_GT_OQ>(a, b) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn choose(k: __m256d, a: __m256d, b: __m256d) -> __m256d {
        unsafe { _mm256_blendv_pd(b, a, k) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn all(k: __m256d) -> bool {
        unsafe { _mm256_movemask_pd(k) == 0xf }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn exponent(x: __m256d) -> __m256d {
        unsafe {
            let bits = _mm256_srli_epi64::<52>(_mm256_castpd_si256(x));
            let shifted = _mm256_add_epi64(bits, _mm256_castpd_si256(_mm256_set1_pd(SHIFTER)));
            _mm256_sub_pd(_mm256_castsi256_pd(shifted), _mm256_set1_pd(SHIFTER + 1023.0))
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn times_power(x: __m256d, k: __m256d) -> __m256d {
        unsafe {
            let biased = _mm256_castpd_si256(_mm256_add_pd(k, _mm256_set1_pd(SHIFTER + 1023.0)));
            _mm256_mul_pd(x, _mm256_castsi256_pd(_mm256_slli_epi64::<52>(biased)))
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn round(x: __m256d) -> __m256d {
        unsafe { _mm256_round_pd::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(x) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn transpose([a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
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
    pub(in crate::lanes) unsafe fn row(nodes: *const u64, places: &[Place; COUNT], k: usize) -> __m256d {
        unsafe { _mm256_loadu_pd(at(nodes, places[k])) }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn gather(nodes: *const u64, places: &[Place; COUNT]) -> [__m256d; 3] {
        unsafe {
            let rows = [row(nodes, places, 0), row(nodes, places, 1), row(nodes, places, 2), row(nodes, places, 3)];
            let [x, y, z, _] = transpose(rows);
            [x, y, z]
        }
    }

    #[inline(always)]
    pub(in crate::lanes) unsafe fn scatter<I: Index>([x, y, z]: [__m256d; 3], nodes: *mut u64, places: &[I; COUNT]) {
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
unsafe fn at_mut<T>(nodes: *mut u64, place: impl Index) -> *mut T {
    unsafe { nodes.add(place.index()).cast() }
}

/// A register that the compiler takes as it is: it would transpose each quarter of four on its own, twice the work.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn whole_ps(mut row: __m512) -> __m512 {
    // SAFETY: it does nothing.
    unsafe { std::arch::asm!("/* {0} */", inout(zmm_reg) row, options(pure, nomem, nostack, preserves_flags)) };
    row
}

/// As [`whole_ps`].
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn whole_pd(mut row: __m512d) -> __m512d {
    // SAFETY: it does nothing.
    unsafe { std::arch::asm!("/* {0} */", inout(zmm_reg) row, options(pure, nomem, nostack, preserves_flags)) };
    row
}

#[inline(always)]
unsafe fn add_ps(to: *mut f32, row: __m128) {
    unsafe { _mm_storeu_ps(to, _mm_add_ps(_mm_loadu_ps(to), row)) }
}

#[inline(always)]
unsafe fn add_pd(to: *mut f64, row: __m256d) {
    unsafe { _mm256_storeu_pd(to, _mm256_add_pd(_mm256_loadu_pd(to), row)) }
}

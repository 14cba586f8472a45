//! Memory of kernels: numbers that begin at the beginning of a cache line, in pages as large as the system has them.
#![allow(unsafe_code)]

/// Bytes of a cache line.
const LINE: usize = 64;

/// Numbers that begin at the beginning of a cache line: no register that is read from them lies across two.
#[derive(Debug)]
pub(crate) struct Aligned<R> {
    numbers: Vec<R>,
    start: usize,
    count: usize,
}

impl<R: Copy + Default> Aligned<R> {
    /// So many zeros: memory that nobody has touched yet.
    pub fn zeros(count: usize) -> Self {
        let mut numbers = vec![R::default(); count + LINE / size_of::<R>()];
        in_large_pages(&mut numbers);
        // Where it cannot be told, they begin anywhere.
        let start = numbers.as_ptr().align_offset(LINE).min(LINE / size_of::<R>());
        Self { numbers, start, count }
    }
}

impl<R> Aligned<R> {
    #[inline(always)]
    pub fn all(&self) -> &[R] {
        &self.numbers[self.start..][..self.count]
    }

    pub fn all_mut(&mut self) -> &mut [R] {
        &mut self.numbers[self.start..][..self.count]
    }

    /// The cache lines of a range, as far as it is there.
    #[inline(always)]
    pub fn prefetch(&self, start: usize, count: usize) {
        prefetch(&self.all()[start.min(self.count)..(start + count).min(self.count)]);
    }
}

/// Asks for the cache lines of some numbers.
#[inline(always)]
pub(crate) fn prefetch<T>(numbers: &[T]) {
    #[cfg(target_arch = "x86_64")]
    for line in 0..size_of_val(numbers).div_ceil(LINE) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 machine has it, and it reads nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(numbers.as_ptr().cast::<i8>().wrapping_add(line * LINE)) };
    }
}

/// Asks for large pages: elements are read in order, and of small ones each 85 meet a page whose address has to be found.
#[cfg(target_os = "linux")]
fn in_large_pages<R>(numbers: &mut [R]) {
    /// What every machine's pages are multiples of, or multiples of which they are.
    const PAGE: usize = 1 << 16;
    const LARGE: usize = 1 << 21;
    let start = numbers.as_mut_ptr().cast::<u8>();
    let before = start.align_offset(PAGE);
    let whole = size_of_val(numbers).saturating_sub(before) / PAGE * PAGE;
    if whole >= 2 * LARGE {
        // SAFETY: the pages are ours, and it changes nothing of what they hold. Where it fails they stay as they are.
        let _ = unsafe { rustix::mm::madvise(start.add(before).cast(), whole, rustix::mm::Advice::LinuxHugepage) };
    }
}

#[cfg(not(target_os = "linux"))]
fn in_large_pages<R>(_: &mut [R]) {}

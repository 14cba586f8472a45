//! What the machine can do at most: bytes of memory and operations a second.

use std::time::Instant;

use rayon::prelude::*;
use tensormass_kernels::Chains;

use crate::cpu::{Engine, Precision};

/// Numbers of each of the triad's three arrays: far more than a cache holds.
const TRIAD: usize = 1 << 23;
/// Times that each is measured: the best counts.
const TIMES: usize = 5;
/// Rounds of multiplications and additions in one measurement of a thread.
const ROUNDS: usize = 200_000;

/// Memory bandwidth in bytes/s, by a = b + 3 c over long arrays of f64.
pub(super) fn triad() -> f64 {
    let (mut a, b, c) = (vec![0.0_f64; TRIAD], vec![1.0_f64; TRIAD], vec![2.0_f64; TRIAD]);
    let mut best = f64::INFINITY;
    for _ in 0..TIMES {
        let start = Instant::now();
        a.par_chunks_mut(1 << 16).zip(b.par_chunks(1 << 16)).zip(c.par_chunks(1 << 16)).for_each(|((a, b), c)| {
            for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                *a = b + 3.0 * c;
            }
        });
        best = best.min(start.elapsed().as_secs_f64());
        std::hint::black_box(&mut a);
    }
    3.0 * 8.0 * TRIAD as f64 / best
}

/// Operations a second of a precision on all threads, by multiplications and additions of numbers in registers.
pub(super) fn peak<R: Precision>() -> f64 {
    let (threads, chains) = (rayon::current_num_threads(), Chains::<R>::new(Engine::best()));
    let mut best = f64::INFINITY;
    for _ in 0..TIMES {
        let start = Instant::now();
        (0..threads).into_par_iter().for_each(|_| {
            std::hint::black_box(chains.run(std::hint::black_box(ROUNDS)));
        });
        best = best.min(start.elapsed().as_secs_f64());
    }
    (threads * ROUNDS * chains.operations()) as f64 / best
}

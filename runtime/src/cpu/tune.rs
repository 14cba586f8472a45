//! Which way to compute products with the tangent is fastest here: measured, not reckoned.
//!
//! What is compared is the time of a solution: of all products, and of what they need of the state.

use std::time::Instant;

use super::{CpuBackend, CpuField, Precision};
use crate::backend::{Backend, ForceField};
use crate::tangent::Tangent;

/// Times that the candidates are measured in turn.
const ROUNDS: usize = 3;
/// Products that are measured at once, after one that is not.
const PRODUCTS: u32 = 3;
/// Products of a solution, about.
const SOLUTION: u32 = 50;

/// A field with the fastest of some ways to compute products with the tangents of its laws, and which that is; the first
/// of those that take the same time.
///
/// # Panics
/// There is no candidate.
pub fn fastest<R: Precision>(
    backend: &CpuBackend<R>,
    mut field: CpuField<R>,
    candidates: &[Vec<Tangent>],
) -> (CpuField<R>, usize) {
    let (rest, mut out) = (backend.zeros(), backend.zeros());
    let mut best = vec![f64::INFINITY; candidates.len()];
    for _ in 0..ROUNDS {
        for (candidate, best) in candidates.iter().zip(&mut best) {
            field = field.with_tangents(candidate);
            // What is done once for all states comes first.
            field.prepare(backend, &rest);
            let start = Instant::now();
            field.prepare(backend, &rest);
            let prepared = start.elapsed();
            field.add_dforce(backend, &rest, 1.0, &mut out);
            let start = Instant::now();
            for _ in 0..PRODUCTS {
                field.add_dforce(backend, &rest, 1.0, &mut out);
            }
            let solution = prepared + start.elapsed() * SOLUTION / PRODUCTS;
            *best = best.min(solution.as_secs_f64());
        }
    }
    let fastest = (0..best.len()).fold(0, |fastest, k| if best[k] < best[fastest] { k } else { fastest });
    (field.with_tangents(&candidates[fastest]), fastest)
}

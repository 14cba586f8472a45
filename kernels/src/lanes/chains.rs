//! Chains of multiplications and additions in registers: how many operations a machine does at most.

use super::{Engine, Entries, Lanes, Registers};
use crate::table::Precision;

/// Chains side by side: an operation of one need not wait for that of another.
const CHAINS: usize = 12;

/// Chains of multiplications and additions on some lanes.
#[derive(Debug, Clone, Copy)]
pub struct Chains<R> {
    run: fn(usize) -> R,
    lanes: usize,
}

impl<R: Precision> Chains<R> {
    /// Those of a machine.
    pub fn new(engine: Engine) -> Self {
        match engine.registers() {
            Registers::Scalar => Self::of::<R>(),
            #[cfg(target_arch = "x86_64")]
            Registers::Avx2(_) => Self::of::<R::Avx2>(),
            #[cfg(target_arch = "x86_64")]
            Registers::Avx512(_) => Self::of::<R::Avx512>(),
        }
    }

    fn of<V: Entries + Lanes<Scalar = R>>() -> Self {
        Self { run: V::chains(), lanes: V::COUNT }
    }
}

impl<R> Chains<R> {
    /// So many rounds; what comes out depends on all of them.
    pub fn run(&self, rounds: usize) -> R {
        (self.run)(rounds)
    }

    /// Operations of a round.
    pub fn operations(&self) -> usize {
        2 * CHAINS * self.lanes
    }
}

/// See [`Chains::run`].
#[inline(always)]
pub(super) fn chains<V: Lanes>(rounds: usize) -> V::Scalar {
    let mut chains = [V::from_f64(0.0); CHAINS];
    for (k, chain) in chains.iter_mut().enumerate() {
        *chain = V::from_f64(k as f64);
    }
    let (factor, term) = (V::from_f64(0.999), V::from_f64(1e-3));
    for _ in 0..rounds {
        for chain in &mut chains {
            *chain = chain.multiply_add(factor, term);
        }
    }
    let mut sum = chains[0];
    for chain in &chains[1..] {
        sum = sum + *chain;
    }
    let mut all = vec![V::Scalar::default(); V::COUNT];
    sum.store(&mut all);
    all[0]
}

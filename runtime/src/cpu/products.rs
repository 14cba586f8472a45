//! Products with the tangent on the CPU: what they need of a state, and which elements compute them how.

use rayon::prelude::*;
use tensormass_kernels::{Node, States};

use super::assembled::Assembled;
use super::cluster::Room;
use super::field::{CpuBatch, CpuField};
use super::vectors::CpuVector;
use super::{CpuBackend, Precision};
use crate::backend::Backend;
use crate::inventory::names::STORED_TANGENT;
use crate::inventory::{Lease, Ledger};
use crate::tangent::Tangent;

/// How products are computed, with what they need of a state; none before they are asked for.
pub(super) enum Products<R> {
    Stored(Option<Stored<R>>),
    Recomputed,
    Assembled(Option<Assembled<R>>),
}

/// Numbers of the state of a batch.
pub(super) struct Stored<R> {
    states: States<R>,
    _lease: Lease,
}

impl<R> From<Tangent> for Products<R> {
    fn from(tangent: Tangent) -> Self {
        match tangent {
            Tangent::Stored => Self::Stored(None),
            Tangent::Recomputed => Self::Recomputed,
            Tangent::Assembled => Self::Assembled(None),
        }
    }
}

impl<R: Precision> Products<R> {
    /// The kernel of a product.
    fn kernel(&self) -> &'static str {
        match self {
            Self::Stored(_) => "apply",
            Self::Recomputed => "dforce",
            Self::Assembled(_) => "multiply",
        }
    }
}

impl<R: Precision> CpuBatch<R> {
    /// Takes the tangent at a displacement.
    fn linearize(&mut self, u: &CpuVector<R>, ledger: &Ledger) {
        let Self { law, compute, clusters, blocks, products, .. } = self;
        let (compute, clusters, blocks) = (&**compute, &*clusters, &*blocks);
        match products {
            Products::Stored(stored) => {
                let Stored { states, .. } = stored.get_or_insert_with(|| {
                    let states = compute.states(blocks);
                    Stored { _lease: ledger.hold(STORED_TANGENT, states.bytes()), states }
                });
                // Nothing is stored of a tangent that depends on nothing.
                if compute.stored() == 0 {
                    return;
                }
                ledger.ran("linearize");
                states.parts_mut(blocks).into_par_iter().enumerate().for_each_init(Room::new, |room, (k, states)| {
                    let [u] = room.copies(blocks, &clusters[k], [u]);
                    compute.linearize(blocks.part(k), u, states);
                });
            }
            Products::Recomputed => {}
            Products::Assembled(matrix) => {
                let matrix = matrix.get_or_insert_with(|| Assembled::new(clusters, blocks, compute.lanes(), ledger));
                // The tangent of a linear law is the same everywhere.
                if !(law.structure.linear && matrix.is_filled) {
                    ledger.ran("assemble");
                    matrix.fill(compute, blocks, clusters, u);
                }
            }
        }
    }

    /// What a cluster adds to a product from what is stored of the state.
    fn multiply(&self, cluster: usize, du: &[Node<R>], out: &mut [Node<R>]) -> Option<usize> {
        match &self.products {
            Products::Stored(Some(Stored { states, .. })) => {
                let part = self.blocks.part(cluster);
                self.compute.apply(part, states.of(part), du, out);
            }
            Products::Assembled(Some(matrix)) => matrix.multiply(&*self.compute, cluster, du, out),
            _ => unreachable!("the tangent is linearized"),
        }
        None
    }
}

impl<R: Precision> CpuField<R> {
    /// Whether the tangent of a law depends on the displacement.
    pub(super) fn depends_on_state(&self) -> bool {
        self.batches.iter().any(|b| !b.law.structure.linear)
    }

    /// Takes the tangent at a displacement, which is kept where something depends on it.
    pub(super) fn take_tangent_at(&mut self, backend: &CpuBackend<R>, u: &CpuVector<R>) {
        if self.depends_on_state() {
            backend.copy(u, self.state.get_or_insert_with(|| backend.zeros()));
        }
        self.linearize(u);
    }

    fn linearize(&mut self, u: &CpuVector<R>) {
        let Self { batches, ledger, .. } = self;
        batches.iter_mut().for_each(|batch| batch.linearize(u, ledger));
        self.is_linearized = true;
    }

    /// Lets go of the tangent.
    pub(super) fn forget(&mut self) {
        self.state = None;
        self.is_linearized = false;
        for batch in &mut self.batches {
            match &mut batch.products {
                Products::Stored(stored) => *stored = None,
                Products::Recomputed => {}
                Products::Assembled(matrix) => *matrix = None,
            }
        }
    }

    /// Pass 1 of a product with the tangent at the prepared state: that of rest, if none was.
    pub(super) fn apply(&mut self, du: &CpuVector<R>) {
        if !self.is_linearized {
            let rest = CpuVector::zeros(du.0.len(), &self.ledger);
            self.linearize(&rest);
            self.state = self.depends_on_state().then_some(rest);
        }
        let kernels = ["apply", "dforce", "multiply"].into_iter();
        for kernel in kernels.filter(|kernel| self.batches.iter().any(|b| b.products.kernel() == *kernel)) {
            self.ledger.ran(kernel);
        }
        let recomputes = self.batches.iter().any(|b| matches!(b.products, Products::Recomputed));
        let done = if recomputes {
            let state = self.state.take();
            // Linear laws take any displacement.
            let u = state.as_ref().unwrap_or(du);
            let done = self.pass([u, du], |batch, k, [u, du], out| match batch.products {
                Products::Recomputed => {
                    batch.compute.dforce(batch.blocks.part(k), [u, du], out);
                    None
                }
                _ => batch.multiply(k, du, out),
            });
            self.state = state;
            done
        } else {
            self.pass([du], |batch, k, [du], out| batch.multiply(k, du, out))
        };
        debug_assert!(done.is_ok(), "differentials report no domain");
    }
}

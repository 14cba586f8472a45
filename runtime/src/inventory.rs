//! What a run holds and what it runs: buffers by name with their bytes, kernels by name with how often they ran.
//!
//! Whoever makes a buffer enters it in the backend's [`Ledger`] and keeps the [`Lease`] as long as the buffer; whoever
//! compiles a kernel keeps its [`Tally`]. That costs a lock for each buffer and each pass over a body, no more.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Names of buffers, in plans and inventories.
pub mod names {
    /// State, masses, loads, and what integrators and solvers work with.
    pub const VECTORS: &str = "vectors over the nodes";
    /// The nodes of each element.
    pub const ELEMENT_NODES: &str = "nodes of elements";
    /// J^-1 and weight of each quadrature point.
    pub const REST: &str = "rest data of elements";
    /// Constants of materials, one set or one for each element.
    pub const CONSTANTS: &str = "constants of materials";
    /// The mesh's number of each element, where the order is another.
    pub const ELEMENT_NUMBERS: &str = "numbers of elements";
    /// The place of each node, where the order is another.
    pub const PLACES: &str = "numbers of nodes";
    /// What elements or clusters add to nodes.
    pub const PARTIAL_FORCES: &str = "partial forces";
    /// Which of these belong to which node.
    pub const SLOTS: &str = "slots of nodes";
    /// Imposed components.
    pub const CONSTRAINED: &str = "constrained nodes";
    /// What is stored of the tangent at quadrature points.
    pub const STORED_TANGENT: &str = "stored tangent";
    /// The tangent as a matrix.
    pub const ASSEMBLED_TANGENT: &str = "assembled tangent";
    /// The mass as a matrix.
    pub const MASS_MATRIX: &str = "consistent mass";
    /// Nodes that may touch an obstacle.
    pub const SURFACE: &str = "nodes of the surface";
    /// Nodes that implicit steps hold on obstacles.
    pub const HELD: &str = "held nodes";
    /// Faces under pressure, with their slots.
    pub const PRESSED: &str = "faces under pressure";
    /// Obstacles of triangles.
    pub const TRIANGLES: &str = "triangles of obstacles";
    /// The same as distances.
    pub const GRIDS: &str = "grids of distances from obstacles";
    /// Whether elements are inside their laws' domains.
    pub const MARGINS: &str = "margins of elements";
    /// Values that are recorded of elements.
    pub const OUTPUTS: &str = "values of elements";
    /// Partial sums of norms and products.
    pub const PARTIALS: &str = "partial sums";
    /// Scalars of a linear solver.
    pub const REGISTERS: &str = "registers";
    /// Numbers of passes in a submission.
    pub const NUMBERS: &str = "numbers of passes";
    /// Values of motions in a submission.
    pub const MOTIONS: &str = "values of motions";
    /// What the host reads.
    pub const RESULTS: &str = "results";
}

/// Bytes that are held now, and the most that were at once.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Held {
    /// Now.
    pub bytes: usize,
    /// At most so far.
    pub peak: usize,
}

impl Held {
    fn add(&mut self, bytes: usize) {
        self.bytes += bytes;
        self.peak = self.peak.max(self.bytes);
    }
}

/// A kernel that was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Used {
    /// How often it ran: over a whole body on a CPU, as one dispatch on a GPU.
    pub runs: u64,
    /// Whether it is ready to run again: a GPU's pipelines that were let go are not.
    pub is_ready: bool,
}

/// What a backend holds and ran.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Inventory {
    /// Buffers by name, those that are gone included.
    pub buffers: BTreeMap<String, Held>,
    /// All buffers together.
    pub all: Held,
    /// Kernels by name.
    pub kernels: BTreeMap<String, Used>,
}

impl Inventory {
    /// The most bytes that buffers of a name had at once; 0 where there was none.
    pub fn peak(&self, buffer: &str) -> usize {
        self.buffers.get(buffer).map_or(0, |held| held.peak)
    }

    /// How often the kernels of a name ran, on whatever law and element: those of this name, or of this and more after a
    /// colon.
    pub fn runs(&self, kernel: &str) -> u64 {
        self.of(kernel).map(|(_, used)| used.runs).sum()
    }

    /// Whether a kernel of a name is ready to run, as [`Inventory::runs`].
    pub fn is_ready(&self, kernel: &str) -> bool {
        self.of(kernel).any(|(_, used)| used.is_ready)
    }

    fn of(&self, kernel: &str) -> impl Iterator<Item = (&String, &Used)> {
        self.kernels.iter().filter(move |(name, _)| {
            name.strip_prefix(kernel).is_some_and(|rest| rest.is_empty() || rest.starts_with(':'))
        })
    }
}

/// The book in which a backend's buffers and kernels are entered; its copies are the same book.
#[derive(Debug, Clone, Default)]
pub struct Ledger(Arc<Mutex<Book>>);

#[derive(Debug, Default)]
struct Book {
    buffers: BTreeMap<&'static str, Held>,
    all: Held,
    kernels: BTreeMap<String, Arc<AtomicU64>>,
}

/// A buffer's entry: it is held until this is dropped.
#[derive(Debug)]
pub struct Lease {
    ledger: Ledger,
    name: &'static str,
    bytes: usize,
}

impl Clone for Lease {
    fn clone(&self) -> Self {
        self.ledger.hold(self.name, self.bytes)
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        let mut book = self.ledger.book();
        if let Some(held) = book.buffers.get_mut(self.name) {
            held.bytes -= self.bytes;
        }
        book.all.bytes -= self.bytes;
    }
}

/// A kernel's entry: it is ready until all of its copies are dropped.
#[derive(Debug, Clone)]
pub struct Tally(Arc<AtomicU64>);

impl Tally {
    /// Counts a run.
    pub fn ran(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

impl Ledger {
    fn book(&self) -> MutexGuard<'_, Book> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Enters a buffer; one without bytes is none, and has no entry.
    pub fn hold(&self, name: &'static str, bytes: usize) -> Lease {
        if bytes > 0 {
            let mut book = self.book();
            book.buffers.entry(name).or_default().add(bytes);
            book.all.add(bytes);
        }
        Lease { ledger: self.clone(), name, bytes }
    }

    /// Enters a kernel.
    pub fn kernel(&self, name: &str) -> Tally {
        Tally(Arc::clone(self.book().kernels.entry(name.to_owned()).or_default()))
    }

    /// Counts a run of a kernel that needs no preparation.
    pub fn ran(&self, name: &str) {
        let mut book = self.book();
        match book.kernels.get(name) {
            Some(runs) => {
                runs.fetch_add(1, Ordering::Relaxed);
            }
            None => {
                book.kernels.insert(name.to_owned(), Arc::new(AtomicU64::new(1)));
            }
        }
    }

    /// What is in it now.
    pub fn inventory(&self) -> Inventory {
        let book = self.book();
        let used =
            |runs: &Arc<AtomicU64>| Used { runs: runs.load(Ordering::Relaxed), is_ready: Arc::strong_count(runs) > 1 };
        Inventory {
            buffers: book.buffers.iter().map(|(name, held)| ((*name).to_owned(), *held)).collect(),
            all: book.all,
            kernels: book.kernels.iter().map(|(name, runs)| (name.clone(), used(runs))).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Held, Ledger, Used};

    #[test]
    fn what_is_dropped_is_no_longer_held_but_was() {
        let ledger = Ledger::default();
        let first = ledger.hold("a", 8);
        drop(ledger.hold("a", 4));
        let _other = ledger.hold("b", 2);
        let _none = ledger.hold("c", 0);
        drop(first);
        let inventory = ledger.inventory();
        assert_eq!(inventory.buffers["a"], Held { bytes: 0, peak: 12 });
        assert_eq!(inventory.buffers["b"], Held { bytes: 2, peak: 2 });
        assert_eq!(inventory.all, Held { bytes: 2, peak: 12 });
        assert_eq!((inventory.peak("a"), inventory.peak("c"), inventory.buffers.len()), (12, 0, 2));
    }

    #[test]
    fn kernels_count_what_they_ran_when_they_are_gone_too() {
        let ledger = Ledger::default();
        let tally = ledger.kernel("force: law");
        tally.ran();
        ledger.kernel("force: other").ran();
        ledger.ran("forces");
        let inventory = ledger.inventory();
        assert_eq!((inventory.runs("force"), inventory.runs("forces"), inventory.runs("for")), (2, 1, 0));
        assert_eq!(inventory.kernels["force: law"], Used { runs: 1, is_ready: true });
        assert!(inventory.is_ready("force") && !inventory.kernels["force: other"].is_ready);
        drop(tally);
        assert!(!ledger.inventory().is_ready("force"));
    }
}

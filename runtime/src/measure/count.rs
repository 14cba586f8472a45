//! What an element costs in operations and bytes, counted: the generator's operations, and what has to be moved at the least
//! where nothing but a node's own vectors stays in a cache.

use super::Subject;
use crate::plan::{operations, point_operations};

/// Bytes of a device's structures.
#[derive(Clone, Copy, Default)]
pub(super) struct Layout {
    /// A number.
    pub real: f64,
    /// A vector at a node.
    pub vector: f64,
    /// A partial force.
    pub slot: f64,
    /// Rest data of a quadrature point.
    pub point: f64,
    /// What tells an element where its node is.
    pub place: f64,
    /// Partial forces an element: with clusters those of nodes that are foreign to one.
    pub slots: f64,
    /// What tells a cluster where such a node is; 0 without clusters.
    pub local: f64,
    /// The partial force that each node has besides; 0 without clusters.
    pub own: f64,
}

/// Counts an element's operations and bytes.
pub(super) struct Count<'a> {
    pub subject: &'a Subject,
    pub layout: Layout,
    /// Nodes of the body an element.
    pub nodes: f64,
}

impl Count<'_> {
    /// Point kernels that gather some vectors, and what else a point takes.
    pub fn flops(&self, gathers: u32, kernel: &str, times: u32, contract: bool) -> u32 {
        let info = self.subject.element.info;
        let contract = if contract { info.contract_operations } else { 0 };
        operations(info, gathers, times * point_operations(self.subject.law.info, kernel) + contract)
    }

    /// What every element pass reads: nodes, rest data, so many vectors once each, and so many stored numbers a point.
    pub fn read(&self, vectors: u32, stored: usize) -> f64 {
        let (info, layout) = (self.subject.element.info, &self.layout);
        let point = layout.point + layout.real * stored as f64;
        layout.place * info.nodes as f64
            + layout.local * layout.slots
            + point * info.points.len() as f64
            + f64::from(vectors) * layout.vector * self.nodes
    }

    /// Slots that are written and read, their numbers, and the sums that are read and written.
    pub fn two_passes(&self, vectors: u32, stored: usize) -> f64 {
        let layout = &self.layout;
        let sums = layout.slots * (2.0 * layout.slot + 4.0) + 2.0 * layout.own * self.nodes;
        self.read(vectors, stored) + sums + 2.0 * layout.vector * self.nodes
    }
}

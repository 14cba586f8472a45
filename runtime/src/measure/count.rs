//! What an element costs in operations and bytes, counted: the generator's operations, and what has to be moved at the least
//! where nothing but a node's own vectors stays in a cache.

use super::Subject;
use crate::plan::{operations, point_operations, tangent_operations};
use crate::tangent::Tangent;

/// Bytes of a device's structures.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    /// A number.
    pub real: f64,
    /// A vector at a node.
    pub vector: f64,
    /// A partial force.
    pub slot: f64,
    /// Rest data of a quadrature point.
    pub point: f64,
    /// What tells an element where its nodes are.
    pub places: f64,
    /// What tells a block of a matrix where its node is.
    pub column: f64,
    /// Partial forces an element: with clusters those of nodes that are foreign to one.
    pub slots: f64,
    /// What tells a cluster where such a node is; 0 without clusters.
    pub local: f64,
    /// The partial force that each node has besides; 0 without clusters.
    pub own: f64,
    /// How products with the tangent are computed.
    pub tangent: Tangent,
    /// Blocks of the tangent an element, where it is assembled.
    pub blocks: f64,
}

impl Default for Layout {
    fn default() -> Self {
        let none = 0.0;
        Self {
            real: none,
            vector: none,
            slot: none,
            point: none,
            places: none,
            column: none,
            slots: none,
            local: none,
            own: none,
            tangent: Tangent::Recomputed,
            blocks: none,
        }
    }
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
        layout.places
            + layout.local * layout.slots
            + point * info.points.len() as f64
            + f64::from(vectors) * layout.vector * self.nodes
    }

    /// Operations of a product with the tangent, and bytes.
    pub fn product(&self, vectors: u32, stored: usize) -> (u32, f64) {
        let Layout { real, vector, blocks, tangent, .. } = self.layout;
        match tangent {
            Tangent::Stored => {
                let info = self.subject.element.info;
                let apply = tangent_operations(self.subject.law.info) + info.contract_operations;
                (operations(info, 1, apply), self.two_passes(1, stored))
            }
            // Who stores nothing copies the state, and has to read it again.
            Tangent::Recomputed => (self.flops(vectors, "dforce", 1, true), self.two_passes(vectors, 0)),
            Tangent::Assembled => {
                // A block serves twice, with a difference of vectors; it knows one node besides that of its row.
                let flops = 39.0 * blocks;
                let matrix = blocks * (9.0 * real + self.layout.column) + self.layout.local * self.layout.slots;
                (flops.round() as u32, matrix + vector * self.nodes + self.sums())
            }
        }
    }

    /// What [`Self::product`] needs of a state: operations and bytes; none where it is more than kernels.
    pub fn linearize(&self, stored: usize) -> (Option<u32>, Option<f64>) {
        match self.layout.tangent {
            Tangent::Stored => {
                let written = self.layout.real * (stored * self.subject.element.info.points.len()) as f64;
                let flops = if stored > 0 { self.flops(1, "linearize", 1, false) } else { 0 };
                (Some(flops), Some(self.read(1, 0) + written))
            }
            // The state is copied.
            Tangent::Recomputed => (Some(0), Some(2.0 * self.layout.vector * self.nodes)),
            Tangent::Assembled => (None, None),
        }
    }

    /// What an element pass reads, and what two passes move besides.
    pub fn two_passes(&self, vectors: u32, stored: usize) -> f64 {
        self.read(vectors, stored) + self.sums()
    }

    /// Slots that are written and read, their numbers, and the sums that are read and written.
    fn sums(&self) -> f64 {
        let layout = &self.layout;
        let partial = layout.slots * (2.0 * layout.slot + 4.0) + 2.0 * layout.own * self.nodes;
        partial + 2.0 * layout.vector * self.nodes
    }
}

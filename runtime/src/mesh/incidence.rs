//! Incidence: which slots (element, local node) hold the partial forces of each node.

use super::tet_mesh::{NodeId, TetMesh};

/// For each node, the slots `4 * e + a` in which it is node `a` of element `e`, in compressed rows.
///
/// Pass 1 of the two-pass assembly (Faure et al. 2012, algorithm 1) writes one partial force a slot; pass 2 sums the
/// slots of each node in increasing order, hence always in the same order. Every slot occurs once, so no slot is ever
/// undefined and none needs zeroing, unlike the padded `PartialForce[slot][node]` of the paper.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Incidence {
    offsets: Vec<u32>,
    slots: Vec<u32>,
}

impl Incidence {
    /// The incidence of a mesh: 16 bytes an element and 4 a node.
    pub fn new(mesh: &TetMesh) -> Incidence {
        Self::of_elements(mesh.nodes().len(), mesh.tets().iter().map(|t| t.map(NodeId::index)))
    }

    /// The incidence of elements in an order of their own, over this many nodes: slots count in that order.
    ///
    /// # Panics
    /// If an element names a node beyond `nodes`.
    pub fn of_elements(nodes: usize, elements: impl Iterator<Item = [usize; 4]> + Clone) -> Incidence {
        let mut offsets = vec![0_u32; nodes + 1];
        for node in elements.clone().flatten() {
            offsets[node + 1] += 1;
        }
        for node in 0..nodes {
            offsets[node + 1] += offsets[node];
        }
        let mut slots = vec![0_u32; offsets[nodes] as usize];
        let mut next = offsets.clone();
        for (slot, node) in elements.flatten().enumerate() {
            let place = &mut next[node];
            // `as u32` is exact: a mesh has at most MAX_ELEMENTS elements.
            slots[*place as usize] = slot as u32;
            *place += 1;
        }
        Incidence { offsets, slots }
    }

    /// Where each node's slots start in [`Incidence::slots`]; one more entry than nodes.
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// The slots of all nodes, node after node; four entries an element.
    pub fn slots(&self) -> &[u32] {
        &self.slots
    }

    /// The slots of one node, in increasing order.
    ///
    /// # Panics
    /// If `node` is not of the mesh.
    pub fn of(&self, node: NodeId) -> &[u32] {
        &self.slots[self.offsets[node.index()] as usize..self.offsets[node.index() + 1] as usize]
    }

    /// The most elements that share a node (N_n in the paper).
    pub fn max_valence(&self) -> usize {
        self.offsets.windows(2).map(|pair| (pair[1] - pair[0]) as usize).max().unwrap_or(0)
    }
}

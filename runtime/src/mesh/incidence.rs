//! Incidence: which slots (element, local node) hold the partial forces of each node.

use super::topology::{Mesh, NodeId};

/// For each node, the slots in which it is a node of an element, in compressed rows; slots count the nodes of one element
/// after the other.
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
    /// The incidence of a mesh: 4 bytes a slot and 4 a node.
    pub fn new(mesh: &Mesh) -> Incidence {
        let slots = mesh.blocks().iter().flat_map(|block| block.nodes.iter().map(|node| node.index()));
        Self::of_slots(mesh.nodes().len(), slots)
    }

    /// The incidence of slots in an order of their own, each given by its node, over this many nodes.
    ///
    /// # Panics
    /// If a slot names a node beyond `nodes`.
    pub fn of_slots(nodes: usize, slots_of: impl Iterator<Item = usize> + Clone) -> Incidence {
        let mut offsets = vec![0_u32; nodes + 1];
        for node in slots_of.clone() {
            offsets[node + 1] += 1;
        }
        for node in 0..nodes {
            offsets[node + 1] += offsets[node];
        }
        let mut slots = vec![0_u32; offsets[nodes] as usize];
        let mut next = offsets.clone();
        for (slot, node) in slots_of.enumerate() {
            let place = &mut next[node];
            // `as u32` is exact: a mesh has at most MAX_SLOTS slots.
            slots[*place as usize] = slot as u32;
            *place += 1;
        }
        Incidence { offsets, slots }
    }

    /// Where each node's slots start in [`Incidence::slots`]; one more entry than nodes.
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// The slots of all nodes, node after node.
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

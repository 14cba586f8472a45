//! The parts of a mesh that hang together.

use super::Mesh;

impl Mesh {
    /// How many parts there are between which no element shares a node; nodes of no element count for nothing.
    pub fn parts(&self) -> usize {
        // Each node knows another of its part, the last of them itself.
        let mut other: Vec<u32> = (0..self.nodes().len() as u32).collect();
        let mut in_element = vec![false; other.len()];
        for element in self.elements() {
            let nodes = self.element_nodes(element);
            let first = last(&mut other, nodes[0].0);
            for node in nodes {
                in_element[node.index()] = true;
                let of = last(&mut other, node.0);
                other[of as usize] = first;
            }
        }
        (0..).zip(&in_element).filter(|(node, inside)| **inside && last(&mut other, *node) == *node).count()
    }
}

/// The last node of a node's part; the way there is halved.
fn last(other: &mut [u32], mut node: u32) -> u32 {
    while other[node as usize] != node {
        other[node as usize] = other[other[node as usize] as usize];
        node = other[node as usize];
    }
    node
}

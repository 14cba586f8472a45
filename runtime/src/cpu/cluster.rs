//! A cluster of elements on the CPU: its nodes, copied from and added to those of the body.

use tensormass_kernels::{Blocks, Cluster as Elements, Compute, RestPoint, States};

use super::Precision;
use crate::body::{Body, LawBatch};

/// Elements of one law and kind that are near each other.
pub(super) struct Cluster<R> {
    /// The elements.
    pub blocks: Blocks<R>,
    /// The mesh's number of each.
    pub elements: Vec<u32>,
    /// The body's number of each node of the cluster.
    pub nodes: Vec<u32>,
    /// What products with the tangent need of a state; none before they are asked for.
    pub states: Option<States<R>>,
}

impl<R: Precision> Cluster<R> {
    /// Some elements of a batch, by their places in it.
    pub fn new(body: &Body, batch: &LawBatch, range: std::ops::Range<usize>, compute: &dyn Compute<R>) -> Self {
        let (info, count) = (batch.element.info, batch.law.info.constants.len());
        let order = interleaved(range.clone(), compute.lanes());
        // Nodes are numbered as the elements in their own order meet them.
        let mut numbers = std::collections::HashMap::new();
        let mut nodes = vec![];
        for e in range.clone() {
            for &n in &body.elements[batch.elements[e] as usize] {
                numbers.entry(n).or_insert_with(|| {
                    nodes.push(n);
                    nodes.len() as u32 - 1
                });
            }
        }
        let elements: Vec<u32> = order.iter().map(|e| batch.elements[*e]).collect();
        let local: Vec<u32> = elements.iter().flat_map(|e| &body.elements[*e as usize]).map(|n| numbers[n]).collect();
        let round = |x: f64| R::from_f64(x);
        let rest = elements.iter().flat_map(|e| &body.rest[*e as usize]);
        let rest: Vec<RestPoint<R>> = rest
            .map(|r| RestPoint { inverse_jacobian: r.inverse_jacobian.map(round), weight: round(r.weight) })
            .collect();
        let constants: Vec<R> = match batch.per_element {
            true => order.iter().flat_map(|e| &batch.constants[e * count..][..count]).map(|c| round(*c)).collect(),
            false => batch.constants.iter().map(|c| round(*c)).collect(),
        };
        let given = Elements { nodes: &local, rest: &rest, constants: &constants, per_element: batch.per_element };
        let blocks = Blocks::new(compute.lanes(), [info.nodes, info.points.len(), count], &given);
        Self { blocks, elements, nodes, states: None }
    }
}

/// A range in which places that follow each other are far apart in whole blocks: the elements of a block share no nodes, as
/// far as can be, and one addition to a node need not wait for another.
fn interleaved(range: std::ops::Range<usize>, lanes: usize) -> Vec<usize> {
    let blocks = range.len() / lanes;
    let whole = (0..blocks * lanes).map(|k| range.start + k % lanes * blocks + k / lanes);
    whole.chain(range.start + blocks * lanes..range.end).collect()
}

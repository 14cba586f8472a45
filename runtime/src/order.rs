//! An order of elements in which those near each other follow each other: clusters are ranges of it.
//!
//! Recursive coordinate bisection (Berger & Bokhari 1987): elements are halved by their centres along the longest side of
//! the box around them, until what is left is a cluster. The order depends on nothing but the mesh.

use std::collections::HashSet;

use crate::body::{Body, LawBatch};

/// Nodes that the elements of a cluster name, each as often as it is named: so many vectors stay in the innermost cache.
const NAMED: usize = 4096;
/// Clusters of a body, at least, while they are not too small: cores share them.
const CLUSTERS: usize = 32;
/// Elements of a cluster, at least.
const LEAST: usize = 256;
/// Clusters are whole blocks of lanes, of any width.
const BLOCK: usize = 16;

/// Elements of a cluster of a kind with so many nodes, where there are so many of that kind.
pub fn cluster_size(nodes: usize, elements: usize) -> usize {
    let most = (NAMED / nodes).next_multiple_of(BLOCK);
    elements.div_ceil(CLUSTERS).next_multiple_of(BLOCK).clamp(LEAST.min(most), most)
}

/// Sorts elements, the numbers of their centres, into clusters of so many.
fn into_clusters(elements: &mut [u32], centres: &[[f64; 3]], size: usize) {
    if elements.len() <= size {
        return;
    }
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &e in elements.iter() {
        let x = centres[e as usize];
        for i in 0..3 {
            (low[i], high[i]) = (low[i].min(x[i]), high[i].max(x[i]));
        }
    }
    let length = |i: usize| high[i] - low[i];
    let axis = (1..3).fold(0, |longest, i| if length(i) > length(longest) { i } else { longest });
    // Whole clusters on the left.
    let half = elements.len().div_ceil(size).div_ceil(2) * size;
    let before = |a: &u32, b: &u32| centres[*a as usize][axis].total_cmp(&centres[*b as usize][axis]).then(a.cmp(b));
    elements.select_nth_unstable_by(half, before);
    let (left, right) = elements.split_at_mut(half);
    into_clusters(left, centres, size);
    into_clusters(right, centres, size);
}

/// Sorts elements into clusters, and those of each by where they are.
pub fn compact(elements: &mut [u32], centres: &[[f64; 3]], size: usize) {
    into_clusters(elements, centres, size);
    for cluster in elements.chunks_mut(size) {
        // In place of an order of single elements: bisection down to a few.
        cluster.sort_unstable();
        into_clusters(cluster, centres, 1);
    }
}

/// How many nodes the clusters of a batch have, one shared by several counting in each.
pub fn cluster_nodes(body: &Body, batch: &LawBatch) -> usize {
    let size = cluster_size(batch.element.info.nodes, batch.elements.len());
    let of_cluster = |elements: &[u32]| {
        let nodes: HashSet<u32> = elements.iter().flat_map(|e| &body.elements[*e as usize]).copied().collect();
        nodes.len()
    };
    batch.elements.chunks(size).map(of_cluster).sum()
}

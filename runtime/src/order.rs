//! An order of elements in which those near each other follow each other: clusters are ranges of it.
//!
//! Recursive coordinate bisection (Berger & Bokhari 1987): elements are halved by their centres along the longest side of
//! the box around them, until what is left is a cluster. The order depends on nothing but the mesh.

use std::ops::Range;

use rayon::prelude::*;
use tensormass_kernels::pairs;
use tensormass_kernels::strip::{self, MEMBERS};

use crate::body::{Body, Constraint, LawBatch};
use crate::strips::{Member, strips};

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

/// The clusters of so many elements of a kind with so many nodes.
pub fn clusters(nodes: usize, elements: usize) -> Vec<Range<usize>> {
    let size = cluster_size(nodes, elements);
    (0..elements).step_by(size).map(|start| start..elements.min(start + size)).collect()
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

/// How clusters share nodes: each node belongs to the first cluster that meets it, and is foreign to the others.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sharing {
    /// Nodes that are foreign to a cluster, one counted for each.
    pub foreign: usize,
    /// Nodes that are foreign to some cluster.
    pub shared: usize,
}

/// How the clusters of a body share nodes.
pub fn sharing(body: &Body) -> Sharing {
    // The last cluster that met a node, and how many did.
    let mut met = vec![(0, 0); body.masses.len()];
    let mut cluster = 0;
    for batch in &body.batches {
        for elements in batch.elements.chunks(cluster_size(batch.element.info.nodes, batch.elements.len())) {
            cluster += 1;
            for node in elements.iter().flat_map(|e| &body.elements[*e as usize]) {
                let (last, count) = &mut met[*node as usize];
                *count += usize::from(*last != cluster);
                *last = cluster;
            }
        }
    }
    let foreign = met.iter().map(|(_, count)| count.saturating_sub(1));
    Sharing { foreign: foreign.clone().sum(), shared: foreign.filter(|n| *n > 0).count() }
}

/// Pairs of nodes that elements of a batch join, one counted for each cluster that has it.
pub fn blocks_of_clusters(body: &Body, batch: &LawBatch) -> usize {
    let info = batch.element.info;
    let distinct = |elements: &[u32]| {
        let mut keys = vec![];
        for nodes in elements.iter().map(|e| &body.elements[*e as usize]) {
            keys.extend(pairs(info.nodes).map(|[i, j]| [nodes[i].min(nodes[j]), nodes[i].max(nodes[j])]));
        }
        keys.sort_unstable();
        keys.dedup();
        keys.len()
    };
    batch.elements.chunks(cluster_size(info.nodes, batch.elements.len())).map(distinct).sum()
}

/// The place of each node where they are numbered as the clusters of a body, one batch after the other, first meet them;
/// nodes of no element are the last.
pub fn node_places(body: &Body) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut places = vec![NONE; body.masses.len()];
    let nodes = body.batches.iter().flat_map(|b| &b.elements).flat_map(|e| &body.elements[*e as usize]);
    let mut met = 0;
    for node in nodes.copied().chain(0..body.masses.len() as u32) {
        let place = &mut places[node as usize];
        if *place == NONE {
            *place = met;
            met += 1;
        }
    }
    places
}

/// The imposed components of a body by the places of their nodes, ascending.
pub fn placed_constraints(body: &Body, places: &[u32]) -> Vec<Constraint> {
    let place = |c: &Constraint| Constraint { node: places[c.node as usize], ..*c };
    let mut constraints: Vec<Constraint> = body.constraints.iter().map(place).collect();
    constraints.sort_unstable_by_key(|c| (c.node, c.component));
    constraints
}

/// Elements of a batch, by their places in it.
#[derive(Debug, Clone)]
pub struct Grouped {
    /// Three linear tetrahedra in a row.
    pub strips: Vec<[Member; MEMBERS]>,
    /// The others.
    pub alone: Vec<u32>,
}

/// Elements among which strips are looked for: they stay near each other.
const GROUP: usize = 4096;
/// Strips of a batch for which a pass of their own is worth it, at least.
const STRIPS: usize = 256;

impl Grouped {
    /// Partial forces of elements with so many nodes.
    pub fn slots(&self, nodes: usize) -> usize {
        strip::NODES * self.strips.len() + nodes * self.alone.len()
    }

    /// Vectors of four numbers that their nodes take.
    pub fn fours(&self, nodes: usize) -> usize {
        strip::NODES.div_ceil(4) * self.strips.len() + nodes.div_ceil(4) * self.alone.len()
    }

    /// Elements of a batch, in an order that is kept.
    fn of(body: &Body, batch: &LawBatch, places: Vec<u32>) -> Self {
        if !batch.element.info.is_linear_simplex {
            return Self { strips: vec![], alone: places };
        }
        let group = |(k, group): (usize, &[u32])| {
            let nodes = |place: &u32| body.elements[batch.elements[*place as usize] as usize].try_into();
            let nodes = |place: &u32| nodes(place).expect("a tetrahedron has four nodes");
            let (found, alone) = strips(&group.iter().map(nodes).collect::<Vec<_>>());
            let placed = |m: Member| Member { element: places[k * GROUP + m.element as usize], ..m };
            let alone: Vec<u32> = alone.iter().map(|e| group[*e as usize]).collect();
            (found.into_iter().map(|strip| strip.map(placed)).collect::<Vec<_>>(), alone)
        };
        let (found, alone): (Vec<_>, Vec<_>) = places.par_chunks(GROUP).enumerate().map(group).unzip();
        match found.concat() {
            strips if strips.len() >= STRIPS => Self { strips, alone: alone.concat() },
            _ => Self { strips: vec![], alone: places },
        }
    }
}

/// An order of a body's elements and nodes for devices without clusters.
#[derive(Debug, Clone)]
pub struct DeviceOrder {
    /// Of each batch its elements, in the order in which they are computed.
    pub elements: Vec<Grouped>,
    /// The place of each node in vectors.
    pub places: Vec<u32>,
}

/// Nodes by which those of an element may differ in a mesh that is numbered layer by layer: so many times those of a layer
/// of a cube.
const LAYERS: f64 = 4.0;

impl DeviceOrder {
    /// The mesh's own order where that sweeps through the body layer by layer: what is read and written then are a few runs
    /// through memory. Otherwise that of clusters and of nodes as they meet them.
    pub fn of(body: &Body) -> Self {
        let span = |nodes: &[u32]| {
            let ends = nodes.iter().fold((u32::MAX, 0), |(low, high), n| (low.min(*n), high.max(*n)));
            f64::from(ends.1.saturating_sub(ends.0))
        };
        let spans: f64 = (0..body.elements.len()).map(|e| span(&body.elements[e])).sum();
        let layer = (body.masses.len() as f64).powf(2.0 / 3.0);
        let sweeps = spans <= LAYERS * layer * body.elements.len() as f64;
        let of_batch = |batch: &LawBatch| {
            let mut places: Vec<u32> = (0..batch.elements.len() as u32).collect();
            if sweeps {
                places.sort_unstable_by_key(|place| batch.elements[*place as usize]);
            }
            Grouped::of(body, batch, places)
        };
        let places = if sweeps { (0..body.masses.len() as u32).collect() } else { node_places(body) };
        Self { elements: body.batches.iter().map(of_batch).collect(), places }
    }
}

//! A cluster of elements on the CPU: its nodes, copied from and added to those of the body.
//!
//! The backend numbers nodes as clusters first meet them ([`crate::order::node_places`]): those that a cluster meets first,
//! its own, follow each other, and so do those of one cluster after the other. The others are foreign to it.

use std::ops::Range;

use rayon::prelude::*;
use tensormass_kernels::strip::MEMBERS;
use tensormass_kernels::{Blocks, Cluster as Elements, Engine, Extent, Node, Place, RestPoint, compose};

use super::Precision;
use super::vectors::CpuVector;
use crate::body::{Body, LawBatch};
use crate::order::clusters;
use crate::strips::{Member, reordered, strips};

/// Elements of one law and kind that are near each other.
pub(super) struct Cluster {
    /// The mesh's number of each.
    pub elements: Vec<u32>,
    /// The places of its own nodes.
    pub own: Range<usize>,
    /// The places of the others, ascending.
    pub foreign: Vec<u32>,
}

impl Cluster {
    /// Some elements of a batch: those of a cluster of `blocks`, which are filled. The first nodes, so many, are those of
    /// clusters before.
    pub fn new<R: Precision>(
        (body, batch, places): (&Body, &LawBatch, &[u32]),
        arranged: &Arranged,
        met: usize,
        (blocks, number): (&mut Blocks<R>, usize),
    ) -> Self {
        let count = batch.law.info.constants.len();
        let elements: Vec<u32> = arranged.members.iter().map(|m| batch.elements[m.element as usize]).collect();
        let nodes = |e: &u32| body.elements[*e as usize].iter().map(|n| places[*n as usize]);
        let mut all: Vec<u32> = elements.iter().flat_map(nodes).collect();
        all.sort_unstable();
        all.dedup();
        let foreign: Vec<u32> = all[..all.partition_point(|n| (*n as usize) < met)].to_vec();
        let own = met..met + all.len() - foreign.len();
        let cluster = Self { elements, own, foreign };
        let strips = arranged.extent.strips * MEMBERS * blocks.lanes();
        let (mut nodes, mut rest, mut constants) = (vec![], vec![], vec![]);
        for (k, (e, member)) in cluster.elements.iter().zip(&arranged.members).enumerate() {
            let (of_element, points) = (&body.elements[*e as usize], &body.rest[*e as usize]);
            let node = |n: usize| cluster.local(places[of_element[n] as usize]);
            match k < strips {
                true => nodes.extend(member.order.map(|n| node(usize::from(n)))),
                false => nodes.extend((0..of_element.len()).map(node)),
            }
            let rounded = |point: RestPoint<f64>| RestPoint {
                inverse_jacobian: point.inverse_jacobian.map(R::from_f64),
                weight: R::from_f64(point.weight),
            };
            rest.extend(points.iter().map(|p| rounded(if k < strips { reordered(p, member.order) } else { *p })));
            if batch.per_element {
                constants.extend(batch.constants[member.element as usize * count..][..count].iter().copied());
            }
        }
        let constants = if batch.per_element { &constants } else { &batch.constants };
        let constants: Vec<R> = constants.iter().map(|c| R::from_f64(*c)).collect();
        blocks.fill(number, &Elements { nodes: &nodes, rest: &rest, constants: &constants });
        cluster
    }

    /// The number that a node has within the cluster, of which its own have the first, by its place in the body.
    pub fn local(&self, place: u32) -> u32 {
        match (place as usize).checked_sub(self.own.start) {
            Some(own) => own as u32,
            None => (self.own.len() + self.foreign.partition_point(|n| *n < place)) as u32,
        }
    }

    /// The place of a node in the body.
    pub fn place(&self, local: u32) -> u32 {
        match (local as usize).checked_sub(self.own.len()) {
            Some(foreign) => self.foreign[foreign],
            None => self.own.start as u32 + local,
        }
    }

    /// Nodes.
    pub fn nodes(&self) -> usize {
        self.own.len() + self.foreign.len()
    }

    /// Copies the vectors of its nodes.
    pub fn copy<R: Precision>(&self, from: &[[R; 3]], to: &mut [Node<R>]) {
        let (own, foreign) = to.split_at_mut(self.own.len());
        let after = from.len().min(self.own.end + 1);
        let numbers = from[self.own.start..after].as_flattened();
        own.iter_mut().enumerate().for_each(|(n, to)| four(numbers, n, to));
        foreign.iter_mut().zip(&self.foreign).for_each(|(to, n)| four(from.as_flattened(), *n as usize, to));
    }

    /// Leaves what was added to its nodes where pass 2 finds it.
    pub fn leave<R: Precision>(&self, from: &[Node<R>], own: &mut [[R; 3]], foreign: &mut [[R; 3]]) {
        let (from_own, from_foreign) = from.split_at(self.own.len());
        for (to, from) in [(own, from_own), (foreign, from_foreign)] {
            let from = &from[..to.len()];
            let to = to.as_flattened_mut();
            from.iter().enumerate().for_each(|(n, from)| match to.get_mut(3 * n..3 * n + 4) {
                // What is too much is written over by the next.
                Some(four) => four.copy_from_slice(from),
                None => to[3 * n..].copy_from_slice(&from[..3]),
            });
        }
    }
}

/// The vectors of a cluster's nodes.
pub(super) type Vectors<'a, R, const N: usize> = [&'a [Node<R>]; N];

/// Room for vectors at the nodes of any cluster of a batch.
pub(super) struct Room<R, const N: usize>([Vec<Node<R>>; N]);

impl<R: Precision, const N: usize> Room<R, N> {
    pub fn new() -> Self {
        Self(std::array::from_fn(|_| vec![]))
    }

    /// Vectors of zeros at the nodes of a cluster.
    pub fn zeros(&mut self, blocks: &Blocks<R>, cluster: &Cluster) -> [&mut [Node<R>]; N] {
        self.0.each_mut().map(|room| {
            room.resize(blocks.reach(), [R::default(); 4]);
            room[..cluster.nodes()].fill([R::default(); 4]);
            room.as_mut_slice()
        })
    }

    /// Copies of vectors at the nodes of a cluster.
    pub fn copies(&mut self, blocks: &Blocks<R>, cluster: &Cluster, vectors: [&CpuVector<R>; N]) -> Vectors<'_, R, N> {
        for (room, vector) in self.0.iter_mut().zip(vectors) {
            room.resize(blocks.reach(), [R::default(); 4]);
            cluster.copy(&vector.0, &mut room[..cluster.nodes()]);
        }
        self.0.each_ref().map(Vec::as_slice)
    }
}

/// Copies the numbers of a node, four at once where four are left: the last one pads the node, and is not looked at.
#[inline(always)]
fn four<R: Copy>(numbers: &[R], node: usize, to: &mut Node<R>) {
    match numbers.get(3 * node..3 * node + 4) {
        Some(four) => to.copy_from_slice(four),
        None => to[..3].copy_from_slice(&numbers[3 * node..]),
    }
}

/// Bytes that the elements of a batch take, in blocks that are filled up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ElementBytes {
    /// The places of their nodes.
    pub places: usize,
    /// J^-1 and weights.
    pub rest: usize,
    /// Constants.
    pub constants: usize,
    /// What the law stores of the tangent, if it is asked to.
    pub stored: usize,
}

/// Bytes that the elements of a batch take on the widest registers of this machine.
pub fn element_bytes<R: Precision>(body: &Body, batch: &LawBatch) -> ElementBytes {
    let (info, law) = (batch.element.info, batch.law.info);
    let lanes = compose::<R>(Engine::best(), batch.element, batch.law).lanes();
    let ranges = clusters(info.nodes, batch.elements.len());
    let filled: usize = ranges.iter().map(|range| range.len().next_multiple_of(lanes)).sum();
    let places = |range| Arranged::new(body, batch, range, lanes).extent.places(lanes, info.nodes);
    let sets = if batch.per_element { filled } else { 1 };
    ElementBytes {
        places: ranges.into_par_iter().map(places).sum::<usize>() * size_of::<Place>(),
        rest: filled * info.points.len() * 10 * size_of::<R>(),
        constants: sets * law.constants.len() * size_of::<R>(),
        stored: filled * info.points.len() * law.stored * size_of::<R>(),
    }
}

/// The elements of a cluster in the order of its blocks.
pub(super) struct Arranged {
    /// Places in the batch; of strips, which come first, with the order of the nodes.
    members: Vec<Member>,
    /// How many.
    pub extent: Extent,
}

impl Arranged {
    /// A range of a batch, as strips on so many lanes as far as they fill blocks.
    pub fn new(body: &Body, batch: &LawBatch, range: Range<usize>, lanes: usize) -> Self {
        let alone = |element: u32| Member { element, order: [0, 1, 2, 3] };
        let mut found = vec![];
        if batch.element.info.is_linear_simplex {
            let nodes = |e: &u32| body.elements[*e as usize].try_into().expect("a tetrahedron has four nodes");
            let elements: Vec<[u32; 4]> = batch.elements[range.clone()].iter().map(nodes).collect();
            (found, _) = strips(&elements);
        }
        let blocks = found.len() / lanes;
        let mut is_alone = vec![true; range.len()];
        let mut members = vec![];
        for block in 0..blocks {
            for m in 0..MEMBERS {
                // What is in neighbouring lanes is far apart.
                members.extend((0..lanes).map(|lane| found[lane * blocks + block][m]));
            }
        }
        members.iter().for_each(|m| is_alone[m.element as usize] = false);
        let others: Vec<u32> = (0..range.len() as u32).filter(|e| is_alone[*e as usize]).collect();
        members.extend(interleaved(others.len(), lanes).map(|k| alone(others[k])));
        let extent = Extent { elements: range.len(), strips: blocks };
        Self { members: members.into_iter().map(|m| m.after(range.start)).collect(), extent }
    }
}

/// Places so that those that follow each other are far apart in whole blocks: the elements of a block share no nodes, as
/// far as can be, and one addition to a node need not wait for another.
fn interleaved(count: usize, lanes: usize) -> impl Iterator<Item = usize> {
    let blocks = count / lanes;
    let whole = (0..blocks * lanes).map(move |k| k % lanes * blocks + k / lanes);
    whole.chain(blocks * lanes..count)
}

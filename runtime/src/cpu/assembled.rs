//! The tangent of a batch as a matrix: sparsity once, numbers in two passes.
//!
//! Pass 1 runs over clusters: it adds up the blocks of their elements, leaves those of pairs of nodes that a cluster is the
//! first to meet, its own, where the matrix has them, and each other in a slot. Pass 2 adds the slots to the blocks of the
//! clusters that own them, in ascending order. As with forces no two threads write one place, and no sum depends on how
//! many there are.

use std::ops::Range;

use rayon::prelude::*;
use tensormass_kernels::{Blocks, Compute, Matrix, Node, Pair, Part, block_place, pairs};

use super::Precision;
use super::cluster::{Cluster, Room};
use super::vectors::CpuVector;
use crate::inventory::names::ASSEMBLED_TANGENT;
use crate::inventory::{Lease, Ledger};

/// A block of numbers.
type Block<R> = [R; 9];

/// A block as it is, and one transposed, added to it.
fn sum<R: Precision>(block: &Pair<R>, transposed: &Pair<R>) -> Block<R> {
    let mut sum = [R::default(); 9];
    for a in 0..3 {
        for c in 0..3 {
            sum[3 * a + c] = block[a][c] + transposed[c][a];
        }
    }
    sum
}

/// See the module.
pub(super) struct Assembled<R> {
    matrix: Matrix<R>,
    clusters: Vec<Pairs>,
    /// Blocks of pairs that clusters share, cluster after cluster.
    foreign: Vec<Block<R>>,
    /// Places in `foreign`, those of one pair after those of another.
    slots: Vec<u32>,
    /// Whether it has numbers.
    pub is_filled: bool,
    _lease: Lease,
}

/// The pairs of nodes that the elements of a cluster join.
struct Pairs {
    /// Of each pair of nodes of each element, by blocks and lanes, the place of its block among those of the cluster, of
    /// which each pair has two: that of the other one where the element has the block's transpose.
    places: Vec<u32>,
    /// Where the numbers of its own pairs begin in the matrix.
    own: Vec<u32>,
    /// How many others there are.
    foreign: usize,
    /// Those of its own that others have slots for: where their numbers begin, and the range of their slots.
    shared: Vec<(u32, Range<u32>)>,
}

impl Pairs {
    fn bytes(&self) -> usize {
        size_of_val(&*self.places) + size_of_val(&*self.own) + size_of_val(&*self.shared)
    }
}

/// Two nodes by their places in the body, the lesser one first.
type Key = [u32; 2];

fn key(a: u32, b: u32) -> Key {
    [a.min(b), a.max(b)]
}

/// The pairs of a cluster, ascending.
fn keys<R: Precision>(cluster: &Cluster, part: Part<R>, nodes: usize, lanes: usize) -> Vec<Key> {
    let mut keys = vec![];
    for block in part.nodes() {
        for [i, j] in pairs(nodes) {
            let [i, j] = [i, j].map(|n| block[n * lanes..][..lanes].iter().map(|n| cluster.place(*n)));
            keys.extend(i.zip(j).map(|(i, j)| key(i, j)));
        }
    }
    keys.sort_unstable();
    keys.dedup();
    keys
}

/// Who owns which pairs: the first cluster that meets a pair.
struct Owners {
    /// The pairs of all clusters with the clusters that meet them, ascending.
    met: Vec<(Key, u32)>,
    /// Those that each cluster owns, ascending, and the others that it meets.
    own: Vec<Vec<Key>>,
    foreign: Vec<Vec<Key>>,
}

impl Owners {
    /// From the pairs that each cluster meets.
    fn of(all: &[Vec<Key>]) -> Self {
        let numbered = all.iter().zip(0_u32..).flat_map(|(keys, k)| keys.iter().map(move |key| (*key, k)));
        let mut met: Vec<(Key, u32)> = numbered.collect();
        met.par_sort_unstable();
        let (mut own, mut foreign) = (vec![vec![]; all.len()], vec![vec![]; all.len()]);
        for of_pair in met.chunk_by(|a, b| a.0 == b.0) {
            own[of_pair[0].1 as usize].push(of_pair[0].0);
            of_pair[1..].iter().for_each(|(key, k)| foreign[*k as usize].push(*key));
        }
        Self { met, own, foreign }
    }

    /// The place of a pair among those of a cluster, of which its own have the first.
    fn place(&self, cluster: usize, key: &Key) -> usize {
        let own = &self.own[cluster];
        match own.binary_search(key) {
            Ok(place) => place,
            Err(_) => own.len() + self.foreign[cluster].partition_point(|other| other < key),
        }
    }

    /// Where the blocks are of each pair of nodes of the elements of a cluster, by blocks and lanes (see [`Pairs`]).
    fn places<R: Precision>(&self, k: usize, cluster: &Cluster, part: Part<R>, [nodes, lanes]: [usize; 2]) -> Vec<u32> {
        let mut places = vec![];
        for block in part.nodes() {
            for [i, j] in pairs(nodes) {
                for lane in 0..lanes {
                    let [i, j] = [i, j].map(|n| cluster.place(block[n * lanes + lane]));
                    // `as u32` is exact: a cluster has far fewer pairs.
                    let block = 2 * self.place(k, &key(i, j)) as u32 + u32::from(i > j);
                    places.push(block_place::<R>(block));
                }
            }
        }
        places
    }
}

impl<R: Precision> Assembled<R> {
    /// A matrix without numbers for the clusters of a batch, on so many lanes.
    pub fn new(clusters: &[Cluster], blocks: &Blocks<R>, lanes: usize, ledger: &Ledger) -> Self {
        let nodes = blocks.nodes();
        let parts = || clusters.par_iter().enumerate().map(|(k, cluster)| (k, cluster, blocks.part(k)));
        let all: Vec<Vec<Key>> = parts().map(|(_, cluster, part)| keys(cluster, part, nodes, lanes)).collect();
        let owners = Owners::of(&all);
        let local = |(cluster, own): (&Cluster, &Vec<Key>)| {
            let pair = |key: &Key| key.map(|n| cluster.local(n));
            own.iter().map(pair).collect()
        };
        let (matrix, at) = Matrix::new(lanes, &clusters.iter().zip(&owners.own).map(local).collect::<Vec<_>>());
        let places: Vec<Vec<u32>> =
            parts().map(|(k, cluster, part)| owners.places(k, cluster, part, [nodes, lanes])).collect();
        let foreign: Vec<usize> = owners.foreign.iter().map(Vec::len).collect();
        let mut joined: Vec<Pairs> = at
            .into_iter()
            .zip(places)
            .zip(&foreign)
            .map(|((own, places), foreign)| Pairs { places, own, foreign: *foreign, shared: vec![] })
            .collect();
        let before = |sum: &mut usize, count: &usize| {
            *sum += count;
            Some(*sum - count)
        };
        // The first slot of each cluster.
        let first: Vec<usize> = foreign.iter().scan(0, before).collect();
        let mut slots = vec![];
        for of_pair in owners.met.chunk_by(|a, b| a.0 == b.0).filter(|of_pair| of_pair.len() > 1) {
            let start = slots.len() as u32;
            for (key, k) in &of_pair[1..] {
                let k = *k as usize;
                slots.push((first[k] + owners.place(k, key) - owners.own[k].len()) as u32);
            }
            let (key, owner) = (of_pair[0].0, of_pair[0].1 as usize);
            let at = joined[owner].own[owners.place(owner, &key)];
            joined[owner].shared.push((at, start..slots.len() as u32));
        }
        let foreign = vec![[R::default(); 9]; foreign.iter().sum()];
        let bytes = matrix.bytes()
            + joined.iter().map(Pairs::bytes).sum::<usize>()
            + size_of_val(&*foreign)
            + size_of_val(&*slots);
        let lease = ledger.hold(ASSEMBLED_TANGENT, bytes);
        Self { matrix, clusters: joined, foreign, slots, is_filled: false, _lease: lease }
    }

    /// Its numbers at displacement u.
    pub fn fill(&mut self, compute: &dyn Compute<R>, blocks: &Blocks<R>, of: &[Cluster], u: &CpuVector<R>) {
        let lanes = compute.lanes();
        let Self { matrix, clusters, foreign, slots, .. } = self;
        let mut rest = foreign.as_mut_slice();
        let mut tasks = vec![];
        for (k, (numbers, pairs)) in matrix.parts_mut().into_iter().zip(&*clusters).enumerate() {
            let foreign;
            (foreign, rest) = rest.split_at_mut(pairs.foreign);
            tasks.push((k, pairs, numbers, foreign));
        }
        tasks.into_par_iter().for_each_init(
            || (Room::new(), vec![]),
            |(room, sums), (k, pairs, numbers, foreign)| {
                let [u] = room.copies(blocks, &of[k], [u]);
                sums.clear();
                sums.resize(2 * (pairs.own.len() + pairs.foreign), [[R::default(); 4]; 3]);
                compute.assemble(blocks.part(k), u, &pairs.places, sums);
                let (of_own, of_foreign) = sums.split_at(2 * pairs.own.len());
                for (at, both) in pairs.own.iter().zip(of_own.chunks_exact(2)) {
                    let numbers = &mut numbers[*at as usize..][..8 * lanes + 1];
                    for (n, number) in sum(&both[0], &both[1]).into_iter().enumerate() {
                        numbers[n * lanes] = number;
                    }
                }
                for (slot, both) in foreign.iter_mut().zip(of_foreign.chunks_exact(2)) {
                    *slot = sum(&both[0], &both[1]);
                }
            },
        );
        matrix.parts_mut().into_par_iter().zip(&*clusters).for_each(|(numbers, pairs)| {
            for (at, range) in &pairs.shared {
                for slot in &slots[range.start as usize..range.end as usize] {
                    for (n, number) in foreign[*slot as usize].iter().enumerate() {
                        let sum = &mut numbers[*at as usize + n * lanes];
                        *sum = *sum + *number;
                    }
                }
            }
        });
        self.is_filled = true;
    }

    /// What a cluster's rows add to a product.
    pub fn multiply(&self, compute: &dyn Compute<R>, cluster: usize, x: &[Node<R>], y: &mut [Node<R>]) {
        compute.multiply(&self.matrix.rows(cluster), x, y);
    }
}

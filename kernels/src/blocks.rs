//! The elements of a cluster as lanes meet them: blocks of as many elements as there are lanes, number by number.
//!
//! A block has the places of each node, lane after lane; of each quadrature point the nine numbers of J^-1 and the weight,
//! lane after lane; and its constants likewise, where each element has its own. The last block is filled up with the last
//! element, without weight.
#![allow(unsafe_code)]

use crate::element::RestPoint;
use crate::lanes::{Lanes, Node, Place, stride};
use crate::real::Real;

/// Numbers that begin at the beginning of a cache line: no register that is read from them lies across two.
#[derive(Debug)]
struct Aligned<R> {
    numbers: Vec<R>,
    start: usize,
}

/// Bytes of a cache line.
const LINE: usize = 64;

impl<R: Copy> Aligned<R> {
    fn new(values: &[R], zero: R) -> Self {
        let mut numbers = vec![zero; values.len() + LINE / size_of::<R>()];
        // Where it cannot be told, they begin anywhere.
        let start = numbers.as_ptr().align_offset(LINE).min(LINE / size_of::<R>());
        numbers[start..][..values.len()].copy_from_slice(values);
        Self { numbers, start }
    }

    #[inline(always)]
    fn from(&self, k: usize) -> &[R] {
        &self.numbers[self.start + k..]
    }
}

/// What is stored of a cluster's state for products with its tangent: of each block numbers of one quadrature point after
/// the other, lane after lane.
#[derive(Debug)]
pub struct States<R>(Aligned<R>);

impl<R: Copy + Default> States<R> {
    /// Room for so many numbers at each point.
    pub(crate) fn new(blocks: &Blocks<R>, stored: usize) -> Self {
        let count = blocks.len() * blocks.lanes * blocks.points * stored;
        Self(Aligned::new(&vec![R::default(); count], R::default()))
    }

    /// Those of the blocks from one on, `each` numbers a block.
    pub(crate) fn of(&self, first: usize, each: usize) -> &[R] {
        self.0.from(first * each)
    }

    pub(crate) fn of_mut(&mut self, first: usize, count: usize, each: usize) -> &mut [R] {
        let start = self.0.start + first * each;
        &mut self.0.numbers[start..][..count * each]
    }
}

/// Asks for the cache lines of some numbers.
#[inline(always)]
pub(crate) fn prefetch<T>(numbers: &[T]) {
    #[cfg(target_arch = "x86_64")]
    for line in numbers.chunks((LINE / size_of::<T>()).max(1)) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 machine has it, and it reads nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(line.as_ptr().cast()) };
    }
}

/// Elements of a cluster, as a runtime has them.
#[derive(Debug, Clone, Copy)]
pub struct Cluster<'a, R> {
    /// The nodes of one element after the other, numbered within the cluster.
    pub nodes: &'a [u32],
    /// The quadrature points of one element after the other.
    pub rest: &'a [RestPoint<R>],
    /// The law's constants: of the one material, or one set after the other, an element each.
    pub constants: &'a [R],
    /// Whether each element has a set of constants.
    pub per_element: bool,
}

/// See the module.
#[derive(Debug)]
pub struct Blocks<R> {
    lanes: usize,
    elements: usize,
    nodes: usize,
    points: usize,
    places: Vec<Place>,
    rest: Aligned<R>,
    constants: Aligned<R>,
    /// Constants of an element.
    count: usize,
    per_element: bool,
    /// One more than the greatest node.
    reach: usize,
}

/// The most nodes that the places of a cluster can tell apart.
pub const fn most_nodes<R>() -> usize {
    Place::MAX as usize / stride::<R>()
}

impl<R: Real + Default> Blocks<R> {
    /// Elements in blocks of so many lanes; each has so many nodes, points and constants.
    ///
    /// # Panics
    /// The arrays do not fit together, or a node is beyond [`most_nodes`].
    pub fn new(lanes: usize, [nodes, points, count]: [usize; 3], cluster: &Cluster<R>) -> Self {
        let elements = cluster.nodes.len() / nodes;
        assert_eq!(cluster.nodes.len(), elements * nodes, "each element has all nodes");
        assert_eq!(cluster.rest.len(), elements * points, "each element has all points");
        let sets = if cluster.per_element { elements } else { 1 };
        assert_eq!(cluster.constants.len(), sets * count, "each element has all constants");
        let reach = cluster.nodes.iter().max().map_or(0, |n| *n as usize + 1);
        assert!(reach <= most_nodes::<R>(), "a cluster of {reach} nodes is too large");
        // The element of each lane, and whether it is the last one once more.
        let all = (0..elements.div_ceil(lanes) * lanes).map(|e| (e.min(elements - 1), e >= elements));
        let all: Vec<(usize, bool)> = all.collect();
        let (mut places, mut rest, mut constants) = (vec![], vec![], vec![]);
        for block in all.chunks(lanes) {
            for node in 0..nodes {
                let place = |e: usize| cluster.nodes[e * nodes + node] as usize * stride::<R>();
                places.extend(block.iter().map(|(e, _)| place(*e) as Place));
            }
            for q in 0..points {
                let point = |e: usize| &cluster.rest[e * points + q];
                for k in 0..9 {
                    rest.extend(block.iter().map(|(e, _)| point(*e).inverse_jacobian[k]));
                }
                rest.extend(block.iter().map(|&(e, again)| if again { R::default() } else { point(e).weight }));
            }
            if cluster.per_element {
                for k in 0..count {
                    constants.extend(block.iter().map(|(e, _)| cluster.constants[e * count + k]));
                }
            }
        }
        if !cluster.per_element {
            constants.extend_from_slice(cluster.constants);
        }
        let [rest, constants] = [rest, constants].map(|numbers| Aligned::new(&numbers, R::default()));
        let per_element = cluster.per_element;
        Self { lanes, elements, nodes, points, places, rest, constants, count, per_element, reach }
    }
}

impl<R> Blocks<R> {
    /// Elements.
    pub fn elements(&self) -> usize {
        self.elements
    }

    /// Nodes of an element.
    pub(crate) fn nodes(&self) -> usize {
        self.nodes
    }

    /// Quadrature points of an element.
    pub(crate) fn points(&self) -> usize {
        self.points
    }

    /// How many blocks there are.
    pub(crate) fn len(&self) -> usize {
        self.elements.div_ceil(self.lanes)
    }

    /// Constants of an element.
    pub(crate) fn constants(&self) -> usize {
        self.count
    }

    /// Whether each element has constants of its own.
    pub(crate) fn per_element(&self) -> bool {
        self.per_element
    }

    /// The places of a node of each element of a block, which are those of nodes.
    ///
    /// # Panics
    /// The block has other lanes, or there are fewer nodes than its elements have.
    #[inline(always)]
    fn places<V: Lanes<Scalar = R>>(&self, block: usize, node: usize, nodes: &[Node<R>]) -> &[Place] {
        assert!(V::COUNT == self.lanes && nodes.len() >= self.reach, "blocks of other lanes or nodes");
        &self.places[(block * self.nodes + node) * V::COUNT..][..V::COUNT]
    }

    /// The vectors at a node of each element of a block.
    #[inline(always)]
    pub(crate) fn gather<V: Lanes<Scalar = R>>(&self, u: &[Node<R>], block: usize, node: usize) -> [V; 3] {
        // SAFETY: `places` says so.
        unsafe { V::gather(u, self.places::<V>(block, node, u)) }
    }

    /// Adds vectors to a node of each element of a block.
    #[inline(always)]
    pub(crate) fn scatter<V: Lanes<Scalar = R>>(&self, vectors: [V; 3], f: &mut [Node<R>], block: usize, node: usize) {
        // SAFETY: as above.
        unsafe { V::scatter(vectors, f, self.places::<V>(block, node, f)) }
    }
}

impl<R: Copy> Blocks<R> {
    /// Asks for what a block has at rest before it is read: it comes from an outer cache or from memory, while others are
    /// computed.
    #[inline(always)]
    pub(crate) fn prefetch(&self, block: usize) {
        let each = 10 * self.points * self.lanes;
        let start = (self.rest.start + block * each).min(self.rest.numbers.len());
        let end = (start + each).min(self.rest.numbers.len());
        prefetch(&self.rest.numbers[start..end]);
        let (places, each) = (&self.places, self.nodes * self.lanes);
        prefetch(&places[(block * each).min(places.len())..((block + 1) * each).min(places.len())]);
    }

    /// J^-1 at a quadrature point of each element of a block, and the weight.
    #[inline(always)]
    pub(crate) fn rest<V: Lanes<Scalar = R>>(&self, block: usize, q: usize) -> ([V; 9], V) {
        let numbers = &self.rest.from(10 * (block * self.points + q) * V::COUNT)[..10 * V::COUNT];
        let mut inverse_jacobian = [V::load(numbers); 9];
        for (k, entry) in inverse_jacobian.iter_mut().enumerate().skip(1) {
            *entry = V::load(&numbers[k * V::COUNT..]);
        }
        (inverse_jacobian, V::load(&numbers[9 * V::COUNT..]))
    }

    /// The constants of the elements of a range of blocks.
    pub(crate) fn load_constants<V: Lanes<Scalar = R>>(&self, first: usize, out: &mut [V]) {
        if self.per_element {
            let numbers = self.constants.from(first * self.count * V::COUNT);
            for (k, out) in out.iter_mut().enumerate() {
                *out = V::load(&numbers[k * V::COUNT..]);
            }
        } else {
            for (out, constant) in out.iter_mut().zip(self.constants.from(0)) {
                *out = V::splat(*constant);
            }
        }
    }
}

/// The nodes of a cluster, copied from those of the body.
pub fn copy_nodes<R: Copy + Default>(from: &[[R; 3]], nodes: &[u32], to: &mut Vec<Node<R>>) {
    to.clear();
    to.extend(nodes.iter().map(|n| {
        let [x, y, z] = from[*n as usize];
        [x, y, z, R::default()]
    }));
}

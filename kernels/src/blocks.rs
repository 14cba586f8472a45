//! The elements of a batch as lanes meet them: blocks of as many elements as there are lanes, number by number.
//!
//! A block has the places of each node, lane after lane; of each quadrature point the nine numbers of J^-1 and the weight,
//! lane after lane; and its constants likewise, where each element has its own. Blocks of a cluster follow each other, and
//! clusters do; the last block of a cluster is filled up with its last element, without weight.
#![allow(unsafe_code)]

use crate::aligned::Aligned;
use crate::element::RestPoint;
use crate::lanes::{Lanes, Node, Place, stride};
use crate::real::Real;

/// What is stored of the state of a batch for products with its tangent: of each block numbers of one quadrature point
/// after the other, lane after lane.
#[derive(Debug)]
pub struct States<R> {
    numbers: Aligned<R>,
    /// Numbers of a block.
    each: usize,
}

impl<R: Real + Default> States<R> {
    /// Room for so many numbers at each point.
    pub(crate) fn new(blocks: &Blocks<R>, stored: usize) -> Self {
        let each = blocks.lanes * blocks.points * stored;
        Self { numbers: Aligned::zeros(blocks.count() * each), each }
    }

    /// Those of a cluster, followed by those of the clusters after it.
    pub fn of(&self, part: Part<R>) -> &[R] {
        &self.numbers.all()[part.first * self.each..]
    }

    /// Those of each cluster.
    pub fn parts_mut(&mut self, blocks: &Blocks<R>) -> Vec<&mut [R]> {
        let mut rest = self.numbers.all_mut();
        let part = |k: usize| {
            let here;
            (here, rest) = std::mem::take(&mut rest).split_at_mut(blocks.part(k).len() * self.each);
            here
        };
        (0..blocks.parts.len()).map(part).collect()
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
}

/// See the module.
#[derive(Debug)]
pub struct Blocks<R> {
    lanes: usize,
    nodes: usize,
    points: usize,
    places: Aligned<Place>,
    rest: Aligned<R>,
    constants: Aligned<R>,
    /// Constants of an element.
    constant_count: usize,
    per_element: bool,
    /// The first block and the elements of each cluster.
    parts: Vec<(usize, usize)>,
    /// One more than the greatest node of a cluster.
    reach: usize,
}

/// The blocks of a cluster.
#[derive(Debug)]
pub struct Part<'a, R> {
    /// Those of the batch.
    pub(crate) blocks: &'a Blocks<R>,
    /// The first one.
    pub(crate) first: usize,
    elements: usize,
}

impl<R> Clone for Part<'_, R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for Part<'_, R> {}

impl<R> Part<'_, R> {
    /// Elements.
    pub fn elements(&self) -> usize {
        self.elements
    }

    /// How many blocks there are.
    pub(crate) fn len(&self) -> usize {
        self.elements.div_ceil(self.blocks.lanes)
    }

    /// The nodes of the elements of each block, numbered within the cluster: those of one node of an element after the
    /// other, lane after lane.
    pub fn nodes(&self) -> impl Iterator<Item = Vec<u32>> {
        let of_block = self.blocks.nodes * self.blocks.lanes;
        let places = self.blocks.places.all()[self.first * of_block..][..self.len() * of_block].chunks_exact(of_block);
        places.map(|places| places.iter().map(|place| u32::from(*place) / stride::<R>() as u32).collect())
    }
}

/// The most nodes that the places of a cluster can tell apart.
pub const fn most_nodes<R>() -> usize {
    Place::MAX as usize / stride::<R>()
}

impl<R: Real + Default> Blocks<R> {
    /// Room for clusters of so many elements, in blocks of so many lanes; each element has so many nodes, points and
    /// constants, and maybe constants of its own. [`Blocks::fill`] says what they are.
    pub fn new(lanes: usize, [nodes, points, constants]: [usize; 3], per_element: bool, clusters: &[usize]) -> Self {
        let mut count = 0;
        let part = |elements: &usize| {
            let first = count;
            count += elements.div_ceil(lanes);
            (first, *elements)
        };
        let parts = clusters.iter().map(part).collect();
        let sets = if per_element { count * lanes } else { 1 };
        Self {
            lanes,
            nodes,
            points,
            places: Aligned::zeros(count * nodes * lanes),
            rest: Aligned::zeros(count * points * 10 * lanes),
            constants: Aligned::zeros(sets * constants),
            constant_count: constants,
            per_element,
            parts,
            reach: 1,
        }
    }

    /// The elements of a cluster, by its number.
    ///
    /// # Panics
    /// The arrays do not fit together, or a node is beyond [`most_nodes`].
    pub fn fill(&mut self, cluster: usize, given: &Cluster<R>) {
        let (first, elements) = self.parts[cluster];
        let (lanes, nodes, points, count) = (self.lanes, self.nodes, self.points, self.constant_count);
        assert_eq!(given.nodes.len(), elements * nodes, "each element has all nodes");
        assert_eq!(given.rest.len(), elements * points, "each element has all points");
        assert_eq!(given.constants.len(), if self.per_element { elements * count } else { count }, "all constants");
        let reach = given.nodes.iter().max().map_or(0, |n| *n as usize + 1);
        assert!(reach <= most_nodes::<R>(), "a cluster of {reach} nodes is too large");
        self.reach = self.reach.max(reach);
        if !self.per_element {
            self.constants.all_mut().copy_from_slice(given.constants);
        }
        for lane in 0..elements.div_ceil(lanes) * lanes {
            // What fills the last block up is its last element once more.
            let (e, again) = (lane.min(elements - 1), lane >= elements);
            let (block, lane) = (first + lane / lanes, lane % lanes);
            for (node, n) in given.nodes[e * nodes..][..nodes].iter().enumerate() {
                let place = *n as usize * stride::<R>();
                self.places.all_mut()[(block * nodes + node) * lanes + lane] = place as Place;
            }
            for (q, point) in given.rest[e * points..][..points].iter().enumerate() {
                let weight = if again { R::default() } else { point.weight };
                let numbers = &mut self.rest.all_mut()[(block * points + q) * 10 * lanes..];
                for (k, number) in point.inverse_jacobian.into_iter().chain([weight]).enumerate() {
                    numbers[k * lanes + lane] = number;
                }
            }
            if self.per_element {
                for (k, constant) in given.constants[e * count..][..count].iter().enumerate() {
                    self.constants.all_mut()[(block * count + k) * lanes + lane] = *constant;
                }
            }
        }
    }
}

impl<R> Blocks<R> {
    /// The blocks of a cluster.
    pub fn part(&self, cluster: usize) -> Part<'_, R> {
        let (first, elements) = self.parts[cluster];
        Part { blocks: self, first, elements }
    }

    /// Nodes that vectors have which kernels are given: as many as the cluster with the most, at least.
    pub fn reach(&self) -> usize {
        self.reach
    }

    /// How many blocks there are.
    fn count(&self) -> usize {
        self.parts.last().map_or(0, |(first, elements)| first + elements.div_ceil(self.lanes))
    }

    /// Nodes of an element.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Quadrature points of an element.
    pub(crate) fn points(&self) -> usize {
        self.points
    }

    /// Constants of an element.
    pub(crate) fn constants(&self) -> usize {
        self.constant_count
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
        &self.places.all()[(block * self.nodes + node) * V::COUNT..][..V::COUNT]
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
    /// computed. Beyond a cluster's end lies the next one, which likely comes next.
    #[inline(always)]
    pub(crate) fn prefetch(&self, block: usize) {
        let each = 10 * self.points * self.lanes;
        self.rest.prefetch(block * each, each);
        let each = self.nodes * self.lanes;
        self.places.prefetch(block * each, each);
    }

    /// J^-1 at a quadrature point of each element of a block, and the weight.
    #[inline(always)]
    pub(crate) fn rest<V: Lanes<Scalar = R>>(&self, block: usize, q: usize) -> ([V; 9], V) {
        let numbers = &self.rest.all()[10 * (block * self.points + q) * V::COUNT..][..10 * V::COUNT];
        let mut inverse_jacobian = [V::load(numbers); 9];
        for (k, entry) in inverse_jacobian.iter_mut().enumerate().skip(1) {
            *entry = V::load(&numbers[k * V::COUNT..]);
        }
        (inverse_jacobian, V::load(&numbers[9 * V::COUNT..]))
    }

    /// The constants of the elements of a range of blocks.
    pub(crate) fn load_constants<V: Lanes<Scalar = R>>(&self, first: usize, out: &mut [V]) {
        if self.per_element {
            let numbers = &self.constants.all()[first * self.constant_count * V::COUNT..];
            for (k, out) in out.iter_mut().enumerate() {
                *out = V::load(&numbers[k * V::COUNT..]);
            }
        } else {
            for (out, constant) in out.iter_mut().zip(self.constants.all()) {
                *out = V::splat(*constant);
            }
        }
    }
}

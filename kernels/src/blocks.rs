//! The elements of a batch as lanes meet them: blocks of as many elements as there are lanes, number by number.
//!
//! A block has the places of each node, a row of lanes for each; of each quadrature point the nine numbers of J^-1 and the weight,
//! lane after lane; and its constants likewise, where each element has its own. Blocks of a cluster follow each other, and
//! clusters do; the last block of a cluster is filled up with its last element, without weight. The first blocks of a cluster
//! may be those of strips ([`crate::strip`]): three blocks have six rows of places.
#![allow(unsafe_code)]

use crate::aligned::Aligned;
use crate::element::RestPoint;
use crate::lanes::{Lanes, Node, Place, stride};
use crate::real::Real;
use crate::strip::{self, MEMBERS, STRIP};

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

    /// Bytes of the numbers.
    pub fn bytes(&self) -> usize {
        size_of_val(self.numbers.all())
    }

    /// Those of a cluster, followed by those of the clusters after it.
    pub fn of(&self, part: Part<R>) -> &[R] {
        &self.numbers.all()[part.span.first * self.each..]
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

/// How many elements a cluster has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// All of them.
    pub elements: usize,
    /// The first of them, so many times [`MEMBERS`] blocks, are strips.
    pub strips: usize,
}

impl Extent {
    /// Elements without strips.
    pub fn of(elements: usize) -> Self {
        Self { elements, strips: 0 }
    }

    /// Places of nodes that its elements have in blocks of so many lanes, where each has so many nodes.
    pub fn places(self, lanes: usize, nodes: usize) -> usize {
        let blocks = self.elements.div_ceil(lanes) - MEMBERS * self.strips;
        (strip::NODES * self.strips + nodes * blocks) * lanes
    }
}

/// Elements of a cluster, as a runtime has them. Of blocks of strips the first elements come first, of one lane after the
/// other, then the second and the third ones, each with its nodes in the order of [`STRIP`].
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
    /// The range of each cluster.
    parts: Vec<Span>,
    /// One more than the greatest node of a cluster.
    reach: usize,
}

/// Where a cluster is.
#[derive(Debug, Clone, Copy)]
struct Span {
    /// Its first block.
    first: usize,
    /// Its first row of places.
    row: usize,
    extent: Extent,
}

/// The blocks of a cluster.
#[derive(Debug)]
pub struct Part<'a, R> {
    /// Those of the batch.
    pub(crate) blocks: &'a Blocks<R>,
    span: Span,
}

/// Blocks that follow each other and are all strips, or none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Range {
    /// Blocks of the cluster before it.
    pub before: usize,
    /// The first block.
    pub first: usize,
    /// How many.
    pub count: usize,
    /// The first row of places.
    pub row: usize,
    /// Whether they are strips.
    pub are_strips: bool,
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
        self.span.extent.elements
    }

    /// How many blocks there are.
    pub(crate) fn len(&self) -> usize {
        self.elements().div_ceil(self.blocks.lanes)
    }

    /// Its blocks, at most so many at once: of strips whole ones.
    pub(crate) fn ranges(&self, most: usize) -> impl Iterator<Item = Range> {
        let (span, len, nodes) = (self.span, self.len(), self.blocks.nodes);
        let ends = [MEMBERS * span.extent.strips, len];
        let mut before = 0;
        std::iter::from_fn(move || {
            let are_strips = before < ends[0];
            let count = if are_strips { most.next_multiple_of(MEMBERS) } else { most };
            let count = count.min(ends[usize::from(!are_strips)] - before);
            let range = Range { before, first: span.first + before, count, row: span.row(before, nodes), are_strips };
            before += count;
            (count > 0).then_some(range)
        })
    }

    /// The nodes of the elements of each block, numbered within the cluster: those of one node of an element after the
    /// other, lane after lane.
    pub fn nodes(&self) -> impl Iterator<Item = Vec<u32>> {
        let (lanes, nodes) = (self.blocks.lanes, self.blocks.nodes);
        let places = move |row: usize| &self.blocks.places.all()[row * lanes..][..lanes];
        (0..self.len()).map(move |block| {
            let places = (0..nodes).flat_map(|node| places(self.span.node_row(block, node, nodes)));
            places.map(|place| u32::from(*place) / stride::<R>() as u32).collect()
        })
    }
}

impl Span {
    /// The first row of places of a block: of strips their first one.
    fn row(&self, block: usize, nodes: usize) -> usize {
        let of_strips = block.min(MEMBERS * self.extent.strips);
        self.row + of_strips / MEMBERS * strip::NODES + (block - of_strips) * nodes
    }

    /// The row of places of a node of a block's elements.
    fn node_row(&self, block: usize, node: usize, nodes: usize) -> usize {
        let member = block % MEMBERS;
        match block < MEMBERS * self.extent.strips {
            true => self.row(block - member, nodes) + STRIP[member][node],
            false => self.row(block, nodes) + node,
        }
    }
}

/// The most nodes that the places of a cluster can tell apart.
pub const fn most_nodes<R>() -> usize {
    Place::MAX as usize / stride::<R>()
}

impl<R: Real + Default> Blocks<R> {
    /// Room for clusters of so many elements, in blocks of so many lanes; each element has so many nodes, points and
    /// constants, and maybe constants of its own. [`Blocks::fill`] says what they are.
    ///
    /// # Panics
    /// There are more strips than elements, or strips of others than linear tetrahedra.
    pub fn new(lanes: usize, [nodes, points, constants]: [usize; 3], per_element: bool, clusters: &[Extent]) -> Self {
        let (mut count, mut rows) = (0, 0);
        let part = |extent: &Extent| {
            let Extent { elements, strips } = *extent;
            assert!(strips == 0 || [nodes, points] == [4, 1], "strips are of linear tetrahedra");
            assert!(MEMBERS * strips * lanes <= elements, "strips beyond the last element");
            let span = Span { first: count, row: rows, extent: *extent };
            count += elements.div_ceil(lanes);
            rows += extent.places(lanes, nodes) / lanes;
            span
        };
        let parts = clusters.iter().map(part).collect();
        let sets = if per_element { count * lanes } else { 1 };
        Self {
            lanes,
            nodes,
            points,
            places: Aligned::zeros(rows * lanes),
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
    /// The arrays do not fit together, a node is beyond [`most_nodes`], or a strip is none.
    pub fn fill(&mut self, cluster: usize, given: &Cluster<R>) {
        let span = self.parts[cluster];
        let Span { first, extent: Extent { elements, strips }, .. } = span;
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
            let (in_part, lane) = (lane / lanes, lane % lanes);
            let (block, member) = (first + in_part, in_part % MEMBERS);
            for (node, n) in given.nodes[e * nodes..][..nodes].iter().enumerate() {
                let place = (*n as usize * stride::<R>()) as Place;
                let row = span.node_row(in_part, node, nodes);
                let at = &mut self.places.all_mut()[row * lanes + lane];
                let is_met =
                    in_part < MEMBERS * strips && STRIP[..member].as_flattened().contains(&STRIP[member][node]);
                assert!(!is_met || *at == place, "elements of a strip share faces");
                *at = place;
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
        Part { blocks: self, span: self.parts[cluster] }
    }

    /// Nodes that vectors have which kernels are given: as many as the cluster with the most, at least.
    pub fn reach(&self) -> usize {
        self.reach
    }

    /// Bytes of places, of rest data and of constants.
    pub fn bytes(&self) -> [usize; 3] {
        [size_of_val(self.places.all()), size_of_val(self.rest.all()), size_of_val(self.constants.all())]
    }

    /// How many blocks there are.
    fn count(&self) -> usize {
        self.parts.last().map_or(0, |span| span.first + span.extent.elements.div_ceil(self.lanes))
    }

    /// Elements of a block.
    pub fn lanes(&self) -> usize {
        self.lanes
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

    /// A row of places, which are those of nodes.
    ///
    /// # Panics
    /// There are other lanes, or fewer nodes than a cluster has.
    #[inline(always)]
    fn places<V: Lanes<Scalar = R>>(&self, row: usize, nodes: &[Node<R>]) -> &[Place] {
        assert!(V::COUNT == self.lanes && nodes.len() >= self.reach, "blocks of other lanes or nodes");
        &self.places.all()[row * V::COUNT..][..V::COUNT]
    }

    /// The vectors at a row of places.
    #[inline(always)]
    pub(crate) fn gather<V: Lanes<Scalar = R>>(&self, u: &[Node<R>], row: usize) -> [V; 3] {
        // SAFETY: `places` says so.
        unsafe { V::gather(u, self.places::<V>(row, u)) }
    }

    /// Adds vectors at a row of places.
    #[inline(always)]
    pub(crate) fn scatter<V: Lanes<Scalar = R>>(&self, vectors: [V; 3], f: &mut [Node<R>], row: usize) {
        // SAFETY: as above.
        unsafe { V::scatter(vectors, f, self.places::<V>(row, f)) }
    }
}

impl<R: Copy> Blocks<R> {
    /// Asks for what a block has at rest before it is read: it comes from an outer cache or from memory, while others are
    /// computed. Beyond a cluster's end lies the next one, which likely comes next.
    #[inline(always)]
    pub(crate) fn prefetch(&self, block: usize) {
        let each = 10 * self.points * self.lanes;
        self.rest.prefetch(block * each, each);
    }

    /// As [`Blocks::prefetch`], some rows of places.
    #[inline(always)]
    pub(crate) fn prefetch_places(&self, row: usize, rows: usize) {
        self.places.prefetch(row * self.lanes, rows * self.lanes);
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

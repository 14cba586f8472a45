//! Strips of linear tetrahedra: three, each of which shares a face with the next (see [`tensormass_kernels::strip`]).
//!
//! Elements are vertices of a graph whose edges are shared faces, and strips are disjoint paths of three. To find as many as
//! there are is hard; here the element with the fewest free neighbours is served first, as in greedy matchings.

use tensormass_kernels::RestPoint;
use tensormass_kernels::strip::{MEMBERS, STRIP};

/// Faces of a tetrahedron, each without one of its nodes.
const FACES: usize = 4;

/// An element of a strip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Member {
    /// Which one of those given.
    pub element: u32,
    /// Of each node in the order of strips its number in the element.
    pub order: [u8; 4],
}

impl Member {
    /// The same element among those that begin after so many others.
    pub fn after(self, before: usize) -> Self {
        Self { element: before as u32 + self.element, ..self }
    }

    /// The order of its nodes along the strip, of which it is in this place: each element has all but the first node of the
    /// one before, and one more.
    pub fn along(&self, place: usize) -> [u8; 4] {
        let mut along = self.order;
        for (order, number) in self.order.iter().zip(STRIP[place]) {
            along[number - place] = *order;
        }
        along
    }
}

/// A linear tetrahedron at rest, with its nodes in another order.
pub fn reordered(point: &RestPoint<f64>, order: [u8; 4]) -> RestPoint<f64> {
    let rows = point.inverse_jacobian.as_chunks::<3>().0;
    // The gradients of nodes 1, 2, 3; with that of node 0 they sum to zero.
    let gradient = |n: u8| match n {
        0 => std::array::from_fn(|k| -(rows[0][k] + rows[1][k] + rows[2][k])),
        n => rows[usize::from(n) - 1],
    };
    let mut inverse_jacobian = [0.0; 9];
    for (row, n) in inverse_jacobian.as_chunks_mut::<3>().0.iter_mut().zip(&order[1..]) {
        *row = gradient(*n);
    }
    RestPoint { inverse_jacobian, weight: point.weight }
}

/// Disjoint strips of some elements, by their nodes, in the order of each strip's least element, and the elements of none,
/// ascending.
pub fn strips(elements: &[[u32; 4]]) -> (Vec<[Member; MEMBERS]>, Vec<u32>) {
    let mut graph = Graph::new(elements);
    let mut paths = vec![];
    while let Some(next) = graph.fewest() {
        if let Some(path) = graph.path(next) {
            path.into_iter().for_each(|e| graph.take(e));
            paths.push(path);
        } else {
            // It has no two that it could lie in a strip with: nor will it have.
            graph.take(next);
            graph.alone.push(next);
        }
    }
    graph.alone.sort_unstable();
    paths.sort_unstable_by_key(|path| path.iter().copied().min());
    (paths.into_iter().map(|path| members(elements, path)).collect(), graph.alone)
}

/// Which elements share faces, and which of them are free.
struct Graph {
    neighbours: Vec<[u32; FACES]>,
    free: Vec<bool>,
    /// Free elements by the number of their free neighbours; some have been taken or have fewer by now.
    by_degree: [Vec<u32>; FACES + 1],
    alone: Vec<u32>,
}

/// No element.
const NONE: u32 = u32::MAX;

impl Graph {
    fn new(elements: &[[u32; 4]]) -> Self {
        let mut faces: Vec<([u32; 3], u32, u8)> = vec![];
        for (e, nodes) in (0..).zip(elements) {
            for left_out in 0..FACES {
                let mut face: [u32; 3] = std::array::from_fn(|k| nodes[(left_out + 1 + k) % FACES]);
                face.sort_unstable();
                faces.push((face, e, left_out as u8));
            }
        }
        faces.sort_unstable();
        let mut neighbours = vec![[NONE; FACES]; elements.len()];
        for shared in faces.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, e, face), (_, other, other_face)] = *shared
                && outside(elements[e as usize], elements[other as usize]).is_some()
            {
                neighbours[e as usize][usize::from(face)] = other;
                neighbours[other as usize][usize::from(other_face)] = e;
            }
        }
        let mut graph =
            Self { neighbours, free: vec![true; elements.len()], by_degree: Default::default(), alone: vec![] };
        // The first elements come last on their stacks, and are met first.
        for e in (0..elements.len() as u32).rev() {
            graph.by_degree[graph.degree(e)].push(e);
        }
        graph
    }

    fn free_neighbours(&self, e: u32) -> impl Iterator<Item = u32> + Clone {
        self.neighbours[e as usize].into_iter().filter(|n| *n != NONE && self.free[*n as usize])
    }

    fn degree(&self, e: u32) -> usize {
        self.free_neighbours(e).count()
    }

    /// A free element with the fewest free neighbours.
    fn fewest(&mut self) -> Option<u32> {
        loop {
            let degree = self.by_degree.iter().position(|stack| !stack.is_empty())?;
            let e = self.by_degree[degree].pop()?;
            if self.free[e as usize] && self.degree(e) == degree {
                return Some(e);
            }
        }
    }

    fn take(&mut self, e: u32) {
        self.free[e as usize] = false;
        for n in self.neighbours[e as usize] {
            if n != NONE && self.free[n as usize] {
                self.by_degree[self.degree(n)].push(n);
            }
        }
    }

    /// Three free elements in a row, of which one is given: those whose own neighbours are fewest, which would be left
    /// without.
    fn path(&self, e: u32) -> Option<[u32; MEMBERS]> {
        let near = self.free_neighbours(e);
        let ends = near.clone().flat_map(|a| self.free_neighbours(a).filter(move |b| *b != e).map(move |b| [e, a, b]));
        let around = near.clone().flat_map(|a| near.clone().filter(move |b| a < *b).map(move |b| [a, e, b]));
        ends.chain(around).min_by_key(|path| path.iter().map(|e| self.degree(*e)).sum::<usize>())
    }
}

/// A strip of three elements in a row: nodes are those of [`STRIP`].
fn members(elements: &[[u32; 4]], path: [u32; MEMBERS]) -> [Member; MEMBERS] {
    let [first, middle, last] = path.map(|e| elements[e as usize]);
    let [n0, n4] = [outside(first, middle), outside(middle, first)];
    let [n1, n5] = [outside(middle, last), outside(last, middle)];
    let mut both = middle.into_iter().filter(|n| ![n1, n4].contains(&Some(*n)));
    let nodes = [n0, n1, both.next(), both.next(), n4, n5];
    std::array::from_fn(|m| {
        let given = elements[path[m] as usize];
        let place = |n: usize| given.iter().position(|g| Some(*g) == nodes[n]);
        // Each node is one of the element's, which have a face in common and are not the same.
        Member { element: path[m], order: STRIP[m].map(|n| place(n).unwrap_or(0) as u8) }
    })
}

/// A node of an element that another one does not have.
fn outside(of: [u32; 4], other: [u32; 4]) -> Option<u32> {
    of.into_iter().find(|n| !other.contains(n))
}

//! Strips of linear tetrahedra: three, each of which shares a face with the next, gathered and added up together.
//!
//! Three tetrahedra name twelve nodes, a strip six. The three of a strip have the same lane of three blocks that follow
//! each other, and everything but the places of nodes is theirs as it is a single element's.

use crate::element::{Element, Elements};
use crate::lanes::{Lanes, Node};

/// Elements of a strip.
pub const MEMBERS: usize = 3;
/// Nodes of a strip.
pub const NODES: usize = 6;
/// Of each node of each element its number among those of the strip. All begin with the same node: differences to it are
/// taken once.
pub const STRIP: [[usize; 4]; MEMBERS] = [[2, 0, 1, 3], [2, 1, 3, 4], [2, 3, 4, 5]];

/// As [`crate::element::gradients`], of strips.
// Written out where a loop would index registers: compilers leave such loops in memory.
#[inline(always)]
pub(crate) fn gradients_of<E: Element, V: Lanes, const N: usize>(
    elements: &Elements<V>,
    vectors: [&[Node<V::Scalar>]; N],
    out: &mut [&mut [[V; 9]]; N],
) {
    let Elements { blocks, count, .. } = *elements;
    for strip in (0..count).step_by(MEMBERS) {
        elements.prefetch_places(strip);
        let row = elements.strip_row(strip);
        for (k, (vector, out)) in vectors.iter().zip(&mut *out).enumerate() {
            let nodes = [
                blocks.gather(vector, row),
                blocks.gather(vector, row + 1),
                blocks.gather(vector, row + 2),
                blocks.gather(vector, row + 3),
                blocks.gather(vector, row + 4),
                blocks.gather(vector, row + 5),
            ];
            let out = &mut out[strip..][..MEMBERS];
            // A few at a time: more than a core can wait for would hold up what follows.
            if k == 0 {
                elements.prefetch_rest(strip);
            }
            out[0] = gradient::<E, V, 0>(elements, strip, &nodes);
            if k == 0 {
                elements.prefetch_rest(strip + 1);
            }
            out[1] = gradient::<E, V, 1>(elements, strip, &nodes);
            if k == 0 {
                elements.prefetch_rest(strip + 2);
            }
            out[2] = gradient::<E, V, 2>(elements, strip, &nodes);
        }
    }
}

/// The gradient in an element of strips.
#[inline(always)]
fn gradient<E: Element, V: Lanes, const M: usize>(
    elements: &Elements<V>,
    strip: usize,
    nodes: &[[V; 3]; NODES],
) -> [V; 9] {
    let (inverse_jacobian, _) = elements.blocks.rest::<V>(elements.first + strip + M, 0);
    E::gradient(&of_member::<E, V, M>(nodes), elements.table.point(0), &inverse_jacobian)
}

/// Vectors at the nodes of an element of strips.
#[inline(always)]
fn of_member<E: Element, V: Lanes, const M: usize>(nodes: &[[V; 3]; NODES]) -> E::Nodal<V> {
    let mut nodal = E::nodal();
    let at = nodal.as_mut();
    at[0] = nodes[STRIP[M][0]];
    at[1] = nodes[STRIP[M][1]];
    at[2] = nodes[STRIP[M][2]];
    at[3] = nodes[STRIP[M][3]];
    nodal
}

/// As [`crate::element::contract`], of strips.
#[inline(always)]
pub(crate) fn contract<E: Element, V: Lanes>(elements: &Elements<V>, stress: &[[V; 9]], f: &mut [Node<V::Scalar>]) {
    let Elements { blocks, count, .. } = *elements;
    for strip in (0..count).step_by(MEMBERS) {
        // As `Element::nodal`.
        let mut forces = [[V::from_f64(-0.0); 3]; NODES];
        let stress = &stress[strip..][..MEMBERS];
        add_forces::<E, V, 0>(elements, strip, &stress[0], &mut forces);
        add_forces::<E, V, 1>(elements, strip, &stress[1], &mut forces);
        add_forces::<E, V, 2>(elements, strip, &stress[2], &mut forces);
        let row = elements.strip_row(strip);
        let [n0, n1, n2, n3, n4, n5] = forces;
        blocks.scatter(n0, f, row);
        blocks.scatter(n1, f, row + 1);
        blocks.scatter(n2, f, row + 2);
        blocks.scatter(n3, f, row + 3);
        blocks.scatter(n4, f, row + 4);
        blocks.scatter(n5, f, row + 5);
    }
}

/// Adds the forces of an element of strips to those of its nodes.
#[inline(always)]
fn add_forces<E: Element, V: Lanes, const M: usize>(
    elements: &Elements<V>,
    strip: usize,
    stress: &[V; 9],
    forces: &mut [[V; 3]; NODES],
) {
    let (inverse_jacobian, weight) = elements.blocks.rest::<V>(elements.first + strip + M, 0);
    let mut nodal = of_member::<E, V, M>(forces);
    E::contract(stress, elements.table.point(0), &inverse_jacobian, weight, &mut nodal);
    let at = nodal.as_ref();
    forces[STRIP[M][0]] = at[0];
    forces[STRIP[M][1]] = at[1];
    forces[STRIP[M][2]] = at[2];
    forces[STRIP[M][3]] = at[3];
}

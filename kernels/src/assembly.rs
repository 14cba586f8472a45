//! Blocks of the tangent between the nodes of an element, from what a law makes of each unit gradient.

#![allow(unsafe_code)]

use crate::element::Elements;
use crate::lanes::{Lanes, Node, stride};

/// A block of 3 x 3 numbers, a row in the place of each of three nodes.
pub type Pair<R> = [Node<R>; 3];

/// Where a block is among others, as [`crate::Compute::assemble`] is told.
pub const fn block_place<R>(block: u32) -> u32 {
    block * 3 * stride::<R>() as u32
}

/// The pairs of an element's nodes, in the order in which their blocks are computed.
pub fn pairs(nodes: usize) -> impl Iterator<Item = [usize; 2]> {
    (1..nodes).flat_map(|j| (0..j).map(move |i| [i, j]))
}

/// The differential dP at each quadrature point, for each component of dG that is 1 where the others are 0.
pub(crate) type Tangents<'a, V> = [&'a [[V; 9]]; 9];

/// What each node's force changes by with each node's displacement, in two dimensions or three: -w grad Lambda_i (dP/dG) grad Lambda_j, added up over
/// an element's points and then to the blocks that are named, of each pair's lanes one after the other.
pub(crate) type AssemblyKernel<V> =
    fn(&Elements<V>, usize, &Tangents<V>, &[[V; 3]], &[u32], &mut [Pair<<V as Lanes>::Scalar>]);

/// See [`AssemblyKernel`].
#[inline(always)]
pub(crate) fn assemble<V: Lanes>(
    elements: &Elements<V>,
    dimension: usize,
    tangents: &Tangents<V>,
    gradients: &[[V; 3]],
    places: &[u32],
    out: &mut [Pair<V::Scalar>],
) {
    let Elements { blocks, first, count, .. } = *elements;
    let (nodes, points) = (blocks.nodes(), blocks.points());
    let greatest = places.iter().fold(0, |greatest, place| (*place).max(greatest));
    assert!(greatest as usize <= block_place::<V::Scalar>(out.len() as u32 - 1) as usize, "a block beyond the last");
    let rows = out.as_flattened_mut();
    // Component 9 c + 3 a + k at a point: what P_ak changes by with component c of a node's displacement.
    let mut of_node = vec![[V::from_f64(0.0); 27]; points];
    let mut places = places.chunks_exact(V::COUNT);
    for block in 0..count {
        for j in 1..nodes {
            for (q, of_node) in of_node.iter_mut().enumerate() {
                let point = block * points + q;
                let (_, weight) = blocks.rest::<V>(first + block, q);
                let gradient = &gradients[point * nodes + j];
                let weighted = [-(weight * gradient[0]), -(weight * gradient[1]), -(weight * gradient[2])];
                for c in 0..3 {
                    for ak in 0..9 {
                        let sum = tangents[3 * c][point][ak] * weighted[0];
                        let sum = tangents[3 * c + 1][point][ak].multiply_add(weighted[1], sum);
                        of_node[9 * c + ak] = tangents[3 * c + 2][point][ak].multiply_add(weighted[2], sum);
                    }
                }
            }
            for i in 0..j {
                let mut sums = [V::from_f64(-0.0); 9];
                for (q, of_node) in of_node.iter().enumerate() {
                    let gradient = &gradients[(block * points + q) * nodes + i];
                    for a in 0..3 {
                        for c in 0..3 {
                            for k in 0..3 {
                                sums[3 * a + c] = of_node[9 * c + 3 * a + k].multiply_add(gradient[k], sums[3 * a + c]);
                            }
                        }
                    }
                }
                let Some(places) = places.next() else { return };
                if dimension == 2 {
                    // Bodies in plane strain stay in their plane, whatever a law's directions do.
                    for k in [2, 5, 6, 7, 8] {
                        sums[k] = V::from_f64(0.0);
                    }
                }
                // SAFETY: each place is that of a block, see above.
                for a in 0..3 {
                    let row = [sums[3 * a], sums[3 * a + 1], sums[3 * a + 2]];
                    unsafe { V::scatter(row, &mut rows[a..], places) };
                }
            }
        }
    }
}

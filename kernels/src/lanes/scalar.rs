//! A single number as lanes: any machine has it.

use super::{Index, Lanes, Node, Place};

macro_rules! scalar {
    ($t:ty) => {
        impl Lanes for $t {
            type Scalar = $t;
            type Machine = ();
            const COUNT: usize = 1;
            #[inline(always)]
            fn splat(x: $t) -> $t {
                x
            }
            #[inline(always)]
            fn load(from: &[$t]) -> $t {
                from[0]
            }
            #[inline(always)]
            fn store(self, to: &mut [$t]) {
                to[0] = self;
            }
            #[inline(always)]
            unsafe fn gather(nodes: &[Node<$t>], places: &[Place]) -> [$t; 3] {
                let [x, y, z, _] = nodes[usize::from(places[0]) / super::stride::<$t>()];
                [x, y, z]
            }
            #[inline(always)]
            unsafe fn scatter<I: Index>(vector: [$t; 3], nodes: &mut [Node<$t>], places: &[I]) {
                let node = &mut nodes[places[0].index() / super::stride::<$t>()];
                for c in 0..3 {
                    node[c] += vector[c];
                }
            }
            fn first_not_positive(self) -> usize {
                0
            }
        }
    };
}
scalar!(f32);
scalar!(f64);

//! The rule by which masses are integrated: five points of Gauss along each coordinate, whatever an element's own rule.
//!
//! A consistent mass is an integral of products of functions, of twice their degree; an element's own rule is as coarse as
//! its stiffness allows. Simplices are collapsed squares and cubes (Stroud, Approximate Calculation of Multiple Integrals,
//! 1971, section 2.4). Exact for products of functions of third order, and of second order on curved elements.

use super::declaration::Quadrature;
use super::shape::Shape;

/// Nodes and weights on [-1, 1]; Abramowitz & Stegun, Handbook of Mathematical Functions, table 25.4.
fn gauss() -> [(f64, f64); 5] {
    let (inner, outer) =
        ((5.0 - 2.0 * (10.0_f64 / 7.0).sqrt()).sqrt() / 3.0, (5.0 + 2.0 * (10.0_f64 / 7.0).sqrt()).sqrt() / 3.0);
    let root = 13.0 * 70.0_f64.sqrt();
    let (heavy, light) = ((322.0 + root) / 900.0, (322.0 - root) / 900.0);
    [(-outer, light), (-inner, heavy), (0.0, 128.0 / 225.0), (inner, heavy), (outer, light)]
}

/// The rule of a shape.
pub(super) fn rule(shape: Shape) -> Quadrature {
    let full = gauss();
    let half = full.map(|(x, w)| (0.5 * (1.0 + x), 0.5 * w));
    let one = [(0.0, 1.0)];
    // Coordinates of a square or a cube, from 0 where they are to be collapsed.
    let along: [&[(f64, f64)]; 3] = match shape {
        Shape::Segment => [&full, &one, &one],
        Shape::Triangle => [&half, &half, &one],
        Shape::Quadrangle => [&full, &full, &one],
        Shape::Tetrahedron => [&half, &half, &half],
        Shape::Hexahedron => [&full, &full, &full],
        Shape::Prism => [&half, &half, &full],
    };
    let (mut points, mut weights) = (vec![], vec![]);
    for &(a, wa) in along[0] {
        for &(b, wb) in along[1] {
            for &(c, wc) in along[2] {
                let left = 1.0 - a;
                let (point, scale) = match shape {
                    Shape::Segment | Shape::Quadrangle | Shape::Hexahedron => ([a, b, c], 1.0),
                    Shape::Triangle | Shape::Prism => ([a, b * left, c], left),
                    Shape::Tetrahedron => ([a, b * left, c * left * (1.0 - b)], left * left * (1.0 - b)),
                };
                points.push(point);
                weights.push(wa * wb * wc * scale);
            }
        }
    }
    Quadrature { degree: 7, points, weights }
}

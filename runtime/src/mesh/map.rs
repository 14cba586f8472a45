//! The map of an element from its reference coordinates xi to its rest positions X.
//!
//! X(xi) = sum_j Lambda_j(xi) X_j; J = dX/dxi. Of a plane element the third column of J is the unit vector along z, so that
//! a body of unit thickness is meant; of a face J has two columns.

use tensormass_kernels::ElementInfo;
use tensormass_kernels::{ReferencePoint, RestPoint};

use super::gradients::{cross, dot, norm, shape_gradients, sub};

/// The columns of J at a point with these slopes. Edges are differences of positions, taken first: far from the origin nothing more is lost
/// than the positions themselves have lost.
pub(super) fn jacobian(info: &ElementInfo, slopes: &[[f64; 3]], positions: &[[f64; 3]]) -> [[f64; 3]; 3] {
    let mut columns = [[0.0; 3]; 3];
    for (position, slopes) in positions.iter().zip(slopes).skip(1) {
        let edge = sub(*position, positions[0]);
        for (column, slope) in columns.iter_mut().zip(slopes) {
            *column = std::array::from_fn(|i| column[i] + slope * edge[i]);
        }
    }
    if info.dimension == 2 {
        columns[2] = [0.0, 0.0, 1.0];
    }
    columns
}

/// The quadrature points of an element at rest; a degenerate element has infinite or NaN entries.
pub(super) fn rest(info: &ElementInfo, positions: &[[f64; 3]]) -> Vec<RestPoint<f64>> {
    if info.is_linear_simplex {
        let shape = shape_gradients(&std::array::from_fn(|a| positions[a]));
        let rows = shape.gradients.as_flattened();
        return vec![RestPoint { inverse_jacobian: std::array::from_fn(|k| rows[k]), weight: shape.volume }];
    }
    let of = |point: &ReferencePoint| {
        let [a, b, c] = jacobian(info, point.gradients, positions);
        let det = dot(a, cross(b, c));
        let rows = [cross(b, c), cross(c, a), cross(a, b)];
        let rows = rows.as_flattened();
        RestPoint { inverse_jacobian: std::array::from_fn(|k| rows[k] / det), weight: det * point.weight }
    };
    info.points.iter().map(of).collect()
}

/// The volume that each point of a rule of masses stands for, with the slopes of the functions there.
pub(crate) fn point_volumes<'a>(
    info: &'a ElementInfo,
    slopes: &'a [Vec<[f64; 3]>],
    positions: &'a [[f64; 3]],
) -> impl Iterator<Item = f64> + 'a {
    info.mass_rule.iter().zip(slopes).map(|((_, weight), slopes)| {
        let [a, b, c] = jacobian(info, slopes, positions);
        dot(a, cross(b, c)) * weight
    })
}

/// The derivatives of the position by the two reference coordinates of a face, from the derivatives of its functions.
pub fn tangents(slopes: &[[f64; 3]], positions: &[[f64; 3]]) -> [[f64; 3]; 2] {
    // From one node on: a face far from the origin loses no digits.
    let along = |k: usize, i: usize| -> f64 {
        slopes.iter().zip(positions).map(|(s, x)| s[k] * (x[i] - positions[0][i])).sum()
    };
    [0, 1].map(|k| std::array::from_fn(|i| along(k, i)))
}

/// The integral of each node's function over a face (m2), or over an edge of a plane body (m, which is m2 of unit
/// thickness).
pub fn integrals(info: &ElementInfo, positions: &[[f64; 3]]) -> Vec<f64> {
    let mut integrals = vec![0.0; info.nodes];
    for point in info.points {
        let [a, b, _] = jacobian(info, point.gradients, positions);
        let scale = if info.dimension == 2 { norm(cross(a, b)) } else { norm(a) };
        for (integral, function) in integrals.iter_mut().zip(point.functions) {
            *integral += function * scale * point.weight;
        }
    }
    integrals
}

/// The order of nodes of an element mirrored: that of the node at each node's place with x and y swapped.
pub(super) fn mirrored(info: &ElementInfo) -> Vec<usize> {
    let place = |x: &[f64; 3]| {
        let swapped = [x[1], x[0], x[2]];
        // Simplices and boxes are symmetric, and so are the nodes of every element on them.
        info.reference.iter().position(|y| *y == swapped).unwrap_or(0)
    };
    info.reference.iter().map(place).collect()
}

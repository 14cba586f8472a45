//! Which motions of an element its quadrature sees: only rigid ones may be without strain at all points.
//!
//! A rule with too few points leaves others (hourglass modes; Belytschko, Liu, Moran & Elkhodary, Nonlinear Finite Elements
//! for Continua and Structures, 2nd ed., 2014, section 8.7), which no law resists.

use super::ElementDeclaration;

/// A pivot below this part of the greatest is rounding: slopes are sums of some tens of terms near 1.
const ROUNDING: f64 = 1e-9;

/// Independent motions of the reference element that are not rigid, and without strain at every quadrature point.
pub(super) fn hourglass_modes(element: &ElementDeclaration) -> usize {
    let dimension = element.shape.dimension();
    let motions = dimension * element.nodes.len();
    let rigid = dimension * (dimension + 1) / 2;
    (motions - rigid).saturating_sub(rank(strains(element, dimension)))
}

/// A row for each component of eps = (G + G') / 2 at each point, doubled, a column for each component of each node.
fn strains(element: &ElementDeclaration, dimension: usize) -> Vec<Vec<f64>> {
    let mut rows = vec![];
    for x in &element.quadrature.points {
        let slopes: Vec<Vec<f64>> =
            element.functions.iter().map(|f| (0..dimension).map(|k| f.derivative(k).at_f64(x)).collect()).collect();
        for i in 0..dimension {
            for k in 0..=i {
                let mut row = vec![0.0; dimension * slopes.len()];
                for (node, slope) in slopes.iter().enumerate() {
                    row[dimension * node + i] += slope[k];
                    row[dimension * node + k] += slope[i];
                }
                rows.push(row);
            }
        }
    }
    rows
}

/// The rank of a matrix, by elimination with complete pivoting.
fn rank(mut rows: Vec<Vec<f64>>) -> usize {
    let largest = rows.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut rank = 0;
    while rank < rows.len() {
        let entries = rows.iter().enumerate().skip(rank);
        let entries = entries.flat_map(|(i, row)| row.iter().enumerate().map(move |(k, x)| (x.abs(), i, k)));
        let Some((size, i, k)) = entries.max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        if size <= ROUNDING * largest {
            break;
        }
        rows.swap(rank, i);
        let pivot = rows[rank].clone();
        for row in &mut rows[rank + 1..] {
            let factor = row[k] / pivot[k];
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
            row[k] = 0.0;
        }
        rank += 1;
    }
    rank
}

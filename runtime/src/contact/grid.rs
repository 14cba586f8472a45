//! The distance from a solid on a regular grid, for devices that cannot search its triangles.
//!
//! Between the grid's points distances are trilinear, and the normal is their gradient's direction. Edges and corners of the
//! solid are rounded off by a part of a cell.

use rayon::prelude::*;

use super::shape::Nearest;
use super::solid::Solid;
use crate::backend::Scalar;

/// Cells beyond the solid on each side.
const MARGIN: f64 = 2.0;

/// Distances at points `low + cell [i, j, k]`, the first index running fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    low: [f64; 3],
    cell: f64,
    counts: [u32; 3],
    values: Vec<f32>,
    reach: f64,
    error: f64,
}

impl Grid {
    /// The grid of a solid, with as many cells as that says.
    pub fn bake(solid: &Solid) -> Self {
        let [low, high] = solid.bounds();
        let longest = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
        let cell = longest / f64::from(solid.cells());
        let counts: [u32; 3] =
            std::array::from_fn(|i| ((high[i] - low[i]) / cell).ceil() as u32 + 2 * MARGIN as u32 + 1);
        let low: [f64; 3] = std::array::from_fn(|i| {
            // The solid in the middle of whole cells.
            0.5 * (low[i] + high[i]) - 0.5 * cell * f64::from(counts[i] - 1)
        });
        let [nx, ny, nz] = counts.map(|n| n as usize);
        let values = (0..nx * ny * nz)
            .into_par_iter()
            .map(|k| {
                let index = [k % nx, k / nx % ny, k / (nx * ny)];
                solid.nearest(std::array::from_fn(|i| low[i] + cell * index[i] as f64)).distance as f32
            })
            .collect();
        let mut grid = Self { low, cell, counts, values, reach: solid.reach(), error: 0.0 };
        let places = solid.vertices().chain(solid.middles());
        grid.error = places.map(|x| grid.nearest(x).distance.abs()).fold(0.0, f64::max);
        grid
    }

    /// Its surface seen from a point.
    pub fn nearest(&self, point: [f64; 3]) -> Nearest<f64> {
        self.nearest_by(point, |place| {
            let index: [usize; 3] =
                std::array::from_fn(|i| (place[i].floor().max(0.0) as usize).min(self.counts[i] as usize - 2));
            let [nx, ny] = [self.counts[0] as usize, self.counts[1] as usize];
            let first = index[0] + nx * (index[1] + ny * index[2]);
            let corner = |k: usize| first + (k & 1) + nx * (k >> 1 & 1) + nx * ny * (k >> 2);
            let values = std::array::from_fn(|k| f64::from(self.values[corner(k)]));
            (std::array::from_fn(|i| place[i] - index[i] as f64), values)
        })
    }

    /// Its surface seen from a point, where `cell` gives, for a place counted in cells, the place within its cell and the values
    /// at the cell's corners: of corner k those of the bits of k, the first for x.
    pub fn nearest_by<S: Scalar>(&self, point: [S; 3], cell: impl FnOnce([S; 3]) -> ([S; 3], [S; 8])) -> Nearest<S> {
        let [zero, one] = [0.0, 1.0].map(S::number);
        // The point of the grid that is nearest.
        let within: [S; 3] = std::array::from_fn(|i| {
            let high = self.low[i] + self.cell * f64::from(self.counts[i] - 1);
            point[i].max(S::number(self.low[i])).min(S::number(high))
        });
        let (at, values) = cell(std::array::from_fn(|i| (within[i] - S::number(self.low[i])) / S::number(self.cell)));
        // Values on the sides across x, then on those edges across y; with how they grow along the others.
        let mix = |a: S, b: S, t: S| a + t * (b - a);
        let x: [S; 4] = std::array::from_fn(|k| mix(values[2 * k], values[2 * k + 1], at[0]));
        let dx: [S; 4] = std::array::from_fn(|k| values[2 * k + 1] - values[2 * k]);
        let xy: [S; 2] = std::array::from_fn(|k| mix(x[2 * k], x[2 * k + 1], at[1]));
        let distance = mix(xy[0], xy[1], at[2]);
        let slope = [
            mix(mix(dx[0], dx[1], at[1]), mix(dx[2], dx[3], at[1]), at[2]),
            mix(x[1] - x[0], x[3] - x[2], at[2]),
            xy[1] - xy[0],
        ];
        let length = |x: [S; 3]| x.iter().fold(zero, |sum, x| sum + *x * *x).sqrt();
        let steep = length(slope);
        let divisor = S::select_greater(steep, zero, steep, one);
        let up = [zero, zero, one];
        let normal: [S; 3] = std::array::from_fn(|i| S::select_greater(steep, zero, slope[i] / divisor, up[i]));
        // Beyond the grid nothing of the solid is nearer than by both: it lies on one side of the grid's face.
        let over: [S; 3] = std::array::from_fn(|i| point[i] - within[i]);
        let outside = length(over);
        let far = (outside * outside + distance * distance).sqrt();
        let away: [S; 3] = std::array::from_fn(|i| over[i] + distance * normal[i]);
        let divisor = length(away);
        let divisor = S::select_greater(divisor, zero, divisor, one);
        Nearest {
            normal: std::array::from_fn(|i| S::select_greater(outside, zero, away[i] / divisor, normal[i])),
            distance: S::select_greater(outside, zero, far, distance),
        }
    }

    /// How far from the origin a point of the solid may be.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The length of a cell's edge.
    pub fn cell(&self) -> f64 {
        self.cell
    }

    /// Points along x, y, z.
    pub fn counts(&self) -> [u32; 3] {
        self.counts
    }

    /// The distances.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// How far its surface is from the solid's vertices and the middles of its triangles, at most.
    pub fn error(&self) -> f64 {
        self.error
    }
}

//! Displacement gradients at the quadrature points of a body, and small symmetric tensors made of them.

use nalgebra::Matrix3;

use crate::body::{Body, LawBatch};

/// Calls `visit` with the displacement gradient du_i/dX_k (row by row) and the volume of each quadrature point of an element.
pub(super) fn each_point(
    body: &Body,
    batch: &LawBatch,
    element: u32,
    u: &[[f64; 3]],
    mut visit: impl FnMut(&[f64; 9], f64),
) {
    let (info, nodes) = (batch.element.info, &body.elements[element as usize]);
    let first = u[nodes[0] as usize];
    for (at, rest) in info.points.iter().zip(&body.rest[element as usize]) {
        let mut g = [0.0; 9];
        for (node, slopes) in nodes.iter().zip(at.gradients).skip(1) {
            // Differences first: the motion of the whole has no digits to spare.
            let u = u[*node as usize];
            let by: [f64; 3] = std::array::from_fn(|i| u[i] - first[i]);
            for k in 0..3 {
                let slope: f64 = (0..info.dimension).map(|a| slopes[a] * rest.inverse_jacobian[3 * a + k]).sum();
                (0..3).for_each(|i| g[3 * i + k] += by[i] * slope);
            }
        }
        visit(&g, rest.weight);
    }
}

/// A symmetric tensor: 11, 22, 33, 12, 23, 13.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Symmetric(pub(super) [f64; 6]);

/// Rows and columns of the components.
const PLACES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

impl Symmetric {
    /// G + G', twice the small strain.
    pub(super) fn twice_small_strain(g: &[f64; 9]) -> Self {
        Self(PLACES.map(|(i, k)| g[3 * i + k] + g[3 * k + i]))
    }

    /// G'G.
    pub(super) fn square(g: &[f64; 9]) -> Self {
        Self(PLACES.map(|(i, k)| g[i] * g[k] + g[3 + i] * g[3 + k] + g[6 + i] * g[6 + k]))
    }

    /// The sum of two.
    pub(super) fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }

    /// The root of the sum of all squared components.
    pub(super) fn norm(&self) -> f64 {
        let [a, b, c, d, e, f] = self.0;
        (a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f)).sqrt()
    }

    /// Numbers between which all eigenvalues are: the mean and what the deviator's norm allows, 2/3 of its square.
    pub(super) fn bounds(&self) -> [f64; 2] {
        let [a, b, c, d, e, f] = self.0;
        let mean = (a + b + c) / 3.0;
        let deviator = Self([a - mean, b - mean, c - mean, d, e, f]).norm();
        let most = deviator * (2.0_f64 / 3.0).sqrt();
        [mean - most, mean + most]
    }

    /// The least and the greatest eigenvalue.
    pub(super) fn extremes(&self) -> [f64; 2] {
        let [a, b, c, d, e, f] = self.0;
        let values = Matrix3::new(a, d, f, d, b, e, f, e, c).symmetric_eigenvalues();
        [values.min(), values.max()]
    }
}

/// det F.
pub(super) fn volume_ratio(g: &[f64; 9]) -> f64 {
    let [a, b, c, d, e, f, i, j, k] = *g;
    Matrix3::new(1.0 + a, b, c, d, 1.0 + e, f, i, j, 1.0 + k).determinant()
}

/// Sine and cosine of the angle of the rotation in F, up to a common factor: exact where F is a rotation.
pub(super) fn turn(g: &[f64; 9]) -> [f64; 2] {
    let axial = [g[7] - g[5], g[2] - g[6], g[3] - g[1]];
    [axial.iter().map(|x| x * x).sum::<f64>().sqrt(), 2.0 + g[0] + g[4] + g[8]]
}

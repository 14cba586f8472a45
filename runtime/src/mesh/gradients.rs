//! Shape gradients of the linear tetrahedron.

/// The constant gradients of the interpolation functions Lambda_j of a P1 tetrahedron.
///
/// `G = sum_j u_j (x) grad Lambda_j`, with `sum_j grad Lambda_j = 0` (Faure et al. 2012, eq. 6, with the sign and the
/// factor 1/(6V) that the printed equation lacks).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeGradients {
    /// grad Lambda_1, grad Lambda_2, grad Lambda_3, in 1/m; grad Lambda_0 is minus their sum.
    pub gradients: [[f64; 3]; 3],
    /// The signed rest volume, m3.
    pub volume: f64,
}

impl ShapeGradients {
    /// All four gradients, in 1/m.
    pub fn all(&self) -> [[f64; 3]; 4] {
        let [g1, g2, g3] = self.gradients;
        [[0, 1, 2].map(|c| -(g1[c] + g2[c] + g3[c])), g1, g2, g3]
    }
}

/// The gradients and the volume of the tetrahedron with these corners (m): the rows of the inverse of the matrix whose
/// columns are the edges from corner 0.
///
/// Edges are differences of positions, taken first: far from the origin nothing more is lost than the positions
/// themselves have lost. A flat tetrahedron gives infinite or NaN gradients; a [`Mesh`](super::Mesh) has none.
pub fn shape_gradients(corners: &[[f64; 3]; 4]) -> ShapeGradients {
    let [e1, e2, e3] = edges(corners);
    let det = determinant(&[e1, e2, e3]);
    let rows = [cross(e2, e3), cross(e3, e1), cross(e1, e2)];
    ShapeGradients { gradients: rows.map(|row| row.map(|x| x / det)), volume: det / 6.0 }
}

/// Six times the signed volume of the tetrahedron with these corners.
pub(super) fn six_volumes(corners: &[[f64; 3]; 4]) -> f64 {
    determinant(&edges(corners))
}

/// The edges from corner 0 to corners 1, 2 and 3.
pub(super) fn edges(corners: &[[f64; 3]; 4]) -> [[f64; 3]; 3] {
    [1, 2, 3].map(|a| sub(corners[a], corners[0]))
}

/// The determinant of the matrix with these rows (or columns).
pub(super) fn determinant([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    dot(*a, cross(*b, *c))
}

pub(super) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

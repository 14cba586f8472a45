//! Whether a point is inside a body.

use nalgebra::{Matrix3, Vector3};
use tensormass_kernels::ElementInfo;

use super::Mesh;

impl Mesh {
    /// Whether a point (m) is inside the body, whose curved faces are taken as flat; nothing is inside a plane body.
    ///
    /// It is where the faces of the boundary fill the view around it: 4 pi, and 0 from outside (the solid angle of a triangle
    /// is that of van Oosterom and Strackee 1983).
    pub fn encloses(&self, point: [f64; 3]) -> bool {
        let mut angle = 0.0;
        for face in self.boundary() {
            let nodes = self.face_nodes(face);
            let seen: Vec<Vector3<f64>> = corners(self.face_kind(face))
                .iter()
                .map(|corner| Vector3::from(self.nodes()[nodes[*corner].index()]) - Vector3::from(point))
                .collect();
            for k in 2..seen.len() {
                angle += solid_angle([seen[0], seen[k - 1], seen[k]]);
            }
        }
        angle > std::f64::consts::TAU
    }
}

/// The solid angle of a triangle whose corners are at these places, negative from behind.
fn solid_angle([a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let volume = Matrix3::from_columns(&[a, b, c]).determinant();
    let [x, y, z] = [a.norm(), b.norm(), c.norm()];
    2.0 * volume.atan2(x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y)
}

/// The nodes at the corners of a face, one after the other around it; none of an edge.
fn corners(face: &ElementInfo) -> Vec<usize> {
    let around: &[[f64; 3]] = match face.shape {
        "triangle" => &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        "quadrangle" => &[[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
        _ => &[],
    };
    around.iter().filter_map(|corner| face.reference.iter().position(|x| x == corner)).collect()
}

//! Which element a point of the body at rest is in, and where in it.

use nalgebra::{Matrix3, Vector3};
use tensormass_kernels::ElementInfo;

use super::map::jacobian;
use super::{ElementId, Mesh};

/// Newton's steps to the reference coordinates of a point, at most: one for elements with straight parallel edges.
const STEPS: usize = 30;
/// A point so far outside an element is in it, as a part of its reference shape: coordinates are rounded.
const ROUNDED: f64 = 1e-9;

/// A material point: an element, and how its gradient of the displacement follows from that of its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialPoint {
    /// The element, the first of those that share the point.
    pub element: ElementId,
    /// The gradient of each node's function, 1/m.
    pub gradients: Vec<[f64; 3]>,
}

impl MaterialPoint {
    /// The displacement gradient du_i/dX_k there, row by row; displacements are given at all nodes of the mesh, m.
    pub fn displacement_gradient(&self, mesh: &Mesh, u: &[[f64; 3]]) -> [f64; 9] {
        let nodes = mesh.element_nodes(self.element);
        let first = u[nodes[0].index()];
        let mut g = [0.0; 9];
        for (node, slope) in nodes.iter().zip(&self.gradients).skip(1) {
            for k in 0..9 {
                g[k] += (u[node.index()][k / 3] - first[k / 3]) * slope[k % 3];
            }
        }
        g
    }
}

impl Mesh {
    /// The material point at a position at rest (m); none where no element is. In plane bodies z does not matter.
    pub fn material_point(&self, position: [f64; 3]) -> Option<MaterialPoint> {
        self.elements().find_map(|element| {
            let info = self.kind(element).info;
            let corners = self.positions(self.element_nodes(element));
            let near = (0..info.dimension).all(|c| {
                let of = corners.iter().map(|x| x[c]);
                let (low, high) = of.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
                // Curved sides go beyond their nodes.
                let room = 0.25 * (high - low);
                (low - room..=high + room).contains(&position[c])
            });
            let gradients = near.then(|| gradients_at(info, &corners, position)).flatten()?;
            Some(MaterialPoint { element, gradients })
        })
    }
}

/// The gradients of an element's functions at a position, if it is inside.
fn gradients_at(info: &ElementInfo, corners: &[[f64; 3]], position: [f64; 3]) -> Option<Vec<[f64; 3]>> {
    let count = info.nodes as f64;
    let mut xi: [f64; 3] = std::array::from_fn(|c| info.reference.iter().map(|x| x[c]).sum::<f64>() / count);
    let wanted = Vector3::from(position) - Vector3::from(corners[0]);
    for _ in 0..STEPS {
        let (values, slopes) = info.functions_at(xi);
        let inverse = Matrix3::from_columns(&jacobian(info, &slopes, corners).map(Vector3::from)).try_inverse()?;
        let here: Vector3<f64> = corners
            .iter()
            .zip(&values)
            .map(|(x, value)| (Vector3::from(*x) - Vector3::from(corners[0])) * *value)
            .sum();
        let mut way = inverse * (wanted - here);
        if info.dimension == 2 {
            way.z = 0.0;
        }
        (0..3).for_each(|c| xi[c] += way[c]);
        if way.norm() <= 1e-14 {
            break;
        }
    }
    if !is_inside(info, xi) {
        return None;
    }
    let (_, slopes) = info.functions_at(xi);
    let inverse = Matrix3::from_columns(&jacobian(info, &slopes, corners).map(Vector3::from)).try_inverse()?;
    Some(slopes.iter().map(|slope| (Vector3::from(*slope).transpose() * inverse).transpose().into()).collect())
}

/// Whether reference coordinates are in an element's shape.
fn is_inside(info: &ElementInfo, xi: [f64; 3]) -> bool {
    let within = |c: usize| {
        let of = info.reference.iter().map(|x| x[c]);
        let (low, high) = of.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        (low - ROUNDED..=high + ROUNDED).contains(&xi[c])
    };
    // Of simplices the coordinates' sum is at most 1.
    let simplex = match info.shape {
        "tetrahedron" => 3,
        "triangle" | "prism" => 2,
        _ => 0,
    };
    (0..info.dimension).all(within) && (simplex == 0 || xi[..simplex].iter().sum::<f64>() <= 1.0 + ROUNDED)
}

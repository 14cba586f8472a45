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
    /// The value of each node's function.
    pub functions: Vec<f64>,
    /// The gradient of each node's function, 1/m.
    pub gradients: Vec<[f64; 3]>,
}

impl MaterialPoint {
    /// The displacement there; displacements are given at all nodes of the mesh.
    pub fn displacement(&self, mesh: &Mesh, u: &[[f64; 3]]) -> [f64; 3] {
        let nodes = mesh.element_nodes(self.element);
        std::array::from_fn(|i| nodes.iter().zip(&self.functions).map(|(node, value)| value * u[node.index()][i]).sum())
    }

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
    /// The material point at a position at rest (m); none where no element is. In plane bodies z does not matter. For many points
    /// a [`Locator`] is faster.
    pub fn material_point(&self, position: [f64; 3]) -> Option<MaterialPoint> {
        self.elements().find_map(|element| self.point_in(element, position, ROUNDED))
    }

    /// The material point of an element at a position, if it is no farther outside than a part of the reference shape.
    fn point_in(&self, element: ElementId, position: [f64; 3], outside: f64) -> Option<MaterialPoint> {
        let info = self.kind(element).info;
        let [low, high] = self.room_of(element);
        let near = (0..info.dimension).all(|c| (low[c]..=high[c]).contains(&position[c]));
        let corners = near.then(|| self.positions(self.element_nodes(element)))?;
        let (functions, gradients) = functions_at(info, &corners, position, outside)?;
        Some(MaterialPoint { element, functions, gradients })
    }

    /// A box in which an element is: curved sides go beyond their nodes.
    fn room_of(&self, element: ElementId) -> [[f64; 3]; 2] {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for node in self.element_nodes(element) {
            let x = self.nodes()[node.index()];
            (0..3).for_each(|c| (low[c], high[c]) = (low[c].min(x[c]), high[c].max(x[c])));
        }
        let room: [f64; 3] = std::array::from_fn(|c| 0.25 * (high[c] - low[c]));
        [std::array::from_fn(|c| low[c] - room[c]), std::array::from_fn(|c| high[c] + room[c])]
    }
}

/// Finds the elements of a mesh by cells of a regular grid.
#[derive(Debug)]
pub struct Locator<'a> {
    mesh: &'a Mesh,
    low: [f64; 3],
    cell: [f64; 3],
    counts: [usize; 3],
    /// The elements whose boxes meet each cell, ascending.
    elements: Vec<Vec<ElementId>>,
}

impl<'a> Locator<'a> {
    /// About as many cells as elements.
    pub fn new(mesh: &'a Mesh) -> Self {
        let [low, high] = mesh.bounding_box();
        let size: [f64; 3] = std::array::from_fn(|c| high[c] - low[c]);
        let extended: Vec<f64> = size.iter().copied().filter(|x| *x > 0.0).collect();
        let each = (extended.iter().product::<f64>() / mesh.len() as f64).powf(1.0 / extended.len().max(1) as f64);
        let counts = size.map(|x| ((x / each).ceil() as usize).clamp(1, 1024));
        let cell = std::array::from_fn(|c| if size[c] > 0.0 { size[c] / counts[c] as f64 } else { 1.0 });
        let mut locator = Self { mesh, low, cell, counts, elements: vec![vec![]; counts.iter().product()] };
        for element in mesh.elements() {
            let [first, last] = mesh.room_of(element).map(|corner| locator.cell_of(corner));
            for k in first[2]..=last[2] {
                for j in first[1]..=last[1] {
                    for i in first[0]..=last[0] {
                        locator.elements[i + counts[0] * (j + counts[1] * k)].push(element);
                    }
                }
            }
        }
        locator
    }

    fn cell_of(&self, position: [f64; 3]) -> [usize; 3] {
        std::array::from_fn(|c| {
            let place = ((position[c] - self.low[c]) / self.cell[c]).max(0.0) as usize;
            place.min(self.counts[c] - 1)
        })
    }

    /// As [`Mesh::material_point`]. Where no element is, that of the element to which it is nearest, up to a quarter of its size
    /// beyond: surfaces of two meshes of one body differ.
    pub fn find(&self, position: [f64; 3]) -> Option<MaterialPoint> {
        let [i, j, k] = self.cell_of(position);
        let near = &self.elements[i + self.counts[0] * (j + self.counts[1] * k)];
        [ROUNDED, 1e-3, 1e-2, 0.1, 0.25]
            .into_iter()
            .find_map(|outside| near.iter().find_map(|e| self.mesh.point_in(*e, position, outside)))
    }
}

/// An element's functions and their gradients at a position, if it is no farther outside than this.
fn functions_at(
    info: &ElementInfo,
    corners: &[[f64; 3]],
    position: [f64; 3],
    outside: f64,
) -> Option<(Vec<f64>, Vec<[f64; 3]>)> {
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
    if !is_inside(info, xi, outside) {
        return None;
    }
    let (values, slopes) = info.functions_at(xi);
    let inverse = Matrix3::from_columns(&jacobian(info, &slopes, corners).map(Vector3::from)).try_inverse()?;
    let gradient = |slope: &[f64; 3]| (Vector3::from(*slope).transpose() * inverse).transpose().into();
    Some((values, slopes.iter().map(gradient).collect()))
}

/// Whether reference coordinates are in an element's shape, or no farther outside than this.
fn is_inside(info: &ElementInfo, xi: [f64; 3], outside: f64) -> bool {
    let within = |c: usize| {
        let of = info.reference.iter().map(|x| x[c]);
        let (low, high) = of.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        (low - outside..=high + outside).contains(&xi[c])
    };
    // Of simplices the coordinates' sum is at most 1.
    let simplex = match info.shape {
        "tetrahedron" => 3,
        "triangle" | "prism" => 2,
        _ => 0,
    };
    (0..info.dimension).all(within) && (simplex == 0 || xi[..simplex].iter().sum::<f64>() <= 1.0 + outside)
}

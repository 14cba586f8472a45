//! Mesh quality: how small and how distorted the elements are.
//!
//! A tetrahedron is measured between its corners, any other element by J at its quadrature points, as the parallelepiped
//! that its reference shape becomes there.

use super::gradients::{cross, dot, edges, norm, six_volumes, sub};
use super::map;
use super::topology::{ElementId, Mesh};
use std::fmt;

/// Extremes over the elements of a mesh. Its `Display` takes two lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Volume of the smallest element, m3.
    pub min_volume: f64,
    /// Volume of the largest element, m3.
    pub max_volume: f64,
    /// Least altitude (distance of a node to its opposite face), m. It bounds the explicit time step only roughly.
    pub min_altitude: f64,
    /// Least angle between two faces, degrees.
    pub min_dihedral: f64,
    /// Greatest angle between two faces, degrees.
    pub max_dihedral: f64,
    /// Least radius ratio: 3 x inscribed / circumscribed radius; 1 for a regular tetrahedron, 0 for a flat one. Of other
    /// elements det J over the product of the lengths of its columns: 1 for a box.
    pub worst_radius_ratio: f64,
    /// The (first) element with that radius ratio.
    pub worst_element: ElementId,
}

/// The faces of a tetrahedron by its corners; face `a` is opposite to corner `a`, its normal points outward.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

impl Quality {
    /// The quality of a mesh.
    pub fn of(mesh: &Mesh) -> Quality {
        let mut quality = Quality {
            min_volume: f64::INFINITY,
            max_volume: 0.0,
            min_altitude: f64::INFINITY,
            min_dihedral: 180.0,
            max_dihedral: 0.0,
            worst_radius_ratio: f64::INFINITY,
            worst_element: ElementId(0),
        };
        for element in mesh.elements() {
            let info = mesh.kind(element).info;
            let positions = mesh.positions(mesh.element_nodes(element));
            let volume = mesh.volume(element);
            quality.min_volume = quality.min_volume.min(volume);
            quality.max_volume = quality.max_volume.max(volume);
            if info.shape == "tetrahedron" {
                // Its corners come first.
                quality.tetrahedron(element, &std::array::from_fn(|a| positions[a]));
                continue;
            }
            for point in info.points {
                quality.parallelepiped(element, map::jacobian(info, point.gradients, &positions), info.dimension);
            }
        }
        quality
    }

    fn distorted(&mut self, element: ElementId, ratio: f64) {
        if ratio < self.worst_radius_ratio {
            self.worst_radius_ratio = ratio;
            self.worst_element = element;
        }
    }

    fn angle(&mut self, degrees: f64) {
        self.min_dihedral = self.min_dihedral.min(degrees);
        self.max_dihedral = self.max_dihedral.max(degrees);
    }

    /// What the box from -1 to 1 becomes under J.
    fn parallelepiped(&mut self, element: ElementId, columns: [[f64; 3]; 3], dimension: usize) {
        let [a, b, c] = columns;
        let normals = [cross(b, c), cross(c, a), cross(a, b)];
        let det = dot(a, normals[0]);
        for (k, normal) in normals.iter().enumerate().take(dimension) {
            self.min_altitude = self.min_altitude.min(2.0 * det / norm(*normal));
            for other in &normals[..k] {
                let angle = norm(cross(*normal, *other)).atan2(dot(*normal, *other)).to_degrees();
                self.angle(angle);
                self.angle(180.0 - angle);
            }
        }
        self.distorted(element, det / columns.iter().map(|column| norm(*column)).product::<f64>());
    }

    fn tetrahedron(&mut self, element: ElementId, corners: &[[f64; 3]; 4]) {
        let volume = six_volumes(corners) / 6.0;

        // Outward normals with the length of twice the face's area.
        let normals = FACES.map(|[a, b, c]| cross(sub(corners[b], corners[a]), sub(corners[c], corners[a])));
        let areas = normals.map(|normal| norm(normal) / 2.0);
        for area in areas {
            self.min_altitude = self.min_altitude.min(3.0 * volume / area);
        }
        for a in 0..4 {
            for b in a + 1..4 {
                // atan2 keeps its digits at angles near 0 and 180 degrees, where acos loses half of them.
                let angle = norm(cross(normals[a], normals[b])).atan2(-dot(normals[a], normals[b])).to_degrees();
                self.angle(angle);
            }
        }

        let [e1, e2, e3] = edges(corners);
        let (q1, q2, q3) = (dot(e1, e1), dot(e2, e2), dot(e3, e3));
        let (c1, c2, c3) = (cross(e2, e3), cross(e3, e1), cross(e1, e2));
        let circumradius = norm([0, 1, 2].map(|c| q1 * c1[c] + q2 * c2[c] + q3 * c3[c])) / (12.0 * volume);
        let inradius = 3.0 * volume / areas.iter().sum::<f64>();
        let ratio = 3.0 * inradius / circumradius;
        self.distorted(element, ratio);
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "element volumes {:.3e} to {:.3e} m3, least altitude {:.3e} m",
            self.min_volume, self.max_volume, self.min_altitude
        )?;
        write!(
            f,
            "dihedral angles {:.1} to {:.1} degrees, worst radius ratio {:.3} (1 is regular) in element {}",
            self.min_dihedral, self.max_dihedral, self.worst_radius_ratio, self.worst_element
        )
    }
}

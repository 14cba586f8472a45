//! Mesh quality: how small and how distorted the elements are.

use super::gradients::{cross, dot, edges, norm, sub};
use super::tet_mesh::{ElementId, FACES, TetMesh};
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
    /// Least radius ratio: 3 x inscribed / circumscribed radius; 1 for a regular tetrahedron, 0 for a flat one.
    pub worst_radius_ratio: f64,
    /// The (first) element with that radius ratio.
    pub worst_element: ElementId,
}

impl Quality {
    /// The quality of a mesh.
    pub fn of(mesh: &TetMesh) -> Quality {
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
            quality.include(element, mesh.volume(element), &mesh.corners(element));
        }
        quality
    }

    fn include(&mut self, element: ElementId, volume: f64, corners: &[[f64; 3]; 4]) {
        self.min_volume = self.min_volume.min(volume);
        self.max_volume = self.max_volume.max(volume);

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
                self.min_dihedral = self.min_dihedral.min(angle);
                self.max_dihedral = self.max_dihedral.max(angle);
            }
        }

        let [e1, e2, e3] = edges(corners);
        let (q1, q2, q3) = (dot(e1, e1), dot(e2, e2), dot(e3, e3));
        let (c1, c2, c3) = (cross(e2, e3), cross(e3, e1), cross(e1, e2));
        let circumradius = norm([0, 1, 2].map(|c| q1 * c1[c] + q2 * c2[c] + q3 * c3[c])) / (12.0 * volume);
        let inradius = 3.0 * volume / areas.iter().sum::<f64>();
        let ratio = 3.0 * inradius / circumradius;
        if ratio < self.worst_radius_ratio {
            self.worst_radius_ratio = ratio;
            self.worst_element = element;
        }
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

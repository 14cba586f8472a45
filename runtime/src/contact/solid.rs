//! A solid within a closed surface of triangles: the signed distance of a point, by parry's tree of boxes.

use std::fmt;

use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{TriMesh, TriMeshBuilderError, TriMeshFlags, TrianglePointLocation};

use super::shape::Nearest;

/// Beside an edge or a corner distances below this part of the size have no direction of their own.
const NEAR: f64 = 1e-7;

/// A solid, in a frame of its own.
pub struct Solid {
    mesh: TriMesh,
    /// How far from the origin a point of it may be.
    reach: f64,
    /// Cells of a grid of its distances along its longest side.
    cells: u32,
}

impl Solid {
    /// The solid within a closed surface, whose triangles turn counterclockwise seen from outside; and how many cells its
    /// longest side has where distances are tabulated.
    ///
    /// # Errors
    /// parry refuses the surface.
    pub fn new(
        vertices: impl Iterator<Item = [f64; 3]>,
        triangles: Vec<[u32; 3]>,
        cells: u32,
    ) -> Result<Self, TriMeshBuilderError> {
        let vertices: Vec<Vector> = vertices.map(Vector::from_array).collect();
        let reach = vertices.iter().map(|x| x.length()).fold(0.0, f64::max);
        Ok(Self { mesh: TriMesh::with_flags(vertices, triangles, TriMeshFlags::ORIENTED)?, reach, cells })
    }

    /// Its surface seen from a point. The sign is that of the angle-weighted normal where the surface is nearest (Baerentzen and
    /// Aanaes 2005).
    pub fn nearest(&self, point: [f64; 3]) -> Nearest<f64> {
        let x = Vector::from_array(point);
        let (seen, (triangle, at)) = self.mesh.project_local_point_and_get_location(x, false);
        let face = self.mesh.triangle_normal(triangle).unwrap_or(Vector::Z);
        let away = x - seen.point;
        // Beside a face the distance is that of its plane, which rounds least.
        if let TrianglePointLocation::OnFace(..) = at {
            let distance = face.dot(x - self.mesh.triangle(triangle).a);
            return Nearest { normal: face.to_array(), distance };
        }
        let distance = if seen.is_inside { -away.length() } else { away.length() };
        let normal = if distance.abs() > NEAR * self.reach { away / distance } else { self.normal(triangle, at, face) };
        Nearest { normal: normal.to_array(), distance }
    }

    /// The direction out of it at a side or a corner of a triangle, which has this normal.
    fn normal(&self, triangle: u32, at: TrianglePointLocation, face: Vector) -> Vector {
        let Some(normals) = self.mesh.pseudo_normals() else { return face };
        let normal = match at {
            TrianglePointLocation::OnVertex(k) => {
                let vertex = self.mesh.indices()[triangle as usize][k as usize];
                normals.vertices_pseudo_normal[vertex as usize]
            }
            TrianglePointLocation::OnEdge(k, _) => normals.edges_pseudo_normal[triangle as usize][k as usize],
            TrianglePointLocation::OnFace(..) | TrianglePointLocation::OnSolid => face,
        };
        normal.try_normalize().unwrap_or(face)
    }

    /// How far from the origin a point of it may be.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The least and the greatest coordinates.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let bounds = self.mesh.local_aabb();
        [bounds.mins.to_array(), bounds.maxs.to_array()]
    }

    /// Cells of a grid of its distances along its longest side.
    pub fn cells(&self) -> u32 {
        self.cells
    }

    /// Its vertices.
    pub fn vertices(&self) -> impl Iterator<Item = [f64; 3]> {
        self.mesh.vertices().iter().map(|x| x.to_array())
    }

    /// The middles of its triangles.
    pub fn middles(&self) -> impl Iterator<Item = [f64; 3]> {
        self.mesh.triangles().map(|t| ((t.a + t.b + t.c) / 3.0).to_array())
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        self.mesh.total_memory_size()
    }
}

/// The same triangles.
impl PartialEq for Solid {
    fn eq(&self, other: &Self) -> bool {
        self.mesh.vertices() == other.mesh.vertices()
            && self.mesh.indices() == other.mesh.indices()
            && self.cells == other.cells
    }
}

impl fmt::Debug for Solid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Solid").field("triangles", &self.mesh.indices().len()).field("reach", &self.reach).finish()
    }
}

//! A beam of linear tetrahedra of which one is nearly flat, as a mesh file.

use std::fmt::Write as _;
use std::path::Path;

use tensormass_runtime::mesh::{Mesh, MeshError, beam};

/// Why there is no such mesh.
#[derive(Debug, thiserror::Error)]
pub enum SliverError {
    /// The beam cannot be made.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No node can be moved so without turning another element inside out.
    #[error("no element of the mesh can be squeezed to {0:e} of its height")]
    None(f64),
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] std::io::Error),
}

/// Writes a beam whose lengths are in units of `unit` m, with one element squeezed to this part of its height.
///
/// # Errors
/// See [`SliverError`].
pub fn write(path: &Path, size: [f64; 3], cells: [u32; 3], height: f64, unit: f64) -> Result<(), SliverError> {
    let mesh = squeezed(size, cells, height)?;
    let mut text = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"body\"\n$EndPhysicalNames\n$Nodes\n{}\n",
        mesh.nodes().len()
    );
    for (k, x) in mesh.nodes().iter().enumerate() {
        let [x, y, z] = x.map(|x| x * unit);
        let _ = writeln!(text, "{} {x:?} {y:?} {z:?}", k + 1);
    }
    let _ = write!(text, "$EndNodes\n$Elements\n{}\n", mesh.len());
    for (k, nodes) in mesh.tets().iter().enumerate() {
        let [a, b, c, d] = nodes.map(|n| n.0 + 1);
        let _ = writeln!(text, "{} 4 2 1 1 {a} {b} {c} {d}", k + 1);
    }
    text += "$EndElements\n";
    Ok(std::fs::write(path, text)?)
}

/// The first interior node that can be moved towards a face that it sees, so that all elements keep their orientation.
fn squeezed(size: [f64; 3], cells: [u32; 3], height: f64) -> Result<Mesh, SliverError> {
    let mesh = beam(size, cells.map(|n| n as usize), [0.0; 3])?;
    let surface = mesh.surface_nodes();
    for nodes in mesh.tets() {
        for apex in nodes.iter().filter(|n| !surface.contains(n)) {
            let base: Vec<[f64; 3]> = nodes.iter().filter(|n| *n != apex).map(|n| mesh.nodes()[n.index()]).collect();
            let top = mesh.nodes()[apex.index()];
            let foot = foot([base[0], base[1], base[2]], top);
            let mut moved = mesh.nodes().to_vec();
            moved[apex.index()] = std::array::from_fn(|i| foot[i] + height * (top[i] - foot[i]));
            if let Ok(found) = mesh.moved(moved) {
                return Ok(found);
            }
        }
    }
    Err(SliverError::None(height))
}

/// Where a point is nearest to the plane of a triangle.
fn foot([a, b, c]: [[f64; 3]; 3], x: [f64; 3]) -> [f64; 3] {
    let minus = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - q[i]) };
    let dot = |p: [f64; 3], q: [f64; 3]| -> f64 { (0..3).map(|i| p[i] * q[i]).sum() };
    let (u, v) = (minus(b, a), minus(c, a));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let along = dot(minus(x, a), normal) / dot(normal, normal);
    std::array::from_fn(|i| x[i] - along * normal[i])
}

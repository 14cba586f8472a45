//! Loads as nodal forces: weight, tractions on boundary faces, forces at nodes.

use super::place::Places;
use crate::body::Load;
use crate::history::History;
use crate::mesh::TetMesh;
use crate::scale::Scale;
use crate::scene::{self, Scene, SceneError};

/// The loads of a scene, in scaled units.
pub fn loads(
    scene: &Scene,
    mesh: &TetMesh,
    places: &Places,
    scale: &Scale,
    masses: &[f64],
) -> Result<Vec<Load>, SceneError> {
    let mut loads = Vec::new();
    for (i, load) in scene.load.iter().enumerate() {
        let mut forces = vec![[0.0; 3]; masses.len()];
        let ramp = match load {
            scene::Load::Gravity { acceleration, ramp } => {
                let g = acceleration.map(|a| a / scale.acceleration());
                for (f, m) in forces.iter_mut().zip(masses) {
                    *f = g.map(|g| m * g);
                }
                ramp
            }
            scene::Load::Traction { faces, value, ramp } => {
                let faces = places.faces(scene, &format!("load.{i}.faces"), faces)?;
                let traction = value.map(|t| t / scale.stress);
                for face in faces {
                    let area = area(face.map(|n| mesh.nodes()[n.index()])) / (scale.length * scale.length);
                    for n in face {
                        for c in 0..3 {
                            forces[n.index()][c] += traction[c] * area / 3.0;
                        }
                    }
                }
                ramp
            }
            scene::Load::Force { nodes, value, total, ramp } => {
                let nodes = places.nodes(scene, &format!("load.{i}.nodes"), nodes)?;
                let each = match (value, total) {
                    (Some(value), _) => *value,
                    (None, Some(total)) => total.map(|f| f / nodes.len() as f64),
                    (None, None) => [0.0; 3],
                };
                for n in nodes {
                    for c in 0..3 {
                        forces[n as usize][c] += each[c] / scale.force();
                    }
                }
                ramp
            }
        };
        let history = ramp.as_ref().map_or_else(|| History::constant(1.0), scene::Ramp::table);
        loads.push(Load { forces, history: history.scaled(1.0 / scale.time, 1.0) });
    }
    Ok(loads)
}

/// The area of a triangle.
pub fn area(p: [[f64; 3]; 3]) -> f64 {
    let edge = |a: usize| -> [f64; 3] { std::array::from_fn(|i| p[a][i] - p[0][i]) };
    let (a, b) = (edge(1), edge(2));
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    0.5 * cross.iter().map(|x| x * x).sum::<f64>().sqrt()
}

//! Loads as nodal forces: weight, tractions on boundary faces, forces at nodes.

use super::place::Places;
use crate::body::{Load, PressedFace, Pressure, Rows};
use crate::history::History;
use tensormass_kernels::RestPoint;

use crate::mesh::{self, Mesh};
use crate::scale::Scale;
use crate::scene::{self, Scene, SceneError};

/// The loads of a scene, in scaled units; `weights` as [`weights`] gives them.
pub fn loads(
    scene: &Scene,
    mesh: &Mesh,
    places: &Places,
    scale: &Scale,
    weights: &[f64],
) -> Result<Vec<Load>, SceneError> {
    let mut loads = Vec::new();
    for (i, load) in scene.load.iter().enumerate() {
        let mut forces = vec![[0.0; 3]; weights.len()];
        let ramp = match load {
            scene::Load::Gravity { acceleration, ramp } => {
                let g = acceleration.map(|a| a / scale.acceleration());
                for (f, m) in forces.iter_mut().zip(weights) {
                    *f = g.map(|g| m * g);
                }
                ramp
            }
            scene::Load::Traction { faces, value, ramp } => {
                let faces = places.faces(scene, &format!("load.{i}.faces"), faces)?;
                let traction = value.map(|t| t / scale.stress);
                for face in faces {
                    let nodes = mesh.face_nodes(face);
                    // Edges of a plane body are areas, one metre high.
                    let unit = scale.length * scale.length;
                    for (n, integral) in
                        nodes.iter().zip(mesh::integrals(mesh.face_kind(face), &mesh.positions(&nodes)))
                    {
                        for c in 0..3 {
                            forces[n.index()][c] += traction[c] * integral / unit;
                        }
                    }
                }
                ramp
            }
            // It depends on the displacement: see [`pressures`].
            scene::Load::Pressure { .. } => continue,
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

/// The pressures of a scene, in scaled units.
pub fn pressures(scene: &Scene, mesh: &Mesh, places: &Places, scale: &Scale) -> Result<Vec<Pressure>, SceneError> {
    let mut pressures = vec![];
    for (i, load) in scene.load.iter().enumerate() {
        let scene::Load::Pressure { faces, value, ramp } = load else { continue };
        if mesh.blocks()[0].info().dimension == 2 {
            let reason = "pressure acts on solid bodies, and this one is plane";
            let remedy = "give a traction, or a body of solid elements";
            return Err(SceneError::at(scene.locate(&format!("load.{i}.kind")), reason, remedy));
        }
        let faces = places.faces(scene, &format!("load.{i}.faces"), faces)?;
        let pressed = |face: mesh::FaceId| {
            let (kind, nodes) = (mesh.face_kind(face), mesh.face_nodes(face));
            let scaled: Vec<[f64; 3]> =
                mesh.positions(&nodes).into_iter().map(|x| x.map(|x| x / scale.length)).collect();
            let tangents = kind.points.iter().map(|point| mesh::tangents(point.gradients, &scaled)).collect();
            PressedFace { kind, nodes: nodes.iter().map(|n| n.0).collect(), tangents }
        };
        let history = ramp.as_ref().map_or_else(|| History::constant(1.0), scene::Ramp::table);
        pressures.push(Pressure {
            faces: faces.into_iter().map(pressed).collect(),
            history: history.scaled(1.0 / scale.time, value / scale.stress),
        });
    }
    Ok(pressures)
}

/// What each node bears of a body force of unit acceleration: the integral of its function times the density. Linear
/// functions give a quarter of a tetrahedron's mass to each node; of quadratic ones some corners bear a negative part,
/// other than of a lumped mass.
pub fn weights(mesh: &Mesh, elements: &Rows<u32>, rest: &Rows<RestPoint<f64>>, masses: &[f64]) -> Vec<f64> {
    let mut weights = vec![0.0; mesh.nodes().len()];
    for (e, mass) in mesh.elements().zip(masses) {
        let (info, points) = (mesh.kind(e).info, &rest[e.index()]);
        let volume: f64 = points.iter().map(|p| p.weight).sum();
        for (j, n) in elements[e.index()].iter().enumerate() {
            let part: f64 = points.iter().zip(info.points).map(|(p, at)| p.weight * at.functions[j]).sum();
            weights[*n as usize] += mass * part / volume;
        }
    }
    weights
}

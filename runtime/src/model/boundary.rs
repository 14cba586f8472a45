//! Supports and imposed motion: which components follow which history.

use std::collections::BTreeMap;

use super::place::Places;
use crate::body::Constraint;
use crate::history::History;
use crate::mesh::Mesh;
use crate::scale::Scale;
use crate::scene::{Axis, Boundary, Scene, SceneError};

/// The constrained components, ascending, and the histories that they follow; in scaled units.
pub fn constraints(
    scene: &Scene,
    mesh: &Mesh,
    places: &Places,
    scale: &Scale,
) -> Result<(Vec<Constraint>, Vec<History>), SceneError> {
    let mut motions: Vec<History> = Vec::new();
    // (node, component) -> (motion, boundary)
    let mut found: BTreeMap<(u32, u8), (usize, usize)> = BTreeMap::new();
    for (i, boundary) in scene.boundary.iter().enumerate() {
        let path = format!("boundary.{i}.nodes");
        let nodes = places.nodes(scene, &path, boundary.nodes())?;
        for (component, history) in histories(boundary) {
            let history = history.scaled(1.0 / scale.time, 1.0 / scale.length);
            let motion = number_of(history, &mut motions);
            for &node in &nodes {
                match found.insert((node, component), (motion, i)) {
                    Some((other, first)) if other != motion => {
                        let [x, y, z] = mesh.nodes()[node as usize];
                        let axis = ["x", "y", "z"][component as usize];
                        return Err(SceneError::at(
                            scene.locate(&path),
                            format!(
                                "node {node} at ({x}, {y}, {z}) is already moved differently along {axis} by \
                                 `boundary.{first}`"
                            ),
                            "let the two selections not overlap, or leave one component to one of them",
                        ));
                    }
                    _ => {}
                }
            }
        }
    }
    // Strain is plane: elements of two dimensions resist nothing along z.
    if mesh.blocks()[0].info().dimension == 2 {
        let motion = number_of(History::constant(0.0), &mut motions);
        for node in 0..mesh.nodes().len() as u32 {
            found.entry((node, 2)).or_insert((motion, 0));
        }
    }
    let constraints =
        found.into_iter().map(|((node, component), (motion, _))| Constraint { node, component, motion }).collect();
    Ok((constraints, motions))
}

/// The place of a history among those that are known; it is added if need be.
fn number_of(history: History, motions: &mut Vec<History>) -> usize {
    motions.iter().position(|m| *m == history).unwrap_or_else(|| {
        motions.push(history);
        motions.len() - 1
    })
}

fn histories(boundary: &Boundary) -> Vec<(u8, History)> {
    let index = |axis: Axis| axis.index() as u8;
    match boundary {
        Boundary::Fixed { fix, .. } => fix.iter().map(|&axis| (index(axis), History::constant(0.0))).collect(),
        Boundary::Moved { motion, .. } => [(Axis::X, &motion.x), (Axis::Y, &motion.y), (Axis::Z, &motion.z)]
            .into_iter()
            .filter_map(|(axis, h)| h.as_ref().map(|h| (index(axis), h.table())))
            .collect(),
    }
}

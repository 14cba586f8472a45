//! Supports and imposed motion: which components follow which history.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::place::Places;
use crate::body::Constraint;
use crate::history::History;
use crate::mesh::Mesh;
use crate::scale::Scale;
use crate::scene::{Boundary, Scene, SceneError};

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
        for (component, nodes, motion) in imposed(boundary, &nodes, mesh, scale, &mut motions) {
            for node in nodes {
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

/// Components of nodes, and the motion that they follow, which is added if need be.
fn imposed(
    boundary: &Boundary,
    nodes: &[u32],
    mesh: &Mesh,
    scale: &Scale,
    motions: &mut Vec<History>,
) -> Vec<(u8, Vec<u32>, usize)> {
    let scaled = |history: &History| history.scaled(1.0 / scale.time, 1.0 / scale.length);
    let mut all =
        |component: usize, history: &History| (component as u8, nodes.to_vec(), number_of(scaled(history), motions));
    match boundary {
        Boundary::Fixed { fix, .. } => fix.iter().map(|axis| all(axis.index(), &History::constant(0.0))).collect(),
        Boundary::Moved { motion, .. } => [&motion.x, &motion.y, &motion.z]
            .into_iter()
            .enumerate()
            .filter_map(|(component, h)| h.as_ref().map(|h| all(component, &h.table())))
            .collect(),
        Boundary::Turned { rotate, .. } => {
            let length = rotate.axis.iter().map(|x| x * x).sum::<f64>().sqrt();
            let axis = rotate.axis.map(|x| x / length);
            let angle = rotate.angle.table().scaled(1.0 / scale.time, 1.0);
            let History::Table(angle) = angle else { unreachable!("angles are tables") };
            let angle = Arc::new(angle);
            let of_node = |node: &u32| {
                let at = mesh.nodes()[*node as usize];
                let arm = std::array::from_fn(|i| (at[i] - rotate.centre[i]) / scale.length);
                (*node, History::turn(&angle, axis, arm))
            };
            let mut turned = vec![];
            for (node, histories) in nodes.iter().map(of_node) {
                for (component, history) in histories.into_iter().enumerate() {
                    let motion = match history {
                        // What turns differs from node to node: looking for an equal one would find none.
                        History::Turn { .. } => {
                            motions.push(history);
                            motions.len() - 1
                        }
                        History::Table(_) => number_of(history, motions),
                    };
                    turned.push((component as u8, vec![node], motion));
                }
            }
            turned
        }
    }
}

//! Resolves selections on a mesh: nodes, elements and boundary faces, by place or by group.

use crate::mesh::{ElementId, FaceId, Mesh, NodeId};
use crate::scene::{BoundingBox, Scene, SceneError, Selection, SelectionKind};

/// A mesh with the points that selections test.
pub struct Places<'a> {
    mesh: &'a Mesh,
    bbox: BoundingBox,
}

impl<'a> Places<'a> {
    /// The points of a mesh.
    pub fn new(mesh: &'a Mesh) -> Self {
        let [min, max] = mesh.bounding_box();
        Self { mesh, bbox: BoundingBox { min, max } }
    }

    /// The selected nodes, ascending; at least one.
    pub fn nodes(&self, scene: &Scene, path: &str, selection: &Selection) -> Result<Vec<u32>, SceneError> {
        let group = |name: &str| self.mesh.node_group(name).map(|g| g.iter().map(|n| n.index()).collect());
        let found = selection.select(self.mesh.nodes(), &self.bbox, group);
        let names: Vec<&str> = self.mesh.node_group_names().collect();
        let found = self.some(scene, path, selection, "node", found, &names)?;
        Ok(found.into_iter().map(|n| n as u32).collect())
    }

    /// The selected elements, ascending; at least one.
    pub fn elements(&self, scene: &Scene, path: &str, selection: &Selection) -> Result<Vec<u32>, SceneError> {
        let group =
            |name: &str| self.mesh.element_group(name).map(|g| g.iter().map(|e: &ElementId| e.index()).collect());
        let centroids: Vec<[f64; 3]> = match selection.kind() {
            SelectionKind::All | SelectionKind::Group(_) => vec![[0.0; 3]; self.mesh.len()],
            SelectionKind::Box(_) | SelectionKind::Where(_) => {
                self.mesh.elements().map(|e| centroid(&self.mesh.positions(self.mesh.element_nodes(e)))).collect()
            }
        };
        let found = selection.select(&centroids, &self.bbox, group);
        let names: Vec<&str> = self.mesh.element_group_names().collect();
        let found = self.some(scene, path, selection, "element", found, &names)?;
        Ok(found.into_iter().map(|e| e as u32).collect())
    }

    /// The selected faces of the boundary; at least one.
    pub fn faces(&self, scene: &Scene, path: &str, selection: &Selection) -> Result<Vec<FaceId>, SceneError> {
        let boundary = self.mesh.boundary();
        let nodes: Vec<Vec<NodeId>> = boundary.iter().map(|face| self.mesh.face_nodes(*face)).collect();
        let key = |face: &Vec<NodeId>| {
            let mut k = face.clone();
            k.sort_unstable();
            k
        };
        let group = |name: &str| {
            let members: std::collections::BTreeSet<Vec<NodeId>> =
                self.mesh.face_group(name)?.iter().map(key).collect();
            Some((0..boundary.len()).filter(|&i| members.contains(&key(&nodes[i]))).collect())
        };
        let centroids: Vec<[f64; 3]> = nodes.iter().map(|of| centroid(&self.mesh.positions(of))).collect();
        let found = selection.select(&centroids, &self.bbox, group);
        let names: Vec<&str> = self.mesh.face_group_names().collect();
        let found = self.some(scene, path, selection, "boundary face", found, &names)?;
        Ok(found.into_iter().map(|i| boundary[i]).collect())
    }

    fn some(
        &self,
        scene: &Scene,
        path: &str,
        selection: &Selection,
        what: &str,
        found: Option<Vec<usize>>,
        names: &[&str],
    ) -> Result<Vec<usize>, SceneError> {
        match found {
            Some(found) if !found.is_empty() => Ok(found),
            Some(_) => {
                let [low, high] = self.mesh.bounding_box();
                Err(SceneError::at(
                    scene.locate(path),
                    format!("`{path}` selects no {what}"),
                    format!(
                        "the body lies within x {} .. {}, y {} .. {}, z {} .. {} (m); compare with near(a, b) rather \
                         than exactly",
                        low[0], high[0], low[1], high[1], low[2], high[2]
                    ),
                ))
            }
            None => {
                let name = match selection.kind() {
                    SelectionKind::Group(name) => name.as_str(),
                    SelectionKind::All | SelectionKind::Box(_) | SelectionKind::Where(_) => "",
                };
                let known = if names.is_empty() { "the mesh has none".to_string() } else { names.join(", ") };
                Err(SceneError::at(
                    scene.locate(path),
                    format!("the mesh has no {what} group \"{name}\""),
                    format!("groups of this kind: {known}"),
                ))
            }
        }
    }
}

/// The mean of the nodes.
fn centroid(points: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|i| points.iter().map(|p| p[i]).sum::<f64>() / points.len() as f64)
}

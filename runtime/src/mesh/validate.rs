//! The checks that every mesh passes before it becomes a [`TetMesh`](super::TetMesh).

use super::error::{GroupKind, MeshError};
use super::gradients::{norm, six_volumes, sub};
use super::tet_mesh::{ElementId, Groups, NodeId, Orientation, TetMesh, face_of, sorted};
use std::collections::BTreeSet;

/// Below this volume, in longest edges cubed, an element counts as flat: its shape gradients would have lost all but
/// a few of their 53 bits to cancellation.
const FLAT: f64 = 1e-14;

/// The first culprit of a check, and how many there are.
struct Culprits<T> {
    count: usize,
    first: Option<T>,
}

impl<T> Culprits<T> {
    fn find(culprits: impl Iterator<Item = T>) -> Self {
        let (mut count, mut first) = (0, None);
        for culprit in culprits {
            count += 1;
            first.get_or_insert(culprit);
        }
        Culprits { count, first }
    }

    /// The error made of the count and the first culprit, if there is one.
    fn refuse(self, error: impl FnOnce(usize, T) -> MeshError) -> Result<(), MeshError> {
        self.first.map_or(Ok(()), |first| Err(error(self.count, first)))
    }
}

/// Checks nodes and elements; elements of negative volume are refused or turned.
pub(super) fn mesh(nodes: &[[f64; 3]], tets: &mut [[NodeId; 4]], orientation: Orientation) -> Result<(), MeshError> {
    if tets.is_empty() {
        return Err(MeshError::NoElements);
    }
    if tets.len() > TetMesh::MAX_ELEMENTS {
        return Err(MeshError::TooManyElements { elements: tets.len(), limit: TetMesh::MAX_ELEMENTS });
    }
    Culprits::find(nodes.iter().enumerate().filter(|(_, x)| !x.iter().all(|c| c.is_finite())))
        .refuse(|count, (node, &position)| MeshError::NotFinite { count, node: NodeId(node as u32), position })?;

    let missing = |tet: &[NodeId; 4]| tet.iter().copied().find(|node| node.index() >= nodes.len());
    Culprits::find(numbered(tets).filter_map(|(element, tet)| missing(tet).map(|node| (element, node))))
        .refuse(|count, (element, node)| MeshError::NodeOutOfRange { count, element, node, nodes: nodes.len() })?;
    Culprits::find(numbered(tets).filter(|(_, tet)| sorted(**tet).windows(2).any(|pair| pair[0] == pair[1])))
        .refuse(|count, (element, &nodes)| MeshError::RepeatedNode { count, element, nodes })?;

    let corners = |tet: &[NodeId; 4]| tet.map(|node| nodes[node.index()]);
    Culprits::find(numbered(tets).filter(|(_, tet)| is_flat(&corners(tet)))).refuse(|count, (element, tet)| {
        MeshError::Degenerate { count, element, volume: six_volumes(&corners(tet)) / 6.0, nodes: *tet }
    })?;
    match orientation {
        Orientation::Refuse => Culprits::find(numbered(tets).filter(|(_, tet)| six_volumes(&corners(tet)) < 0.0))
            .refuse(|count, (element, tet)| MeshError::Inverted {
                count,
                element,
                volume: six_volumes(&corners(tet)) / 6.0,
                nodes: *tet,
            })?,
        Orientation::Repair => {
            for tet in tets.iter_mut().filter(|tet| six_volumes(&corners(tet)) < 0.0) {
                tet.swap(1, 2);
            }
        }
    }
    duplicates(tets)?;
    unreferenced(nodes.len(), tets)
}

/// Elements with their ids. `as u32` is exact: the count was checked first.
fn numbered(tets: &[[NodeId; 4]]) -> impl Iterator<Item = (ElementId, &[NodeId; 4])> {
    tets.iter().enumerate().map(|(element, tet)| (ElementId(element as u32), tet))
}

/// Whether the volume is negligible against the longest edge cubed, or no number that can be divided by.
fn is_flat(corners: &[[f64; 3]; 4]) -> bool {
    let volume = six_volumes(corners).abs() / 6.0;
    let edges = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    let longest = edges.iter().fold(0.0_f64, |longest, (a, b)| longest.max(norm(sub(corners[*b], corners[*a]))));
    !volume.is_normal() || volume < FLAT * longest.powi(3)
}

fn duplicates(tets: &[[NodeId; 4]]) -> Result<(), MeshError> {
    let mut keys: Vec<([NodeId; 4], ElementId)> =
        numbered(tets).map(|(element, tet)| (sorted(*tet), element)).collect();
    keys.sort_unstable();
    let mut repeated: Vec<(ElementId, ElementId)> =
        keys.chunk_by(|a, b| a.0 == b.0).flat_map(|run| run[1..].iter().map(|later| (later.1, run[0].1))).collect();
    repeated.sort_unstable();
    Culprits::find(repeated.into_iter()).refuse(|count, (element, earlier)| MeshError::Duplicate {
        count,
        element,
        earlier,
    })
}

fn unreferenced(nodes: usize, tets: &[[NodeId; 4]]) -> Result<(), MeshError> {
    let mut used = vec![false; nodes];
    for node in tets.iter().flatten() {
        used[node.index()] = true;
    }
    Culprits::find((0..nodes).filter(|&node| !used[node]))
        .refuse(|count, node| MeshError::UnreferencedNodes { count, node: NodeId(node as u32) })
}

/// Checks groups against a valid mesh, brings them into their normal order, and turns boundary faces outward.
pub(super) fn groups(groups: &mut Groups, nodes: usize, tets: &[[NodeId; 4]]) -> Result<(), MeshError> {
    let out_of_range = |kind, name: &String, member, index: u32, len| {
        Err(MeshError::GroupIndex { kind, name: name.clone(), member, index, len })
    };
    for (name, group) in &mut groups.nodes {
        if let Some(node) = group.iter().find(|node| node.index() >= nodes) {
            return out_of_range(GroupKind::Node, name, GroupKind::Node, node.0, nodes);
        }
        group.sort_unstable();
        group.dedup();
    }
    for (name, group) in &mut groups.elements {
        if let Some(element) = group.iter().find(|element| element.index() >= tets.len()) {
            return out_of_range(GroupKind::Element, name, GroupKind::Element, element.0, tets.len());
        }
        group.sort_unstable();
        group.dedup();
    }
    for (name, group) in &groups.faces {
        if let Some(node) = group.iter().flatten().find(|node| node.index() >= nodes) {
            return out_of_range(GroupKind::Face, name, GroupKind::Node, node.0, nodes);
        }
    }
    if groups.faces.values().all(Vec::is_empty) {
        return Ok(());
    }
    let owners = Owners::find(groups.faces.values().flatten(), nodes, tets);
    for (name, group) in &mut groups.faces {
        Culprits::find(group.iter().filter(|face| owners.of(face).0 == 0))
            .refuse(|count, &face| MeshError::FaceNotInMesh { name: name.clone(), count, face })?;
        let mut seen = BTreeSet::new();
        // A face listed twice would take a pressure twice.
        group.retain(|face| seen.insert(sorted(*face)));
        for face in group.iter_mut() {
            if let (1, outward) = owners.of(face) {
                *face = outward;
            }
        }
    }
    Ok(())
}

/// For each face of a group: how many elements have it, and how the first of them orients it.
struct Owners {
    keys: Vec<[NodeId; 3]>,
    found: Vec<(u32, [NodeId; 3])>,
}

impl Owners {
    fn find<'a>(faces: impl Iterator<Item = &'a [NodeId; 3]>, nodes: usize, tets: &[[NodeId; 4]]) -> Owners {
        let mut keys: Vec<[NodeId; 3]> = faces.map(|face| sorted(*face)).collect();
        keys.sort_unstable();
        keys.dedup();
        // Most elements touch no group: a flag a node spares them the search.
        let mut in_group = vec![false; nodes];
        for node in keys.iter().flatten() {
            in_group[node.index()] = true;
        }
        let mut found = vec![(0, [NodeId(0); 3]); keys.len()];
        for tet in tets {
            for opposite in 0..4 {
                let face = face_of(tet, opposite);
                if face.iter().all(|node| in_group[node.index()])
                    && let Ok(place) = keys.binary_search(&sorted(face))
                {
                    if found[place].0 == 0 {
                        found[place].1 = face;
                    }
                    found[place].0 += 1;
                }
            }
        }
        Owners { keys, found }
    }

    fn of(&self, face: &[NodeId; 3]) -> (u32, [NodeId; 3]) {
        self.keys.binary_search(&sorted(*face)).map_or((0, *face), |place| self.found[place])
    }
}

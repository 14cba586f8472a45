//! The checks that every mesh passes before it becomes a [`Mesh`](super::Mesh).

use super::error::{GroupKind, MeshError};
use super::gradients::{norm, sub};
use super::map;
use super::topology::{Block, ElementId, FaceKey, Groups, Mesh, NodeId, Orientation, face_key, sorted};
use std::collections::BTreeSet;
use tensormass_kernels::ElementInfo;

/// Below this volume, in longest edges cubed, an element counts as flat: its gradients would have lost all but a few of
/// their 53 bits to cancellation.
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
pub(super) fn mesh(nodes: &[[f64; 3]], blocks: &mut [Block], orientation: Orientation) -> Result<(), MeshError> {
    if blocks.is_empty() {
        return Err(MeshError::NoElements);
    }
    let slots: usize = blocks.iter().map(|block| block.nodes.len()).sum();
    if slots > Mesh::MAX_SLOTS {
        let elements = blocks.iter().map(Block::len).sum();
        let limit = Mesh::MAX_SLOTS / blocks.iter().map(|block| block.info().nodes).max().unwrap_or(1);
        return Err(MeshError::TooManyElements { elements, limit });
    }
    if let Some(other) = blocks.iter().find(|b| b.info().dimension != blocks[0].info().dimension) {
        return Err(MeshError::MixedDimensions { first: blocks[0].info().name, second: other.info().name });
    }
    Culprits::find(nodes.iter().enumerate().filter(|(_, x)| !x.iter().all(|c| c.is_finite())))
        .refuse(|count, (node, &position)| MeshError::NotFinite { count, node: NodeId(node as u32), position })?;

    let missing = |nodes_of: &[NodeId]| nodes_of.iter().copied().find(|node| node.index() >= nodes.len());
    Culprits::find(numbered(blocks).filter_map(|(element, _, of)| missing(of).map(|node| (element, node))))
        .refuse(|count, (element, node)| MeshError::NodeOutOfRange { count, element, node, nodes: nodes.len() })?;
    Culprits::find(numbered(blocks).filter(|(_, _, of)| sorted(of).windows(2).any(|pair| pair[0] == pair[1])))
        .refuse(|count, (element, _, of)| MeshError::RepeatedNode { count, element, nodes: of.to_vec() })?;
    if blocks[0].info().dimension == 2 {
        let outside = |(_, x): &(usize, &[f64; 3])| x[2] != 0.0;
        Culprits::find(nodes.iter().enumerate().filter(outside)).refuse(|count, (node, x)| MeshError::OutOfPlane {
            count,
            node: NodeId(node as u32),
            z: x[2],
        })?;
    }
    let shapes: Vec<Shape> = numbered(blocks).map(|(_, info, of)| Shape::of(info, &positions(nodes, of))).collect();
    let with_shape = || numbered(blocks).zip(&shapes).map(|((element, _, of), shape)| (element, of, *shape));
    Culprits::find(with_shape().filter(|(_, _, shape)| shape.is_flat())).refuse(|count, (element, of, shape)| {
        MeshError::Degenerate { count, element, volume: shape.volume, nodes: of.to_vec() }
    })?;
    Culprits::find(with_shape().filter(|(_, _, shape)| shape.is_folded()))
        .refuse(|count, (element, of, _)| MeshError::Folded { count, element, nodes: of.to_vec() })?;
    match orientation {
        Orientation::Refuse => Culprits::find(with_shape().filter(|(_, _, shape)| shape.volume < 0.0)).refuse(
            |count, (element, of, shape)| MeshError::Inverted {
                count,
                element,
                volume: shape.volume,
                nodes: of.to_vec(),
            },
        )?,
        Orientation::Repair => {
            let mut shapes = shapes.iter();
            for block in blocks.iter_mut() {
                let info = block.info();
                let order = map::mirrored(info);
                for of in block.nodes.chunks_exact_mut(info.nodes) {
                    if shapes.next().is_some_and(|shape| shape.volume < 0.0) {
                        let old = of.to_vec();
                        of.iter_mut().zip(&order).for_each(|(node, j)| *node = old[*j]);
                    }
                }
            }
        }
    }
    duplicates(blocks)?;
    unreferenced(nodes.len(), blocks)
}

/// Elements with their ids and kinds. `as u32` is exact: the count was checked first.
fn numbered(blocks: &[Block]) -> impl Iterator<Item = (ElementId, &'static ElementInfo, &[NodeId])> {
    let all = blocks.iter().flat_map(|block| block.elements().map(|nodes| (block.info(), nodes)));
    all.enumerate().map(|(element, (info, nodes))| (ElementId(element as u32), info, nodes))
}

fn positions(nodes: &[[f64; 3]], of: &[NodeId]) -> Vec<[f64; 3]> {
    of.iter().map(|node| nodes[node.index()]).collect()
}

/// How an element is mapped.
#[derive(Clone, Copy)]
struct Shape {
    volume: f64,
    /// Whether det J has both signs.
    both: bool,
    /// The longest distance of two nodes.
    longest: f64,
    dimension: usize,
}

impl Shape {
    fn of(info: &ElementInfo, positions: &[[f64; 3]]) -> Self {
        let rest = map::rest(info, positions);
        let mut longest = 0.0_f64;
        for (k, a) in positions.iter().enumerate() {
            longest = positions[..k].iter().fold(longest, |longest, b| longest.max(norm(sub(*b, *a))));
        }
        let both = rest.iter().any(|r| r.weight > 0.0) && rest.iter().any(|r| r.weight < 0.0);
        Self { volume: rest.iter().map(|r| r.weight).sum(), both, longest, dimension: info.dimension }
    }

    /// Whether the volume is negligible against the longest edge cubed, or no number that can be divided by.
    fn is_flat(&self) -> bool {
        let volume = self.volume.abs();
        !self.both && (!volume.is_normal() || volume < FLAT * self.longest.powi(self.dimension as i32))
    }

    fn is_folded(&self) -> bool {
        self.both
    }
}

fn duplicates(blocks: &[Block]) -> Result<(), MeshError> {
    let mut keys: Vec<(Vec<NodeId>, ElementId)> =
        numbered(blocks).map(|(element, _, of)| (sorted(of), element)).collect();
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

fn unreferenced(nodes: usize, blocks: &[Block]) -> Result<(), MeshError> {
    let mut used = vec![false; nodes];
    for node in blocks.iter().flat_map(|block| &block.nodes) {
        used[node.index()] = true;
    }
    Culprits::find((0..nodes).filter(|&node| !used[node]))
        .refuse(|count, node| MeshError::UnreferencedNodes { count, node: NodeId(node as u32) })
}

/// Checks groups against a valid mesh, brings them into their normal order, and turns boundary faces outward.
pub(super) fn groups(groups: &mut Groups, mesh: &Mesh) -> Result<(), MeshError> {
    let nodes = mesh.nodes().len();
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
        if let Some(element) = group.iter().find(|element| element.index() >= mesh.len()) {
            return out_of_range(GroupKind::Element, name, GroupKind::Element, element.0, mesh.len());
        }
        group.sort_unstable();
        group.dedup();
    }
    for (name, group) in &groups.faces {
        if let Some(node) = group.iter().flatten().find(|node| node.index() >= nodes) {
            return out_of_range(GroupKind::Face, name, GroupKind::Node, node.0, nodes);
        }
    }
    for (name, group) in &groups.edges {
        if let Some(node) = group.iter().flatten().find(|node| node.index() >= nodes) {
            return out_of_range(GroupKind::Edge, name, GroupKind::Node, node.0, nodes);
        }
    }
    if groups.faces.values().all(Vec::is_empty) {
        return Ok(());
    }
    let owners = Owners::find(groups.faces.values().flatten(), mesh);
    for (name, group) in &mut groups.faces {
        Culprits::find(group.iter().filter(|face| owners.of(face).is_none()))
            .refuse(|count, face| MeshError::FaceNotInMesh { name: name.clone(), count, face: face.clone() })?;
        let mut seen = BTreeSet::new();
        // A face listed twice would take a pressure twice.
        group.retain(|face| seen.insert(sorted(face)));
        for face in group.iter_mut() {
            if let Some((1, outward)) = owners.of(face) {
                face.clone_from(outward);
            }
        }
    }
    Ok(())
}

/// For each face of a group: how many elements have it, and how the first of them orients it.
struct Owners {
    keys: Vec<FaceKey>,
    found: Vec<(u32, Vec<NodeId>)>,
}

impl Owners {
    fn find<'a>(faces: impl Iterator<Item = &'a Vec<NodeId>>, mesh: &Mesh) -> Owners {
        let mut in_group = vec![false; mesh.nodes().len()];
        let mut keys: Vec<FaceKey> = faces
            .map(|face| {
                face.iter().for_each(|node| in_group[node.index()] = true);
                face_key(face)
            })
            .collect();
        keys.sort_unstable();
        keys.dedup();
        let mut found = vec![(0, vec![]); keys.len()];
        for (_, face) in mesh.faces() {
            // Most elements touch no group: a flag a node spares them the search.
            if face.iter().all(|node| in_group[node.index()])
                && let Ok(place) = keys.binary_search(&face_key(&face))
            {
                if found[place].0 == 0 {
                    found[place].1 = face;
                }
                found[place].0 += 1;
            }
        }
        Owners { keys, found }
    }

    /// `None` where no element has all these nodes on one face, and no others.
    fn of(&self, face: &[NodeId]) -> Option<(u32, &Vec<NodeId>)> {
        let place = self.keys.binary_search(&face_key(face)).ok()?;
        let (count, outward) = &self.found[place];
        (sorted(outward) == sorted(face)).then_some((*count, outward))
    }
}

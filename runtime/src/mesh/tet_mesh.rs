//! The tetrahedral mesh: checked rest positions, connectivity and named groups.

use super::error::MeshError;
use super::gradients::{ShapeGradients, shape_gradients, six_volumes};
use super::validate;
use std::collections::BTreeMap;
use std::fmt;

/// A node, by its place in [`TetMesh::nodes`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// An element (tetrahedron), by its place in [`TetMesh::tets`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ElementId(pub u32);

impl NodeId {
    /// The same number as an array index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl ElementId {
    /// The same number as an array index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl fmt::Display for ElementId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// What to do with elements whose node order gives a negative volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Orientation {
    /// Refuse them: a wrong order often means that something else is wrong too.
    #[default]
    Refuse,
    /// Swap their second and third node.
    Repair,
}

/// Named parts of a mesh. [`TetMesh::new`] sorts nodes and elements and drops repetitions.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Groups {
    /// Sets of nodes.
    pub nodes: BTreeMap<String, Vec<NodeId>>,
    /// Sets of elements.
    pub elements: BTreeMap<String, Vec<ElementId>>,
    /// Sets of triangles, each a face of at least one element. A face of the boundary is turned outward.
    pub faces: BTreeMap<String, Vec<[NodeId; 3]>>,
}

/// The faces of a tetrahedron as local node numbers; face `a` is opposite to node `a`, its normal points outward.
pub(super) const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A mesh of linear tetrahedra in its rest state, valid by construction.
///
/// Every node is finite and used, every element has four different nodes and a positive volume, no element occurs
/// twice, and `4 * elements` fits in a `u32`, so that a slot `4 * e + a` (node `a` of element `e`) does too.
#[derive(Debug, Clone, PartialEq)]
pub struct TetMesh {
    nodes: Vec<[f64; 3]>,
    tets: Vec<[NodeId; 4]>,
    groups: Groups,
}

impl TetMesh {
    /// The largest number of elements, so that every slot `4 * e + a` fits in a `u32`.
    pub const MAX_ELEMENTS: usize = (u32::MAX / 4) as usize;

    /// A mesh from rest positions (m), the four nodes of each element, and groups.
    ///
    /// # Errors
    /// [`MeshError`] if the mesh is not valid (see [`TetMesh`]), including elements with a negative volume; each error
    /// gives the number of culprits and the first of them.
    pub fn new(nodes: Vec<[f64; 3]>, tets: Vec<[NodeId; 4]>, groups: Groups) -> Result<TetMesh, MeshError> {
        TetMesh::with_orientation(nodes, tets, groups, Orientation::Refuse)
    }

    /// As [`TetMesh::new`], but swaps the second and third node of each element that has a negative volume.
    ///
    /// # Errors
    /// [`MeshError`] if the mesh is not valid for another reason.
    pub fn oriented(nodes: Vec<[f64; 3]>, tets: Vec<[NodeId; 4]>, groups: Groups) -> Result<TetMesh, MeshError> {
        TetMesh::with_orientation(nodes, tets, groups, Orientation::Repair)
    }

    /// [`TetMesh::new`] or [`TetMesh::oriented`], as a scene's option says.
    ///
    /// # Errors
    /// [`MeshError`] if the mesh is not valid.
    pub fn with_orientation(
        nodes: Vec<[f64; 3]>,
        mut tets: Vec<[NodeId; 4]>,
        mut groups: Groups,
        orientation: Orientation,
    ) -> Result<TetMesh, MeshError> {
        validate::mesh(&nodes, &mut tets, orientation)?;
        validate::groups(&mut groups, nodes.len(), &tets)?;
        Ok(TetMesh { nodes, tets, groups })
    }

    /// Rest positions, m.
    pub fn nodes(&self) -> &[[f64; 3]] {
        &self.nodes
    }

    /// The four nodes of each element, in an order that gives a positive volume.
    pub fn tets(&self) -> &[[NodeId; 4]] {
        &self.tets
    }

    /// The elements' ids in order.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = ElementId> + use<> {
        // `as u32` is exact: validation bounds the count by MAX_ELEMENTS.
        (0..self.tets.len() as u32).map(ElementId)
    }

    /// All groups.
    pub fn groups(&self) -> &Groups {
        &self.groups
    }

    /// The nodes of a group, in increasing order; `None` if there is no such group.
    pub fn node_group(&self, name: &str) -> Option<&[NodeId]> {
        self.groups.nodes.get(name).map(Vec::as_slice)
    }

    /// The elements of a group, in increasing order; `None` if there is no such group.
    pub fn element_group(&self, name: &str) -> Option<&[ElementId]> {
        self.groups.elements.get(name).map(Vec::as_slice)
    }

    /// The triangles of a group (outward normal by the right-hand rule on the boundary); `None` if there is no such
    /// group.
    pub fn face_group(&self, name: &str) -> Option<&[[NodeId; 3]]> {
        self.groups.faces.get(name).map(Vec::as_slice)
    }

    /// The names of the node groups, sorted.
    pub fn node_group_names(&self) -> impl Iterator<Item = &str> {
        self.groups.nodes.keys().map(String::as_str)
    }

    /// The names of the element groups, sorted.
    pub fn element_group_names(&self) -> impl Iterator<Item = &str> {
        self.groups.elements.keys().map(String::as_str)
    }

    /// The names of the face groups, sorted.
    pub fn face_group_names(&self) -> impl Iterator<Item = &str> {
        self.groups.faces.keys().map(String::as_str)
    }

    /// The rest positions of an element's nodes, m.
    ///
    /// # Panics
    /// If `element` is not of this mesh, as do the other functions of an element.
    pub fn corners(&self, element: ElementId) -> [[f64; 3]; 4] {
        self.tets[element.index()].map(|node| self.nodes[node.index()])
    }

    /// The rest volume of an element, m3: positive.
    pub fn volume(&self, element: ElementId) -> f64 {
        six_volumes(&self.corners(element)) / 6.0
    }

    /// The shape gradients of an element and its volume.
    pub fn shape_gradients(&self, element: ElementId) -> ShapeGradients {
        shape_gradients(&self.corners(element))
    }

    /// The rest volume of the mesh, m3: the sum over its elements in their order.
    pub fn total_volume(&self) -> f64 {
        self.elements().map(|element| self.volume(element)).sum()
    }

    /// The least and the greatest coordinate along each axis, m: `[lower, upper]`.
    pub fn bounding_box(&self) -> [[f64; 3]; 2] {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for node in &self.nodes {
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(node[axis]);
                bounds[1][axis] = bounds[1][axis].max(node[axis]);
            }
        }
        bounds
    }

    /// The faces that belong to one element only, each once, with outward normals by the right-hand rule; ordered by
    /// element, then by the local node that they are opposite to.
    pub fn boundary_faces(&self) -> Vec<[NodeId; 3]> {
        let mut keys: Vec<([NodeId; 3], u32)> = Vec::with_capacity(4 * self.tets.len());
        for (slot, face) in self.faces().enumerate() {
            keys.push((sorted(face), slot as u32));
        }
        // Sorting, not hashing: the order is fixed, and 16 bytes a face are all the memory that it takes.
        keys.sort_unstable();
        let mut slots: Vec<u32> =
            keys.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() == 1).map(|run| run[0].1).collect();
        slots.sort_unstable();
        slots.into_iter().map(|slot| face_of(&self.tets[slot as usize / 4], slot as usize % 4)).collect()
    }

    /// The nodes of the boundary faces, in increasing order.
    pub fn surface_nodes(&self) -> Vec<NodeId> {
        let mut on_surface = vec![false; self.nodes.len()];
        for node in self.boundary_faces().into_iter().flatten() {
            on_surface[node.index()] = true;
        }
        // `as u32` is exact: every node is named by a NodeId.
        (0..self.nodes.len() as u32).map(NodeId).filter(|node| on_surface[node.index()]).collect()
    }

    /// All faces of all elements, outward, in slot order.
    fn faces(&self) -> impl Iterator<Item = [NodeId; 3]> + '_ {
        self.tets.iter().flat_map(|tet| (0..4).map(|opposite| face_of(tet, opposite)))
    }
}

/// The face of `tet` opposite to its local node, outward.
pub(super) fn face_of(tet: &[NodeId; 4], opposite: usize) -> [NodeId; 3] {
    FACES[opposite].map(|corner| tet[corner])
}

/// The same nodes in increasing order: equal for two faces or elements exactly if they have the same nodes.
pub(super) fn sorted<const N: usize>(mut nodes: [NodeId; N]) -> [NodeId; N] {
    nodes.sort_unstable();
    nodes
}

//! The mesh: checked rest positions, elements of any kinds, and named groups.

use super::error::MeshError;
use super::gradients::{ShapeGradients, shape_gradients};
use super::map;
use super::validate;
use std::collections::BTreeMap;
use std::fmt;
use tensormass_kernels::element::RestPoint;
use tensormass_kernels::{ElementEntry, ElementInfo};

/// A node, by its place in [`Mesh::nodes`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// An element, by its place in the mesh: block after block.
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
    /// Mirror their order of nodes: of a linear tetrahedron the second and third are swapped.
    Repair,
}

/// Named parts of a mesh. [`Mesh::new`] sorts nodes and elements and drops repetitions.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Groups {
    /// Sets of nodes.
    pub nodes: BTreeMap<String, Vec<NodeId>>,
    /// Sets of elements.
    pub elements: BTreeMap<String, Vec<ElementId>>,
    /// Sets of faces, each one of at least one element, by all its nodes. A face of the boundary is given the order of
    /// nodes that its element has: outward.
    pub faces: BTreeMap<String, Vec<Vec<NodeId>>>,
    /// Sets of edges by their ends: those of groups of nodes along curves. [`Mesh::refined`] alone needs them.
    pub edges: BTreeMap<String, Vec<[NodeId; 2]>>,
}

/// Elements of one kind.
#[derive(Debug, Clone)]
pub struct Block {
    /// What they are.
    pub element: &'static ElementEntry,
    /// The nodes of one after the other, in the order of the element's declaration.
    pub nodes: Vec<NodeId>,
}

impl Block {
    /// The kind's properties.
    pub fn info(&self) -> &'static ElementInfo {
        self.element.info
    }

    /// How many elements there are.
    pub fn len(&self) -> usize {
        self.nodes.len() / self.info().nodes
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The nodes of each element.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = &[NodeId]> {
        self.nodes.chunks_exact(self.info().nodes)
    }
}

impl PartialEq for Block {
    fn eq(&self, other: &Self) -> bool {
        (self.info().name, &self.nodes) == (other.info().name, &other.nodes)
    }
}

/// A face of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct FaceId {
    /// The element.
    pub element: ElementId,
    /// Which of its faces.
    pub face: u32,
}

/// A mesh in its rest state, valid by construction.
///
/// Every node is finite and used, every element has different nodes and det J > 0 at its quadrature points, no element
/// occurs twice, and every slot (node `a` of element `e`, counted element after element) has a number that fits in a
/// `u32`.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    nodes: Vec<[f64; 3]>,
    blocks: Vec<Block>,
    /// The number of each block's first element, and one more.
    first: Vec<u32>,
    groups: Groups,
}

impl Mesh {
    /// The largest number of slots, so that each fits in a `u32`.
    pub const MAX_SLOTS: usize = u32::MAX as usize;

    /// The largest number of linear tetrahedra.
    pub const MAX_ELEMENTS: usize = (u32::MAX / 4) as usize;

    /// A mesh from rest positions (m), the elements, and groups.
    ///
    /// # Errors
    /// [`MeshError`] if the mesh is not valid (see [`Mesh`]), including elements with a negative volume; each error gives
    /// the number of culprits and the first of them.
    pub fn new(nodes: Vec<[f64; 3]>, blocks: Vec<Block>, groups: Groups) -> Result<Mesh, MeshError> {
        Mesh::with_orientation(nodes, blocks, groups, Orientation::Refuse)
    }

    /// A mesh of linear tetrahedra.
    ///
    /// # Errors
    /// As [`Mesh::new`].
    pub fn tetrahedra(nodes: Vec<[f64; 3]>, tets: Vec<[NodeId; 4]>, groups: Groups) -> Result<Mesh, MeshError> {
        Mesh::new(nodes, vec![linear_tetrahedra(tets)], groups)
    }

    /// As [`Mesh::tetrahedra`], but swaps the second and third node of each element that has a negative volume.
    ///
    /// # Errors
    /// [`MeshError`] if the mesh is not valid for another reason.
    pub fn oriented(nodes: Vec<[f64; 3]>, tets: Vec<[NodeId; 4]>, groups: Groups) -> Result<Mesh, MeshError> {
        Mesh::with_orientation(nodes, vec![linear_tetrahedra(tets)], groups, Orientation::Repair)
    }

    /// As [`Mesh::new`], with what is to be done about elements of negative volume.
    ///
    /// # Errors
    /// [`MeshError`] if the mesh is not valid.
    pub fn with_orientation(
        nodes: Vec<[f64; 3]>,
        mut blocks: Vec<Block>,
        mut groups: Groups,
        orientation: Orientation,
    ) -> Result<Mesh, MeshError> {
        blocks.retain(|block| !block.is_empty());
        validate::mesh(&nodes, &mut blocks, orientation)?;
        let mut first = vec![0];
        for block in &blocks {
            // `as u32` is exact: validation bounds the count of slots.
            first.push(first[first.len() - 1] + block.len() as u32);
        }
        let mut mesh = Mesh { nodes, blocks, first, groups: Groups::default() };
        validate::groups(&mut groups, &mesh)?;
        mesh.groups = groups;
        Ok(mesh)
    }

    /// The same mesh with other rest positions.
    ///
    /// # Errors
    /// As [`Mesh::new`].
    pub fn moved(&self, nodes: Vec<[f64; 3]>) -> Result<Mesh, MeshError> {
        Mesh::new(nodes, self.blocks.clone(), self.groups.clone())
    }

    /// Rest positions, m.
    pub fn nodes(&self) -> &[[f64; 3]] {
        &self.nodes
    }

    /// The elements, kind by kind.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The four nodes of each element of a mesh of linear tetrahedra, in an order that gives a positive volume.
    ///
    /// # Panics
    /// The mesh has other elements.
    pub fn tets(&self) -> &[[NodeId; 4]] {
        let [block] = &self.blocks[..] else { panic!("the mesh has elements of several kinds") };
        assert!(block.info().is_linear_simplex, "the mesh has elements other than linear tetrahedra");
        block.nodes.as_chunks().0
    }

    /// How many elements there are.
    pub fn len(&self) -> usize {
        self.first[self.first.len() - 1] as usize
    }

    /// Never: an empty mesh is not valid.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The elements' ids in order.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = ElementId> + use<> {
        (0..self.first[self.first.len() - 1]).map(ElementId)
    }

    /// What an element is.
    ///
    /// # Panics
    /// If `element` is not of this mesh, as do the other functions of an element.
    pub fn kind(&self, element: ElementId) -> &'static ElementEntry {
        self.place(element).0.element
    }

    /// The nodes of an element.
    pub fn element_nodes(&self, element: ElementId) -> &[NodeId] {
        let (block, place) = self.place(element);
        let n = block.info().nodes;
        &block.nodes[place * n..][..n]
    }

    /// The block of an element, and its place there.
    fn place(&self, element: ElementId) -> (&Block, usize) {
        let block = self.first.partition_point(|first| *first <= element.0) - 1;
        (&self.blocks[block], (element.0 - self.first[block]) as usize)
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

    /// The faces of a group by their nodes (outward normal by the right-hand rule on the boundary); `None` if there is no
    /// such group.
    pub fn face_group(&self, name: &str) -> Option<&[Vec<NodeId>]> {
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

    /// The sum of each element's nodes' positions from the least corner of the mesh, m: an order by them does not depend on
    /// where the mesh is.
    pub fn centres(&self) -> Vec<[f64; 3]> {
        let [low, _] = self.bounding_box();
        let sum = |e| {
            let positions = self.element_nodes(e).iter().map(|node| self.nodes[node.index()]);
            positions.fold([0.0; 3], |sum, x| std::array::from_fn(|i| sum[i] + (x[i] - low[i])))
        };
        self.elements().map(sum).collect()
    }

    /// The rest positions of some nodes, m.
    pub fn positions(&self, nodes: &[NodeId]) -> Vec<[f64; 3]> {
        nodes.iter().map(|node| self.nodes[node.index()]).collect()
    }

    /// An element's quadrature points at rest (m): J^-1 and the weights.
    pub fn rest(&self, element: ElementId) -> Vec<RestPoint<f64>> {
        map::rest(self.kind(element).info, &self.positions(self.element_nodes(element)))
    }

    /// The rest volume of an element, m3: positive.
    pub fn volume(&self, element: ElementId) -> f64 {
        self.rest(element).iter().map(|point| point.weight).sum()
    }

    /// The shape gradients of a linear tetrahedron and its volume.
    pub fn shape_gradients(&self, element: ElementId) -> ShapeGradients {
        let nodes = self.element_nodes(element);
        shape_gradients(&std::array::from_fn(|a| self.nodes[nodes[a].index()]))
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

    /// The nodes of a face, in its order.
    pub fn face_nodes(&self, face: FaceId) -> Vec<NodeId> {
        let nodes = self.element_nodes(face.element);
        self.kind(face.element).info.faces[face.face as usize].nodes.iter().map(|j| nodes[*j]).collect()
    }

    /// The element that a face is.
    ///
    /// # Panics
    /// The build has no such element: its declarations were checked.
    pub fn face_kind(&self, face: FaceId) -> &'static ElementInfo {
        let name = self.kind(face.element).info.faces[face.face as usize].element;
        tensormass_kernels::element(name).expect("the faces of elements are elements").info
    }

    /// The faces that belong to one element only, each once; ordered by element, then as the element declares them.
    pub fn boundary(&self) -> Vec<FaceId> {
        let mut keys: Vec<(FaceKey, FaceId)> = self.faces().map(|(face, nodes)| (face_key(&nodes), face)).collect();
        // Sorting, not hashing: the order is fixed, and 24 bytes a face are all the memory that it takes.
        keys.sort_unstable();
        let mut faces: Vec<FaceId> =
            keys.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() == 1).map(|run| run[0].1).collect();
        faces.sort_unstable();
        faces
    }

    /// The nodes of each face of the boundary, with outward normals by the right-hand rule.
    pub fn boundary_faces(&self) -> Vec<Vec<NodeId>> {
        self.boundary().into_iter().map(|face| self.face_nodes(face)).collect()
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

    /// All faces of all elements, with their nodes.
    pub(super) fn faces(&self) -> impl Iterator<Item = (FaceId, Vec<NodeId>)> {
        self.elements().flat_map(move |element| {
            let faces = 0..self.kind(element).info.faces.len() as u32;
            faces.map(move |face| FaceId { element, face }).map(|face| (face, self.face_nodes(face)))
        })
    }
}

fn linear_tetrahedra(tets: Vec<[NodeId; 4]>) -> Block {
    Block { element: tensormass_kernels::linear_tetrahedron(), nodes: tets.into_iter().flatten().collect() }
}

/// What tells faces apart: their four least nodes, fewer where there are not so many. Faces of a conforming mesh that are
/// not the same share the nodes of an edge at most, which are two or three.
pub(super) type FaceKey = [u32; 4];

/// See [`FaceKey`].
pub(super) fn face_key(nodes: &[NodeId]) -> FaceKey {
    let mut all: Vec<u32> = nodes.iter().map(|node| node.0).collect();
    all.sort_unstable();
    std::array::from_fn(|k| all.get(k).copied().unwrap_or(u32::MAX))
}

/// The same nodes in increasing order: equal for two elements exactly if they have the same nodes.
pub(super) fn sorted(nodes: &[NodeId]) -> Vec<NodeId> {
    let mut nodes = nodes.to_vec();
    nodes.sort_unstable();
    nodes
}

//! What can be wrong with a mesh, and what to do about it.

use super::topology::{ElementId, NodeId};
use std::fmt;

/// The kind of a mesh group, for messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroupKind {
    /// A set of nodes.
    Node,
    /// A set of elements.
    Element,
    /// A set of faces.
    Face,
    /// A set of edges.
    Edge,
}

impl fmt::Display for GroupKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            GroupKind::Node => "node",
            GroupKind::Element => "element",
            GroupKind::Face => "face",
            GroupKind::Edge => "edge",
        })
    }
}

/// Why a mesh was refused. Counts are of all culprits; ids are those of the first.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// There is nothing to simulate.
    #[error("the mesh has no elements; give at least one tetrahedron (a surface mesh has none: fill it first)")]
    NoElements,
    /// A slot would not fit in a `u32`.
    #[error("the mesh has {elements} elements, more than the {limit} that can be numbered; use a coarser mesh")]
    TooManyElements {
        /// Elements asked for.
        elements: usize,
        /// The most that are possible.
        limit: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error(
        "{} a coordinate that is not finite, first is node {node} at ({}, {}, {}); correct its coordinates",
        counted(*count, "node has", "nodes have"), position[0], position[1], position[2]
    )]
    NotFinite {
        /// Culprits.
        count: usize,
        /// The first of them.
        node: NodeId,
        /// Its position, m.
        position: [f64; 3],
    },
    /// An element names a node that does not exist.
    #[error(
        "{} a node that does not exist, first is element {element}, which names node {node} of {nodes}; \
         number nodes from 0 to the number of nodes less one",
        counted(*count, "element names", "elements name")
    )]
    NodeOutOfRange {
        /// Culprits.
        count: usize,
        /// The first of them.
        element: ElementId,
        /// The node that it names.
        node: NodeId,
        /// How many nodes there are.
        nodes: usize,
    },
    /// An element names one node twice.
    #[error(
        "{} a node twice, first is element {element} with nodes {}; an element needs different nodes",
        counted(*count, "element names", "elements name"), list(nodes)
    )]
    RepeatedNode {
        /// Culprits.
        count: usize,
        /// The first of them.
        element: ElementId,
        /// Its nodes.
        nodes: Vec<NodeId>,
    },
    /// An element is flat: its volume is below 1e-14 of its longest edge cubed.
    #[error(
        "{} degenerate (flat), first is element {element} with volume {volume:.3e} m3 and nodes {}; \
         remove such elements or move their nodes",
        counted(*count, "element is", "elements are"), list(nodes)
    )]
    Degenerate {
        /// Culprits.
        count: usize,
        /// The first of them.
        element: ElementId,
        /// Its signed volume, m3.
        volume: f64,
        /// Its nodes.
        nodes: Vec<NodeId>,
    },
    /// The map of an element from its reference coordinates folds: det J has both signs.
    #[error(
        "{} folded (det J has both signs), first is element {element} with nodes {}; move its nodes, or check their order",
        counted(*count, "element is", "elements are"), list(nodes)
    )]
    Folded {
        /// Culprits.
        count: usize,
        /// The first of them.
        element: ElementId,
        /// Its nodes.
        nodes: Vec<NodeId>,
    },
    /// Plane elements beside solid ones.
    #[error("the mesh has plane and solid elements ({first} and {second}); give one or the other")]
    MixedDimensions {
        /// An element of one dimension.
        first: &'static str,
        /// One of another.
        second: &'static str,
    },
    /// A plane body that is not in the plane z = 0.
    #[error(
        "{} outside the plane z = 0, first is node {node} at z = {z}; plane elements need z = 0",
        counted(*count, "node is", "nodes are")
    )]
    OutOfPlane {
        /// Culprits.
        count: usize,
        /// The first of them.
        node: NodeId,
        /// Its z, m.
        z: f64,
    },
    /// An element's node order gives a negative volume.
    #[error(
        "{} inverted, first is element {element} with volume {volume:.3e} m3 and nodes {}; \
         swap two of its nodes, or set `orient = true` to have that done for every such element",
        counted(*count, "element is", "elements are"), list(nodes)
    )]
    Inverted {
        /// Culprits.
        count: usize,
        /// The first of them.
        element: ElementId,
        /// Its signed volume, m3.
        volume: f64,
        /// Its nodes.
        nodes: Vec<NodeId>,
    },
    /// Two elements have the same nodes.
    #[error(
        "{} the nodes of an earlier one, first is element {element}, which repeats element {earlier}; remove one of them",
        counted(*count, "element has", "elements have")
    )]
    Duplicate {
        /// Culprits, without the earliest of each set.
        count: usize,
        /// The first of them.
        element: ElementId,
        /// The element that it repeats.
        earlier: ElementId,
    },
    /// A node that no element uses would have no mass.
    #[error(
        "{} used by no element, first is node {node}; a node without an element has no mass: remove it",
        counted(*count, "node is", "nodes are")
    )]
    UnreferencedNodes {
        /// Culprits.
        count: usize,
        /// The first of them.
        node: NodeId,
    },
    /// A group names a node or an element that does not exist.
    #[error("{kind} group `{name}` names {member} {index} of {len}; number from 0 to {len} less one")]
    GroupIndex {
        /// What the group holds.
        kind: GroupKind,
        /// The group.
        name: String,
        /// `node` or `element`.
        member: GroupKind,
        /// The number out of range.
        index: u32,
        /// How many there are.
        len: usize,
    },
    /// A face of a face group is no face of any element.
    #[error(
        "{} of face group `{name}` {} of any element, first is ({}); \
         take faces whose nodes are those of one face of an element, or remove the group",
        counted(*count, "face", "faces"), if *count == 1 { "is not a face" } else { "are not faces" }, list(face)
    )]
    FaceNotInMesh {
        /// The group.
        name: String,
        /// Culprits.
        count: usize,
        /// The first of them.
        face: Vec<NodeId>,
    },
    /// A beam of elements that make no cell.
    #[error("a beam cannot be made of `{element}`; take a solid element, or a plane one for a rectangle")]
    BeamElement {
        /// The element.
        element: &'static str,
    },
    /// A rectangle of another thickness than one metre, or of several cells across it.
    #[error(
        "a rectangle of plane elements is one metre thick, not {size} m in {cells} cells; give size 1 and 1 cell along z"
    )]
    BeamThickness {
        /// What was given, m.
        size: f64,
        /// What was given.
        cells: usize,
    },
    /// A torus without a hole, or of no size.
    #[error(
        "a torus of the radii {major} and {minor} m has no hole; give a minor radius above 0 and below the major one"
    )]
    TorusRadii {
        /// The radius of the circle in the middle of its tube, m.
        major: f64,
        /// The radius of its tube, m.
        minor: f64,
    },
    /// A torus of elements that make no cell.
    #[error("a torus cannot be made of `{element}`; take a solid element")]
    TorusElement {
        /// The element.
        element: &'static str,
    },
    /// Too few cells around a torus.
    #[error("{around} cells do not go around a torus; give at least 3")]
    TorusCells {
        /// Cells around.
        around: usize,
    },
    /// A beam with no cells along an axis.
    #[error("the beam has no cells along {axis}; give at least 1")]
    BeamCells {
        /// x, y or z.
        axis: char,
    },
    /// A beam with a size that is not a positive, finite length.
    #[error("the beam's size along {axis} is {size} m; give a positive, finite length")]
    BeamSize {
        /// x, y or z.
        axis: char,
        /// What was given, m.
        size: f64,
    },
    /// A beam that starts nowhere.
    #[error("the beam's origin along {axis} is {value} m; give a finite coordinate")]
    BeamOrigin {
        /// x, y or z.
        axis: char,
        /// What was given, m.
        value: f64,
    },
    /// A beam with more elements (or nodes) than can be numbered.
    #[error(
        "a beam of {} x {} x {} cells has more elements than the {limit} that can be numbered; use fewer cells",
        cells[0], cells[1], cells[2]
    )]
    BeamTooLarge {
        /// What was given.
        cells: [usize; 3],
        /// The most elements that are possible.
        limit: usize,
    },
}

impl MeshError {
    /// The first culprit if it is an element: readers turn it into a line number.
    pub fn element(&self) -> Option<ElementId> {
        match *self {
            MeshError::NodeOutOfRange { element, .. }
            | MeshError::RepeatedNode { element, .. }
            | MeshError::Degenerate { element, .. }
            | MeshError::Folded { element, .. }
            | MeshError::Inverted { element, .. }
            | MeshError::Duplicate { element, .. } => Some(element),
            MeshError::NoElements
            | MeshError::TooManyElements { .. }
            | MeshError::MixedDimensions { .. }
            | MeshError::OutOfPlane { .. }
            | MeshError::NotFinite { .. }
            | MeshError::UnreferencedNodes { .. }
            | MeshError::GroupIndex { .. }
            | MeshError::FaceNotInMesh { .. }
            | MeshError::BeamElement { .. }
            | MeshError::BeamThickness { .. }
            | MeshError::BeamCells { .. }
            | MeshError::BeamSize { .. }
            | MeshError::BeamOrigin { .. }
            | MeshError::BeamTooLarge { .. }
            | MeshError::TorusRadii { .. }
            | MeshError::TorusElement { .. }
            | MeshError::TorusCells { .. } => None,
        }
    }

    /// The first culprit if it is a node: readers turn it into a line number.
    pub fn node(&self) -> Option<NodeId> {
        match *self {
            MeshError::NotFinite { node, .. }
            | MeshError::OutOfPlane { node, .. }
            | MeshError::UnreferencedNodes { node, .. } => Some(node),
            MeshError::NoElements
            | MeshError::TooManyElements { .. }
            | MeshError::MixedDimensions { .. }
            | MeshError::Folded { .. }
            | MeshError::NodeOutOfRange { .. }
            | MeshError::RepeatedNode { .. }
            | MeshError::Degenerate { .. }
            | MeshError::Inverted { .. }
            | MeshError::Duplicate { .. }
            | MeshError::GroupIndex { .. }
            | MeshError::FaceNotInMesh { .. }
            | MeshError::BeamElement { .. }
            | MeshError::BeamThickness { .. }
            | MeshError::BeamCells { .. }
            | MeshError::BeamSize { .. }
            | MeshError::BeamOrigin { .. }
            | MeshError::BeamTooLarge { .. }
            | MeshError::TorusRadii { .. }
            | MeshError::TorusElement { .. }
            | MeshError::TorusCells { .. } => None,
        }
    }
}

/// "1 element is", "3 elements are".
fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// "3, 1, 4, 2".
fn list(nodes: &[NodeId]) -> String {
    nodes.iter().map(NodeId::to_string).collect::<Vec<_>>().join(", ")
}

//! From a file's nodes, elements and physical groups to those of a mesh.

use super::lines::Problem;
use super::{Raw, RawElement, RawNode};
use crate::mesh::error::MeshError;
use crate::mesh::topology::{Block, ElementId, Groups, NodeId, sorted};
use std::collections::{BTreeMap, BTreeSet};
use tensormass_kernels::ElementEntry;

const KINDS: [&str; 4] = ["point", "curve", "surface", "volume"];

/// What a mesh is made of, and where it came from.
pub(super) struct Assembled {
    pub(super) nodes: Vec<[f64; 3]>,
    pub(super) blocks: Vec<Block>,
    pub(super) groups: Groups,
    pub(super) warnings: Vec<String>,
    pub(super) source: Source,
}

/// The lines that nodes, faces and elements came from.
pub(super) struct Source {
    node_lines: Vec<u32>,
    element_lines: Vec<u32>,
    faces: Vec<(Vec<NodeId>, u32)>,
    elements_line: usize,
}

impl Source {
    /// The line of the first culprit.
    pub(super) fn line_of(&self, error: &MeshError) -> usize {
        let line = if let MeshError::FaceNotInMesh { face, .. } = error {
            self.faces.iter().find(|(nodes, _)| sorted(nodes) == sorted(face)).map(|found| found.1)
        } else if let Some(element) = error.element() {
            self.element_lines.get(element.index()).copied()
        } else {
            error.node().and_then(|node| self.node_lines.get(node.index()).copied())
        };
        line.map_or(self.elements_line, |line| line as usize)
    }
}

/// Numbers nodes and elements, and turns physical groups into mesh groups.
pub(super) fn assemble(mut raw: Raw) -> Result<Assembled, Problem> {
    let mut warnings = Vec::new();
    raw.nodes.sort_by_key(|node| node.tag);
    if let Some(pair) = raw.nodes.windows(2).find(|pair| pair[0].tag == pair[1].tag) {
        return Err(Problem {
            line: pair[1].line as usize,
            reason: format!("node {} is given twice, also at line {}", pair[1].tag, pair[0].line),
            remedy: "give each node its own tag".to_owned(),
        });
    }
    let mut places: Places = Default::default();
    for (of_dimension, elements) in places.iter_mut().zip(&raw.elements) {
        *of_dimension = elements.iter().map(|element| find_nodes(&raw.nodes, element)).collect::<Result<_, _>>()?;
    }
    // Bodies are solid, or plane where nothing is solid.
    let body = if raw.elements[3].is_empty() && !raw.elements[2].is_empty() { 2 } else { 3 };
    let ids = number_nodes(&raw, &places, &mut warnings)?;
    let id = |place: usize| ids[place].expect("only nodes that no element of this dimension uses were left out");

    // Kind by kind, in the order in which the file begins them; within a kind in the order of the file.
    let mut kinds: Vec<&'static ElementEntry> = vec![];
    for kind in raw.elements[body].iter().filter_map(|element| element.kind) {
        if !kinds.iter().any(|known| std::ptr::eq(*known, kind)) {
            kinds.push(kind);
        }
    }
    let (mut blocks, mut order) = (vec![], vec![]);
    for kind in kinds {
        let mut block = Block { element: kind, nodes: vec![] };
        for (place, element) in raw.elements[body].iter().enumerate() {
            if element.kind.is_some_and(|other| std::ptr::eq(other, kind)) {
                block.nodes.extend(places[body][place].iter().map(|place| id(*place)));
                order.push(place);
            }
        }
        blocks.push(block);
    }
    let faces: Vec<Vec<NodeId>> =
        places[body - 1].iter().map(|nodes| nodes.iter().map(|place| id(*place)).collect()).collect();
    let groups =
        collect_groups(&raw, &places, &Numbers { ids: &ids, body, order: &order, faces: &faces }, &mut warnings);

    let kept = || raw.nodes.iter().zip(&ids).filter(|(_, id)| id.is_some()).map(|(node, _)| node);
    Ok(Assembled {
        nodes: kept().map(|node| node.position).collect(),
        blocks,
        groups,
        warnings,
        source: Source {
            node_lines: kept().map(|node| node.line).collect(),
            element_lines: order.iter().map(|place| raw.elements[body][*place].line).collect(),
            faces: faces.into_iter().zip(raw.elements[body - 1].iter().map(|element| element.line)).collect(),
            elements_line: raw.elements_line,
        },
    })
}

/// By dimension, the places of each element's nodes among the nodes sorted by tag, in the order of the element's
/// declaration.
type Places = [Vec<Vec<usize>>; 4];

/// The places of an element's nodes among the nodes sorted by tag, in the order of its declaration.
fn find_nodes(nodes: &[RawNode], element: &RawElement) -> Result<Vec<usize>, Problem> {
    let mut places = vec![0; element.nodes.len()];
    for (k, &tag) in element.nodes.iter().enumerate() {
        let ours = element.kind.map_or(k, |kind| kind.info.gmsh.order[k]);
        places[ours] = find_node(nodes, tag).ok_or_else(|| Problem {
            line: element.line as usize,
            reason: format!("the element names node {tag}, which $Nodes does not give"),
            remedy: "correct the node's tag, or save the mesh again".to_owned(),
        })?;
    }
    Ok(places)
}

fn find_node(nodes: &[RawNode], tag: u64) -> Option<usize> {
    // Tags are dense in most files, so that the first guess is right.
    let guess = usize::try_from(tag.checked_sub(nodes.first()?.tag)?).ok()?;
    if nodes.get(guess).is_some_and(|node| node.tag == tag) {
        return Some(guess);
    }
    nodes.binary_search_by_key(&tag, |node| node.tag).ok()
}

/// The number of each node in the mesh; `None` for those that geometry points alone use, such as the centre of an arc.
fn number_nodes(raw: &Raw, places: &Places, warnings: &mut Vec<String>) -> Result<Vec<Option<NodeId>>, Problem> {
    let mut on_point: Vec<bool> = raw.nodes.iter().map(|node| node.on_point).collect();
    for place in places[0].iter().flatten() {
        on_point[*place] = true;
    }
    for place in places[1..].iter().flatten().flatten() {
        on_point[*place] = false;
    }
    let mut next = 0;
    let mut ids = Vec::with_capacity(raw.nodes.len());
    for on_point in &on_point {
        ids.push((!on_point).then_some(NodeId(next)));
        next = next.checked_add(u32::from(!on_point)).ok_or_else(|| Problem {
            line: raw.elements_line,
            reason: format!("the mesh has more than {} nodes", u32::MAX),
            remedy: "use a coarser mesh".to_owned(),
        })?;
    }
    if let Some(first) = on_point.iter().position(|on_point| *on_point) {
        let node = &raw.nodes[first];
        warnings.push(format!(
            "left out {} that only geometry points use, first is Gmsh node {} at line {}",
            match on_point.iter().filter(|on_point| **on_point).count() {
                1 => "1 node".to_owned(),
                count => format!("{count} nodes"),
            },
            node.tag,
            node.line
        ));
    }
    Ok(ids)
}

/// How a file's nodes and elements are numbered in the mesh.
struct Numbers<'a> {
    ids: &'a [Option<NodeId>],
    /// The dimension of the body.
    body: usize,
    /// The place in the file of each element of the mesh.
    order: &'a [usize],
    /// The faces, which are elements of one dimension less.
    faces: &'a [Vec<NodeId>],
}

/// The mesh groups of all physical groups.
fn collect_groups(raw: &Raw, places: &Places, numbers: &Numbers, warnings: &mut Vec<String>) -> Groups {
    let mut groups = Groups::default();
    let mut number = vec![0; numbers.order.len()];
    for (element, place) in numbers.order.iter().enumerate() {
        // A number that does not fit is beyond what a mesh can have, which the mesh refuses first.
        number[*place] = element as u32;
    }
    let mut used: BTreeSet<(usize, u32)> = BTreeSet::new();
    for (dimension, kind) in KINDS.iter().enumerate() {
        // Elements by physical tag, in file order.
        let mut members: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (place, element) in raw.elements[dimension].iter().enumerate() {
            for tag in &raw.sets.list[element.set as usize] {
                members.entry(*tag).or_default().push(place);
            }
        }
        for (tag, elements) in members {
            used.insert((dimension, tag));
            let name = raw.names.get(&(dimension, tag)).map_or_else(
                || {
                    // Tags are separate in each dimension, hence the dimension in the name.
                    let name = format!("{kind}_{tag}");
                    warnings.push(format!("physical {kind} {tag} has no name; its group is called `{name}`"));
                    name
                },
                |(name, _)| name.clone(),
            );
            if dimension == numbers.body {
                let group = groups.elements.entry(name).or_default();
                group.extend(elements.iter().map(|place| ElementId(number[*place])));
                continue;
            }
            let nodes: Vec<NodeId> = elements
                .iter()
                .flat_map(|place| &places[dimension][*place])
                .filter_map(|place| numbers.ids[*place])
                .collect();
            if nodes.is_empty() {
                warnings.push(format!("physical {kind} `{name}` has no nodes that elements use; it gives no group"));
                continue;
            }
            if dimension + 1 == numbers.body {
                let faces = elements.iter().map(|place| numbers.faces[*place].clone());
                groups.faces.entry(name.clone()).or_default().extend(faces);
            } else if dimension == 1 {
                // The ends of a line come first in Gmsh's order.
                let node = |place: &usize| numbers.ids[*place];
                let ends = |line: &usize| Some([node(&places[1][*line][0])?, node(&places[1][*line][1])?]);
                groups.edges.entry(name.clone()).or_default().extend(elements.iter().filter_map(ends));
            }
            groups.nodes.entry(name).or_default().extend(nodes);
        }
    }
    for (key, (name, line)) in raw.names.iter().filter(|(key, _)| !used.contains(key)) {
        warnings.push(format!("physical {} `{name}` (line {line}) has no elements; it gives no group", KINDS[key.0]));
    }
    groups
}

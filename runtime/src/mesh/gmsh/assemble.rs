//! From a file's nodes, elements and physical groups to those of a mesh.

use super::lines::Problem;
use super::{Raw, RawElement, RawNode};
use crate::mesh::error::MeshError;
use crate::mesh::tet_mesh::{ElementId, Groups, NodeId, sorted};
use std::collections::{BTreeMap, BTreeSet};

const KINDS: [&str; 4] = ["point", "curve", "surface", "volume"];

/// What a mesh is made of, and where it came from.
pub(super) struct Assembled {
    pub(super) nodes: Vec<[f64; 3]>,
    pub(super) tets: Vec<[NodeId; 4]>,
    pub(super) groups: Groups,
    pub(super) warnings: Vec<String>,
    pub(super) source: Source,
}

/// The lines that nodes, triangles and elements came from.
pub(super) struct Source {
    node_lines: Vec<u32>,
    tet_lines: Vec<u32>,
    triangles: Vec<([NodeId; 3], u32)>,
    elements_line: usize,
}

impl Source {
    /// The line of the first culprit.
    pub(super) fn line_of(&self, error: &MeshError) -> usize {
        let line = if let MeshError::FaceNotInMesh { face, .. } = error {
            self.triangles.iter().find(|(nodes, _)| sorted(*nodes) == sorted(*face)).map(|found| found.1)
        } else if let Some(element) = error.element() {
            self.tet_lines.get(element.index()).copied()
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
    let mut places: [Vec<[usize; 4]>; 4] = Default::default();
    for (dimension, elements) in raw.elements.iter().enumerate() {
        places[dimension] =
            elements.iter().map(|element| find_nodes(&raw.nodes, element, dimension)).collect::<Result<_, _>>()?;
    }
    let ids = number_nodes(&raw, &places, &mut warnings)?;
    let id = |place: usize| ids[place].expect("only nodes that no element of this dimension uses were left out");

    let tets = places[3].iter().map(|nodes| nodes.map(id)).collect();
    let triangles: Vec<[NodeId; 3]> = places[2].iter().map(|[a, b, c, _]| [a, b, c].map(|&place| id(place))).collect();
    let groups = collect_groups(&raw, &places, &ids, &triangles, &mut warnings);

    let kept = || raw.nodes.iter().zip(&ids).filter(|(_, id)| id.is_some()).map(|(node, _)| node);
    Ok(Assembled {
        nodes: kept().map(|node| node.position).collect(),
        tets,
        groups,
        warnings,
        source: Source {
            node_lines: kept().map(|node| node.line).collect(),
            tet_lines: raw.elements[3].iter().map(|element| element.line).collect(),
            triangles: triangles.into_iter().zip(raw.elements[2].iter().map(|element| element.line)).collect(),
            elements_line: raw.elements_line,
        },
    })
}

/// The places of an element's nodes among the nodes sorted by tag.
fn find_nodes(nodes: &[RawNode], element: &RawElement, dimension: usize) -> Result<[usize; 4], Problem> {
    let mut places = [0; 4];
    for (place, &tag) in places.iter_mut().zip(&element.nodes[..=dimension]) {
        *place = find_node(nodes, tag).ok_or_else(|| Problem {
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
fn number_nodes(
    raw: &Raw,
    places: &[Vec<[usize; 4]>; 4],
    warnings: &mut Vec<String>,
) -> Result<Vec<Option<NodeId>>, Problem> {
    let mut on_point: Vec<bool> = raw.nodes.iter().map(|node| node.on_point).collect();
    for [place, ..] in &places[0] {
        on_point[*place] = true;
    }
    for (dimension, places) in places.iter().enumerate().skip(1) {
        for place in places.iter().flat_map(|nodes| &nodes[..=dimension]) {
            on_point[*place] = false;
        }
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

/// The mesh groups of all physical groups.
fn collect_groups(
    raw: &Raw,
    places: &[Vec<[usize; 4]>; 4],
    ids: &[Option<NodeId>],
    triangles: &[[NodeId; 3]],
    warnings: &mut Vec<String>,
) -> Groups {
    let mut groups = Groups::default();
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
            if dimension == 3 {
                let group = groups.elements.entry(name).or_default();
                // A number that does not fit is beyond TetMesh::MAX_ELEMENTS, which the mesh refuses first.
                group.extend(elements.iter().map(|place| ElementId(*place as u32)));
                continue;
            }
            let nodes: Vec<NodeId> = elements
                .iter()
                .flat_map(|place| &places[dimension][*place][..=dimension])
                .filter_map(|place| ids[*place])
                .collect();
            if nodes.is_empty() {
                warnings.push(format!("physical {kind} `{name}` has no nodes that elements use; it gives no group"));
                continue;
            }
            if dimension == 2 {
                groups.faces.entry(name.clone()).or_default().extend(elements.iter().map(|place| triangles[*place]));
            }
            groups.nodes.entry(name).or_default().extend(nodes);
        }
    }
    for (key, (name, line)) in raw.names.iter().filter(|(key, _)| !used.contains(key)) {
        warnings.push(format!("physical {} `{name}` (line {line}) has no elements; it gives no group", KINDS[key.0]));
    }
    groups
}

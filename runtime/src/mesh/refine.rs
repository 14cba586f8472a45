//! Uniform refinement: every element cut into smaller ones of its own kind.
//!
//! A simplex is cut along the lattice of Freudenthal (Bey, Numer. Math. 85, 2000): its parts are of at most three shapes, however
//! many there are. Faces are cut alike from both sides, whatever the order of an element's nodes, so that the mesh stays conforming.

use std::collections::{BTreeMap, HashMap};

use tensormass_kernels::ElementInfo;

use super::error::MeshError;
use super::topology::{Block, ElementId, FaceId, Groups, Mesh, NodeId, face_key};

/// Nodes of elements lie on lattices of so many places along an edge, or of a divisor.
const PLACES: usize = 12;

impl Mesh {
    /// The mesh with each edge of its elements cut into `n` parts: `n` squared (plane) or cubed (solid) elements for each, one element's
    /// next to each other and in its place.
    ///
    /// Nodes keep their numbers; new ones are where the elements' own functions put them, so that curved elements stay curved. What
    /// comes of a group's elements, faces and edges belongs to it, and new nodes to those groups of nodes of whose faces or edges
    /// they are.
    ///
    /// # Errors
    /// [`MeshError`] if the elements are too many to number, or what comes of curved elements is not valid.
    pub fn refined(&self, n: usize) -> Result<Mesh, MeshError> {
        if n < 2 {
            return Ok(self.clone());
        }
        for block in self.blocks() {
            let (info, parts) = (block.info(), n.checked_pow(block.info().dimension as u32));
            let (elements, limit) =
                (parts.unwrap_or(usize::MAX).saturating_mul(self.len()), Mesh::MAX_SLOTS / info.nodes);
            if elements > limit {
                return Err(MeshError::TooManyElements { elements, limit });
            }
        }
        let whole = whole(self.blocks(), n);
        let patterns: Vec<Pattern> = self.blocks().iter().map(|block| Pattern::new(block.info(), n, whole)).collect();
        let mut nodes = Nodes::of(self, &patterns, whole);
        let mut blocks = vec![];
        for (block, pattern) in self.blocks().iter().zip(&patterns) {
            let mut children = vec![];
            for element in block.elements() {
                let numbers = nodes.within(element, pattern);
                children.extend(pattern.children.iter().flatten().map(|k| numbers[*k]));
            }
            blocks.push(Block { element: block.element, nodes: children });
        }
        let groups = self.groups_of(&patterns, &mut nodes, n);
        Mesh::new(nodes.positions, blocks, groups)
    }

    /// The groups of the parts.
    fn groups_of(&self, patterns: &[Pattern], nodes: &mut Nodes, n: usize) -> Groups {
        let mut groups = Groups::default();
        for (name, elements) in &self.groups().elements {
            let parts = |e: &ElementId| {
                let count = self.pattern(*e, patterns).children.len() as u32;
                (e.0 * count..(e.0 + 1) * count).map(ElementId)
            };
            groups.elements.insert(name.clone(), elements.iter().flat_map(parts).collect());
        }
        let faces: HashMap<_, FaceId> = match self.groups().faces.is_empty() {
            true => HashMap::new(),
            false => self.faces().map(|(face, nodes)| (face_key(&nodes), face)).collect(),
        };
        for (name, of) in &self.groups().faces {
            let mut parts = vec![];
            for face in of.iter().filter_map(|face| faces.get(&face_key(face))) {
                let pattern = self.pattern(face.element, patterns);
                let numbers = nodes.within(self.element_nodes(face.element), pattern);
                let part = |nodes: &Vec<usize>| nodes.iter().map(|k| numbers[*k]).collect::<Vec<NodeId>>();
                parts.extend(pattern.faces[face.face as usize].iter().map(part));
            }
            groups.faces.insert(name.clone(), parts);
        }
        let along = if self.groups().edges.is_empty() { BTreeMap::new() } else { nodes.along_edges() };
        let mut on_edges: BTreeMap<&String, Vec<NodeId>> = BTreeMap::new();
        for (name, of) in &self.groups().edges {
            let mut parts = vec![];
            for [a, b] in of {
                let between = along.get(&[*a.min(b), *a.max(b)]).map_or(&[][..], Vec::as_slice);
                on_edges.entry(name).or_default().extend(between.iter().map(|(_, node)| *node));
                let ends = between.iter().filter(|(weight, _)| (weight * n as u64).is_multiple_of(nodes.whole));
                let chain: Vec<NodeId> =
                    [*a.max(b)].into_iter().chain(ends.map(|(_, node)| *node)).chain([*a.min(b)]).collect();
                parts.extend(chain.windows(2).map(|pair| [pair[0], pair[1]]));
            }
            groups.edges.insert(name.clone(), parts);
        }
        for (name, own) in &self.groups().nodes {
            let on_faces = groups.faces.get(name).into_iter().flatten().flatten();
            let added = on_faces.chain(on_edges.get(name).into_iter().flatten());
            groups.nodes.insert(name.clone(), own.iter().chain(added).copied().collect());
        }
        groups
    }

    /// How an element is cut.
    fn pattern<'a>(&self, element: ElementId, patterns: &'a [Pattern]) -> &'a Pattern {
        let kind = self.kind(element).info.name;
        let place = self.blocks().iter().position(|block| block.info().name == kind);
        // An element is of one of the blocks.
        &patterns[place.unwrap_or(0)]
    }
}

/// Where reference coordinates run: the first ones in a simplex, the others from -1 to 1.
#[derive(Clone, Copy)]
struct Shape {
    simplex: usize,
    lines: usize,
}

impl Shape {
    fn of(info: &ElementInfo) -> Self {
        let simplex = match info.shape {
            "tetrahedron" => 3,
            "triangle" | "prism" => 2,
            // Segments, quadrangles and hexahedra.
            _ => 0,
        };
        Self { simplex, lines: info.dimension - simplex }
    }

    /// Its corners.
    fn corners(self) -> Vec<[f64; 3]> {
        let of_simplex = (0..=self.simplex).map(|k| std::array::from_fn(|axis| f64::from(u8::from(axis + 1 == k))));
        let mut corners: Vec<[f64; 3]> = of_simplex.collect();
        for axis in self.simplex..self.simplex + self.lines {
            let ends = |corner: [f64; 3]| {
                [-1.0, 1.0].map(|end| std::array::from_fn(|i| if i == axis { end } else { corner[i] }))
            };
            corners = corners.into_iter().flat_map(ends).collect();
        }
        corners
    }

    /// The function of a corner that is 1 there and 0 at the others: a product of linear ones.
    fn weight(self, corner: &[f64; 3], x: &[f64; 3]) -> f64 {
        let simplex = &x[..self.simplex];
        let own = corner[..self.simplex].iter().position(|c| *c == 1.0);
        let of_simplex = own.map_or_else(|| 1.0 - simplex.iter().sum::<f64>(), |axis| simplex[axis]);
        let lines = self.simplex..self.simplex + self.lines;
        lines.fold(of_simplex, |product, axis| product * 0.5 * (1.0 + corner[axis] * x[axis]))
    }

    /// Its parts.
    fn parts(self, n: usize) -> Vec<Part> {
        let mut parts = simplices(self.simplex, n);
        for axis in self.simplex..self.simplex + self.lines {
            let along = |part: Part| {
                (0..n).map(move |k| {
                    let mut part = part;
                    part.origin[axis] = (2 * k + 1) as f64 / n as f64 - 1.0;
                    part.axes[axis][axis] = 1.0 / n as f64;
                    part
                })
            };
            parts = parts.into_iter().flat_map(along).collect();
        }
        parts
    }
}

/// A part in reference coordinates of the whole: where its own origin is, and its own axes.
#[derive(Clone, Copy)]
struct Part {
    origin: [f64; 3],
    axes: [[f64; 3]; 3],
}

impl Part {
    fn at(&self, x: &[f64; 3]) -> [f64; 3] {
        let along = |i: usize| (0..3).map(|axis| self.axes[axis][i] * x[axis]).sum::<f64>();
        std::array::from_fn(|i| self.origin[i] + along(i))
    }
}

/// The parts of a simplex of so many dimensions. In the coordinates s_k = x_k + x_(k+1) + .. it is the part of a box where n >= s_1 >=
/// s_2 >= .., and the parts are those of Kuhn's simplices of the box's cells that lie within: from a cell's corner along its edges, in
/// any order of the axes.
fn simplices(dimension: usize, n: usize) -> Vec<Part> {
    let orders: &[&[usize]] = match dimension {
        3 => &[&[0, 1, 2], &[0, 2, 1], &[1, 0, 2], &[1, 2, 0], &[2, 0, 1], &[2, 1, 0]],
        2 => &[&[0, 1], &[1, 0]],
        _ => return vec![Part { origin: [0.0; 3], axes: [[0.0; 3]; 3] }],
    };
    let mut parts = vec![];
    for cell in 0..n.pow(dimension as u32) {
        let corner: [usize; 3] =
            std::array::from_fn(|k| if k < dimension { cell / n.pow((dimension - 1 - k) as u32) % n } else { 0 });
        for order in orders {
            let mut places = vec![corner];
            for axis in *order {
                let mut next = places[places.len() - 1];
                next[*axis] += 1;
                places.push(next);
            }
            if !places.iter().all(|s| s.is_sorted_by(|a, b| a >= b)) {
                continue;
            }
            let x = |s: &[usize; 3]| -> [f64; 3] {
                std::array::from_fn(|k| (s[k] - s.get(k + 1).unwrap_or(&0)) as f64 / n as f64)
            };
            let from = x(&places[0]);
            let mut axes = [[0.0; 3]; 3];
            for (axis, place) in axes.iter_mut().zip(&places[1..]) {
                let end = x(place);
                *axis = std::array::from_fn(|i| end[i] - from[i]);
            }
            // Odd orders of the axes are mirror images.
            let odd =
                (0..dimension).flat_map(|a| (a..dimension).map(move |b| (a, b))).filter(|(a, b)| order[*a] > order[*b]);
            if odd.count() % 2 == 1 {
                axes.swap(0, 1);
            }
            parts.push(Part { origin: from, axes });
        }
    }
    parts
}

/// What tells a place in an element from others: the corners whose functions are not 0 there, and these as whole numbers. On a face or
/// an edge these are its own corners, so that neighbours agree on it.
type Key = Vec<(u32, u64)>;

/// How elements of one kind are cut.
struct Pattern {
    /// Which nodes of the element are its corners.
    corners: Vec<usize>,
    /// The values of the element's functions at each node of its parts.
    functions: Vec<Vec<f64>>,
    /// What each of these nodes is told by, with places among the corners.
    keys: Vec<Key>,
    /// Which of these the element's own nodes are.
    own: Vec<usize>,
    /// The nodes of each part.
    children: Vec<Vec<usize>>,
    /// The nodes of the parts of each face.
    faces: Vec<Vec<Vec<usize>>>,
}

impl Pattern {
    fn new(info: &ElementInfo, n: usize, whole: u64) -> Self {
        let shape = Shape::of(info);
        let corners = shape.corners();
        let key = |x: &[f64; 3]| -> Key {
            let weights = corners.iter().map(|corner| (shape.weight(corner, x) * whole as f64).round() as u64);
            (0..).zip(weights).filter(|(_, weight)| *weight > 0).collect()
        };
        let mut found: HashMap<Key, usize> = HashMap::new();
        let (mut keys, mut functions) = (vec![], vec![]);
        let mut number = |x: [f64; 3]| {
            *found.entry(key(&x)).or_insert_with(|| {
                keys.push(key(&x));
                functions.push(info.functions_at(x).0);
                keys.len() - 1
            })
        };
        let nodes_of = |part: &Part| info.reference.iter().map(|x| number(part.at(x))).collect::<Vec<_>>();
        let children: Vec<Vec<usize>> = shape.parts(n).iter().map(nodes_of).collect();
        let own = info.reference.iter().map(|x| number(*x)).collect();
        let nodes = corners.iter().filter_map(|corner| info.reference.iter().position(|x| x == corner));
        let nodes: Vec<usize> = nodes.collect();
        let faces = info.faces.iter().map(|face| {
            let within = |k: &usize| keys[*k].iter().all(|(corner, _)| face.nodes.contains(&nodes[*corner as usize]));
            let of_children = children.iter().flat_map(|child| {
                info.faces.iter().map(|face| face.nodes.iter().map(|j| child[*j]).collect::<Vec<usize>>())
            });
            of_children.filter(|nodes| nodes.iter().all(within)).collect()
        });
        let faces = faces.collect();
        Self { corners: nodes, functions, keys, own, children, faces }
    }

    /// The key of one of its nodes in an element.
    fn key(&self, k: usize, element: &[NodeId]) -> Key {
        let mut key: Key = self.keys[k].iter().map(|(c, w)| (element[self.corners[*c as usize]].0, *w)).collect();
        key.sort_unstable();
        key
    }
}

/// The weight of a corner at itself, of all elements alike. Weights are products of a simplex's function and one of each line, each a
/// multiple of 1 over the places along an edge: of as many parts as can be numbered less than 2^40, which roundings do not reach.
fn whole(blocks: &[Block], n: usize) -> u64 {
    let factors = |block: &Block| {
        let Shape { simplex, lines } = Shape::of(block.info());
        lines + usize::from(simplex > 0)
    };
    ((PLACES * n) as u64).pow(blocks.iter().map(factors).max().unwrap_or(1) as u32)
}

/// The nodes of the parts, as far as they are numbered.
struct Nodes {
    positions: Vec<[f64; 3]>,
    numbers: HashMap<Key, NodeId>,
    whole: u64,
}

impl Nodes {
    /// Those that there are before.
    fn of(mesh: &Mesh, patterns: &[Pattern], whole: u64) -> Self {
        let mut numbers = HashMap::new();
        for (block, pattern) in mesh.blocks().iter().zip(patterns) {
            for element in block.elements() {
                for (k, node) in pattern.own.iter().zip(element) {
                    numbers.insert(pattern.key(*k, element), *node);
                }
            }
        }
        Self { positions: mesh.nodes().to_vec(), numbers, whole }
    }

    /// The numbers of an element's places.
    fn within(&mut self, element: &[NodeId], pattern: &Pattern) -> Vec<NodeId> {
        let Self { positions, numbers, .. } = self;
        let mut number = |k: usize| {
            *numbers.entry(pattern.key(k, element)).or_insert_with(|| {
                // From one node on: far from the origin no more is lost than positions have lost.
                let first = positions[element[0].index()];
                let mut x = first;
                for (value, node) in pattern.functions[k].iter().zip(element).skip(1) {
                    let at = positions[node.index()];
                    x = std::array::from_fn(|i| x[i] + value * (at[i] - first[i]));
                }
                positions.push(x);
                // `as u32` is exact: the slots can be numbered, and every node has one.
                NodeId(positions.len() as u32 - 1)
            })
        };
        (0..pattern.keys.len()).map(&mut number).collect()
    }

    /// The nodes between the ends of each edge, by the weight of the lesser end, ascending.
    fn along_edges(&self) -> BTreeMap<[NodeId; 2], Vec<(u64, NodeId)>> {
        let mut along: BTreeMap<[NodeId; 2], Vec<(u64, NodeId)>> = BTreeMap::new();
        for (key, node) in &self.numbers {
            if let [(a, weight), (b, _)] = key[..] {
                along.entry([NodeId(a), NodeId(b)]).or_default().push((weight, *node));
            }
        }
        along.values_mut().for_each(|nodes| nodes.sort_unstable());
        along
    }
}

//! Meshes of any element, distorted, and quadrature that no element declares.

use tensormass_kernels::{ElementEntry, ElementInfo, elements};
use tensormass_runtime::mesh::{Block, Groups, Mesh, NodeId, beam_of};
use tensormass_testing::codegen::element::{ElementDeclaration, declarations};

use super::Random;

/// The elements of which bodies of this dimension can be made.
pub fn of_dimension(dimension: usize) -> impl Iterator<Item = &'static ElementEntry> {
    elements().iter().filter(move |e| e.info.dimension == dimension)
}

/// The unit cube, or the unit square, in n cells along each side.
pub fn unit(element: &'static ElementEntry, n: usize) -> Mesh {
    let thick = if element.info.dimension == 3 { n } else { 1 };
    beam_of(element, [1.0; 3], [n, n, thick], [0.0; 3]).unwrap_or_else(|e| panic!("{e}"))
}

/// The unit cube of boxes beside wedges: both are made on one lattice, so that their nodes have the same numbers.
pub fn boxes_beside_wedges(cells: usize) -> Mesh {
    let [boxes, wedges] = ["hexahedron_q1", "prism_p1"].map(|name| tensormass_kernels::element(name).expect("shipped"));
    let [of_boxes, of_wedges] = [boxes, wedges].map(|element| unit(element, cells));
    assert_eq!(of_boxes.nodes(), of_wedges.nodes());
    let part = |mesh: &Mesh, each: usize, left: bool| {
        let block = &mesh.blocks()[0];
        // Cells follow each other along z, then y, then x.
        let is_left = |e: usize| e / each / (cells * cells) <= cells / 2;
        let nodes = block.elements().enumerate().filter(|(e, _)| is_left(*e) == left).flat_map(|(_, n)| n);
        Block { element: block.element, nodes: nodes.copied().collect() }
    };
    let blocks = vec![part(&of_boxes, 1, true), part(&of_wedges, 2, false)];
    Mesh::new(of_boxes.nodes().to_vec(), blocks, Groups::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// The mesh with its nodes numbered at random.
pub fn renumbered(mesh: &Mesh, seed: u64) -> Mesh {
    let mut order: Vec<usize> = (0..mesh.nodes().len()).collect();
    let mut random = Random(seed);
    order.sort_by_cached_key(|_| random.vector(1.0)[0].to_bits());
    let mut number = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, old)| number[*old] = new as u32);
    let nodes = order.iter().map(|old| mesh.nodes()[*old]).collect();
    let block = |block: &Block| {
        let nodes = block.nodes.iter().map(|n| NodeId(number[n.index()])).collect();
        Block { element: block.element, nodes }
    };
    let blocks = mesh.blocks().iter().map(block).collect();
    Mesh::new(nodes, blocks, Groups::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// The two corners between which each node lies, or the node itself twice; a corner is a node of the linear element.
fn between(info: &ElementInfo) -> Vec<[usize; 2]> {
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
    let middle = |j: usize, [a, b]: [usize; 2]| {
        let [x, y, z] = [info.reference[j], info.reference[a], info.reference[b]];
        (0..3).all(|i| near(x[i], 0.5 * (y[i] + z[i])))
    };
    let pair = |j: usize| {
        let pairs = (0..info.nodes).flat_map(|a| (0..a).map(move |b| [a, b])).filter(|p| !p.contains(&j));
        // A node of a quadratic element that halves the distance of two others is that of an edge.
        let found = if info.order > 1 { pairs.into_iter().find(|p| middle(j, *p)) } else { None };
        found.unwrap_or([j, j])
    };
    (0..info.nodes).map(pair).collect()
}

/// The mesh with its inner corners moved at random by a part of the distance of corners, edges kept straight.
pub fn distorted(mesh: &Mesh, part: f64, seed: u64) -> Mesh {
    let surface = mesh.surface_nodes();
    let mut nodes = mesh.nodes().to_vec();
    let mut random = Random(seed);
    let plane = mesh.blocks()[0].info().dimension == 2;
    let mut ends: Vec<Option<[NodeId; 2]>> = vec![None; nodes.len()];
    for block in mesh.blocks() {
        let between = between(block.info());
        for element in block.elements() {
            for (node, [a, b]) in element.iter().zip(&between) {
                ends[node.index()] = Some([element[*a], element[*b]]);
            }
        }
    }
    let cells = (mesh.nodes().len() as f64).powf(1.0 / if plane { 2.0 } else { 3.0 }) - 1.0;
    for (n, ends) in ends.iter().enumerate() {
        let is_corner = ends.is_some_and(|[a, b]| a == b);
        if is_corner && surface.binary_search(&NodeId(n as u32)).is_err() {
            let [x, y, z] = random.vector(part / cells);
            let by = [x, y, if plane { 0.0 } else { z }];
            nodes[n] = std::array::from_fn(|i| nodes[n][i] + by[i]);
        }
    }
    let corners = nodes.clone();
    for (node, ends) in nodes.iter_mut().zip(ends) {
        if let Some([a, b]) = ends.filter(|[a, b]| a != b) {
            *node = std::array::from_fn(|i| 0.5 * (corners[a.index()][i] + corners[b.index()][i]));
        }
    }
    mesh.moved(nodes).unwrap_or_else(|e| panic!("{e}"))
}

/// The declaration of an element: its functions are polynomials.
pub fn declaration(info: &ElementInfo) -> ElementDeclaration {
    let all = declarations().expect("the build has read them");
    all.into_iter().find(|e| e.name == info.name).expect("a declared element")
}

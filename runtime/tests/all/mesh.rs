//! Meshes: the beam, groups, boundary, incidence, gradients, quality, and what is refused with which words.

mod files;
mod gmsh;
mod refine;
mod refused;

use std::collections::BTreeMap;
use tensormass_runtime::mesh::{
    ElementId, Groups, Incidence, Mesh, NodeId, Quality, Ring, beam, shape_gradients, torus_of,
};

/// The first cell's elements in the C++ baseline's beam of 20 x 10 x 10 cells, and its hashes.
const BASELINE_CELL: &[[u32; 4]] =
    &[[0, 121, 132, 133], [0, 121, 133, 122], [0, 122, 133, 1], [0, 132, 11, 133], [0, 11, 12, 133], [0, 1, 133, 12]];
const BASELINE_TETS: u64 = 13_424_134_743_660_099_931;
const BASELINE_NODES: u64 = 6_866_057_066_873_688_151;

type Vec3 = [f64; 3];

/// splitmix64, scaled to [-1, 1): the same numbers on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        [self.next(), self.next(), self.next()]
    }
}

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn area_vector(mesh: &Mesh, face: &[NodeId]) -> Vec3 {
    let [a, b, c] = [0, 1, 2].map(|k| mesh.nodes()[face[k].index()]);
    cross(sub(b, a), sub(c, a)).map(|x| x / 2.0)
}

fn ids<const N: usize>(tets: &[[u32; N]]) -> Vec<[NodeId; N]> {
    tets.iter().map(|tet| tet.map(NodeId)).collect()
}

fn faces(of: &[[u32; 3]]) -> Vec<Vec<NodeId>> {
    of.iter().map(|face| face.map(NodeId).to_vec()).collect()
}

/// The two elements of Faure et al. 2012, figure 2: they share nodes 1, 2 and 3.
fn two_tets() -> Mesh {
    let nodes = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
    Mesh::tetrahedra(nodes, ids(&[[0, 1, 2, 3], [1, 2, 3, 4]]), Groups::default()).expect("a valid mesh")
}

/// A beam whose nodes are moved by up to a tenth of a cell.
fn distorted(seed: u64) -> Mesh {
    let straight = beam([2.0, 1.0, 1.0], [4, 2, 2], [0.0; 3]).expect("a valid beam");
    let mut random = Random(seed);
    let mut moved = || random.vector().map(|x| 0.05 * x);
    let nodes = straight.nodes().iter().map(|x| sub(*x, moved())).collect();
    Mesh::tetrahedra(nodes, straight.tets().to_vec(), straight.groups().clone()).expect("a valid mesh")
}

const BEAMS: &[(Vec3, [usize; 3], Vec3)] = &[
    ([1.0, 1.0, 1.0], [1, 1, 1], [0.0, 0.0, 0.0]),
    ([5.0, 1.0, 1.0], [20, 10, 10], [0.0, 0.0, 0.0]),
    ([0.3, 0.02, 7.0], [2, 3, 5], [-4.0, 0.1, 1e-3]),
    ([1e-6, 2e-6, 3e-6], [3, 1, 2], [0.0, 0.0, 0.0]),
    ([1e7, 1e6, 1e6], [5, 1, 1], [1e8, -1e8, 0.0]),
];

#[test]
fn beams_fill_their_box_with_equal_elements() {
    for &(size, cells, origin) in BEAMS {
        let mesh = beam(size, cells, origin).expect("a valid beam");
        let [nx, ny, nz] = cells;
        assert_eq!(mesh.nodes().len(), (nx + 1) * (ny + 1) * (nz + 1), "{cells:?}");
        assert_eq!(mesh.tets().len(), 6 * nx * ny * nz, "{cells:?}");

        // A coordinate is rounded to half an ulp of its size; relative to a cell's edge, that is `error`. A volume has
        // three edges, each with two ends, and its determinant three more roundings.
        let error = (0..3)
            .map(|c| (origin[c].abs() + size[c]) * f64::EPSILON / (size[c] / cells[c] as f64))
            .fold(0.0, f64::max);
        let volume = size.iter().product::<f64>();
        let each = volume / mesh.tets().len() as f64;
        for element in mesh.elements() {
            assert!((mesh.volume(element) / each - 1.0).abs() <= 8.0 * error, "{cells:?} element {element}");
        }
        let total = mesh.total_volume();
        assert!((total / volume - 1.0).abs() <= 8.0 * error * mesh.tets().len() as f64, "{cells:?}: {total}");
        let [lower, upper] = mesh.bounding_box();
        assert_eq!((lower, upper), (origin, [0, 1, 2].map(|c| origin[c] + size[c])), "{cells:?}");
    }
}

#[test]
fn beams_have_the_reference_numbering() {
    let unit = beam([1.0; 3], [1, 1, 1], [0.0; 3]).expect("a valid beam");
    assert_eq!(unit.nodes()[1], [0.0, 0.0, 1.0], "z runs fastest");
    assert_eq!(unit.nodes()[4], [1.0, 0.0, 0.0], "x runs slowest");
    for tet in unit.tets() {
        assert!(tet.contains(&NodeId(0)) && tet.contains(&NodeId(7)), "{tet:?} lacks the main diagonal");
    }

    // FNV-1a over numbers and over the bits of coordinates, as printed by the C++ baseline for its 12,000 elements.
    let mesh = beam([5.0, 1.0, 1.0], [20, 10, 10], [0.0; 3]).expect("a valid beam");
    let hash = |words: &mut dyn Iterator<Item = u64>| {
        words.fold(1_469_598_103_934_665_603_u64, |hash, word| (hash ^ word).wrapping_mul(1_099_511_628_211))
    };
    assert_eq!(mesh.tets()[..6], ids(BASELINE_CELL));
    assert_eq!(hash(&mut mesh.tets().iter().flatten().map(|node| node.0.into())), BASELINE_TETS);
    assert_eq!(hash(&mut mesh.nodes().iter().flatten().map(|x| x.to_bits())), BASELINE_NODES);
}

#[test]
fn interior_faces_are_shared_by_exactly_two() {
    for &(size, cells, origin) in BEAMS {
        let mesh = beam(size, cells, origin).expect("a valid beam");
        let mut shared: BTreeMap<[NodeId; 3], usize> = BTreeMap::new();
        for [a, b, c, d] in mesh.tets() {
            for face in [[b, c, d], [a, c, d], [a, b, d], [a, b, c]] {
                let mut face = face.map(|node| *node);
                face.sort_unstable();
                *shared.entry(face).or_default() += 1;
            }
        }
        assert!(shared.values().all(|count| *count <= 2), "{cells:?}: a face has three elements");
        let outside = shared.values().filter(|count| **count == 1).count();
        let [nx, ny, nz] = cells;
        assert_eq!(outside, 4 * (nx * ny + ny * nz + nz * nx), "{cells:?}: two triangles a square of the surface");
        assert_eq!(mesh.boundary_faces().len(), outside, "{cells:?}");
    }
}

#[test]
fn boundaries_are_closed_and_outward() {
    let distorted = distorted(1);
    let straight: Vec<Mesh> = BEAMS.iter().map(|b| beam(b.0, b.1, b.2).expect("a valid beam")).collect();
    for (case, mesh) in straight.iter().chain([&distorted, &two_tets()]).enumerate() {
        let faces = mesh.boundary_faces();
        let areas: Vec<Vec3> = faces.iter().map(|face| area_vector(mesh, face)).collect();
        let total: f64 = areas.iter().map(|a| dot(*a, *a).sqrt()).sum();
        let [lower, upper] = mesh.bounding_box();
        // Edges carry the rounding of the coordinates; relative to the least extent of the box that is `error`.
        let reach = lower.iter().chain(&upper).fold(0.0_f64, |reach, x| reach.max(x.abs()));
        let extent = (0..3).map(|c| upper[c] - lower[c]).fold(f64::INFINITY, f64::min);
        let error = f64::EPSILON * (1.0 + reach / extent) * faces.len() as f64;
        for c in 0..3 {
            let sum: f64 = areas.iter().map(|a| a[c]).sum();
            assert!(sum.abs() <= error * total, "case {case}: area vectors sum to {sum} along {c}");
        }
        if let Some((size, _, _)) = BEAMS.get(case) {
            let [a, b, c] = *size;
            let expected = 2.0 * (a * b + b * c + c * a);
            assert!((total / expected - 1.0).abs() <= error, "case {case}: area {total}, not {expected}");
        }
        // Gauss: the flux of x through an outward boundary is three times the volume.
        let flux: f64 = faces.iter().zip(&areas).map(|(f, a)| dot(sub(mesh.nodes()[f[0].index()], lower), *a)).sum();
        let volume = mesh.total_volume();
        assert!((flux / 3.0 / volume - 1.0).abs() <= 8.0 * error * reach.max(1.0), "case {case}: {flux} {volume}");
        let mut nodes: Vec<NodeId> = faces.into_iter().flatten().collect();
        nodes.sort_unstable();
        nodes.dedup();
        assert_eq!(mesh.surface_nodes(), nodes, "case {case}");
    }
    let first = two_tets().boundary_faces();
    assert_eq!(first, faces(&[[0, 3, 2], [0, 1, 3], [0, 2, 1], [2, 3, 4], [1, 4, 3], [1, 2, 4]]), "order");
}

#[test]
fn beam_sides_are_groups() {
    let (size, cells, origin) = ([2.0, 1.0, 0.5], [4, 3, 2], [1.0, -1.0, 0.25]);
    let mesh = beam(size, cells, origin).expect("a valid beam");
    let names = ["xmax", "xmin", "ymax", "ymin", "zmax", "zmin"];
    assert_eq!(mesh.node_group_names().collect::<Vec<_>>(), names);
    assert_eq!(mesh.face_group_names().collect::<Vec<_>>(), names);
    assert_eq!(mesh.element_group_names().count(), 0);
    assert_eq!((mesh.node_group("top"), mesh.face_group("top"), mesh.element_group("xmin")), (None, None, None));
    let [lower, upper] = mesh.bounding_box();
    for (axis, letter) in ["x", "y", "z"].iter().enumerate() {
        for (end, place, sign) in [("min", lower[axis], -1.0), ("max", upper[axis], 1.0)] {
            let name = format!("{letter}{end}");
            let nodes = mesh.node_group(&name).expect("a side");
            let on_side: Vec<NodeId> =
                (0..60).map(NodeId).filter(|node| mesh.nodes()[node.index()][axis] == place).collect();
            assert_eq!(nodes, on_side, "{name}");
            let faces = mesh.face_group(&name).expect("a side");
            let area: f64 = faces.iter().map(|face| sign * area_vector(&mesh, face)[axis]).sum();
            let expected = size.iter().product::<f64>() / size[axis];
            assert!((area - expected).abs() < 1e-14 * expected * faces.len() as f64, "{name}: {area}, not {expected}");
        }
    }
}

#[test]
fn incidence_inverts_the_connectivity() {
    let two = Incidence::new(&two_tets());
    // Node 2 is node 2 of E0 and node 1 of E1 (Faure et al. 2012, section 3.1): slots 4*0 + 2 and 4*1 + 1.
    assert_eq!(two.of(NodeId(2)), [2, 5]);
    assert_eq!((two.offsets(), two.max_valence()), (&[0, 1, 3, 5, 7, 8][..], 2));

    for mesh in [two_tets(), distorted(2), beam([5.0, 1.0, 1.0], [7, 3, 2], [0.0; 3]).expect("a valid beam")] {
        let incidence = Incidence::new(&mesh);
        let mut seen = vec![0; 4 * mesh.tets().len()];
        for node in (0..mesh.nodes().len() as u32).map(NodeId) {
            let slots = incidence.of(node);
            assert!(!slots.is_empty() && slots.is_sorted(), "node {node}");
            for &slot in slots {
                assert_eq!(mesh.tets()[slot as usize / 4][slot as usize % 4], node, "slot {slot}");
                seen[slot as usize] += 1;
            }
        }
        assert!(seen.iter().all(|count| *count == 1), "every slot belongs to one node");
        assert_eq!(incidence.slots().len(), seen.len());
    }
    let inner = beam([1.0; 3], [2, 2, 2], [0.0; 3]).expect("a valid beam");
    assert_eq!(Incidence::new(&inner).max_valence(), 24, "an inner node of Kuhn's split (paper: N_n = 24)");
}

#[test]
fn gradients_reproduce_linear_fields() {
    for seed in 0..200 {
        let mut random = Random(seed);
        let corners = [(); 4].map(|()| random.vector());
        let field = [(); 3].map(|()| random.vector());
        let shape = shape_gradients(&corners);
        let gradients = shape.all();
        let values = corners.map(|x| field.map(|row| dot(row, x)));
        // Each gradient is a quotient of products of edges: its relative error is epsilon times the ratio of the longest
        // edges' product to the determinant. Values have an error of three roundings.
        let longest = (0..4).flat_map(|a| (0..a).map(move |b| (a, b))).map(|(a, b)| sub(corners[a], corners[b]));
        let longest = longest.map(|edge| dot(edge, edge).sqrt()).fold(0.0, f64::max);
        let condition = 1.0 + longest.powi(3) / (6.0 * shape.volume.abs());
        let size: f64 = gradients.iter().map(|g| dot(*g, *g).sqrt()).sum();
        let tolerance = 32.0 * f64::EPSILON * condition * (1.0 + size * 3.0);
        for i in 0..3 {
            for k in 0..3 {
                let found: f64 = (0..4).map(|j| values[j][i] * gradients[j][k]).sum();
                assert!((found - field[i][k]).abs() <= tolerance, "seed {seed}: G[{i}][{k}] = {found}");
            }
            // Lambda_i is 1 at its own node and 0 at the others.
            for j in 0..4 {
                let value = dot(shape.gradients[i], sub(corners[j], corners[0]));
                let expected = if j == i + 1 { 1.0 } else { 0.0 };
                assert!((value - expected).abs() <= tolerance, "seed {seed}: Lambda_{} at node {j}", i + 1);
            }
        }
    }
}

#[test]
fn gradients_do_not_feel_the_distance_from_the_origin() {
    for seed in 0..20 {
        let mut random = Random(seed);
        // On a lattice of 2^-20 m, moving by 2^30 m is exact, so that the gradients must not change by a bit.
        let near = [(); 4].map(|()| random.vector().map(|x| (x * 1_048_576.0).round() / 1_048_576.0));
        let far = near.map(|x| x.map(|c| c + 1_073_741_824.0));
        assert_eq!(shape_gradients(&near), shape_gradients(&far), "seed {seed}");
    }
}

#[test]
fn quality_knows_the_regular_tetrahedron() {
    let regular = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let mesh = Mesh::oriented(regular, ids(&[[0, 1, 2, 3]]), Groups::default()).expect("a valid mesh");
    let quality = Quality::of(&mesh);
    let third = (1.0_f64 / 3.0).acos().to_degrees();
    for (name, found, expected) in [
        ("volume", quality.min_volume, 8.0 / 3.0),
        ("altitude", quality.min_altitude, 4.0 / 3.0_f64.sqrt()),
        ("least angle", quality.min_dihedral, third),
        ("greatest angle", quality.max_dihedral, third),
        ("radius ratio", quality.worst_radius_ratio, 1.0),
    ] {
        assert!((found / expected - 1.0).abs() < 8.0 * f64::EPSILON, "{name}: {found}, not {expected}");
    }
    let text = Quality::of(&two_tets()).to_string();
    assert_eq!(
        text,
        "element volumes 1.667e-1 to 3.333e-1 m3, least altitude 5.774e-1 m\n\
         dihedral angles 54.7 to 90.0 degrees, worst radius ratio 0.732 (1 is regular) in element 0"
    );
}

#[test]
fn groups_are_normalised() {
    let two = two_tets();
    let groups = Groups {
        nodes: BTreeMap::from([("n".to_owned(), [3, 1, 3].map(NodeId).to_vec())]),
        elements: BTreeMap::from([("e".to_owned(), [1, 0, 1].map(ElementId).to_vec())]),
        // Inward, repeated in another order, and an interior face, whose orientation is the caller's.
        faces: BTreeMap::from([("f".to_owned(), faces(&[[0, 1, 2], [2, 0, 1], [1, 2, 3]]))]),
        edges: BTreeMap::new(),
    };
    let mesh = Mesh::tetrahedra(two.nodes().to_vec(), two.tets().to_vec(), groups).expect("a valid mesh");
    assert_eq!(mesh.node_group("n"), Some(&[NodeId(1), NodeId(3)][..]));
    assert_eq!(mesh.element_group("e"), Some(&[ElementId(0), ElementId(1)][..]));
    assert_eq!(mesh.face_group("f"), Some(&faces(&[[0, 2, 1], [1, 2, 3]])[..]));
}

#[test]
fn inverted_elements_are_turned_on_request() {
    let nodes = two_tets().nodes().to_vec();
    let tets = ids(&[[0, 2, 1, 3], [1, 2, 3, 4]]);
    let mesh = Mesh::oriented(nodes, tets, Groups::default()).expect("a valid mesh");
    assert_eq!(mesh, two_tets());
}

/// A torus of each solid element: its volume comes near 2 pi^2 R r^2 with the element's order, its boundary is closed and
/// encloses its tube and not its hole; its reference volume (TORUS_2014) is that of linear tetrahedra.
#[test]
fn toruses_are_closed_rings() {
    let ring = Ring { major: 7.5e-3, minor: 2.5e-3, centre: [0.1, 0.0, -0.2], axis: 1 };
    let volume = 2.0 * std::f64::consts::PI.powi(2) * ring.major * ring.minor * ring.minor;
    let mut made = 0;
    for element in tensormass_runtime::elements().iter().filter(|e| e.info.dimension == 3) {
        let mesh = torus_of(element, ring, [4, 78]).unwrap_or_else(|e| panic!("{}: {e}", element.info.name));
        let error = (mesh.total_volume() / volume - 1.0).abs();
        // Polygons of 16 corners around the tube lack 2.7 %, quadratic sides a hundredth of that.
        assert!(error < if element.info.order == 1 { 0.03 } else { 1e-3 }, "{}: {error:e}", element.info.name);
        let mut areas = [0.0; 3];
        for face in mesh.boundary_faces().iter().filter(|_| element.info.shape == "tetrahedron") {
            let area = area_vector(&mesh, face);
            areas = std::array::from_fn(|i| areas[i] + area[i]);
        }
        assert!(areas.iter().all(|a| a.abs() < 1e-15), "{}: open by {areas:?}", element.info.name);
        for (point, inside) in
            [([0.1 + 7.5e-3, 0.0, -0.2], true), ([0.1, 0.0, -0.2], false), ([0.1, 0.0, -0.2 + 8e-3], true)]
        {
            assert_eq!(mesh.encloses(point), inside, "{}: {point:?}", element.info.name);
        }
        made += 1;
    }
    assert!(made >= 5, "{made} solid elements");
    let mesh = torus_of(tensormass_runtime::linear_tetrahedron(), ring, [4, 78]).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((mesh.nodes().len(), mesh.len()), (1950, 7488));
    assert!((mesh.total_volume() / 9.002_596_946_822_25e-7 - 1.0).abs() < 1e-12, "{:e}", mesh.total_volume());
    for (ring, cells) in [(Ring { minor: 8e-3, ..ring }, [4, 78]), (ring, [4, 2]), (ring, [0, 8])] {
        assert!(torus_of(tensormass_runtime::linear_tetrahedron(), ring, cells).is_err(), "{ring:?}, {cells:?}");
    }
}

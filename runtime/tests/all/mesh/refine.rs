//! Refined meshes: conforming, as large as before, with the groups of what they were made of; and what scenes make of them.

use std::collections::BTreeSet;
use std::path::Path;

use tensormass_runtime::mesh::gmsh::read;
use tensormass_runtime::mesh::{Groups, Mesh, NodeId, Orientation};
use tensormass_runtime::model::build;
use tensormass_runtime::{elements, laws};

use super::files::area;
use super::two_tets;
use crate::support::elements::{boxes_beside_wedges, distorted, unit};
use crate::support::{done, parameters_text, probe, repository, scene};

/// Positions as whole numbers of a lattice so fine.
fn places(mesh: &Mesh, nodes: &[NodeId], lattice: usize) -> BTreeSet<[i64; 3]> {
    mesh.positions(nodes).into_iter().map(|x| x.map(|x| (x * lattice as f64).round() as i64)).collect()
}

/// What every refined mesh must be. A face of one element that is no face of its neighbour would be one of the boundary.
fn check(name: &str, mesh: &Mesh, n: usize, tolerance: f64) -> Mesh {
    let fine = mesh.refined(n).unwrap_or_else(|e| panic!("{name}: {e}"));
    let dimension = mesh.blocks()[0].info().dimension as u32;
    let close =
        |what: &str, a: f64, b: f64| assert!((a / b - 1.0).abs() <= tolerance, "{name}, {n}, {what}: {a} and {b}");
    assert_eq!(fine.len(), mesh.len() * n.pow(dimension), "{name}, {n}");
    assert_eq!(fine.boundary().len(), mesh.boundary().len() * n.pow(dimension - 1), "{name}, {n}: it is conforming");
    assert_eq!(fine.nodes()[..mesh.nodes().len()], *mesh.nodes(), "{name}, {n}: nodes keep their numbers");
    assert_eq!(fine.parts(), mesh.parts(), "{name}, {n}");
    close("volume", fine.total_volume(), mesh.total_volume());
    close("surface", area(&fine, None), area(mesh, None));
    for (group, faces) in &mesh.groups().faces {
        let parts = fine.face_group(group).expect("it is kept");
        assert_eq!(parts.len(), faces.len() * n.pow(dimension - 1), "{name}, {n}: {group}");
        close(group, area(&fine, Some(group)), area(mesh, Some(group)));
        let of_faces: BTreeSet<NodeId> = parts.iter().flatten().copied().collect();
        let nodes = fine.node_group(group).expect("faces come with their nodes");
        assert!(nodes.iter().copied().eq(of_faces), "{name}, {n}: {group}");
    }
    for (group, of) in &mesh.groups().elements {
        let parts = fine.element_group(group).expect("it is kept");
        let volume = |mesh: &Mesh, of: &[_]| of.iter().map(|e| mesh.volume(*e)).sum::<f64>();
        assert_eq!(parts.len(), of.len() * n.pow(dimension), "{name}, {n}: {group}");
        close(group, volume(&fine, parts), volume(mesh, of));
    }
    fine
}

/// Structured meshes become those of as many cells: as many nodes, and each side's in the same places.
#[test]
fn structured_meshes_become_finer_ones() {
    for element in elements().iter().filter(|e| e.info.dimension > 1) {
        for n in [2, 3] {
            let fine = check(element.info.name, &unit(element, 2), n, 1e-12);
            let made = unit(element, 2 * n);
            assert_eq!(fine.nodes().len(), made.nodes().len(), "{}, {n}", element.info.name);
            for group in made.node_group_names() {
                let [a, b] = [&fine, &made].map(|m| places(m, m.node_group(group).expect("a side"), 4 * n));
                assert_eq!(a, b, "{}, {n}: {group}", element.info.name);
            }
            // Of straight sides, if not of flat ones; those of the boundary stay where they are.
            check(element.info.name, &distorted(&unit(element, 2), 0.3, 5), n, 1e-12);
        }
    }
    check("boxes beside wedges", &boxes_beside_wedges(4), 3, 1e-12);
}

/// Cut once into four and twice into two are the same parts: as many nodes in the same places.
#[test]
fn parts_of_parts_are_parts() {
    for element in elements().iter().filter(|e| e.info.dimension > 1) {
        let mesh = distorted(&unit(element, 2), 0.3, 5);
        let [once, twice] = [mesh.refined(4), mesh.refined(2).and_then(|m| m.refined(2))].map(|m| m.expect("valid"));
        let all = |mesh: &Mesh| {
            let nodes: Vec<NodeId> = (0..mesh.nodes().len() as u32).map(NodeId).collect();
            places(mesh, &nodes, 1 << 20)
        };
        // Diagonals of a cut tetrahedron's middle may be others; of four places along an edge none is on one of them alone.
        if element.info.order == 1 || element.info.shape != "tetrahedron" {
            assert_eq!(all(&once), all(&twice), "{}", element.info.name);
        }
        assert_eq!((once.nodes().len(), once.len()), (twice.nodes().len(), twice.len()), "{}", element.info.name);
    }
}

/// Files of Gmsh, curved ones too: with the element's own functions the parts are where the element is.
#[test]
fn files_are_refined_with_their_groups() {
    for (name, tolerance) in [("ball", 2e-3), ("extruded", 1e-12), ("boxes", 1e-12), ("plane", 1e-12)] {
        for version in [2, 4] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/{name}_{version}.msh"));
            let mesh = read(&path, Orientation::Refuse).unwrap_or_else(|e| panic!("{e}")).mesh;
            for n in [1, 2, 5] {
                check(name, &mesh, n, tolerance);
            }
        }
    }
}

/// A group of nodes along a curve has the new nodes of its edges and no others, not even those of an edge between two of its nodes.
#[test]
fn curves_are_their_edges() {
    let coarse = two_tets();
    let id = NodeId;
    let mut groups = Groups::default();
    // Two edges of three of a triangle.
    groups.nodes.insert("rim".into(), vec![id(0), id(1), id(2)]);
    groups.edges.insert("rim".into(), vec![[id(0), id(1)], [id(2), id(1)]]);
    groups.nodes.insert("points".into(), vec![id(0), id(3)]);
    let mesh = Mesh::new(coarse.nodes().to_vec(), coarse.blocks().to_vec(), groups).expect("valid");
    for fine in [mesh.refined(4).expect("valid"), mesh.refined(2).and_then(|m| m.refined(2)).expect("valid")] {
        let rim = fine.node_group("rim").expect("it is kept");
        assert_eq!(rim.len(), 9);
        let corners = mesh.nodes();
        let on = |[a, b]: [usize; 2], x: &[f64; 3]| {
            (0..=4).any(|k| {
                (0..3).all(|i| {
                    (corners[a][i] + 0.25 * f64::from(k) * (corners[b][i] - corners[a][i]) - x[i]).abs() < 1e-12
                })
            })
        };
        assert!(fine.positions(rim).iter().all(|x| on([0, 1], x) || on([1, 2], x)));
        assert_eq!(fine.groups().edges["rim"].len(), 8);
        assert_eq!(fine.node_group("points"), Some(&[id(0), id(3)][..]));
    }
}

#[test]
fn what_cannot_be_numbered_is_refused() {
    let refused = two_tets().refined(1 << 20).expect_err("2^61 elements").to_string();
    assert!(refused.contains("more than the 1073741823 that can be numbered"), "{refused}");
}

/// The scene of a file, its lower side held, under its weight; refined so often.
fn sagging(file: &str, law: &str, parameters: &str, refine: usize) -> String {
    let path = repository("runtime/tests/data").join(file);
    format!(
        "[mesh]\nfile = {path:?}\nrefine = {refine}\n[[material]]\nlaw = \"{law}\"\ndensity = 1000.0\nparameters = {parameters}\n\
         [[boundary]]\nnodes = \"near(z, zmin)\"\nfix = [\"x\", \"y\", \"z\"]\n[[load]]\nkind = \"gravity\"\n\
         acceleration = [1.0, 0.0, 0.0]\n[solver]\nintegrator = \"static\"\nprecision = \"f64\"\ncg = {{ tolerance = 1e-10 }}\n\
         [[probe]]\nname = \"work\"\nkind = \"energy\"\npart = \"external\"\n"
    )
}

/// The functions of a mesh are among those of its refined one, so that this gives way more: Galerkin's method, of a linear law.
#[test]
fn a_refined_body_gives_way_more() {
    let law = laws().iter().find(|l| l.info.structure.linear && l.damping.is_none()).expect("a linear law");
    for file in ["extruded_4.msh", "boxes_4.msh"] {
        let work = |n: usize| {
            -probe(&done(&scene::<&str>(&sagging(file, law.info.name, &parameters_text(law), n), &[])), "work")
        };
        let [once, twice, four] = [1, 2, 4].map(work);
        assert!(once < twice * (1.0 - 1e-3) && twice < four * (1.0 - 1e-4), "{file}: {once}, {twice}, {four}");
        assert!(four - twice < twice - once, "{file}: {once}, {twice}, {four}");
    }
}

/// Values for each element of the file go to its parts; a file of as many as there are parts does not fit.
#[test]
fn values_for_each_element_are_those_of_the_file() {
    let own = |law: &tensormass_runtime::LawEntry| {
        law.info.parameters.iter().find(|p| p.direction && p.per_element).map(|p| p.name)
    };
    let Some((law, name)) = laws().iter().find_map(|law| Some((law, own(law)?))) else { return };
    let rows: Vec<String> = (0..6).map(|e| format!("[1.0, {e}.0, 0.0]")).collect();
    let text = parameters_text(law);
    let from = text.find(&format!("{name} = [")).expect("it has no default here");
    let end = from + text[from..].find(']').expect("an array");
    let each = format!("{name} = {{ per_element = [{}] }}", rows.join(", "));
    let all = [&text[..from], &each, &text[end + 1..]].concat();
    let model = build(&scene::<&str>(&sagging("extruded_4.msh", law.info.name, &all, 2), &[])).expect("it fits");
    for e in model.mesh.elements() {
        let (parent, mut place) = (f64::from(e.0 / 8), 0);
        for p in law.info.parameters {
            let found = &model.parameters(e)[place..place + p.len];
            place += p.len;
            if p.name == name {
                assert!((found[1] / found[0] - parent).abs() < 1e-12, "{e}: {found:?}");
            }
        }
    }
    let short = all.replace(", [1.0, 5.0, 0.0]", "");
    let refused = build(&scene::<&str>(&sagging("extruded_4.msh", law.info.name, &short, 2), &[]))
        .expect_err("5 of 6")
        .to_string();
    assert!(refused.contains("there are 5 values for 6 elements"), "{refused}");
    assert!(refused.contains("as it is before it is refined"), "{refused}");
}

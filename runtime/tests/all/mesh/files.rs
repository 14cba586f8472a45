//! Meshes as Gmsh 4.15 writes them: curved quadratic tetrahedra, boxes beside wedges, quadratic boxes, a plane body of
//! quadratic triangles beside quadrangles; each in both versions of the format.

use std::path::Path;

use tensormass_runtime::mesh::gmsh::read;
use tensormass_runtime::mesh::{Mesh, Orientation, integrals};

fn mesh(name: &str, version: u32) -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/{name}_{version}.msh"));
    read(&path, Orientation::Refuse).unwrap_or_else(|e| panic!("{e}")).mesh
}

/// The measure of a group of faces, or of the whole boundary.
pub fn area(mesh: &Mesh, group: Option<&str>) -> f64 {
    let members: Option<Vec<_>> = group.map(|name| {
        let mut faces = mesh.face_group(name).unwrap_or_else(|| panic!("no group {name}")).to_vec();
        faces.iter_mut().for_each(|face| face.sort_unstable());
        faces
    });
    let faces = mesh.boundary().into_iter().filter(|face| {
        let mut nodes = mesh.face_nodes(*face);
        nodes.sort_unstable();
        members.as_ref().is_none_or(|m| m.contains(&nodes))
    });
    faces.map(|f| integrals(mesh.face_kind(f), &mesh.positions(&mesh.face_nodes(f))).iter().sum::<f64>()).sum()
}

/// Name, kinds with their numbers of elements, volume, boundary, a group of faces with its area; and how exactly these are
/// the true body's: curved elements approximate a ball.
fn check(name: &str, kinds: &[(&str, usize)], volume: f64, boundary: f64, (group, part): (&str, f64), tolerance: f64) {
    for version in [2, 4] {
        let mesh = mesh(name, version);
        // Kinds in the order of the file, which is the version's.
        let mut found: Vec<(&str, usize)> = mesh.blocks().iter().map(|b| (b.info().name, b.len())).collect();
        found.sort_unstable();
        assert_eq!(found, kinds, "{name} {version}");
        let close = |what: &str, found: f64, wanted: f64| {
            assert!((found / wanted - 1.0).abs() < tolerance, "{name} {version}: {what} {found}, not {wanted}");
        };
        close("volume", mesh.total_volume(), volume);
        close("boundary", area(&mesh, None), boundary);
        close(group, area(&mesh, Some(group)), part);
    }
}

#[test]
fn meshes_of_gmsh_are_read_with_all_elements() {
    let ball = 4.0 / 3.0 * std::f64::consts::PI;
    // Edges of .9 on a radius of 1; linear ones would miss a sixth of the ball.
    check("ball", &[("tetrahedron_p2", 50)], ball, 3.0 * ball, ("skin", 3.0 * ball), 0.01);
    check("extruded", &[("hexahedron_q1", 2), ("prism_p1", 4)], 2.0, 10.0, ("base", 2.0), 1e-12);
    check("boxes", &[("hexahedron_s2", 1)], 2.0, 10.0, ("base", 2.0), 1e-12);
    check("plane", &[("quadrangle_s2", 4), ("triangle_p2", 14)], 2.0, 6.0, ("base", 2.0), 1e-12);
}

/// Element groups name elements of the mesh, whatever the order of kinds in the file.
#[test]
fn groups_of_mixed_meshes_are_their_elements() {
    for version in [2, 4] {
        let mesh = mesh("extruded", version);
        for (group, kind, left) in [("boxes", "hexahedron_q1", true), ("wedges", "prism_p1", false)] {
            for element in mesh.element_group(group).expect("a group") {
                assert_eq!(mesh.kind(*element).info.name, kind, "{version}");
                let middle: f64 = mesh.positions(mesh.element_nodes(*element)).iter().map(|x| x[0] - 1.0).sum();
                assert_eq!(middle < 0.0, left, "{version}: {group}");
            }
        }
    }
}

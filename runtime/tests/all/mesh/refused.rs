//! Meshes and beams that are refused, each with its message.

use super::{Vec3, faces, ids, two_tets};
use tensormass_runtime::mesh::{ElementId, Groups, Mesh, MeshError, NodeId, beam};

/// Spoils the mesh of two elements and gives the message of its refusal.
fn refusal(spoil: impl FnOnce(&mut Vec<Vec3>, &mut Vec<[NodeId; 4]>, &mut Groups)) -> String {
    let good = two_tets();
    let (mut nodes, mut tets, mut groups) = (good.nodes().to_vec(), good.tets().to_vec(), Groups::default());
    spoil(&mut nodes, &mut tets, &mut groups);
    Mesh::tetrahedra(nodes, tets, groups).expect_err("a mesh to refuse").to_string()
}

#[test]
fn bad_meshes_are_refused_with_a_remedy() {
    let check = |found: String, expected: &str| assert_eq!(found, expected);
    check(
        refusal(|_, tets, _| tets.clear()),
        "the mesh has no elements; give at least one tetrahedron (a surface mesh has none: fill it first)",
    );
    check(
        refusal(|nodes, _, _| {
            nodes[2][1] = f64::NAN;
            nodes[4][0] = f64::INFINITY;
        }),
        "2 nodes have a coordinate that is not finite, first is node 2 at (0, NaN, 0); correct its coordinates",
    );
    check(
        refusal(|_, tets, _| tets[1][3] = NodeId(5)),
        "1 element names a node that does not exist, first is element 1, which names node 5 of 5; \
         number nodes from 0 to the number of nodes less one",
    );
    check(
        refusal(|_, tets, _| tets[1][3] = NodeId(1)),
        "1 element names a node twice, first is element 1 with nodes 1, 2, 3, 1; \
         an element needs different nodes",
    );
    check(
        refusal(|nodes, _, _| nodes[4] = [0.25, 0.25, 0.5]),
        "1 element is degenerate (flat), first is element 1 with volume 0.000e0 m3 and nodes 1, 2, 3, 4; \
         remove such elements or move their nodes",
    );
    check(
        refusal(|nodes, _, _| nodes[4] = [0.25, 0.25, 0.5 + 1e-14]),
        "1 element is degenerate (flat), first is element 1 with volume 1.665e-15 m3 and nodes 1, 2, 3, 4; \
         remove such elements or move their nodes",
    );
    check(
        refusal(|_, tets, _| tets.iter_mut().for_each(|tet| tet.swap(0, 1))),
        "2 elements are inverted, first is element 0 with volume -1.667e-1 m3 and nodes 1, 0, 2, 3; \
         swap two of its nodes, or set `orient = true` to have that done for every such element",
    );
    check(
        refusal(|_, tets, _| tets.extend([tets[1], ids(&[[2, 3, 1, 4]])[0], tets[0]])),
        "3 elements have the nodes of an earlier one, first is element 2, which repeats element 1; remove one of them",
    );
    check(
        refusal(|nodes, _, _| nodes.extend([[0.0; 3], [1.0; 3]])),
        "2 nodes are used by no element, first is node 5; a node without an element has no mass: remove it",
    );
    check(
        refusal(|_, _, groups| drop(groups.nodes.insert("top".to_owned(), vec![NodeId(1), NodeId(9)]))),
        "node group `top` names node 9 of 5; number from 0 to 5 less one",
    );
    check(
        refusal(|_, _, groups| drop(groups.elements.insert("soft".to_owned(), vec![ElementId(2)]))),
        "element group `soft` names element 2 of 2; number from 0 to 2 less one",
    );
    check(
        refusal(|_, _, groups| drop(groups.faces.insert("side".to_owned(), faces(&[[0, 1, 7]])))),
        "face group `side` names node 7 of 5; number from 0 to 5 less one",
    );
    check(
        refusal(|_, _, groups| drop(groups.faces.insert("side".to_owned(), faces(&[[0, 1, 2], [0, 1, 4]])))),
        "1 face of face group `side` is not a face of any element, first is (0, 1, 4); \
         take faces whose nodes are those of one face of an element, or remove the group",
    );
}

#[test]
fn flatness_does_not_depend_on_the_unit() {
    // Beyond these, volumes leave the range of numbers that keep all their digits.
    for (scale, valid) in [(1e-110, false), (1e-100, true), (1e-6, true), (1e6, true), (1e102, true), (1e110, false)] {
        let nodes = two_tets().nodes().iter().map(|x| x.map(|c| c * scale)).collect();
        let mesh = Mesh::tetrahedra(nodes, two_tets().tets().to_vec(), Groups::default());
        assert_eq!(mesh.is_ok(), valid, "scale {scale}: {mesh:?}");
        let degenerate = matches!(mesh, Err(MeshError::Degenerate { count: 2, element: ElementId(0), .. }));
        assert_eq!(degenerate, !valid, "scale {scale}: {mesh:?}");
    }
    let nodes = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1e-12]];
    assert!(Mesh::tetrahedra(nodes, ids(&[[0, 1, 2, 3]]), Groups::default()).is_ok(), "thin, but not flat");
}

#[test]
fn bad_beams_are_refused_with_a_remedy() {
    let check = |size, cells, origin, expected: &str| {
        assert_eq!(beam(size, cells, origin).expect_err("a beam to refuse").to_string(), expected);
    };
    let (unit, one, zero) = ([1.0; 3], [1; 3], [0.0; 3]);
    check(unit, [1, 0, 1], zero, "the beam has no cells along y; give at least 1");
    check([1.0, 1.0, 0.0], one, zero, "the beam's size along z is 0 m; give a positive, finite length");
    check([-1.0, 1.0, 1.0], one, zero, "the beam's size along x is -1 m; give a positive, finite length");
    check([1.0, f64::NAN, 1.0], one, zero, "the beam's size along y is NaN m; give a positive, finite length");
    check([f64::INFINITY, 1.0, 1.0], one, zero, "the beam's size along x is inf m; give a positive, finite length");
    check(unit, one, [0.0, f64::NAN, 0.0], "the beam's origin along y is NaN m; give a finite coordinate");
    for cells in [[usize::MAX, 2, 2], [usize::MAX, 1, 1], [1 << 20, 1 << 20, 1 << 20], [178_956_971, 1, 1]] {
        let error = beam(unit, cells, zero).expect_err("a beam to refuse");
        assert_eq!(error, MeshError::BeamTooLarge { cells, limit: 1_073_741_823 });
    }
    // A billionth of a nanometre a cell, far from the origin: all nodes round to the same place.
    let error = beam([1e-18; 3], one, [1e3; 3]).expect_err("a beam to refuse");
    assert!(matches!(error, MeshError::Degenerate { count: 6, element: ElementId(0), .. }), "{error}");
}

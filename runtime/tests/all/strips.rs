//! Strips of tetrahedra: each element once, each strip three in a row, and the same forces as element by element.

use std::path::PathBuf;

use crate::support::elements::{distorted, renumbered, unit};
use crate::support::{Random, body, parameters};
use tensormass_kernels::strip::STRIP;
use tensormass_kernels::{laws, linear_tetrahedron};
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::cpu::{CpuBackend, CpuField, Engine, One, Precision};
use tensormass_runtime::mesh::gmsh;
use tensormass_runtime::mesh::{Block, ElementId, Groups, Mesh, NodeId, Orientation};
use tensormass_runtime::strips::strips;

/// Meshes, and how many of their elements are in strips, at least.
fn meshes() -> Vec<(&'static str, Mesh, f64)> {
    let tetrahedron = linear_tetrahedron();
    let ball = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/ball_4.msh");
    let ball = corners(&gmsh::read(&ball, Orientation::Refuse).unwrap_or_else(|e| panic!("{e}")).mesh);
    let cubes = distorted(&unit(tetrahedron, 5), 0.2, 3);
    vec![
        ("one cube", unit(tetrahedron, 1), 1.0),
        ("cubes", cubes.clone(), 0.97),
        ("cubes, numbered at random", renumbered(&cubes, 5), 0.97),
        ("a ball", ball, 0.9),
    ]
}

/// The linear tetrahedra of quadratic ones.
fn corners(mesh: &Mesh) -> Mesh {
    let mut used: Vec<NodeId> = mesh.elements().flat_map(|e| mesh.element_nodes(e)[..4].to_vec()).collect();
    used.sort_unstable();
    used.dedup();
    let number = |n: &NodeId| NodeId(used.partition_point(|other| other < n) as u32);
    let nodes = mesh.elements().flat_map(|e| mesh.element_nodes(e)[..4].iter().map(number)).collect();
    let block = Block { element: linear_tetrahedron(), nodes };
    let positions = used.iter().map(|n| mesh.nodes()[n.index()]).collect();
    Mesh::new(positions, vec![block], Groups::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn nodes(mesh: &Mesh) -> Vec<[u32; 4]> {
    let nodes = |e: ElementId| mesh.element_nodes(e).iter().map(|n| n.0).collect::<Vec<_>>();
    mesh.elements().map(|e| nodes(e).try_into().expect("a tetrahedron")).collect()
}

#[test]
fn each_element_is_in_one_strip_or_alone() {
    for (name, mesh, least) in meshes() {
        let elements = nodes(&mesh);
        let (found, alone) = strips(&elements);
        let mut met: Vec<u32> = found.iter().flatten().map(|m| m.element).chain(alone.iter().copied()).collect();
        met.sort_unstable();
        assert!(met.iter().copied().eq(0..elements.len() as u32), "{name}: {met:?}");
        let share = 1.0 - alone.len() as f64 / elements.len() as f64;
        assert!(share >= least, "{name}: {share:.3} of {} are in strips", elements.len());
        // Of those that are left no three are in a row.
        let left: Vec<[u32; 4]> = alone.iter().map(|e| elements[*e as usize]).collect();
        assert!(strips(&left).0.is_empty(), "{name}");
        for strip in found {
            let mut of_strip = [None; 6];
            for (member, numbers) in strip.iter().zip(STRIP) {
                let given = elements[member.element as usize];
                let mut order = member.order;
                for (place, number) in order.iter().zip(numbers) {
                    let node = given[usize::from(*place)];
                    assert_eq!(*of_strip[number].get_or_insert(node), node, "{name}: {strip:?}");
                }
                order.sort_unstable();
                assert_eq!(order, [0, 1, 2, 3], "{name}: {strip:?}");
            }
        }
    }
}

/// The same element twice shares every face with itself, and is no strip.
#[test]
fn what_is_there_twice_is_no_strip() {
    let (found, alone) = strips(&[[0, 1, 2, 3]; 3]);
    assert!(found.is_empty());
    assert_eq!(alone, [0, 1, 2]);
}

/// Roundings in a kernel's longest chain of operations, magnified by what cancels at strains of a tenth.
const ROUNDINGS: f64 = 200.0;

/// What a body of some law computes, against its elements one by one.
fn check<R: Precision>(name: &str, mesh: &Mesh, law: &'static tensormass_kernels::LawEntry, engine: Engine) {
    let body = body(mesh, law, &parameters(law), &[]);
    let mut random = Random(8);
    let mut vector = |size: f64| mesh.nodes().iter().map(|_| random.vector(size)).collect::<Vec<_>>();
    // Of edges of a fifth.
    let vectors = [vector(0.01), vector(1.0), vector(1.0)];
    let constants = &body.batches[0].constants;
    let mut wanted = vec![vec![[0.0; 3]; mesh.nodes().len()]; 4];
    for (e, nodes) in mesh.elements().zip(body.elements.iter()) {
        let one = One::new(linear_tetrahedron(), law, &body.rest[e.index()], constants);
        let [u, v, dv] = vectors.each_ref().map(|x| nodes.iter().map(|n| x[*n as usize]).collect::<Vec<_>>());
        let mut out = vec![[[0.0; 3]; 4]; 4];
        assert!(one.force(&u, &mut out[0]), "{name}: outside the domain");
        one.dforce(&u, &dv, &mut out[1]);
        one.diagonal(&u, &mut out[2]);
        one.ddamping([&u, &v, &dv], &mut out[3]);
        for (wanted, out) in wanted.iter_mut().zip(out) {
            for (n, x) in nodes.iter().zip(out) {
                (0..3).for_each(|c| wanted[*n as usize][c] += x[c]);
            }
        }
    }
    let backend = CpuBackend::<R>::new(&body);
    let mut field = CpuField::<R>::on(&backend, &body, engine);
    let [u, v, dv] = vectors.each_ref().map(|x| backend.upload(x));
    let mut out = vec![backend.zeros(), backend.zeros(), backend.zeros(), backend.zeros()];
    field.add_force(&backend, &u, &mut out[0]).unwrap_or_else(|e| panic!("{name}: {e}"));
    field.add_dforce_at(&backend, &u, &dv, 1.0, &mut out[1]);
    field.add_diagonal_at(&backend, &u, 1.0, &mut out[2]);
    field.add_ddamping(&backend, [&u, &v], &dv, 1.0, &mut out[3]);
    for ((kernel, wanted), out) in ["force", "dforce", "diagonal", "ddamping"].iter().zip(&wanted).zip(&out) {
        let found = backend.download(out);
        let numbers = wanted.as_flattened().iter().zip(found.as_flattened());
        let (size, off) =
            numbers.fold((0.0_f64, 0.0_f64), |(size, off), (a, b)| (size.max(a.abs()), off.max((a - b).abs())));
        let law = law.info.name;
        assert!(
            off <= ROUNDINGS * R::EPSILON * size,
            "{name} of {law}: {kernel} on {} is off by {off:.1e} of {size:.1e}",
            engine.name()
        );
    }
}

#[test]
fn strips_have_the_forces_of_their_elements() {
    for (name, mesh, _) in meshes() {
        for law in laws() {
            for engine in Engine::available() {
                check::<f32>(name, &mesh, law, engine);
                check::<f64>(name, &mesh, law, engine);
            }
        }
    }
}

//! The patch test: a mesh with moved interior nodes takes the homogeneous state that its boundary imposes, for every law.
//!
//! Tolerances of case PATCH: places 1e-12 (64 bits) and 2e-6 (32 bits: eps_m / strain = 6e-8 / .1 an element by textbook
//! forms, on a mesh of edge .3), energy 1e-12 and 1e-5; stresses err as energies do.

use crate::support::{
    REFERENCE, Random, body, case, number, numbers, reference, reference_parameters, relative, system,
};
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::cg::CgLimits;
use tensormass_runtime::cpu::Precision;
use tensormass_runtime::integrate::{NewtonLimits, SolverSettings, Statics};
use tensormass_runtime::mesh::{Groups, Mesh, NodeId};
use tensormass_runtime::scene::Preconditioner;
use tensormass_runtime::system::Integrator;
use tensormass_runtime::{LawEntry, laws};

type Matrix = [[f64; 3]; 3];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

struct Patch {
    mesh: Mesh,
    gradient: Matrix,
}

fn patch() -> Patch {
    let file = reference("patch_mesh.json");
    let list = |key: &str| file[key].as_array().expect("a list").clone();
    let nodes = list("nodes").iter().map(numbers::<3>).collect();
    let tets = list("tets").iter().map(|t| numbers::<4>(t).map(|n| NodeId(n as u32))).collect();
    let mesh = Mesh::tetrahedra(nodes, tets, Groups::default()).expect("the reference's mesh is valid");
    Patch { mesh, gradient: std::array::from_fn(|i| numbers(&file["G"][i])) }
}

/// Static equilibrium of one law, with each boundary node at G X; `places` and `energies` are tolerances.
fn check<R: Precision>(patch: &Patch, law: &'static LawEntry, tolerance: f64, places: f64, energies: f64) {
    let name = law.info.name;
    let nodes = patch.mesh.nodes();
    let moved = |n: usize| -> [f64; 3] { patch.gradient.map(|row| (0..3).map(|j| row[j] * nodes[n][j]).sum()) };
    let surface = patch.mesh.surface_nodes();
    assert_eq!((nodes.len() - surface.len(), patch.mesh.tets().len()), (8, 162), "the reference's mesh");
    let imposed: Vec<_> = surface.iter().flat_map(|n| (0..3).map(|c| (n.0, c as u8, moved(n.index())[c]))).collect();
    let mut body = body(&patch.mesh, law, &reference_parameters(law), &imposed);
    // From rest to G X over one unit of time, as a ramp would take it.
    for (motion, (_, _, value)) in body.motions.iter_mut().zip(&imposed) {
        *motion = tensormass_runtime::history::History::table(vec![(0.0, 0.0), (1.0, *value)]).expect("a ramp");
    }
    let mut system = system::<R>(body);
    let settings = SolverSettings {
        cg: CgLimits { tolerance, max_iterations: 500 },
        preconditioner: Preconditioner::Jacobi,
        newton: NewtonLimits { tolerance, max_iterations: 20 },
    };
    let mut state = system.initial_state([0.0; 3]);
    // From rest the first linear solution of any law is G X already: start elsewhere, so that Newton's method has to find it.
    let mut random = Random(3);
    let start: Vec<[f64; 3]> = nodes.iter().map(|_| random.vector(0.03)).collect();
    state.u = system.backend.upload(&start);
    system.backend.impose(&system.body.motions_at(0.0), &mut state.u);
    let mut statics = Statics::new(&system.backend, settings);
    let report = statics.step(&mut system, &mut state, 1.0).unwrap_or_else(|e| panic!("{name}: {e}"));
    let u = system.backend.download(&state.u);
    let error = (0..nodes.len()).flat_map(|n| (0..3).map(move |c| (n, c))).map(|(n, c)| (u[n][c] - moved(n)[c]).abs());
    let error = error.fold(0.0, f64::max);
    assert!(report.newton >= 2 || law.info.structure.linear, "{name}: {report:?}");
    println!("{name}: places {error:.1e}, {} Newton iterations, {} products", report.newton, report.products);
    assert!(error <= places, "{name}: a node is {error:.2e} m away from G X");

    let Some((_, key)) = REFERENCE.iter().find(|(law, _)| *law == name) else { return };
    let wanted = &case("PATCH")["expected"][key];
    // W counts from rest.
    let at_rest = system.initial_state([0.0; 3]).u;
    let [energy, rest] = [&state.u, &at_rest]
        .map(|u| system.field.potential_energy(&system.backend, u).unwrap_or_else(|e| panic!("{name}: {e}")));
    let energy = energy - rest;
    let off = relative(energy, number(&wanted["energy"]));
    // Cauchy's stress of the reference's P: P F' / J.
    let p: Matrix = std::array::from_fn(|i| numbers(&wanted["P"][i]));
    let f: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| patch.gradient[i][j] + f64::from(i == j)));
    let transposed: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| f[j][i]));
    let j = nalgebra::Matrix3::from_fn(|r, c| f[r][c]).determinant();
    let sigma = product(&p, &transposed).map(|row| row.map(|x| x / j));
    let size = sigma.as_flattened().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let worst = system
        .field
        .cauchy(&system.backend, &state.u)
        .iter()
        .flat_map(|s| s.iter().zip(sigma.as_flattened()).map(|(a, b)| (a - b).abs()))
        .fold(0.0, f64::max);
    println!("{name}: energy {off:.1e}, stress {:.1e}", worst / size);
    assert!(off <= energies, "{name}: the energy is {energy}, off by {off:.2e}");
    assert!(worst <= energies * size * 10.0, "{name}: a stress is off by {:.2e}", worst / size);
}

#[test]
fn in_64_bits() {
    let patch = patch();
    for law in laws() {
        check::<f64>(&patch, law, 1e-14, 1e-12, 1e-12);
    }
}

#[test]
fn in_32_bits() {
    let patch = patch();
    for law in laws() {
        check::<f32>(&patch, law, 1e-7, 2e-6, 1e-5);
    }
}

/// The mesh is not regular, or the test would be empty.
#[test]
fn the_mesh_is_distorted() {
    let volumes: Vec<f64> = patch().mesh.elements().map(|e| patch().mesh.volume(e)).collect();
    let (least, greatest) = volumes.iter().fold((f64::MAX, 0.0_f64), |(a, b), v| (a.min(*v), b.max(*v)));
    assert!(greatest > 1.5 * least, "{least} .. {greatest}");
}

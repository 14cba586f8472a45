//! Consistent masses: exact for motions that elements reproduce, frequencies from above and of the elements' order, and
//! implicit steps that solve with them.

use crate::support::elements::{boxes_beside_wedges, distorted, of_dimension, unit};
use crate::support::vibration::{DENSITY, frequency, matrix};
use crate::support::{body, done, parameters, probe, relative, scene, system};
use nalgebra::{DMatrix, DVector};
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::cg::CgLimits;
use tensormass_runtime::integrate::{ImplicitEuler, NewtonLimits, SolverSettings};
use tensormass_runtime::laws;
use tensormass_runtime::mass::MassMatrix;
use tensormass_runtime::mesh::Mesh;
use tensormass_runtime::scene::Preconditioner;
use tensormass_runtime::system::Integrator;

/// v . M v of one component.
fn form(m: &MassMatrix, v: &[f64]) -> f64 {
    let row = |i: usize| m.row(i).map(|k| m.values[k] * v[m.columns[k] as usize]).sum::<f64>();
    (0..m.len()).map(|i| v[i] * row(i)).sum()
}

/// The integral of v^2 over a mesh with these nodes, against v . M v.
fn check(what: &str, mesh: &Mesh, v: impl Fn(&[f64; 3]) -> f64, integral: f64) {
    let nodal: Vec<f64> = mesh.nodes().iter().map(v).collect();
    let found = form(&matrix(mesh), &nodal);
    // Positive terms, some hundreds of roundings each.
    assert!(relative(found, DENSITY * integral) <= 1e-12, "{what}: {found}, not {}", DENSITY * integral);
}

/// The unit cube or square, with corners inside moved: every element of every dimension, and boxes beside wedges.
fn meshes() -> impl Iterator<Item = (&'static str, Mesh)> {
    let mixed = ("boxes and wedges", boxes_beside_wedges(3));
    let each = of_dimension(3).chain(of_dimension(2)).map(|element| (element.info.name, unit(element, 3)));
    each.chain([mixed]).map(|(name, mesh)| (name, distorted(&mesh, 0.4, 7)))
}

#[test]
fn linear_velocities_have_their_kinetic_energy_on_distorted_meshes() {
    for (name, mesh) in meshes() {
        // In the plane all is at z = 0.
        let plane = mesh.blocks()[0].info().dimension == 2;
        let [a, b, c, d] = [0.7, -1.3, 0.4, if plane { 0.0 } else { 2.1 }];
        // The integral over the unit cube of (a + b x + c y + d z)^2: its mean squared, and the variance of each term.
        let mean = a + 0.5 * (b + c + d);
        let integral = mean * mean + (b * b + c * c + d * d) / 12.0;
        check(name, &mesh, |x| a + b * x[0] + c * x[1] + d * x[2], integral);
    }
}

#[test]
fn velocities_of_the_elements_order_have_their_kinetic_energy() {
    for element in of_dimension(3).chain(of_dimension(2)) {
        let p = element.info.order as i32;
        check(element.info.name, &unit(element, 2), |x| x[1].powi(p), 1.0 / f64::from(2 * p + 1));
    }
}

#[test]
fn matrices_are_symmetric_and_weigh_what_the_body_weighs() {
    for (name, mesh) in meshes() {
        let m = matrix(&mesh);
        let entry = |i: usize, j: usize| m.row(i).find(|k| m.columns[*k] as usize == j).map(|k| m.values[k]);
        for i in 0..m.len() {
            for k in m.row(i) {
                let (j, value) = (m.columns[k] as usize, m.values[k]);
                let other = entry(j, i).unwrap_or_else(|| panic!("{name}: no entry {j}, {i}"));
                // The same terms in the same order.
                assert_eq!(value.to_bits(), other.to_bits(), "{name}: entries {i}, {j}");
            }
            assert_eq!(Some(m.diagonal()[i]), entry(i, i), "{name}: diagonal {i}");
        }
        let weight: f64 = m.row_sums().iter().sum();
        assert!(relative(weight, DENSITY * mesh.total_volume()) <= 1e-13, "{name}: {weight}");
    }
}

/// Rayleigh's quotient over fewer motions is greater: consistent masses meet frequencies from above, with twice the order of
/// the element.
#[test]
fn frequencies_come_from_above_with_twice_the_order() {
    for element in of_dimension(3).chain(of_dimension(2)) {
        let [coarse, fine] = [2, 4].map(|cells| frequency(element, cells).consistent - 1.0);
        let order = (coarse / fine).log2();
        eprintln!("{}: {coarse:.2e}, {fine:.2e}, order {order:.2}", element.info.name);
        assert!(fine > 0.0 && coarse > fine, "{}: {coarse:e}, {fine:e}", element.info.name);
        assert!(order >= 2.0 * f64::from(element.info.order) - 0.2, "{}: order {order}", element.info.name);
    }
}

fn settings() -> SolverSettings {
    SolverSettings {
        cg: CgLimits { tolerance: 1e-13, max_iterations: 5000 },
        preconditioner: Preconditioner::Jacobi,
        newton: NewtonLimits { tolerance: 1e-13, max_iterations: 1 },
    }
}

/// One implicit step of a linear law with mass damping against the dense solution of
/// ((1 + h alpha) M + h^2 K) dv = -h alpha M v - h^2 K v.
#[test]
fn implicit_steps_solve_with_the_matrix() {
    let law = laws().iter().find(|law| law.info.structure.linear && law.damping.is_none()).expect("a linear law");
    let (h, alpha) = (0.01, 3.0);
    for (name, mesh) in meshes() {
        let mut body = body(&mesh, law, &parameters(law), &[]);
        body.mass_matrix = Some(matrix(&mesh));
        body.mass_damping = alpha;
        let n = mesh.nodes().len();
        let mut system = system::<f64>(body);
        let velocity: Vec<[f64; 3]> = mesh
            .nodes()
            .iter()
            .map(|x| [0.3 * x[1], x[0] * x[0], if x[2] == 0.0 { 0.0 } else { 0.1 * x[0] }])
            .collect();
        let m = matrix(&mesh);
        let dense = |c: usize, row: usize, column: usize| {
            let entry = if column % 3 == c { m.row(row).find(|k| m.columns[*k] as usize == column / 3) } else { None };
            entry.map_or(0.0, |k| m.values[k])
        };
        let mass = DMatrix::from_fn(3 * n, 3 * n, |i, j| dense(i % 3, i / 3, j));
        let zeros = system.backend.zeros();
        system.field.prepare(&system.backend, &zeros);
        let mut column = |k: usize| {
            let mut u = vec![[0.0; 3]; n];
            u[k / 3][k % 3] = 1.0;
            let mut f = system.backend.zeros();
            system.field.add_dforce(&system.backend, &system.backend.upload(&u), -1.0, &mut f);
            DVector::from_column_slice(system.backend.download(&f).as_flattened())
        };
        let stiffness = DMatrix::from_columns(&(0..3 * n).map(&mut column).collect::<Vec<_>>());
        let v = DVector::from_column_slice(velocity.as_flattened());
        let right = -(&mass * &v) * (h * alpha) - &stiffness * &v * (h * h);
        let left = mass * (1.0 + h * alpha) + stiffness * (h * h);
        let wanted = &v + left.cholesky().expect("positive").solve(&right);

        let mut state = system.initial_state([0.0; 3]);
        state.v = Some(system.backend.upload(&velocity));
        let mut integrator = ImplicitEuler::new(&system.backend, settings());
        integrator.step(&mut system, &mut state, h).unwrap_or_else(|e| panic!("{name}: {e}"));
        let found = system.backend.download(state.velocity());
        let worst = found.as_flattened().iter().zip(wanted.iter()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst <= 1e-9 * wanted.amax(), "{name}: a velocity is off by {worst:e}");
        let kinetic = 0.5 * (0..3).map(|c| form(&m, &found.iter().map(|v| v[c]).collect::<Vec<_>>())).sum::<f64>();
        assert!(relative(system.kinetic_energy(state.velocity()), kinetic) <= 1e-12, "{name}: kinetic energy");
    }
}

/// A free body under its weight moves as a whole, whatever its elements and its distortion.
#[test]
fn a_falling_body_is_not_strained() {
    let text = |element: &str| {
        format!(
            "[mesh]\nbeam = {{ size = [2, 1, 1], cells = [3, 2, 1], element = \"{element}\" }}\n[[material]]\n\
             law = \"hooke\"\ndensity = 1000.0\nparameters = {{ young = 1e5, poisson = 0.3 }}\n[[load]]\n\
             kind = \"gravity\"\nacceleration = [0, -9.81, 0]\n[solver]\nintegrator = \"implicit-euler\"\nstep = 0.01\n\
             duration = 0.1\nmass = \"consistent\"\ncg = {{ tolerance = 1e-13 }}\n[[probe]]\nname = \"elastic\"\n\
             kind = \"energy\"\npart = \"elastic\"\n[[probe]]\nname = \"kinetic\"\nkind = \"energy\"\npart = \"kinetic\"\n"
        )
    };
    for element in of_dimension(3).chain(of_dimension(2)) {
        let outcome = done(&scene::<&str>(&text(element.info.name), &[]));
        let [elastic, kinetic] = ["elastic", "kinetic"].map(|name| probe(&outcome, name));
        // Ten steps of 9.81 m/s2 in 2 m3 of 1000 kg/m3.
        assert!(relative(kinetic, 0.5 * 2000.0 * 0.981 * 0.981) <= 1e-10, "{}: {kinetic}", element.info.name);
        assert!(elastic <= 1e-12 * kinetic, "{}: {elastic} of {kinetic}", element.info.name);
    }
}

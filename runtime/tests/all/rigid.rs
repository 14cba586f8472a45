//! Rigid motion and the tangent: no force, no net force or torque, a symmetric K with six rigid modes, its diagonal.
//!
//! Bounds: a nodal force sums at most 24 partial forces, each of an element stiffness times a displacement rounded to
//! eps_m; with the largest diagonal entry k of K and the largest displacement (or coordinate, where F - I is formed
//! from rotations) d, that is 24 x 4 eps_m k d, and BOUND k d below.

use crate::support::{Cpu, Random, at_node, body, parameters, system};
use nalgebra::{DMatrix, SymmetricEigen};
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::cpu::CpuVector;
use tensormass_runtime::mesh::{Groups, Mesh, beam};
use tensormass_runtime::{LawEntry, laws};

const BOUND: f64 = 100.0 * f64::EPSILON;

struct Case {
    mesh: Mesh,
    system: Cpu<f64>,
    law: &'static LawEntry,
    /// The largest diagonal entry of K at rest.
    stiffness: f64,
}

/// A small distorted body of one law.
fn free(law: &'static LawEntry, random: &mut Random) -> Case {
    let regular = beam([1.0, 0.7, 0.5], [2, 2, 1], [0.3, -0.1, 0.2]).expect("a beam");
    let nodes = regular.nodes().iter().map(|p| {
        let d = random.vector(0.05);
        std::array::from_fn(|c| p[c] + d[c])
    });
    let mesh = Mesh::tetrahedra(nodes.collect(), regular.tets().to_vec(), Groups::default()).expect("a valid mesh");
    let mut system = system::<f64>(body(&mesh, law, &parameters(law), &[]));
    let rest = vec![[0.0; 3]; mesh.nodes().len()];
    let d = diagonal(&mut system, &rest);
    let stiffness = system.backend.max_abs(&d);
    Case { law, mesh, system, stiffness }
}

/// Whether the law's tangent has a comparison in it.
fn selects(law: &LawEntry) -> bool {
    law.info.operations.iter().any(|o| o.kernel == "dforce" && o.selects > 0)
}

fn force(system: &mut Cpu<f64>, u: &[[f64; 3]]) -> CpuVector<f64> {
    let (u, mut f) = (system.backend.upload(u), system.backend.zeros());
    system.field.add_force(&system.backend, &u, &mut f).unwrap_or_else(|e| panic!("{e}"));
    f
}

fn diagonal(system: &mut Cpu<f64>, u: &[[f64; 3]]) -> CpuVector<f64> {
    let (u, mut d) = (system.backend.upload(u), system.backend.zeros());
    system.field.prepare(&system.backend, &u);
    system.field.add_diagonal(&system.backend, 1.0, &mut d);
    d
}

/// K = -df/du at u, column by column.
fn tangent(system: &mut Cpu<f64>, u: &[[f64; 3]]) -> DMatrix<f64> {
    let size = 3 * u.len();
    let mut k = DMatrix::zeros(size, size);
    system.field.prepare(&system.backend, &system.backend.upload(u));
    for column in 0..size {
        let mut unit = [0.0; 3];
        unit[column % 3] = 1.0;
        let (du, mut df) = (at_node(&system.backend, column / 3, unit), system.backend.zeros());
        system.field.add_dforce(&system.backend, &du, -1.0, &mut df);
        let df = system.backend.download(&df);
        for row in 0..size {
            k[(row, column)] = df[row / 3][row % 3];
        }
    }
    k
}

/// The rotation by `angle` about a unit axis, minus the identity (Rodrigues).
fn rotation_less_identity(axis: [f64; 3], angle: f64) -> [[f64; 3]; 3] {
    let w = [[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]];
    let (s, c) = (angle.sin(), 2.0 * (0.5 * angle).sin().powi(2));
    std::array::from_fn(|i| std::array::from_fn(|j| s * w[i][j] + c * (0..3).map(|k| w[i][k] * w[k][j]).sum::<f64>()))
}

/// Every law, several bodies and states each: what holds for a property of it, told with law and seed.
fn check(property: impl Fn(&LawEntry, &mut Case, &mut Random) -> Result<(), String>) {
    for law in laws() {
        for seed in 0..6 {
            let mut random = Random(seed);
            let mut case = free(law, &mut random);
            property(law, &mut case, &mut random).unwrap_or_else(|e| panic!("{}, seed {seed}: {e}", law.info.name));
        }
    }
}

fn within(what: &str, value: f64, bound: f64) -> Result<(), String> {
    // Written so that NaN is refused.
    if value <= bound { Ok(()) } else { Err(format!("{what} is {value:.3e}, allowed {bound:.3e}")) }
}

/// Nodal displacements are subtracted before anything else, so that G = 0 exactly, and P(0) = 0 but for constants that
/// cancel: BOUND k d holds with the element's strain of one rounding unit in place of d.
#[test]
fn translation_gives_no_force() {
    check(|_, case, random| {
        let u = vec![random.vector(100.0); case.mesh.nodes().len()];
        let f = force(&mut case.system, &u);
        within("the force", case.system.backend.max_abs(&f), BOUND * case.stiffness)
    });
}

#[test]
fn rotation_gives_no_force() {
    check(|law, case, random| {
        let axis = random.vector(1.0);
        let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        let turn = rotation_less_identity(axis.map(|x| x / length), 3.0 * random.next());
        let place = |p: &[f64; 3]| turn.map(|row| (0..3).map(|j| row[j] * p[j]).sum());
        let u: Vec<[f64; 3]> = case.mesh.nodes().iter().map(place).collect();
        let f = force(&mut case.system, &u);
        let size = case.system.backend.max_abs(&f) / case.stiffness;
        if law.info.structure.linear {
            // Such a law takes rotation for strain: the test would be empty if it did not show.
            return within("1e-3 over the force", 1e-3 / size, 1.0);
        }
        within("the force", size, BOUND * 2.0)
    });
}

/// A state some 10 % from rest.
fn deformed(case: &Case, random: &mut Random) -> Vec<[f64; 3]> {
    let g: [[f64; 3]; 3] = std::array::from_fn(|_| random.vector(0.08));
    let place = |p: &[f64; 3]| {
        let noise = random.vector(0.01);
        std::array::from_fn(|i| noise[i] + (0..3).map(|j| g[i][j] * p[j]).sum::<f64>())
    };
    case.mesh.nodes().iter().map(place).collect()
}

#[test]
fn forces_balance() {
    check(|law, case, random| {
        let u = deformed(case, random);
        let f = force(&mut case.system, &u);
        let size = case.system.backend.max_abs(&f);
        let f = case.system.backend.download(&f);
        within("1e-3 over the force", 1e-3 * case.stiffness * 0.1 / size, 1.0)?;
        let bound = BOUND * case.stiffness * f.len() as f64;
        for c in 0..3 {
            let (a, b) = ((c + 1) % 3, (c + 2) % 3);
            let x = |n: usize, c: usize| case.mesh.nodes()[n][c] + u[n][c];
            within("the net force", f.iter().map(|f| f[c]).sum::<f64>().abs(), bound)?;
            let torque: f64 = f.iter().enumerate().map(|(n, f)| x(n, a) * f[b] - x(n, b) * f[a]).sum();
            if !law.info.structure.linear {
                within("the net torque", torque.abs(), bound)?;
            }
        }
        Ok(())
    });
}

/// Six zero eigenvalues at rest, and a gap: K of a body of two elements across has a condition number below 1e5 on the
/// rest; eigenvalues err by the matrix's size times eps_m times the largest.
#[test]
fn six_rigid_modes() {
    check(|_, case, _| {
        let rest = vec![[0.0; 3]; case.mesh.nodes().len()];
        let k = tangent(&mut case.system, &rest);
        let mut values: Vec<f64> = SymmetricEigen::new(k).eigenvalues.iter().copied().collect();
        values.sort_by(f64::total_cmp);
        let largest = values[values.len() - 1];
        let zero = BOUND * values.len() as f64 * largest;
        for value in &values[..6] {
            within("a rigid mode's eigenvalue", value.abs(), zero)?;
        }
        within("1e-5 of the largest eigenvalue over the seventh", 1e-5 * largest / values[6], 1.0)
    });
}

#[test]
fn tangent_is_symmetric_and_has_its_diagonal() {
    check(|_, case, random| {
        for at_rest in [true, false] {
            let u = if at_rest { vec![[0.0; 3]; case.mesh.nodes().len()] } else { deformed(case, random) };
            let k = tangent(&mut case.system, &u);
            within("K - K'", (&k - k.transpose()).amax(), BOUND * case.stiffness)?;
            let d = diagonal(&mut case.system, &u);
            let d = case.system.backend.download(&d);
            let off = d.as_flattened().iter().enumerate().map(|(i, d)| (d - k[(i, i)]).abs()).fold(0.0, f64::max);
            within("diagonal", off, BOUND * case.stiffness)?;
            // A law that selects may have a kink at rest, where no difference finds the one-sided tangent.
            if at_rest && selects(case.law) {
                continue;
            }
            // Its differential is that of the force: central differences with d = 1e-4 err by d^2 and by eps_m / d.
            let (step, direction) = (1e-4, (0..u.len()).map(|_| random.vector(1.0)).collect::<Vec<_>>());
            let at = |sign: f64| -> Vec<[f64; 3]> {
                u.iter().zip(&direction).map(|(u, d)| std::array::from_fn(|c| u[c] + sign * step * d[c])).collect()
            };
            let (after, before) = (force(&mut case.system, &at(1.0)), force(&mut case.system, &at(-1.0)));
            let [after, before] = [after, before].map(|f| case.system.backend.download(&f));
            let du = nalgebra::DVector::from_column_slice(direction.as_flattened());
            let df = k * du;
            let slope = |i: usize| (before.as_flattened()[i] - after.as_flattened()[i]) / (2.0 * step);
            let error = (0..df.len()).map(|i| (slope(i) - df[i]).abs()).fold(0.0, f64::max);
            // Third derivatives of the laws are some 10 stiffnesses over a strain; gradients on this mesh up to 10 / m.
            within("K - df/du", error, 1e3 * step * step * case.stiffness * 10.0)?;
        }
        Ok(())
    });
}

//! Conjugate gradients: when they stop and what they then have, imposed components, curvature, the preconditioner.

use crate::support::{Cpu, Random, body, done, outcome, parameters, scene, system};
use tensormass_runtime::backend::{Backend, ForceField, Operator};
use tensormass_runtime::cg::{CgLimits, CgOutcome, CgReport, ConjugateGradient};
use tensormass_runtime::cpu::{CpuVector, Precision};
use tensormass_runtime::laws;
use tensormass_runtime::mesh::beam;
use tensormass_runtime::simulate::Ending;
use tensormass_runtime::system::SolveError;

/// A clamped beam of one law with its free end's imposed components off 0.
fn clamped<R: Precision>(law: usize) -> Cpu<R> {
    let law = &laws()[law];
    let mesh = beam([3.0, 1.0, 1.0], [6, 2, 2], [0.0; 3]).expect("a beam");
    let last = mesh.nodes().len() as u32 - 1;
    let held = (0..9).flat_map(|n| (0..3).map(move |c| (n, c, 0.0)));
    let imposed: Vec<_> = held.chain([(last, 1, 0.0)]).collect();
    system(body(&mesh, law, &parameters(law), &imposed))
}

struct Solution {
    report: CgReport,
    x: Vec<[f64; 3]>,
    /// The residual b - A x, computed anew, over that at the start, in the norm of D.
    residual: f64,
}

/// Solves (m M + K) x = b at displacement u for a random b, from a random start.
fn solve<R: Precision>(system: &mut Cpu<R>, u: &[[f64; 3]], mass: f64, limits: CgLimits, seed: u64) -> Solution {
    let mut random = Random(seed);
    let nodes = system.body.masses.len();
    let backend = &system.backend;
    let mut vector = |size: f64| backend.upload(&(0..nodes).map(|_| random.vector(size)).collect::<Vec<_>>());
    // Both parts of the first residual are of one size: of b, and of A x.
    let (b, mut x) = (vector(1e5), vector(0.1));
    let u = backend.upload(u);
    system.field.prepare(backend, &u);
    let operator = Operator { masses: &system.masses, mass, stiffness: 1.0, damping: None };
    let mut d = backend.zeros();
    operator.diagonal(backend, &mut system.field, &mut d);
    backend.make_positive(&mut d);
    let norm = |x: &CpuVector<R>, field: &mut _| {
        let (mut r, mut z) = (backend.zeros(), backend.zeros());
        operator.apply(backend, field, x, &mut r);
        backend.scale(-1.0, &mut r);
        backend.axpy(1.0, &b, &mut r);
        backend.project(&mut r);
        backend.divide(&r, &d, &mut z);
        backend.dot(&r, &z).sqrt()
    };
    let start = norm(&x, &mut system.field);
    let report = ConjugateGradient::new(backend).solve(backend, &mut system.field, &operator, &d, &b, &mut x, limits);
    let residual = norm(&x, &mut system.field) / start.max(f64::MIN_POSITIVE);
    Solution { report, x: backend.download(&x), residual }
}

/// The break test: a residual of the tolerance asked for, and more iterations for a smaller one. The recursive residual
/// and the true one part by rounding only: cond(D^-1 K) eps_m, with 1e4 for this beam.
fn check<R: Precision>(tolerances: &[f64]) {
    for law in 0..laws().len() {
        for seed in 0..3 {
            let mut last = 0;
            for &tolerance in tolerances {
                let mut system = clamped::<R>(law);
                let rest = vec![[0.0; 3]; system.body.masses.len()];
                let limits = CgLimits { tolerance, max_iterations: 2000 };
                let solution = solve(&mut system, &rest, 0.0, limits, seed);
                let name =
                    format!("{}, seed {seed}, tolerance {tolerance:e}: {:?}", laws()[law].info.name, solution.report);
                assert_eq!(solution.report.outcome, CgOutcome::Converged, "{name}");
                assert!(solution.report.residual <= tolerance, "{name}");
                let reached = solution.residual;
                assert!(reached <= tolerance + 1e4 * R::EPSILON, "{name}: the residual is {reached:e}");
                assert!(solution.report.iterations > last, "{name}: no more iterations than for a larger tolerance");
                last = solution.report.iterations;
            }
        }
    }
}

#[test]
fn tolerance_is_met() {
    check::<f64>(&[1e-1, 1e-3, 1e-6, 1e-10]);
    check::<f32>(&[1e-1, 1e-2, 1e-4]);
}

#[test]
fn nothing_to_do_takes_no_iteration() {
    let mut system = clamped::<f64>(0);
    let rest = system.backend.zeros();
    system.field.prepare(&system.backend, &rest);
    let operator = Operator { masses: &system.masses, mass: 1.0, stiffness: 1.0, damping: None };
    let ones = system.backend.upload(&vec![[1.0; 3]; system.body.masses.len()]);
    let (b, mut x) = (system.backend.zeros(), system.backend.zeros());
    let limits = CgLimits { tolerance: 1e-6, max_iterations: 10 };
    let mut cg = ConjugateGradient::new(&system.backend);
    let report = cg.solve(&system.backend, &mut system.field, &operator, &ones, &b, &mut x, limits);
    assert_eq!(report, CgReport { outcome: CgOutcome::Converged, iterations: 0, residual: 0.0 });
    assert_eq!(system.backend.download(&x), system.backend.download(&rest));
}

/// Imposed components of x are given: they come back bit for bit, whatever they are.
fn keeps_imposed_components<R: Precision>() {
    let mut system = clamped::<R>(0);
    let rest = vec![[0.0; 3]; system.body.masses.len()];
    let mut x = |max_iterations| solve(&mut system, &rest, 1.0, CgLimits { tolerance: 1e-4, max_iterations }, 4).x;
    // No iteration at all gives the start.
    let (before, after) = (x(0), x(2000));
    for c in &system.body.constraints {
        let (n, c) = (c.node as usize, c.component as usize);
        assert_eq!(after[n][c].to_bits(), before[n][c].to_bits(), "node {n}, component {c}");
        assert_ne!(after[n][c], 0.0, "node {n}, component {c}: 0 is kept by chance");
    }
    assert_ne!(before, after);
}

#[test]
fn imposed_components_are_kept() {
    keeps_imposed_components::<f64>();
    keeps_imposed_components::<f32>();
}

const STIFF: &str = r#"
[mesh]
beam = { size = [4, 1, 1], cells = [8, 2, 2] }
[[material]]
law = "hooke"
density = 1000.0
elements = "x < 2"
parameters = { young = 1e6, poisson = 0.3 }
[[material]]
law = "hooke"
density = 1000.0
elements = "x > 2"
parameters = { young = 1e9, poisson = 0.3 }
[[boundary]]
nodes = "near(x, xmin)"
fix = ["x", "y", "z"]
[[load]]
kind = "gravity"
acceleration = [0.0, 0.0, -9.81]
[solver]
integrator = "static"
cg = { tolerance = 1e-8, max_iterations = 20000 }
"#;

#[test]
fn the_cap_ends_a_run() {
    let outcome = outcome(&scene(STIFF, &["solver.cg.max_iterations=3"]));
    let Ending::Failed(SolveError::NotConverged { solver, iterations, residual, tolerance, .. }) = outcome.ending
    else {
        panic!("{:?}", outcome.ending);
    };
    assert_eq!((solver, iterations, tolerance), ("linear", 3, 1e-8));
    assert!(residual > tolerance && residual.is_finite(), "{residual}");
    assert_eq!(outcome.summary["status"], "failed");
}

/// Three to twelve times fewer iterations were measured at stiffness ratios of 1e3 and more.
#[test]
fn jacobi_pays_where_stiffnesses_differ() {
    let products = |preconditioner: &str| {
        let outcome = done(&scene(STIFF, &[format!("solver.cg.preconditioner={preconditioner}")]));
        outcome.summary["solver"]["tangent_products"].as_u64().expect("a count")
    };
    let (jacobi, none) = (products("jacobi"), products("none"));
    println!("products: Jacobi {jacobi}, none {none}");
    assert!(3 * jacobi <= none, "{jacobi} products with Jacobi, {none} without");
}

/// A law that softens in compression has a tangent that is not positive definite there: x stays the best point before.
#[test]
fn negative_curvature_is_an_exit() {
    let law = laws().iter().position(|l| l.info.name == "st_venant_kirchhoff").expect("a law that softens");
    let mut system = clamped::<f64>(law);
    let mesh = beam([3.0, 1.0, 1.0], [6, 2, 2], [0.0; 3]).expect("a beam");
    // Half as long: below the stretch of .577 at which its stress is least.
    let u: Vec<[f64; 3]> = mesh.nodes().iter().map(|p| [-0.5 * p[0], 0.0, 0.0]).collect();
    let solution = solve(&mut system, &u, 0.0, CgLimits { tolerance: 1e-8, max_iterations: 2000 }, 1);
    assert_eq!(solution.report.outcome, CgOutcome::NegativeCurvature);
    assert!(solution.x.as_flattened().iter().all(|x| x.is_finite()), "x is not finite");
    // Inertia makes it definite again: omega^2 of this beam is below (2 / 1e-5 s)^2.
    let solution = solve(&mut system, &u, 4e10, CgLimits { tolerance: 1e-8, max_iterations: 2000 }, 1);
    assert_eq!(solution.report.outcome, CgOutcome::Converged);
}

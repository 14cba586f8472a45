//! Integrators against closed forms: one oscillator, free fall, order in time, imposed motion, momentum, energy.

use crate::support::{Cpu, Random, at_node, body, case, done, number, parameters, probe, relative, scene, system};
use tensormass_runtime::LawEntry;
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::cg::CgLimits;
use tensormass_runtime::cpu::{CpuBackend, CpuField};
use tensormass_runtime::integrate::{
    CentralDifference, ImplicitEuler, NewtonLimits, SemiImplicitEuler, SolverSettings, central_difference_coefficients,
};
use tensormass_runtime::laws;
use tensormass_runtime::mesh::{Groups, Mesh, NodeId, beam};
use tensormass_runtime::scene::Preconditioner;
use tensormass_runtime::step_limit::power_limit;
use tensormass_runtime::system::{Integrator, State};

type Stepper = Box<dyn Integrator<CpuBackend<f64>, CpuField<f64>>>;

const ALL: [&str; 3] = ["implicit-euler", "semi-implicit-euler", "central-difference"];

fn stepper(name: &str, system: &Cpu<f64>) -> Stepper {
    let settings = SolverSettings {
        cg: CgLimits { tolerance: 1e-13, max_iterations: 1000 },
        preconditioner: Preconditioner::Jacobi,
        newton: NewtonLimits { tolerance: 1e-12, max_iterations: 30 },
    };
    match name {
        "implicit-euler" => Box::new(ImplicitEuler::new(&system.backend, settings)),
        "semi-implicit-euler" => Box::new(SemiImplicitEuler::new(&system.backend)),
        _ => Box::new(CentralDifference::new(&system.backend)),
    }
}

fn advance(system: &mut Cpu<f64>, stepper: &mut Stepper, state: &mut State<CpuBackend<f64>>, h: f64, steps: u64) {
    for _ in 0..steps {
        stepper.step(system, state, h).unwrap_or_else(|e| panic!("{e}"));
        state.step += 1;
        state.time = h * state.step as f64;
    }
}

/// One element whose last node moves along the first `free` axes.
fn one_element(law: &'static LawEntry, free: u8) -> Cpu<f64> {
    let nodes = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.3, 1.0]];
    let mesh = Mesh::tetrahedra(nodes, vec![[0, 1, 2, 3].map(NodeId)], Groups::default()).expect("one element");
    let held = (0..4).flat_map(|n| (0..3).map(move |c| (n, c, 0.0))).filter(|&(n, c, _)| n < 3 || c >= free);
    system(body(&mesh, law, &parameters(law), &held.collect::<Vec<_>>()))
}

fn critical(system: &mut Cpu<f64>) -> f64 {
    let rest = system.backend.zeros();
    power_limit(system, &rest)
}

/// The matrix that takes (u, v / omega) of the oscillator over one step.
fn transition(integrator: &str, omega_h: f64, alpha_h: f64) -> [[f64; 2]; 2] {
    let law = laws().iter().find(|l| l.info.structure.linear).expect("a linear law");
    let mut columns = [[0.0; 2]; 2];
    for (start, column) in [[1.0, 0.0], [0.0, 1.0]].into_iter().zip(&mut columns) {
        let mut system = one_element(law, 1);
        let omega = 2.0 / critical(&mut system);
        system.body.mass_damping = alpha_h * omega / omega_h;
        let mut state = system.initial_state([0.0; 3]);
        state.u = at_node(&system.backend, 3, [start[0], 0.0, 0.0]);
        state.v = Some(at_node(&system.backend, 3, [start[1] * omega, 0.0, 0.0]));
        let mut stepper = stepper(integrator, &system);
        advance(&mut system, &mut stepper, &mut state, omega_h / omega, 1);
        let [u, v] = [&state.u, state.velocity()].map(|x| system.backend.download(x)[3][0]);
        *column = [u, v / omega];
    }
    let [a, b] = columns;
    [[a[0], b[0]], [a[1], b[1]]]
}

/// A check of a number against another, with the tolerance that its reference or its derivation gives.
fn check(what: &str, value: f64, wanted: f64, tolerance: f64) {
    let error = if wanted == 0.0 { value.abs() } else { relative(value, wanted) };
    assert!(error <= tolerance, "{what}: {value:?}, wanted {wanted:?}: off by {error:.2e}, allowed {tolerance:.0e}");
}

/// Tolerance 1e-6, the case's own.
#[test]
fn one_mode() {
    for c in case("OSCILLATOR")["expected"].as_array().expect("a list") {
        let x = number(&c["omega_h"]);
        // u + i v / omega is multiplied by 1 / (1 + i omega h).
        let [[a, b], [d, e]] = transition("implicit-euler", x, 0.0);
        check(&format!("{x}: structure"), (a - e).hypot(b + d), 0.0, 1e-6 * a.hypot(d));
        check(&format!("{x}: amplitude"), a.hypot(d), number(&c["implicit_euler_amp_per_step"]), 1e-6);
        check(&format!("{x}: phase"), (-d).atan2(a), number(&c["implicit_euler_phase_per_step"]), 1e-6);

        let [[a, b], [d, e]] = transition("semi-implicit-euler", x, 0.0);
        let (half_trace, determinant) = (0.5 * (a + e), a * e - b * d);
        let discriminant = half_trace * half_trace - determinant;
        let radius = if discriminant < 0.0 { determinant.sqrt() } else { half_trace.abs() + discriminant.sqrt() };
        check(&format!("{x}: spectral radius"), radius, number(&c["symplectic_spectral_radius"]), 1e-6);
        if let Some(ratio) = c["symplectic_period_ratio_hnum_over_exact"].as_f64() {
            check(&format!("{x}: period"), x / (-discriminant).sqrt().atan2(half_trace), ratio, 1e-6);
        }
    }
}

/// One step with damping, a = alpha h and w = omega h, against the schemes as written: implicit Euler solves
/// (1 + a + w^2) v+ = v - w u, the other two are explicit; to rounding, 1e-12 with the solver's tolerance.
#[test]
fn one_damped_mode() {
    for (w, a) in [(0.5, 0.3), (1.2, 0.05)] {
        for (integrator, [of_u, of_v]) in [
            ("implicit-euler", [-w / (1.0 + a + w * w), 1.0 / (1.0 + a + w * w)]),
            ("semi-implicit-euler", [-w, 1.0 - a]),
            // Half a step back, then v+ = ((2 - a) v- - 2 w u) / (2 + a).
            (
                "central-difference",
                [((2.0 - a) * 0.5 * w - 2.0 * w) / (2.0 + a), (2.0 - a) * (1.0 + 0.5 * a) / (2.0 + a)],
            ),
        ] {
            let [[uu, uv], [vu, vv]] = transition(integrator, w, a);
            let wanted = [1.0 + w * of_u, w * of_v, of_u, of_v];
            for (k, (value, wanted)) in [uu, uv, vu, vv].into_iter().zip(wanted).enumerate() {
                check(&format!("{integrator}, w {w}, a {a}, entry {k}"), value, wanted, 1e-12);
            }
        }
    }
}

#[test]
fn coefficients_of_central_differences() {
    let case = case("TLED_COEFF");
    let wanted = |key: &str| number(&case["expected"][key]);
    let (g1, g2, g3) = central_difference_coefficients(wanted("alpha"), wanted("dt"));
    for (value, key) in [(g1, "g1"), (g2, "g2"), (g3, "g3")] {
        check(key, value, wanted(key), 1e-15);
    }
}

const FALL: &str = r#"
[mesh]
beam = { size = [0.01, 0.01, 0.01], cells = [1, 1, 1] }
[[material]]
law = "hooke"
density = 1000.0
parameters = { young = 3e3, poisson = 0.3 }
[[load]]
kind = "gravity"
acceleration = [0.0, 0.0, -9.81]
[solver]
integrator = "central-difference"
duration = 0.03
step = 2.5e-5
[[probe]]
name = "drop"
kind = "displacement"
nodes = "all"
component = "z"
[[probe]]
name = "kinetic"
kind = "energy"
part = "kinetic"
"#;

/// Tolerance: one step, so v h for a place and g h for a velocity.
#[test]
fn free_fall() {
    let h = 2.5e-5;
    let case = case("FALL");
    for integrator in ALL {
        for alpha in [0, 10] {
            let wanted = |key: &str| number(&case["expected"][format!("fall_2mm_alpha{alpha}")][key]);
            let at = |time: f64| {
                let set = [
                    "integrator".to_owned() + "=" + integrator,
                    format!("mass_damping={alpha}"),
                    format!("duration={time:?}"),
                ];
                let outcome = done(&scene(FALL, &set.map(|s| format!("solver.{s}"))));
                (-probe(&outcome, "drop"), (2.0 * probe(&outcome, "kinetic") / 1e-3).sqrt())
            };
            let name = format!("{integrator}, alpha {alpha}");
            let ((drop, speed), v) = (at(wanted("t")), wanted("v"));
            check(&format!("{name}: drop"), drop, 2e-3, v * h / 2e-3);
            check(&format!("{name}: speed"), speed, v, 9.81 * h / v);
            let later = wanted("drop_at_0_03s");
            check(&format!("{name}: later"), at(0.03).0, later, 9.81 * 0.03 * h / later);
        }
    }
}

/// The order p from three steps: |u_h - u_h/2| / |u_h/2 - u_h/4| = 2^p (1 + O(omega h)), omega h = 1/64 in the first.
#[test]
fn order_in_time() {
    for law in laws() {
        for (integrator, alpha, order) in [
            ("implicit-euler", 0.0, 1.0),
            ("implicit-euler", 5.0, 1.0),
            ("semi-implicit-euler", 0.0, 1.0),
            ("semi-implicit-euler", 5.0, 1.0),
            ("central-difference", 0.0, 2.0),
            ("central-difference", 5.0, 2.0),
        ] {
            let end = |division: u64| {
                let mut system = one_element(law, 3);
                system.body.mass_damping = alpha;
                let h = critical(&mut system) / 128.0;
                // Some 10 % of strain.
                let speed = 0.1 / (64.0 * h);
                let mut state = system.initial_state([0.5 * speed, -0.3 * speed, speed]);
                // From rest at u = 0 semi-implicit Euler would be a central difference.
                state.u = at_node(&system.backend, 3, [0.05, -0.02, 0.03]);
                let mut stepper = stepper(integrator, &system);
                advance(&mut system, &mut stepper, &mut state, h / division as f64, 192 * division);
                system.backend.download(&state.u)[3]
            };
            let (a, b, c) = (end(1), end(2), end(4));
            let distance = |p: [f64; 3], q: [f64; 3]| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
            let found = (distance(a, b) / distance(b, c)).log2();
            println!("{} {integrator} alpha {alpha}: order {found:.3}", law.info.name);
            let error = (found - order).abs();
            assert!(error <= 0.1, "{}, {integrator}, alpha {alpha}: order {found:.3}", law.info.name);
        }
    }
}

/// Imposed components are where their history says, to the rounding of the state's type.
#[test]
fn imposed_motion() {
    let text = FALL.to_owned()
        + r#"
[[boundary]]
nodes = "near(z, zmin)"
move = { x = { ramp = [[0.0, 0.0], [1e-3, 2e-4], [2e-3, -1e-4]] }, z = { velocity = 0.05 } }
[[probe]]
name = "x"
kind = "displacement"
nodes = "near(z, zmin)"
component = "x"
[[probe]]
name = "z"
kind = "displacement"
nodes = "near(z, zmin)"
component = "z"
"#;
    for integrator in ALL {
        for (precision, epsilon) in [("f64", f64::EPSILON), ("f32", f64::from(f32::EPSILON))] {
            for (time, x) in [(5e-4, 1e-4), (1e-3, 2e-4), (1.5e-3, 0.5e-4), (2e-3, -1e-4), (3e-3, -1e-4)] {
                let set = [
                    format!("integrator={integrator}"),
                    format!("precision={precision}"),
                    format!("duration={time:?}"),
                ];
                let outcome = done(&scene(&text, &set.map(|s| format!("solver.{s}"))));
                let what = format!("{integrator}, {precision}, {time} s");
                // The history is evaluated in f64 from differences of up to 3e-4.
                check(&format!("{what}: x"), probe(&outcome, "x"), x, 8.0 * epsilon);
                check(&format!("{what}: z"), probe(&outcome, "z"), 0.05 * time, 8.0 * epsilon);
            }
        }
    }
}

/// Explicit steps conserve both momenta, with x after and v over the step, but for rounding: each step rounds m v and
/// h f, of the size (omega h) m v, at every node. A law without rotations in it exerts torques.
#[test]
fn momentum_of_a_free_body() {
    const STEPS: u64 = 300;
    for law in laws() {
        for integrator in &ALL[1..] {
            let mesh = beam([1.0, 0.6, 0.5], [2, 2, 2], [0.1, -0.2, 0.3]).expect("a beam");
            let mut system = system::<f64>(body(&mesh, law, &parameters(law), &[]));
            let h = 0.5 * critical(&mut system);
            let seed = 7;
            let mut random = Random(seed);
            let mut state = system.initial_state([3.0, -2.0, 1.0]);
            let mut v = system.backend.download(state.velocity());
            for (v, x) in v.iter_mut().zip(mesh.nodes()) {
                let noise = random.vector(1.0);
                let spin = [-5.0 * x[1], 5.0 * x[0], 0.0];
                *v = std::array::from_fn(|c| v[c] + spin[c] + noise[c]);
            }
            state.v = Some(system.backend.upload(&v));
            let masses = system.body.masses.clone();
            let momenta = |backend: &CpuBackend<f64>, state: &State<CpuBackend<f64>>| {
                let [u, v] = [&state.u, state.velocity()].map(|x| backend.download(x));
                let (mut p, mut l, mut size) = ([0.0; 3], [0.0; 3], 0.0_f64);
                for (i, m) in masses.iter().enumerate() {
                    let x: [f64; 3] = std::array::from_fn(|c| mesh.nodes()[i][c] + u[i][c]);
                    let v = v[i];
                    for c in 0..3 {
                        p[c] += m * v[c];
                        l[c] += m * (x[(c + 1) % 3] * v[(c + 2) % 3] - x[(c + 2) % 3] * v[(c + 1) % 3]);
                        size += m * v[c].abs() * (1.0 + x.iter().map(|x| x.abs()).sum::<f64>());
                    }
                }
                (p, l, size)
            };
            let (p0, l0, size) = momenta(&system.backend, &state);
            let bound = 16.0 * STEPS as f64 * f64::EPSILON * size;
            let mut stepper = stepper(integrator, &system);
            advance(&mut system, &mut stepper, &mut state, h, STEPS);
            let (p, l, _) = momenta(&system.backend, &state);
            for c in 0..3 {
                let name = format!("{}, {integrator}, seed {seed}, component {c}", law.info.name);
                assert!((p[c] - p0[c]).abs() <= bound, "{name}: {} of {}", p[c] - p0[c], p0[c]);
                let kept = (l[c] - l0[c]).abs() <= bound;
                assert!(kept || law.info.structure.linear, "{name}: {} of {}", l[c] - l0[c], l0[c]);
            }
        }
    }
}

/// A body that falls ten thousand times its size is no blow-up.
#[test]
fn a_long_fall_is_no_divergence() {
    let fall = scene::<&str>(
        r#"
[mesh]
beam = { size = [1e-3, 1e-3, 1e-3], cells = [1, 1, 1] }
[[material]]
law = "hooke"
density = 1000.0
parameters = { young = 1e3, poisson = 0.3 }
[[load]]
kind = "gravity"
acceleration = [0.0, 0.0, -1000.0]
[solver]
integrator = "semi-implicit-euler"
step = 1e-4
duration = 0.3
[[probe]]
name = "z"
kind = "displacement"
nodes = "all"
component = "z"
"#,
        &[],
    );
    let z = probe(&done(&fall), "z");
    // Semi-implicit Euler sums h^2 (1 + .. + n) = h^2 n (n + 1) / 2.
    assert!(relative(z, -1000.0 * 1e-8 * 3000.0 * 3001.0 / 2.0) <= 1e-9, "{z}");
}

/// Semi-implicit Euler conserves E - h/2 v . K u, and |h/2 v . K u| <= omega h / 2 E: with omega h = .2 the energy stays
/// within .1 / (1 - .1) of that, .22 in all, however long (strains of 1 %, where every law is near its linear part).
#[test]
fn energy_does_not_drift() {
    for law in laws() {
        let mesh = beam([1.0, 0.6, 0.5], [2, 1, 1], [0.0; 3]).expect("a beam");
        let held: Vec<_> = (0..4).flat_map(|n| (0..3).map(move |c| (n, c, 0.0))).collect();
        let mut system = system::<f64>(body(&mesh, law, &parameters(law), &held));
        let h = 0.1 * critical(&mut system);
        let seed = 11;
        let mut random = Random(seed);
        let mut state = system.initial_state([0.0; 3]);
        let mut v = system.backend.download(state.velocity());
        v[4..].iter_mut().for_each(|v| *v = random.vector(0.2));
        state.v = Some(system.backend.upload(&v));
        let mut stepper = stepper("semi-implicit-euler", &system);
        let start = system.kinetic_energy(state.velocity());
        // A law may have an energy at rest.
        let at_rest = system.field.potential_energy(&system.backend, &state.u).unwrap_or_else(|e| panic!("{e}"));
        for _ in 0..400 {
            advance(&mut system, &mut stepper, &mut state, h, 25);
            let elastic = system.field.potential_energy(&system.backend, &state.u).unwrap_or_else(|e| panic!("{e}"));
            let energy = (elastic - at_rest + system.kinetic_energy(state.velocity())) / start;
            let step = state.step;
            assert!((energy - 1.0).abs() <= 0.23, "{}, seed {seed}, step {step}: {energy}", law.info.name);
        }
    }
}

//! Damping against the schemes' own recurrences: one mode with viscosity and Rayleigh's C = alpha M + beta K, creep of a
//! Kelvin-Voigt bar, Newton's method with damping, critical steps, rotation.

use crate::support::{self, Cpu, Random, at_node, body, done, parameters, probe, relative, system, viscous};
use tensormass_runtime::LawEntry;
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::cg::CgLimits;
use tensormass_runtime::cpu::{CpuBackend, CpuField};
use tensormass_runtime::integrate::{
    CentralDifference, ImplicitEuler, NewtonLimits, SemiImplicitEuler, SolverSettings,
};
use tensormass_runtime::laws;
use tensormass_runtime::mesh::{Groups, Mesh, NodeId, beam};
use tensormass_runtime::model::build;
use tensormass_runtime::plan::{Layout, Plan};
use tensormass_runtime::scene::{Preconditioner, Scene};
use tensormass_runtime::simulate::Outcome;
use tensormass_runtime::step_limit::{element_limit, power_limit};
use tensormass_runtime::system::{Integrator, State};

type Stepper = Box<dyn Integrator<CpuBackend<f64>, CpuField<f64>>>;
type Vector = Vec<[f64; 3]>;

const ALL: [&str; 3] = ["implicit-euler", "semi-implicit-euler", "central-difference"];

fn stepper(name: &str, system: &Cpu<f64>, newton: u32) -> Stepper {
    let settings = SolverSettings {
        cg: CgLimits { tolerance: 1e-13, max_iterations: 1000 },
        preconditioner: Preconditioner::Jacobi,
        newton: NewtonLimits { tolerance: 1e-12, max_iterations: newton },
    };
    match name {
        "implicit-euler" => Box::new(ImplicitEuler::new(&system.backend, settings)),
        "semi-implicit-euler" => Box::new(SemiImplicitEuler::new(&system.backend)),
        _ => Box::new(CentralDifference::new(&system.backend)),
    }
}

fn advance(system: &mut Cpu<f64>, stepper: &mut Stepper, state: &mut State<CpuBackend<f64>>, h: f64) {
    stepper.step(system, state, h).unwrap_or_else(|e| panic!("{e}"));
    state.step += 1;
    state.time = h * state.step as f64;
}

fn dissipative() -> Vec<&'static LawEntry> {
    let found: Vec<_> = laws().iter().filter(|law| law.damping.is_some()).collect();
    assert!(!found.is_empty(), "a law with a dissipation is part of the build");
    found
}

/// The corners of one element.
const CORNERS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.3, 1.0]];

/// One element whose last node moves along the first `free` axes.
fn one_element(law: &'static LawEntry, parameters: &[f64], free: u8) -> Cpu<f64> {
    let mesh =
        Mesh::tetrahedra(CORNERS.to_vec(), vec![[0, 1, 2, 3].map(NodeId)], Groups::default()).expect("one element");
    let held = (0..4).flat_map(|n| (0..3).map(move |c| (n, c, 0.0))).filter(|&(n, c, _)| n < 3 || c >= free);
    system(body(&mesh, law, parameters, &held.collect::<Vec<_>>()))
}

/// Mass, stiffness and viscosity of the one degree of freedom, at rest.
fn oscillator(system: &mut Cpu<f64>) -> [f64; 3] {
    let (rest, unit) = (system.backend.zeros(), at_node(&system.backend, 3, [1.0, 0.0, 0.0]));
    let mut product = |viscosity: bool| {
        let mut f = system.backend.zeros();
        if viscosity {
            system.field.add_ddamping(&system.backend, [&rest, &rest], &unit, -1.0, &mut f);
        } else {
            system.field.add_dforce_at(&system.backend, &rest, &unit, -1.0, &mut f);
        }
        system.backend.download(&f)[3][0]
    };
    let (k, c) = (product(false), product(true));
    [system.body.masses[3], k, c]
}

fn check(what: &str, value: f64, wanted: f64, tolerance: f64) {
    let error = if wanted == 0.0 { value.abs() } else { relative(value, wanted) };
    assert!(error <= tolerance, "{what}: {value:?}, wanted {wanted:?}: off by {error:.2e}, allowed {tolerance:.0e}");
}

/// u and v / omega after each step of a scheme as written, for x = omega h, a = alpha h and c, the coefficient of the
/// elements' damping times h over the mass.
fn recurrence(integrator: &str, [mut u, mut v]: [f64; 2], (x, a, c): (f64, f64, f64), steps: usize) -> Vec<[f64; 2]> {
    let mut all = vec![];
    for step in 0..steps {
        v = match integrator {
            "implicit-euler" => (v - x * u) / (1.0 + a + c + x * x),
            "semi-implicit-euler" => (1.0 - a - c) * v - x * u,
            _ => {
                let pull = x * u + c * v;
                // The first step goes back by half a step before.
                let v = if step == 0 { (1.0 + 0.5 * a) * v + 0.5 * pull } else { v };
                ((2.0 - a) * v - 2.0 * pull) / (2.0 + a)
            }
        };
        u += x * v;
        all.push([u, v]);
    }
    all
}

/// One mode of a law in each scheme, to the size of its strain, 1e-9 and less, where every law is linear.
fn one_mode(law: &'static LawEntry, viscosity: f64, alpha: f64, beta: f64) {
    for integrator in ALL {
        let mut system = one_element(law, &viscous(law, viscosity), 1);
        let [m, k, c] = oscillator(&mut system);
        let omega = (k / m).sqrt();
        let h = 0.3 / omega;
        (system.body.mass_damping, system.body.stiffness_damping) = (alpha / h, beta * h);
        let coefficient = h * c / m + beta * (omega * h).powi(2);
        let start = [1e-10, -2e-10];
        let wanted = recurrence(integrator, start, (omega * h, alpha, coefficient), 25);
        for newton in [1, 30] {
            let mut state = system.initial_state([0.0; 3]);
            state.u = at_node(&system.backend, 3, [start[0], 0.0, 0.0]);
            state.v = Some(at_node(&system.backend, 3, [start[1] * omega, 0.0, 0.0]));
            let mut stepper = stepper(integrator, &system, newton);
            for (step, [u, v]) in wanted.iter().enumerate() {
                advance(&mut system, &mut stepper, &mut state, h);
                let what = format!("{}, {integrator}, newton {newton}, step {step}", law.info.name);
                let [found_u, found_v] = [&state.u, state.velocity()].map(|x| system.backend.download(x)[3][0]);
                let error = (found_u - u).hypot(found_v / omega - v) / 1e-10;
                // Relative to the start: what is left of it after the damping is told apart from 0.
                assert!(error <= 1e-8 && u.hypot(*v) > 1e-12, "{what}: off by {error:.1e}");
            }
        }
    }
}

#[test]
fn one_viscous_mode() {
    for law in dissipative() {
        one_mode(law, 300.0, 0.0, 0.0);
        one_mode(law, 200.0, 0.05, 0.1);
    }
}

#[test]
fn one_mode_with_rayleigh_damping() {
    // Fibres that bear tension only have two stiffnesses at rest.
    for law in laws().iter().filter(|law| law.info.structure.isotropic) {
        one_mode(law, 0.0, 0.03, 0.2);
    }
}

/// Free decay: amplitudes fall by exp(-xi omega t) with xi = alpha / (2 omega) + beta omega / 2, to the schemes' first
/// order, omega h / 2 in the exponent.
#[test]
fn modes_decay_as_their_damping_ratio_says() {
    let law = laws().iter().find(|l| l.info.structure.linear).expect("a linear law");
    for integrator in ALL {
        let mut system = one_element(law, &parameters(law), 1);
        let [m, k, _] = oscillator(&mut system);
        let omega = (k / m).sqrt();
        let (h, xi) = (1e-3 / omega, 0.05);
        (system.body.mass_damping, system.body.stiffness_damping) = (0.6 * xi * omega, 1.4 * xi / omega);
        let mut state = system.initial_state([0.0; 3]);
        state.u = at_node(&system.backend, 3, [1e-3, 0.0, 0.0]);
        let mut stepper = stepper(integrator, &system, 1);
        let steps = 10_000;
        (0..steps).for_each(|_| advance(&mut system, &mut stepper, &mut state, h));
        let (t, damped) = (h * steps as f64, omega * (1.0 - xi * xi).sqrt());
        // u = A exp(-xi omega t) cos(..): the amplitude from u and v.
        let [u, v] = [&state.u, state.velocity()].map(|x| system.backend.download(x)[3][0]);
        let amplitude = u.hypot((v + xi * omega * u) / damped);
        let start = 1e-3_f64.hypot(xi * omega * 1e-3 / damped);
        let decay = -(amplitude / start).ln() / (xi * omega * t);
        // Implicit Euler damps by omega h / 2 more, of xi = .05 one per cent.
        check(&format!("{integrator}: decay"), decay, 1.0, 0.011);
    }
}

/// c of the one degree of freedom by hand, V (eta (n.n + n_x^2) + (zeta - 2/3 eta) n_x^2) with the gradient n of the
/// node's interpolation function: E' = sym(e_x (x) n) u'.
#[test]
fn viscosity_of_an_element() {
    let law = laws().iter().find(|l| l.info.name == "kelvin_voigt").expect("a law of this build");
    let (eta, zeta) = (300.0, 600.0);
    let mut system = one_element(law, &viscous(law, eta), 1);
    let [_, _, c] = oscillator(&mut system);
    let rest = system.body.rest[0][0];
    let n = &rest.inverse_jacobian[6..9];
    let square: f64 = n.iter().map(|x| x * x).sum();
    let wanted = rest.weight * (eta * (square + n[0] * n[0]) + (zeta - 2.0 / 3.0 * eta) * n[0] * n[0]);
    check("c", c, wanted, 1e-14);
}

/// Where elements damp, one explicit step is critical at 2 / omega (sqrt(1 + xi^2) - xi); the recurrence itself turns
/// there.
#[test]
fn critical_steps_of_one_mode() {
    for law in dissipative() {
        for (viscosity, beta) in [(300.0, 0.0), (3000.0, 0.0), (300.0, 1e-3), (1e6, 0.0)] {
            let mut system = one_element(law, &viscous(law, viscosity), 1);
            let [m, k, c] = oscillator(&mut system);
            system.body.stiffness_damping = beta;
            let omega = (k / m).sqrt();
            let xi = (c + beta * k) / (2.0 * m * omega);
            let wanted = 2.0 / omega * ((1.0 + xi * xi).sqrt() - xi);
            let rest = system.backend.zeros();
            let limit = power_limit(&mut system, &rest);
            // A root between 1 and 1e5 times its own rounding.
            check(&format!("{}, viscosity {viscosity}, beta {beta}", law.info.name), limit, wanted, 1e-3);
            assert!(limit <= wanted * (1.0 + 1e-6) && element_limit(&system.body) <= limit * (1.0 + 1e-6));
            for integrator in &ALL[1..] {
                for (factor, stable) in [(0.99, true), (1.01, false)] {
                    let (x, step) = (omega * wanted * factor, (c + beta * k) / m * wanted * factor);
                    let end = recurrence(integrator, [1e-10, 1e-10], (x, 0.0, step), 20_000);
                    // NaN is not bounded.
                    let bounded = end.iter().all(|[u, v]| u.hypot(*v) < 1.0);
                    assert_eq!(bounded, stable, "{integrator}, {factor} of the limit");
                }
            }
        }
    }
}

/// A beam just below the limit stays bounded and just above it does not.
#[test]
fn critical_steps_of_a_viscous_beam() {
    let mesh = beam([1.0, 0.6, 0.5], [3, 2, 2], [0.0; 3]).expect("a beam");
    for law in dissipative() {
        for (viscosity, beta) in [(100.0, 0.0), (1000.0, 2e-4)] {
            let make = || {
                let mut body = body(&mesh, law, &viscous(law, viscosity), &[]);
                body.stiffness_damping = beta;
                system::<f64>(body)
            };
            let mut system = make();
            let rest = system.backend.zeros();
            let (power, element) = (power_limit(&mut system, &rest), element_limit(&system.body));
            assert!(element <= power && element > 0.3 * power, "{}: {element:e} of {power:e}", law.info.name);
            for (factor, stable) in [(0.97, true), (1.03, false)] {
                let mut system = make();
                let mut random = Random(3);
                let mut state = system.initial_state([0.0; 3]);
                let noise: Vector = mesh.nodes().iter().map(|_| random.vector(1e-9)).collect();
                state.v = Some(system.backend.upload(&noise));
                let mut stepper = stepper("semi-implicit-euler", &system, 1);
                (0..2000).for_each(|_| {
                    let small = system.backend.max_abs(state.velocity()) < 1e-3;
                    if small {
                        advance(&mut system, &mut stepper, &mut state, factor * power);
                    }
                });
                let largest = system.backend.max_abs(state.velocity());
                assert_eq!(largest < 1e-8, stable, "{}, {factor} of the limit: {largest:e} m/s", law.info.name);
            }
        }
    }
}

/// M (V+ - V) = h (F(U+) + F_v(U, V+) - (alpha M + beta K(U)) V+) after Newton's method at large strain, to its tolerance:
/// and in few iterations, as only the right matrix lets it.
#[test]
fn newton_solves_the_damped_step() {
    for law in laws() {
        let mesh = beam([1.0, 0.6, 0.5], [2, 1, 1], [0.0; 3]).expect("a beam");
        let held: Vec<_> = (0..4).flat_map(|n| (0..3).map(move |c| (n, c, 0.0))).collect();
        let mut system = system::<f64>(body(&mesh, law, &viscous(law, 3e3), &held));
        let rest = system.backend.zeros();
        let h = 3.0 * power_limit(&mut system, &rest);
        (system.body.mass_damping, system.body.stiffness_damping) = (0.2 / h, 0.5 * h);
        let (alpha, beta) = (system.body.mass_damping, system.body.stiffness_damping);
        let mut random = Random(5);
        let mut state = system.initial_state([0.0; 3]);
        let [mut u, mut v] = [&state.u, state.velocity()].map(|x| system.backend.download(x));
        for (u, v) in u[4..].iter_mut().zip(&mut v[4..]) {
            (*u, *v) = (random.vector(0.04), random.vector(0.05 / h));
        }
        let u = system.backend.upload(&u);
        (state.u, state.v) = (u.clone(), Some(system.backend.upload(&v)));
        let mut stepper = stepper("implicit-euler", &system, 30);
        let report = stepper.step(&mut system, &mut state, h).unwrap_or_else(|e| panic!("{}: {e}", law.info.name));
        let mut f = system.backend.zeros();
        system.force(&state.u, h, &mut f).expect("inside the domain");
        let elastic = system.backend.max_abs(&f);
        let mut damping = system.backend.zeros();
        system.add_damping(&u, state.velocity(), &mut damping);
        let scale = elastic + system.backend.max_abs(&damping);
        let [f, damping, after] = [&f, &damping, state.velocity()].map(|x| system.backend.download(x));
        let mut worst = 0.0_f64;
        for n in 4..v.len() {
            for c in 0..3 {
                let m = system.body.masses[n];
                let inertia = m * (after[n][c] - v[n][c]) / h + alpha * m * after[n][c];
                worst = worst.max((f[n][c] + damping[n][c] - inertia).abs());
            }
        }
        let what = format!("{}: {} Newton iterations, {worst:.1e} of {scale:.1e} N left", law.info.name, report.newton);
        println!("{what}");
        assert!(worst <= 1e-9 * scale && beta > 0.0, "{what}");
        assert!(report.newton <= 8, "{what}");
    }
}

/// A body that turns as a whole is not damped by finite laws: of the forces of a general velocity, rounding is left.
#[test]
fn rotation_is_free() {
    for law in dissipative().into_iter().filter(|law| !law.info.small_strain) {
        let mesh = beam([1.0, 0.7, 0.5], [2, 2, 1], [0.3, -0.1, 0.2]).expect("a beam");
        let mut system = system::<f64>(body(&mesh, law, &viscous(law, 300.0), &[]));
        // A quarter turn about z, and a stretch along x: the velocity of a rotation about an axis is w x (x + u).
        let (spin, mut random) = ([0.7, -1.3, 2.0], Random(9));
        let turned: Vector = mesh.nodes().iter().map(|x| [-x[1] - x[0], 1.25 * x[0] - x[1], 0.0]).collect();
        let velocity = mesh.nodes().iter().zip(&turned).map(|(x, u)| {
            let y: [f64; 3] = std::array::from_fn(|c| x[c] + u[c]);
            std::array::from_fn(|c| spin[(c + 1) % 3] * y[(c + 2) % 3] - spin[(c + 2) % 3] * y[(c + 1) % 3])
        });
        let velocity: Vector = velocity.collect();
        let noise: Vector = turned.iter().map(|_| random.vector(2.0)).collect();
        let turned = system.backend.upload(&turned);
        let mut force = |v: &Vector| {
            let (v, mut f) = (system.backend.upload(v), system.backend.zeros());
            system.add_damping(&turned, &v, &mut f);
            system.backend.max_abs(&f)
        };
        let (of_rotation, of_noise) = (force(&velocity), force(&noise));
        // Gradients are of size one: sums of tens of products, of eps each.
        assert!(
            of_rotation <= 1e-13 * of_noise && of_noise > 1.0,
            "{}: {of_rotation:e} of {of_noise:e}",
            law.info.name
        );
    }
}

/// A scene pays for the damping that it has: passes and kernels of the plan.
#[test]
fn plans_show_what_damps() {
    let plan = |set: &[&str]| {
        let scene = support::scene(CREEP, set);
        let model = build(&scene).unwrap_or_else(|e| panic!("{e}"));
        let plan = Plan::new(&scene, &model, Layout::Gpu);
        let kernels: Vec<&str> = plan.laws[0].kernels.iter().map(|(name, _)| *name).collect();
        (
            plan.passes.iter().map(|pass| pass.name).collect::<Vec<_>>().join("; "),
            kernels.join(" "),
            plan.left_out.join("; "),
        )
    };
    let elastic = ["material.0.law=neo_hookean", "material.0.parameters={ young = 2.6e6, poisson = 0.3 }"];
    let explicit = "solver.integrator=central-difference";
    let beta = "solver.stiffness_damping=1e-3";
    for (set, passes, kernels) in [
        (
            vec![],
            vec!["damping forces", "diagonal of damping", "differentials of damping"],
            "damping ddamping damping_diagonal",
        ),
        (vec![explicit], vec!["damping forces"], "damping"),
        (vec!["solver.integrator=static"], vec![], ""),
        (elastic.to_vec(), vec![], ""),
        ([&elastic[..], &[beta]].concat(), vec!["stiffness damping"], ""),
        // The tangent of a linearised step is that of Rayleigh's part.
        ([&elastic[..], &[beta, "solver.newton.max_iterations=1"]].concat(), vec![], ""),
        ([&elastic[..], &[beta, explicit]].concat(), vec!["differentials of the velocity"], ""),
    ] {
        let (found, run, left_out) = plan(&set);
        assert!(passes.iter().all(|pass| found.contains(pass)), "{set:?}: {found}");
        let words = found.matches("damping").count() + found.matches("of the velocity").count();
        assert_eq!(words, passes.len(), "{set:?}: {found}");
        let damping: Vec<&str> = run.split(' ').filter(|name| name.contains("damping")).collect();
        assert_eq!(damping.join(" "), kernels, "{set:?}: {run}");
        assert_eq!(left_out.contains("viscosity"), kernels.is_empty(), "{set:?}: {left_out}");
        assert_eq!(left_out.contains("stiffness damping"), !set.contains(&beta), "{set:?}: {left_out}");
    }
}

/// A bar on rollers under a constant traction, so light that it has no inertia.
const CREEP: &str = r#"
[mesh]
beam = { size = [1, 0.4, 0.5], cells = [3, 2, 2] }
[[material]]
law = "kelvin_voigt"
density = 1e-4
parameters = { young = 2.6e6, poisson = 0.3, shear_viscosity = 5e5, bulk_viscosity = 1.0833333333333333e6 }
[[boundary]]
nodes = "near(x, xmin)"
fix = ["x"]
[[boundary]]
nodes = "near(y, ymin)"
fix = ["y"]
[[boundary]]
nodes = "near(z, zmin)"
fix = ["z"]
[[load]]
kind = "traction"
faces = "near(x, xmax)"
value = [2.6, 0, 0]
[solver]
integrator = "implicit-euler"
step = 0.1
duration = 0.8
cg = { tolerance = 1e-10 }
newton = { tolerance = 1e-9 }
[[probe]]
name = "end"
kind = "displacement"
nodes = "near(x, xmax)"
component = "x"
[[probe]]
name = "support"
kind = "reaction"
nodes = "near(x, xmin)"
component = "x"
"#;

/// With eta / mu = zeta / kappa = tau = .5 s the stress of a bar is E (eps + tau eps'), and implicit Euler's strain after n
/// steps sigma / E (1 - (1 + h / tau)^-n); the spring and the dashpot carry the load together.
fn creep(run: impl Fn(&Scene) -> Outcome, set: &[&str], tolerance: f64) {
    for steps in [1, 3, 8] {
        let duration = format!("solver.duration={}", 0.1 * f64::from(steps));
        let outcome = run(&support::scene(CREEP, &[set, &[&duration]].concat()));
        let wanted = 1e-6 * (1.0 - 1.2_f64.powi(-steps));
        check(&format!("strain after {steps} steps"), probe(&outcome, "end"), wanted, tolerance);
        check("support", probe(&outcome, "support"), -2.6 * 0.2, tolerance);
    }
}

/// Tolerance: a strain of 1e-6 makes second-order terms of that part; 1e-4 kg/m3 adds 1e-9.
#[test]
fn creep_of_a_bar() {
    creep(done, &[], 1e-5);
    creep(done, &["solver.newton.max_iterations=1"], 1e-5);
}

/// f32, with the linear solver's tolerance.
#[cfg(feature = "gpu")]
#[test]
fn creep_of_a_bar_on_a_gpu() {
    use tensormass_runtime::gpu::GpuOptions;
    use tensormass_runtime::simulate::{Silent, run_on};
    use tensormass_runtime::target::Target;
    let Some(gpu) = support::gpu::test_device() else { return };
    let target = Target::Gpu(gpu, GpuOptions::default());
    let run = |scene: &Scene| run_on(&target, scene, None, &mut Silent).unwrap_or_else(|e| panic!("{e}"));
    creep(run, &["solver.precision=f32", "solver.cg.tolerance=1e-6", "solver.newton.tolerance=1e-5"], 1e-4);
}

//! From a scene to its steps, its integrator, and how its linear solver computes products.

use crate::backend::{Backend, ForceField};
use crate::body::Body;
use crate::cg::CgLimits;
use crate::cpu::{CpuBackend, CpuField, Precision, fastest};
use crate::integrate::{CentralDifference, ImplicitEuler, NewtonLimits, SemiImplicitEuler, SolverSettings, Statics};
use crate::scene::{self, Scene};
use crate::step_limit::{StepLimits, element_limit, power_limit};
use crate::system::{Integrator, State, System};
use crate::tangent::{self, ChosenBy, Tangent};

/// An integrator on a backend.
pub(super) type Stepper<B, F> = Box<dyn Integrator<B, F>>;

/// Step in s and number of steps; a static scene without a step takes its ramps to their ends at once.
pub(super) fn stepping(scene: &Scene) -> (f64, u64) {
    let steps = scene.solver.steps();
    let step = match (scene.solver.step, scene.solver.duration) {
        (Some(step), Some(_)) => step,
        (_, Some(duration)) => duration,
        (_, None) => ramps_end(scene).max(1.0),
    };
    (step, steps)
}

/// The time in s at which the last ramp of a scene ends.
fn ramps_end(scene: &Scene) -> f64 {
    let loads = scene.load.iter().filter_map(|l| match l {
        scene::Load::Gravity { ramp, .. }
        | scene::Load::Traction { ramp, .. }
        | scene::Load::Pressure { ramp, .. }
        | scene::Load::Force { ramp, .. } => ramp.as_ref().map(scene::Ramp::end),
    });
    let motions = scene.boundary.iter().flat_map(|b| match b {
        scene::Boundary::Fixed { .. } => vec![],
        scene::Boundary::Turned { rotate, .. } => match &rotate.angle {
            scene::Angle::Ramp(ramp) => vec![ramp.end()],
            scene::Angle::Velocity(_) => vec![],
        },
        scene::Boundary::Moved { motion, .. } => [&motion.x, &motion.y, &motion.z]
            .into_iter()
            .filter_map(|h| match h {
                Some(scene::History::Ramp(ramp)) => Some(ramp.end()),
                Some(scene::History::Velocity(_)) | None => None,
            })
            .collect(),
    });
    loads.chain(motions).fold(0.0, f64::max)
}

/// The critical steps of a body at its initial state in s, where its unit of time is so many; none in statics. What explicit
/// steps do not need of it is let go.
pub(super) fn limits<B: Backend, F: ForceField<B>>(
    scene: &Scene,
    system: &mut System<B, F>,
    state: &State<B>,
    unit: f64,
) -> Option<StepLimits> {
    if !system.body.moves {
        return None;
    }
    let limits = [element_limit(&system.body), power_limit(system, &state.u)].map(|limit| limit * unit);
    if scene.solver.integrator.is_explicit() {
        system.field.forget_tangent(&system.backend);
        system.backend.trim();
    }
    let [element, power] = limits;
    Some(StepLimits { element, power })
}

/// The integrator that a scene asks for.
pub(super) fn integrator<B: Backend + 'static, F: ForceField<B> + 'static>(
    scene: &Scene,
    backend: &B,
) -> Stepper<B, F> {
    let solver = &scene.solver;
    let settings = SolverSettings {
        cg: CgLimits { tolerance: solver.cg.tolerance, max_iterations: solver.cg.max_iterations },
        preconditioner: solver.cg.preconditioner,
        newton: NewtonLimits { tolerance: solver.newton.tolerance, max_iterations: solver.newton.max_iterations },
    };
    match solver.integrator {
        scene::Integrator::ImplicitEuler => Box::new(ImplicitEuler::new(backend, settings)),
        scene::Integrator::SemiImplicitEuler => Box::new(SemiImplicitEuler::new(backend)),
        scene::Integrator::CentralDifference => Box::new(CentralDifference::new(backend)),
        scene::Integrator::Static => Box::new(Statics::new(backend, settings)),
    }
}

/// A field that computes products as a scene asks for, for each law of the body, and who chose that.
pub(super) fn with_tangents<R: Precision>(
    scene: &Scene,
    body: &Body,
    backend: &CpuBackend<R>,
    field: CpuField<R>,
) -> (CpuField<R>, Vec<Tangent>, ChosenBy) {
    let (tangents, by) = tangent::asked_for(scene, body);
    if scene.solver.integrator.is_explicit() {
        // The critical step alone asks for products: it stores nothing.
        let field = field.with_tangents(&vec![Tangent::Recomputed; tangents.len()]);
        return (field, tangents, by);
    }
    if scene.solver.cg.tangent != scene::TangentChoice::Measured {
        return (field.with_tangents(&tangents), tangents, by);
    }
    // What is asked for is speed: digits are not given up for it.
    let exact = scene.solver.precision == scene::Precision::F64;
    let all = [Tangent::Stored, Tangent::Recomputed, Tangent::Assembled]
        .into_iter()
        .filter(|t| exact || *t != Tangent::Assembled);
    let others = all.map(|tangent| vec![tangent; body.batches.len()]).filter(|other| *other != tangents);
    let mut candidates: Vec<_> = std::iter::once(tangents.clone()).chain(others).collect();
    let (field, fastest) = fastest(backend, field, &candidates);
    (field, candidates.swap_remove(fastest), ChosenBy::Measurement)
}

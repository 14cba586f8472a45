//! From a scene to its steps and its integrator.

use crate::backend::{Backend, ForceField};
use crate::cg::CgLimits;
use crate::integrate::{CentralDifference, ImplicitEuler, NewtonLimits, SemiImplicitEuler, SolverSettings, Statics};
use crate::scene::{self, Scene};
use crate::system::Integrator;

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
        scene::Load::Gravity { ramp, .. } | scene::Load::Traction { ramp, .. } | scene::Load::Force { ramp, .. } => {
            ramp.as_ref().map(scene::Ramp::end)
        }
    });
    let motions = scene.boundary.iter().flat_map(|b| match b {
        scene::Boundary::Fixed { .. } => vec![],
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

/// The integrator that a scene asks for.
pub(super) fn integrator<B: Backend + 'static, F: ForceField<B> + 'static>(
    scene: &Scene,
    backend: &B,
    nodes: usize,
) -> Stepper<B, F> {
    let solver = &scene.solver;
    let settings = SolverSettings {
        cg: CgLimits { tolerance: solver.cg.tolerance, max_iterations: solver.cg.max_iterations },
        preconditioner: solver.cg.preconditioner,
        newton: NewtonLimits { tolerance: solver.newton.tolerance, max_iterations: solver.newton.max_iterations },
    };
    match solver.integrator {
        scene::Integrator::ImplicitEuler => Box::new(ImplicitEuler::new(backend, nodes, settings)),
        scene::Integrator::SemiImplicitEuler => Box::new(SemiImplicitEuler::new(backend)),
        scene::Integrator::CentralDifference => Box::new(CentralDifference::new(backend)),
        scene::Integrator::Static => Box::new(Statics::new(backend, nodes, settings)),
    }
}

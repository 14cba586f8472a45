//! How many vectors over the nodes a run holds at once.
//!
//! A count of what integrators, solvers and records make: a test compares it with what runs do hold.

use super::{Layout, Needed};
use crate::scene::{Preconditioner, Scene};

/// Vectors of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Vectors {
    /// From the beginning to the end: state, masses, loads.
    base: usize,
    /// For the critical step, before the first one.
    limits: usize,
    /// From the first step on: of the integrator, its solvers, and impulses.
    steps: usize,
    /// Within a step, or while it is recorded.
    within: usize,
}

impl Vectors {
    /// Those of a scene on a device.
    pub fn of(scene: &Scene, needed: &Needed, layout: Layout) -> Self {
        let Needed { model, moves, implicit, viscous, proportional, .. } = *needed;
        let (body, contact) = (&model.body, model.body.contact.as_ref());
        // The displacement at which the tangent is taken.
        let tangent = usize::from(!body.is_elastically_linear());
        // Displacement; velocity and masses.
        let base = 1 + if moves { 2 } else { 0 } + body.loads.len();
        let limits = if moves { 5 + usize::from(viscous) + tangent } else { 0 };
        let damped = if viscous || proportional { 2 } else { 0 };
        let impulses = usize::from(needed.impulses);
        let recorded = usize::from(moves || needed.records.reactions);
        if !implicit {
            // Where steps are not looked at one by one, what they began with is kept.
            let copies = if layout == Layout::Gpu && needed.passes_over_steps(scene) { 2 } else { 0 };
            return Self { base, limits, steps: 1 + impulses, within: recorded.max(copies) };
        }
        let newton = &scene.solver.newton;
        let iterates = newton.max_iterations > 1;
        let judged = iterates || !moves;
        // Where a linear solution is as good as the nonlinear one has to be, nothing follows it.
        let precise = scene.solver.precision == crate::scene::Precision::F64;
        let suffices = body.is_linear() && precise && scene.solver.cg.tolerance <= newton.tolerance;
        let slides = contact.is_some_and(|c| c.obstacles.iter().any(|o| o.sticking > 0.0 || o.sliding > 0.0));
        let parts = [
            // Of conjugate gradients, the diagonal, the residual, and what is solved for.
            (true, 7),
            (judged, 2),
            (iterates || contact.is_some(), 1),
            (iterates && !suffices, 2),
            (iterates || scene.solver.cg.preconditioner == Preconditioner::None, 1),
            (moves && (body.mass_damping != 0.0 || slides), 1),
            (true, damped + impulses + tangent),
        ];
        let steps = parts.iter().filter(|(needed, _)| *needed).map(|(_, count)| count).sum();
        let within = match (contact, moves) {
            // A step that missed contact is taken again; friction and what is held are brought to it.
            (Some(_), _) => 3,
            (None, true) => 0,
            (None, false) => usize::from(!body.is_linear()),
        };
        Self { base, limits, steps, within: within.max(recorded) }
    }

    /// The most at once.
    pub fn most(self) -> usize {
        self.base + self.limits.max(self.steps + self.within)
    }

    /// While steps are taken.
    pub fn in_steps(self) -> usize {
        self.base + self.steps
    }
}

//! Static equilibrium: Newton's method on f(u) + loads = 0, in increments of the imposed motion and loads.

use crate::backend::{Backend, ForceField};
use crate::system::{Integrator, SolveError, Solved, State, StepReport, System};

use super::equation::Equation;
use super::newton::{Newton, SolverSettings};

/// Equilibrium at the end of each increment. A linear law takes one solution, and in f32 as many corrections as the
/// Newton tolerance asks for; an increment that fails is halved.
pub struct Statics<B: Backend> {
    newton: Newton<B>,
    settings: SolverSettings,
    du: B::Vector,
}

/// Halvings of one increment.
const DEPTH: u32 = 8;

impl<B: Backend> Statics<B> {
    /// Work vectors for a body.
    pub fn new(backend: &B, settings: SolverSettings) -> Self {
        Self { newton: Newton::new(backend), settings, du: backend.zeros() }
    }

    fn advance<F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        state: &mut State<B>,
        from: f64,
        to: f64,
        depth: u32,
    ) -> Result<StepReport, SolveError> {
        let target = system.body.motions_at(to);
        let backend = &system.backend;
        backend.clear(&mut self.du);
        backend.impose_change(&target, &state.u, &mut self.du);
        let equation = Equation {
            mass: 0.0,
            stiffness: 1.0,
            displacement: 1.0,
            force: 1.0,
            time: to,
            u: &state.u,
            velocity: None,
            constant: None,
            viscous: false,
            stiffness_damping: 0.0,
        };
        match self.newton.solve(system, &equation, &mut self.du, &self.settings) {
            Ok(report) => {
                system.backend.axpy(1.0, &self.du, &mut state.u);
                system.backend.impose(&target, &mut state.u);
                Ok(report)
            }
            // Cutting the increment helps a nonlinear solution, not a linear solver that has run out of iterations.
            Err(e @ SolveError::NotConverged { solver: "linear", .. }) => Err(e),
            Err(e) if depth == 0 || system.body.is_linear() => Err(e),
            Err(_) => {
                let middle = 0.5 * (from + to);
                let mut report = self.advance(system, state, from, middle, depth - 1)?;
                report += self.advance(system, state, middle, to, depth - 1)?;
                Ok(report)
            }
        }
    }
}

impl<B: Backend, F: ForceField<B>> Integrator<B, F> for Statics<B> {
    fn step(&mut self, system: &mut System<B, F>, state: &mut State<B>, h: f64) -> Result<StepReport, SolveError> {
        // An increment of linear laws is taken whole or not at all.
        let before = (!system.body.is_linear()).then(|| {
            let mut before = system.backend.zeros();
            system.backend.copy(&state.u, &mut before);
            before
        });
        let result = self.advance(system, state, state.time, state.time + h, DEPTH);
        if let (Err(_), Some(before)) = (&result, &before) {
            system.backend.copy(before, &mut state.u);
        }
        result
    }

    fn solved(&self, backend: &B) -> Option<Solved> {
        Some(Solved { reported: self.newton.reached, change: backend.download(&self.du) })
    }
}

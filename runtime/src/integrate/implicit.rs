//! Implicit Euler (Faure et al. 2012, eqs. 18 to 20), linearised once or iterated to convergence.
//!
//! Damping forces of the elements are those of the velocity at the end of the step and of the strain at its beginning.
//! They are then the derivative of h D by the velocity, so that each step still minimises a potential (its matrix is
//! symmetric), and dissipate whatever the step; the lag is of the order of the scheme.

use crate::backend::{Backend, ForceField};
use crate::system::{Integrator, SolveError, State, StepReport, System};

use super::newton::{Equation, Newton, SolverSettings};

/// Implicit Euler: V+ = V + h M^-1 (F(U+) + F_v(U, V+) - (alpha M + beta K(U)) V+), U+ = U + h V+.
///
/// In dV: ((1 + h alpha) M + h (C + beta K) + h^2 K) dV = h (F + F_v - (alpha M + beta K) V) - h^2 K V with C = -dF_v/dV,
/// loads at the end of the step. With one Newton
/// iteration this is the paper's linearised step; with more, the nonlinear equation is solved.
pub struct ImplicitEuler<B: Backend> {
    newton: Newton<B>,
    settings: SolverSettings,
    dv: B::Vector,
    damping: B::Vector,
}

impl<B: Backend> ImplicitEuler<B> {
    /// Work vectors for a body of this many nodes.
    pub fn new(backend: &B, nodes: usize, settings: SolverSettings) -> Self {
        Self { newton: Newton::new(backend, nodes), settings, dv: backend.zeros(), damping: backend.zeros() }
    }
}

impl<B: Backend, F: ForceField<B>> Integrator<B, F> for ImplicitEuler<B> {
    fn step(&mut self, system: &mut System<B, F>, state: &mut State<B>, h: f64) -> Result<StepReport, SolveError> {
        let alpha = system.body.mass_damping;
        let end = state.time + h;
        // Imposed components: the velocity that takes them to their place at the end of the step, minus the old one.
        let (now, target) = (system.body.motions_at(state.time), system.body.motions_at(end));
        let velocity: Vec<f64> = now.iter().zip(&target).map(|(a, b)| (b - a) / h).collect();
        let backend = &system.backend;
        backend.clear(&mut self.dv);
        backend.impose_change(&velocity, &state.v, &mut self.dv);
        if alpha != 0.0 {
            backend.clear(&mut self.damping);
            system.masses.add(backend, -h * alpha, &state.v, &mut self.damping);
        }
        let equation = Equation {
            mass: 1.0 + h * alpha,
            stiffness: h * h,
            displacement: h,
            force: h,
            time: end,
            u: &state.u,
            velocity: Some(&state.v),
            constant: (alpha != 0.0).then_some(&self.damping),
            viscous: system.body.is_viscous(),
            stiffness_damping: system.body.stiffness_damping,
        };
        let report = self.newton.solve(system, &equation, &mut self.dv, &self.settings)?;
        let backend = &system.backend;
        backend.axpy(1.0, &self.dv, &mut state.v);
        backend.axpy(h, &state.v, &mut state.u);
        backend.impose(&target, &mut state.u);
        Ok(report)
    }
}

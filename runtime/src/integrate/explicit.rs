//! Explicit steps: semi-implicit Euler and central differences.
//!
//! The elements' damping forces are those of the last velocity that is known, before the step or half a step before: the
//! schemes stay explicit, and are of first order in these forces. Contact is the last thing in a step (Li et al. 2014,
//! Algorithm 1).

use serde_json::{Value, json};

use crate::backend::{Advance, Backend, ForceField};
use crate::system::{Integrator, SolveError, State, StepReport, System};

/// Sets imposed components to their values at a time, and their velocity to the mean over the last h.
fn impose<B: Backend, F: ForceField<B>>(system: &System<B, F>, state: &mut State<B>, time: f64, h: f64) {
    let (now, before) = (system.body.motions_at(time), system.body.motions_at(time - h));
    let velocity: Vec<f64> = now.iter().zip(&before).map(|(a, b)| (a - b) / h).collect();
    let [u, v] = state.motion();
    system.backend.impose(&now, u);
    system.backend.impose(&velocity, v);
}

/// Semi-implicit (symplectic) Euler (Faure et al. 2012, eq. 17): V += h M^-1 F(U), then U += h V.
pub struct SemiImplicitEuler<B: Backend> {
    force: B::Vector,
}

impl<B: Backend> SemiImplicitEuler<B> {
    /// A work vector for a body.
    pub fn new(backend: &B) -> Self {
        Self { force: backend.zeros() }
    }
}

impl<B: Backend, F: ForceField<B>> Integrator<B, F> for SemiImplicitEuler<B> {
    fn step(&mut self, system: &mut System<B, F>, state: &mut State<B>, h: f64) -> Result<StepReport, SolveError> {
        system.force(&state.u, state.time, &mut self.force)?;
        system.add_damping(&state.u, state.velocity(), &mut self.force);
        let [u, v] = state.motion();
        system.backend.advance(Advance {
            force: &self.force,
            masses: system.masses.of_motion(),
            // Damping -alpha M V at the beginning of the step.
            keep: 1.0 - h * system.body.mass_damping,
            kick: h,
            drift: h,
            v,
            u,
        });
        impose(system, state, state.time + h, h);
        system.meet_obstacles(state, h);
        Ok(StepReport { forces: 1, ..StepReport::default() })
    }
}

/// gamma_1, gamma_2, gamma_3 of Li et al. 2014, eq. (8): u+ = gamma_1 M^-1 (r - f) + gamma_2 u + gamma_3 u-.
pub fn central_difference_coefficients(alpha: f64, h: f64) -> (f64, f64, f64) {
    let denominator = alpha * h + 2.0;
    let gamma_2 = 4.0 / denominator;
    (2.0 * h * h / denominator, gamma_2, 1.0 - gamma_2)
}

/// Central differences with mass-proportional damping (Li et al. 2014, eqs. 6 to 8).
///
/// Advanced in increments, w+ = u+ - u = gamma_1 a - gamma_3 w, which is the same scheme (gamma_2 - 1 = -gamma_3) and
/// does not lose a small increment in a large displacement. The velocity of the state is that of the middle of the last
/// step, w / h, except at the start.
pub struct CentralDifference<B: Backend> {
    force: B::Vector,
    started: bool,
}

impl<B: Backend> CentralDifference<B> {
    /// A work vector for a body.
    pub fn new(backend: &B) -> Self {
        Self { force: backend.zeros(), started: false }
    }
}

impl<B: Backend, F: ForceField<B>> Integrator<B, F> for CentralDifference<B> {
    fn step(&mut self, system: &mut System<B, F>, state: &mut State<B>, h: f64) -> Result<StepReport, SolveError> {
        system.force(&state.u, state.time, &mut self.force)?;
        system.add_damping(&state.u, state.velocity(), &mut self.force);
        let [u, v] = state.motion();
        let alpha = system.body.mass_damping;
        let backend = &system.backend;
        if !self.started {
            // u(-h) = u_0 - h v_0 + h^2 a_0 / 2 with a_0 = M^-1 f - alpha v_0: the velocity half a step before the start.
            backend.advance(Advance {
                force: &self.force,
                masses: system.masses.of_motion(),
                keep: 1.0 + 0.5 * h * alpha,
                kick: -0.5 * h,
                drift: 0.0,
                v: &mut *v,
                u: &mut *u,
            });
            self.started = true;
        }
        let (gamma_1, _, gamma_3) = central_difference_coefficients(alpha, h);
        backend.advance(Advance {
            force: &self.force,
            masses: system.masses.of_motion(),
            keep: -gamma_3,
            kick: gamma_1 / h,
            drift: h,
            v,
            u,
        });
        impose(system, state, state.time + h, h);
        system.meet_obstacles(state, h);
        Ok(StepReport { forces: 1, ..StepReport::default() })
    }

    fn memory(&self) -> Value {
        json!({ "started": self.started })
    }

    fn recall(&mut self, memory: &Value) {
        self.started = memory["started"] == true;
    }
}

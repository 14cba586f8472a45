//! Implicit Euler (Faure et al. 2012, eqs. 18 to 20), linearised once or iterated to convergence.
//!
//! Damping forces of the elements are those of the velocity at the end of the step and of the strain at its beginning.
//! They are then the derivative of h D by the velocity, so that each step still minimises a potential (its matrix is
//! symmetric), and dissipate whatever the step; the lag is of the order of the scheme.
//!
//! Where something can be met, a step is solved with the nodes that are on obstacles held there, until those are the right
//! ones ([`crate::contact::Holding`]).

use std::sync::Arc;

use serde_json::{Value, json};

use crate::backend::{Backend, ForceField};
use crate::contact::{ATTEMPTS, Attempt, Contact, Held, Holding};
use crate::mass::Masses;
use crate::system::{Integrator, SolveError, Solved, State, StepReport, System};

use super::equation::Equation;
use super::newton::{Newton, SolverSettings};

/// Implicit Euler: V+ = V + h M^-1 (F(U+) + F_v(U, V+) - (alpha M + beta K(U)) V+), U+ = U + h V+.
///
/// In dV: ((1 + h alpha) M + h (C + beta K) + h^2 K) dV = h (F + F_v - (alpha M + beta K) V) - h^2 K V with C = -dF_v/dV,
/// loads at the end of the step. With one Newton
/// iteration this is the paper's linearised step; with more, the nonlinear equation is solved.
pub struct ImplicitEuler<B: Backend> {
    newton: Newton<B>,
    settings: SolverSettings,
    dv: B::Vector,
    /// Impulses that do not depend on dV, where there are some: mass damping of V, friction.
    constant: Option<B::Vector>,
    holding: Holding,
}

impl<B: Backend> ImplicitEuler<B> {
    /// Work vectors for a body.
    pub fn new(backend: &B, settings: SolverSettings) -> Self {
        Self {
            newton: Newton::new(backend),
            settings,
            dv: backend.zeros(),
            constant: None,
            holding: Holding::default(),
        }
    }

    /// Solves for dV with these nodes held, whose velocities are given; and what holds each node, if any is held.
    fn solve<F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        state: &State<B>,
        h: f64,
        held: &[Held],
        v: &[[f64; 3]],
    ) -> Result<(StepReport, Vec<[f64; 3]>), SolveError> {
        let alpha = system.body.mass_damping;
        let end = state.time + h;
        // Imposed components: the velocity that takes them to their place at the end of the step, minus the old one.
        let (now, target) = (system.body.motions_at(state.time), system.body.motions_at(end));
        let velocity: Vec<f64> = now.iter().zip(&target).map(|(a, b)| (b - a) / h).collect();
        system.backend.hold(held);
        let backend = &system.backend;
        backend.clear(&mut self.dv);
        let has_constant =
            alpha != 0.0 || held.iter().any(|held| held.grip.friction != [0.0; 3] || held.grip.drag > 0.0);
        let mut constant = has_constant.then(|| self.constant.get_or_insert_with(|| backend.zeros()));
        if let Some(constant) = &mut constant {
            backend.clear(constant);
            if alpha != 0.0 {
                system.masses.add(backend, -h * alpha, state.velocity(), constant);
            }
        }
        if !held.is_empty() {
            let (mut change, mut friction) = (vec![[0.0; 3]; v.len()], vec![[0.0; 3]; v.len()]);
            for held in held {
                let node = held.node as usize;
                let to: [f64; 3] = std::array::from_fn(|i| held.target[i] / h - v[node][i]);
                let along: f64 = to.iter().zip(held.normal).map(|(x, n)| x * n).sum();
                change[node] = if held.grip.sticks { to } else { held.normal.map(|n| along * n) };
                friction[node] = held.grip.friction;
                if held.grip.drag > 0.0 {
                    // -drag (h (v + dv) - target) along the surface: the part of dv is a mass, which has no direction.
                    let slip = held.slip(v[node].map(|v| h * v));
                    friction[node] = std::array::from_fn(|i| held.grip.drag * (h * along * held.normal[i] - slip[i]));
                }
            }
            backend.axpy(1.0, &backend.upload(&change), &mut self.dv);
            if let Some(constant) = constant {
                backend.axpy(1.0, &backend.upload(&friction), constant);
            }
        }
        backend.impose_change(&velocity, state.velocity(), &mut self.dv);
        let equation = Equation {
            mass: 1.0 + h * alpha,
            stiffness: h * h,
            displacement: h,
            force: h,
            time: end,
            u: &state.u,
            velocity: Some(state.velocity()),
            constant: self.constant.as_ref().filter(|_| has_constant),
            viscous: system.body.is_viscous(),
            stiffness_damping: system.body.stiffness_damping,
        };
        let drags: Vec<(u32, f64)> = held
            .iter()
            .filter(|held| held.grip.drag > 0.0)
            .map(|held| (held.node, held.grip.drag * h / equation.mass))
            .collect();
        let masses = (!drags.is_empty()).then(|| Masses::of(&system.backend, &system.body, &drags));
        let masses = masses.map(|masses| std::mem::replace(&mut system.masses, masses));
        let solved = self.newton.solve(system, &equation, &mut self.dv, &self.settings).and_then(|report| {
            let holding = if held.is_empty() { vec![] } else { self.newton.holding(system, &equation, &self.dv)? };
            Ok((report, holding))
        });
        if let Some(masses) = masses {
            system.masses = masses;
        }
        solved
    }

    /// Solves for dV with the nodes held that have to be.
    fn solve_with_contact<F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        state: &State<B>,
        h: f64,
        contact: &Contact,
    ) -> Result<StepReport, SolveError> {
        let passages = contact.passages(state.time, state.time + h);
        let tolerance = contact.tolerance(system.backend.epsilon());
        let [u, v] = [&state.u, state.velocity()].map(|x| system.backend.download(x));
        let mut holding = std::mem::take(&mut self.holding);
        holding.begin(contact, &passages, &u, tolerance);
        let mut report = StepReport::default();
        for attempt in 1..=ATTEMPTS {
            let (cost, mut impulses) = self.solve(system, state, h, holding.held(), &v)?;
            report += cost;
            let dv = system.backend.download(&self.dv);
            let way = |(v, dv): (&[f64; 3], &[f64; 3])| std::array::from_fn(|i| h * (v[i] + dv[i]));
            let by: Vec<[f64; 3]> = v.iter().zip(&dv).map(way).collect();
            impulses.resize(v.len(), [0.0; 3]);
            let mut total = vec![[0.0; 3]; v.len()];
            for held in holding.held() {
                let (node, free) = (held.node as usize, contact.free[held.index]);
                // What supports hold is not the obstacle's.
                (0..3).filter(|i| !free[*i]).for_each(|i| impulses[node][i] = 0.0);
                let sliding = if held.grip.sticks { [0.0; 3] } else { held.grip.impulse(held.slip(by[node])) };
                total[node] = std::array::from_fn(|i| impulses[node][i] + sliding[i]);
            }
            let goes_on = holding.look(contact, &passages, &Attempt { u: &u, by: &by, impulses: &impulses }, tolerance);
            if !goes_on || attempt == ATTEMPTS {
                report.unsettled += u64::from(goes_on);
                system.add_impulses(&total);
                break;
            }
        }
        self.holding = holding;
        Ok(report)
    }
}

impl<B: Backend, F: ForceField<B>> Integrator<B, F> for ImplicitEuler<B> {
    fn step(&mut self, system: &mut System<B, F>, state: &mut State<B>, h: f64) -> Result<StepReport, SolveError> {
        let looks = system.touch.as_ref().is_some_and(|touch| touch.is_looked_for);
        let report = match system.body.contact.as_ref().filter(|_| looks).map(Arc::clone) {
            Some(contact) => {
                let solved = self.solve_with_contact(system, state, h, &contact);
                system.backend.hold(&[]);
                solved?
            }
            None => self.solve(system, state, h, &[], &[])?.0,
        };
        let target = system.body.motions_at(state.time + h);
        let backend = &system.backend;
        let [u, v] = state.motion();
        backend.axpy(1.0, &self.dv, v);
        backend.axpy(h, v, u);
        backend.impose(&target, u);
        // What rounding left, and what did not settle.
        system.meet_obstacles(state, h);
        Ok(report)
    }

    fn solved(&self, backend: &B) -> Option<Solved> {
        Some(Solved { reported: self.newton.reached, change: backend.download(&self.dv) })
    }

    fn memory(&self) -> Value {
        json!({ "held": self.holding.memory() })
    }

    fn recall(&mut self, memory: &Value) {
        self.holding.recall(&memory["held"]);
    }
}

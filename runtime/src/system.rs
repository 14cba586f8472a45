//! A body on a backend: state, masses, loads and imposed motion over time, shared by all integrators.

use serde_json::Value;

use crate::backend::{Backend, ForceField, LeftDomain, Meeting};
use crate::body::{Body, Start};
use crate::device::DeviceError;
use crate::mass::Masses;

/// Displacement and velocity at a time; positions are never stored.
pub struct State<B: Backend> {
    /// Displacement.
    pub u: B::Vector,
    /// Velocity; none in statics.
    pub v: Option<B::Vector>,
    /// Time.
    pub time: f64,
    /// Steps taken.
    pub step: u64,
}

impl<B: Backend> State<B> {
    /// The velocity of a body that moves.
    ///
    /// # Panics
    /// It does not.
    pub fn velocity(&self) -> &B::Vector {
        self.v.as_ref().expect("a body that moves has a velocity")
    }

    /// Displacement and velocity of a body that moves.
    ///
    /// # Panics
    /// It does not.
    pub fn motion(&mut self) -> [&mut B::Vector; 2] {
        [&mut self.u, self.v.as_mut().expect("a body that moves has a velocity")]
    }
}

/// Why a simulation cannot go on. What was computed before stays valid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// An element left its law's domain.
    #[error("{0}; take a smaller step, ramp the loads more slowly, or use a law without a domain")]
    LeftDomain(#[from] LeftDomain),
    /// The state grew beyond all bounds.
    #[error(
        "the simulation diverged: displacements differ by {largest:.3e} times the body's size; take a smaller step \
         (the critical step is reported) or an implicit integrator"
    )]
    Diverged {
        /// The largest difference of displacements over the body's diameter.
        largest: f64,
    },
    /// The device failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// A linear or nonlinear solver gave up.
    #[error(
        "the {solver} solver did not converge: relative residual {residual:.3e} after {iterations} iterations, wanted \
         {tolerance:.1e}; {remedy}"
    )]
    NotConverged {
        /// "linear" or "nonlinear".
        solver: &'static str,
        /// Iterations taken.
        iterations: u32,
        /// Residual reached.
        residual: f64,
        /// Residual wanted.
        tolerance: f64,
        /// What to change.
        remedy: &'static str,
    },
}

/// A body on a backend.
pub struct System<B: Backend, F: ForceField<B>> {
    /// Vectors.
    pub backend: B,
    /// Elements.
    pub field: F,
    /// The body in scaled units.
    pub body: Body,
    /// M.
    pub masses: Masses<B>,
    /// Contact, if there is anything to meet.
    pub touch: Option<Touch<B>>,
    loads: Vec<B::Vector>,
    pressures: Vec<B::Pressure>,
}

/// Contact of a body on a backend.
pub struct Touch<B: Backend> {
    device: B::Contact,
    /// Whether impulses on the nodes are wanted.
    pub is_recorded: bool,
    /// Those since they were last cleared; none before something may first be met.
    pub impulse: Option<B::Vector>,
    /// Whether steps look for contact: they need not while nothing can be met.
    pub is_looked_for: bool,
    /// Steps that looked for contact.
    pub steps: u64,
}

impl<B: Backend> Touch<B> {
    /// Makes room for impulses, if they are wanted.
    fn begin_impulses(&mut self, backend: &B) {
        if self.is_recorded {
            self.impulse.get_or_insert_with(|| backend.zeros());
        }
    }
}

/// A body spread over this many of its diameters has diverged: no law of solids means such a stretch, and explicit
/// blow-ups pass it within a few steps. A body that travels as a whole is not spread.
const DIVERGED: f64 = 1e4;

impl<B: Backend, F: ForceField<B>> System<B, F> {
    /// Puts a body on a backend.
    pub fn new(backend: B, field: F, mut body: Body) -> Self {
        body.contact = body.contact.map(|contact| backend.contact_here(contact));
        let masses = Masses::of(&backend, &body, &[]);
        let loads = body.loads.iter().map(|l| backend.upload(&l.forces)).collect();
        let touch = body.contact.as_ref().map(|contact| Touch {
            device: backend.contact(contact),
            is_recorded: false,
            impulse: None,
            is_looked_for: true,
            steps: 0,
        });
        let pressures = body.pressures.iter().map(|p| backend.pressure(&p.faces)).collect();
        Self { backend, field, body, masses, touch, loads, pressures }
    }

    /// The state at rest with this velocity everywhere, imposed components at their time-0 values.
    pub fn initial_state(&self, velocity: [f64; 3]) -> State<B> {
        self.start(&Start::moving(velocity))
    }

    /// A state to start from, imposed components at their time-0 values.
    pub fn start(&self, start: &Start) -> State<B> {
        let mut u = start.displacement.as_ref().map_or_else(|| self.backend.zeros(), |u| self.backend.upload(u));
        self.backend.impose(&self.body.motions_at(0.0), &mut u);
        let v = self.body.moves.then(|| {
            let uniform = || self.backend.upload(&vec![start.velocity; self.body.masses.len()]);
            let mut v = start.velocities.as_ref().map_or_else(uniform, |v| self.backend.upload(v));
            self.backend.project(&mut v);
            v
        });
        State { u, v, time: 0.0, step: 0 }
    }

    /// f += the loads at a time.
    pub fn add_loads(&self, time: f64, f: &mut B::Vector) {
        for (load, vector) in self.body.loads.iter().zip(&self.loads) {
            let factor = load.history.at(time);
            if factor != 0.0 {
                self.backend.axpy(factor, vector, f);
            }
        }
    }

    /// f = internal forces at u plus loads at a time.
    ///
    /// # Errors
    /// An element is outside its law's domain.
    pub fn force(&mut self, u: &B::Vector, time: f64, f: &mut B::Vector) -> Result<(), LeftDomain> {
        self.backend.clear(f);
        self.field.add_force(&self.backend, u, f)?;
        self.add_loads(time, f);
        for (pressure, faces) in self.body.pressures.iter().zip(&self.pressures) {
            let value = pressure.history.at(time);
            if value != 0.0 {
                self.backend.add_pressure(faces, value, u, f);
            }
        }
        Ok(())
    }

    /// f += the elements' damping forces at displacement u and velocity v: those of dissipations, and Rayleigh's -beta K v.
    pub fn add_damping(&mut self, u: &B::Vector, v: &B::Vector, f: &mut B::Vector) {
        if self.body.is_viscous() {
            self.field.add_damping(&self.backend, [u, v], 1.0, f);
        }
        if self.body.stiffness_damping != 0.0 {
            self.field.add_dforce_at(&self.backend, u, v, self.body.stiffness_damping, f);
        }
    }

    /// What contact does at the end of an explicit step of length h, which the displacement has taken.
    pub fn meet_obstacles(&mut self, state: &mut State<B>, h: f64) {
        let (Some(touch), Some(contact)) = (&mut self.touch, &self.body.contact) else { return };
        if !touch.is_looked_for {
            return;
        }
        touch.steps += 1;
        touch.begin_impulses(&self.backend);
        let passages = contact.passages(state.time, state.time + h);
        let [u, v] = state.motion();
        self.backend.touch(Meeting {
            contact: &touch.device,
            passages: &passages,
            h,
            masses: self.masses.of_motion(),
            v,
            u,
            impulse: touch.impulse.as_mut(),
        });
    }

    /// Adds impulses to those of contact, if these are wanted.
    pub fn add_impulses(&mut self, impulses: &[[f64; 3]]) {
        let Some(touch) = &mut self.touch else { return };
        touch.begin_impulses(&self.backend);
        if let Some(impulse) = &mut touch.impulse {
            self.backend.axpy(1.0, &self.backend.upload(impulses), impulse);
        }
    }

    /// The least distance of the surface from an obstacle at a displacement and a time; `limit` where it is more than that,
    /// or there is none.
    pub fn gap(&self, u: &B::Vector, time: f64, limit: f64) -> f64 {
        match (&self.touch, &self.body.contact) {
            (Some(touch), Some(contact)) => self.backend.gap(&touch.device, &contact.passages(time, time), limit, u),
            _ => limit,
        }
    }

    /// Work of the loads against u: minus their potential, 0 at rest.
    pub fn load_work(&self, u: &B::Vector, time: f64) -> f64 {
        let loads = self.body.loads.iter().zip(&self.loads);
        loads.map(|(load, vector)| load.history.at(time) * self.backend.dot(vector, u)).sum()
    }

    /// v . M v / 2.
    pub fn kinetic_energy(&self, v: &B::Vector) -> f64 {
        let mut p = self.backend.zeros();
        self.masses.add(&self.backend, 0.5, v, &mut p);
        self.backend.dot(&p, v)
    }

    /// Refuses a state that has grown beyond all bounds, or that a failed device returned.
    ///
    /// # Errors
    /// [`SolveError::Diverged`], [`SolveError::Device`].
    pub fn check_bounded(&self, state: &State<B>) -> Result<(), SolveError> {
        let limit = DIVERGED * self.body.diameter;
        let largest = self.backend.max_abs(&state.u);
        self.backend.check()?;
        if largest < limit {
            return Ok(());
        }
        // Far from home: spread out, or only moved?
        let u = self.backend.download(&state.u);
        let spread = |c: usize| {
            let (low, high) = u.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), u| (l.min(u[c]), h.max(u[c])));
            high - low
        };
        let finite = u.as_flattened().iter().all(|x| x.is_finite());
        let largest = if finite { (0..3).map(spread).fold(0.0, f64::max) } else { f64::INFINITY };
        let imposed = self.body.motions.iter().map(|m| m.at(state.time).abs()).fold(0.0, f64::max);
        if largest < limit + imposed {
            return Ok(());
        }
        Err(SolveError::Diverged { largest: largest / self.body.diameter })
    }
}

/// An integrator: takes a body from one time to the next.
pub trait Integrator<B: Backend, F: ForceField<B>> {
    /// Takes one step of length h.
    ///
    /// # Errors
    /// The step failed; the state is then that before the step.
    fn step(&mut self, system: &mut System<B, F>, state: &mut State<B>, h: f64) -> Result<StepReport, SolveError>;
    /// What the last solution of its last step found, if it solves anything.
    fn solved(&self, _backend: &B) -> Option<Solved> {
        None
    }
    /// What it remembers from step to step besides the state.
    fn memory(&self) -> Value {
        Value::Null
    }
    /// Goes on with what another run's remembered; nothing, where that is none of its own.
    fn recall(&mut self, _memory: &Value) {}
}

/// What a solution found.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// The residual as the solver knows it, as a part of what had to be balanced: that of the linear solution, which is recursive,
    /// where a step is linearised, else Newton's.
    pub reported: f64,
    /// By how much the step changes the velocity of each node; in equilibrium the displacement.
    pub change: Vec<[f64; 3]>,
}

/// What a step cost.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepReport {
    /// Evaluations of the forces.
    pub forces: u64,
    /// Products with the tangent (CG iterations).
    pub products: u64,
    /// Newton iterations.
    pub newton: u64,
    /// Linear solutions that stopped because the precision was exhausted.
    pub stagnated: u64,
    /// Linear solutions that met a direction of negative curvature.
    pub negative_curvature: u64,
    /// Steps whose contact had not settled after the last solution.
    pub unsettled: u64,
    /// The greatest part of a residual that was left where rounding let it fall no further; 0 where all fell as far as asked.
    pub left: f64,
}

impl std::ops::AddAssign for StepReport {
    fn add_assign(&mut self, o: Self) {
        self.forces += o.forces;
        self.products += o.products;
        self.newton += o.newton;
        self.stagnated += o.stagnated;
        self.negative_curvature += o.negative_curvature;
        self.unsettled += o.unsettled;
        self.left = self.left.max(o.left);
    }
}

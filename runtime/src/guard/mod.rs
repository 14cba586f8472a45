//! Guards: cheap indicators of where the results of a run cannot be trusted, each with a threshold and a cure.
//!
//! | guard | what | looked at |
//! |---|---|---|
//! | `linear` | rotation and strain of elements whose law is linear | states |
//! | `stretches` | principal stretches against the range for which the law's author trusts it | states |
//! | `inverted` | elements that are inside out, of laws without a domain | states |
//! | `rounding` | lambda/mu at rest against the precision | once |
//! | `locking` | Poisson's ratio at rest of linear simplices | once |
//! | `residual` | what solvers report against what is true | the last step |
//! | `curvature` | linear solutions of linearised steps that met a direction of negative curvature | all |
//! | `step` | the step of explicit integrators against the critical one | once |
//!
//! States are looked at on the CPU in f64, at most 16 times a run and at its end: a look costs about as much as the
//! forces do. docs/scenes.md says where thresholds come from.

mod at_rest;
mod gradient;
mod inverted;
mod residual;
mod strain;

use serde_json::{Value, json};

use crate::body::Body;
use crate::scene::Precision;
use crate::step_limit::StepLimits;

use at_rest::AtRest;
use inverted::Inverted;
pub use residual::LastStep;
use residual::Residual;
use strain::Strains;

/// How often recorded states of a run are looked at, at most, as said above.
const LOOKS: u64 = 16;

/// Whether the guards of a body ask a device for its state; those of implicit steps ask at the end.
pub fn reads(body: &Body, implicit: bool) -> bool {
    implicit || Strains::of(body).is_needed() || Inverted::of(body).is_needed()
}

/// The guards of a run.
#[derive(Debug, Clone, Default)]
pub struct Guards {
    at_rest: AtRest,
    strains: Strains,
    inverted: Inverted,
    residual: Option<Residual>,
    /// Of linearised steps: the solutions that met a direction of negative curvature.
    curvature: Option<u64>,
    steps: u64,
    /// The step that was looked at last.
    seen: u64,
    /// The explicit step as a part of the critical one.
    step: Option<f64>,
}

impl Guards {
    /// Of a body at rest that takes so many steps in a precision.
    pub fn new(body: &Body, precision: Precision, steps: u64) -> Self {
        let (at_rest, strains) = (AtRest::of(body, precision), Strains::of(body));
        Self { at_rest, strains, inverted: Inverted::of(body), steps, ..Self::default() }
    }

    /// Warnings of what is known before the first step.
    pub fn before(&self) -> Vec<String> {
        self.at_rest.warnings()
    }

    /// The length of an explicit step and the critical ones, in s.
    pub fn step(&mut self, step: f64, limits: StepLimits) {
        self.step = Some(step / limits.power);
    }

    /// Whether to look at the recorded state after a step.
    pub fn is_due(&self, step: u64) -> bool {
        let part = |step: u64| (u128::from(step) * u128::from(LOOKS.min(self.steps))) / u128::from(self.steps.max(1));
        self.is_needed() && part(step) > part(self.seen)
    }

    /// Whether the last state has yet to be looked at.
    pub fn is_due_at_end(&self, step: u64) -> bool {
        self.is_needed() && step > self.seen
    }

    /// Looks at the state after a step: the displacement of each node in the body's units, at a time in s.
    pub fn look(&mut self, body: &Body, u: &[[f64; 3]], step: u64, time: f64) {
        self.strains.look(body, u, time);
        self.inverted.look(body, u, time);
        self.seen = step;
    }

    fn is_needed(&self) -> bool {
        self.strains.is_needed() || self.inverted.is_needed()
    }

    /// Computes the true residual of a step in f64, which costs about as much as a few steps.
    pub fn judge(&mut self, step: &LastStep) {
        self.residual = Residual::of(step, self.at_rest.contrast());
    }

    /// Of linearised steps: how many of their linear solutions met a direction of negative curvature and ended there.
    pub fn cut_short(&mut self, solutions: u64) {
        self.curvature = Some(solutions);
    }

    /// Warnings of what was seen.
    pub fn after(&self) -> Vec<String> {
        let mut warnings = self.strains.warnings();
        warnings.extend(self.inverted.warning());
        warnings.extend(self.residual.as_ref().and_then(Residual::warning));
        if let Some(cut) = self.curvature.filter(|cut| *cut > 0) {
            warnings.push(format!(
                "{cut} linearised steps met a direction of negative curvature (the body buckles, or is compressed beyond what its law \
                 resists) and were cut short there: no such step is a solution; take solver.newton.max_iterations above 1, or smaller steps"
            ));
        }
        warnings
    }

    /// Values with their thresholds; null where there is nothing to judge.
    pub fn to_json(&self) -> Value {
        let ([linear, stretches], [rounding, locking]) = (self.strains.to_json(), self.at_rest.to_json());
        json!({
            "linear": linear, "stretches": stretches, "inverted": self.inverted.to_json(), "rounding": rounding, "locking": locking,
            "residual": self.residual.map(Residual::to_json),
            "curvature": self.curvature.map(|cut| json!({ "cut_short": cut, "threshold": 0 })),
            "step": self.step.map(|ratio| json!({ "over_critical": ratio, "threshold": 1.0 })),
        })
    }
}

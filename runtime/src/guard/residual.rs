//! The residual that an implicit step in f32 or an equilibrium really left, in f64: a solver in f32 reports a recursive or a rounded
//! one, and one of statics what is left of an imposed motion's first imbalance.

use serde_json::{Value, json};

use crate::backend::{Backend, ForceField, Operator};
use crate::body::Body;
use crate::cg::{CgLimits, ConjugateGradient};
use crate::cpu::{CpuBackend, CpuField, CpuVector};
use crate::scene::{Integrator, Newton, Precision, Solver};
use crate::system::{Solved, System};

/// The true residual may be so many times what the solver should reach, or reports.
const TIMES: f64 = 10.0;
/// An error of displacements that is worth a warning.
const ERROR: f64 = 1e-3;
/// Tolerances times a ratio of stiffnesses are errors of displacements: from this on they are worth a look.
const DOUBTFUL: f64 = 1e-4;
/// How far the residual falls in the solution that estimates it, and its iterations.
const ESTIMATE: CgLimits = CgLimits { tolerance: 1e-2, max_iterations: 1000 };
/// A reported residual above this is no excuse for the true one.
const EXCUSED: f64 = 1e-4;
/// Newton's method evaluates its residuals, and stops where rounding leaves no less: 10 times this, in f32 and in f64, is not worth a
/// warning.
const ROUNDED: [f64; 2] = [1e-5, 1e-12];

/// The last step of a run, in the body's units.
pub struct LastStep<'a> {
    /// The body.
    pub body: &'a Body,
    /// How it was solved.
    pub solver: &'a Solver,
    /// Its length, and the time at its end.
    pub clock: [f64; 2],
    /// Displacement and velocity before it.
    pub before: &'a [Vec<[f64; 3]>; 2],
    /// The displacement after it.
    pub after: &'a [[f64; 3]],
    /// What its last solution found.
    pub solved: Solved,
}

/// What was found of the last step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Residual {
    truth: f64,
    reported: f64,
    tolerance: f64,
    newton: bool,
    precision: Precision,
    /// Of equilibrium: the greatest displacement that one more linear solution adds, as a part of the greatest.
    error: Option<f64>,
}

impl Residual {
    /// Computes the true residual, of a body whose materials' stiffnesses differ so many times at rest; none where it is not known:
    /// outside a law's domain, or without any force.
    pub(super) fn of(step: &LastStep, contrast: f64) -> Option<Self> {
        let Newton { tolerance, max_iterations } = step.solver.newton;
        let newton = max_iterations > 1;
        let tolerance = if newton { tolerance } else { step.solver.cg.tolerance };
        let (truth, error) = relative(step, !newton, contrast)?;
        truth.is_finite().then_some(Self {
            truth,
            reported: step.solved.reported,
            tolerance,
            newton,
            precision: step.solver.precision,
            error,
        })
    }

    fn threshold(&self) -> f64 {
        let rounded = match (self.newton, self.precision) {
            (false, _) => 0.0,
            (true, Precision::F32) => ROUNDED[0],
            (true, Precision::F64) => ROUNDED[1],
        };
        TIMES * self.tolerance.max(self.reported.min(EXCUSED)).max(rounded)
    }

    /// A warning with its cure.
    pub(super) fn warning(&self) -> Option<String> {
        if let Some(error) = self.error.filter(|error| *error > ERROR) {
            return Some(format!(
                "displacements of the equilibrium are off by about {:.1e} of the greatest, though the residual is small: stiff parts make \
                 most of it, and soft ones are far from balance; take a smaller solver.newton.tolerance with solver.precision = \
                 \"f64\", or parts that differ less in stiffness",
                error
            ));
        }
        let key = if self.newton { "solver.newton.tolerance" } else { "solver.cg.tolerance" };
        let cure = match self.precision {
            Precision::F32 => {
                "f32 cannot solve this any better; take solver.precision = \"f64\", or a looser tolerance and what it costs in accuracy"
            }
            Precision::F64 => "take smaller steps, or a smaller tolerance",
        };
        (self.truth > self.threshold()).then(|| {
            format!(
                "the last step's true residual is {:.1e}, where the solver reports {:.1e} and {key} is {:.1e}: {cure}",
                self.truth, self.reported, self.tolerance
            )
        })
    }

    /// Values and threshold.
    pub(super) fn to_json(self) -> Value {
        json!({
            "estimated_error": self.error, "true": self.truth, "reported": self.reported, "tolerance": self.tolerance, "threshold": self.threshold(),
        })
    }
}

/// The norm of the residual over that of the elements' and inertial forces, all in the norm of the step's diagonal.
///
/// Of a linearised step it is that of the linear equations at the state before it. With it, of equilibrium, an estimate of the error
/// of displacements.
fn relative(step: &LastStep, is_linearised: bool, contrast: f64) -> Option<(f64, Option<f64>)> {
    let mut body = step.body.clone();
    body.contact = None;
    let backend = CpuBackend::<f64>::new(&body);
    let field = CpuField::<f64>::new(&backend, &body);
    let mut system = System::new(backend, field, body);
    let [h, time] = step.clock;
    let [mut residual, mut inner, mut inertia, mut diagonal] = std::array::from_fn(|_| system.backend.zeros());
    if step.solver.integrator == Integrator::Static {
        if is_linearised && !system.body.is_linear() {
            // The linear equations were those of a state that is gone.
            return None;
        }
        let end = system.backend.upload(step.after);
        system.force(&end, time, &mut residual).ok()?;
        system.field.add_force(&system.backend, &end, &mut inner).ok()?;
        system.field.prepare(&system.backend, &end);
        system.field.add_diagonal(&system.backend, 1.0, &mut diagonal);
        system.backend.make_positive(&mut diagonal);
        let differ = contrast.max(spread(&system, &diagonal));
        let is_doubtful = step.solver.precision == Precision::F32 || step.solver.newton.tolerance * differ > DOUBTFUL;
        let error = if is_doubtful { correction(&mut system, &end, &residual, &diagonal) } else { None };
        return Some((ratio(&system, residual, diagonal, &[&inner]), error));
    }
    let [start, v, dv] = [&step.before[0], &step.before[1], &step.solved.change].map(|x| system.backend.upload(x));
    let (alpha, beta, viscous) = (system.body.mass_damping, system.body.stiffness_damping, system.body.is_viscous());
    let mut rate = system.backend.zeros();
    system.backend.copy(&v, &mut rate);
    system.backend.axpy(1.0, &dv, &mut rate);
    let mut at = system.backend.zeros();
    system.backend.copy(&start, &mut at);
    if !is_linearised {
        system.backend.axpy(h, &rate, &mut at);
    }
    system.force(&at, time, &mut residual).ok()?;
    let System { backend, field, masses, .. } = &mut system;
    field.add_force(backend, &at, &mut inner).ok()?;
    field.prepare(backend, &at);
    if is_linearised {
        field.add_dforce(backend, &rate, h, &mut residual);
        field.add_dforce(backend, &rate, h, &mut inner);
    }
    if viscous && is_linearised {
        field.add_damping(backend, [&start, &v], 1.0, &mut residual);
        field.add_ddamping(backend, [&start, &v], &dv, 1.0, &mut residual);
    } else if viscous {
        field.add_damping(backend, [&start, &rate], 1.0, &mut residual);
    }
    if beta != 0.0 {
        field.add_dforce_at(backend, &start, &rate, beta, &mut residual);
    }
    masses.add(backend, -alpha, &rate, &mut residual);
    masses.add(backend, 1.0 / h, &dv, &mut inertia);
    backend.axpy(-1.0, &inertia, &mut residual);
    field.add_diagonal(backend, h + beta, &mut diagonal);
    if viscous {
        field.add_damping_diagonal(backend, [&start, &v], 1.0, &mut diagonal);
    }
    backend.axpy(1.0 / h + alpha, masses.diagonal()?, &mut diagonal);
    Some((ratio(&system, residual, diagonal, &[&inner, &inertia]), None))
}

/// The largest entry of a positive diagonal over the least, of free components: where a body is flattened or meshed unevenly they differ
/// though its materials do not.
fn spread(system: &System<CpuBackend<f64>, CpuField<f64>>, diagonal: &CpuVector<f64>) -> f64 {
    let mut free = system.backend.zeros();
    system.backend.copy(diagonal, &mut free);
    system.backend.project(&mut free);
    let entries = system.backend.download(&free);
    let positive = entries.as_flattened().iter().filter(|x| **x > 0.0);
    let [most, least] = positive.fold([0.0_f64, f64::INFINITY], |[most, least], x| [most.max(*x), least.min(*x)]);
    if most > 0.0 { most / least } else { 1.0 }
}

/// What one more linear solution would add to a displacement at which the field is prepared, each the greatest of a component.
fn correction(
    system: &mut System<CpuBackend<f64>, CpuField<f64>>,
    at: &CpuVector<f64>,
    residual: &CpuVector<f64>,
    diagonal: &CpuVector<f64>,
) -> Option<f64> {
    let mut right = system.backend.zeros();
    system.backend.copy(residual, &mut right);
    system.backend.project(&mut right);
    let mut increment = system.backend.zeros();
    let System { backend, field, masses, .. } = &mut *system;
    let operator = Operator { masses, mass: 0.0, stiffness: 1.0, damping: None };
    ConjugateGradient::new(backend).solve(backend, field, &operator, diagonal, &right, &mut increment, ESTIMATE);
    let greatest = |x: &CpuVector<f64>| {
        system.backend.download(x).as_flattened().iter().fold(0.0_f64, |most, x| most.max(x.abs()))
    };
    let (added, whole) = (greatest(&increment), greatest(at));
    (whole > 0.0 && added.is_finite()).then(|| added / whole)
}

/// The norm of the free part of a residual over the sum of some forces' norms; 0 without forces.
fn ratio(
    system: &System<CpuBackend<f64>, CpuField<f64>>,
    mut residual: CpuVector<f64>,
    mut diagonal: CpuVector<f64>,
    forces: &[&CpuVector<f64>],
) -> f64 {
    let backend = &system.backend;
    backend.make_positive(&mut diagonal);
    backend.project(&mut residual);
    let mut scratch = backend.zeros();
    let mut norm = |x: &CpuVector<f64>| {
        backend.divide(x, &diagonal, &mut scratch);
        backend.dot(x, &scratch).max(0.0).sqrt()
    };
    let all: f64 = forces.iter().map(|force| norm(force)).sum();
    if all > 0.0 { norm(&residual) / all } else { 0.0 }
}

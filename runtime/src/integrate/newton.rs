//! Newton's method on m M (x - x_0) = forces, the equation that implicit steps and statics share.
//!
//! Each iteration solves with A = m M + k K at the current state by conjugate gradient. An iterate that leaves a law's
//! domain, or that makes the residual larger, is taken back by half until it does neither. Norms are those of
//! D = diag A; a residual at the level of rounding is as good as converged and is reported as such.

use crate::backend::{Backend, Damping, ForceField, LeftDomain, Operator};
use crate::cg::{CgLimits, CgOutcome, CgReport, ConjugateGradient};
use crate::mass::Masses;
use crate::scene::Preconditioner;
use crate::system::{SolveError, StepReport, System};

use super::equation::{Damped, Equation};

/// When Newton's method stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonLimits {
    /// The residual's norm must fall by this factor.
    pub tolerance: f64,
    /// Iterations, at most; 1 takes one linearised step and asks for no convergence.
    pub max_iterations: u32,
}

/// Settings of the implicit solvers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverSettings {
    /// Linear solver.
    pub cg: CgLimits,
    /// Preconditioner of the linear solver.
    pub preconditioner: Preconditioner,
    /// Nonlinear solver.
    pub newton: NewtonLimits,
}

/// Fall of the residual asked of a nonlinear solution's first linear one, and at most of the later ones.
///
/// Linear residuals below the error of the linearisation are wasted: each solution is as tight as the last iteration's
/// progress lets one expect of the next (Eisenstat and Walker 1996, choice 2, gamma .9), never tighter than the goal
/// needs nor than the setting asks.
const FORCING: (f64, f64) = (1e-3, 1e-2);

/// Halvings of one Newton increment.
const HALVINGS: u32 = 12;

/// Work vectors of the implicit solvers: what one linearised step does not use is made when something else first does.
pub(super) struct Newton<B: Backend> {
    damped: Option<Damped<B>>,
    cg: ConjugateGradient<B>,
    diagonal: B::Vector,
    residual: B::Vector,
    /// Ones everywhere: no preconditioner, and the roundings of a displaced body.
    ones: Option<B::Vector>,
    judge: Option<Judge<B>>,
    iterate: Option<Iterate<B>>,
    /// The displacement of an iterate.
    u: Option<B::Vector>,
    /// The relative residual that the last solution ended with.
    pub reached: f64,
}

/// Vectors by which the norm of a residual is computed.
struct Judge<B: Backend> {
    scratch: B::Vector,
    product: B::Vector,
}

impl<B: Backend> Judge<B> {
    fn new(backend: &B) -> Self {
        Self { scratch: backend.zeros(), product: backend.zeros() }
    }
}

/// Vectors of Newton's method beyond the first solution.
struct Iterate<B: Backend> {
    increment: B::Vector,
    trial: B::Vector,
}

impl<B: Backend> Newton<B> {
    pub fn new(backend: &B) -> Self {
        Self {
            damped: None,
            cg: ConjugateGradient::new(backend),
            diagonal: backend.zeros(),
            residual: backend.zeros(),
            ones: None,
            judge: None,
            iterate: None,
            u: None,
            reached: 0.0,
        }
    }

    /// The vector for displacements of iterates, to be put back.
    fn displacement(&mut self, backend: &B) -> B::Vector {
        self.u.take().unwrap_or_else(|| backend.zeros())
    }

    /// The vectors for increments, to be put back.
    fn vectors(&mut self, backend: &B) -> Iterate<B> {
        let new = || Iterate { increment: backend.zeros(), trial: backend.zeros() };
        self.iterate.take().unwrap_or_else(new)
    }

    /// Solves for x, which comes with its imposed components set and its free ones 0.
    pub fn solve<F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        equation: &Equation<B>,
        x: &mut B::Vector,
        settings: &SolverSettings,
    ) -> Result<StepReport, SolveError> {
        let mut report = StepReport { forces: 1, ..StepReport::default() };
        equation.residual(system, equation.u, None, &mut None, &mut self.residual)?;
        system.field.prepare(&system.backend, equation.u);
        self.begin_damping(system, equation);
        if let Some(v) = equation.velocity {
            // The linearised force at u_0 + displacement v_0, with the damping of v_0.
            let factor = equation.force * (equation.displacement + equation.stiffness_damping);
            if equation.viscous {
                system.field.add_damping(&system.backend, [equation.u, v], equation.force, &mut self.residual);
            }
            system.field.add_dforce(&system.backend, v, factor, &mut self.residual);
            system.backend.project(&mut self.residual);
            report.products += 1;
        }
        self.diagonal(system, equation);
        let linearised = settings.newton.max_iterations == 1;
        // What the first linear solution has to balance: the scale of the residual.
        let judged = !linearised || equation.mass == 0.0;
        let reference = if judged { self.imbalance(system, equation, x) } else { 0.0 };
        if equation.mass == 0.0 && reference <= self.rounding(system, equation, equation.u, None) {
            // Nothing but the rounding of K u is out of balance: a solution would chase noise. Where there is inertia, a
            // force as small as that still accelerates the body, step after step.
            self.reached = 0.0;
            return Ok(report);
        }
        let exact = linearised || system.body.is_linear();
        let tightest = settings.cg.tolerance;
        let first = if exact { tightest } else { tightest.max(FORCING.0) };
        let solved = self.linear(system, equation, settings, first, x)?;
        self.reached = solved.residual;
        account(&mut report, solved);
        if linearised {
            return Ok(report);
        }
        // The displacement of the iterate is a part of the solver, but is read beside the others: it is out until the end.
        let mut u = self.displacement(&system.backend);
        let solved = self.iterate(system, equation, (x, &mut u), settings, reference, &mut report);
        self.u = Some(u);
        solved.map(|()| report)
    }

    /// Goes on from the first solution until the residual has fallen from the reference as far as it has to; in statics from the
    /// norm of what holds the body if that is less, as far as rounding lets it.
    fn iterate<F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        equation: &Equation<B>,
        (x, u): (&mut B::Vector, &mut B::Vector),
        settings: &SolverSettings,
        reference: f64,
        report: &mut StepReport,
    ) -> Result<(), SolveError> {
        let (exact, tightest) = (system.body.is_linear(), settings.cg.tolerance);
        let wanted = settings.newton.tolerance * reference;
        let mut previous = reference;
        for iteration in 1.. {
            equation.displaced(&system.backend, x, u);
            equation.imbalance(system, u, Some(x), &mut self.damped, &mut self.residual)?;
            report.forces += 1;
            // What a motion imposed on the first elements alone has to balance may be far more than what holds the body in
            // the end: an equilibrium is judged by the lesser.
            let held = if equation.mass == 0.0 { self.norm(&system.backend) } else { f64::INFINITY };
            system.backend.project(&mut self.residual);
            let norm = self.norm(&system.backend);
            self.reached = if reference > 0.0 { norm / reference } else { 0.0 };
            let goal = settings.newton.tolerance * reference.min(held);
            // Textbook stresses err by a strain of one rounding unit over an element's edge.
            let edge = (system.body.volume / system.body.elements.len() as f64).cbrt();
            let floor = self.rounding(system, equation, u, Some(edge));
            let is_last = iteration >= settings.newton.max_iterations;
            // Rounding excuses a residual only once it no longer falls.
            let stalled = norm > 0.5 * previous || is_last;
            if norm <= goal || stalled && norm <= wanted {
                return Ok(());
            }
            if stalled && norm <= 64.0 * floor {
                report.left = report.left.max(norm / reference);
                return Ok(());
            }
            if is_last {
                return Err(not_converged(iteration, norm / reference, settings.newton.tolerance));
            }
            let progress = 0.9 * (norm / previous).powi(2);
            let forcing = if exact { tightest } else { progress.min(FORCING.1).max(tightest).max(0.1 * goal / norm) };
            previous = norm;
            system.field.prepare(&system.backend, u);
            if let Some(damped) = &mut self.damped {
                damped.at_start = system.body.is_elastically_linear();
            }
            self.diagonal(system, equation);
            let Iterate { mut increment, mut trial } = self.vectors(&system.backend);
            system.backend.clear(&mut increment);
            let solved = self.linear(system, equation, settings, forcing, &mut increment).and_then(|linear| {
                account(report, linear);
                report.newton += 1;
                self.backtrack(system, equation, (&mut *x, &mut *u), (&increment, &mut trial), norm, report)
            });
            self.iterate = Some(Iterate { increment, trial });
            solved?;
        }
        unreachable!("the last iteration returns")
    }

    /// What holds each node at x: the imbalance with its sign changed, 0 where nothing is held.
    pub fn holding<F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        equation: &Equation<B>,
        x: &B::Vector,
    ) -> Result<Vec<[f64; 3]>, LeftDomain> {
        let mut u = self.displacement(&system.backend);
        equation.displaced(&system.backend, x, &mut u);
        let found = equation.imbalance(system, &u, Some(x), &mut self.damped, &mut self.residual);
        self.u = Some(u);
        found?;
        Ok(system.backend.download(&self.residual).into_iter().map(|r| r.map(|x| -x)).collect())
    }

    /// x += the largest of increment, increment/2, .. that stays in the domain and lowers the residual.
    fn backtrack<F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        equation: &Equation<B>,
        (x, u): (&mut B::Vector, &mut B::Vector),
        (increment, trial): (&B::Vector, &mut B::Vector),
        norm: f64,
        report: &mut StepReport,
    ) -> Result<(), SolveError> {
        let mut length = 1.0;
        let mut outside = None;
        for _ in 0..=HALVINGS {
            system.backend.copy(x, trial);
            system.backend.axpy(length, increment, trial);
            equation.displaced(&system.backend, trial, u);
            report.forces += 1;
            match equation.residual(system, u, Some(trial), &mut self.damped, &mut self.residual) {
                Ok(()) if self.norm(&system.backend) <= (1.0 - 1e-4 * length) * norm => {
                    system.backend.copy(trial, x);
                    return Ok(());
                }
                Ok(()) => {}
                Err(e) => outside = Some(e),
            }
            length /= 2.0;
        }
        match outside {
            Some(e) => Err(e.into()),
            // No descent along a direction that was solved for: the residual is at the level of rounding or of the
            // linear tolerance, which the caller's tests tell apart. x stays.
            None => Ok(()),
        }
    }

    /// The vectors that damping needs, if there is any, at x = 0.
    fn begin_damping<F: ForceField<B>>(&mut self, system: &System<B, F>, equation: &Equation<B>) {
        if !equation.viscous && equation.stiffness_damping == 0.0 {
            self.damped = None;
            return;
        }
        let backend = &system.backend;
        let new = || Damped { rate: backend.zeros(), elastic: backend.zeros(), at_start: true };
        let damped = self.damped.get_or_insert_with(new);
        damped.at_start = true;
        match equation.velocity {
            Some(v) => backend.copy(v, &mut damped.rate),
            None => backend.clear(&mut damped.rate),
        }
    }

    /// A at the prepared state and the current rate.
    fn operator<'a>(
        masses: &'a Masses<B>,
        equation: &Equation<'a, B>,
        damped: &'a Option<Damped<B>>,
    ) -> Operator<'a, B> {
        let (mass, mut stiffness) = (equation.mass, equation.stiffness);
        let damping = damped.as_ref().and_then(|Damped { rate, at_start, .. }| {
            let proportional = equation.force * equation.stiffness_damping;
            let viscosity = if equation.viscous { equation.force } else { 0.0 };
            stiffness += if *at_start { proportional } else { 0.0 };
            let own = if *at_start { 0.0 } else { proportional };
            let needed = viscosity != 0.0 || own != 0.0;
            needed.then_some(Damping { u: equation.u, v: rate, viscosity, stiffness: own })
        });
        Operator { masses, mass, stiffness, damping }
    }

    /// D = diag A at the prepared state.
    fn diagonal<F: ForceField<B>>(&mut self, system: &mut System<B, F>, equation: &Equation<B>) {
        let (backend, field) = (&system.backend, &mut system.field);
        let operator = Self::operator(&system.masses, equation, &self.damped);
        let (stiffness, diagonal) = (operator.stiffness, &mut self.diagonal);
        if self.damped.is_none() {
            operator.diagonal(backend, field, diagonal);
        } else {
            backend.clear(diagonal);
            operator.damping_diagonal(backend, field, diagonal);
            if let Some(masses) = system.masses.diagonal() {
                backend.axpy(equation.mass, masses, diagonal);
            }
            if let Some(Damped { elastic, .. }) = &mut self.damped {
                backend.clear(elastic);
                field.add_diagonal(backend, stiffness, elastic);
                backend.axpy(1.0, elastic, diagonal);
            }
        }
        backend.make_positive(diagonal);
        backend.even_out(diagonal);
    }

    /// Solves A x = residual at the prepared state.
    fn linear<F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        equation: &Equation<B>,
        settings: &SolverSettings,
        tolerance: f64,
        x: &mut B::Vector,
    ) -> Result<CgReport, SolveError> {
        let operator = Self::operator(&system.masses, equation, &self.damped);
        let preconditioner = match settings.preconditioner {
            Preconditioner::Jacobi => &self.diagonal,
            Preconditioner::None => self.ones.get_or_insert_with(|| ones(system)),
        };
        let (backend, field) = (&system.backend, &mut system.field);
        let b = &self.residual;
        let limits = CgLimits { tolerance, ..settings.cg };
        let report = self.cg.solve(backend, field, &operator, preconditioner, b, x, limits);
        match report.outcome {
            CgOutcome::Converged | CgOutcome::Stagnated | CgOutcome::NegativeCurvature => Ok(report),
            CgOutcome::IterationCap => Err(SolveError::NotConverged {
                solver: "linear",
                iterations: report.iterations,
                residual: report.residual,
                tolerance,
                remedy: "raise solver.cg.max_iterations, loosen solver.cg.tolerance, or check that the supports prevent \
                         rigid motion",
            }),
        }
    }

    /// The norm of residual - A x for x as given: imposed components only.
    fn imbalance<F: ForceField<B>>(&mut self, system: &mut System<B, F>, equation: &Equation<B>, x: &B::Vector) -> f64 {
        let of_residual = self.norm(&system.backend);
        let Self { damped, judge, residual, diagonal, .. } = self;
        let Judge { scratch, product } = judge.as_mut().expect("norms need it");
        let operator = Self::operator(&system.masses, equation, damped);
        operator.apply(&system.backend, &mut system.field, x, product);
        system.backend.xpby(residual, -1.0, product);
        system.backend.divide(product, diagonal, scratch);
        of_residual.max(system.backend.dot(product, scratch).max(0.0).sqrt())
    }

    /// sqrt (r . D^-1 r) of the residual.
    fn norm(&mut self, backend: &B) -> f64 {
        let Self { judge, residual, diagonal, .. } = self;
        let Judge { scratch, .. } = judge.get_or_insert_with(|| Judge::new(backend));
        backend.divide(residual, diagonal, scratch);
        backend.dot(residual, scratch).max(0.0).sqrt()
    }

    /// What rounding alone leaves of the residual: of the forces K (u + offset).
    fn rounding<F: ForceField<B>>(
        &mut self,
        system: &System<B, F>,
        equation: &Equation<B>,
        u: &B::Vector,
        offset: Option<f64>,
    ) -> f64 {
        let backend = &system.backend;
        let Self { ones, judge, diagonal, damped, .. } = self;
        let Judge { scratch, product } = judge.get_or_insert_with(|| Judge::new(backend));
        let damped = &*damped;
        let Operator { masses, mass, stiffness, .. } = Self::operator(&system.masses, equation, damped);
        let mut of = |x: &B::Vector| {
            // diag(K) x = (D - m diag(M)) x / k.
            backend.clear(product);
            match damped {
                Some(Damped { elastic, .. }) => backend.multiply_add(1.0 / stiffness, elastic, x, product),
                None => {
                    backend.multiply_add(1.0 / stiffness, diagonal, x, product);
                    if let Some(masses) = masses.diagonal() {
                        backend.multiply_add(-mass / stiffness, masses, x, product);
                    }
                }
            }
            backend.project(product);
            backend.divide(product, diagonal, scratch);
            backend.dot(product, scratch).max(0.0).sqrt()
        };
        let of_offset = offset.map_or(0.0, |offset| offset * of(ones.get_or_insert_with(|| self::ones(system))));
        4.0 * backend.epsilon() * equation.force * (of(u) + of_offset)
    }
}

/// Ones at all nodes.
fn ones<B: Backend, F: ForceField<B>>(system: &System<B, F>) -> B::Vector {
    system.backend.upload(&vec![[1.0; 3]; system.body.masses.len()])
}

fn account(report: &mut StepReport, linear: CgReport) {
    report.products += u64::from(linear.iterations) + 1;
    report.stagnated += u64::from(linear.outcome == CgOutcome::Stagnated);
    report.negative_curvature += u64::from(linear.outcome == CgOutcome::NegativeCurvature);
}

fn not_converged(iterations: u32, residual: f64, tolerance: f64) -> SolveError {
    SolveError::NotConverged {
        solver: "nonlinear",
        iterations,
        residual,
        tolerance,
        remedy: "take a smaller step, raise solver.newton.max_iterations or loosen solver.newton.tolerance",
    }
}

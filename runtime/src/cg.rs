//! Preconditioned conjugate gradient on A = m M + k K, matrix-free, with imposed components projected out.
//!
//! Faure et al. 2012, Algorithm 3, with its break test put right (stop when rho < eps^2 rho_0), a preconditioner, an
//! iteration cap, and exits for negative curvature and stagnation. Norms are those of the preconditioner,
//! rho = r . D^-1 r: a plain 2-norm judges badly where stiffnesses differ (Jacobi's D = diag A).

use crate::backend::{ALPHA, BETA, Backend, Descent, ForceField, Operator, REGISTERS, RUNNING, SUM, Scalar, Update};

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgLimits {
    /// The residual's norm must fall by this factor.
    pub tolerance: f64,
    /// Iterations, at most.
    pub max_iterations: u32,
}

/// How a solution ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CgOutcome {
    /// The residual fell by the tolerance.
    Converged,
    /// A direction of negative curvature was met: A is not positive definite. x is the best point before it.
    NegativeCurvature,
    /// x no longer changes: the precision is exhausted.
    Stagnated,
    /// The cap was reached.
    IterationCap,
}

/// What a solution cost and reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgReport {
    /// How it ended.
    pub outcome: CgOutcome,
    /// Iterations taken, one product with A each.
    pub iterations: u32,
    /// Norm of the (recursive) residual over that of the right-hand side.
    pub residual: f64,
}

/// Iterations in a row that change x by less than rounding does, after which a solution has stagnated.
///
/// The residual is no judge of that: conjugate gradients lower the error in the norm of A, and on a slender beam the
/// residual stays level, or rises, for hundreds of iterations while they do.
const PATIENCE: u32 = 50;

/// rho = r . D^-1 r.
const RHO: usize = 4;
/// Of b alone; from [`Start`] on the larger of it and the first rho.
const REFERENCE: usize = 5;
/// rho at which the solution is good enough; the squared tolerance before [`Start`].
const TARGET: usize = 6;
/// What all iterations took off the squared error in the norm of A.
const GAINED: usize = 7;
/// Iterations in a row that took off next to nothing.
const SINCE: usize = 8;
/// The part of [`GAINED`] that is next to nothing.
const NEGLIGIBLE: usize = 9;
/// Iterations taken.
const ITERATIONS: usize = 10;
/// One of the codes below.
const OUTCOME: usize = 11;
/// The smallest number that registers tell from 0.
const SMALLEST: usize = 12;

const CONVERGED: f64 = 1.0;
const NEGATIVE_CURVATURE: f64 = 2.0;
const STAGNATED: f64 = 3.0;

/// The value in a register's place where the solver runs.
fn running<S: Scalar>(s: &[S; REGISTERS], k: usize, value: S) -> S {
    S::select_greater(s[RUNNING], S::number(0.0), value, s[k])
}

/// Stops the solver with an outcome where it runs and left > right.
fn stop_if_greater<S: Scalar>(s: &mut [S; REGISTERS], left: S, right: S, outcome: f64) {
    let code = S::select_greater(left, right, S::number(outcome), s[OUTCOME]);
    s[OUTCOME] = running(s, OUTCOME, code);
    s[RUNNING] = S::select_greater(left, right, S::number(0.0), s[RUNNING]);
}

/// From the residuals of x as given and of x = 0: the norm to reach.
struct Start;

impl Update for Start {
    const SUMS: bool = false;
    fn apply<S: Scalar>(s: &mut [S; REGISTERS]) {
        s[REFERENCE] = S::select_greater(s[RHO], s[REFERENCE], s[RHO], s[REFERENCE]);
        s[TARGET] = s[TARGET] * s[REFERENCE];
        let (target, rho) = (s[TARGET], s[RHO]);
        stop_if_greater(s, target, rho, CONVERGED);
        let (smallest, reference) = (s[SMALLEST], s[REFERENCE]);
        stop_if_greater(s, smallest, reference, CONVERGED);
    }
}

/// From d . A d: how far to go along d.
struct Advance;

impl Update for Advance {
    const SUMS: bool = true;
    fn apply<S: Scalar>(s: &mut [S; REGISTERS]) {
        let (zero, one) = (S::number(0.0), S::number(1.0));
        s[ITERATIONS] = running(s, ITERATIONS, s[ITERATIONS] + one);
        let positive = S::select_greater(s[SUM], zero, one, zero);
        stop_if_greater(s, one, positive, NEGATIVE_CURVATURE);
        let curvature = S::select_greater(s[SUM], zero, s[SUM], one);
        s[ALPHA] = s[RHO] / curvature;
    }
}

/// From the new r . D^-1 r: whether to go on, and how far to turn.
struct Judge;

impl Update for Judge {
    const SUMS: bool = true;
    fn apply<S: Scalar>(s: &mut [S; REGISTERS]) {
        // What an iteration takes off the squared error in the norm of A.
        let gain = s[ALPHA] * s[RHO];
        s[GAINED] = running(s, GAINED, s[GAINED] + gain);
        let since = s[SINCE] + S::number(1.0);
        let since = S::select_greater(gain, s[NEGLIGIBLE] * s[GAINED], S::number(0.0), since);
        s[SINCE] = running(s, SINCE, since);
        s[BETA] = s[SUM] / s[RHO];
        s[RHO] = running(s, RHO, s[SUM]);
        let (target, rho) = (s[TARGET], s[RHO]);
        stop_if_greater(s, target, rho, CONVERGED);
        stop_if_greater(s, since, S::number(f64::from(PATIENCE)), STAGNATED);
    }
}

/// Work vectors, kept between solutions.
pub struct ConjugateGradient<B: Backend> {
    r: B::Vector,
    z: B::Vector,
    d: B::Vector,
    q: B::Vector,
    registers: B::Registers,
    /// Iterations that the next solution may need: a little more than the last one took.
    expected: u32,
}

impl<B: Backend> ConjugateGradient<B> {
    /// Work vectors for a body.
    pub fn new(backend: &B) -> Self {
        let [r, z, d, q] = std::array::from_fn(|_| backend.zeros());
        Self { r, z, d, q, registers: backend.registers([0.0; REGISTERS]), expected: u32::MAX }
    }

    /// Solves A x = b for the free components of x; its constrained components are given and kept.
    ///
    /// `preconditioner` is D of the norm rho = r . D^-1 r; all its components are positive. The residual is compared to
    /// the larger of those of x as given and of x = 0 in the free components. Everything from the first product to the
    /// break tests happens where the vectors live; the host reads the registers once for
    /// [`Backend::iterations_between_readings`] iterations, and those after the last do nothing.
    pub fn solve(
        &mut self,
        backend: &B,
        field: &mut impl ForceField<B>,
        operator: &Operator<B>,
        preconditioner: &B::Vector,
        b: &B::Vector,
        x: &mut B::Vector,
        limits: CgLimits,
    ) -> CgReport {
        let Self { r, z, d, q, registers, expected } = self;
        let mut first = [0.0; REGISTERS];
        first[RUNNING] = 1.0;
        first[TARGET] = limits.tolerance * limits.tolerance;
        first[NEGLIGIBLE] = backend.epsilon() * backend.epsilon();
        first[SMALLEST] = backend.smallest();
        backend.load(first, registers);
        backend.copy(b, r);
        backend.project(r);
        backend.divide(r, preconditioner, z);
        backend.dot_to(r, z, registers, REFERENCE);
        field.product(backend, operator, x, q, registers);
        backend.axpy(-1.0, q, r);
        backend.divide(r, preconditioner, z);
        backend.dot_to(r, z, registers, RHO);
        backend.update::<Start>(registers);
        backend.copy(z, d);
        let mut left = limits.max_iterations;
        loop {
            // Steps that take few iterations each shall not submit many that do nothing.
            let now = left.min(backend.iterations_between_readings()).min(*expected);
            for _ in 0..now {
                field.product(backend, operator, d, q, registers);
                backend.update::<Advance>(registers);
                backend.descend(Descent { d, q, preconditioner, x, r, z }, registers);
                backend.update::<Judge>(registers);
                backend.turn(z, d, registers);
            }
            left -= now;
            let s = backend.read(registers);
            // A device that has failed reads NaN, and there is nothing to go on with.
            let runs = s[RUNNING] > 0.0;
            if left == 0 || !runs {
                let report = report(&s);
                *expected = report.iterations.saturating_add(1);
                return report;
            }
            *expected = u32::MAX;
        }
    }
}

fn report(s: &[f64; REGISTERS]) -> CgReport {
    let outcome = match s[OUTCOME] {
        CONVERGED => CgOutcome::Converged,
        NEGATIVE_CURVATURE => CgOutcome::NegativeCurvature,
        STAGNATED => CgOutcome::Stagnated,
        _ => CgOutcome::IterationCap,
    };
    let residual = if s[REFERENCE] > 0.0 { (s[RHO] / s[REFERENCE]).sqrt() } else { 0.0 };
    CgReport { outcome, iterations: s[ITERATIONS] as u32, residual }
}

/// The updates as modules for a GPU, with their names.
#[cfg(feature = "gpu")]
pub(crate) fn updates() -> Vec<(String, String)> {
    use crate::gpu::update_module;
    vec![update_module::<Start>(), update_module::<Advance>(), update_module::<Judge>()]
}

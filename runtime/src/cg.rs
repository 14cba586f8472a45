//! Preconditioned conjugate gradient on A = m M + k K, matrix-free, with imposed components projected out.
//!
//! Faure et al. 2012, Algorithm 3, with its break test put right (stop when rho < eps^2 rho_0), a preconditioner, an
//! iteration cap, and exits for negative curvature and stagnation. Norms are those of the preconditioner,
//! rho = r . D^-1 r: a plain 2-norm judges badly where stiffnesses differ (Jacobi's D = diag A).

use crate::backend::{Backend, ForceField};

/// A = mass M + stiffness K at the state to which the field is prepared; M is diagonal.
pub struct Operator<'a, B: Backend> {
    /// Lumped masses, one entry a component.
    pub masses: &'a B::Vector,
    /// Factor m of M.
    pub mass: f64,
    /// Factor k of K.
    pub stiffness: f64,
}

impl<B: Backend> Operator<'_, B> {
    /// y = A x, constrained components set to 0.
    pub fn apply(&self, backend: &B, field: &mut impl ForceField<B>, x: &B::Vector, y: &mut B::Vector) {
        backend.clear(y);
        // add_dforce adds -K x.
        field.add_dforce(backend, x, -self.stiffness, y);
        if self.mass != 0.0 {
            backend.multiply_add(self.mass, self.masses, x, y);
        }
        backend.project(y);
    }

    /// d = diag A.
    pub fn diagonal(&self, backend: &B, field: &mut impl ForceField<B>, d: &mut B::Vector) {
        backend.clear(d);
        field.add_diagonal(backend, self.stiffness, d);
        backend.axpy(self.mass, self.masses, d);
    }
}

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

/// Work vectors, kept between solutions.
pub struct ConjugateGradient<B: Backend> {
    r: B::Vector,
    z: B::Vector,
    d: B::Vector,
    q: B::Vector,
}

impl<B: Backend> ConjugateGradient<B> {
    /// Work vectors for a body.
    pub fn new(backend: &B) -> Self {
        Self { r: backend.zeros(), z: backend.zeros(), d: backend.zeros(), q: backend.zeros() }
    }

    /// Solves A x = b for the free components of x; its constrained components are given and kept.
    ///
    /// `preconditioner` is D of the norm rho = r . D^-1 r; all its components are positive. The residual is compared to
    /// the larger of those of x as given and of x = 0 in the free components.
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
        let Self { r, z, d, q } = self;
        backend.copy(b, r);
        backend.project(r);
        backend.divide(r, preconditioner, z);
        let of_b = backend.dot(r, z);
        operator.apply(backend, field, x, q);
        backend.axpy(-1.0, q, r);
        backend.divide(r, preconditioner, z);
        let mut rho = backend.dot(r, z);
        let reference = rho.max(of_b);
        let target = limits.tolerance * limits.tolerance * reference;
        let report = |outcome, iterations, rho: f64| CgReport {
            outcome,
            iterations,
            residual: if reference > 0.0 { (rho / reference).sqrt() } else { 0.0 },
        };
        if rho <= target || reference == 0.0 {
            return report(CgOutcome::Converged, 0, rho);
        }
        backend.copy(z, d);
        // alpha rho is what an iteration takes off the squared error in the norm of A.
        let (mut gained, mut since) = (0.0, 0);
        let negligible = backend.epsilon() * backend.epsilon();
        for iteration in 1..=limits.max_iterations {
            operator.apply(backend, field, d, q);
            let curvature = backend.dot(d, q);
            if curvature <= 0.0 || curvature.is_nan() {
                return report(CgOutcome::NegativeCurvature, iteration, rho);
            }
            let alpha = rho / curvature;
            backend.axpy(alpha, d, x);
            backend.axpy(-alpha, q, r);
            backend.divide(r, preconditioner, z);
            let next = backend.dot(r, z);
            if next <= target {
                return report(CgOutcome::Converged, iteration, next);
            }
            gained += alpha * rho;
            since = if alpha * rho > negligible * gained { 0 } else { since + 1 };
            if since > PATIENCE {
                return report(CgOutcome::Stagnated, iteration, next);
            }
            let beta = next / rho;
            rho = next;
            backend.xpby(z, beta, d);
        }
        report(CgOutcome::IterationCap, limits.max_iterations, rho)
    }
}

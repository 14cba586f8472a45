//! An implicit step, solved to a tolerance: iterations and time with and without a preconditioner, and time of its parts.
//!
//! The step is one linearised step of implicit Euler. Solutions are compared by one norm, that of the residual b - A x
//! itself: each preconditioner stops its own norm elsewhere. The fewest iterations that reach the tolerance are searched,
//! and a solution with so many is timed.

use std::time::Instant;

use super::body::displacements;
use super::{MeasureError, Subject, median};
use crate::backend::{Backend, ForceField, Operator, REGISTERS, RUNNING};
use crate::cg::{CgLimits, ConjugateGradient};
use crate::model::Model;
use crate::system::System;

/// What the residual is to fall to, of the right-hand side.
pub const TOLERANCE: f64 = 1e-5;
/// The step in s.
pub const STEP: f64 = 0.01;
/// Iterations after which the search for fewer is given up.
const MOST: u32 = 1 << 15;

/// A solution that was timed.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The preconditioner's name in scenes.
    pub preconditioner: &'static str,
    /// Iterations.
    pub iterations: u32,
    /// |b - A x| / |b|: above [`TOLERANCE`] where the precision or the patience does not allow for less.
    pub residual: f64,
    /// Seconds of each repetition, ascending.
    pub seconds: Vec<f64>,
}

/// What was measured of an implicit step.
#[derive(Debug, Clone, PartialEq)]
pub struct Implicit {
    /// Solutions with each preconditioner.
    pub solutions: Vec<Solution>,
    /// Median seconds of the parts of a step with the first of them; the last is what the solution takes besides products.
    pub parts: Vec<(&'static str, f64)>,
}

impl Solution {
    /// The median time in seconds.
    pub fn median(&self) -> f64 {
        median(&self.seconds)
    }
}

/// The median of times in any order.
fn median_of(mut seconds: Vec<f64>) -> f64 {
    seconds.sort_by(f64::total_cmp);
    median(&seconds)
}

/// Solves one system as often as asked.
struct Solver<'a, B: Backend, F: ForceField<B>> {
    backend: &'a B,
    field: &'a mut F,
    operator: Operator<'a, B>,
    cg: ConjugateGradient<B>,
    b: B::Vector,
    x: B::Vector,
    q: B::Vector,
}

impl<B: Backend, F: ForceField<B>> Solver<'_, B, F> {
    /// Takes so many iterations, or fewer where the precision is exhausted before; how many it took.
    fn solve(&mut self, preconditioner: &B::Vector, iterations: u32) -> Result<u32, MeasureError> {
        let Self { backend, field, operator, cg, b, x, .. } = self;
        backend.clear(x);
        let limits = CgLimits { tolerance: f64::MIN_POSITIVE.sqrt(), max_iterations: iterations };
        let report = cg.solve(*backend, *field, operator, preconditioner, b, x, limits);
        backend.wait()?;
        Ok(report.iterations)
    }

    fn residual(&mut self) -> f64 {
        let Self { backend, field, operator, b, x, q, .. } = self;
        operator.apply(backend, *field, x, q);
        backend.xpby(b, -1.0, q);
        (backend.dot(q, q) / backend.dot(b, b)).sqrt()
    }

    /// The fewest iterations that reach the tolerance, to a sixty-fourth: all that can be taken if none do.
    fn fewest(&mut self, preconditioner: &B::Vector) -> Result<(u32, f64), MeasureError> {
        let mut reached = |iterations: u32| -> Result<(u32, f64), MeasureError> {
            let taken = self.solve(preconditioner, iterations)?;
            Ok((taken, self.residual()))
        };
        let (mut few, mut asked) = (0, 1);
        let (mut enough, mut residual) = reached(asked)?;
        while residual > TOLERANCE && enough == asked && asked < MOST {
            (few, asked) = (asked, 2 * asked);
            (enough, residual) = reached(asked)?;
        }
        while residual <= TOLERANCE && enough > few + (enough / 64).max(1) {
            let middle = few + (enough - few) / 2;
            match reached(middle)? {
                (taken, here) if here <= TOLERANCE => (enough, residual) = (taken, here),
                _ => few = middle,
            }
        }
        Ok((enough, residual))
    }
}

/// Measures a step of a subject.
pub(super) fn implicit<B: Backend, F: ForceField<B>>(
    subject: &Subject,
    model: Model,
    backend: B,
    field: F,
) -> Result<Implicit, MeasureError> {
    let [u, _] = displacements(subject, &model);
    let h = STEP / model.scale.time;
    let repeats = subject.repeats.max(1);
    let System { backend, mut field, masses, body, .. } = System::new(backend, field, model.body);
    let u = backend.upload(&u);
    let [mut b, mut diagonal] = [backend.zeros(), backend.zeros()];
    let mut parts: [Vec<f64>; 3] = Default::default();
    let operator = || Operator { masses: &masses, mass: 1.0, stiffness: h * h, damping: None };
    for repeat in 0..=repeats {
        let mut start = Instant::now();
        let mut lap = |part: &mut Vec<f64>| -> Result<(), MeasureError> {
            backend.wait()?;
            if repeat > 0 {
                part.push(start.elapsed().as_secs_f64());
            }
            start = Instant::now();
            Ok(())
        };
        backend.clear(&mut b);
        field.add_force(&backend, &u, &mut b)?;
        backend.scale(h, &mut b);
        lap(&mut parts[0])?;
        field.prepare(&backend, &u);
        lap(&mut parts[1])?;
        operator().diagonal(&backend, &mut field, &mut diagonal);
        backend.make_positive(&mut diagonal);
        lap(&mut parts[2])?;
    }
    let ones = backend.upload(&vec![[1.0; 3]; body.masses.len()]);
    let cg = ConjugateGradient::new(&backend);
    let [x, q] = [backend.zeros(), backend.zeros()];
    let mut solver = Solver { backend: &backend, field: &mut field, operator: operator(), cg, b, x, q };
    let preconditioners = [("jacobi", &diagonal), ("none", &ones)];
    let mut solutions = vec![];
    for (preconditioner, vector) in preconditioners {
        let (iterations, residual) = solver.fewest(vector)?;
        solutions.push(Solution { preconditioner, iterations, residual, seconds: vec![] });
    }
    // In turn, so that a drift of the machine does not become a result.
    for _ in 0..repeats {
        for (solution, (_, vector)) in solutions.iter_mut().zip(preconditioners) {
            let start = Instant::now();
            solver.solve(vector, solution.iterations)?;
            solution.seconds.push(start.elapsed().as_secs_f64());
        }
    }
    solutions.iter_mut().for_each(|s| s.seconds.sort_by(f64::total_cmp));
    let mut products = vec![];
    let mut running = [0.0; REGISTERS];
    running[RUNNING] = 1.0;
    let mut registers = backend.registers(running);
    let Solver { field, operator, b, mut q, .. } = solver;
    for _ in 0..repeats {
        let start = Instant::now();
        for _ in 0..solutions[0].iterations {
            field.product(&backend, &operator, &b, &mut q, &mut registers);
        }
        backend.wait()?;
        products.push(start.elapsed().as_secs_f64());
    }
    let solution = solutions[0].median();
    let products = median_of(products).min(solution);
    let [forces, linearization, preconditioner] = parts.map(median_of);
    let parts = vec![
        ("forces", forces),
        ("linearization", linearization),
        ("diagonal", preconditioner),
        ("products", products),
        ("vectors", solution - products),
    ];
    Ok(Implicit { solutions, parts })
}

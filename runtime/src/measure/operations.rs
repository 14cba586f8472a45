//! Times of kernels, of explicit steps and of the linear solver.

use std::time::Instant;

use super::body::displacements;
use super::count::{Count, Layout};
use super::{ITERATIONS, MeasureError, Measured, Subject, Timing};
use crate::backend::{Backend, ForceField, Operator};
use crate::body::Body;
use crate::cg::{CgLimits, ConjugateGradient};
use crate::integrate::SemiImplicitEuler;
use crate::model::Model;
use crate::system::{Integrator, System};

/// Times an operation, after one that is not counted; it waits until it is done, and says what its time is to be multiplied
/// by.
fn time(
    operation: &'static str,
    repeats: usize,
    mut run: impl FnMut() -> Result<f64, MeasureError>,
) -> Result<Timing, MeasureError> {
    let mut seconds = Vec::with_capacity(repeats);
    for repeat in 0..=repeats {
        let start = Instant::now();
        let factor = run()?;
        if repeat > 0 {
            seconds.push(factor * start.elapsed().as_secs_f64());
        }
    }
    seconds.sort_by(f64::total_cmp);
    Ok(Timing { operation, seconds, times: 1, flops: None, bytes: None })
}

/// All operations of a subject.
pub(super) fn all<B: Backend, F: ForceField<B>>(
    subject: &Subject,
    model: Model,
    backend: B,
    mut field: F,
    layout: Layout,
) -> Result<Measured, MeasureError> {
    let Body { elements, .. } = &model.body;
    let (nodes, elements) = (model.mesh.nodes().len(), elements.len());
    let count = Count { subject, layout, nodes: nodes as f64 / elements as f64 };
    let [u, du] = displacements(subject, &model).map(|u| backend.upload(&u));
    let mut f = backend.zeros();
    let repeats = subject.repeats.max(1);
    let linear = subject.law.info.structure.linear;
    let (vectors, per_node) = (if linear { 1 } else { 2 }, subject.element.info.nodes as u32);

    let done = |backend: &B| Ok(backend.wait().map(|()| 1.0)?);
    let energy = time("energy", repeats, || {
        field.element_energies(&backend, &u)?;
        done(&backend)
    })?;
    let force = time("force", repeats, || {
        field.add_force(&backend, &u, &mut f)?;
        done(&backend)
    })?;
    let dforce = time("dforce", repeats, || {
        field.add_dforce_at(&backend, &u, &du, 1.0, &mut f);
        done(&backend)
    })?;
    let linearize = time("linearize", repeats, || {
        field.prepare(&backend, &u);
        done(&backend)
    })?;
    let apply = time("apply", repeats, || {
        field.add_dforce(&backend, &du, 1.0, &mut f);
        done(&backend)
    })?;
    let diagonal = time("diagonal", repeats, || {
        field.add_diagonal(&backend, 1.0, &mut f);
        done(&backend)
    })?;
    let stored = subject.law.info.stored;
    let counted = |timing, flops, bytes| Timing { flops: Some(flops), bytes: Some(bytes), ..timing };
    let (apply_flops, apply_bytes) = count.product(vectors, stored);
    let (linearize_flops, linearize_bytes) = count.linearize(stored);
    let mut timings = vec![
        counted(energy, count.flops(1, "energy", 1, false), count.read(1, 0) + count.layout.real),
        counted(force, count.flops(1, "force", 1, true), count.two_passes(1, 0)),
        counted(dforce, count.flops(vectors, "dforce", 1, true), count.two_passes(vectors, 0)),
        Timing { flops: linearize_flops, bytes: linearize_bytes, ..linearize },
        counted(apply, apply_flops, apply_bytes),
        counted(diagonal, count.flops(vectors - 1, "diagonal", per_node, false), count.two_passes(vectors - 1, 0)),
    ];
    let mut system = System::new(backend, field, model.body);
    timings.push(explicit(&mut system, repeats)?);
    timings.push(solver(&mut system, &u, repeats)?);
    Ok(Measured { nodes, elements, timings })
}

/// Explicit steps, too short to go anywhere.
fn explicit<B: Backend, F: ForceField<B>>(system: &mut System<B, F>, repeats: usize) -> Result<Timing, MeasureError> {
    let mut state = system.initial_state([0.0; 3]);
    let mut integrator = SemiImplicitEuler::new(&system.backend);
    time("explicit step", repeats, || {
        integrator.step(system, &mut state, 1e-9)?;
        Ok(system.backend.wait().map(|()| 1.0)?)
    })
}

/// Iterations of the solver of an implicit step; those of a solution that stops before are scaled up.
fn solver<B: Backend, F: ForceField<B>>(
    system: &mut System<B, F>,
    b: &B::Vector,
    repeats: usize,
) -> Result<Timing, MeasureError> {
    let System { backend, field, masses, body, .. } = system;
    let rest = backend.zeros();
    field.prepare(backend, &rest);
    let ones = backend.upload(&vec![[1.0; 3]; body.masses.len()]);
    let operator = Operator { masses, mass: 1.0, stiffness: 1.0, damping: None };
    let mut cg = ConjugateGradient::new(backend);
    let limits = CgLimits { tolerance: f64::MIN_POSITIVE.sqrt(), max_iterations: ITERATIONS };
    let iterations = time("50 iterations of CG", repeats, || {
        let mut x = backend.zeros();
        let report = cg.solve(backend, field, &operator, &ones, b, &mut x, limits);
        backend.wait()?;
        Ok(f64::from(ITERATIONS) / f64::from(report.iterations.max(1)))
    })?;
    Ok(Timing { times: ITERATIONS, ..iterations })
}

//! The elements of a body on the CPU: one batch a law, two passes (Faure et al. 2012, Algorithm 1).
//!
//! Pass 1 runs over elements and writes each node's partial force into a slot of its own; pass 2 runs over nodes and
//! sums their slots in ascending order. No two threads write one place, and the sum does not depend on the thread
//! count.

use rayon::prelude::*;
use tensormass_kernels::batch::{Batch, RestElement};
use tensormass_kernels::{BatchKernels, DampingKernels};

use super::{CpuBackend, Precision};
use crate::backend::{Backend, ForceField, LeftDomain, Operator, REGISTERS, RUNNING, SUM};
use crate::body::{Body, LawBatch};
use crate::mesh::{Incidence, NodeId};

/// Elements a task.
const CHUNK: usize = 512;

/// Partial forces of one element: three components for each of its nodes.
type Slots<R> = [[R; 3]; 4];

/// The elements of one law.
struct CpuBatch<R: Precision> {
    law: &'static str,
    domain: &'static str,
    kernels: BatchKernels<R>,
    /// Only where the law has a dissipation.
    damping: Option<DampingKernels<R>>,
    nodes: Vec<[u32; 4]>,
    rest: Vec<RestElement<R>>,
    constants: Vec<R>,
    stride: usize,
    count: usize,
    /// The mesh's number of each element.
    elements: Vec<u32>,
}

impl<R: Precision> CpuBatch<R> {
    fn new(body: &Body, batch: &LawBatch) -> Self {
        let round = |x: f64| R::from_f64(x);
        let rest = |&e: &u32| {
            let r = &body.rest[e as usize];
            RestElement { shape_gradients: r.shape_gradients.map(round), volume: round(r.volume) }
        };
        Self {
            law: batch.law.info.name,
            domain: batch.law.info.domain.unwrap_or("everywhere"),
            kernels: R::kernels(batch.law),
            damping: R::damping_kernels(batch.law),
            nodes: batch.elements.iter().map(|&e| body.elements[e as usize]).collect(),
            rest: batch.elements.iter().map(rest).collect(),
            constants: batch.constants.iter().map(|&c| round(c)).collect(),
            stride: if batch.per_element { batch.law.info.constants.len() } else { 0 },
            count: batch.law.info.constants.len(),
            elements: batch.elements.clone(),
        }
    }

    fn view(&self) -> Batch<'_, R> {
        Batch {
            nodes: &self.nodes,
            rest: &self.rest,
            constants: &self.constants,
            stride: self.stride,
            count: self.count,
        }
    }

    /// Runs a kernel over chunks of the batch; the lowest element outside the law's domain is the error.
    fn run<T: Send>(
        &self,
        out: &mut [T],
        kernel: impl Fn(&Batch<R>, &mut [T]) -> Option<usize> + Sync,
    ) -> Result<(), LeftDomain> {
        let outside = out
            .par_chunks_mut(CHUNK)
            .enumerate()
            .filter_map(|(k, out)| {
                let start = k * CHUNK;
                let batch = self.view().range(start..start + out.len());
                kernel(&batch, out).map(|e| start + e)
            })
            .min();
        match outside {
            None => Ok(()),
            Some(e) => Err(LeftDomain {
                element: self.elements[e],
                law: self.law.to_string(),
                domain: self.domain.to_string(),
            }),
        }
    }
}

/// All elements of a body.
pub struct CpuField<R: Precision> {
    batches: Vec<CpuBatch<R>>,
    slots: Vec<Slots<R>>,
    /// Which slots belong to each node; elements count batch after batch.
    incidence: Incidence,
    /// The displacement at which the tangent is taken.
    state: Vec<[R; 3]>,
}

impl<R: Precision> CpuField<R> {
    /// The elements of a body, in batches.
    pub fn new(body: &Body) -> Self {
        let batches: Vec<CpuBatch<R>> = body.batches.iter().map(|b| CpuBatch::new(body, b)).collect();
        let elements = batches.iter().flat_map(|b| &b.nodes).map(|nodes| nodes.map(|n| n as usize));
        let incidence = Incidence::of_elements(body.masses.len(), elements);
        Self {
            slots: vec![[[R::default(); 3]; 4]; incidence.slots().len() / 4],
            batches,
            incidence,
            state: vec![[R::default(); 3]; body.masses.len()],
        }
    }

    /// Pass 1: every batch into its slots.
    fn elements(
        &mut self,
        kernel: impl Fn(&BatchKernels<R>, &Batch<R>, &mut [Slots<R>]) -> Option<usize> + Sync,
    ) -> Result<(), LeftDomain> {
        let mut rest = self.slots.as_mut_slice();
        let mut result = Ok(());
        for batch in &self.batches {
            let (slots, others) = rest.split_at_mut(batch.nodes.len());
            rest = others;
            let done = batch.run(slots, |view, out| kernel(&batch.kernels, view, out));
            result = result.and(done);
        }
        result
    }

    /// Pass 1 of damping: every batch into its slots, 0 where a law has none.
    fn damping(&mut self, kernel: impl Fn(&DampingKernels<R>, &Batch<R>, &mut [Slots<R>]) + Sync) {
        let mut rest = self.slots.as_mut_slice();
        for batch in &self.batches {
            let (slots, others) = rest.split_at_mut(batch.nodes.len());
            rest = others;
            let Some(kernels) = &batch.damping else {
                slots.fill([[R::default(); 3]; 4]);
                continue;
            };
            let done = batch.run(slots, |view, out| {
                kernel(kernels, view, out);
                None
            });
            debug_assert!(done.is_ok(), "damping reports no domain");
        }
    }

    /// Pass 2: y += factor times the sum of each node's slots.
    fn nodes(&self, factor: R, y: &mut [[R; 3]]) {
        let flat = self.slots.as_flattened();
        y.par_chunks_mut(CHUNK).enumerate().for_each(|(k, y)| {
            for (i, y) in y.iter_mut().enumerate() {
                let node = k * CHUNK + i;
                let mut sum = [R::default(); 3];
                for &slot in self.incidence.of(NodeId(node as u32)) {
                    let partial = flat[slot as usize];
                    for c in 0..3 {
                        sum[c] = sum[c] + partial[c];
                    }
                }
                for c in 0..3 {
                    y[c] = y[c] + factor * sum[c];
                }
            }
        });
    }
}

impl<R: Precision> ForceField<CpuBackend<R>> for CpuField<R> {
    fn element_energies(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>) -> Result<Vec<f64>, LeftDomain> {
        let mut energies = vec![0.0; self.slots.len()];
        for batch in &self.batches {
            let mut out = vec![R::default(); batch.nodes.len()];
            batch.run(&mut out, |view, out| (batch.kernels.energy)(view, u, out))?;
            for (&e, w) in batch.elements.iter().zip(out) {
                energies[e as usize] = w.to_f64();
            }
        }
        Ok(energies)
    }

    fn cauchy(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>) -> Vec<[f64; 9]> {
        let mut stresses = vec![[0.0; 9]; self.slots.len()];
        for batch in &self.batches {
            let mut out = vec![[R::default(); 9]; batch.nodes.len()];
            // The kernel cannot fail: outside the domain its values are not used.
            let _ = batch.run(&mut out, |view, out| {
                (batch.kernels.cauchy)(view, u, out);
                None
            });
            for (&e, s) in batch.elements.iter().zip(out) {
                stresses[e as usize] = s.map(R::to_f64);
            }
        }
        stresses
    }

    fn add_force(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>, f: &mut Vec<[R; 3]>) -> Result<(), LeftDomain> {
        self.elements(|kernels, batch, out| (kernels.force)(batch, u, out))?;
        self.nodes(R::from_f64(1.0), f);
        Ok(())
    }

    fn prepare(&mut self, backend: &CpuBackend<R>, u: &Vec<[R; 3]>) {
        backend.copy(u, &mut self.state);
    }

    fn add_dforce(&mut self, backend: &CpuBackend<R>, du: &Vec<[R; 3]>, factor: f64, df: &mut Vec<[R; 3]>) {
        let state = std::mem::take(&mut self.state);
        self.add_dforce_at(backend, &state, du, factor, df);
        self.state = state;
    }

    fn add_diagonal(&mut self, backend: &CpuBackend<R>, factor: f64, d: &mut Vec<[R; 3]>) {
        let state = std::mem::take(&mut self.state);
        self.add_diagonal_at(backend, &state, factor, d);
        self.state = state;
    }

    fn add_dforce_at(
        &mut self,
        _: &CpuBackend<R>,
        u: &Vec<[R; 3]>,
        du: &Vec<[R; 3]>,
        factor: f64,
        df: &mut Vec<[R; 3]>,
    ) {
        let done = self.elements(|kernels, batch, out| {
            (kernels.dforce)(batch, u, du, out);
            None
        });
        debug_assert!(done.is_ok(), "a differential reports no domain");
        self.nodes(R::from_f64(factor), df);
    }

    fn add_diagonal_at(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>, factor: f64, d: &mut Vec<[R; 3]>) {
        let done = self.elements(|kernels, batch, out| (kernels.diagonal)(batch, u, out));
        debug_assert!(done.is_ok(), "a diagonal reports no domain");
        self.nodes(R::from_f64(factor), d);
    }

    fn add_damping(&mut self, _: &CpuBackend<R>, [u, v]: [&Vec<[R; 3]>; 2], factor: f64, f: &mut Vec<[R; 3]>) {
        self.damping(|kernels, batch, out| (kernels.damping)(batch, u, v, out));
        self.nodes(R::from_f64(factor), f);
    }

    fn add_ddamping(
        &mut self,
        _: &CpuBackend<R>,
        [u, v]: [&Vec<[R; 3]>; 2],
        dv: &Vec<[R; 3]>,
        factor: f64,
        df: &mut Vec<[R; 3]>,
    ) {
        self.damping(|kernels, batch, out| (kernels.ddamping)(batch, u, v, dv, out));
        self.nodes(R::from_f64(factor), df);
    }

    fn add_damping_diagonal(&mut self, _: &CpuBackend<R>, [u, v]: [&Vec<[R; 3]>; 2], factor: f64, d: &mut Vec<[R; 3]>) {
        self.damping(|kernels, batch, out| (kernels.diagonal)(batch, u, v, out));
        self.nodes(R::from_f64(factor), d);
    }

    fn product(
        &mut self,
        backend: &CpuBackend<R>,
        operator: &Operator<CpuBackend<R>>,
        x: &Vec<[R; 3]>,
        y: &mut Vec<[R; 3]>,
        registers: &mut [f64; REGISTERS],
    ) {
        if registers[RUNNING] > 0.0 {
            operator.apply(backend, self, x, y);
            registers[SUM] = backend.dot(x, y);
        }
    }
}

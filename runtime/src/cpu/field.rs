//! The elements of a body on the CPU: one batch a law and kind, two passes (Faure et al. 2012, Algorithm 1).
//!
//! Pass 1 runs over elements and writes each node's partial force into a slot of its own; pass 2 runs over nodes and
//! sums their slots in ascending order. No two threads write one place, and the sum does not depend on the thread
//! count.

use rayon::prelude::*;
use tensormass_kernels::RestPoint;

use super::kernels::{Kernels, Part};
use super::vectors::{BLOCK, exact_dot};
use super::{CpuBackend, Precision};
use crate::backend::{Backend, ForceField, LeftDomain, Operator, REGISTERS, RUNNING, SUM};
use crate::body::{Body, LawBatch};
use crate::mesh::{Incidence, NodeId};

/// Elements a task.
const CHUNK: usize = 512;

/// The elements of one law and kind.
struct CpuBatch<R: Precision> {
    law: &'static str,
    domain: &'static str,
    kernels: Kernels<R>,
    nodes: Vec<u32>,
    rest: Vec<RestPoint<R>>,
    constants: Vec<R>,
    stride: usize,
    count: usize,
    /// The mesh's number of each element.
    elements: Vec<u32>,
}

impl<R: Precision> CpuBatch<R> {
    fn new(body: &Body, batch: &LawBatch) -> Self {
        let round = |x: f64| R::from_f64(x);
        let rest =
            |r: &RestPoint<f64>| RestPoint { inverse_jacobian: r.inverse_jacobian.map(round), weight: round(r.weight) };
        let elements = || batch.elements.iter().map(|&e| e as usize);
        Self {
            law: batch.law.info.name,
            domain: batch.law.info.domain.unwrap_or("everywhere"),
            kernels: Kernels::new(batch.element, batch.law),
            nodes: elements().flat_map(|e| &body.elements[e]).copied().collect(),
            rest: elements().flat_map(|e| &body.rest[e]).map(rest).collect(),
            constants: batch.constants.iter().map(|&c| round(c)).collect(),
            stride: if batch.per_element { batch.law.info.constants.len() } else { 0 },
            count: batch.law.info.constants.len(),
            elements: batch.elements.clone(),
        }
    }

    /// The elements in a range.
    fn part(&self, elements: std::ops::Range<usize>) -> Part<'_, R> {
        let (nodes, points) = (self.kernels.nodes(), self.kernels.points());
        Part {
            nodes: &self.nodes[elements.start * nodes..elements.end * nodes],
            rest: &self.rest[elements.start * points..elements.end * points],
            constants: &self.constants[elements.start * self.stride..],
            stride: self.stride,
            count: self.count,
        }
    }

    /// Runs a kernel over chunks of the batch, each with its part of `out` (`each` entries an element); the lowest element
    /// outside the law's domain is the error.
    fn run<T: Send>(
        &self,
        out: &mut [T],
        each: usize,
        kernel: impl Fn(&Part<R>, &mut [T]) -> Option<usize> + Sync,
    ) -> Result<(), LeftDomain> {
        let outside = out
            .par_chunks_mut(CHUNK * each)
            .enumerate()
            .filter_map(|(k, out)| {
                let start = k * CHUNK;
                kernel(&self.part(start..start + out.len() / each), out).map(|e| start + e)
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
    /// A partial force for each node of each element, batch after batch.
    slots: Vec<[R; 3]>,
    /// Which slots belong to each node.
    incidence: Incidence,
    /// How many elements there are.
    elements: usize,
    /// The displacement at which the tangent is taken.
    state: Vec<[R; 3]>,
}

impl<R: Precision> CpuField<R> {
    /// The elements of a body, in batches.
    pub fn new(body: &Body) -> Self {
        let batches: Vec<CpuBatch<R>> = body.batches.iter().map(|b| CpuBatch::new(body, b)).collect();
        let slots = batches.iter().flat_map(|b| &b.nodes).map(|n| *n as usize);
        let incidence = Incidence::of_slots(body.masses.len(), slots);
        Self {
            slots: vec![[R::default(); 3]; incidence.slots().len()],
            elements: body.elements.len(),
            batches,
            incidence,
            state: vec![[R::default(); 3]; body.masses.len()],
        }
    }

    /// Pass 1: every batch into its slots.
    fn elements(
        &mut self,
        kernel: impl Fn(&Kernels<R>, &Part<R>, &mut [[R; 3]]) -> Option<usize> + Sync,
    ) -> Result<(), LeftDomain> {
        let mut rest = self.slots.as_mut_slice();
        let mut result = Ok(());
        for batch in &self.batches {
            let (slots, others) = rest.split_at_mut(batch.nodes.len());
            rest = others;
            let done = batch.run(slots, batch.kernels.nodes(), |part, out| kernel(&batch.kernels, part, out));
            result = result.and(done);
        }
        result
    }

    /// Pass 1 of what reports no domain.
    fn everywhere(&mut self, kernel: impl Fn(&Kernels<R>, &Part<R>, &mut [[R; 3]]) + Sync) {
        let done = self.elements(|kernels, part, out| {
            kernel(kernels, part, out);
            None
        });
        debug_assert!(done.is_ok(), "differentials and damping report no domain");
    }

    /// The sum of a node's slots.
    fn sum_of_slots(&self, node: usize) -> [R; 3] {
        let mut sum = [R::default(); 3];
        for &slot in self.incidence.of(NodeId(node as u32)) {
            let partial = self.slots[slot as usize];
            for c in 0..3 {
                sum[c] = sum[c] + partial[c];
            }
        }
        sum
    }

    /// Pass 2: y += factor times the sum of each node's slots.
    fn nodes(&self, factor: R, y: &mut [[R; 3]]) {
        y.par_chunks_mut(CHUNK).enumerate().for_each(|(k, y)| {
            for (i, y) in y.iter_mut().enumerate() {
                let sum = self.sum_of_slots(k * CHUNK + i);
                for c in 0..3 {
                    y[c] = y[c] + factor * sum[c];
                }
            }
        });
    }

    /// Pass 2 of a product: y = factor times the sum of each node's slots + mass M x, imposed components 0; x . y. One pass
    /// over the vectors, with the arithmetic of [`Operator::apply`] and [`Backend::dot`].
    fn product_at_nodes(
        &self,
        backend: &CpuBackend<R>,
        [factor, mass]: [R; 2],
        masses: &[[R; 3]],
        x: &[[R; 3]],
        y: &mut [[R; 3]],
    ) -> f64 {
        let blocks: Vec<f64> = y
            .par_chunks_mut(BLOCK)
            .enumerate()
            .map(|(block, y)| {
                let first = block * BLOCK;
                let (x, masses) = (&x[first..][..y.len()], &masses[first..][..y.len()]);
                for (i, y) in y.iter_mut().enumerate() {
                    let sum = self.sum_of_slots(first + i);
                    *y = std::array::from_fn(|c| factor * sum[c] + mass * (masses[i][c] * x[i][c]));
                }
                backend.imposed(block).for_each(|(i, c)| y[i][c] = R::default());
                x.iter().zip(y.iter()).map(|(x, y)| exact_dot(x, y)).sum::<f64>()
            })
            .collect();
        blocks.iter().sum()
    }
}

impl<R: Precision> ForceField<CpuBackend<R>> for CpuField<R> {
    fn element_energies(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>) -> Result<Vec<f64>, LeftDomain> {
        let mut energies = vec![0.0; self.elements];
        for batch in &self.batches {
            let mut out = vec![R::default(); batch.elements.len()];
            batch.run(&mut out, 1, |part, out| batch.kernels.energy(part, u, out))?;
            for (&e, w) in batch.elements.iter().zip(out) {
                energies[e as usize] = w.to_f64();
            }
        }
        Ok(energies)
    }

    fn cauchy(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>) -> Vec<[f64; 9]> {
        let mut stresses = vec![[0.0; 9]; self.elements];
        for batch in &self.batches {
            let mut out = vec![[R::default(); 9]; batch.elements.len()];
            // The kernel cannot fail: outside the domain its values are not used.
            let _ = batch.run(&mut out, 1, |part, out| {
                batch.kernels.cauchy(part, u, out);
                None
            });
            for (&e, s) in batch.elements.iter().zip(out) {
                stresses[e as usize] = s.map(R::to_f64);
            }
        }
        stresses
    }

    fn add_force(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>, f: &mut Vec<[R; 3]>) -> Result<(), LeftDomain> {
        self.elements(|kernels, part, out| kernels.force(part, u, out))?;
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
        self.everywhere(|kernels, part, out| kernels.dforce(part, u, du, out));
        self.nodes(R::from_f64(factor), df);
    }

    fn add_diagonal_at(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>, factor: f64, d: &mut Vec<[R; 3]>) {
        self.everywhere(|kernels, part, out| kernels.diagonal(part, u, out));
        self.nodes(R::from_f64(factor), d);
    }

    fn add_damping(&mut self, _: &CpuBackend<R>, [u, v]: [&Vec<[R; 3]>; 2], factor: f64, f: &mut Vec<[R; 3]>) {
        self.everywhere(|kernels, part, out| kernels.damping(part, [u, v], out));
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
        self.everywhere(|kernels, part, out| kernels.ddamping(part, [u, v, dv], out));
        self.nodes(R::from_f64(factor), df);
    }

    fn add_damping_diagonal(&mut self, _: &CpuBackend<R>, [u, v]: [&Vec<[R; 3]>; 2], factor: f64, d: &mut Vec<[R; 3]>) {
        self.everywhere(|kernels, part, out| kernels.damping_diagonal(part, [u, v], out));
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
        if registers[RUNNING] == 0.0 {
            return;
        }
        if operator.damping.is_some() || operator.masses.matrix().is_some() {
            operator.apply(backend, self, x, y);
            registers[SUM] = backend.dot(x, y);
            return;
        }
        let state = std::mem::take(&mut self.state);
        self.everywhere(|kernels, part, out| kernels.dforce(part, &state, x, out));
        self.state = state;
        let factors = [-operator.stiffness, operator.mass].map(R::from_f64);
        registers[SUM] = self.product_at_nodes(backend, factors, operator.masses.diagonal(), x, y);
    }
}

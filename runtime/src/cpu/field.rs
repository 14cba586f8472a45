//! The elements of a body on the CPU, a cluster at a time, in two passes (after Faure et al. 2012, Algorithm 1).
//!
//! Pass 1 runs over clusters: it copies the vectors of a cluster's nodes, and adds the forces of its elements, in their
//! order, into a slot for each of these nodes. Pass 2 runs over the nodes of the body and sums their slots in ascending
//! order. A node has as many slots as clusters share it: most have one, where the paper has one for each element. No two
//! threads write one place, and no sum depends on the thread count.

use rayon::prelude::*;
use tensormass_kernels::{Blocks, Compute, Engine, Node, compose, copy_nodes};

use super::cluster::Cluster;
use super::vectors::{BLOCK, exact_dot};
use super::{CpuBackend, Precision};
use crate::backend::{Backend, ForceField, LeftDomain, Operator, REGISTERS, RUNNING, SUM};
use crate::body::{Body, LawBatch};
use crate::mesh::{Incidence, NodeId};
use crate::order::cluster_size;

/// The elements of one law and kind.
struct CpuBatch<R: Precision> {
    law: &'static str,
    domain: &'static str,
    compute: Box<dyn Compute<R>>,
    clusters: Vec<Cluster<R>>,
}

impl<R: Precision> CpuBatch<R> {
    fn new(body: &Body, batch: &LawBatch, engine: Engine) -> Self {
        let compute = compose::<R>(engine, batch.element, batch.law);
        let (count, size) = (batch.elements.len(), cluster_size(batch.element.info.nodes, batch.elements.len()));
        let ranges: Vec<usize> = (0..count).step_by(size).collect();
        let cluster = |start: &usize| Cluster::new(body, batch, *start..count.min(start + size), &*compute);
        // One after the other: what is computed in turn lies in turn in memory, as far as the allocator has it.
        Self {
            law: batch.law.info.name,
            domain: batch.law.info.domain.unwrap_or("everywhere"),
            clusters: ranges.iter().map(cluster).collect(),
            compute,
        }
    }

    fn left(&self, element: u32) -> LeftDomain {
        LeftDomain { element, law: self.law.to_string(), domain: self.domain.to_string() }
    }
}

/// The vectors of a cluster's nodes.
type Vectors<'a, R, const N: usize> = [&'a [Node<R>]; N];

/// Copies vectors of a cluster's nodes.
fn local<'a, R: Precision, const N: usize>(
    cluster: &Cluster<R>,
    vectors: [&Vec<[R; 3]>; N],
    room: &'a mut [Vec<Node<R>>; N],
) -> Vectors<'a, R, N> {
    vectors.iter().zip(room.iter_mut()).for_each(|(vector, room)| copy_nodes(vector, &cluster.nodes, room));
    room.each_ref().map(Vec::as_slice)
}

/// All elements of a body.
pub struct CpuField<R: Precision> {
    batches: Vec<CpuBatch<R>>,
    /// A partial force for each node of each cluster, batch after batch.
    slots: Vec<Node<R>>,
    /// Which slots belong to each node.
    incidence: Incidence,
    /// How many elements there are.
    elements: usize,
    /// The displacement at which the tangent is taken.
    state: Vec<[R; 3]>,
    /// Whether what is stored of it is there.
    is_linearized: bool,
}

impl<R: Precision> CpuField<R> {
    /// The elements of a body, in clusters, on the widest registers of this machine.
    pub fn new(body: &Body) -> Self {
        Self::on(body, Engine::best())
    }

    /// The elements of a body, in clusters.
    pub fn on(body: &Body, engine: Engine) -> Self {
        let batches: Vec<CpuBatch<R>> = body.batches.iter().map(|b| CpuBatch::new(body, b, engine)).collect();
        let clusters = batches.iter().flat_map(|b| &b.clusters);
        let slots = clusters.flat_map(|c| &c.nodes).map(|n| *n as usize);
        let incidence = Incidence::of_slots(body.masses.len(), slots);
        Self {
            slots: vec![[R::default(); 4]; incidence.slots().len()],
            elements: body.elements.len(),
            batches,
            incidence,
            state: vec![[R::default(); 3]; body.masses.len()],
            is_linearized: false,
        }
    }

    /// Pass 1: a kernel of every cluster into its slots.
    fn elements<const N: usize>(
        &mut self,
        vectors: [&Vec<[R; 3]>; N],
        kernel: impl Fn(&dyn Compute<R>, &Blocks<R>, Vectors<R, N>, &mut [Node<R>]) -> Option<usize> + Sync,
    ) -> Result<(), LeftDomain> {
        self.pass(vectors, |batch, cluster, vectors, out| kernel(&*batch.compute, &cluster.blocks, vectors, out))
    }

    fn pass<const N: usize>(
        &mut self,
        vectors: [&Vec<[R; 3]>; N],
        kernel: impl Fn(&CpuBatch<R>, &Cluster<R>, Vectors<R, N>, &mut [Node<R>]) -> Option<usize> + Sync,
    ) -> Result<(), LeftDomain> {
        let mut rest = self.slots.as_mut_slice();
        let mut tasks = vec![];
        for batch in &self.batches {
            for cluster in &batch.clusters {
                let (slots, others) = rest.split_at_mut(cluster.nodes.len());
                rest = others;
                tasks.push((batch, cluster, slots));
            }
        }
        let room = || std::array::from_fn(|_| vec![]);
        let outside = tasks
            .into_par_iter()
            .map_init(room, |room: &mut [Vec<Node<R>>; N], (batch, cluster, slots)| {
                slots.fill([R::default(); 4]);
                let outside = kernel(batch, cluster, local(cluster, vectors, room), slots);
                outside.map(|e| (cluster.elements[e], batch))
            })
            .flatten()
            .min_by_key(|(element, _)| *element);
        outside.map_or(Ok(()), |(element, batch)| Err(batch.left(element)))
    }

    /// Pass 1 of what reports no domain.
    fn everywhere<const N: usize>(
        &mut self,
        vectors: [&Vec<[R; 3]>; N],
        kernel: impl Fn(&dyn Compute<R>, &Blocks<R>, Vectors<R, N>, &mut [Node<R>]) + Sync,
    ) {
        let done = self.elements(vectors, |compute, blocks, vectors, out| {
            kernel(compute, blocks, vectors, out);
            None
        });
        debug_assert!(done.is_ok(), "differentials and damping report no domain");
    }

    /// Stores what products with the tangent need of the state.
    fn linearize(&mut self) {
        let u = &self.state;
        for batch in &mut self.batches {
            let compute = &*batch.compute;
            batch.clusters.par_iter_mut().for_each_init(
                || [vec![]],
                |room, cluster| {
                    let mut states = cluster.states.take().unwrap_or_else(|| compute.states(&cluster.blocks));
                    let [u] = local(cluster, [u], room);
                    compute.linearize(&cluster.blocks, u, &mut states);
                    cluster.states = Some(states);
                },
            );
        }
        self.is_linearized = true;
    }

    /// Pass 1 of a product with the tangent at the prepared state: that of rest, if none was.
    fn apply(&mut self, du: &Vec<[R; 3]>) {
        if !self.is_linearized {
            self.linearize();
        }
        let done = self.pass([du], |batch, cluster, [du], out| {
            let states = cluster.states.as_ref().expect("the tangent is linearized");
            batch.compute.apply(&cluster.blocks, states, du, out);
            None
        });
        debug_assert!(done.is_ok(), "differentials report no domain");
    }

    /// What a kernel gives each element, by the mesh's numbers.
    fn each<T: Copy + Send + Sync, U: Clone>(
        &self,
        u: &Vec<[R; 3]>,
        zero: T,
        kernel: impl Fn(&dyn Compute<R>, &Blocks<R>, &[Node<R>], &mut [T]) -> Option<usize> + Sync,
        convert: impl Fn(T) -> U,
    ) -> Result<Vec<U>, LeftDomain> {
        let mut all = vec![convert(zero); self.elements];
        let mut outside: Option<(u32, &CpuBatch<R>)> = None;
        for batch in &self.batches {
            let room = || [vec![]];
            let of_clusters: Vec<(Vec<T>, Option<usize>)> = batch
                .clusters
                .par_iter()
                .map_init(room, |room, cluster| {
                    let mut out = vec![zero; cluster.elements.len()];
                    let [u] = local(cluster, [u], room);
                    let outside = kernel(&*batch.compute, &cluster.blocks, u, &mut out);
                    (out, outside)
                })
                .collect();
            for (cluster, (out, left)) in batch.clusters.iter().zip(of_clusters) {
                cluster.elements.iter().zip(out).for_each(|(e, value)| all[*e as usize] = convert(value));
                let left = left.map(|e| (cluster.elements[e], batch));
                outside = [outside, left].into_iter().flatten().min_by_key(|(element, _)| *element);
            }
        }
        outside.map_or(Ok(all), |(element, batch)| Err(batch.left(element)))
    }

    /// The sum of a node's slots.
    fn sum_of_slots(&self, node: usize) -> [R; 3] {
        let mut sum = [R::default(); 4];
        for &slot in self.incidence.of(NodeId(node as u32)) {
            let partial = self.slots[slot as usize];
            for c in 0..4 {
                sum[c] = sum[c] + partial[c];
            }
        }
        let [x, y, z, _] = sum;
        [x, y, z]
    }

    /// Pass 2: y += factor times the sum of each node's slots.
    fn nodes(&self, factor: R, y: &mut [[R; 3]]) {
        y.par_chunks_mut(BLOCK).enumerate().for_each(|(k, y)| {
            for (i, y) in y.iter_mut().enumerate() {
                let sum = self.sum_of_slots(k * BLOCK + i);
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
        self.each(u, R::default(), |compute, blocks, u, out| compute.energy(blocks, u, out), R::to_f64)
    }

    fn cauchy(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>) -> Vec<[f64; 9]> {
        let stress = |compute: &dyn Compute<R>, blocks: &Blocks<R>, u: &[Node<R>], out: &mut [[R; 9]]| {
            compute.cauchy(blocks, u, out);
            None
        };
        // The kernel cannot fail: outside the domain its values are not used.
        self.each(u, [R::default(); 9], stress, |s| s.map(R::to_f64)).unwrap_or_default()
    }

    fn add_force(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>, f: &mut Vec<[R; 3]>) -> Result<(), LeftDomain> {
        self.elements([u], |compute, blocks, [u], out| compute.force(blocks, u, out))?;
        self.nodes(R::from_f64(1.0), f);
        Ok(())
    }

    fn prepare(&mut self, backend: &CpuBackend<R>, u: &Vec<[R; 3]>) {
        backend.copy(u, &mut self.state);
        self.linearize();
    }

    fn add_dforce(&mut self, _: &CpuBackend<R>, du: &Vec<[R; 3]>, factor: f64, df: &mut Vec<[R; 3]>) {
        self.apply(du);
        self.nodes(R::from_f64(factor), df);
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
        self.everywhere([u, du], |compute, blocks, u_du, out| compute.dforce(blocks, u_du, out));
        self.nodes(R::from_f64(factor), df);
    }

    fn add_diagonal_at(&mut self, _: &CpuBackend<R>, u: &Vec<[R; 3]>, factor: f64, d: &mut Vec<[R; 3]>) {
        self.everywhere([u], |compute, blocks, [u], out| compute.diagonal(blocks, u, out));
        self.nodes(R::from_f64(factor), d);
    }

    fn add_damping(&mut self, _: &CpuBackend<R>, [u, v]: [&Vec<[R; 3]>; 2], factor: f64, f: &mut Vec<[R; 3]>) {
        self.everywhere([u, v], |compute, blocks, u_v, out| compute.damping(blocks, u_v, out));
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
        self.everywhere([u, v, dv], |compute, blocks, u_v_dv, out| compute.ddamping(blocks, u_v_dv, out));
        self.nodes(R::from_f64(factor), df);
    }

    fn add_damping_diagonal(&mut self, _: &CpuBackend<R>, [u, v]: [&Vec<[R; 3]>; 2], factor: f64, d: &mut Vec<[R; 3]>) {
        self.everywhere([u, v], |compute, blocks, u_v, out| compute.damping_diagonal(blocks, u_v, out));
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
        self.apply(x);
        let factors = [-operator.stiffness, operator.mass].map(R::from_f64);
        registers[SUM] = self.product_at_nodes(backend, factors, operator.masses.diagonal(), x, y);
    }
}

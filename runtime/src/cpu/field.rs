//! The elements of a body on the CPU, a cluster at a time, in two passes (after Faure et al. 2012, Algorithm 1).
//!
//! Pass 1 runs over clusters: it copies the vectors of a cluster's nodes, and adds the forces of its elements, in their
//! order. What it adds to its own nodes it leaves where the sums begin, what to foreign ones in a slot for each. Pass 2 runs
//! over the nodes of the body and sums their slots in ascending order. A node has as many partial forces as clusters share
//! it: most have one, where the paper has one for each element. No two threads write one place, and no sum depends on the
//! thread count.

use std::ops::Range;

use rayon::prelude::*;
use tensormass_kernels::{Blocks, Compute, Engine, Extent, LawInfo, Node, Part, States, compose};

use super::assembled::Assembled;
use super::cluster::{Arranged, Cluster, Room, Vectors};
use super::vectors::{BLOCK, CpuVector, exact_dot};
use super::{CpuBackend, Precision};
use crate::backend::{Backend, ForceField, LeftDomain, Operator, REGISTERS, RUNNING, SUM};
use crate::body::{Body, LawBatch};
use crate::mesh::Incidence;
use crate::order::clusters;
use crate::tangent::{self, Tangent};

/// The elements of one law and kind.
struct CpuBatch<R: Precision> {
    law: &'static LawInfo,
    compute: Box<dyn Compute<R>>,
    clusters: Vec<Cluster>,
    blocks: Blocks<R>,
    /// Products with the tangent.
    products: Products<R>,
}

/// How products with the tangent are computed, with what they need of a state; none before they are asked for.
enum Products<R> {
    Stored(Option<States<R>>),
    Recomputed,
    Assembled(Option<Assembled<R>>),
}

impl<R> From<Tangent> for Products<R> {
    fn from(tangent: Tangent) -> Self {
        match tangent {
            Tangent::Stored => Self::Stored(None),
            Tangent::Recomputed => Self::Recomputed,
            Tangent::Assembled => Self::Assembled(None),
        }
    }
}

impl<R: Precision> CpuBatch<R> {
    /// A batch whose first nodes, so many, are those of batches before it.
    fn new(body: &Body, batch: &LawBatch, places: &[u32], met: &mut usize, engine: Engine) -> Self {
        let info = batch.element.info;
        let compute = compose::<R>(engine, batch.element, batch.law);
        let ranges = clusters(info.nodes, batch.elements.len());
        let arranged: Vec<Arranged> =
            ranges.into_par_iter().map(|range| Arranged::new(body, batch, range, compute.lanes())).collect();
        let extents: Vec<Extent> = arranged.iter().map(|a| a.extent).collect();
        let shape = [info.nodes, info.points.len(), batch.law.info.constants.len()];
        let mut blocks = Blocks::new(compute.lanes(), shape, batch.per_element, &extents);
        let cluster = |(number, arranged)| {
            let cluster = Cluster::new((body, batch, places), arranged, *met, (&mut blocks, number));
            *met = cluster.own.end;
            cluster
        };
        Self {
            law: batch.law.info,
            clusters: arranged.iter().enumerate().map(cluster).collect(),
            blocks,
            compute,
            products: Products::Stored(None),
        }
    }

    /// What a cluster adds to a product from what is stored of the state.
    fn multiply(&self, cluster: usize, du: &[Node<R>], out: &mut [Node<R>]) -> Option<usize> {
        match &self.products {
            Products::Stored(Some(states)) => {
                let part = self.blocks.part(cluster);
                self.compute.apply(part, states.of(part), du, out);
            }
            Products::Assembled(Some(matrix)) => matrix.multiply(&*self.compute, cluster, du, out),
            _ => unreachable!("the tangent is linearized"),
        }
        None
    }

    fn left(&self, element: u32) -> LeftDomain {
        let (law, domain) = (self.law.name.to_string(), self.law.domain.unwrap_or("everywhere").to_string());
        LeftDomain { element, law, domain }
    }
}

/// All elements of a body.
pub struct CpuField<R: Precision> {
    batches: Vec<CpuBatch<R>>,
    /// Of each node the partial force of the cluster that it belongs to.
    own: Vec<[R; 3]>,
    /// A partial force for each node that is foreign to a cluster, cluster after cluster.
    foreign: Vec<[R; 3]>,
    /// The nodes that have some of these, ascending, and where theirs begin and end in `slots`.
    shared: Vec<(u32, Range<u32>)>,
    /// Places in `foreign`, node after node, ascending.
    slots: Vec<u32>,
    /// How many elements there are.
    elements: usize,
    /// The displacement at which the tangent is taken.
    state: CpuVector<R>,
    /// Whether what is stored of it is there.
    is_linearized: bool,
}

impl<R: Precision> CpuField<R> {
    /// The elements of a body, in clusters, on the widest registers of this machine.
    pub fn new(backend: &CpuBackend<R>, body: &Body) -> Self {
        Self::on(backend, body, Engine::best())
    }

    /// The elements of a body, in clusters.
    pub fn on(backend: &CpuBackend<R>, body: &Body, engine: Engine) -> Self {
        let mut met = 0;
        let batch = |b| CpuBatch::new(body, b, backend.places(), &mut met, engine);
        let batches: Vec<CpuBatch<R>> = body.batches.iter().map(batch).collect();
        let clusters = batches.iter().flat_map(|b| &b.clusters);
        let foreign = clusters.flat_map(|c| &c.foreign).map(|n| *n as usize);
        let nodes = body.masses.len();
        let incidence = Incidence::of_slots(nodes, foreign);
        let ranges = incidence.offsets().windows(2).zip(0..).map(|(ends, node)| (node, ends[0]..ends[1]));
        let field = Self {
            own: vec![[R::default(); 3]; nodes],
            foreign: vec![[R::default(); 3]; incidence.slots().len()],
            shared: ranges.filter(|(_, slots)| !slots.is_empty()).collect(),
            slots: incidence.slots().to_vec(),
            elements: body.elements.len(),
            batches,
            state: backend.zeros(),
            is_linearized: false,
        };
        field.with_tangents(&tangent::by_rule(body, size_of::<R>()))
    }

    /// Computes products with the tangent of each law in this way, instead of by the rule.
    pub fn with_tangents(mut self, tangents: &[Tangent]) -> Self {
        self.batches.iter_mut().zip(tangents).for_each(|(batch, tangent)| batch.products = (*tangent).into());
        self.is_linearized = false;
        self
    }

    /// Pass 1: a kernel of every cluster, which adds to vectors of zeros.
    fn elements<const N: usize>(
        &mut self,
        vectors: [&CpuVector<R>; N],
        kernel: impl Fn(&dyn Compute<R>, Part<R>, Vectors<R, N>, &mut [Node<R>]) -> Option<usize> + Sync,
    ) -> Result<(), LeftDomain> {
        self.pass(vectors, |batch, k, vectors, out| kernel(&*batch.compute, batch.blocks.part(k), vectors, out))
    }

    fn pass<const N: usize>(
        &mut self,
        vectors: [&CpuVector<R>; N],
        kernel: impl Fn(&CpuBatch<R>, usize, Vectors<R, N>, &mut [Node<R>]) -> Option<usize> + Sync,
    ) -> Result<(), LeftDomain> {
        let (mut own, mut foreign) = (self.own.as_mut_slice(), self.foreign.as_mut_slice());
        let mut tasks = vec![];
        for batch in &self.batches {
            for (k, cluster) in batch.clusters.iter().enumerate() {
                let (own_here, foreign_here);
                (own_here, own) = own.split_at_mut(cluster.own.len());
                (foreign_here, foreign) = foreign.split_at_mut(cluster.foreign.len());
                tasks.push((batch, k, own_here, foreign_here));
            }
        }
        let outside = tasks
            .into_par_iter()
            .map_init(
                || (Room::<R, N>::new(), Room::<R, 1>::new()),
                |(room, out), (batch, k, own, foreign)| {
                    let (blocks, cluster) = (&batch.blocks, &batch.clusters[k]);
                    let vectors = room.copies(blocks, cluster, vectors);
                    let [out] = out.zeros(blocks, cluster);
                    let outside = kernel(batch, k, vectors, out);
                    cluster.leave(out, own, foreign);
                    outside.map(|e| (cluster.elements[e], batch))
                },
            )
            .flatten()
            .min_by_key(|(element, _)| *element);
        outside.map_or(Ok(()), |(element, batch)| Err(batch.left(element)))
    }

    /// Pass 1 of what reports no domain.
    fn everywhere<const N: usize>(
        &mut self,
        vectors: [&CpuVector<R>; N],
        kernel: impl Fn(&dyn Compute<R>, Part<R>, Vectors<R, N>, &mut [Node<R>]) + Sync,
    ) {
        let done = self.elements(vectors, |compute, part, vectors, out| {
            kernel(compute, part, vectors, out);
            None
        });
        debug_assert!(done.is_ok(), "differentials and damping report no domain");
    }

    /// Stores what products with the tangent need of the state.
    fn linearize(&mut self) {
        let u = &self.state;
        for CpuBatch { law, compute, clusters, blocks, products, .. } in &mut self.batches {
            let (compute, clusters, blocks) = (&**compute, &*clusters, &*blocks);
            match products {
                Products::Stored(states) => {
                    let states = states.get_or_insert_with(|| compute.states(blocks));
                    states.parts_mut(blocks).into_par_iter().enumerate().for_each_init(
                        Room::new,
                        |room, (k, states)| {
                            let [u] = room.copies(blocks, &clusters[k], [u]);
                            compute.linearize(blocks.part(k), u, states);
                        },
                    );
                }
                Products::Recomputed => {}
                Products::Assembled(matrix) => {
                    let matrix = matrix.get_or_insert_with(|| Assembled::new(clusters, blocks, compute.lanes()));
                    // The tangent of a linear law is the same everywhere.
                    if !(law.structure.linear && matrix.is_filled) {
                        matrix.fill(compute, blocks, clusters, u);
                    }
                }
            }
        }
        self.is_linearized = true;
    }

    /// Pass 1 of a product with the tangent at the prepared state: that of rest, if none was.
    fn apply(&mut self, du: &CpuVector<R>) {
        if !self.is_linearized {
            self.linearize();
        }
        let recomputes = self.batches.iter().any(|b| matches!(b.products, Products::Recomputed));
        let done = if recomputes {
            self.at_state(|field, u| {
                field.pass([u, du], |batch, k, [u, du], out| match batch.products {
                    Products::Recomputed => {
                        batch.compute.dforce(batch.blocks.part(k), [u, du], out);
                        None
                    }
                    _ => batch.multiply(k, du, out),
                })
            })
        } else {
            self.pass([du], |batch, k, [du], out| batch.multiply(k, du, out))
        };
        debug_assert!(done.is_ok(), "differentials report no domain");
    }

    /// What is computed at the displacement at which the tangent is taken.
    fn at_state<T>(&mut self, compute: impl FnOnce(&mut Self, &CpuVector<R>) -> T) -> T {
        let state = std::mem::replace(&mut self.state, CpuVector(vec![]));
        let result = compute(self, &state);
        self.state = state;
        result
    }

    /// What a kernel gives each element, by the mesh's numbers.
    fn each<T: Copy + Send + Sync, U: Clone>(
        &self,
        u: &CpuVector<R>,
        zero: T,
        kernel: impl Fn(&dyn Compute<R>, Part<R>, &[Node<R>], &mut [T]) -> Option<usize> + Sync,
        convert: impl Fn(T) -> U,
    ) -> Result<Vec<U>, LeftDomain> {
        let mut all = vec![convert(zero); self.elements];
        let mut outside: Option<(u32, &CpuBatch<R>)> = None;
        for batch in &self.batches {
            let clusters = batch.clusters.par_iter().enumerate();
            let of_clusters: Vec<(Vec<T>, Option<usize>)> = clusters
                .map_init(Room::new, |room, (k, cluster)| {
                    let mut out = vec![zero; cluster.elements.len()];
                    let [u] = room.copies(&batch.blocks, cluster, [u]);
                    let outside = kernel(&*batch.compute, batch.blocks.part(k), u, &mut out);
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

    /// Pass 2: of each block of nodes its number and the sums of their partial forces.
    fn sums(&mut self) -> impl IndexedParallelIterator<Item = (usize, &[[R; 3]])> {
        let Self { own, foreign, shared, slots, .. } = self;
        let (foreign, shared, slots) = (&*foreign, &*shared, &*slots);
        own.par_chunks_mut(BLOCK).enumerate().map(move |(block, sums)| {
            let first = block * BLOCK;
            let start = shared.partition_point(|(node, _)| (*node as usize) < first);
            for (node, range) in shared[start..].iter().take_while(|(node, _)| (*node as usize) < first + BLOCK) {
                let sum = &mut sums[*node as usize - first];
                for slot in &slots[range.start as usize..range.end as usize] {
                    let partial = foreign[*slot as usize];
                    for c in 0..3 {
                        sum[c] = sum[c] + partial[c];
                    }
                }
            }
            (block, &*sums)
        })
    }

    /// y += factor times the sum of each node's partial forces.
    fn nodes(&mut self, factor: R, y: &mut CpuVector<R>) {
        self.sums().zip(y.0.par_chunks_mut(BLOCK)).for_each(|((_, sums), y)| {
            for (y, sum) in y.as_flattened_mut().iter_mut().zip(sums.as_flattened()) {
                *y = *y + factor * *sum;
            }
        });
    }

    /// y = factor times the sum of each node's partial forces + mass M x, imposed components 0; x . y. One pass over the
    /// vectors, with the arithmetic of [`Operator::apply`] and [`Backend::dot`].
    fn product_at_nodes(
        &mut self,
        backend: &CpuBackend<R>,
        [factor, mass]: [R; 2],
        masses: &CpuVector<R>,
        x: &CpuVector<R>,
        y: &mut CpuVector<R>,
    ) -> f64 {
        let given = x.0.par_chunks(BLOCK).zip(masses.0.par_chunks(BLOCK));
        let blocks: Vec<f64> = self
            .sums()
            .zip(y.0.par_chunks_mut(BLOCK).zip(given))
            .map(|((block, sums), (y, (x, masses)))| {
                let numbers = sums.as_flattened().iter().zip(x.as_flattened()).zip(masses.as_flattened());
                for (y, ((sum, x), m)) in y.as_flattened_mut().iter_mut().zip(numbers) {
                    *y = factor * *sum + mass * (*m * *x);
                }
                backend.imposed(block).for_each(|(i, c)| y[i][c] = R::default());
                exact_dot(x, y)
            })
            .collect();
        blocks.iter().sum()
    }
}

impl<R: Precision> ForceField<CpuBackend<R>> for CpuField<R> {
    fn element_energies(&mut self, _: &CpuBackend<R>, u: &CpuVector<R>) -> Result<Vec<f64>, LeftDomain> {
        self.each(u, R::default(), |compute, part, u, out| compute.energy(part, u, out), R::to_f64)
    }

    fn cauchy(&mut self, _: &CpuBackend<R>, u: &CpuVector<R>) -> Vec<[f64; 9]> {
        let stress = |compute: &dyn Compute<R>, part: Part<R>, u: &[Node<R>], out: &mut [[R; 9]]| {
            compute.cauchy(part, u, out);
            None
        };
        // The kernel cannot fail: outside the domain its values are not used.
        self.each(u, [R::default(); 9], stress, |s| s.map(R::to_f64)).unwrap_or_default()
    }

    fn add_force(&mut self, _: &CpuBackend<R>, u: &CpuVector<R>, f: &mut CpuVector<R>) -> Result<(), LeftDomain> {
        self.elements([u], |compute, part, [u], out| compute.force(part, u, out))?;
        self.nodes(R::from_f64(1.0), f);
        Ok(())
    }

    fn prepare(&mut self, backend: &CpuBackend<R>, u: &CpuVector<R>) {
        backend.copy(u, &mut self.state);
        self.linearize();
    }

    fn add_dforce(&mut self, _: &CpuBackend<R>, du: &CpuVector<R>, factor: f64, df: &mut CpuVector<R>) {
        self.apply(du);
        self.nodes(R::from_f64(factor), df);
    }

    fn add_diagonal(&mut self, backend: &CpuBackend<R>, factor: f64, d: &mut CpuVector<R>) {
        self.at_state(|field, u| field.add_diagonal_at(backend, u, factor, d));
    }

    fn add_dforce_at(
        &mut self,
        _: &CpuBackend<R>,
        u: &CpuVector<R>,
        du: &CpuVector<R>,
        factor: f64,
        df: &mut CpuVector<R>,
    ) {
        self.everywhere([u, du], |compute, part, u_du, out| compute.dforce(part, u_du, out));
        self.nodes(R::from_f64(factor), df);
    }

    fn add_diagonal_at(&mut self, _: &CpuBackend<R>, u: &CpuVector<R>, factor: f64, d: &mut CpuVector<R>) {
        self.everywhere([u], |compute, part, [u], out| compute.diagonal(part, u, out));
        self.nodes(R::from_f64(factor), d);
    }

    fn add_damping(&mut self, _: &CpuBackend<R>, [u, v]: [&CpuVector<R>; 2], factor: f64, f: &mut CpuVector<R>) {
        self.everywhere([u, v], |compute, part, u_v, out| compute.damping(part, u_v, out));
        self.nodes(R::from_f64(factor), f);
    }

    fn add_ddamping(
        &mut self,
        _: &CpuBackend<R>,
        [u, v]: [&CpuVector<R>; 2],
        dv: &CpuVector<R>,
        factor: f64,
        df: &mut CpuVector<R>,
    ) {
        self.everywhere([u, v, dv], |compute, part, u_v_dv, out| compute.ddamping(part, u_v_dv, out));
        self.nodes(R::from_f64(factor), df);
    }

    fn add_damping_diagonal(
        &mut self,
        _: &CpuBackend<R>,
        [u, v]: [&CpuVector<R>; 2],
        factor: f64,
        d: &mut CpuVector<R>,
    ) {
        self.everywhere([u, v], |compute, part, u_v, out| compute.damping_diagonal(part, u_v, out));
        self.nodes(R::from_f64(factor), d);
    }

    fn product(
        &mut self,
        backend: &CpuBackend<R>,
        operator: &Operator<CpuBackend<R>>,
        x: &CpuVector<R>,
        y: &mut CpuVector<R>,
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
        // x has nothing along what is held: the sum is that of the projected product too.
        registers[SUM] = self.product_at_nodes(backend, factors, operator.masses.diagonal(), x, y);
        backend.project_held(y);
    }
}

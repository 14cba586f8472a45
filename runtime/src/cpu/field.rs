//! The elements of a body on the CPU, a cluster at a time, in two passes (after Faure et al. 2012, Algorithm 1).
//!
//! Pass 1 runs over clusters: it copies the vectors of a cluster's nodes, and adds the forces of its elements, in their
//! order. What it adds to its own nodes it leaves where the sums begin, what to foreign ones in a slot for each. Pass 2 runs
//! over the nodes of the body and sums their slots in ascending order. A node has as many partial forces as clusters share
//! it: most have one, where the paper has one for each element. No two threads write one place, and no sum depends on the
//! thread count.

use std::ops::Range;

use rayon::prelude::*;
use tensormass_kernels::{Blocks, Compute, Engine, Extent, LawInfo, Node, Part, compose};

use super::cluster::{Arranged, Cluster, Room, Vectors};
use super::products::Products;
use super::vectors::{BLOCK, CpuVector, exact_dot};
use super::{CpuBackend, Precision};
use crate::backend::{Backend, ForceField, LeftDomain, Operator, REGISTERS, RUNNING, SUM};
use crate::body::{Body, LawBatch};
use crate::inventory::names::{CONSTANTS, ELEMENT_NODES, ELEMENT_NUMBERS, PARTIAL_FORCES, REST, SLOTS};
use crate::inventory::{Lease, Ledger};
use crate::mesh::Incidence;
use crate::order::clusters;
use crate::tangent::{self, Tangent};

/// The elements of one law and kind.
pub(super) struct CpuBatch<R: Precision> {
    pub law: &'static LawInfo,
    pub compute: Box<dyn Compute<R>>,
    pub clusters: Vec<Cluster>,
    pub blocks: Blocks<R>,
    /// Products with the tangent.
    pub products: Products<R>,
    _leases: [Lease; 3],
}

impl<R: Precision> CpuBatch<R> {
    /// A batch whose first nodes, so many, are those of batches before it.
    fn new(body: &Body, batch: &LawBatch, backend: &CpuBackend<R>, met: &mut usize, engine: Engine) -> Self {
        let info = batch.element.info;
        let compute = compose::<R>(engine, batch.element, batch.law);
        let ranges = clusters(info.nodes, batch.elements.len());
        let arranged: Vec<Arranged> =
            ranges.into_par_iter().map(|range| Arranged::new(body, batch, range, compute.lanes())).collect();
        let extents: Vec<Extent> = arranged.iter().map(|a| a.extent).collect();
        let shape = [info.nodes, info.points.len(), batch.law.info.constants.len()];
        let mut blocks = Blocks::new(compute.lanes(), shape, batch.per_element, &extents);
        let cluster = |(number, arranged)| {
            let cluster = Cluster::new((body, batch, backend.places()), arranged, *met, (&mut blocks, number));
            *met = cluster.own.end;
            cluster
        };
        let clusters = arranged.iter().enumerate().map(cluster).collect();
        let (names, bytes) = ([ELEMENT_NODES, REST, CONSTANTS], blocks.bytes());
        let leases = std::array::from_fn(|k| backend.ledger().hold(names[k], bytes[k]));
        Self { law: batch.law.info, clusters, blocks, compute, products: Products::Stored(None), _leases: leases }
    }

    fn left(&self, element: u32) -> LeftDomain {
        let (law, domain) = (self.law.name.to_string(), self.law.domain.unwrap_or("everywhere").to_string());
        LeftDomain { element, law, domain }
    }
}

/// All elements of a body.
pub struct CpuField<R: Precision> {
    pub(super) batches: Vec<CpuBatch<R>>,
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
    /// The displacement at which the tangent is taken; none where no law's tangent depends on it, or none was prepared.
    pub(super) state: Option<CpuVector<R>>,
    /// Whether what is stored of it is there.
    pub(super) is_linearized: bool,
    pub(super) ledger: Ledger,
    _leases: [Lease; 3],
}

impl<R: Precision> CpuField<R> {
    /// The elements of a body, in clusters, on the widest registers of this machine.
    pub fn new(backend: &CpuBackend<R>, body: &Body) -> Self {
        Self::on(backend, body, Engine::best())
    }

    /// The elements of a body, in clusters.
    pub fn on(backend: &CpuBackend<R>, body: &Body, engine: Engine) -> Self {
        let mut met = 0;
        let batch = |b| CpuBatch::new(body, b, backend, &mut met, engine);
        let batches: Vec<CpuBatch<R>> = body.batches.iter().map(batch).collect();
        let clusters = batches.iter().flat_map(|b| &b.clusters);
        let foreign = clusters.flat_map(|c| &c.foreign).map(|n| *n as usize);
        let nodes = body.masses.len();
        let incidence = Incidence::of_slots(nodes, foreign);
        let ranges = incidence.offsets().windows(2).zip(0..).map(|(ends, node)| (node, ends[0]..ends[1]));
        let own = vec![[R::default(); 3]; nodes];
        let foreign = vec![[R::default(); 3]; incidence.slots().len()];
        let shared: Vec<(u32, Range<u32>)> = ranges.filter(|(_, slots)| !slots.is_empty()).collect();
        let slots = incidence.slots().to_vec();
        let ledger = backend.ledger();
        let all = || batches.iter().flat_map(|b| &b.clusters);
        let numbers = all().map(|c| size_of_val(&*c.elements)).sum();
        let of_clusters = all().map(|c| size_of_val(&*c.foreign)).sum::<usize>();
        let leases = [
            ledger.hold(PARTIAL_FORCES, size_of_val(&*own) + size_of_val(&*foreign)),
            ledger.hold(SLOTS, size_of_val(&*shared) + size_of_val(&*slots) + of_clusters),
            ledger.hold(ELEMENT_NUMBERS, numbers),
        ];
        let field = Self {
            own,
            foreign,
            shared,
            slots,
            elements: body.elements.len(),
            state: None,
            is_linearized: false,
            ledger: ledger.clone(),
            _leases: leases,
            batches,
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
        name: &str,
        vectors: [&CpuVector<R>; N],
        kernel: impl Fn(&dyn Compute<R>, Part<R>, Vectors<R, N>, &mut [Node<R>]) -> Option<usize> + Sync,
    ) -> Result<(), LeftDomain> {
        self.ledger.ran(name);
        self.pass(vectors, |batch, k, vectors, out| kernel(&*batch.compute, batch.blocks.part(k), vectors, out))
    }

    pub(super) fn pass<const N: usize>(
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
    pub(super) fn everywhere<const N: usize>(
        &mut self,
        name: &str,
        vectors: [&CpuVector<R>; N],
        kernel: impl Fn(&dyn Compute<R>, Part<R>, Vectors<R, N>, &mut [Node<R>]) + Sync,
    ) {
        let done = self.elements(name, vectors, |compute, part, vectors, out| {
            kernel(compute, part, vectors, out);
            None
        });
        debug_assert!(done.is_ok(), "differentials and damping report no domain");
    }

    /// What a kernel gives each element, by the mesh's numbers.
    fn each<T: Copy + Send + Sync, U: Clone>(
        &self,
        name: &str,
        u: &CpuVector<R>,
        zero: T,
        kernel: impl Fn(&dyn Compute<R>, Part<R>, &[Node<R>], &mut [T]) -> Option<usize> + Sync,
        convert: impl Fn(T) -> U,
    ) -> Result<Vec<U>, LeftDomain> {
        self.ledger.ran(name);
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
    pub(super) fn nodes(&mut self, factor: R, y: &mut CpuVector<R>) {
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
        masses: Option<&CpuVector<R>>,
        x: &CpuVector<R>,
        y: &mut CpuVector<R>,
    ) -> f64 {
        // Without masses their factor is 0, and x as good as any.
        let given = x.0.par_chunks(BLOCK).zip(masses.unwrap_or(x).0.par_chunks(BLOCK));
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
        self.each("energy", u, R::default(), |compute, part, u, out| compute.energy(part, u, out), R::to_f64)
    }

    fn cauchy(&mut self, _: &CpuBackend<R>, u: &CpuVector<R>) -> Vec<[f64; 9]> {
        let stress = |compute: &dyn Compute<R>, part: Part<R>, u: &[Node<R>], out: &mut [[R; 9]]| {
            compute.cauchy(part, u, out);
            None
        };
        // The kernel cannot fail: outside the domain its values are not used.
        self.each("cauchy", u, [R::default(); 9], stress, |s| s.map(R::to_f64)).unwrap_or_default()
    }

    fn add_force(&mut self, _: &CpuBackend<R>, u: &CpuVector<R>, f: &mut CpuVector<R>) -> Result<(), LeftDomain> {
        self.elements("force", [u], |compute, part, [u], out| compute.force(part, u, out))?;
        self.nodes(R::from_f64(1.0), f);
        Ok(())
    }

    fn prepare(&mut self, backend: &CpuBackend<R>, u: &CpuVector<R>) {
        self.take_tangent_at(backend, u);
    }

    fn forget_tangent(&mut self, _: &CpuBackend<R>) {
        self.forget();
    }

    fn add_dforce(&mut self, _: &CpuBackend<R>, du: &CpuVector<R>, factor: f64, df: &mut CpuVector<R>) {
        self.apply(du);
        self.nodes(R::from_f64(factor), df);
    }

    fn add_diagonal(&mut self, backend: &CpuBackend<R>, factor: f64, d: &mut CpuVector<R>) {
        match self.state.take() {
            Some(state) => {
                self.add_diagonal_at(backend, &state, factor, d);
                self.state = Some(state);
            }
            // Of rest; linear laws, whose diagonal depends on nothing, take what is there.
            None if self.depends_on_state() => self.add_diagonal_at(backend, &backend.zeros(), factor, d),
            None => {
                self.everywhere("diagonal", [&*d], |compute, part, [u], out| compute.diagonal(part, u, out));
                self.nodes(R::from_f64(factor), d);
            }
        }
    }

    fn add_dforce_at(
        &mut self,
        _: &CpuBackend<R>,
        u: &CpuVector<R>,
        du: &CpuVector<R>,
        factor: f64,
        df: &mut CpuVector<R>,
    ) {
        if self.depends_on_state() {
            self.everywhere("dforce", [u, du], |compute, part, u_du, out| compute.dforce(part, u_du, out));
        } else {
            // A constant tangent is all that there is to know: G is not gathered.
            self.everywhere("apply", [du], |compute, part, [du], out| compute.apply(part, &[], du, out));
        }
        self.nodes(R::from_f64(factor), df);
    }

    fn add_diagonal_at(&mut self, _: &CpuBackend<R>, u: &CpuVector<R>, factor: f64, d: &mut CpuVector<R>) {
        self.everywhere("diagonal", [u], |compute, part, [u], out| compute.diagonal(part, u, out));
        self.nodes(R::from_f64(factor), d);
    }

    fn add_damping(&mut self, _: &CpuBackend<R>, [u, v]: [&CpuVector<R>; 2], factor: f64, f: &mut CpuVector<R>) {
        self.everywhere("damping", [u, v], |compute, part, u_v, out| compute.damping(part, u_v, out));
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
        self.everywhere("ddamping", [u, v, dv], |compute, part, u_v_dv, out| compute.ddamping(part, u_v_dv, out));
        self.nodes(R::from_f64(factor), df);
    }

    fn add_damping_diagonal(
        &mut self,
        _: &CpuBackend<R>,
        [u, v]: [&CpuVector<R>; 2],
        factor: f64,
        d: &mut CpuVector<R>,
    ) {
        self.everywhere("damping_diagonal", [u, v], |compute, part, u_v, out| compute.damping_diagonal(part, u_v, out));
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

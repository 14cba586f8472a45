//! Any law composed with any element: gather G at some quadrature points, evaluate the law there, contract.
//!
//! Laws and elements meet through function pointers, some blocks at a time, so that what is compiled is the sum of the
//! two, not the product: G and P stay in the innermost cache.

use crate::assembly::{Pair, pairs};
use crate::blocks::{Blocks, Part, Range, States};
use crate::element::{ElementEntry, ElementInfo, ElementKernels, Elements, Table};
use crate::lanes::{Engine, Lanes, Node, Registers};
use crate::law::LawEntry;
use crate::matrix::{MultiplyKernel, Rows};
use crate::point::{DampingPointKernels, Material, Outside, PointKernels};
use crate::strip::MEMBERS;
use crate::table::{Precision, Tabled};

/// Bytes of a tensor at the points that are computed at once, unless one block has more: what of G, dG and P stays in a
/// cache, and as much of the elements as is asked for in advance.
const BYTES: usize = 4 * 9 * 64;

/// A law on an element, in one precision: what it computes of the elements of a cluster, from and to vectors at its
/// nodes.
pub trait Compute<R>: Send + Sync {
    /// Elements of a block.
    fn lanes(&self) -> usize;
    /// Displacements u -> each element's strain energy (unit of stress times m^3).
    fn energy(&self, part: Part<R>, u: &[Node<R>], out: &mut [R]) -> Outside;
    /// Displacements u -> nodal forces f_j = - integral of P grad Lambda_j, added to f.
    fn force(&self, part: Part<R>, u: &[Node<R>], f: &mut [Node<R>]) -> Outside;
    /// Displacements u and increments du -> the differentials of the nodal forces, added to df.
    fn dforce(&self, part: Part<R>, u: [&[Node<R>]; 2], df: &mut [Node<R>]);
    /// Numbers stored of an element's state for [`Compute::apply`].
    fn stored(&self) -> usize;
    /// Room for the state of a batch.
    fn states(&self, blocks: &Blocks<R>) -> States<R>;
    /// Displacements u -> what is stored for [`Compute::apply`].
    fn linearize(&self, part: Part<R>, u: &[Node<R>], states: &mut [R]);
    /// What was stored of u ([`States::of`]) and increments du -> the differentials of [`Compute::dforce`], added to df.
    fn apply(&self, part: Part<R>, states: &[R], du: &[Node<R>], df: &mut [Node<R>]);
    /// Displacements u -> what the force of each node of an element changes by with the displacement of each: row a of a
    /// pair has component a by those of the displacement. `places` says for each of [`crate::pairs`] of the nodes of a
    /// block's elements, lane after lane, what in `out` it is added to, as [`crate::block_place`] gives it.
    ///
    /// # Panics
    /// A place is beyond `out`, or there is none for an element.
    fn assemble(&self, part: Part<R>, u: &[Node<R>], places: &[u32], out: &mut [Pair<R>]);
    /// A x with the rows that a cluster has of a symmetric matrix, added to y.
    fn multiply(&self, rows: &Rows<R>, x: &[Node<R>], y: &mut [Node<R>]);
    /// Displacements u -> the diagonal of the tangent stiffness -df/du, added to d.
    fn diagonal(&self, part: Part<R>, u: &[Node<R>], d: &mut [Node<R>]);
    /// Displacements u -> each element's Cauchy stress, the mean over its volume at rest.
    fn cauchy(&self, part: Part<R>, u: &[Node<R>], out: &mut [[R; 9]]);
    /// Displacements u and velocities v -> each element's dissipation potential; 0 where the law has none.
    fn dissipation(&self, part: Part<R>, u_v: [&[Node<R>]; 2], out: &mut [R]);
    /// Displacements u and velocities v -> nodal damping forces, added to f; none where the law has no dissipation.
    fn damping(&self, part: Part<R>, u_v: [&[Node<R>]; 2], f: &mut [Node<R>]);
    /// The differentials of [`Compute::damping`] where the velocities change by dv, added to df.
    fn ddamping(&self, part: Part<R>, u_v_dv: [&[Node<R>]; 3], df: &mut [Node<R>]);
    /// The diagonal of minus that differential, added to d.
    fn damping_diagonal(&self, part: Part<R>, u_v: [&[Node<R>]; 2], d: &mut [Node<R>]);
}

/// A law on an element.
pub fn compose<R: Precision>(engine: Engine, element: &ElementEntry, law: &LawEntry) -> Box<dyn Compute<R>> {
    match engine.registers() {
        Registers::Scalar => Box::new(Composed::<R>::new(element, law)),
        #[cfg(target_arch = "x86_64")]
        Registers::Avx2(_) => Box::new(Composed::<R::Avx2>::new(element, law)),
        #[cfg(target_arch = "x86_64")]
        Registers::Avx512(_) => Box::new(Composed::<R::Avx512>::new(element, law)),
    }
}

/// A law on an element, on some lanes.
struct Composed<V: Lanes> {
    info: &'static ElementInfo,
    element: ElementKernels<V>,
    law: PointKernels<V>,
    damping: Option<DampingPointKernels<V>>,
    table: Table<V>,
    multiply: MultiplyKernel<V>,
    /// Numbers stored of a point's state.
    stored: usize,
}

impl<V: Tabled> Composed<V> {
    fn new(element: &ElementEntry, law: &LawEntry) -> Self {
        Self {
            info: element.info,
            element: V::element(&element.kernels),
            law: V::law(&law.kernels),
            damping: law.damping.as_ref().map(|damping| V::damping(&damping.kernels)),
            table: Table::new(element.info),
            multiply: V::multiply(),
            stored: law.info.stored,
        }
    }

    /// Numbers stored of a block's state.
    fn of_block(&self) -> usize {
        self.stored * self.info.points.len() * V::COUNT
    }

    /// Blocks that are computed at once.
    fn group(&self) -> usize {
        let blocks = (BYTES / (9 * V::COUNT * size_of::<V::Scalar>() * self.info.points.len())).max(1);
        // Whole strips.
        if self.info.is_linear_simplex { (blocks / MEMBERS).max(1) * MEMBERS } else { blocks }
    }

    /// Room for a tensor at each point of a group, and so many more.
    fn tensors<const N: usize>(&self) -> [Vec<[V; 9]>; N] {
        let points = self.group() * self.info.points.len();
        std::array::from_fn(|_| vec![[V::from_f64(0.0); 9]; points])
    }

    /// The gradients of some vectors.
    fn gradients<const N: usize>(
        &self,
        elements: &Elements<V>,
        vectors: [&[Node<V::Scalar>]; N],
        out: &mut [Vec<[V; 9]>; N],
    ) {
        // Two at once, where there are two.
        for (vectors, out) in vectors.chunks(2).zip(out.chunks_mut(2)) {
            match (vectors, out) {
                ([u, v], [g, rate]) => (self.element.gradients)(elements, [u, v], [g, rate]),
                ([u], [g]) => (self.element.gradient)(elements, [u], [g]),
                _ => unreachable!("as many gradients as vectors"),
            }
        }
    }

    /// Calls for each group of blocks, with how many elements are before it.
    fn groups(&self, part: Part<V::Scalar>, mut call: impl FnMut(usize, Elements<V>, Material<V>)) {
        let blocks = part.blocks;
        let (group, count, points) = (self.group(), blocks.constants(), self.info.points.len());
        let sets = if blocks.per_element() { group.min(part.len()) } else { 1 };
        let mut constants = vec![V::from_f64(0.0); sets * count];
        let stride = if blocks.per_element() { count } else { 0 };
        for Range { before, first, count: here, row, are_strips } in part.ranges(group) {
            if blocks.per_element() || before == 0 {
                blocks.load_constants(first, &mut constants[..here.min(sets) * count]);
            }
            let material = Material { constants: &constants, stride, count, points };
            let table = &self.table;
            call(before * V::COUNT, Elements { blocks, first, count: here, row, are_strips, table }, material);
        }
    }

    /// What a law makes of some gradients, contracted to the nodes.
    fn contracted<const N: usize>(
        &self,
        part: Part<V::Scalar>,
        vectors: [&[Node<V::Scalar>]; N],
        f: &mut [Node<V::Scalar>],
        law: impl Fn(&Material<V>, [&[[V; 9]]; N], &mut [[V; 9]]) -> Outside,
    ) -> Outside {
        let mut gradients = self.tensors::<N>();
        let [mut stress] = self.tensors::<1>();
        let mut outside = None;
        self.groups(part, |before, elements, material| {
            let points = elements.count * material.points;
            self.gradients(&elements, vectors, &mut gradients);
            let stress = &mut stress[..points];
            let here = law(&material, gradients.each_ref().map(|g| &g[..points]), stress);
            (self.element.contract)(&elements, stress, f);
            outside = outside.or(here.map(|e| before + e));
        });
        outside
    }

    /// What a law makes of some gradients, and those of the nodes' functions, integrated at the nodes.
    fn at_nodes<const N: usize>(
        &self,
        part: Part<V::Scalar>,
        vectors: [&[Node<V::Scalar>]; N],
        d: &mut [Node<V::Scalar>],
        law: impl Fn(&Material<V>, [&[[V; 9]]; N], &mut [[V; 3]]),
    ) {
        let mut gradients = self.tensors::<N>();
        let mut at_points = vec![[V::from_f64(0.0); 3]; self.group() * self.info.points.len() * self.info.nodes];
        self.groups(part, |_, elements, material| {
            let points = elements.count * material.points;
            self.gradients(&elements, vectors, &mut gradients);
            let at_points = &mut at_points[..points * self.info.nodes];
            (self.element.node_gradients)(&elements, at_points);
            law(&material, gradients.each_ref().map(|g| &g[..points]), at_points);
            (self.element.integrate_nodes)(&elements, at_points, d);
        });
    }

    /// The integral over each element of what a law makes of some gradients.
    fn integrated<const N: usize>(
        &self,
        part: Part<V::Scalar>,
        vectors: [&[Node<V::Scalar>]; N],
        out: &mut [V::Scalar],
        law: impl Fn(&Material<V>, [&[[V; 9]]; N], &mut [V]) -> Outside,
    ) -> Outside {
        let mut gradients = self.tensors::<N>();
        let mut densities = vec![V::from_f64(0.0); self.group() * self.info.points.len()];
        let mut integrals = vec![V::from_f64(0.0); self.group()];
        let mut outside = None;
        self.groups(part, |before, elements, material| {
            let points = elements.count * material.points;
            self.gradients(&elements, vectors, &mut gradients);
            let here = law(&material, gradients.each_ref().map(|g| &g[..points]), &mut densities[..points]);
            (self.element.integrate)(&elements, &densities, &mut integrals);
            outside = outside.or(here.map(|e| before + e));
            let mut all = vec![V::Scalar::default(); V::COUNT];
            for (out, integral) in out[before..].chunks_mut(V::COUNT).zip(&integrals[..elements.count]) {
                integral.store(&mut all);
                out.copy_from_slice(&all[..out.len()]);
            }
        });
        outside
    }
}

impl<V: Tabled> Compute<V::Scalar> for Composed<V> {
    fn lanes(&self) -> usize {
        V::COUNT
    }

    fn energy(&self, part: Part<V::Scalar>, u: &[Node<V::Scalar>], out: &mut [V::Scalar]) -> Outside {
        self.integrated(part, [u], out, |material, [g], out| (self.law.energy)(material, g, out))
    }

    fn force(&self, part: Part<V::Scalar>, u: &[Node<V::Scalar>], f: &mut [Node<V::Scalar>]) -> Outside {
        self.contracted(part, [u], f, |material, [g], out| (self.law.force)(material, g, out))
    }

    fn dforce(&self, part: Part<V::Scalar>, u_du: [&[Node<V::Scalar>]; 2], df: &mut [Node<V::Scalar>]) {
        self.contracted(part, u_du, df, |material, [g, dg], out| {
            (self.law.dforce)(material, g, dg, out);
            None
        });
    }

    fn stored(&self) -> usize {
        self.stored * self.info.points.len()
    }

    fn states(&self, blocks: &Blocks<V::Scalar>) -> States<V::Scalar> {
        States::new(blocks, self.stored)
    }

    fn linearize(&self, part: Part<V::Scalar>, u: &[Node<V::Scalar>], states: &mut [V::Scalar]) {
        if self.stored == 0 {
            return;
        }
        let [mut g] = self.tensors();
        self.groups(part, |before, elements, material| {
            let points = elements.count * material.points;
            (self.element.gradient)(&elements, [u], [&mut g]);
            let states = &mut states[before / V::COUNT * self.of_block()..][..elements.count * self.of_block()];
            (self.law.linearize)(&material, &g[..points], states);
        });
    }

    fn apply(&self, part: Part<V::Scalar>, states: &[V::Scalar], du: &[Node<V::Scalar>], df: &mut [Node<V::Scalar>]) {
        let [mut dg, mut stress] = self.tensors();
        self.groups(part, |before, elements, material| {
            let points = elements.count * material.points;
            (self.element.gradient)(&elements, [du], [&mut dg]);
            let states = &states[before / V::COUNT * self.of_block()..];
            (self.law.apply)(&material, states, &dg[..points], &mut stress[..points]);
            (self.element.contract)(&elements, &stress, df);
        });
    }

    fn assemble(&self, part: Part<V::Scalar>, u: &[Node<V::Scalar>], places: &[u32], out: &mut [Pair<V::Scalar>]) {
        let ([mut g, mut unit], mut tangents) = (self.tensors(), self.tensors::<9>());
        let mut states = vec![V::Scalar::default(); self.group() * self.of_block()];
        let mut gradients = vec![[V::from_f64(0.0); 3]; self.group() * self.info.points.len() * self.info.nodes];
        let of_block = pairs(self.info.nodes).count() * V::COUNT;
        self.groups(part, |before, elements, material| {
            let points = elements.count * material.points;
            (self.element.gradient)(&elements, [u], [&mut g]);
            (self.law.linearize)(&material, &g[..points], &mut states);
            for (k, tangent) in tangents.iter_mut().enumerate() {
                unit[..points].iter_mut().for_each(|dg| dg[k] = V::from_f64(1.0));
                (self.law.apply)(&material, &states, &unit[..points], &mut tangent[..points]);
                unit[..points].iter_mut().for_each(|dg| dg[k] = V::from_f64(0.0));
            }
            (self.element.node_gradients)(&elements, &mut gradients);
            let places = &places[before / V::COUNT * of_block..][..elements.count * of_block];
            (self.element.assemble)(
                &elements,
                self.info.dimension,
                &tangents.each_ref().map(Vec::as_slice),
                &gradients,
                places,
                out,
            );
        });
    }

    fn multiply(&self, rows: &Rows<V::Scalar>, x: &[Node<V::Scalar>], y: &mut [Node<V::Scalar>]) {
        (self.multiply)(rows, x, y);
    }

    fn diagonal(&self, part: Part<V::Scalar>, u: &[Node<V::Scalar>], d: &mut [Node<V::Scalar>]) {
        self.at_nodes(part, [u], d, |material, [g], out| (self.law.diagonal)(material, g, out));
    }

    fn cauchy(&self, part: Part<V::Scalar>, u: &[Node<V::Scalar>], out: &mut [[V::Scalar; 9]]) {
        let [mut g, mut stress, mut means] = self.tensors();
        self.groups(part, |before, elements, material| {
            let points = elements.count * material.points;
            (self.element.gradient)(&elements, [u], [&mut g]);
            (self.law.cauchy)(&material, &g[..points], &mut stress[..points]);
            (self.element.mean)(&elements, &stress, &mut means);
            let mut all = vec![V::Scalar::default(); V::COUNT];
            for (out, mean) in out[before..].chunks_mut(V::COUNT).zip(&means[..elements.count]) {
                for (k, mean) in mean.iter().enumerate() {
                    mean.store(&mut all);
                    out.iter_mut().zip(&all).for_each(|(out, value)| out[k] = *value);
                }
            }
        });
    }

    fn dissipation(&self, part: Part<V::Scalar>, u_v: [&[Node<V::Scalar>]; 2], out: &mut [V::Scalar]) {
        let Some(damping) = &self.damping else { return out.fill(V::Scalar::default()) };
        self.integrated(part, u_v, out, |material, [g, rate], out| {
            (damping.dissipation)(material, g, rate, out);
            None
        });
    }

    fn damping(&self, part: Part<V::Scalar>, u_v: [&[Node<V::Scalar>]; 2], f: &mut [Node<V::Scalar>]) {
        let Some(damping) = &self.damping else { return };
        self.contracted(part, u_v, f, |material, [g, rate], out| {
            (damping.damping)(material, g, rate, out);
            None
        });
    }

    fn ddamping(&self, part: Part<V::Scalar>, u_v_dv: [&[Node<V::Scalar>]; 3], df: &mut [Node<V::Scalar>]) {
        let Some(damping) = &self.damping else { return };
        self.contracted(part, u_v_dv, df, |material, [g, rate, dg], out| {
            (damping.ddamping)(material, g, rate, dg, out);
            None
        });
    }

    fn damping_diagonal(&self, part: Part<V::Scalar>, u_v: [&[Node<V::Scalar>]; 2], d: &mut [Node<V::Scalar>]) {
        let Some(damping) = &self.damping else { return };
        self.at_nodes(part, u_v, d, |material, [g, rate], out| (damping.diagonal)(material, g, rate, out));
    }
}

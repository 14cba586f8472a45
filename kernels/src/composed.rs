//! Any law composed with any element: gather G at some quadrature points, evaluate the law there, contract.
//!
//! Laws and elements meet through function pointers, a block of points at a time, so that what is compiled is the sum of
//! the two, not the product: a block's G and P stay in the innermost cache.

use crate::damping::DampingEntry;
use crate::element::{ElementInfo, ElementKernels, Elements, RestPoint, Table};
use crate::law::LawEntry;
use crate::point::{DampingPointKernels, Material, PointKernels, PointOutside};
use crate::real::Real;

/// Quadrature points of a block, unless one element has more.
const BLOCK: usize = 64;

/// A precision in which laws and elements have entry points.
pub trait Entry: Real {
    /// A law's kernels.
    fn point_kernels(law: &LawEntry) -> PointKernels<Self>;
    /// A dissipative law's kernels.
    fn damping_point_kernels(damping: &DampingEntry) -> DampingPointKernels<Self>;
    /// An element's kernels.
    fn element_kernels(element: &crate::ElementEntry) -> ElementKernels<Self>;
}

impl Entry for f32 {
    fn point_kernels(law: &LawEntry) -> PointKernels<f32> {
        (law.point_f32)()
    }
    fn damping_point_kernels(damping: &DampingEntry) -> DampingPointKernels<f32> {
        (damping.point_f32)()
    }
    fn element_kernels(element: &crate::ElementEntry) -> ElementKernels<f32> {
        (element.f32)()
    }
}

impl Entry for f64 {
    fn point_kernels(law: &LawEntry) -> PointKernels<f64> {
        (law.point_f64)()
    }
    fn damping_point_kernels(damping: &DampingEntry) -> DampingPointKernels<f64> {
        (damping.point_f64)()
    }
    fn element_kernels(element: &crate::ElementEntry) -> ElementKernels<f64> {
        (element.f64)()
    }
}

/// A law on an element, in one precision.
#[derive(Debug, Clone)]
pub struct Composed<R: Real> {
    info: &'static ElementInfo,
    element: ElementKernels<R>,
    law: PointKernels<R>,
    damping: Option<DampingPointKernels<R>>,
    table: Table<R>,
}

/// Elements of one kind and law, and their material.
#[derive(Debug, Clone, Copy)]
pub struct ComposedBatch<'a, R> {
    /// The nodes of one element after the other, into the displacement array.
    pub nodes: &'a [u32],
    /// The quadrature points of one element after the other.
    pub rest: &'a [RestPoint<R>],
    /// The law's constants: of the one material, or one set after the other, an element each.
    pub constants: &'a [R],
    /// Constants between one element's set and the next: 0 where all elements share one.
    pub stride: usize,
    /// How many constants a set has.
    pub count: usize,
}

impl<R: Entry> Composed<R> {
    /// A law on an element.
    pub fn new(element: &crate::ElementEntry, law: &LawEntry) -> Self {
        Self {
            info: element.info,
            element: R::element_kernels(element),
            law: R::point_kernels(law),
            damping: law.damping.as_ref().map(R::damping_point_kernels),
            table: Table::new(element.info),
        }
    }

    /// The element.
    pub fn info(&self) -> &'static ElementInfo {
        self.info
    }

    /// Displacements u -> each element's strain energy (unit of stress times m^3).
    pub fn energy(&self, batch: &ComposedBatch<R>, u: &[[R; 3]], out: &mut [R]) -> PointOutside {
        let mut densities = self.block(R::from_f64(0.0));
        self.blocks(batch, out, 1, |block, out, g, _| {
            (self.element.gradient)(&block.elements, u, g);
            let densities = &mut densities[..g.len()];
            let outside = (self.law.energy)(&block.material, g, densities);
            self.integrate(&block, densities, out);
            outside
        })
    }

    /// Displacements u -> each element's nodal forces f_j = - integral of P grad Lambda_j, one slot a node.
    pub fn force(&self, batch: &ComposedBatch<R>, u: &[[R; 3]], out: &mut [[R; 3]]) -> PointOutside {
        let mut stress = self.block([R::from_f64(0.0); 9]);
        self.blocks(batch, out, self.info.nodes, |block, out, g, _| {
            (self.element.gradient)(&block.elements, u, g);
            let stress = &mut stress[..g.len()];
            let outside = (self.law.force)(&block.material, g, stress);
            (self.element.contract)(&block.elements, stress, out);
            outside
        })
    }

    /// Displacements u and increments du -> each element's nodal force differentials, one slot a node.
    pub fn dforce(&self, batch: &ComposedBatch<R>, u: &[[R; 3]], du: &[[R; 3]], out: &mut [[R; 3]]) {
        let mut stress = self.block([R::from_f64(0.0); 9]);
        self.blocks(batch, out, self.info.nodes, |block, out, g, dg| {
            (self.element.gradient)(&block.elements, u, g);
            (self.element.gradient)(&block.elements, du, dg);
            let stress = &mut stress[..g.len()];
            (self.law.dforce)(&block.material, g, dg, stress);
            (self.element.contract)(&block.elements, stress, out);
            None
        });
    }

    /// Displacements u -> the diagonal of the tangent stiffness -df/du at each element's nodes.
    pub fn diagonal(&self, batch: &ComposedBatch<R>, u: &[[R; 3]], out: &mut [[R; 3]]) {
        let mut at_points = vec![[R::from_f64(0.0); 3]; self.block_points() * self.info.nodes];
        self.blocks(batch, out, self.info.nodes, |block, out, g, _| {
            (self.element.gradient)(&block.elements, u, g);
            let at_points = &mut at_points[..g.len() * self.info.nodes];
            (self.element.node_gradients)(&block.elements, at_points);
            (self.law.diagonal)(&block.material, g, at_points);
            self.integrate_nodes(&block, at_points, out);
            None
        });
    }

    /// Displacements u -> each element's Cauchy stress, the mean over its volume at rest.
    pub fn cauchy(&self, batch: &ComposedBatch<R>, u: &[[R; 3]], out: &mut [[R; 9]]) {
        let mut stress = self.block([R::from_f64(0.0); 9]);
        self.blocks(batch, out, 1, |block, out, g, _| {
            (self.element.gradient)(&block.elements, u, g);
            let stress = &mut stress[..g.len()];
            (self.law.cauchy)(&block.material, g, stress);
            let points = self.info.points.len();
            let all = stress.chunks_exact(points).zip(block.elements.rest.chunks_exact(points));
            for ((stress, rest), out) in all.zip(out) {
                let volume = rest[1..].iter().fold(rest[0].weight, |sum, r| sum + r.weight);
                *out = std::array::from_fn(|k| {
                    let sum = stress.iter().zip(rest).map(|(s, r)| s[k] * r.weight).reduce(|a, b| a + b);
                    sum.expect("an element has a quadrature point") / volume
                });
            }
            None
        });
    }

    /// Displacements u and velocities v -> each element's dissipation potential; 0 where the law has none.
    pub fn dissipation(&self, batch: &ComposedBatch<R>, [u, v]: [&[[R; 3]]; 2], out: &mut [R]) {
        let Some(damping) = &self.damping else { return out.fill(R::from_f64(0.0)) };
        let mut densities = self.block(R::from_f64(0.0));
        self.blocks(batch, out, 1, |block, out, g, rate| {
            (self.element.gradient)(&block.elements, u, g);
            (self.element.gradient)(&block.elements, v, rate);
            let densities = &mut densities[..g.len()];
            (damping.dissipation)(&block.material, g, rate, densities);
            self.integrate(&block, densities, out);
            None
        });
    }

    /// Displacements u and velocities v -> each element's nodal damping forces, one slot a node; 0 where the law has none.
    pub fn damping(&self, batch: &ComposedBatch<R>, [u, v]: [&[[R; 3]]; 2], out: &mut [[R; 3]]) {
        let Some(damping) = &self.damping else { return out.fill([R::from_f64(0.0); 3]) };
        let mut stress = self.block([R::from_f64(0.0); 9]);
        self.blocks(batch, out, self.info.nodes, |block, out, g, rate| {
            (self.element.gradient)(&block.elements, u, g);
            (self.element.gradient)(&block.elements, v, rate);
            let stress = &mut stress[..g.len()];
            (damping.damping)(&block.material, g, rate, stress);
            (self.element.contract)(&block.elements, stress, out);
            None
        });
    }

    /// The differentials of [`Composed::damping`] where the velocities change by dv.
    pub fn ddamping(&self, batch: &ComposedBatch<R>, [u, v, dv]: [&[[R; 3]]; 3], out: &mut [[R; 3]]) {
        let Some(damping) = &self.damping else { return out.fill([R::from_f64(0.0); 3]) };
        let mut stress = self.block([R::from_f64(0.0); 9]);
        let mut increments = self.block([R::from_f64(0.0); 9]);
        self.blocks(batch, out, self.info.nodes, |block, out, g, rate| {
            (self.element.gradient)(&block.elements, u, g);
            (self.element.gradient)(&block.elements, v, rate);
            let (stress, dg) = (&mut stress[..g.len()], &mut increments[..g.len()]);
            (self.element.gradient)(&block.elements, dv, dg);
            (damping.ddamping)(&block.material, g, rate, dg, stress);
            (self.element.contract)(&block.elements, stress, out);
            None
        });
    }

    /// The diagonal of minus that differential at each element's nodes.
    pub fn damping_diagonal(&self, batch: &ComposedBatch<R>, [u, v]: [&[[R; 3]]; 2], out: &mut [[R; 3]]) {
        let Some(damping) = &self.damping else { return out.fill([R::from_f64(0.0); 3]) };
        let mut at_points = vec![[R::from_f64(0.0); 3]; self.block_points() * self.info.nodes];
        self.blocks(batch, out, self.info.nodes, |block, out, g, rate| {
            (self.element.gradient)(&block.elements, u, g);
            (self.element.gradient)(&block.elements, v, rate);
            let at_points = &mut at_points[..g.len() * self.info.nodes];
            (self.element.node_gradients)(&block.elements, at_points);
            (damping.diagonal)(&block.material, g, rate, at_points);
            self.integrate_nodes(&block, at_points, out);
            None
        });
    }

    /// Elements of a block.
    fn block_elements(&self) -> usize {
        (BLOCK / self.info.points.len()).max(1)
    }

    fn block_points(&self) -> usize {
        self.block_elements() * self.info.points.len()
    }

    /// A value for each point of a block.
    fn block<T: Copy>(&self, zero: T) -> Vec<T> {
        vec![zero; self.block_points()]
    }

    /// Calls for each block of elements, with their part of `out` (`each` entries an element) and room for two gradients a
    /// point; the first element that is outside.
    fn blocks<T>(
        &self,
        batch: &ComposedBatch<R>,
        out: &mut [T],
        each: usize,
        mut call: impl FnMut(Block<R>, &mut [T], &mut [[R; 9]], &mut [[R; 9]]) -> PointOutside,
    ) -> PointOutside {
        let (nodes, points) = (self.info.nodes, self.info.points.len());
        let size = self.block_elements();
        let [mut g, mut dg] = [(); 2].map(|()| self.block([R::from_f64(0.0); 9]));
        let mut outside = None;
        for (k, out) in out.chunks_mut(size * each).enumerate() {
            let (first, count) = (k * size, out.len() / each);
            let elements = Elements {
                nodes: &batch.nodes[first * nodes..][..count * nodes],
                rest: &batch.rest[first * points..][..count * points],
                table: &self.table,
            };
            let constants = &batch.constants[first * batch.stride..];
            let material = Material { constants, stride: batch.stride, count: batch.count, points };
            let here = call(Block { elements, material }, out, &mut g[..count * points], &mut dg[..count * points]);
            outside = outside.or(here.map(|q| first + q / points));
        }
        outside
    }

    /// The integral over each element of a density at its points.
    fn integrate(&self, block: &Block<R>, densities: &[R], out: &mut [R]) {
        let points = self.info.points.len();
        let all = densities.chunks_exact(points).zip(block.elements.rest.chunks_exact(points));
        for ((densities, rest), out) in all.zip(out) {
            let sum = densities.iter().zip(rest).map(|(w, r)| *w * r.weight).reduce(|a, b| a + b);
            *out = sum.expect("an element has a quadrature point");
        }
    }

    /// The integral over each element of what each of its nodes has at the points.
    fn integrate_nodes(&self, block: &Block<R>, at_points: &[[R; 3]], out: &mut [[R; 3]]) {
        let (nodes, points) = (self.info.nodes, self.info.points.len());
        let all = at_points.chunks_exact(nodes * points).zip(block.elements.rest.chunks_exact(points));
        for ((at_points, rest), out) in all.zip(out.chunks_exact_mut(nodes)) {
            out.fill([R::from_f64(0.0); 3]);
            for (values, rest) in at_points.chunks_exact(nodes).zip(rest) {
                for (out, value) in out.iter_mut().zip(values) {
                    *out = std::array::from_fn(|i| out[i] + value[i] * rest.weight);
                }
            }
        }
    }
}

/// Some elements, and their material.
struct Block<'a, R> {
    elements: Elements<'a, R>,
    material: Material<'a, R>,
}

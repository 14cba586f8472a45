//! The kernels of a law on an element: fused for linear tetrahedra, composed for any other.

use tensormass_kernels::batch::Batch;
use tensormass_kernels::{
    BatchKernels, Composed, ComposedBatch, DampingKernels, ElementEntry, ElementInfo, LawEntry, RestPoint,
};

use super::Precision;

/// Some elements, and their material.
#[derive(Clone, Copy)]
pub struct Part<'a, R> {
    /// The nodes of one element after the other.
    pub nodes: &'a [u32],
    /// The quadrature points of one element after the other.
    pub rest: &'a [RestPoint<R>],
    /// The law's constants.
    pub constants: &'a [R],
    /// Constants between one element's set and the next.
    pub stride: usize,
    /// How many constants a set has.
    pub count: usize,
}

impl<'a, R> Part<'a, R> {
    fn fused(&self) -> Batch<'a, R> {
        let Self { nodes, rest, constants, stride, count } = *self;
        Batch { nodes: nodes.as_chunks().0, rest, constants, stride, count }
    }

    fn composed(&self) -> ComposedBatch<'a, R> {
        let Self { nodes, rest, constants, stride, count } = *self;
        ComposedBatch { nodes, rest, constants, stride, count }
    }
}

/// See the module.
pub struct Kernels<R: Precision> {
    info: &'static ElementInfo,
    form: Form<R>,
}

enum Form<R: Precision> {
    Fused(BatchKernels<R>, Option<DampingKernels<R>>),
    Composed(Composed<R>),
}

impl<R: Precision> Kernels<R> {
    /// The kernels of a law on an element.
    pub fn new(element: &ElementEntry, law: &LawEntry) -> Self {
        let form = if element.info.is_linear_simplex {
            Form::Fused(R::kernels(law), R::damping_kernels(law))
        } else {
            Form::Composed(Composed::new(element, law))
        };
        Self { info: element.info, form }
    }

    /// Nodes of an element.
    pub fn nodes(&self) -> usize {
        self.info.nodes
    }

    /// Quadrature points of an element.
    pub fn points(&self) -> usize {
        self.info.points.len()
    }

    /// Each element's strain energy; the first element outside the law's domain.
    pub fn energy(&self, part: &Part<R>, u: &[[R; 3]], out: &mut [R]) -> Option<usize> {
        match &self.form {
            Form::Fused(kernels, _) => (kernels.energy)(&part.fused(), u, out),
            Form::Composed(composed) => composed.energy(&part.composed(), u, out),
        }
    }

    /// Nodal forces, one slot a node; the first element outside the law's domain.
    pub fn force(&self, part: &Part<R>, u: &[[R; 3]], out: &mut [[R; 3]]) -> Option<usize> {
        match &self.form {
            Form::Fused(kernels, _) => (kernels.force)(&part.fused(), u, out.as_chunks_mut().0),
            Form::Composed(composed) => composed.force(&part.composed(), u, out),
        }
    }

    /// Their differentials where u changes by du.
    pub fn dforce(&self, part: &Part<R>, u: &[[R; 3]], du: &[[R; 3]], out: &mut [[R; 3]]) {
        match &self.form {
            Form::Fused(kernels, _) => (kernels.dforce)(&part.fused(), u, du, out.as_chunks_mut().0),
            Form::Composed(composed) => composed.dforce(&part.composed(), u, du, out),
        }
    }

    /// The diagonal of the tangent stiffness.
    pub fn diagonal(&self, part: &Part<R>, u: &[[R; 3]], out: &mut [[R; 3]]) {
        match &self.form {
            Form::Fused(kernels, _) => {
                (kernels.diagonal)(&part.fused(), u, out.as_chunks_mut().0);
            }
            Form::Composed(composed) => composed.diagonal(&part.composed(), u, out),
        }
    }

    /// Each element's Cauchy stress, the mean over its volume at rest.
    pub fn cauchy(&self, part: &Part<R>, u: &[[R; 3]], out: &mut [[R; 9]]) {
        match &self.form {
            Form::Fused(kernels, _) => (kernels.cauchy)(&part.fused(), u, out),
            Form::Composed(composed) => composed.cauchy(&part.composed(), u, out),
        }
    }

    /// Damping forces; 0 where the law has no dissipation.
    pub fn damping(&self, part: &Part<R>, [u, v]: [&[[R; 3]]; 2], out: &mut [[R; 3]]) {
        match &self.form {
            Form::Fused(_, Some(kernels)) => (kernels.damping)(&part.fused(), u, v, out.as_chunks_mut().0),
            Form::Fused(_, None) => out.fill([R::default(); 3]),
            Form::Composed(composed) => composed.damping(&part.composed(), [u, v], out),
        }
    }

    /// Their differentials where v changes by dv.
    pub fn ddamping(&self, part: &Part<R>, [u, v, dv]: [&[[R; 3]]; 3], out: &mut [[R; 3]]) {
        match &self.form {
            Form::Fused(_, Some(kernels)) => (kernels.ddamping)(&part.fused(), u, v, dv, out.as_chunks_mut().0),
            Form::Fused(_, None) => out.fill([R::default(); 3]),
            Form::Composed(composed) => composed.ddamping(&part.composed(), [u, v, dv], out),
        }
    }

    /// The diagonal of minus that differential.
    pub fn damping_diagonal(&self, part: &Part<R>, [u, v]: [&[[R; 3]]; 2], out: &mut [[R; 3]]) {
        match &self.form {
            Form::Fused(_, Some(kernels)) => (kernels.diagonal)(&part.fused(), u, v, out.as_chunks_mut().0),
            Form::Fused(_, None) => out.fill([R::default(); 3]),
            Form::Composed(composed) => composed.damping_diagonal(&part.composed(), [u, v], out),
        }
    }
}

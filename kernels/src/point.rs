//! A law's point kernels over a range of quadrature points, whatever element these are of.

use crate::aligned::prefetch;
use crate::damping::Dissipative;
use crate::lanes::Lanes;
use crate::law::Law;

/// The constants of a material at a range of quadrature points.
#[derive(Debug, Clone, Copy)]
pub struct Material<'a, V> {
    /// The law's constants: one set, or one set after the other.
    pub constants: &'a [V],
    /// Constants between one element's set and the next: 0 where all share one.
    pub stride: usize,
    /// How many constants a set has.
    pub count: usize,
    /// Quadrature points of an element.
    pub points: usize,
}

impl<'a, V> Material<'a, V> {
    #[inline(always)]
    fn at(&self, point: usize) -> &'a [V] {
        &self.constants[point / self.points * self.stride..][..self.count]
    }
}

/// A tensor of nine components at each point, row by row.
pub type Tensors<V> = [[V; 9]];
/// Vectors at each point, those of one point after the other.
pub type Vectors<V> = [[V; 3]];
/// The first element that has left the law's domain, if any.
pub type Outside = Option<usize>;

/// From one tensor a point to another.
pub type TensorKernel<V> = fn(&Material<V>, &Tensors<V>, &mut Tensors<V>);
/// From one tensor a point to another, which may lie outside the law's domain.
pub type BoundedKernel<V> = fn(&Material<V>, &Tensors<V>, &mut Tensors<V>) -> Outside;
/// From two tensors a point to a third.
pub type TensorsKernel<V> = fn(&Material<V>, &Tensors<V>, &Tensors<V>, &mut Tensors<V>);
/// From a tensor a point to what is stored of the state there: numbers of one point after the other, lane by lane.
pub type StateKernel<V> = fn(&Material<V>, &Tensors<V>, &mut [<V as Lanes>::Scalar]);
/// From what is stored and a tensor a point to another.
pub type ApplyKernel<V> = fn(&Material<V>, &[<V as Lanes>::Scalar], &Tensors<V>, &mut Tensors<V>);
/// From three tensors a point to a fourth.
pub type ThreeTensorsKernel<V> = fn(&Material<V>, &Tensors<V>, &Tensors<V>, &Tensors<V>, &mut Tensors<V>);
/// From two tensors a point to a density.
pub type DensityKernel<V> = fn(&Material<V>, &Tensors<V>, &Tensors<V>, &mut [V]);
/// From a tensor and the gradients of the nodes' functions a point to the diagonals at the nodes, in their place.
pub type DiagonalKernel<V> = fn(&Material<V>, &Tensors<V>, &mut Vectors<V>);
/// As [`DiagonalKernel`], from two tensors a point.
pub type DampingDiagonalKernel<V> = fn(&Material<V>, &Tensors<V>, &Tensors<V>, &mut Vectors<V>);

/// A law's kernels at quadrature points on some lanes; arrays have one entry a point.
#[derive(Debug, Clone, Copy)]
pub struct PointKernels<V: Lanes> {
    /// G -> W.
    pub energy: fn(&Material<V>, &Tensors<V>, &mut [V]) -> Outside,
    /// G -> P.
    pub force: BoundedKernel<V>,
    /// G, dG -> dP.
    pub dforce: TensorsKernel<V>,
    /// G -> what of the tangent is stored.
    pub linearize: StateKernel<V>,
    /// What is stored, dG -> dP.
    pub apply: ApplyKernel<V>,
    /// G, and the gradients of the functions of each node -> the diagonal at each node.
    pub diagonal: DiagonalKernel<V>,
    /// G -> the Cauchy stress.
    pub cauchy: TensorKernel<V>,
}

/// A dissipative law's kernels at quadrature points on some lanes; the second array is the rate of G.
#[derive(Debug, Clone, Copy)]
pub struct DampingPointKernels<V> {
    /// D, the dissipation density.
    pub dissipation: DensityKernel<V>,
    /// The stress of damping.
    pub damping: TensorsKernel<V>,
    /// Its differential, where the rate changes as the third array gives.
    pub ddamping: ThreeTensorsKernel<V>,
    /// As [`PointKernels::diagonal`].
    pub diagonal: DampingDiagonalKernel<V>,
}

/// The first of the elements outside so far and those of a point whose margin is given.
#[inline(always)]
fn first<V: Lanes>(outside: Outside, element: usize, margin: V) -> Outside {
    if margin.is_positive() {
        return outside;
    }
    let here = element * V::COUNT + margin.first_not_positive();
    Some(outside.map_or(here, |before| before.min(here)))
}

#[inline(always)]
pub(crate) fn energy<L: Law, V: Lanes>(material: &Material<V>, g: &[[V; 9]], out: &mut [V]) -> Outside {
    let mut outside = None;
    for (q, (g, out)) in g.iter().zip(out).enumerate() {
        let (w, margin) = L::energy(material.at(q), g);
        *out = w;
        outside = first(outside, q / material.points, margin);
    }
    outside
}

#[inline(always)]
pub(crate) fn force<L: Law, V: Lanes>(material: &Material<V>, g: &[[V; 9]], out: &mut [[V; 9]]) -> Outside {
    let mut outside = None;
    for (q, (g, out)) in g.iter().zip(out).enumerate() {
        let (p, margin) = L::force(material.at(q), g);
        *out = p;
        outside = first(outside, q / material.points, margin);
    }
    outside
}

#[inline(always)]
pub(crate) fn dforce<L: Law, V: Lanes>(material: &Material<V>, g: &[[V; 9]], dg: &[[V; 9]], out: &mut [[V; 9]]) {
    for (q, ((g, dg), out)) in g.iter().zip(dg).zip(out).enumerate() {
        *out = L::dforce(material.at(q), g, dg);
    }
}

#[inline(always)]
pub(crate) fn linearize<L: Law, V: Lanes>(material: &Material<V>, g: &[[V; 9]], out: &mut [V::Scalar]) {
    for (q, g) in g.iter().enumerate() {
        let state = L::linearize(material.at(q), g);
        let stored = state.as_ref().len();
        let here = &mut out[q * stored * V::COUNT..][..stored * V::COUNT];
        for k in 0..stored {
            state.as_ref()[k].store(&mut here[k * V::COUNT..]);
        }
    }
}

#[inline(always)]
pub(crate) fn apply<L: Law, V: Lanes>(material: &Material<V>, states: &[V::Scalar], dg: &[[V; 9]], out: &mut [[V; 9]]) {
    for (q, (increment, out)) in dg.iter().zip(out).enumerate() {
        let mut state = L::state::<V>();
        let stored = state.as_ref().len();
        let each = stored * V::COUNT;
        let here = &states[q * each..][..each];
        // What the next group of points will read.
        let next = ((q + dg.len()) * each).min(states.len());
        prefetch(&states[next..(next + each).min(states.len())]);
        for k in 0..stored {
            state.as_mut()[k] = V::load(&here[k * V::COUNT..]);
        }
        *out = L::apply(material.at(q), &state, increment);
    }
}

/// The gradients of the nodes' functions stand in `out`, and their diagonals after it.
#[inline(always)]
pub(crate) fn diagonal<L: Law, V: Lanes>(material: &Material<V>, g: &[[V; 9]], out: &mut [[V; 3]]) {
    let nodes = out.len() / g.len();
    for (q, (g, out)) in g.iter().zip(out.chunks_exact_mut(nodes)).enumerate() {
        for n in out {
            *n = L::diagonal(material.at(q), g, n);
        }
    }
}

#[inline(always)]
pub(crate) fn cauchy<L: Law, V: Lanes>(material: &Material<V>, g: &[[V; 9]], out: &mut [[V; 9]]) {
    for (q, (g, out)) in g.iter().zip(out).enumerate() {
        *out = L::cauchy(material.at(q), g);
    }
}

#[inline(always)]
pub(crate) fn dissipation<L: Dissipative, V: Lanes>(
    material: &Material<V>,
    g: &[[V; 9]],
    rate: &[[V; 9]],
    out: &mut [V],
) {
    for (q, ((g, rate), out)) in g.iter().zip(rate).zip(out).enumerate() {
        *out = L::dissipation(material.at(q), g, rate);
    }
}

#[inline(always)]
pub(crate) fn damping<L: Dissipative, V: Lanes>(
    material: &Material<V>,
    g: &[[V; 9]],
    rate: &[[V; 9]],
    out: &mut [[V; 9]],
) {
    for (q, ((g, rate), out)) in g.iter().zip(rate).zip(out).enumerate() {
        *out = L::damping(material.at(q), g, rate);
    }
}

#[inline(always)]
pub(crate) fn ddamping<L: Dissipative, V: Lanes>(
    material: &Material<V>,
    g: &[[V; 9]],
    rate: &[[V; 9]],
    dg: &[[V; 9]],
    out: &mut [[V; 9]],
) {
    for (q, (((g, rate), dg), out)) in g.iter().zip(rate).zip(dg).zip(out).enumerate() {
        *out = L::ddamping(material.at(q), g, rate, dg);
    }
}

#[inline(always)]
pub(crate) fn damping_diagonal<L: Dissipative, V: Lanes>(
    material: &Material<V>,
    g: &[[V; 9]],
    rate: &[[V; 9]],
    out: &mut [[V; 3]],
) {
    let nodes = out.len() / g.len();
    for (q, ((g, rate), out)) in g.iter().zip(rate).zip(out.chunks_exact_mut(nodes)).enumerate() {
        for n in out {
            *n = L::damping_diagonal(material.at(q), g, rate, n);
        }
    }
}

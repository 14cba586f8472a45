//! What generated elements implement, and how a runtime meets them without knowing their types.
//!
//! A law is evaluated at an element's quadrature points. With X(xi) = sum_j Lambda_j(xi) X_j and J = dX/dxi at a point,
//! grad Lambda_j = J^-T dLambda_j/dxi: the slopes dLambda_j/dxi are a table of the element, J^-1 and the weight are data
//! of the point.

use crate::assembly::AssemblyKernel;
use crate::blocks::Blocks;
use crate::lanes::{Lanes, Node};
use crate::real::Real;
use crate::shader::ElementFunctions;
use crate::strip::{self, MEMBERS, STRIP};
use crate::table::ElementTable;

/// An element, as its file declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementInfo {
    /// Name in scenes and of its file.
    pub name: &'static str,
    /// What it is.
    pub docs: &'static str,
    /// Where its functions are from.
    pub source: &'static str,
    /// Where the reference coordinates run: `tetrahedron`, `hexahedron`, `prism`, `triangle`, `quadrangle` or `segment`, as
    /// the element's file says.
    pub shape: &'static str,
    /// Reference coordinates: 3 of bodies, 2 of bodies in plane strain and of faces, 1 of edges.
    pub dimension: usize,
    /// Polynomials up to this order are reproduced.
    pub order: u32,
    /// Number of nodes.
    pub nodes: usize,
    /// Reference coordinates of the nodes.
    pub reference: &'static [[f64; 3]],
    /// Whether the rows of J^-1 are the gradients of nodes 1, 2, 3: it is the linear tetrahedron.
    pub is_linear_simplex: bool,
    /// The quadrature points.
    pub points: &'static [ReferencePoint],
    /// The interpolation functions Lambda_j.
    pub functions: &'static [&'static [Term]],
    /// Reference coordinates and weights of a rule by which products of two functions are integrated exactly.
    pub mass_rule: &'static [([f64; 3], f64)],
    /// Each node's part of a lumped mass: positive, and 1 in all.
    pub lumping: &'static [f64],
    /// VTK's cell type, and the node that stands at each of its places.
    pub vtk: Numbering,
    /// Gmsh's element type, and the node that stands at each of its places.
    pub gmsh: Numbering,
    /// Its faces, with normals outwards by the right-hand rule; of a plane element its edges, counter-clockwise.
    pub faces: &'static [Face],
    /// Additions, multiplications and divisions of G at one point.
    pub gradient_operations: u32,
    /// Additions, multiplications and divisions of the contraction at one point.
    pub contract_operations: u32,
}

/// A term of a polynomial: its coefficient times powers of the reference coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// The coefficient.
    pub coefficient: f64,
    /// The powers.
    pub exponents: [u32; 3],
}

impl ElementInfo {
    /// Lambda_j and dLambda_j/dxi of each node at reference coordinates.
    pub fn functions_at(&self, xi: [f64; 3]) -> (Vec<f64>, Vec<[f64; 3]>) {
        let power = |k: usize, n: u32| xi[k].powi(n as i32);
        let value = |t: &Term| (0..3).fold(t.coefficient, |product, k| product * power(k, t.exponents[k]));
        let slope = |t: &Term, by: usize| match t.exponents[by] {
            0 => 0.0,
            n => (0..3).fold(t.coefficient * f64::from(n), |product, k| {
                product * power(k, if k == by { n - 1 } else { t.exponents[k] })
            }),
        };
        let sum = |f: &[Term], of: &dyn Fn(&Term) -> f64| f.iter().map(of).sum::<f64>();
        let values = self.functions.iter().map(|f| sum(f, &value)).collect();
        let slopes = self.functions.iter().map(|f| std::array::from_fn(|by| sum(f, &|t| slope(t, by)))).collect();
        (values, slopes)
    }
}

/// A quadrature point of an element.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferencePoint {
    /// Its weight; they sum to the measure of the reference shape.
    pub weight: f64,
    /// Lambda_j there.
    pub functions: &'static [f64],
    /// dLambda_j/dxi there.
    pub gradients: &'static [[f64; 3]],
}

/// An element type of another program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Numbering {
    /// Its number there.
    pub kind: u32,
    /// The node that stands at each place.
    pub order: &'static [usize],
}

/// A face of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Face {
    /// The element that it is.
    pub element: &'static str,
    /// Its nodes among those of the whole.
    pub nodes: &'static [usize],
}

/// A quadrature point of an element at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestPoint<R> {
    /// J^-1 = dxi/dX, row by row: component 3 a + k is dxi_a/dX_k (1/m). Of a linear tetrahedron the rows are the gradients
    /// of the interpolation functions of nodes 1, 2, 3.
    pub inverse_jacobian: [R; 9],
    /// det J times the weight of the quadrature (m^3): the volume of an element with one point.
    pub weight: R,
}

/// Kernels generated from an element's interpolation functions.
pub trait Element: Send + Sync + 'static {
    /// A vector at each node.
    type Nodal<R: Real>: AsRef<[[R; 3]]> + AsMut<[[R; 3]]> + Copy;
    /// What the element is.
    fn info() -> &'static ElementInfo;
    /// Minus zero in every component at each node: a sum that begins with it is that of what is added, bit for bit, so that
    /// compilers need not add it.
    fn nodal<R: Real>() -> Self::Nodal<R>;
    /// G = sum_j u_j (x) grad Lambda_j; `slopes` as [`Table`] has them.
    fn gradient<R: Real>(u: &Self::Nodal<R>, slopes: &[R], inverse_jacobian: &[R; 9]) -> [R; 9];
    /// Adds -w P grad Lambda_j to the force of each node.
    fn contract<R: Real>(
        stress: &[R; 9],
        slopes: &[R],
        inverse_jacobian: &[R; 9],
        weight: R,
        forces: &mut Self::Nodal<R>,
    );
    /// grad Lambda_j of each node.
    fn node_gradients<R: Real>(slopes: &[R], inverse_jacobian: &[R; 9]) -> Self::Nodal<R>;
}

/// An element's slopes on some lanes: point by point those of each node but the first, as many as the element has
/// dimensions.
#[derive(Debug, Clone, PartialEq)]
pub struct Table<V> {
    slopes: Vec<V>,
    points: usize,
}

impl<V: Real> Table<V> {
    /// The table of an element.
    pub fn new(info: &ElementInfo) -> Self {
        let of = |point: &ReferencePoint| {
            let nodes = point.gradients[1..].to_vec();
            nodes.into_iter().flat_map(|g| g.into_iter().take(info.dimension))
        };
        Self { slopes: info.points.iter().flat_map(of).map(V::from_f64).collect(), points: info.points.len() }
    }

    #[inline(always)]
    pub(crate) fn point(&self, q: usize) -> &[V] {
        let len = self.slopes.len() / self.points;
        &self.slopes[q * len..][..len]
    }
}

/// Elements of one kind: a range of blocks.
#[derive(Debug, Clone, Copy)]
pub struct Elements<'a, V: Lanes> {
    /// The blocks that the range is of.
    pub(crate) blocks: &'a Blocks<V::Scalar>,
    /// The first block.
    pub(crate) first: usize,
    /// How many blocks.
    pub(crate) count: usize,
    /// The first row of their places.
    pub(crate) row: usize,
    /// Whether each three blocks are strips.
    pub(crate) are_strips: bool,
    /// The element's table.
    pub(crate) table: &'a Table<V>,
}

impl<V: Lanes> Elements<'_, V> {
    /// The row of places of a node of a block's elements.
    #[inline(always)]
    fn row(&self, block: usize, node: usize) -> usize {
        match self.are_strips {
            true => self.strip_row(block) + STRIP[block % MEMBERS][node],
            false => self.row + block * self.blocks.nodes() + node,
        }
    }

    /// The first row of places of the strips that a block is of.
    #[inline(always)]
    pub(crate) fn strip_row(&self, block: usize) -> usize {
        self.row + block / MEMBERS * strip::NODES
    }

    /// Asks for what a block of the next range has at rest.
    #[inline(always)]
    pub(crate) fn prefetch_rest(&self, block: usize) {
        self.blocks.prefetch(self.first + self.count + block);
    }

    /// Asks for the places of a block of the next range.
    #[inline(always)]
    pub(crate) fn prefetch_places(&self, block: usize) {
        let next = self.count + block;
        match self.are_strips {
            true => self.blocks.prefetch_places(self.strip_row(next), strip::NODES),
            false => self.blocks.prefetch_places(self.row(next, 0), self.blocks.nodes()),
        }
    }
}

/// Nodal vectors, N of them -> their gradients at each quadrature point.
pub(crate) type GradientKernel<V, const N: usize> =
    fn(&Elements<V>, [&[Node<<V as Lanes>::Scalar>]; N], [&mut [[V; 9]]; N]);
/// A stress at each quadrature point -> nodal forces, added to the nodes.
pub(crate) type ContractKernel<V> = fn(&Elements<V>, &[[V; 9]], &mut [Node<<V as Lanes>::Scalar>]);
/// The gradient of each node's function at each quadrature point.
pub(crate) type NodeGradientKernel<V> = fn(&Elements<V>, &mut [[V; 3]]);

/// Values that each node has at the quadrature points -> their integrals over the elements, added to the nodes.
pub(crate) type NodeIntegralKernel<V> = fn(&Elements<V>, &[[V; 3]], &mut [Node<<V as Lanes>::Scalar>]);
/// A tensor at each quadrature point -> its mean over each element's volume.
pub(crate) type MeanKernel<V> = fn(&Elements<V>, &[[V; 9]], &mut [[V; 9]]);

/// An element's kernels over a range of blocks, on some lanes.
#[derive(Debug, Clone, Copy)]
pub struct ElementKernels<V: Lanes> {
    /// G at each quadrature point.
    pub(crate) gradient: GradientKernel<V, 1>,
    /// As [`Self::gradient`] of two vectors, whose elements are read once.
    pub(crate) gradients: GradientKernel<V, 2>,
    /// Nodal forces.
    pub(crate) contract: ContractKernel<V>,
    /// Gradients of the functions.
    pub(crate) node_gradients: NodeGradientKernel<V>,
    /// The integral over each element of what each of its nodes has at the points, added to the nodes.
    pub(crate) integrate_nodes: NodeIntegralKernel<V>,
    /// The integral over each element of a density.
    pub(crate) integrate: fn(&Elements<V>, &[V], &mut [V]),
    /// The mean over each element's volume of a tensor.
    pub(crate) mean: MeanKernel<V>,
    /// Blocks of the tangent.
    pub(crate) assemble: AssemblyKernel<V>,
}

/// An element of this build.
#[derive(Debug, Clone, Copy)]
pub struct ElementEntry {
    /// What it is.
    pub info: &'static ElementInfo,
    /// Its kernels on all lanes.
    pub(crate) kernels: ElementTable,
    /// Its kernels as WGSL, in single precision.
    pub functions: &'static ElementFunctions,
}

impl ElementEntry {
    /// The entry of an element.
    pub const fn new<E: Element>(info: &'static ElementInfo, functions: &'static ElementFunctions) -> Self {
        Self { info, kernels: ElementTable::of::<E>(), functions }
    }
}

/// See [`ElementKernels::gradient`].
#[inline(always)]
pub(crate) fn gradient<E: Element, V: Lanes>(
    elements: &Elements<V>,
    u: [&[Node<V::Scalar>]; 1],
    out: [&mut [[V; 9]]; 1],
) {
    gradients_of::<E, V, 1>(elements, u, out);
}

/// See [`ElementKernels::gradients`].
#[inline(always)]
pub(crate) fn gradients<E: Element, V: Lanes>(
    elements: &Elements<V>,
    u: [&[Node<V::Scalar>]; 2],
    out: [&mut [[V; 9]]; 2],
) {
    gradients_of::<E, V, 2>(elements, u, out);
}

#[inline(always)]
fn gradients_of<E: Element, V: Lanes, const N: usize>(
    elements: &Elements<V>,
    vectors: [&[Node<V::Scalar>]; N],
    mut out: [&mut [[V; 9]]; N],
) {
    if elements.are_strips && E::info().is_linear_simplex {
        return strip::gradients_of::<E, V, N>(elements, vectors, &mut out);
    }
    let points = E::info().points.len();
    let Elements { blocks, first, count, table, .. } = *elements;
    for block in 0..count {
        elements.prefetch_rest(block);
        elements.prefetch_places(block);
        // One vector after the other: of two at once there are more numbers than registers.
        for (vector, out) in vectors.iter().zip(&mut out) {
            let mut nodal = E::nodal();
            for (node, vector_at_node) in nodal.as_mut().iter_mut().enumerate() {
                *vector_at_node = blocks.gather(vector, elements.row(block, node));
            }
            for q in 0..points {
                let (inverse_jacobian, _) = blocks.rest::<V>(first + block, q);
                out[block * points + q] = E::gradient(&nodal, table.point(q), &inverse_jacobian);
            }
        }
    }
}

/// See [`ContractKernel`].
#[inline(always)]
pub(crate) fn contract<E: Element, V: Lanes>(elements: &Elements<V>, stress: &[[V; 9]], f: &mut [Node<V::Scalar>]) {
    if elements.are_strips && E::info().is_linear_simplex {
        return strip::contract::<E, V>(elements, stress, f);
    }
    let points = E::info().points.len();
    let Elements { blocks, first, count, table, .. } = *elements;
    for block in 0..count {
        let mut forces = E::nodal();
        for q in 0..points {
            let (inverse_jacobian, weight) = blocks.rest::<V>(first + block, q);
            let stress = &stress[block * points + q];
            E::contract(stress, table.point(q), &inverse_jacobian, weight, &mut forces);
        }
        for (node, force) in forces.as_ref().iter().enumerate() {
            blocks.scatter(*force, f, elements.row(block, node));
        }
    }
}

/// See [`NodeGradientKernel`].
#[inline(always)]
pub(crate) fn node_gradients<E: Element, V: Lanes>(elements: &Elements<V>, out: &mut [[V; 3]]) {
    let info = E::info();
    let points = info.points.len();
    let Elements { blocks, first, count, table, .. } = *elements;
    for (k, out) in out.chunks_exact_mut(info.nodes).take(count * points).enumerate() {
        let (inverse_jacobian, _) = blocks.rest::<V>(first + k / points, k % points);
        out.copy_from_slice(E::node_gradients(table.point(k % points), &inverse_jacobian).as_ref());
    }
}

/// See [`ElementKernels::integrate_nodes`].
#[inline(always)]
pub(crate) fn integrate_nodes<V: Lanes>(elements: &Elements<V>, at_points: &[[V; 3]], f: &mut [Node<V::Scalar>]) {
    let Elements { blocks, first, count, .. } = *elements;
    let (nodes, points) = (blocks.nodes(), blocks.points());
    for block in 0..count {
        for node in 0..nodes {
            let mut sum = [V::from_f64(0.0); 3];
            for q in 0..points {
                let (_, weight) = blocks.rest::<V>(first + block, q);
                let value = &at_points[(block * points + q) * nodes + node];
                for i in 0..3 {
                    sum[i] = sum[i] + value[i] * weight;
                }
            }
            blocks.scatter(sum, f, elements.row(block, node));
        }
    }
}

/// See [`ElementKernels::integrate`].
#[inline(always)]
pub(crate) fn integrate<V: Lanes>(elements: &Elements<V>, densities: &[V], out: &mut [V]) {
    let Elements { blocks, first, count, .. } = *elements;
    let points = blocks.points();
    for block in 0..count {
        let mut sum = V::from_f64(0.0);
        for q in 0..points {
            sum = sum + densities[block * points + q] * blocks.rest::<V>(first + block, q).1;
        }
        out[block] = sum;
    }
}

/// See [`ElementKernels::mean`].
#[inline(always)]
pub(crate) fn mean<V: Lanes>(elements: &Elements<V>, tensors: &[[V; 9]], out: &mut [[V; 9]]) {
    let Elements { blocks, first, count, .. } = *elements;
    let points = blocks.points();
    for block in 0..count {
        let (mut sum, mut volume) = ([V::from_f64(0.0); 9], V::from_f64(0.0));
        for q in 0..points {
            let (_, weight) = blocks.rest::<V>(first + block, q);
            volume = volume + weight;
            for k in 0..9 {
                sum[k] = sum[k] + tensors[block * points + q][k] * weight;
            }
        }
        for k in 0..9 {
            out[block][k] = sum[k] / volume;
        }
    }
}

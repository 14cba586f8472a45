//! What generated elements implement, and how a runtime meets them without knowing their types.
//!
//! A law is evaluated at an element's quadrature points. With X(xi) = sum_j Lambda_j(xi) X_j and J = dX/dxi at a point,
//! grad Lambda_j = J^-T dLambda_j/dxi: the slopes dLambda_j/dxi are a table of the element, J^-1 and the weight are data
//! of the point.

use crate::real::Real;
use crate::shader::ElementFunctions;

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
    /// Whether the rows of J^-1 are the gradients of nodes 1, 2, 3: the fused kernels of [`crate::batch`] compute it.
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
    /// The zero vector at each node.
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

/// An element's slopes in one precision: point by point those of each node but the first, as many as the element has
/// dimensions.
#[derive(Debug, Clone, PartialEq)]
pub struct Table<R> {
    slopes: Vec<R>,
    points: usize,
}

impl<R: Real> Table<R> {
    /// The table of an element.
    pub fn new(info: &ElementInfo) -> Self {
        let of = |point: &ReferencePoint| {
            let nodes = point.gradients[1..].to_vec();
            nodes.into_iter().flat_map(|g| g.into_iter().take(info.dimension))
        };
        Self { slopes: info.points.iter().flat_map(of).map(R::from_f64).collect(), points: info.points.len() }
    }

    fn point(&self, q: usize) -> &[R] {
        let len = self.slopes.len() / self.points;
        &self.slopes[q * len..][..len]
    }
}

/// Elements of one kind.
#[derive(Debug, Clone, Copy)]
pub struct Elements<'a, R> {
    /// The nodes of one element after the other, into the displacement array.
    pub nodes: &'a [u32],
    /// The quadrature points of one element after the other.
    pub rest: &'a [RestPoint<R>],
    /// The element's table.
    pub table: &'a Table<R>,
}

/// Nodal vectors -> their gradients at each quadrature point.
pub type GradientKernel<R> = fn(&Elements<R>, &[[R; 3]], &mut [[R; 9]]);
/// A stress at each quadrature point -> nodal forces, one slot a node.
pub type ContractKernel<R> = fn(&Elements<R>, &[[R; 9]], &mut [[R; 3]]);
/// The gradient of each node's function at each quadrature point.
pub type NodeGradientKernel<R> = fn(&Elements<R>, &mut [[R; 3]]);

/// An element's kernels over a range of elements, in one precision.
#[derive(Debug, Clone, Copy)]
pub struct ElementKernels<R> {
    /// G at each quadrature point.
    pub gradient: GradientKernel<R>,
    /// Nodal forces.
    pub contract: ContractKernel<R>,
    /// Gradients of the functions.
    pub node_gradients: NodeGradientKernel<R>,
}

impl<R: Real> ElementKernels<R> {
    /// The kernels of an element.
    pub fn of<E: Element>() -> Self {
        Self { gradient: gradient::<E, R>, contract: contract::<E, R>, node_gradients: node_gradients::<E, R> }
    }
}

/// An element of this build.
#[derive(Debug, Clone, Copy)]
pub struct ElementEntry {
    /// What it is.
    pub info: &'static ElementInfo,
    /// Its kernels in single precision.
    pub f32: fn() -> ElementKernels<f32>,
    /// Its kernels in double precision.
    pub f64: fn() -> ElementKernels<f64>,
    /// Its kernels as WGSL, in single precision.
    pub functions: &'static ElementFunctions,
}

impl ElementEntry {
    /// The entry of an element.
    pub const fn new<E: Element>(info: &'static ElementInfo, functions: &'static ElementFunctions) -> Self {
        Self { info, f32: ElementKernels::<f32>::of::<E>, f64: ElementKernels::<f64>::of::<E>, functions }
    }
}

/// See [`GradientKernel`].
fn gradient<E: Element, R: Real>(elements: &Elements<R>, u: &[[R; 3]], out: &mut [[R; 9]]) {
    let info = E::info();
    let points = info.points.len();
    for ((nodes, rest), out) in elements
        .nodes
        .chunks_exact(info.nodes)
        .zip(elements.rest.chunks_exact(points))
        .zip(out.chunks_exact_mut(points))
    {
        let mut nodal = E::nodal();
        for (to, n) in nodal.as_mut().iter_mut().zip(nodes) {
            *to = u[*n as usize];
        }
        for (q, (rest, out)) in rest.iter().zip(out).enumerate() {
            *out = E::gradient(&nodal, elements.table.point(q), &rest.inverse_jacobian);
        }
    }
}

/// See [`ContractKernel`].
fn contract<E: Element, R: Real>(elements: &Elements<R>, stress: &[[R; 9]], out: &mut [[R; 3]]) {
    let info = E::info();
    let points = info.points.len();
    for ((stress, rest), out) in
        stress.chunks_exact(points).zip(elements.rest.chunks_exact(points)).zip(out.chunks_exact_mut(info.nodes))
    {
        let mut forces = E::nodal();
        for (q, (stress, rest)) in stress.iter().zip(rest).enumerate() {
            E::contract(stress, elements.table.point(q), &rest.inverse_jacobian, rest.weight, &mut forces);
        }
        out.copy_from_slice(forces.as_ref());
    }
}

/// See [`NodeGradientKernel`].
fn node_gradients<E: Element, R: Real>(elements: &Elements<R>, out: &mut [[R; 3]]) {
    let info = E::info();
    let points = info.points.len();
    for (k, (rest, out)) in elements.rest.iter().zip(out.chunks_exact_mut(info.nodes)).enumerate() {
        let gradients = E::node_gradients(elements.table.point(k % points), &rest.inverse_jacobian);
        out.copy_from_slice(gradients.as_ref());
    }
}

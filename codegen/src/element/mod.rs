//! Elements: declared by interpolation functions and a quadrature rule, printed as kernels that know no law.
//!
//! An element is data ([`ElementDeclaration`]). Its kernels gather G = sum_j u_j (x) grad Lambda_j from nodal
//! displacements and contract a stress with the gradients, f_j = -w P grad Lambda_j. Because the functions sum to one,
//! sum_j grad Lambda_j = 0: the gather subtracts the first node's displacement before it multiplies, which keeps the
//! digits of a small strain in a large translation.

mod declaration;
mod polynomial;
mod shape;

use num_traits::Zero;

pub use declaration::{ElementDeclaration, Face, Numbering, Quadrature};
pub use polynomial::Polynomial;
pub use shape::{SHAPES, Shape};

use crate::ir::{Builder, Input, InvalidKernel, KernelIr, Output, Rational, ValidKernel, ValueId};

/// Name and text of each file of `elements/`.
const DECLARATIONS: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/elements.rs"));

/// Why an element's declaration is refused.
#[derive(Debug, thiserror::Error)]
pub enum ElementError {
    /// The declaration is none, or the element is not what it has to be.
    #[error("element `{element}`: {reason}")]
    Declaration {
        /// The element.
        element: String,
        /// What is wrong.
        reason: String,
    },
    /// The gradients are not constant, or there are several quadrature points.
    #[error(
        "element `{0}`: only elements with constant gradients and one quadrature point are supported by this version"
    )]
    NotConstant(String),
    /// A printed kernel breaks a rule: a defect of the generator.
    #[error(transparent)]
    Invalid(#[from] InvalidKernel),
}

/// The kernels of an element.
#[derive(Debug, Clone)]
pub struct ElementKernels {
    /// The element's name.
    pub name: String,
    /// What it is.
    pub docs: String,
    /// Number of nodes.
    pub nodes: u32,
    /// Nodal displacements and shape gradients -> G.
    pub gradient: ValidKernel,
    /// Stress, shape gradients and weight -> nodal forces.
    pub contract: ValidKernel,
    /// Shape gradients -> the gradients of all nodes.
    pub node_gradients: ValidKernel,
    /// Gradients of Lambda_j by the reference coordinates, one row a node.
    pub reference_gradients: Vec<[Rational; 3]>,
}

/// The declarations of this crate, in the order of their names.
///
/// # Errors
/// [`ElementError::Declaration`]: the first that is wrong.
pub fn declarations() -> Result<Vec<ElementDeclaration>, ElementError> {
    let all = DECLARATIONS.iter().map(|(name, text)| ElementDeclaration::parse(name, text));
    let all = all.collect::<Result<Vec<_>, _>>()?;
    all.iter().try_for_each(|element| element.check_faces(&all))?;
    Ok(all)
}

/// The linear tetrahedron.
///
/// # Panics
/// Its declaration is wrong: a test of this crate reads it.
pub fn tetrahedron_p1() -> ElementDeclaration {
    let (name, text) = DECLARATIONS.iter().find(|(name, _)| *name == "tetrahedron_p1").expect("it is declared");
    ElementDeclaration::parse(name, text).expect("its declaration is right")
}

/// Generates the kernels of an element.
///
/// # Errors
/// See [`ElementError`].
pub fn kernels(element: &ElementDeclaration) -> Result<ElementKernels, ElementError> {
    let refuse = || ElementError::NotConstant(element.name.clone());
    if element.quadrature.points.len() != 1 || element.shape.dimension() != 3 {
        return Err(refuse());
    }
    let mut reference_gradients = Vec::new();
    for f in &element.functions {
        let mut row = [Rational::zero(); 3];
        for (k, entry) in row.iter_mut().enumerate() {
            *entry = f.derivative(k).as_constant().ok_or_else(refuse)?;
        }
        reference_gradients.push(row);
    }
    let n = element.functions.len() as u32;
    Ok(ElementKernels {
        name: element.name.clone(),
        docs: element.docs.clone(),
        nodes: n,
        gradient: gradient(n).validate()?,
        contract: contract(n).validate()?,
        node_gradients: node_gradients(n).validate()?,
        reference_gradients,
    })
}

/// Component k of the gradient of node j >= 1.
fn shape(b: &mut Builder, j: u32, k: u32) -> ValueId {
    b.input(Input::ShapeGradients, 3 * (j - 1) + k)
}

/// Minus the sum of vectors of three components, which follow each other.
fn minus_sum(b: &mut Builder, vectors: &[ValueId]) -> Vec<ValueId> {
    (0..3)
        .map(|i| {
            let mut components = vectors.iter().skip(i).step_by(3).copied();
            let first = components.next().expect("an element has more than one node");
            let sum = components.fold(first, |sum, v| b.add(sum, v));
            b.neg(sum)
        })
        .collect()
}

fn gradient(n: u32) -> KernelIr {
    let mut b = Builder::new();
    let mut g = Vec::new();
    for i in 0..3 {
        let first = b.input(Input::NodalDisplacement, i);
        let relative: Vec<ValueId> = (1..n)
            .map(|j| {
                let u = b.input(Input::NodalDisplacement, 3 * j + i);
                b.sub(u, first)
            })
            .collect();
        for k in 0..3 {
            let mut sum = None;
            for (j, &u) in relative.iter().enumerate() {
                let s = shape(&mut b, j as u32 + 1, k);
                let term = b.mul(u, s);
                sum = Some(sum.map_or(term, |t| b.add(t, term)));
            }
            g.push(sum.expect("an element has more than one node"));
        }
    }
    let inputs = vec![(Input::NodalDisplacement, 3 * n), (Input::ShapeGradients, 3 * (n - 1))];
    b.finish("gradient", inputs, vec![(Output::DisplacementGradient, g)])
}

fn contract(n: u32) -> KernelIr {
    let mut b = Builder::new();
    let weight = b.input(Input::Weight, 0);
    let minus = b.neg(weight);
    let p: Vec<ValueId> = (0..9)
        .map(|k| {
            let p = b.input(Input::StressIn, k);
            b.mul(minus, p)
        })
        .collect();
    let mut forces = vec![];
    for j in 1..n {
        for i in 0..3 {
            let mut sum = None;
            for k in 0..3 {
                let s = shape(&mut b, j, k as u32);
                let term = b.mul(p[3 * i + k], s);
                sum = Some(sum.map_or(term, |t| b.add(t, term)));
            }
            forces.push(sum.expect("three terms"));
        }
    }
    // The forces of an element sum to zero: the first node's is minus the others'.
    let first = minus_sum(&mut b, &forces);
    let inputs = vec![(Input::StressIn, 9), (Input::ShapeGradients, 3 * (n - 1)), (Input::Weight, 1)];
    b.finish("contract", inputs, vec![(Output::NodalForce, first.into_iter().chain(forces).collect())])
}

fn node_gradients(n: u32) -> KernelIr {
    let mut b = Builder::new();
    let others: Vec<ValueId> =
        (1..n).flat_map(|j| (0..3).map(move |k| (j, k))).map(|(j, k)| shape(&mut b, j, k)).collect();
    let first = minus_sum(&mut b, &others);
    let inputs = vec![(Input::ShapeGradients, 3 * (n - 1))];
    b.finish("node_gradients", inputs, vec![(Output::NodeGradients, first.into_iter().chain(others).collect())])
}

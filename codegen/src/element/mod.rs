//! Elements: declared by interpolation functions and a quadrature rule, printed as kernels that know no law.
//!
//! An element is data ([`ElementDeclaration`]). Its kernels gather G = sum_j u_j (x) grad Lambda_j from nodal
//! displacements and contract a stress with the gradients, f_j = -w P grad Lambda_j. Because the functions sum to one,
//! sum_j grad Lambda_j = 0: the gather subtracts the first node's displacement before it multiplies, which keeps the
//! digits of a small strain in a large translation.
//!
//! With J = dX/dxi at a quadrature point, grad Lambda_j = J^-T dLambda_j/dxi: the gradients by the reference coordinates xi
//! are a table of the element, J^-1 and the weight det J w are data of each point. Of a simplex with linear functions the
//! rows of J^-1 are the gradients themselves, and one point suffices: its kernels are specialised so. In two dimensions
//! strain is plane: nothing depends on z, and nothing moves along it.

mod declaration;
mod fine;
mod mapped;
mod polynomial;
mod rank;
mod shape;

use num_traits::One;

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
    /// A printed kernel breaks a rule: a defect of the generator.
    #[error(transparent)]
    Invalid(#[from] InvalidKernel),
}

/// The kernels of an element at a quadrature point.
#[derive(Debug, Clone)]
pub struct ElementKernels {
    /// What the element is.
    pub declaration: ElementDeclaration,
    /// Number of nodes.
    pub nodes: u32,
    /// Whether the rows of J^-1 are the gradients of all functions but the first, everywhere: a linear tetrahedron.
    pub is_linear_simplex: bool,
    /// Nodal displacements and gradients -> G.
    pub gradient: ValidKernel,
    /// Stress, gradients and weight -> nodal forces.
    pub contract: ValidKernel,
    /// Gradients -> the gradients of all nodes.
    pub node_gradients: ValidKernel,
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
/// [`ElementError::Invalid`].
pub fn kernels(element: &ElementDeclaration) -> Result<ElementKernels, ElementError> {
    let nodes = element.functions.len() as u32;
    let is_linear_simplex = is_linear_simplex(element);
    let dimension = element.shape.dimension();
    let (gradient, contract, node_gradients) = if is_linear_simplex {
        (gradient(nodes), contract(nodes), node_gradients(nodes))
    } else {
        (
            mapped::gradient(nodes, dimension),
            mapped::contract(nodes, dimension),
            mapped::node_gradients(nodes, dimension),
        )
    };
    Ok(ElementKernels {
        declaration: element.clone(),
        nodes,
        is_linear_simplex,
        gradient: gradient.validate()?,
        contract: contract.validate()?,
        node_gradients: node_gradients.validate()?,
    })
}

/// Whether there is one quadrature point, and function j > 0 is the coordinate j - 1 of three.
fn is_linear_simplex(element: &ElementDeclaration) -> bool {
    let coordinate = |k: usize| {
        let mut exponents = [0; 3];
        exponents[k] = 1;
        Polynomial::monomial(Rational::one(), exponents)
    };
    element.quadrature.points.len() == 1
        && element.functions.len() == 4
        && (0..3).all(|k| element.functions[k + 1] == coordinate(k))
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

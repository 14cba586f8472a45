//! What the generator prints for passes: functions of values, which know no buffer.

/// A tensor, or a vector, that a law's function takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Argument {
    /// The material's constants.
    Constants,
    /// G.
    DisplacementGradient,
    /// The rate of G.
    GradientRate,
    /// The direction of a differential.
    GradientIncrement,
    /// The gradient of one node's interpolation function.
    NodeGradient,
}

/// A law's point kernel as a WGSL function of arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointFunction {
    /// Its name.
    pub name: &'static str,
    /// The function, after everything that it calls.
    pub text: &'static str,
    /// What it takes, in its order.
    pub arguments: &'static [Argument],
    /// The field of its result that holds the value, where the result is a structure: its field `margin` is the domain's
    /// margin. Where there is none, the result is the value.
    pub field: Option<&'static str>,
}

/// A law's point kernels as WGSL, in single precision.
#[derive(Debug, Clone, Copy)]
pub struct LawFunctions {
    /// What the law is, and what its constants are, as a comment.
    pub banner: &'static str,
    /// W.
    pub energy: PointFunction,
    /// P.
    pub force: PointFunction,
    /// dP.
    pub dforce: PointFunction,
    /// The diagonal of the tangent at one node.
    pub diagonal: PointFunction,
    /// Cauchy stress.
    pub cauchy: PointFunction,
}

/// The point kernels of a law's damping as WGSL, in single precision.
#[derive(Debug, Clone, Copy)]
pub struct DampingFunctions {
    /// The stress of damping.
    pub damping: PointFunction,
    /// Its differential by the rate.
    pub ddamping: PointFunction,
    /// The diagonal of that differential at one node.
    pub diagonal: PointFunction,
}

/// An element's kernels at a quadrature point as WGSL functions of arrays, each under its own name. Of a linear
/// tetrahedron they take the gradients of nodes 1, 2, 3; of others the slopes, then J^-1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ElementFunctions {
    /// `gradient`: nodal vectors, gradients -> G.
    pub gradient: &'static str,
    /// `contract`: stress, gradients, weight -> nodal forces.
    pub contract: &'static str,
    /// `node_gradients`: gradients -> those of every node.
    pub node_gradients: &'static str,
}

//! What an integrator needs of a device: vectors over the nodes, and the forces of the elements.
//!
//! Integrators and solvers are written once over these traits; where the vectors live and who computes on them is a
//! backend's affair. Vectors have three components a node. Scalars that a backend returns are `f64`, summed in a fixed
//! order.

/// An element has left the domain of its law: the state is not one that the law describes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("element {element} has left the domain of law `{law}` ({domain})")]
pub struct LeftDomain {
    /// The element, in the mesh's numbering.
    pub element: u32,
    /// The law's name.
    pub law: String,
    /// The inequality that holds inside the domain.
    pub domain: String,
}

/// Vectors over the nodes of a body, and their arithmetic.
pub trait Backend {
    /// Three components a node.
    type Vector;

    /// A vector of zeros.
    fn zeros(&self) -> Self::Vector;
    /// A vector with the given components, rounded to the backend's precision.
    fn upload(&self, values: &[[f64; 3]]) -> Self::Vector;
    /// The components of a vector.
    fn download(&self, x: &Self::Vector) -> Vec<[f64; 3]>;
    /// y = x.
    fn copy(&self, x: &Self::Vector, y: &mut Self::Vector);
    /// x = 0.
    fn clear(&self, x: &mut Self::Vector);
    /// y += a x.
    fn axpy(&self, a: f64, x: &Self::Vector, y: &mut Self::Vector);
    /// y = x + b y.
    fn xpby(&self, x: &Self::Vector, b: f64, y: &mut Self::Vector);
    /// y = b y.
    fn scale(&self, b: f64, y: &mut Self::Vector);
    /// y += a d x, component by component.
    fn multiply_add(&self, a: f64, d: &Self::Vector, x: &Self::Vector, y: &mut Self::Vector);
    /// y = x / d, component by component.
    fn divide(&self, x: &Self::Vector, d: &Self::Vector, y: &mut Self::Vector);
    /// The sum of x_i y_i over all components, in a fixed order.
    fn dot(&self, x: &Self::Vector, y: &Self::Vector) -> f64;
    /// The largest |x_i|; infinite if a component is not finite.
    fn max_abs(&self, x: &Self::Vector) -> f64;
    /// Sets the constrained components to 0.
    fn project(&self, x: &mut Self::Vector);
    /// Sets the constrained components to these values, in the constraints' order.
    fn impose(&self, values: &[f64], x: &mut Self::Vector);
    /// Sets the constrained components of y to these values minus those of x, in the constraints' order.
    fn impose_change(&self, values: &[f64], x: &Self::Vector, y: &mut Self::Vector);
    /// Replaces components that are not positive by their magnitude, and 0 by 1.
    fn make_positive(&self, x: &mut Self::Vector);
    /// The unit round-off of the backend's precision.
    fn epsilon(&self) -> f64;
}

/// Forces that derive from a potential: the elements of a body.
///
/// K is the tangent stiffness, K = -df/du at the state given to [`ForceField::prepare`].
pub trait ForceField<B: Backend> {
    /// The potential energy at displacement u.
    ///
    /// # Errors
    /// An element is outside its law's domain.
    fn potential_energy(&mut self, backend: &B, u: &B::Vector) -> Result<f64, LeftDomain>;
    /// f += the forces at displacement u.
    ///
    /// # Errors
    /// An element is outside its law's domain.
    fn add_force(&mut self, backend: &B, u: &B::Vector, f: &mut B::Vector) -> Result<(), LeftDomain>;
    /// Linearises at displacement u: the state of [`ForceField::add_dforce`] and [`ForceField::add_diagonal`].
    fn prepare(&mut self, backend: &B, u: &B::Vector);
    /// df += factor times the force differential in the direction du, that is factor times (-K du).
    fn add_dforce(&mut self, backend: &B, du: &B::Vector, factor: f64, df: &mut B::Vector);
    /// d += factor times the diagonal of K.
    fn add_diagonal(&mut self, backend: &B, factor: f64, d: &mut B::Vector);
}

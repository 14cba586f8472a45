//! Integrators, written once over a backend's vectors.

mod equation;
mod explicit;
mod implicit;
mod newton;
mod statics;

pub use explicit::{CentralDifference, SemiImplicitEuler, central_difference_coefficients};
pub use implicit::ImplicitEuler;
pub use newton::{NewtonLimits, SolverSettings};
pub use statics::Statics;

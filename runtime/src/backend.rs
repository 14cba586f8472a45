//! What an integrator needs of a device: vectors over the nodes, and the forces of the elements.
//!
//! Integrators and solvers are written once over these traits; where the vectors live and who computes on them is a
//! backend's affair. Vectors have three components a node. Scalars that a backend returns are `f64`, summed in a fixed
//! order. To return one, a device has to be waited for; a solver that needs scalars in every iteration keeps them in
//! [`Backend::Registers`], where the vectors live, and gives its recurrences as [`Update`]s.

use std::sync::Arc;

use crate::body::PressedFace;
use crate::contact::{Contact, Held, Passage};
use crate::device::DeviceError;
use crate::inventory::Ledger;
use crate::mass::{MassMatrix, Masses};

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

/// A number of a solver's recurrences: `f64` on the host, or a device's own.
pub trait Scalar:
    Copy
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Div<Output = Self>
{
    /// A constant.
    fn number(x: f64) -> Self;
    /// `then` where left > right, `otherwise` elsewhere; both are evaluated.
    fn select_greater(left: Self, right: Self, then: Self, otherwise: Self) -> Self;
    /// The square root of what is not negative.
    fn sqrt(self) -> Self;

    /// The greater of the two.
    fn max(self, other: Self) -> Self {
        Self::select_greater(self, other, self, other)
    }
    /// The lesser of the two.
    fn min(self, other: Self) -> Self {
        Self::select_greater(self, other, other, self)
    }
    /// 1, or -1 where it is negative.
    fn sign(self) -> Self {
        Self::select_greater(Self::number(0.0), self, Self::number(-1.0), Self::number(1.0))
    }
    /// Its magnitude.
    fn abs(self) -> Self {
        self * self.sign()
    }
}

impl Scalar for f64 {
    fn number(x: f64) -> Self {
        x
    }
    fn select_greater(left: Self, right: Self, then: Self, otherwise: Self) -> Self {
        if left > right { then } else { otherwise }
    }
    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

/// Numbers of [`Backend::Registers`].
pub const REGISTERS: usize = 16;
/// The register that stops a solver: where it is 0, [`Backend::descend`], [`Backend::turn`], [`ForceField::product`] and
/// updates that heed it do nothing.
pub const RUNNING: usize = 0;
/// The register that receives a sum for the next update: of [`ForceField::product`] or [`Backend::descend`].
pub const SUM: usize = 1;
/// The factor of [`Backend::descend`].
pub const ALPHA: usize = 2;
/// The factor of [`Backend::turn`].
pub const BETA: usize = 3;

/// One step of a solver's recurrences on its registers, written once for every backend.
///
/// There is no control flow: what depends on a condition is a [`Scalar::select_greater`]. Backends may compute in f32,
/// and need not tell NaN from other numbers.
pub trait Update: 'static {
    /// Whether it reads [`SUM`].
    const SUMS: bool;
    /// Changes the registers.
    fn apply<S: Scalar>(registers: &mut [S; REGISTERS]);
}

/// Vectors over the nodes of a body, and their arithmetic.
///
/// A device may fail at any time. Numbers that it returns from then on are NaN, and [`Backend::check`] says why.
pub trait Backend {
    /// Three components a node.
    type Vector;
    /// [`REGISTERS`] numbers of a solver, where the vectors live.
    type Registers;
    /// A matrix over the nodes, the same for each component.
    type Matrix;
    /// What may touch what.
    type Contact;
    /// Faces under a pressure.
    type Pressure;

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
    /// The mass matrix of the body for which the backend was made.
    fn matrix(&self, matrix: &MassMatrix) -> Self::Matrix;
    /// y += a M x.
    fn add_product(&self, a: f64, matrix: &Self::Matrix, x: &Self::Vector, y: &mut Self::Vector);
    /// y = x / d, component by component.
    fn divide(&self, x: &Self::Vector, d: &Self::Vector, y: &mut Self::Vector);
    /// The sum of x_i y_i over all components, in a fixed order.
    fn dot(&self, x: &Self::Vector, y: &Self::Vector) -> f64;
    /// The largest |x_i|; infinite if a component is not finite.
    fn max_abs(&self, x: &Self::Vector) -> f64;
    /// Sets the constrained components, and what is held of nodes, to 0.
    fn project(&self, x: &mut Self::Vector);
    /// Sets each constrained component to the value of the motion that it follows.
    fn impose(&self, motions: &[f64], x: &mut Self::Vector);
    /// Sets each constrained component of y to the value of the motion that it follows minus the component of x.
    fn impose_change(&self, motions: &[f64], x: &Self::Vector, y: &mut Self::Vector);
    /// Says which nodes are held on obstacles: as constrained along their normals, or altogether if they stick.
    fn hold(&mut self, held: &[Held]);
    /// Sets what is held of nodes to 0, as [`Backend::project`] does besides.
    fn project_held(&self, x: &mut Self::Vector);
    /// Gives held nodes their greatest component in all three, so that dividing by it keeps directions.
    fn even_out(&self, x: &mut Self::Vector);
    /// Replaces components that are not positive by their magnitude, and 0 by 1.
    fn make_positive(&self, x: &mut Self::Vector);
    /// The unit round-off of the backend's precision.
    fn epsilon(&self) -> f64;
    /// The smallest normal number of the backend's registers.
    fn smallest(&self) -> f64;

    /// Registers with these values.
    fn registers(&self, values: [f64; REGISTERS]) -> Self::Registers;
    /// Sets all registers.
    fn load(&self, values: [f64; REGISTERS], registers: &mut Self::Registers);
    /// The values of all registers: waits for the device.
    fn read(&self, registers: &Self::Registers) -> [f64; REGISTERS];
    /// registers\[k\] = the sum of x_i y_i.
    fn dot_to(&self, x: &Self::Vector, y: &Self::Vector, registers: &mut Self::Registers, k: usize);
    /// Applies an update to the registers.
    fn update<U: Update>(&self, registers: &mut Self::Registers);
    /// One descent of a conjugate gradient along d, with a = [`ALPHA`]: x += a d, r -= a q, z = r / D, and the sum of
    /// r_i z_i for the next update.
    fn descend(&self, descent: Descent<Self>, registers: &mut Self::Registers)
    where
        Self: Sized;
    /// One update of an explicit integrator: v = keep v + kick M^-1 f, then u += drift v.
    fn advance(&self, advance: Advance<Self>)
    where
        Self: Sized;
    /// Some faces of the body for which the backend was made.
    fn pressure(&self, faces: &[PressedFace]) -> Self::Pressure;
    /// f += the forces of a pressure at displacement u.
    fn add_pressure(&self, faces: &Self::Pressure, pressure: f64, u: &Self::Vector, f: &mut Self::Vector);
    /// Contact as this backend can compute it.
    fn contact_here(&self, contact: Arc<Contact>) -> Arc<Contact> {
        contact
    }
    /// Contact of the body for which the backend was made.
    fn contact(&self, contact: &Contact) -> Self::Contact;
    /// What contact does at the end of a step.
    fn touch(&self, meeting: Meeting<Self>)
    where
        Self: Sized;
    /// The least distance of the surface from an obstacle, where the passages begin; `limit` where it is more than that.
    fn gap(&self, contact: &Self::Contact, passages: &[Passage<f64>], limit: f64, u: &Self::Vector) -> f64;
    /// The next direction of a conjugate gradient: d = z + b d with b = [`BETA`].
    fn turn(&self, z: &Self::Vector, d: &mut Self::Vector, registers: &Self::Registers);
    /// How many iterations a solver does well to take between two readings of its registers.
    fn iterations_between_readings(&self) -> u32;
    /// How many explicit steps a run does well to take between two looks at the state.
    fn steps_between_checks(&self) -> u64 {
        1
    }

    /// What the backend runs on.
    fn name(&self) -> String;
    /// Hands over all that was asked for, and waits until it is done.
    ///
    /// # Errors
    /// The device has failed.
    fn wait(&self) -> Result<(), DeviceError>;
    /// What the device was asked to do so far.
    fn counts(&self) -> Counts;
    /// The book of what this backend, and a field on it, hold and ran.
    fn ledger(&self) -> &Ledger;
    /// Lets go of memory that is kept for vectors to come.
    fn trim(&self) {}
    /// Whether the device still works: numbers returned before a successful check are good.
    ///
    /// # Errors
    /// The first fault of the device.
    fn check(&self) -> Result<(), DeviceError>;
}

/// The vectors and factors of [`Backend::advance`].
pub struct Advance<'a, B: Backend> {
    /// Forces.
    pub force: &'a B::Vector,
    /// Lumped masses.
    pub masses: &'a B::Vector,
    /// What is kept of the velocity.
    pub keep: f64,
    /// The factor of the acceleration.
    pub kick: f64,
    /// The factor of the velocity.
    pub drift: f64,
    /// Velocity.
    pub v: &'a mut B::Vector,
    /// Displacement.
    pub u: &'a mut B::Vector,
}

/// A step at whose end something may have been met.
pub struct Meeting<'a, B: Backend> {
    /// What may touch what.
    pub contact: &'a B::Contact,
    /// How the obstacles moved.
    pub passages: &'a [Passage<f64>],
    /// The step's length: the displacement has grown by it times the velocity.
    pub h: f64,
    /// Lumped masses.
    pub masses: &'a B::Vector,
    /// Velocity.
    pub v: &'a mut B::Vector,
    /// Displacement.
    pub u: &'a mut B::Vector,
    /// Gets the impulses of contact on the nodes added, if they are wanted.
    pub impulse: Option<&'a mut B::Vector>,
}

/// The vectors of [`Backend::descend`].
pub struct Descent<'a, B: Backend> {
    /// The direction.
    pub d: &'a B::Vector,
    /// A d.
    pub q: &'a B::Vector,
    /// The preconditioner D.
    pub preconditioner: &'a B::Vector,
    /// The solution.
    pub x: &'a mut B::Vector,
    /// The residual.
    pub r: &'a mut B::Vector,
    /// D^-1 r.
    pub z: &'a mut B::Vector,
}

/// What a device was asked to do; all 0 where there is no device to be waited for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Kernels started.
    pub dispatches: u64,
    /// Lists of kernels handed over.
    pub submissions: u64,
    /// Times that results were waited for and read.
    pub readbacks: u64,
    /// Bytes read.
    pub bytes_read: u64,
}

/// A = mass M + stiffness K + damping, K at the state to which a field is prepared.
pub struct Operator<'a, B: Backend> {
    /// M.
    pub masses: &'a Masses<B>,
    /// Factor m of M.
    pub mass: f64,
    /// Factor k of K.
    pub stiffness: f64,
    /// What damping adds, if there is any.
    pub damping: Option<Damping<'a, B>>,
}

/// The part of an operator that is damping: viscosity C + stiffness K, both at a state of their own.
///
/// C = -df/dv of the laws' dissipations. Implicit steps take damping at the displacement with which they begin.
pub struct Damping<'a, B: Backend> {
    /// Displacement.
    pub u: &'a B::Vector,
    /// Velocity.
    pub v: &'a B::Vector,
    /// Factor of C; 0 where no law has a dissipation.
    pub viscosity: f64,
    /// Factor of K at u; 0 where there is no Rayleigh damping, or [`Operator::stiffness`] has it.
    pub stiffness: f64,
}

impl<B: Backend> Operator<'_, B> {
    /// y = A x, constrained components set to 0.
    pub fn apply(&self, backend: &B, field: &mut impl ForceField<B>, x: &B::Vector, y: &mut B::Vector) {
        backend.clear(y);
        // add_dforce adds -K x.
        field.add_dforce(backend, x, -self.stiffness, y);
        if let Some(damping) = &self.damping {
            if damping.viscosity != 0.0 {
                field.add_ddamping(backend, [damping.u, damping.v], x, -damping.viscosity, y);
            }
            if damping.stiffness != 0.0 {
                field.add_dforce_at(backend, damping.u, x, -damping.stiffness, y);
            }
        }
        if self.mass != 0.0 {
            self.masses.add(backend, self.mass, x, y);
        }
        backend.project(y);
    }

    /// d = diag A.
    pub fn diagonal(&self, backend: &B, field: &mut impl ForceField<B>, d: &mut B::Vector) {
        backend.clear(d);
        field.add_diagonal(backend, self.stiffness, d);
        self.damping_diagonal(backend, field, d);
        if let Some(masses) = self.masses.diagonal() {
            backend.axpy(self.mass, masses, d);
        }
    }
}

impl<B: Backend> Operator<'_, B> {
    /// d += the diagonal of the part that is damping.
    pub fn damping_diagonal(&self, backend: &B, field: &mut impl ForceField<B>, d: &mut B::Vector) {
        let Some(damping) = &self.damping else { return };
        if damping.viscosity != 0.0 {
            field.add_damping_diagonal(backend, [damping.u, damping.v], damping.viscosity, d);
        }
        if damping.stiffness != 0.0 {
            field.add_diagonal_at(backend, damping.u, damping.stiffness, d);
        }
    }
}

/// Forces that derive from a potential, and those of damping: the elements of a body.
///
/// K is the tangent stiffness, K = -df/du at the state given to [`ForceField::prepare`].
pub trait ForceField<B: Backend> {
    /// The strain energy of each element at displacement u, in the mesh's numbering.
    ///
    /// # Errors
    /// An element is outside its law's domain.
    fn element_energies(&mut self, backend: &B, u: &B::Vector) -> Result<Vec<f64>, LeftDomain>;
    /// The Cauchy stress of each element at displacement u, in the mesh's numbering, 9 components row by row.
    fn cauchy(&mut self, backend: &B, u: &B::Vector) -> Vec<[f64; 9]>;
    /// Whether [`ForceField::add_force`] may leave it to [`ForceField::check_domains`] to say that an element is outside: for
    /// fields that wait for a device to know it. Others say it at once.
    fn defer_domains(&mut self, _defer: bool) {}
    /// Whether all elements were inside their laws' domains in all forces since domains are deferred.
    ///
    /// # Errors
    /// An element was outside its law's domain.
    fn check_domains(&mut self, _backend: &B) -> Result<(), LeftDomain> {
        Ok(())
    }
    /// f += the forces at displacement u.
    ///
    /// # Errors
    /// An element is outside its law's domain.
    fn add_force(&mut self, backend: &B, u: &B::Vector, f: &mut B::Vector) -> Result<(), LeftDomain>;
    /// Linearises at displacement u: the state of [`ForceField::add_dforce`] and [`ForceField::add_diagonal`].
    fn prepare(&mut self, backend: &B, u: &B::Vector);
    /// Lets go of what products with the tangent need: whoever asks for one again has to prepare it again.
    fn forget_tangent(&mut self, _backend: &B) {}
    /// df += factor times the force differential in the direction du, that is factor times (-K du).
    fn add_dforce(&mut self, backend: &B, du: &B::Vector, factor: f64, df: &mut B::Vector);
    /// d += factor times the diagonal of K.
    fn add_diagonal(&mut self, backend: &B, factor: f64, d: &mut B::Vector);
    /// As [`ForceField::add_dforce`] with K at displacement u, whatever was prepared.
    fn add_dforce_at(&mut self, backend: &B, u: &B::Vector, du: &B::Vector, factor: f64, df: &mut B::Vector);
    /// As [`ForceField::add_diagonal`] with K at displacement u, whatever was prepared.
    fn add_diagonal_at(&mut self, backend: &B, u: &B::Vector, factor: f64, d: &mut B::Vector);
    /// f += factor times the damping forces of the laws' dissipations at \[displacement, velocity\].
    fn add_damping(&mut self, backend: &B, at: [&B::Vector; 2], factor: f64, f: &mut B::Vector);
    /// df += factor times their differential by the velocity in the direction dv, that is factor times (-C dv).
    fn add_ddamping(&mut self, backend: &B, at: [&B::Vector; 2], dv: &B::Vector, factor: f64, df: &mut B::Vector);
    /// d += factor times the diagonal of C.
    fn add_damping_diagonal(&mut self, backend: &B, at: [&B::Vector; 2], factor: f64, d: &mut B::Vector);
    /// y = A x, constrained components set to 0, and the sum of x_i y_i for the next update.
    fn product(
        &mut self,
        backend: &B,
        operator: &Operator<B>,
        x: &B::Vector,
        y: &mut B::Vector,
        registers: &mut B::Registers,
    );

    /// The potential energy at displacement u.
    ///
    /// # Errors
    /// An element is outside its law's domain.
    fn potential_energy(&mut self, backend: &B, u: &B::Vector) -> Result<f64, LeftDomain> {
        Ok(self.element_energies(backend, u)?.iter().sum())
    }
}

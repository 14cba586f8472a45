//! The equation that implicit steps and statics share: its residual, and where damping is taken.

use crate::backend::{Backend, ForceField, LeftDomain};
use crate::system::System;

/// The equation of one implicit step: find x (imposed components given) with
/// `force (f(u_0 + displacement (x + v_0)) + d(u_0, x + v_0)) + constant - mass M x = 0` on the free components, where d
/// are the elements' damping forces.
pub(super) struct Equation<'a, B: Backend> {
    /// Factor of M in A and in the residual.
    pub mass: f64,
    /// Factor of K in A.
    pub stiffness: f64,
    /// Displacement for each unit of x (and of v_0).
    pub displacement: f64,
    /// Factor of the forces.
    pub force: f64,
    /// The time at which loads are taken.
    pub time: f64,
    /// u_0.
    pub u: &'a B::Vector,
    /// v_0: the velocity at which x = 0 moves on; the first linearisation is taken at u_0 all the same.
    pub velocity: Option<&'a B::Vector>,
    /// What the residual has besides forces and inertia.
    pub constant: Option<&'a B::Vector>,
    /// Whether a law has a dissipation.
    pub viscous: bool,
    /// Rayleigh's beta.
    pub stiffness_damping: f64,
}

impl<B: Backend> Equation<'_, B> {
    /// The displacement at x.
    pub fn displaced(&self, backend: &B, x: &B::Vector, u: &mut B::Vector) {
        backend.copy(self.u, u);
        backend.axpy(self.displacement, x, u);
        if let Some(v) = self.velocity {
            backend.axpy(self.displacement, v, u);
        }
    }

    /// The residual at displacement u and, where given, x; projected. Without x it has no damping.
    pub fn residual<F: ForceField<B>>(
        &self,
        system: &mut System<B, F>,
        u: &B::Vector,
        x: Option<&B::Vector>,
        damped: &mut Option<Damped<B>>,
        r: &mut B::Vector,
    ) -> Result<(), LeftDomain> {
        self.imbalance(system, u, x, damped, r)?;
        system.backend.project(r);
        Ok(())
    }

    /// The residual with what holds the constrained components.
    pub fn imbalance<F: ForceField<B>>(
        &self,
        system: &mut System<B, F>,
        u: &B::Vector,
        x: Option<&B::Vector>,
        damped: &mut Option<Damped<B>>,
        r: &mut B::Vector,
    ) -> Result<(), LeftDomain> {
        system.force(u, self.time, r)?;
        if let (Some(x), Some(Damped { rate, .. })) = (x, damped) {
            system.backend.copy(x, rate);
            if let Some(v) = self.velocity {
                system.backend.axpy(1.0, v, rate);
            }
            system.add_damping(self.u, rate, r);
        }
        let backend = &system.backend;
        backend.scale(self.force, r);
        if let Some(constant) = self.constant {
            backend.axpy(1.0, constant, r);
        }
        if let (Some(x), true) = (x, self.mass != 0.0) {
            system.masses.add(backend, -self.mass, x, r);
        }
        Ok(())
    }
}

/// What the solver needs where elements damp.
pub(super) struct Damped<B: Backend> {
    /// The velocity at the current iterate.
    pub rate: B::Vector,
    /// The part of the diagonal that is the stiffness's.
    pub elastic: B::Vector,
    /// Whether the prepared K is that of u_0, so that Rayleigh's part needs no product of its own.
    pub at_start: bool,
}

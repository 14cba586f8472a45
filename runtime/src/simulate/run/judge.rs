//! What a run asks its guards: states now and then, the last step's residual, and what to warn of.

use crate::backend::{Backend, ForceField};
use crate::guard::LastStep;
use crate::plan::precision_name;
use crate::probe::Energies;
use crate::system::SolveError;

use super::super::{Ending, Observer};
use super::Run;

impl<B: Backend + 'static, F: ForceField<B> + 'static> Run<'_, B, F> {
    /// Lets the guards look at the state.
    pub(super) fn look(&mut self) {
        let u = self.system.backend.download(&self.state.u);
        let time = self.state.time * self.model.scale.time;
        self.guards.look(&self.system.body, &u, self.state.step, time);
    }

    /// Lets the guards judge the last step's residual; contact would hold what they take for out of balance.
    pub(super) fn judge_residual(&mut self) {
        let backend = &self.system.backend;
        let met = self.system.touch.as_ref().is_some_and(|touch| touch.is_looked_for);
        let solved = self.integrator.solved(backend);
        if let (Some(before), Some(solved), false) = (self.before_last.take(), solved, met) {
            let after = backend.download(&self.state.u);
            let (body, solver, clock) = (&self.system.body, &self.scene.solver, [self.step, self.state.time]);
            self.guards.judge(&LastStep { body, solver, clock, before: &before, after: &after, solved });
        }
    }

    /// Warns of what the guards saw, the last state included.
    pub(super) fn look_back(
        &mut self,
        ending: &Ending,
        energies: Option<Energies>,
        observer: &mut (dyn Observer + Send),
    ) {
        if self.guards.is_due_at_end(self.state.step) {
            self.look();
        }
        if *ending == Ending::Done {
            self.judge_residual();
        }
        let solver = &self.scene.solver;
        if !solver.integrator.is_explicit() && solver.newton.max_iterations == 1 {
            self.guards.cut_short(self.cost.negative_curvature);
        }
        // States of a simulation that blew up say nothing of its laws.
        if !matches!(ending, Ending::Failed(SolveError::Diverged { .. })) {
            let mut found = self.guards.after();
            if *ending == Ending::Done && energies.is_some_and(|e| !e.total().is_finite()) {
                found.push(format!(
                    "the energy is beyond what {} holds; displacements are right all the same",
                    precision_name(self.scene.solver.precision)
                ));
            }
            found.iter().for_each(|warning| observer.warning(warning));
            self.warnings.extend(found);
        }
    }
}

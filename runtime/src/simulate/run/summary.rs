//! What `summary.json` and `failure.json` say of a run.

use serde_json::{Value, json};

use crate::backend::{Backend, ForceField, LeftDomain};
use crate::inventory::{Held, Inventory};
use crate::plan::{Plan, integrator_name, precision_name};
use crate::probe::Energies;

use super::super::Ending;
use super::Run;
use super::record::Results;

impl<B: Backend + 'static, F: ForceField<B> + 'static> Run<'_, B, F> {
    pub(super) fn summary(
        &mut self,
        ending: &Ending,
        energies: Option<Energies>,
        results: &Results,
        wall: f64,
    ) -> Value {
        let scale = self.model.scale;
        let probes: serde_json::Map<String, Value> =
            self.model.recorder.names().iter().zip(&results.last).map(|((n, _), v)| (n.clone(), json!(v))).collect();
        let plan = match &self.tangents {
            Some((tangents, _)) => Plan::with_tangents(self.scene, &self.model, self.layout, tangents),
            None => Plan::new(self.scene, &self.model, self.layout),
        };
        let implicit = !self.scene.solver.integrator.is_explicit();
        let tangents_by = self.tangents.as_ref().filter(|_| implicit).map(|(_, by)| *by);
        let status = match ending {
            Ending::Done => "done",
            Ending::Failed(_) => "failed",
            Ending::Interrupted => "interrupted",
        };
        let error = match ending {
            Ending::Failed(e) => Some(e.to_string()),
            Ending::Done | Ending::Interrupted => None,
        };
        json!({
            "scene": self.scene.path().display().to_string(),
            "title": self.scene.scene.title,
            "status": status,
            "error": error,
            "device": self.system.backend.name(),
            "precision": precision_name(self.scene.solver.precision),
            "integrator": integrator_name(self.scene.solver.integrator),
            "nodes": self.model.mesh.nodes().len(),
            "elements": self.model.mesh.len(),
            "steps": self.state.step,
            "step_s": self.step * scale.time,
            "simulated_time_s": self.state.time * scale.time,
            "wall_time_s": wall,
            "energies": energies.map(|e| json!({
                "kinetic_J": e.kinetic, "elastic_J": e.elastic, "external_J": e.external, "total_J": e.total(),
            })),
            "probes": probes,
            "step_limits": self.limits.map(|l| json!({ "element_s": l.element, "power_s": l.power })),
            "solver": {
                "force_evaluations": self.cost.forces,
                "tangent_products": self.cost.products,
                "newton_iterations": self.cost.newton,
                "stagnated_solutions": self.cost.stagnated,
                "negative_curvatures": self.cost.negative_curvature,
                "unsettled_contacts": self.cost.unsettled,
                "residual_left_by_rounding": self.cost.left,
                "tangents_chosen_by": tangents_by,
            },
            "guards": self.guards.to_json(),
            "contact": self.system.touch.as_ref().map(|touch| json!({ "steps_that_looked": touch.steps })),
            "device_counts": self.device_counts(),
            "inventory": self.inventory(),
            "units": { "length_m": scale.length, "stress_Pa": scale.stress, "time_s": scale.time },
            "model": plan.to_json(),
            "warnings": self.warnings,
        })
    }

    /// What the device was asked to do; nothing where there is none to be waited for.
    pub(super) fn device_counts(&self) -> Option<Value> {
        let counts = self.system.backend.counts();
        (counts.dispatches > 0).then(|| {
            json!({
                "dispatches": counts.dispatches, "submissions": counts.submissions,
                "readbacks": counts.readbacks, "bytes_read": counts.bytes_read,
            })
        })
    }

    /// What was held at most and is at the end, and what ran how often.
    pub(super) fn inventory(&self) -> Value {
        let Inventory { buffers, all, kernels } = self.system.backend.ledger().inventory();
        let of = |bytes: fn(&Held) -> usize| -> serde_json::Map<String, Value> {
            let some = buffers.iter().filter(|(_, held)| bytes(held) > 0);
            some.map(|(name, held)| (name.clone(), json!(bytes(held)))).collect()
        };
        let runs: serde_json::Map<String, Value> =
            kernels.into_iter().map(|(name, used)| (name, json!(used.runs))).collect();
        json!({
            "allocated_bytes": all.peak, "buffers_bytes": of(|held| held.peak), "held_bytes": of(|held| held.bytes),
            "kernel_runs": runs,
        })
    }

    /// The element that left its law's domain, by itself: enough to evaluate it again.
    pub(super) fn failure(&self, e: &LeftDomain) -> Value {
        let nodes = &self.system.body.elements[e.element as usize];
        let u = self.in_si(&self.state.u, self.model.scale.length);
        json!({
            "error": e.to_string(),
            "law": e.law,
            "parameters": self.model.assignment.parameters(e.element),
            "element": e.element,
            "time_s": self.state.time * self.model.scale.time,
            "kind": self.model.mesh.kind(crate::mesh::ElementId(e.element)).info.name,
            "rest_positions_m": nodes.iter().map(|n| self.model.mesh.nodes()[*n as usize]).collect::<Vec<_>>(),
            "last_displacements_m": nodes.iter().map(|n| u[*n as usize]).collect::<Vec<_>>(),
        })
    }
}

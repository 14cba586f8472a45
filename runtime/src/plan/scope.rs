//! What a scene models, and what it leaves out and why, in words.

use super::Needed;
use crate::scene::Scene;

/// Sorts what may be modelled.
#[derive(Default)]
struct Scope {
    modelled: Vec<String>,
    left_out: Vec<String>,
}

impl Scope {
    fn say(&mut self, included: bool, yes: impl Into<String>, no: &str) {
        if included { self.modelled.push(yes.into()) } else { self.left_out.push(no.to_string()) }
    }
}

/// What is modelled, and what is left out.
pub(super) fn scope(scene: &Scene, needed: &Needed) -> [Vec<String>; 2] {
    let Needed { model, moves, implicit, viscous, proportional, records, .. } = *needed;
    let body = &model.body;
    let mut scope = Scope::default();
    let masses = if body.mass_matrix.is_some() { "consistent masses" } else { "lumped masses" };
    scope.say(moves, format!("inertia ({masses})"), "inertia: static equilibrium");
    scope.say(moves, "velocities", "velocities, masses and critical steps: nothing moves in statics");
    scope.say(scene.solver.mass_damping > 0.0 && moves, "mass damping", "damping: solver.mass_damping is 0");
    scope.say(proportional, "stiffness damping", "stiffness damping: solver.stiffness_damping is 0");
    let dissipates = body.batches.iter().any(|b| b.law.damping.is_some());
    let no_viscosity =
        if dissipates { "viscosity: nothing moves in statics" } else { "viscosity: no law has a dissipation" };
    scope.say(viscous, "viscosity (dissipations of laws)", no_viscosity);
    let explicit = "tangent stiffness: the integrator is explicit; the critical step takes products before the first step, and \
                    stores nothing";
    scope.say(implicit, "tangent stiffness", explicit);
    let large = !body.is_elastically_linear();
    if implicit {
        let constant = "linearization: every law is linear, its tangent depends on no displacement";
        scope.say(large, "linearization at the state of each solution", constant);
    }
    scope.say(large, "large deformation", "large deformation: every law is linear, rotations are not modelled");
    fibres(&mut scope, needed);
    let moving = body.motions.iter().any(|m| !m.is_constant());
    let constrained = body.constraints.len();
    scope.say(constrained > 0, format!("{constrained} imposed components"), "supports: none given");
    scope.say(moving, "imposed motion", "imposed motion: no boundary moves");
    scope.say(!body.loads.is_empty(), format!("{} loads", body.loads.len()), "loads: none given");
    let pressed: usize = body.pressures.iter().map(|p| p.faces.len()).sum();
    scope.say(pressed > 0, format!("pressure on {pressed} faces"), "pressure: none given");
    match &body.contact {
        None => scope.say(false, "", "contact: no obstacle"),
        Some(contact) => {
            let [nodes, obstacles] = [contact.nodes.len(), contact.obstacles.len()];
            scope.say(true, format!("contact of {nodes} surface nodes with {obstacles} obstacles"), "");
            scope.say(false, "", "contact in steps in which nothing can come as far as an obstacle: the gap tells");
            scope.say(needed.impulses, "forces of contact", "forces of contact: no probe and no field shows them");
        }
    }
    outputs(&mut scope, scene, needed);
    scope.say(
        records.stresses,
        "stresses of elements in records",
        "stresses of elements: no probe and no field shows them",
    );
    let energies = "energies in records: no probe and no field shows them; the summary has those of the end";
    scope.say(records.energies, "energies in records", energies);
    [scope.modelled, scope.left_out]
}

fn fibres(scope: &mut Scope, needed: &Needed) {
    let has_fibres = |law: &tensormass_kernels::LawInfo| law.parameters.iter().any(|p| p.direction);
    let batches = &needed.model.body.batches;
    let with: Vec<_> = batches.iter().filter(|b| has_fibres(b.law.info)).collect();
    let each = with.iter().any(|b| b.per_element);
    scope.say(
        !with.is_empty(),
        if each { "fibres (constants for each element)" } else { "fibres (one direction)" },
        "fibres: no law has a direction",
    );
}

fn outputs(scope: &mut Scope, scene: &Scene, needed: &Needed) {
    let probes = needed.model.recorder.names().len();
    scope.say(probes > 0, format!("{probes} probes"), "probes: none given");
    scope.say(scene.output.frames != Some(0), "frames", "frames: output.frames is 0");
    let checkpoints = scene.output.checkpoint_every.is_some();
    scope.say(checkpoints, "checkpoints", "checkpoints: output.checkpoint_every is not given");
}

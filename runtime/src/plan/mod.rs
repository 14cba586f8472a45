//! What a scene will compute, and what it leaves out: laws, kernels, passes, memory.
//!
//! A run makes what its scene requires, and enters it in its inventory ([`crate::inventory`]); a plan says the same before,
//! without a device. Tests compare the two.

mod buffers;
mod device;
mod laws;
mod passes;
mod scope;
mod vectors;

use serde_json::{Value, json};

use crate::frames;
use crate::mesh::Quality;
use crate::model::Model;
use crate::probe::Needs;
use crate::scene::{Integrator, Precision, Scene};
use crate::tangent::{self, Tangent};

use laws::Damping;
pub use laws::PlannedLaw;
pub(crate) use laws::{operations, point_operations, tangent_operations};
pub use passes::{Per, PlannedPass};
use vectors::Vectors;

/// How buffers are laid out: they differ between the CPU and GPUs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// In memory, in the scene's precision.
    Cpu,
    /// On a device: f32, four numbers where three would do.
    Gpu,
}

/// What a scene will compute.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Laws with their kernels.
    pub laws: Vec<PlannedLaw>,
    /// Passes in the order in which a step runs them.
    pub passes: Vec<PlannedPass>,
    /// Buffers with their bytes, under the names that an inventory has: what a run holds at most. Where nothing is met, a run
    /// holds less for contact; an assembled tangent takes up to a quarter more, where rows of its matrix do not fill lanes.
    pub buffers: Vec<(&'static str, usize)>,
    /// Vectors that are held from step to step, and those that are at once at most.
    pub vectors: [usize; 2],
    /// Elements of the mesh.
    pub elements: usize,
    /// How small and how distorted the elements are.
    pub quality: Quality,
    /// What is modelled.
    pub modelled: Vec<String>,
    /// What is left out, and why.
    pub left_out: Vec<String>,
}

/// What decides about kernels, passes and buffers.
struct Needed<'a> {
    model: &'a Model,
    moves: bool,
    implicit: bool,
    /// Whether laws' dissipations damp.
    viscous: bool,
    /// Whether Rayleigh's damping has a part that is proportional to the stiffness.
    proportional: bool,
    /// Whether forces of contact are recorded.
    impulses: bool,
    /// What probes and frames read.
    records: Needs,
    /// How products with the tangents of laws are computed, where there are some.
    tangents: Vec<Option<Tangent>>,
    /// Bytes of a number.
    real: usize,
    /// Iterations of Newton's method, at most.
    max_iterations: u32,
}

impl<'a> Needed<'a> {
    fn new(scene: &Scene, model: &'a Model, layout: Layout, tangents: &[Tangent]) -> Self {
        let (body, implicit) = (&model.body, !scene.solver.integrator.is_explicit());
        // GPUs store nothing.
        let on_layout = |tangent: &Tangent| match layout {
            Layout::Cpu => *tangent,
            Layout::Gpu => Tangent::Recomputed,
        };
        let shown = if scene.output.frames == Some(0) { Needs::default() } else { frames::needs(&scene.output.fields) };
        let records = model.recorder.needs().and(shown);
        Self {
            model,
            moves: body.moves,
            implicit,
            viscous: body.is_viscous(),
            // Static equilibrium has no damping.
            proportional: body.moves && body.stiffness_damping > 0.0,
            impulses: body.contact.is_some() && records.contact,
            records,
            tangents: tangents.iter().map(|t| implicit.then(|| on_layout(t))).collect(),
            real: match layout {
                Layout::Cpu => scene.solver.precision.bytes(),
                Layout::Gpu => Precision::F32.bytes(),
            },
            max_iterations: scene.solver.newton.max_iterations,
        }
    }

    /// Whether there are steps after which nothing is recorded, besides the first and the last one.
    fn passes_over_steps(&self, scene: &Scene) -> bool {
        let (output, steps) = (&scene.output, scene.solver.steps());
        let probes = !self.model.recorder.names().is_empty();
        let is_recorded = |step| {
            (probes && output.wants_probes(step, steps))
                || output.wants_frame(step, steps)
                || output.wants_checkpoint(step, steps)
        };
        (2..steps).any(|step| !is_recorded(step))
    }
}

/// The integrator's name in scenes.
pub fn integrator_name(integrator: Integrator) -> &'static str {
    match integrator {
        Integrator::ImplicitEuler => "implicit-euler",
        Integrator::SemiImplicitEuler => "semi-implicit-euler",
        Integrator::CentralDifference => "central-difference",
        Integrator::Static => "static",
    }
}

/// The precision's name in scenes.
pub fn precision_name(precision: Precision) -> &'static str {
    match precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    }
}

impl Plan {
    /// The plan of a scene on a CPU or a GPU.
    pub fn new(scene: &Scene, model: &Model, layout: Layout) -> Self {
        let (tangents, _) = tangent::asked_for(scene, &model.body);
        Self::with_tangents(scene, model, layout, &tangents)
    }

    /// The plan where products with the tangents of the laws are computed in these ways on a CPU.
    pub fn with_tangents(scene: &Scene, model: &Model, layout: Layout, tangents: &[Tangent]) -> Self {
        let needed = Needed::new(scene, model, layout, tangents);
        let damping = Damping { is_viscous: needed.viscous, is_proportional: needed.proportional };
        let batches = model.body.batches.iter().zip(&needed.tangents);
        let laws: Vec<PlannedLaw> = batches.map(|(b, tangent)| PlannedLaw::new(b, *tangent, damping)).collect();
        let vectors = Vectors::of(scene, &needed, layout);
        let buffers = buffers::buffers(scene, &needed, layout, vectors.most());
        let passes = passes::passes(&needed, layout, &laws, &buffers);
        let [mut modelled, left_out] = scope::scope(scene, &needed);
        modelled.extend(buffers::grids(&needed, layout).iter().map(|(i, grid)| {
            format!(
                "obstacle.{i} as a grid of distances: cells of {:.2e} m, its surface off by {:.1e} m at most",
                grid.cell() * model.scale.length,
                grid.error() * model.scale.length
            )
        }));
        Self {
            laws,
            passes,
            buffers,
            vectors: [vectors.in_steps(), vectors.most()],
            elements: model.body.elements.len(),
            quality: model.quality,
            modelled,
            left_out,
        }
    }

    /// Operations and bytes an element of all passes that run as often.
    pub fn totals(&self, per: Per) -> [f64; 2] {
        let passes = || self.passes.iter().filter(|pass| pass.per == per);
        [passes().filter_map(|p| p.flops).sum(), passes().filter_map(|p| p.bytes).sum()]
    }

    /// Bytes an element over all buffers.
    pub fn bytes_per_element(&self) -> f64 {
        self.buffers.iter().map(|(_, b)| *b as f64).sum::<f64>() / self.elements as f64
    }

    /// The plan as JSON.
    pub fn to_json(&self) -> Value {
        let laws: Vec<Value> = self
            .laws
            .iter()
            .map(|l| {
                let kernels: serde_json::Map<String, Value> =
                    l.kernels.iter().map(|(k, n)| ((*k).to_string(), json!(n))).collect();
                json!({
                    "law": l.info.name, "element": l.element.name, "elements": l.elements, "constants_per_element": l.per_element,
                    "operations_per_element": kernels, "tangent": l.tangent, "reviewed": l.info.reviewed,
                })
            })
            .collect();
        let buffers: serde_json::Map<String, Value> =
            self.buffers.iter().map(|(n, b)| ((*n).to_string(), json!(b))).collect();
        let passes: Vec<Value> = self.passes.iter().map(|pass| pass.to_json()).collect();
        let total = |per: Per| {
            let [flops, bytes] = self.totals(per);
            (per.name().to_string(), json!({ "flops_per_element": flops, "bytes_per_element": bytes }))
        };
        let totals: serde_json::Map<String, Value> = Per::ALL.into_iter().map(total).collect();
        json!({
            "mesh": {
                "min_volume_m3": self.quality.min_volume, "max_volume_m3": self.quality.max_volume,
                "min_altitude_m": self.quality.min_altitude, "min_dihedral_deg": self.quality.min_dihedral,
                "max_dihedral_deg": self.quality.max_dihedral, "worst_radius_ratio": self.quality.worst_radius_ratio,
            },
            "laws": laws, "passes": passes, "totals": totals, "buffers_bytes": buffers,
            "vectors": { "in_steps": self.vectors[0], "at_most": self.vectors[1] },
            "bytes_per_element": self.bytes_per_element(), "modelled": self.modelled, "left_out": self.left_out,
        })
    }
}

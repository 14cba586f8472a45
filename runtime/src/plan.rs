//! What a scene will compute, and what it leaves out: laws, kernels, passes, memory.

use serde_json::{Value, json};
use tensormass_kernels::{ElementInfo, LawEntry, LawInfo, pairs};

use crate::body::LawBatch;
use crate::contact::{Grid, Shape};
use crate::cpu::{TOUCHING_BYTES, place_bytes};
use crate::mesh::Quality;
use crate::model::Model;
use crate::order::{DeviceOrder, Sharing, blocks_of_clusters, sharing};
use crate::scene::{Field, Integrator, Precision, Scene};
use crate::tangent::{self, Tangent, blocks};

/// How buffers are laid out: they differ between the CPU and GPUs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// In memory, in the scene's precision.
    Cpu,
    /// On a device: f32, four numbers where three would do, slots by node.
    Gpu,
}

/// One law of a plan.
#[derive(Debug, Clone)]
pub struct PlannedLaw {
    /// The law.
    pub info: &'static LawInfo,
    /// The kind of element.
    pub element: &'static ElementInfo,
    /// Elements.
    pub elements: usize,
    /// Constants stored: for each element, or once.
    pub per_element: bool,
    /// How products with the tangent are computed; none where there are none.
    pub tangent: Option<Tangent>,
    /// The kernels that will run, each with its operations an element.
    pub kernels: Vec<(&'static str, u32)>,
}

/// What a scene will compute.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Laws with their kernels.
    pub laws: Vec<PlannedLaw>,
    /// Passes in the order in which a step runs them.
    pub passes: Vec<&'static str>,
    /// Buffers with their bytes.
    pub buffers: Vec<(&'static str, usize)>,
    /// Elements of the mesh.
    pub elements: usize,
    /// How small and how distorted the elements are.
    pub quality: Quality,
    /// What is modelled.
    pub modelled: Vec<String>,
    /// What is left out, and why.
    pub left_out: Vec<String>,
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
        let implicit = !scene.solver.integrator.is_explicit();
        let moves = scene.solver.integrator != Integrator::Static;
        // Static equilibrium has no damping.
        let viscous = moves && model.body.is_viscous();
        let proportional = moves && model.body.stiffness_damping > 0.0;
        // GPUs store nothing.
        let on_layout = |tangent: &Tangent| match layout {
            Layout::Cpu => *tangent,
            Layout::Gpu => Tangent::Recomputed,
        };
        let tangents: Vec<Option<Tangent>> = tangents.iter().map(|t| implicit.then(|| on_layout(t))).collect();
        let laws = model
            .body
            .batches
            .iter()
            .zip(&tangents)
            .map(|(b, tangent)| {
                let mut law = law(b, *tangent, proportional);
                let damping = damping_kernels(b.law, b.element.info);
                law.kernels.extend(damping.filter(|(name, _)| viscous && (implicit || *name == "damping")));
                law
            })
            .collect();
        let (nodes, elements) = (model.body.masses.len(), model.body.elements.len());
        let points = model.body.rest.values().len();
        // A GPU has slopes of reference elements with each law and kind.
        let mapped = model.body.batches.iter().map(|b| b.element.info).filter(|info| !info.is_linear_simplex);
        let slopes: usize = mapped.map(|info| info.points.len() * (info.nodes - 1)).sum();
        let matrix = model.body.mass_matrix.as_ref();
        let (entries, rows) = matrix.map_or((0, 0), |m| (m.values.len(), m.offsets.len()));
        let frames_show = |field| scene.output.frames != Some(0) && scene.output.fields.contains(&field);
        let impulses = model.body.contact.is_some() && (model.recorder.needs().contact || frames_show(Field::Contact));
        let touching = model.body.contact.as_ref().map_or(0, |contact| contact.nodes.len());
        // Of a face under pressure: its nodes and tangents at rest; on a GPU slots too, and where each node finds its own.
        let pressed = || model.body.pressures.iter().flat_map(|p| &p.faces);
        let shapes = || model.body.contact.iter().flat_map(|contact| &contact.obstacles).map(|o| &o.shape);
        let grids: Vec<(usize, Grid)> = match layout {
            Layout::Cpu => vec![],
            Layout::Gpu => {
                shapes().enumerate().filter_map(|(i, shape)| Some((i, Grid::bake(shape.solid()?)))).collect()
            }
        };
        let vectors = if implicit { 20 + 2 * usize::from(viscous || proportional) } else { 6 } + usize::from(impulses);
        let constants: usize = model.body.batches.iter().map(|b| b.constants.len()).sum();
        let with_domain = model.body.batches.iter().filter(|b| b.law.info.domain.is_some());
        let margins: usize = with_domain.map(|b| b.elements.len()).sum();
        let buffers = match layout {
            Layout::Cpu => {
                let real = scene.solver.precision.bytes();
                let place_bytes = match scene.solver.precision {
                    Precision::F32 => place_bytes::<f32>,
                    Precision::F64 => place_bytes::<f64>,
                };
                let of_places = model.body.batches.iter().map(|b| place_bytes(&model.body, b)).sum();
                // Each node has a partial force, and one for each cluster to which it is foreign; a number both ways, and
                // where the numbers of a shared node are.
                let Sharing { foreign, shared } = sharing(&model.body);
                let of_points = |b: &LawBatch| b.elements.len() * b.element.info.points.len();
                let storing = model.body.batches.iter().zip(&tangents).filter(|(_, t)| **t == Some(Tangent::Stored));
                let stored: usize = storing.map(|(b, _)| b.law.info.stored * of_points(b)).sum();
                let assembled =
                    model.body.batches.iter().zip(&tangents).filter(|(_, t)| **t == Some(Tangent::Assembled));
                // Numbers and columns of blocks, slots of those that clusters share; and where an element's blocks are.
                let matrix = |b: &LawBatch| {
                    let (own, places) =
                        (blocks(&model.body, b), pairs(b.element.info.nodes).count() * b.elements.len());
                    let foreign = blocks_of_clusters(&model.body, b) - own;
                    (9 * real + 2) * own + (9 * real + 8) * foreign + 4 * places
                };
                let assembled = assembled.map(|(b, _)| matrix(b)).sum();
                vec![
                    ("element nodes", of_places),
                    ("rest data", 10 * real * points),
                    ("material constants", real * constants),
                    ("partial forces", 3 * real * (nodes + foreign)),
                    ("nodes of clusters, slots of nodes", 8 * foreign + 12 * shared + 4 * nodes),
                    ("stored tangent", real * stored),
                    ("assembled tangent", assembled),
                    ("state and work vectors", vectors * 3 * real * nodes),
                    ("consistent mass", (4 + real) * entries + 4 * rows),
                    ("nodes of the surface", TOUCHING_BYTES * touching),
                    (
                        "faces under pressure",
                        pressed().map(|f| size_of_val(f) + 4 * f.nodes.len() + size_of_val(&*f.tangents)).sum(),
                    ),
                    ("triangles of obstacles", shapes().map(Shape::bytes).sum()),
                ]
            }
            Layout::Gpu => {
                let order = DeviceOrder::of(&model.body);
                let groups = || model.body.batches.iter().map(|b| b.element.info.nodes).zip(&order.elements);
                let fours: usize = groups().map(|(nodes, elements)| elements.fours(nodes)).sum();
                let slots: usize = groups().map(|(nodes, elements)| elements.slots(nodes)).sum();
                vec![
                    ("element nodes", 16 * fours),
                    ("rest data", 48 * points + 16 * slopes),
                    ("material constants", 4 * constants),
                    ("partial forces", 16 * slots),
                    ("slots of nodes", 4 * (slots + nodes + 1)),
                    ("margins of domains", 4 * margins),
                    ("state and work vectors", (vectors + 1) * 16 * nodes),
                    ("consistent mass", 8 * entries + 4 * rows),
                    ("nodes of the surface", 16 * touching),
                    ("faces under pressure", pressed().map(|f| 40 * f.nodes.len() + 32 * f.tangents.len()).sum()),
                    (
                        "grids of distances from obstacles",
                        grids.iter().map(|(_, grid)| size_of_val(grid.values())).sum(),
                    ),
                ]
            }
        };
        let buffers = buffers.into_iter().filter(|(_, bytes)| *bytes > 0).collect();
        let mut passes = vec!["elements: partial forces", "nodes: sum of slots"];
        if layout == Layout::Gpu && margins > 0 {
            passes.push("elements: count of those outside their law's domain");
        }
        if !model.body.pressures.is_empty() {
            passes.push("faces: forces of pressure, nodes: sum");
        }
        if viscous {
            passes.push("elements: damping forces, nodes: sum of slots");
        }
        if proportional && !implicit {
            passes.push("elements: partial force differentials of the velocity, nodes: sum of slots");
        }
        if implicit {
            let stores = |(b, t): (&LawBatch, &Option<Tangent>)| *t == Some(Tangent::Stored) && b.law.info.stored > 0;
            if model.body.batches.iter().zip(&tangents).any(stores) {
                passes.push("elements: what is stored of the tangent");
            }
            if tangents.contains(&Some(Tangent::Assembled)) {
                passes.push("elements: partial blocks of the tangent, pairs of nodes: sum of slots");
            }
            passes.push("elements: diagonal");
            if viscous {
                passes.push("elements: diagonal of damping, nodes: sum of slots");
            }
            match layout {
                Layout::Cpu if tangents.iter().all(|t| *t == Some(Tangent::Assembled)) => {
                    passes.push("CG: pairs of nodes: partial products with the assembled tangent, nodes: sum, vectors");
                }
                Layout::Cpu => passes.push("CG: elements: partial force differentials, nodes: sum, vectors"),
                Layout::Gpu => passes.extend([
                    "CG iteration 1: elements: partial force differentials",
                    "CG iteration 2: nodes: product, and its partial sums with the direction",
                    "CG iteration 3: step length, and whether the curvature is positive",
                    "CG iteration 4: nodes: solution, residual, and partial sums of its norm",
                    "CG iteration 5: turn, and whether to stop",
                    "CG iteration 6: nodes: next direction",
                ]),
            }
            if matrix.is_some() {
                passes.push("CG: nodes: product with the consistent mass");
            }
            if viscous {
                passes.push("CG: elements: partial differentials of damping forces, nodes: product");
            }
            // The first iteration's tangent is that of the beginning of the step, which is Rayleigh's.
            if proportional && scene.solver.newton.max_iterations > 1 && !model.body.is_elastically_linear() {
                passes.push(
                    "CG after the first Newton iteration: elements: differentials of stiffness damping, nodes: product",
                );
            }
        }
        passes.push("nodes: update of the state");
        if model.body.contact.is_some() {
            passes.push("nodes of the surface: contact, while an obstacle can be met");
        }
        let (mut modelled, left_out) = scope(scene, model, implicit);
        modelled.extend(grids.iter().map(|(i, grid)| {
            format!(
                "obstacle.{i} as a grid of distances: cells of {:.2e} m, its surface off by {:.1e} m at most",
                grid.cell() * model.scale.length,
                grid.error() * model.scale.length
            )
        }));
        Self { laws, passes, buffers, elements, quality: model.quality, modelled, left_out }
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
        json!({
            "mesh": {
                "min_volume_m3": self.quality.min_volume, "max_volume_m3": self.quality.max_volume,
                "min_altitude_m": self.quality.min_altitude, "min_dihedral_deg": self.quality.min_dihedral,
                "max_dihedral_deg": self.quality.max_dihedral, "worst_radius_ratio": self.quality.worst_radius_ratio,
            },
            "laws": laws, "passes": self.passes, "buffers_bytes": buffers,
            "bytes_per_element": self.bytes_per_element(), "modelled": self.modelled, "left_out": self.left_out,
        })
    }
}

/// Operations of an element: those of its points, each with some gradients, its law, and what follows.
pub(crate) fn operations(element: &ElementInfo, gradients: u32, then: u32) -> u32 {
    element.points.len() as u32 * (gradients * element.gradient_operations + then)
}

/// Operations of a law's kernel at a point; 0 where it has none of this name.
pub(crate) fn point_operations(law: &LawInfo, kernel: &str) -> u32 {
    law.operations.iter().find(|o| o.kernel == kernel).map_or(0, |o| o.arithmetic())
}

/// Operations of dP at a point from what is stored of the state: G, if there is no kernel of its own.
pub(crate) fn tangent_operations(law: &LawInfo) -> u32 {
    let own = law.operations.iter().find(|o| o.kernel == "apply");
    own.map_or_else(|| point_operations(law, "dforce"), |o| o.arithmetic())
}

/// Operations of the blocks of the tangent between an element's nodes at a point: dP for each unit gradient, from what
/// [`tangent_operations`] begins with; its products with the gradient of each node, and theirs with that of each other.
fn assembly_operations(law: &LawInfo, element: &ElementInfo) -> u32 {
    let (nodes, pairs) = (element.nodes as u32, pairs(element.nodes).count() as u32);
    point_operations(law, "linearize") + 9 * tangent_operations(law) + (nodes - 1) * (3 + 27 * 5) + pairs * 27 * 2
}

/// The kernels of a law's damping, each with its operations an element.
fn damping_kernels(law: &LawEntry, element: &'static ElementInfo) -> impl Iterator<Item = (&'static str, u32)> {
    let (info, linear) = (law.info, law.damping.map(|damping| damping.linear));
    let point = |name: &str| point_operations(info, name);
    let gathers = if linear == Some(true) { 2 } else { 3 };
    let (contract, nodes) = (element.contract_operations, element.nodes as u32);
    let kernels = [
        ("damping", operations(element, 2, point("damping") + contract)),
        ("ddamping", operations(element, gathers, point("ddamping") + contract)),
        ("damping_diagonal", operations(element, gathers - 1, nodes * point("damping_diagonal"))),
    ];
    kernels.into_iter().filter(move |_| linear.is_some())
}

fn law(batch: &LawBatch, tangent: Option<Tangent>, proportional: bool) -> PlannedLaw {
    let (info, element) = (batch.law.info, batch.element.info);
    let point = |name: &str| point_operations(info, name);
    let gathers = if info.structure.linear { 1 } else { 2 };
    let mut kernels = vec![("force", operations(element, 1, point("force") + element.contract_operations))];
    // What does not depend on the increment is computed once, and stored if it is anything.
    if tangent == Some(Tangent::Stored) {
        if info.stored > 0 {
            kernels.push(("linearize", operations(element, 1, point("linearize"))));
        }
        kernels.push(("apply", operations(element, 1, tangent_operations(info) + element.contract_operations)));
    }
    if tangent == Some(Tangent::Assembled) {
        kernels.push(("assemble", operations(element, 1, assembly_operations(info, element))));
    }
    if tangent == Some(Tangent::Recomputed) || proportional {
        kernels.push(("dforce", operations(element, gathers, point("dforce") + element.contract_operations)));
    }
    if tangent.is_some() {
        kernels.push(("diagonal", operations(element, 1, element.nodes as u32 * point("diagonal"))));
    }
    PlannedLaw { info, element, elements: batch.elements.len(), per_element: batch.per_element, tangent, kernels }
}

fn scope(scene: &Scene, model: &Model, implicit: bool) -> (Vec<String>, Vec<String>) {
    let (mut modelled, mut left_out) = (vec![], vec![]);
    let mut say = |included: bool, yes: String, no: &str| {
        if included { modelled.push(yes) } else { left_out.push(no.to_string()) }
    };
    let inertia = scene.solver.integrator != Integrator::Static;
    let masses = if model.body.mass_matrix.is_some() { "consistent masses" } else { "lumped masses" };
    say(inertia, format!("inertia ({masses})"), "inertia: static equilibrium");
    say(scene.solver.mass_damping > 0.0 && inertia, "mass damping".into(), "damping: solver.mass_damping is 0");
    say(
        scene.solver.stiffness_damping > 0.0 && inertia,
        "stiffness damping".into(),
        "stiffness damping: solver.stiffness_damping is 0",
    );
    let viscous = model.body.is_viscous();
    let no_viscosity =
        if viscous { "viscosity: nothing moves in statics" } else { "viscosity: no law has a dissipation" };
    say(viscous && inertia, "viscosity (dissipations of laws)".into(), no_viscosity);
    say(implicit, "tangent stiffness".into(), "tangent stiffness: the integrator is explicit");
    let large = model.body.batches.iter().any(|b| !b.law.info.structure.linear);
    say(large, "large deformation".into(), "large deformation: every law is linear, rotations are not modelled");
    let moving = model.body.motions.iter().any(|m| !m.is_constant());
    say(
        !model.body.constraints.is_empty(),
        format!("{} imposed components", model.body.constraints.len()),
        "supports: none given",
    );
    say(moving, "imposed motion".into(), "imposed motion: no boundary moves");
    say(!model.body.loads.is_empty(), format!("{} loads", model.body.loads.len()), "loads: none given");
    let pressed: usize = model.body.pressures.iter().map(|p| p.faces.len()).sum();
    say(pressed > 0, format!("pressure on {pressed} faces"), "pressure: none given");
    let contact = model.body.contact.as_ref();
    say(
        contact.is_some(),
        contact.map_or_else(String::new, |c| {
            format!("contact of {} surface nodes with {} obstacles", c.nodes.len(), c.obstacles.len())
        }),
        "contact: no obstacle",
    );
    (modelled, left_out)
}

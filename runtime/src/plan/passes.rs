//! The passes of a plan, in the order in which a step runs them, with the least that each computes and moves.
//!
//! Operations of elements are the generator's. Bytes are those that come from and go to memory where nothing but a node's own
//! vectors stays in a cache.

use serde_json::{Value, json};

use super::buffers::Buffer;
use super::{Layout, Needed, PlannedLaw, operations, point_operations};
use crate::body::LawBatch;
use crate::inventory::names;
use crate::tangent::Tangent;

/// How often a pass runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Per {
    /// Once a step.
    Step,
    /// Once a linear solution: an implicit step has one, or as many as Newton's method takes.
    Solution,
    /// Once an iteration of conjugate gradients.
    Iteration,
    /// Once a record.
    Record,
}

impl Per {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Step, Self::Solution, Self::Iteration, Self::Record];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Solution => "solution",
            Self::Iteration => "iteration",
            Self::Record => "record",
        }
    }
}

/// A pass over elements or nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedPass {
    /// What it does.
    pub name: &'static str,
    /// How often.
    pub per: Per,
    /// Operations an element of the body; none where they depend on the state.
    pub flops: Option<f64>,
    /// Bytes an element of the body, at the least; none likewise.
    pub bytes: Option<f64>,
}

impl PlannedPass {
    pub(super) fn to_json(self) -> Value {
        let Self { name, per, flops, bytes } = self;
        json!({ "pass": name, "per": per.name(), "flops_per_element": flops, "bytes_per_element": bytes })
    }
}

/// What passes are put together from.
struct Passes<'a> {
    laws: &'a [PlannedLaw],
    elements: f64,
    nodes: f64,
    /// Bytes an element: what every element pass reads, a vector, partial forces, and their numbers.
    read: f64,
    vector: f64,
    partial: f64,
    slots: f64,
    /// Partial forces beyond the first of each node: additions.
    sums: f64,
    all: Vec<PlannedPass>,
}

impl Passes<'_> {
    /// Operations of some kernels an element of the body.
    fn flops(&self, kernels: &[&str]) -> f64 {
        let of = |law: &PlannedLaw| {
            let operations: u32 = kernels.iter().map(|kernel| law.operations(kernel)).sum();
            law.elements as f64 * f64::from(operations)
        };
        self.laws.iter().map(of).sum::<f64>() / self.elements
    }

    fn push(&mut self, per: Per, name: &'static str, flops: f64, bytes: f64) {
        self.all.push(PlannedPass { name, per, flops: Some(flops), bytes: Some(bytes) });
    }

    /// Some kernels over elements, which read so many vectors and move so much besides.
    fn over_elements(&mut self, per: Per, name: &'static str, kernels: &[&str], vectors: u32, besides: f64) {
        let bytes = self.read + f64::from(vectors) * self.vector + besides;
        self.push(per, name, self.flops(kernels), bytes);
    }

    /// Both passes at once: partial forces are written and read, and added to a vector.
    fn both(&mut self, per: Per, name: &'static str, kernels: &[&str], vectors: u32, stored: f64) {
        let bytes = self.read + f64::from(vectors + 2) * self.vector + stored + 2.0 * self.partial + self.slots;
        self.push(per, name, self.flops(kernels) + self.sums, bytes);
    }

    /// A pass over nodes that moves so many vectors, with so many operations a component.
    fn over_nodes(&mut self, per: Per, name: &'static str, vectors: u32, flops: u32) {
        let flops = f64::from(3 * flops) * self.nodes / self.elements;
        self.push(per, name, flops, f64::from(vectors) * self.vector);
    }

    /// A kernel that gives each element a value of so many bytes.
    fn recorded(&mut self, name: &'static str, needed: &Needed, kernel: &str, value: usize) {
        let of = |b: &LawBatch| {
            let (law, element) = (b.law.info, b.element.info);
            b.elements.len() as f64 * f64::from(operations(element, 1, point_operations(law, kernel)))
        };
        let flops = needed.model.body.batches.iter().map(of).sum::<f64>() / self.elements;
        self.push(Per::Record, name, flops, self.read + self.vector + value as f64);
    }

    /// A pass whose work depends on the state.
    fn other(&mut self, per: Per, name: &'static str) {
        self.all.push(PlannedPass { name, per, flops: None, bytes: None });
    }
}

/// The passes of a scene.
pub(super) fn passes(needed: &Needed, layout: Layout, laws: &[PlannedLaw], buffers: &[Buffer]) -> Vec<PlannedPass> {
    let body = &needed.model.body;
    let (elements, nodes) = (body.elements.len() as f64, body.masses.len() as f64);
    let bytes =
        |name: &str| buffers.iter().find(|(n, _)| *n == name).map_or(0.0, |(_, bytes)| *bytes as f64) / elements;
    let constants = if body.batches.iter().any(|b| b.per_element) { bytes(names::CONSTANTS) } else { 0.0 };
    let (vector, slot) = match layout {
        Layout::Cpu => (3 * needed.real, 3 * needed.real),
        Layout::Gpu => (16, 16),
    };
    let partial = bytes(names::PARTIAL_FORCES);
    let mut p = Passes {
        laws,
        elements,
        nodes,
        read: bytes(names::ELEMENT_NODES) + bytes(names::REST) + constants,
        vector: vector as f64 * nodes / elements,
        partial,
        slots: bytes(names::SLOTS),
        sums: 3.0 * (partial / slot as f64 - nodes / elements).max(0.0),
        all: vec![],
    };
    let Needed { moves, implicit, viscous, proportional, records, .. } = *needed;
    // Newton's method takes forces at each iterate.
    let forces = if implicit { Per::Solution } else { Per::Step };
    p.over_elements(forces, "elements: partial forces", &["force"], 1, partial);
    let (sums, bytes_of_sums) = (p.sums, p.partial + p.slots + 2.0 * p.vector);
    p.push(forces, "nodes: sum of slots", sums, bytes_of_sums);
    if layout == Layout::Gpu && body.batches.iter().any(|b| b.law.info.domain.is_some()) {
        let margins = bytes(names::MARGINS);
        p.push(forces, "elements: count of those outside their law's domain", 1.0, margins);
    }
    if !body.pressures.is_empty() {
        p.other(forces, "faces: forces of pressure, nodes: sum");
    }
    if viscous {
        p.both(forces, "elements: damping forces, nodes: sum of slots", &["damping"], 2, 0.0);
    }
    if proportional && !implicit {
        let name = "elements: partial force differentials of the velocity, nodes: sum of slots";
        p.both(Per::Step, name, &["dforce"], 2, 0.0);
    }
    if implicit {
        implicit_passes(&mut p, needed, layout, [bytes(names::STORED_TANGENT), bytes(names::ASSEMBLED_TANGENT)]);
        if body.mass_matrix.is_some() {
            p.push(
                Per::Iteration,
                "CG: nodes: product with the consistent mass",
                6.0 * body.mass_matrix.as_ref().map_or(0, |m| m.values.len()) as f64 / elements,
                bytes(names::MASS_MATRIX) + 2.0 * p.vector,
            );
        }
        if viscous {
            let name = "CG: elements: partial differentials of damping forces, nodes: product";
            p.both(Per::Iteration, name, &["ddamping"], 3, 0.0);
        }
        // The first iteration's tangent is that of the beginning of the step, which is Rayleigh's.
        if proportional && needed.max_iterations > 1 && !body.is_elastically_linear() {
            let name =
                "CG after the first Newton iteration: elements: differentials of stiffness damping, nodes: product";
            p.both(Per::Iteration, name, &["dforce"], 2, 0.0);
        }
    }
    match (implicit, moves) {
        (false, _) => p.over_nodes(Per::Step, "nodes: update of the state", 6, 6),
        (true, true) => p.over_nodes(Per::Step, "nodes: update of the state", 6, 3),
        (true, false) => p.over_nodes(Per::Step, "nodes: update of the state", 3, 1),
    }
    if !body.constraints.is_empty() {
        p.other(Per::Step, "constrained nodes: imposed displacement");
    }
    if body.contact.is_some() {
        p.other(Per::Step, "nodes of the surface: contact, while an obstacle can be met");
        p.other(
            Per::Step,
            "nodes of the surface: the gap, while contact is not looked for or to see whether it need be",
        );
    }
    if records.reactions {
        p.both(Per::Record, "records: support forces", &["force"], 1, 0.0);
    }
    if records.stresses {
        let values = match layout {
            Layout::Cpu => 9 * needed.real,
            Layout::Gpu => 36,
        };
        p.recorded("records: stresses of elements", needed, "cauchy", values);
    }
    if records.energies {
        p.recorded("records: energies of elements", needed, "energy", needed.real);
    }
    p.all
}

/// What an implicit step has besides forces.
fn implicit_passes(p: &mut Passes, needed: &Needed, layout: Layout, [stored, assembled]: [f64; 2]) {
    let body = &needed.model.body;
    let depends = !body.is_elastically_linear();
    let stores = |(law, t): (&PlannedLaw, &Option<Tangent>)| *t == Some(Tangent::Stored) && law.info.stored > 0;
    if p.laws.iter().zip(&needed.tangents).any(stores) {
        p.over_elements(Per::Solution, "elements: what is stored of the tangent", &["linearize"], 1, stored);
    }
    if needed.tangents.contains(&Some(Tangent::Assembled)) {
        let name = "elements: partial blocks of the tangent, pairs of nodes: sum of slots";
        p.over_elements(Per::Solution, name, &["assemble"], 1, assembled);
    }
    p.both(Per::Solution, "elements: diagonal", &["diagonal"], u32::from(depends), 0.0);
    if needed.viscous {
        let name = "elements: diagonal of damping, nodes: sum of slots";
        p.both(Per::Solution, name, &["damping_diagonal"], 2, 0.0);
    }
    let state = u32::from(depends && needed.tangents.contains(&Some(Tangent::Recomputed)));
    match layout {
        Layout::Cpu if needed.tangents.iter().all(|t| *t == Some(Tangent::Assembled)) => {
            let name = "CG: pairs of nodes: partial products with the assembled tangent, nodes: sum, vectors";
            let blocks = assembled / (9 * needed.real) as f64;
            let bytes = assembled + 2.0 * p.partial + p.slots + 17.0 * p.vector;
            let flops = 39.0 * blocks + p.sums + 36.0 * p.nodes / p.elements;
            p.push(Per::Iteration, name, flops, bytes);
        }
        Layout::Cpu => {
            // The product, and 12 operations a component on 14 vectors: those of the solver.
            let name = "CG: elements: partial force differentials, nodes: sum, vectors";
            let bytes = p.read + f64::from(state + 15) * p.vector + stored + 2.0 * p.partial + p.slots;
            let flops = p.flops(&["apply", "dforce"]) + p.sums + 36.0 * p.nodes / p.elements;
            p.push(Per::Iteration, name, flops, bytes);
        }
        Layout::Gpu => {
            let partial = p.partial;
            let elements = "CG iteration 1: elements: partial force differentials";
            p.over_elements(Per::Iteration, elements, &["dforce"], 1 + state, partial);
            let (sums, bytes) = (p.sums + 12.0 * p.nodes / p.elements, partial + p.slots + 3.0 * p.vector);
            p.push(
                Per::Iteration,
                "CG iteration 2: nodes: product, and its partial sums with the direction",
                sums,
                bytes,
            );
            p.push(Per::Iteration, "CG iteration 3: step length, and whether the curvature is positive", 0.0, 0.0);
            let name = "CG iteration 4: nodes: solution, residual, and partial sums of its norm";
            p.over_nodes(Per::Iteration, name, 8, 7);
            p.push(Per::Iteration, "CG iteration 5: turn, and whether to stop", 0.0, 0.0);
            p.over_nodes(Per::Iteration, "CG iteration 6: nodes: next direction", 3, 2);
        }
    }
}

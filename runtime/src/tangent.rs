//! How products with the tangent are computed on a CPU: from what is stored of the state, from the state anew, or by a matrix.
//!
//! The first two give the same numbers to rounding: on registers a product that is stored is rounded where it would be fused
//! with a sum. Storing saves operations in every product and costs memory that every product reads: little while it stays
//! in a cache, more than the operations of a cheap law where it does not. A matrix takes fewer operations still, and of
//! simple elements fewer numbers; but it takes several products' time to assemble, and what is rounded in it no longer
//! knows that a turned body has no forces. Where stiffnesses differ by a factor of a thousand that loses two digits or
//! three, of a million four: the rule takes a matrix in f64 and of bodies of one material alone.

use serde::{Deserialize, Serialize};

use crate::body::{Body, LawBatch};
use crate::mesh::Incidence;
use crate::plan::{point_operations, tangent_operations};
use crate::scene::{Scene, TangentChoice};

/// How products with a law's tangent are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tangent {
    /// What does not depend on the increment is stored once a linearisation.
    Stored,
    /// Everything is computed in each product.
    Recomputed,
    /// Blocks of 3 x 3 numbers between nodes are assembled once a linearisation.
    Assembled,
}

/// Bytes of rest data and stored tangents of a body that a machine's caches are taken to hold.
const CACHE: usize = 16 << 20;
/// Operations that are worth reading a number from memory: of linear tetrahedra a product that reads 12 of them an element
/// (St Venant-Kirchhoff) takes a little longer than one that computes 84 operations, one that reads 11 (neo-Hookean) as long
/// as one that computes 78 and a logarithm.
const PRICE: u32 = 9;

/// The fixed rule for the laws of a body, in numbers of so many bytes: it depends on the body alone, not on the machine.
pub fn by_rule(body: &Body, real: usize) -> Vec<Tangent> {
    let numbers = |b: &LawBatch| b.elements.len() * b.element.info.points.len() * (10 + b.law.info.stored);
    let in_cache = real * body.batches.iter().map(numbers).sum::<usize>() <= CACHE;
    let choice = |b: &LawBatch| {
        let free = if in_cache || saves(b) { Tangent::Stored } else { Tangent::Recomputed };
        let is_exact = real == size_of::<f64>() && is_one_material(body);
        if is_exact && assembling_saves(body, b, free) { Tangent::Assembled } else { free }
    };
    body.batches.iter().map(choice).collect()
}

/// Whether a body is stiff in the same way everywhere, however its materials are given.
fn is_one_material(body: &Body) -> bool {
    let [batch] = body.batches.as_slice() else { return false };
    let mut sets = batch.constants.chunks_exact(batch.law.info.constants.len().max(1));
    let first = sets.next();
    sets.all(|set| Some(set) == first)
}

/// Whether a product with a matrix costs so much less than one without that the matrix is worth assembling: less where that
/// happens once, half as much where it happens in every iteration of Newton's method.
fn assembling_saves(body: &Body, batch: &LawBatch, free: Tangent) -> bool {
    let (law, element) = (batch.law.info, batch.element.info);
    let points = batch.elements.len() * element.points.len();
    let (numbers, operations) = match free {
        Tangent::Stored => (10 + law.stored, element.gradient_operations + tangent_operations(law)),
        _ => (10, element.gradient_operations + anew(batch)),
    };
    let cost = |numbers: usize, operations: usize| PRICE as usize * numbers + operations;
    let free = points * cost(numbers, (operations + element.contract_operations) as usize);
    // Each block serves two nodes with 18 operations each, and their difference.
    let assembled = blocks(body, batch) * cost(9, 39);
    if law.structure.linear { assembled < free } else { 2 * assembled < free }
}

/// Operations of G and dP at a point from the state.
fn anew(batch: &LawBatch) -> u32 {
    batch.element.info.gradient_operations + point_operations(batch.law.info, "dforce")
}

/// Whether storing saves more at a point than reading costs, where it is read from memory.
fn saves(batch: &LawBatch) -> bool {
    let law = batch.law.info;
    anew(batch).saturating_sub(tangent_operations(law)) >= PRICE * law.stored as u32
}

/// Blocks of the assembled tangent of a batch: one for each two nodes that an element joins.
pub fn blocks(body: &Body, batch: &LawBatch) -> usize {
    let nodes = |e: &u32| &body.elements[*e as usize];
    let slots = batch.elements.iter().flat_map(nodes).map(|n| *n as usize);
    let incidence = Incidence::of_slots(body.masses.len(), slots);
    // The last node that met each.
    let mut met = vec![usize::MAX; body.masses.len()];
    let mut blocks = 0;
    for (node, ends) in incidence.offsets().windows(2).enumerate() {
        for slot in &incidence.slots()[ends[0] as usize..ends[1] as usize] {
            let element = batch.elements[*slot as usize / batch.element.info.nodes];
            for other in nodes(&element).iter().map(|n| *n as usize).filter(|other| *other > node) {
                blocks += usize::from(met[other] != node);
                met[other] = node;
            }
        }
    }
    blocks
}

/// Who chose how products are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ChosenBy {
    /// [`by_rule`].
    Rule,
    /// The scene.
    Scene,
    /// What was measured before the first step.
    Measurement,
    /// The run that is resumed.
    Checkpoint,
}

/// What a scene asks for, for each law of its body; the rule's choice where it asks for a measurement.
pub fn asked_for(scene: &Scene, body: &Body) -> (Vec<Tangent>, ChosenBy) {
    let all = |tangent| (vec![tangent; body.batches.len()], ChosenBy::Scene);
    match scene.solver.cg.tangent {
        TangentChoice::Stored => all(Tangent::Stored),
        TangentChoice::Recomputed => all(Tangent::Recomputed),
        TangentChoice::Assembled => all(Tangent::Assembled),
        TangentChoice::Auto | TangentChoice::Measured => {
            (by_rule(body, scene.solver.precision.bytes()), ChosenBy::Rule)
        }
    }
}

//! How products with the tangent are computed on a CPU: from what is stored of the state, or from the state anew.
//!
//! Both give the same numbers to rounding: on registers a product that is stored is rounded where it would be fused with a
//! sum. Storing saves operations in every product and costs memory that every product
//! reads: little while it stays in a cache, more than the operations of a cheap law where it does not.

use serde::Serialize;

use crate::body::{Body, LawBatch};
use crate::plan::{point_operations, tangent_operations};
use crate::scene::{Scene, TangentChoice};

/// How products with a law's tangent are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tangent {
    /// What does not depend on the increment is stored once a linearisation.
    Stored,
    /// Everything is computed in each product.
    Recomputed,
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
    let choice = |b: &LawBatch| if in_cache || saves(b) { Tangent::Stored } else { Tangent::Recomputed };
    body.batches.iter().map(choice).collect()
}

/// Whether storing saves more at a point than reading costs, where it is read from memory.
fn saves(batch: &LawBatch) -> bool {
    let (law, element) = (batch.law.info, batch.element.info);
    let anew = element.gradient_operations + point_operations(law, "dforce");
    anew.saturating_sub(tangent_operations(law)) >= PRICE * law.stored as u32
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
}

/// What a scene asks for, for each law of its body; the rule's choice where it asks for a measurement.
pub fn asked_for(scene: &Scene, body: &Body) -> (Vec<Tangent>, ChosenBy) {
    let all = |tangent| (vec![tangent; body.batches.len()], ChosenBy::Scene);
    match scene.solver.cg.tangent {
        TangentChoice::Stored => all(Tangent::Stored),
        TangentChoice::Recomputed => all(Tangent::Recomputed),
        TangentChoice::Auto | TangentChoice::Measured => {
            (by_rule(body, scene.solver.precision.bytes()), ChosenBy::Rule)
        }
    }
}

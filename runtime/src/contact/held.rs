//! Which nodes an implicit step holds on obstacles, and how: found by solving, looking, and solving again.
//!
//! A node that would enter an obstacle is held on its tangent plane there, and along the plane as well while friction can
//! ([`Grip`]); what holds it is its impulse. A node that would have to be pulled is let go. Where that settles, the step ends on
//! obstacles, obeys Coulomb's cone, and pulls nowhere.

use serde::{Deserialize, Serialize};

use super::friction::{Grip, Look, dot, norm, tangential};
use super::rule::{Move, Passage, at_end, meets};
use super::shape::Nearest;
use super::{Contact, Obstacle};

/// Solutions of one step, at most.
pub const ATTEMPTS: usize = 30;
/// How often a node may be let go in a step before it stays.
const LEAVINGS: u32 = 4;
/// A node that has come away from its obstacle by less than this part of its way in a step is still held on it in the next, until
/// it turns out to be pulled.
const LEAVES: f64 = 0.1;

/// A node that an obstacle holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// Its number in [`Contact::nodes`].
    pub index: usize,
    /// The node.
    pub node: u32,
    obstacle: usize,
    /// The direction out of the obstacle, without its components that supports hold.
    pub normal: [f64; 3],
    /// The displacement over the step that ends where it is held; of a node that slides its part along the normal counts.
    pub target: [f64; 3],
    /// What friction does to it.
    pub grip: Grip,
    /// How far it moved in the step.
    way: f64,
}

/// The nodes that a step holds.
#[derive(Debug, Default)]
pub struct Holding {
    held: Vec<Held>,
    /// How often each node was let go in this step.
    let_go: Vec<(usize, u32)>,
}

/// A step as it was solved.
#[derive(Debug, Clone, Copy)]
pub struct Attempt<'a> {
    /// Displacements of all nodes of the body before the step.
    pub u: &'a [[f64; 3]],
    /// What the step adds to them.
    pub by: &'a [[f64; 3]],
    /// Impulses on them that the solution leaves open: those that hold what is held, in components that no support holds.
    pub impulses: &'a [[f64; 3]],
}

impl Held {
    /// How far a displacement over the step takes it along the obstacle.
    pub fn slip(&self, by: [f64; 3]) -> [f64; 3] {
        tangential(std::array::from_fn(|i| by[i] - self.target[i]), self.normal)
    }
}

impl Holding {
    /// The nodes held, by ascending number.
    pub fn held(&self) -> &[Held] {
        &self.held
    }

    /// What the next step begins with.
    pub fn memory(&self) -> serde_json::Value {
        serde_json::json!(self.held)
    }

    /// Goes on with a memory of the same contact.
    pub fn recall(&mut self, memory: &serde_json::Value) {
        self.held = serde_json::from_value(memory.clone()).unwrap_or_default();
    }

    /// Begins a step: of the nodes held before, those still on an obstacle.
    pub fn begin(&mut self, contact: &Contact, passages: &[Passage<f64>], u: &[[f64; 3]], tolerance: f64) {
        self.let_go.clear();
        let before = std::mem::take(&mut self.held);
        for old in before.into_iter().filter(|h| h.index < contact.nodes.len() && h.obstacle < passages.len()) {
            let from = contact.place(old.index, u);
            let seen = contact.obstacles[old.obstacle].shape.nearest(passages[old.obstacle].local(from));
            // Nodes that slide on a curved surface leave it by a part of their way.
            if seen.distance <= (LEAVES * old.way).max(16.0 * tolerance) {
                // It goes with the obstacle from where it is.
                let whose = (old.index, old.obstacle);
                let held = hold(contact, &passages[old.obstacle], whose, from, (0.0, [0.0; 3], seen));
                // Friction goes on with what it was.
                self.held.extend(held.map(|held| Held { grip: old.grip.next_step(held.normal), ..held }));
            }
        }
    }

    /// Looks at a solution; whether anything has to be held otherwise, so that the step is solved again.
    pub fn look(&mut self, contact: &Contact, passages: &[Passage<f64>], attempt: &Attempt, tolerance: f64) -> bool {
        let Attempt { u, by, impulses } = *attempt;
        let largest = self.held.iter().map(|h| norm(impulses[h.node as usize])).fold(0.0, f64::max);
        // How far a held node moves, at most.
        let travel = self.held.iter().map(|h| norm(by[h.node as usize])).fold(0.0, f64::max);
        let mut changed = false;
        let mut kept = vec![];
        for mut held in std::mem::take(&mut self.held) {
            let (node, Obstacle { sticking, sliding, .. }) = (held.node as usize, &contact.obstacles[held.obstacle]);
            let impulse = impulses[node];
            let pressing = dot(impulse, held.normal);
            if pressing < -1e-9 * largest && self.times_let_go(held.index) < LEAVINGS {
                self.let_go.push((held.index, self.times_let_go(held.index) + 1));
                changed = true;
                continue;
            }
            held.way = norm(by[node]);
            changed |= held.grip.adapt(Look {
                along: tangential(impulse, held.normal),
                pressing: pressing.max(0.0),
                slip: held.slip(by[node]),
                coefficients: [*sticking, *sliding],
                largest,
                travel,
            });
            kept.push(held);
        }
        self.held = kept;
        let of = |k: usize| self.held.binary_search_by_key(&k, |held| held.index).is_ok();
        let mut new = vec![];
        for index in (0..contact.nodes.len()).filter(|k| !of(*k)) {
            let (from, by) = (contact.place(index, u), by[contact.nodes[index] as usize]);
            let holds = (0..contact.obstacles.len()).find_map(|obstacle| {
                let (passage, shape) = (&passages[obstacle], &contact.obstacles[obstacle].shape);
                let seen = passage.seen(Move { from, by });
                let (t, near) = meets(|x| shape.nearest(x), shape.approach(), seen, tolerance);
                let enters = at_end(near, seen.by, t).distance < -tolerance;
                enters.then(|| hold(contact, passage, (index, obstacle), from, (t, seen.by, near))).flatten()
            });
            new.extend(holds);
        }
        changed |= !new.is_empty();
        self.held.extend(new);
        self.held.sort_unstable_by_key(|held| held.index);
        changed
    }

    fn times_let_go(&self, index: usize) -> u32 {
        self.let_go.iter().filter(|(k, _)| *k == index).map(|(_, times)| *times).max().unwrap_or(0)
    }
}

/// An obstacle's hold on a node that comes from a place a part of its way, as the obstacle sees that, to the plane seen from there;
/// none where supports hold it across that.
fn hold(
    contact: &Contact,
    passage: &Passage<f64>,
    (index, obstacle): (usize, usize),
    from: [f64; 3],
    (t, by, near): (f64, [f64; 3], Nearest<f64>),
) -> Option<Held> {
    let surface: [f64; 3] = std::array::from_fn(|i| t * by[i] - near.distance * near.normal[i]);
    let mut normal = passage.outside(near.normal);
    let free = contact.free[index];
    (0..3).filter(|i| !free[*i]).for_each(|i| normal[i] = 0.0);
    let length = norm(normal);
    // Supports hold it across the surface.
    if length < 1e-6 {
        return None;
    }
    Some(Held {
        index,
        node: contact.nodes[index],
        obstacle,
        normal: normal.map(|x| x / length),
        target: passage.way(from, surface),
        grip: Grip::new(contact.obstacles[obstacle].sticking > 0.0),
        way: 0.0,
    })
}

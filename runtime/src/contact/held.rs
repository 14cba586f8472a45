//! Which nodes an implicit step holds on obstacles, and how: found by solving, looking, and solving again.
//!
//! A node that would enter an obstacle is held on its tangent plane there, and along the plane as well while friction can; what
//! holds it is its impulse. A node that would have to be pulled is let go, one whose tangential impulse is beyond Coulomb's cone
//! slides against kinetic friction, and one that friction would push along sticks. Where that settles, the step ends on
//! obstacles, obeys the cone, and pulls nowhere.

use super::rule::{Move, Passage, at_end, meets};
use super::{Contact, Obstacle};

/// Solutions of one step, at most.
pub const ATTEMPTS: usize = 30;
/// How often a node may change its mind in a step before it stays as it is.
const CHANGES: u32 = 4;
/// Friction that changes by less than this part of its limit has settled.
const SETTLED: f64 = 1e-3;

/// A node that an obstacle holds.
#[derive(Debug, Clone, PartialEq)]
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
    /// Whether friction holds it along the surface too.
    pub sticks: bool,
    /// The impulse of friction on it while it slides.
    pub friction: [f64; 3],
    changes: u32,
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

impl Holding {
    /// The nodes held, by ascending number.
    pub fn held(&self) -> &[Held] {
        &self.held
    }

    /// What the next step begins with: the number and the obstacle of each node, whether it sticks, and its friction.
    pub fn memory(&self) -> Vec<(usize, usize, bool, [f64; 3])> {
        self.held.iter().map(|held| (held.index, held.obstacle, held.sticks, held.friction)).collect()
    }

    /// Goes on with a memory of the same contact.
    pub fn recall(&mut self, memory: &serde_json::Value) {
        let known: Vec<(usize, usize, bool, [f64; 3])> = serde_json::from_value(memory.clone()).unwrap_or_default();
        let held = |(index, obstacle, sticks, friction)| Held {
            index,
            node: 0,
            obstacle,
            normal: [0.0; 3],
            target: [0.0; 3],
            sticks,
            friction,
            changes: 0,
        };
        self.held = known.into_iter().map(held).collect();
    }

    /// Begins a step: of the nodes held before, those still on an obstacle.
    pub fn begin(&mut self, contact: &Contact, passages: &[Passage<f64>], u: &[[f64; 3]], tolerance: f64) {
        self.let_go.clear();
        let before = std::mem::take(&mut self.held);
        for old in before.into_iter().filter(|h| h.index < contact.nodes.len() && h.obstacle < passages.len()) {
            let from = contact.place(old.index, u);
            let seen = contact.obstacles[old.obstacle].shape.nearest(passages[old.obstacle].local(from));
            // Nodes that slide on a curved surface leave it by a part of their way.
            if seen.distance <= 16.0 * tolerance {
                let still = Move { from, by: [0.0; 3] };
                let held = hold(contact, passages, (old.index, old.obstacle), still, tolerance);
                // Friction goes on with what it was.
                self.held.extend(held.map(|held| Held {
                    sticks: old.sticks && held.sticks,
                    friction: tangential(old.friction, held.normal),
                    ..held
                }));
            }
        }
    }

    /// Looks at a solution; whether anything has to be held otherwise, so that the step is solved again.
    pub fn look(&mut self, contact: &Contact, passages: &[Passage<f64>], attempt: &Attempt, tolerance: f64) -> bool {
        let Attempt { u, by, impulses } = *attempt;
        let largest = self.held.iter().map(|h| norm(impulses[h.node as usize])).fold(0.0, f64::max);
        let mut changed = false;
        let mut kept = vec![];
        for mut held in std::mem::take(&mut self.held) {
            let (node, Obstacle { sticking, sliding, .. }) = (held.node as usize, &contact.obstacles[held.obstacle]);
            let impulse = impulses[node];
            let pressing = dot(impulse, held.normal);
            if pressing < -1e-9 * largest && self.times_let_go(held.index) < CHANGES {
                self.let_go.push((held.index, self.times_let_go(held.index) + 1));
                changed = true;
                continue;
            }
            let pressing = pressing.max(0.0);
            if held.sticks {
                let along = tangential(impulse, held.normal);
                let needed = norm(along);
                if needed > sticking * pressing * (1.0 + 1e-9) && needed > 1e-12 * largest && held.changes < CHANGES {
                    held.sticks = false;
                    held.changes += 1;
                    held.friction = along.map(|x| x * (sliding * pressing / needed));
                    changed = true;
                }
            } else if *sticking > 0.0 {
                let slip = tangential(std::array::from_fn(|i| by[node][i] - held.target[i]), held.normal);
                let (speed, limit) = (norm(slip), sliding * pressing);
                if dot(slip, held.friction) > 0.0 {
                    held.sticks = true;
                    held.changes += 1;
                    held.friction = [0.0; 3];
                    changed = true;
                } else if speed > 0.0 {
                    let friction = slip.map(|x| -x * (limit / speed));
                    let difference: [f64; 3] = std::array::from_fn(|i| friction[i] - held.friction[i]);
                    changed |= norm(difference) > SETTLED * limit + 1e-12 * largest;
                    held.friction = friction;
                }
            }
            kept.push(held);
        }
        self.held = kept;
        let of = |k: usize| self.held.binary_search_by_key(&k, |held| held.index).is_ok();
        let mut new = vec![];
        for index in (0..contact.nodes.len()).filter(|k| !of(*k)) {
            let (from, by) = (contact.place(index, u), by[contact.nodes[index] as usize]);
            let holds = (0..contact.obstacles.len())
                .find_map(|obstacle| hold(contact, passages, (index, obstacle), Move { from, by }, tolerance));
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

/// Where an obstacle holds a node that moves so; none where the node does not meet it, or is on it and leaves. A node that does
/// not move is held if it is on the obstacle.
fn hold(
    contact: &Contact,
    passages: &[Passage<f64>],
    (index, obstacle): (usize, usize),
    node: Move<f64>,
    tolerance: f64,
) -> Option<Held> {
    let (passage, Obstacle { shape, sticking, .. }) = (&passages[obstacle], &contact.obstacles[obstacle]);
    let seen = passage.seen(node);
    let (t, near) = meets(|x| shape.nearest(x), shape.approach(), seen, tolerance);
    // Where the path ends on the obstacle nothing is undone, and where it ends outside nothing was met.
    let is_still = node.by == [0.0; 3];
    if !is_still && at_end(near, seen.by, t).distance >= -tolerance {
        return None;
    }
    let surface: [f64; 3] = std::array::from_fn(|i| t * seen.by[i] - near.distance * near.normal[i]);
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
        target: passage.way(node.from, surface),
        sticks: *sticking > 0.0,
        friction: [0.0; 3],
        changes: 0,
    })
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

fn tangential(a: [f64; 3], normal: [f64; 3]) -> [f64; 3] {
    let along = dot(a, normal);
    std::array::from_fn(|i| a[i] - along * normal[i])
}

//! What friction does to a node that an implicit step holds, found by solving, looking, and solving again.
//!
//! A node sticks while that takes no more than static friction, and slides against kinetic friction. One that cannot decide gets
//! a drag, a force proportional to its slip: whose factor is the limit over the last slip, so that it never pushes and is within
//! the cone when it settles (each such step lowers the energy of the step with Coulomb's friction, as it is convex in the slip).

use serde::{Deserialize, Serialize};

/// How often a node may change its mind in a step before it gets a drag.
const CHANGES: u32 = 4;
/// How often friction that does not settle is tried as it is.
const LOOKS: u32 = 6;
/// Friction that changes by less than this part of its limit has settled.
const SETTLED: f64 = 1e-3;
/// Slip of less than this part of the longest way of a held node is none.
const NEGLIGIBLE: f64 = 1e-6;
/// The part of that way which a node is first thought to slip by.
const DOUBT: f64 = 1e-2;
/// How much a drag changes from one solution to the next, at most.
const ADAPTS: f64 = 8.0;

/// What friction does to a node.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Grip {
    /// Whether it holds the node along the surface.
    pub sticks: bool,
    /// The impulse on a node that slides.
    pub friction: [f64; 3],
    /// The impulse for each length of slip, of a node that cannot decide; 0 of others.
    pub drag: f64,
    /// The drag before that, and the slip with it.
    before: [f64; 2],
    changes: u32,
    /// How often friction was not yet that of the slip.
    looks: u32,
}

/// A node in a step as it was solved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    /// What holds it along the surface, but for friction.
    pub along: [f64; 3],
    /// What holds it across.
    pub pressing: f64,
    /// How far it slips.
    pub slip: [f64; 3],
    /// The coefficients of what sticks and of what slides.
    pub coefficients: [f64; 2],
    /// The largest impulse on a held node.
    pub largest: f64,
    /// The longest way of one.
    pub travel: f64,
}

impl Grip {
    /// That of a node that is new on an obstacle.
    pub(super) fn new(sticks: bool) -> Self {
        Self { sticks, ..Self::default() }
    }

    /// With which the next step begins.
    pub(super) fn next_step(&self, normal: [f64; 3]) -> Self {
        Self { sticks: self.sticks, friction: tangential(self.friction, normal), drag: self.drag, ..Self::default() }
    }

    /// The impulse of friction on a node that does not stick, where it slips so.
    pub fn impulse(&self, slip: [f64; 3]) -> [f64; 3] {
        if self.drag > 0.0 { slip.map(|x| -self.drag * x) } else { self.friction }
    }

    /// Looks at a solution; whether it has to be another.
    pub(super) fn adapt(&mut self, look: Look) -> bool {
        let [sticking, sliding] = look.coefficients;
        let limit = sliding * look.pressing;
        if sticking == 0.0 {
            false
        } else if self.drag > 0.0 {
            self.adapt_drag(look, limit)
        } else if self.sticks {
            self.leave_off(look, sticking, limit)
        } else {
            self.slide(look, limit)
        }
    }

    /// A node with a drag: what slides comes to its limit, what sticks slips by less each time.
    fn adapt_drag(&mut self, look: Look, limit: f64) -> bool {
        let (speed, negligible) = (norm(look.slip), NEGLIGIBLE * look.travel);
        let slipped = speed.max(negligible);
        if slipped > 0.0 {
            let next = next_drag([self.before, [self.drag, slipped]], limit);
            (self.before, self.drag) = ([self.drag, slipped], next);
        }
        let [drag, _] = self.before;
        speed > negligible && (drag * speed - limit).abs() > SETTLED * limit
    }

    /// A node that sticks, as long as it can.
    fn leave_off(&mut self, look: Look, sticking: f64, limit: f64) -> bool {
        let needed = norm(look.along);
        if needed <= sticking * look.pressing * (1.0 + 1e-9) || needed <= 1e-12 * look.largest {
            return false;
        }
        let may_change = self.changes < CHANGES;
        if !may_change && look.travel == 0.0 {
            return false;
        }
        self.sticks = false;
        self.friction = look.along.map(|x| x * (limit / needed));
        self.changes += 1;
        if !may_change {
            self.drag = limit / (DOUBT * look.travel);
        }
        true
    }

    /// A node that slides.
    fn slide(&mut self, look: Look, limit: f64) -> bool {
        let speed = norm(look.slip);
        if dot(look.slip, self.friction) > 0.0 {
            // Friction pushes it.
            if self.changes < CHANGES {
                (self.sticks, self.friction) = (true, [0.0; 3]);
            } else {
                self.drag = limit / speed;
            }
            self.changes += 1;
            return true;
        }
        if speed == 0.0 {
            return false;
        }
        let friction = look.slip.map(|x| -x * (limit / speed));
        let difference: [f64; 3] = std::array::from_fn(|i| friction[i] - self.friction[i]);
        let is_settled = norm(difference) <= SETTLED * limit + 1e-12 * look.largest;
        self.friction = friction;
        self.looks += u32::from(!is_settled);
        if self.looks > LOOKS {
            self.drag = limit / speed;
        }
        !is_settled
    }
}

/// The drag with which a node's friction is at its limit, from two drags and the slips with them: as if the node were held back
/// by a spring whose other end moves, slip = a / (k + drag).
fn next_drag([[c, s], [drag, slip]]: [[f64; 2]; 2], limit: f64) -> f64 {
    let plain = limit / slip;
    let stiffness = (slip * drag - s * c) / (s - slip);
    if c == 0.0 || !(stiffness > 0.0 && stiffness.is_finite()) {
        return plain;
    }
    // A pull within the limit lets it stick.
    let pull = slip * (stiffness + drag);
    let next = if pull > limit { limit * stiffness / (pull - limit) } else { f64::INFINITY };
    next.max(plain.min(drag) / ADAPTS).min(plain.max(drag) * ADAPTS)
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// The part of a vector across a unit normal.
pub(super) fn tangential(a: [f64; 3], normal: [f64; 3]) -> [f64; 3] {
    let along = dot(a, normal);
    std::array::from_fn(|i| a[i] - along * normal[i])
}

//! When contact need not be looked for: while nothing can have come as far as an obstacle.
//!
//! Before some steps the gap is measured, and how far nodes will travel is estimated by their speed. Where that leaves room,
//! the pass of contact is not dispatched; afterwards speeds say whether the room was enough. Of one step they say so exactly,
//! because a step is its velocity times its length; of several, speeds at both ends do, with as much again in reserve.

use crate::backend::{Backend, ForceField};
use crate::system::{State, System};

/// Steps after which the gap is measured again while contact is looked for.
const LOOK_AGAIN: u64 = 32;
/// Of the estimated travel, at most a part of the gap.
const RESERVE: f64 = 2.0;

/// What is known of the distance to the nearest obstacle.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// How far a node and an obstacle may still approach each other before they meet.
    room: f64,
    /// The greatest speed of a node when it was last asked for, and when that was.
    speed: f64,
    asked: f64,
    /// The acceleration since the time before.
    acceleration: f64,
    /// Steps until the gap is measured again.
    steps: u64,
}

impl Watch {
    /// Decides whether the next steps, of length h each, look for contact.
    pub(super) fn before<B: Backend, F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        state: &State<B>,
        steps: u64,
        h: f64,
    ) {
        let looks = system.touch.as_ref().is_some_and(|touch| touch.is_looked_for);
        if system.touch.is_none() || (looks && self.steps > 0) {
            self.steps = self.steps.saturating_sub(steps);
            return;
        }
        if looks {
            self.ask(system, state, state.time);
            let limit = system.body.contact.as_ref().map_or(0.0, |contact| contact.size);
            self.room = system.gap(&state.u, state.time, limit);
        }
        let span = h * steps as f64;
        let travel = span * (self.speed + span * self.acceleration) + obstacles(system, state, state.time, steps, h);
        // What is not a number is not clear.
        let is_clear = self.room > RESERVE * travel;
        let looked_for = !is_clear;
        self.steps = if looked_for { LOOK_AGAIN.saturating_sub(steps) } else { 0 };
        if let Some(touch) = &mut system.touch {
            touch.is_looked_for = looked_for;
        }
    }

    /// Whether steps that did not look for contact may have missed it: those that brought the state here from a time.
    pub(super) fn missed<B: Backend, F: ForceField<B>>(
        &mut self,
        system: &mut System<B, F>,
        state: &State<B>,
        from: f64,
        steps: u64,
        h: f64,
    ) -> bool {
        let Some(false) = system.touch.as_ref().map(|touch| touch.is_looked_for) else { return false };
        let (before, span) = (self.speed, h * steps as f64);
        self.ask(system, state, from + span);
        let approach = obstacles(system, state, from, steps, h);
        let travel = match steps {
            1 => span * self.speed + approach,
            _ => RESERVE * (span * before.max(self.speed) + approach),
        };
        self.room -= travel;
        let is_clear = self.room > 0.0;
        let missed = !is_clear;
        if missed && let Some(touch) = &mut system.touch {
            touch.is_looked_for = true;
            self.steps = LOOK_AGAIN;
        }
        missed
    }

    /// Asks for the greatest speed, at a time.
    fn ask<B: Backend, F: ForceField<B>>(&mut self, system: &System<B, F>, state: &State<B>, now: f64) {
        // Of three components the greatest is no less than the length by this.
        let speed = 3.0_f64.sqrt() * system.backend.max_abs(state.velocity());
        let time = now - self.asked;
        self.acceleration = if time > 0.0 { (speed - self.speed).abs() / time } else { 0.0 };
        (self.speed, self.asked) = (speed, now);
    }
}

/// How far the surface of an obstacle may move towards a node in some steps.
fn obstacles<B: Backend, F: ForceField<B>>(
    system: &System<B, F>,
    state: &State<B>,
    from: f64,
    steps: u64,
    h: f64,
) -> f64 {
    let Some(contact) = &system.body.contact else { return 0.0 };
    if contact.obstacles.iter().all(|o| o.motion.is_still()) {
        return 0.0;
    }
    // Nodes are about as far from an obstacle's origin as the scene is large.
    let arm = 2.0 * contact.size + 3.0_f64.sqrt() * system.backend.max_abs(&state.u);
    let of_step = |k: u64| {
        let from = from + h * k as f64;
        let passages = contact.passages(from, from + h);
        passages.iter().map(|p| norm(&p.moved) + arm * norm(p.turned.as_flattened())).fold(0.0, f64::max)
    };
    (0..steps).map(of_step).sum()
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

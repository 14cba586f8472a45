//! Elements that are inside out, of laws that have no domain to forbid it.

use rayon::prelude::*;
use serde_json::{Value, json};

use crate::body::Body;

use super::gradient::{each_point, volume_ratio};

/// What was seen of elements whose volume is not above 0.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Inverted {
    is_needed: bool,
    /// The most at once, with the first of them and the time in s.
    most: Option<(usize, u32, f64)>,
}

impl Inverted {
    /// Of a body at rest.
    pub(super) fn of(body: &Body) -> Self {
        Self { is_needed: body.batches.iter().any(|b| b.law.info.domain.is_none()), most: None }
    }

    /// Whether there is anything to look at.
    pub(super) fn is_needed(&self) -> bool {
        self.is_needed
    }

    /// Looks at a state: the displacement of each node in the body's units, at a time in s.
    pub(super) fn look(&mut self, body: &Body, u: &[[f64; 3]], time: f64) {
        let mut found: Vec<u32> = vec![];
        for batch in body.batches.iter().filter(|b| b.law.info.domain.is_none()) {
            let is_inverted = |element: &u32| {
                let mut least = f64::INFINITY;
                each_point(body, batch, *element, u, |g, _| least = least.min(volume_ratio(g)));
                least <= 0.0
            };
            found.par_extend(batch.elements.par_iter().copied().filter(is_inverted));
        }
        let Some(first) = found.iter().min() else { return };
        if self.most.is_none_or(|(most, ..)| found.len() > most) {
            self.most = Some((found.len(), *first, time));
        }
    }

    /// A warning with its cure.
    pub(super) fn warning(&self) -> Option<String> {
        self.most.map(|(count, first, time)| {
            let elements = if count == 1 { "element is" } else { "elements are" };
            format!(
                "{count} {elements} inside out at {time:.4} s, the first is element {first}: their law computes on, but no material does \
                 that; take smaller steps or loads, or a law whose energy grows without bound as volume vanishes"
            )
        })
    }

    /// What was seen.
    pub(super) fn to_json(self) -> Value {
        json!(self.most.map(|(count, first, time)| json!({ "most": count, "element": first, "time_s": time })))
    }
}

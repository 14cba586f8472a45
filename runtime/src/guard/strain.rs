//! What deformed states say of the laws: rotation and strain against linear ones, stretches against declared ranges.

use rayon::prelude::*;
use serde_json::{Value, json};
use tensormass_kernels::{LawInfo, laws};

use super::gradient::{Symmetric, each_point, turn, volume_ratio};
use crate::body::{Body, LawBatch};

/// The estimated relative error of a linear law's displacements that is worth a warning.
const LINEAR: f64 = 0.01;
/// Rotations without any strain have no bound: the indicator ends here.
const MOST: f64 = 1e3;
/// Elements that are looked at together. Their sums are added in order, so that nothing depends on the number of threads.
const TOGETHER: usize = 1024;

/// The greatest or least value so far, with the first element that had it and the time in s.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Extreme {
    value: f64,
    element: u32,
    time: f64,
}

impl Extreme {
    fn new(value: f64) -> Self {
        Self { value, element: 0, time: 0.0 }
    }

    fn to_json(self) -> Value {
        json!({ "value": self.value, "element": self.element, "time_s": self.time })
    }
}

/// What was seen of elements of linear laws.
#[derive(Debug, Clone, Copy)]
struct Linear {
    law: &'static LawInfo,
    /// What the Green strain has and the small one has not, as a part of the gradient: the integral of ||G'G|| / 2 over that of
    /// ||G||. A turn by a small angle phi that is taken to first order misses phi / 2 of its displacement. At its greatest.
    error: f64,
    /// Then the integral of ||G'G|| over that of ||G + G'||: the relative error of strains.
    indicator: f64,
    /// When that was, s.
    time: f64,
    /// The principal small strain of greatest magnitude.
    strain: Extreme,
    /// The greatest rotation, rad.
    rotation: Extreme,
}

/// What was seen of the elements of a law that declares a range of stretches.
#[derive(Debug, Clone, Copy)]
struct Trusted {
    law: &'static LawInfo,
    range: (f64, f64),
    least: Extreme,
    greatest: Extreme,
}

/// What was seen of a body's states.
#[derive(Debug, Clone, Default)]
pub(super) struct Strains {
    linear: Option<Linear>,
    trusted: Vec<Trusted>,
}

/// Of some elements of linear laws: integrals of ||G'G||, ||G + G'|| and ||G||, the extreme strain, the extreme turn.
#[derive(Clone, Copy)]
struct LinearPart {
    sums: [f64; 3],
    strain: (f64, u32),
    turn: ([f64; 2], u32),
}

impl Strains {
    /// Of a body at rest.
    pub(super) fn of(body: &Body) -> Self {
        let mut strains = Self::default();
        for batch in &body.batches {
            let law = batch.law.info;
            if law.structure.linear && strains.linear.is_none() {
                let none = Extreme::new(0.0);
                strains.linear =
                    Some(Linear { law, error: 0.0, indicator: 0.0, time: 0.0, strain: none, rotation: none });
            }
            let is_new = strains.trusted.iter().all(|t| t.law.name != law.name);
            if let Some(range) = law.valid_stretches.filter(|_| is_new) {
                let one = Extreme::new(1.0);
                strains.trusted.push(Trusted { law, range, least: one, greatest: one });
            }
        }
        strains
    }

    /// Whether there is anything to look at.
    pub(super) fn is_needed(&self) -> bool {
        self.linear.is_some() || !self.trusted.is_empty()
    }

    /// Looks at a state: the displacement of each node in the body's units, at a time in s.
    pub(super) fn look(&mut self, body: &Body, u: &[[f64; 3]], time: f64) {
        if !u.as_flattened().iter().all(|x| x.is_finite()) {
            return;
        }
        if let Some(linear) = &mut self.linear {
            linear.look(body, u, time);
        }
        self.trusted.iter_mut().for_each(|trusted| trusted.look(body, u, time));
    }

    /// Warnings, each with its cure.
    pub(super) fn warnings(&self) -> Vec<String> {
        let linear = self.linear.iter().filter_map(Linear::warning);
        linear.chain(self.trusted.iter().filter_map(Trusted::warning)).collect()
    }

    /// Values and thresholds.
    pub(super) fn to_json(&self) -> [Value; 2] {
        let trusted: Vec<Value> = self.trusted.iter().map(|trusted| trusted.to_json()).collect();
        [json!(self.linear.map(|linear| linear.to_json())), json!(trusted)]
    }
}

/// Some elements of a batch at a time: what `of` makes of each such part, in order.
fn parts<T: Send>(batch: &LawBatch, of: impl Fn(&[u32]) -> T + Sync + Send) -> Vec<T> {
    batch.elements.par_chunks(TOGETHER).map(of).collect()
}

impl Linear {
    fn look(&mut self, body: &Body, u: &[[f64; 3]], time: f64) {
        let none = LinearPart { sums: [0.0; 3], strain: (self.strain.value, 0), turn: ([0.0, 1.0], 0) };
        let mut all = none;
        for batch in body.batches.iter().filter(|b| b.law.info.structure.linear) {
            let part = |elements: &[u32]| {
                let mut part = none;
                for e in elements {
                    each_point(body, batch, *e, u, |g, volume| part.meet(*e, g, volume));
                }
                part
            };
            parts(batch, part).into_iter().for_each(|part| all.join(part));
        }
        if all.strain.0 > self.strain.value {
            self.strain = Extreme { value: all.strain.0, element: all.strain.1, time };
        }
        let rotation = all.turn.0[0].atan2(all.turn.0[1]);
        if rotation > self.rotation.value {
            self.rotation = Extreme { value: rotation, element: all.turn.1, time };
        }
        let [square, strain, gradient] = all.sums;
        let error = if square > 0.0 { 0.5 * square / gradient } else { 0.0 };
        if error > self.error {
            (self.error, self.indicator, self.time) = (error, (square / strain).min(MOST), time);
        }
    }

    fn warning(&self) -> Option<String> {
        if self.error <= LINEAR {
            return None;
        }
        let (degrees, strain) = (self.rotation.value.to_degrees(), 100.0 * self.strain.value);
        Some(format!(
            "law `{}` is linear and holds for small rotations and strains only: at {:.4} s displacements are wrong by about {:.0} %, strains by more (rotations up to \
             {degrees:.0} degrees, strains up to {strain:.1} %); {}",
            self.law.name,
            self.time,
            100.0 * self.error,
            cure(self.law, |other| !other.structure.linear, "a law of large deformation")
        ))
    }

    fn to_json(self) -> Value {
        json!({
            "estimated_error": self.error, "threshold": LINEAR, "time_s": self.time, "indicator": self.indicator,
            "greatest_strain": self.strain.to_json(), "greatest_rotation_rad": self.rotation.to_json(),
        })
    }
}

impl LinearPart {
    fn meet(&mut self, element: u32, g: &[f64; 9], volume: f64) {
        let strain = Symmetric::twice_small_strain(g);
        let square = Symmetric::square(g);
        let gradient = (square.0[0] + square.0[1] + square.0[2]).sqrt();
        for (sum, norm) in self.sums.iter_mut().zip([square.norm(), strain.norm(), gradient]) {
            *sum += volume * norm;
        }
        let magnitude = |[low, high]: [f64; 2]| 0.5 * high.abs().max(low.abs());
        // Eigenvalues only where they may be the largest so far.
        if magnitude(strain.bounds()) > self.strain.0 {
            let value = magnitude(strain.extremes());
            if value > self.strain.0 {
                self.strain = (value, element);
            }
        }
        self.turn = further(self.turn, (turn(g), element));
    }

    fn join(&mut self, other: Self) {
        (0..3).for_each(|k| self.sums[k] += other.sums[k]);
        if other.strain.0 > self.strain.0 {
            self.strain = other.strain;
        }
        self.turn = further(self.turn, other.turn);
    }
}

/// The one that has turned further; both by less than half a turn.
fn further(a: ([f64; 2], u32), b: ([f64; 2], u32)) -> ([f64; 2], u32) {
    let ([sine, cosine], [other_sine, other_cosine]) = (a.0, b.0);
    if other_sine * cosine > sine * other_cosine { b } else { a }
}

impl Trusted {
    fn look(&mut self, body: &Body, u: &[[f64; 3]], time: f64) {
        for batch in body.batches.iter().filter(|b| b.law.info.name == self.law.name) {
            let begin = [(self.least.value, 0), (self.greatest.value, 0)];
            let part = |elements: &[u32]| {
                let mut found = begin;
                for e in elements {
                    each_point(body, batch, *e, u, |g, _| meet(&mut found, *e, g));
                }
                found
            };
            for [least, greatest] in parts(batch, part) {
                if least.0 < self.least.value {
                    self.least = Extreme { value: least.0, element: least.1, time };
                }
                if greatest.0 > self.greatest.value {
                    self.greatest = Extreme { value: greatest.0, element: greatest.1, time };
                }
            }
        }
    }

    fn warning(&self) -> Option<String> {
        let (low, high) = self.range;
        let outside = [(self.least, low - self.least.value), (self.greatest, self.greatest.value - high)];
        let worst = outside.into_iter().filter(|(_, by)| *by > 0.0).max_by(|a, b| a.1.total_cmp(&b.1))?.0;
        Some(format!(
            "element {} of law `{}` has a principal stretch of {:.3} at {:.4} s, and the law is trusted from {low} to {high}; {}",
            worst.element,
            self.law.name,
            worst.value,
            worst.time,
            cure(
                self.law,
                |other| other.valid_stretches.is_none() && !other.structure.linear,
                "a law of larger strains"
            )
        ))
    }

    fn to_json(self) -> Value {
        json!({
            "law": self.law.name, "range": [self.range.0, self.range.1],
            "least": self.least.to_json(), "greatest": self.greatest.to_json(),
        })
    }
}

/// The extreme principal stretches, with the elements that have them, after one more gradient. Where the element is inside out
/// the least one is negative.
fn meet(found: &mut [(f64, u32); 2], element: u32, g: &[f64; 9]) {
    // Of C - 1, so that small strains keep their digits.
    let change = Symmetric::twice_small_strain(g).plus(Symmetric::square(g));
    let stretch = |change: f64| (1.0 + change).max(0.0).sqrt();
    let is_inverted = volume_ratio(g) < 0.0;
    let [low, high] = change.bounds().map(stretch);
    if low >= found[0].0 && high <= found[1].0 && !is_inverted {
        return;
    }
    let [mut low, high] = change.extremes().map(stretch);
    if is_inverted {
        low = -low;
    }
    if low < found[0].0 {
        found[0] = (low, element);
    }
    if high > found[1].0 {
        found[1] = (high, element);
    }
}

/// What to take in place of a law: those of the build with the same parameters, if there are any, that are as wanted.
fn cure(law: &LawInfo, wanted: impl Fn(&LawInfo) -> bool, what: &str) -> String {
    let names = |info: &LawInfo| info.parameters.iter().map(|p| p.name).collect::<Vec<_>>();
    let alike = laws().iter().map(|l| l.info).filter(|other| names(other) == names(law) && wanted(other));
    let alike: Vec<&str> = alike.map(|other| other.name).collect();
    match alike.as_slice() {
        [] => format!("take {what}, or smaller loads"),
        _ => format!("take {what} ({}), or smaller loads", alike.join(", ")),
    }
}

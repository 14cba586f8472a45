//! What can be said of a body before its first step: materials whose digits rounding takes, and elements that lock.

use std::collections::HashSet;

use serde_json::{Value, json};
use tensormass_kernels::{ElementInfo, elements};

use crate::body::{Body, LawBatch};
use crate::moduli::Lame;
use crate::scene::Precision;

/// The relative error of stresses by rounding that is worth a warning: fewer than four digits are left.
const ROUNDING: f64 = 1e-4;
/// Poisson's ratio from which on linear simplices are much too stiff.
const LOCKING: f64 = 0.45;

/// What the materials of a body are at rest.
#[derive(Debug, Clone, Default)]
pub(super) struct AtRest {
    /// The largest lambda/mu, and the first element that has it.
    ratio: Option<(f64, u32)>,
    /// The largest Poisson's ratio of linear simplices, with the first element that has it and its kind.
    simplex: Option<(f64, u32, &'static ElementInfo)>,
    /// The largest lambda + 2 mu and the least mu.
    stiffnesses: Option<[f64; 2]>,
    /// The distance of numbers near 1.
    spacing: f64,
    precision: Option<Precision>,
}

/// Whether an element's gradient is the same everywhere: as many nodes as it takes.
fn is_linear_simplex(info: &ElementInfo) -> bool {
    info.nodes == info.dimension + 1
}

impl AtRest {
    /// Of a body computed in a precision.
    pub(super) fn of(body: &Body, precision: Precision) -> Self {
        let spacing = match precision {
            Precision::F32 => f64::from(f32::EPSILON),
            Precision::F64 => f64::EPSILON,
        };
        let mut found = Self { spacing, precision: Some(precision), ..Self::default() };
        body.batches.iter().for_each(|batch| found.meet(batch));
        found
    }

    fn meet(&mut self, batch: &LawBatch) {
        let count = batch.law.info.constants.len();
        // Each material once.
        let mut known: HashSet<Vec<u64>> = HashSet::new();
        let sets = if batch.per_element { batch.elements.len() } else { 1 };
        for (set, element) in batch.elements.iter().enumerate().take(sets) {
            let constants = &batch.constants[set * count..(set + 1) * count];
            if !known.insert(constants.iter().map(|x| x.to_bits()).collect()) {
                continue;
            }
            let lame = Lame::at_rest(batch.law, constants);
            let (ratio, poisson) = (lame.lambda / lame.mu, lame.poisson());
            if !(ratio.is_finite() && poisson.is_finite()) {
                continue;
            }
            let [most, least] = self.stiffnesses.unwrap_or([0.0, f64::INFINITY]);
            self.stiffnesses = Some([most.max(lame.lambda + 2.0 * lame.mu), least.min(lame.mu)]);
            if self.ratio.is_none_or(|(most, _)| ratio > most) {
                self.ratio = Some((ratio, *element));
            }
            let kind = batch.element.info;
            if is_linear_simplex(kind) && self.simplex.is_none_or(|(most, ..)| poisson > most) {
                self.simplex = Some((poisson, *element, kind));
            }
        }
    }

    /// The largest stiffness, lambda + 2 mu, over the least, mu.
    pub(super) fn contrast(&self) -> f64 {
        self.stiffnesses.map_or(1.0, |[most, least]| most / least)
    }

    /// The part of a stress that rounding takes: of a strain the relative rounding error is that of numbers, and lambda multiplies
    /// it where mu multiplies the strain.
    fn rounding(&self) -> Option<f64> {
        self.ratio.map(|(ratio, _)| ratio * self.spacing)
    }

    /// Warnings, each with its cure.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = vec![];
        if let (Some((ratio, element)), Some(error)) = (self.ratio, self.rounding().filter(|e| *e > ROUNDING)) {
            let cure = match self.precision {
                Some(Precision::F32) => "take solver.precision = \"f64\", or a smaller bulk modulus",
                Some(Precision::F64) | None => "take a smaller bulk modulus",
            };
            warnings.push(format!(
                "element {element} is so nearly incompressible (lambda/mu is {ratio:.1e} at rest) that rounding may change stresses by \
                 {error:.0e} of themselves: {cure}"
            ));
        }
        if let Some((poisson, element, kind)) = self.simplex.filter(|(poisson, ..)| *poisson >= LOCKING) {
            let others = elements().iter().map(|e| e.info);
            let others = others.filter(|o| o.dimension == kind.dimension && o.order >= 2 || is_box(o, kind));
            let names: Vec<&str> = others.map(|o| o.name).collect();
            warnings.push(format!(
                "elements `{}` lock where volume hardly changes (Poisson's ratio {poisson:.4} of element {element}, {LOCKING} or more): \
                 bending and shear come out too stiff; take elements of another kind ({}), or a Poisson's ratio below {LOCKING}",
                kind.name,
                names.join(", ")
            ));
        }
        warnings
    }

    /// Values and thresholds.
    pub(super) fn to_json(&self) -> [Value; 2] {
        let rounding = self.ratio.map(|(ratio, element)| {
            json!({
                "lambda_over_mu": ratio, "element": element, "estimated_error": self.rounding(), "threshold": ROUNDING,
            })
        });
        let locking = self.simplex.map(|(poisson, element, kind)| {
            json!({ "poisson": poisson, "element": element, "kind": kind.name, "threshold": LOCKING })
        });
        [json!(rounding), json!(locking)]
    }
}

/// Whether an element is of as many dimensions as another, and of boxes.
fn is_box(info: &ElementInfo, other: &ElementInfo) -> bool {
    info.dimension == other.dimension && matches!(info.shape, "hexahedron" | "quadrangle")
}

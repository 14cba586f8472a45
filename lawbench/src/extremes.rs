//! How accurate a law's kernels are, from strains of 1e-8 to 10, turned and not, soft and nearly incompressible.

use std::collections::HashMap;

use rayon::prelude::*;
use serde::Serialize;
use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::Input;

use crate::evaluate::printed;
use crate::gate::{Machine, Measure, QUANTITIES, Quantity, Reference};
use crate::material::{Material, MaterialError};
use crate::number::Exact;
use crate::states::{Precision, ROTATIONS, Random, STRAINS, State};
use crate::subject::Subject;
use crate::wgsl::{Device, DeviceError, Point, Values};

/// What to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// States a cell.
    pub samples: usize,
    /// Of the random states.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { samples: 6, seed: 1 }
    }
}

/// One machine and quantity at the states of one material, strain and rotation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// What computes.
    pub machine: Machine,
    /// What is computed.
    pub quantity: Quantity,
    /// Index in [`Extremes::materials`].
    pub material: usize,
    /// One of [`STRAINS`].
    pub strain: f64,
    /// One of [`ROTATIONS`], in rad.
    pub rotation: f64,
    /// States that count; 0 where all are outside the domain or the range of normal numbers.
    pub states: usize,
    /// The worst error as a part of its bound.
    pub gate: f64,
    /// The worst error as a part of the value.
    pub relative: f64,
    /// Where the worst error as a part of its bound is.
    pub state: Option<State>,
}

/// Stress at rest, where it has to be 0 exactly.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rest {
    /// What computes.
    pub machine: Machine,
    /// Index in [`Extremes::materials`].
    pub material: usize,
    /// |P(0)|.
    pub stress: f64,
}

/// The worst relative error of P in f32 at unrotated, well-conditioned states.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Plain {
    /// Error as a part of the value.
    pub relative: f64,
    /// The state's strain.
    pub strain: f64,
    /// Index in [`Extremes::materials`].
    pub material: usize,
}

/// The relative error of P that unrotated states have to keep in f32, up to this strain and this condition number.
pub const PLAIN: (f64, f64, f64) = (1e-6, 0.5, 16.0);

/// The measurements of one law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extremes {
    /// The law.
    pub law: String,
    /// The parameter sets, from soft to nearly incompressible.
    pub materials: Vec<Material>,
    /// Every cell, by machine, quantity, material, strain, rotation.
    pub cells: Vec<Cell>,
    /// Stress at rest.
    pub rest: Vec<Rest>,
    /// See [`PLAIN`]; none where no state is in question.
    pub plain: Option<Plain>,
    /// What computed the WGSL.
    pub wgsl: Adapter,
    /// What the law's author vouches for, and the kernels rely on.
    pub accepted: Vec<String>,
}

/// What computed the WGSL, or why nothing did.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Adapter {
    /// Its name.
    Device(String),
    /// The reason.
    Skipped(String),
}

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
pub enum ExtremesError {
    /// There is no material.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// The device failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
}

/// What computes, and what is computed.
type What = (Machine, Quantity);

/// Indices of material, strain and rotation.
type Place = (usize, usize, usize);

/// One state in f32 and its exact values, kept for the device.
struct Single {
    place: Place,
    point: Point,
    reference: Reference,
}

/// What one cell's states gave.
struct Sampled {
    measures: Vec<(What, Measure, State)>,
    plain: Option<Plain>,
    singles: Vec<Single>,
}

/// A material as the machines have it.
struct Prepared {
    exact: Vec<Exact>,
    exact_energy: Exact,
    double: Vec<f64>,
    single: Vec<f32>,
}

impl Prepared {
    fn new(derivation: &Derivation, material: &Material) -> Self {
        let exact = material.exact_constants(derivation);
        let zero = [0.0; 9].map(Exact::from);
        let inputs = [(Input::Constants, exact.as_slice()), (Input::DisplacementGradient, &zero[..])];
        let exact_energy = crate::evaluate::textbook(derivation, "energy", &inputs).value.remove(0);
        let double = material.constants(derivation);
        let single = double.iter().map(|c| *c as f32).collect();
        Self { exact, exact_energy, double, single }
    }
}

/// P, W and dP at one state as the printed kernels compute them; W counts from rest.
pub(crate) fn computed<T: Precision>(
    derivation: &Derivation,
    constants: &[T],
    g: &[T; 9],
    d: &[T; 9],
) -> [Vec<f64>; 3] {
    let exactly = |values: Vec<T>| values.into_iter().map(T::exactly).collect::<Vec<f64>>();
    let inputs =
        [(Input::Constants, constants), (Input::DisplacementGradient, &g[..]), (Input::GradientIncrement, &d[..])];
    let rest = [(Input::Constants, constants), (Input::DisplacementGradient, &[T::nearest(0.0); 9][..])];
    let energy =
        printed(derivation, "energy", &inputs[..2]).value[0].sub(&printed(derivation, "energy", &rest).value[0]);
    [
        exactly(printed(derivation, "force", &inputs[..2]).value),
        exactly(vec![energy]),
        exactly(printed(derivation, "dforce", &inputs).value),
    ]
}

/// Measures a law; its WGSL too where there is a device.
///
/// # Errors
/// See [`ExtremesError`].
pub fn extremes(
    subject: &Subject,
    options: Options,
    device: Result<&Device, String>,
) -> Result<Extremes, ExtremesError> {
    let materials = Material::all(subject)?;
    let derivation = &subject.derivation;
    let prepared: Vec<Prepared> = materials.iter().map(|m| Prepared::new(derivation, m)).collect();
    let places: Vec<Place> = (0..materials.len())
        .flat_map(|m| (0..STRAINS.len()).flat_map(move |s| (0..ROTATIONS.len()).map(move |r| (m, s, r))))
        .collect();
    // In order: what is found does not depend on the number of threads.
    let sampled: Vec<Sampled> =
        places.par_iter().map(|place| sample(derivation, &prepared[place.0], *place, options)).collect();
    let mut tally = Tally::default();
    let mut rest = vec![];
    for (material, p) in prepared.iter().enumerate() {
        let stress = |values: [Vec<f64>; 3]| values[0].iter().map(|x| x * x).sum::<f64>().sqrt();
        let single = stress(computed(derivation, &p.single, &[0.0; 9], &[0.0; 9]));
        let double = stress(computed(derivation, &p.double, &[0.0; 9], &[0.0; 9]));
        rest.push(Rest { machine: Machine::F32, material, stress: single });
        rest.push(Rest { machine: Machine::F64, material, stress: double });
    }
    let mut plain: Option<Plain> = None;
    for (place, cell) in places.iter().zip(&sampled) {
        cell.measures.iter().for_each(|(what, measure, state)| tally.add(*what, *place, *measure, *state));
        let worse = cell.plain.filter(|new| plain.is_none_or(|old| new.relative > old.relative));
        plain = worse.or(plain);
    }
    let singles: Vec<Single> = sampled.into_iter().flat_map(|s| s.singles).collect();
    let wgsl = match device {
        Ok(device) => {
            on_device(subject, device, &prepared, &singles, &mut tally, &mut rest)?;
            Adapter::Device(device.name().to_string())
        }
        Err(reason) => Adapter::Skipped(reason),
    };
    let machines = [Machine::F32, Machine::F64, Machine::Wgsl];
    let machines = &machines[..if matches!(wgsl, Adapter::Device(_)) { 3 } else { 2 }];
    let cells = tally.cells(machines, &places);
    let accepted = crate::explain::accepted(&subject.law);
    Ok(Extremes { law: subject.name().to_string(), materials, cells, rest, plain, wgsl, accepted })
}

/// The states of one cell in f32 and f64.
fn sample(derivation: &Derivation, material: &Prepared, place: Place, options: Options) -> Sampled {
    let (m, s, r) = place;
    let mut random = Random::new(&[options.seed, m as u64, s as u64, r as u64]);
    let mut sampled = Sampled { measures: vec![], plain: None, singles: vec![] };
    for k in 0..options.samples {
        let (g, d) = (random.gradient(STRAINS[s], ROTATIONS[r], k), random.direction());
        let exact =
            |g: &[f64; 9], d: &[f64; 9]| Reference::new(derivation, &material.exact, &material.exact_energy, g, d);
        if let Some(reference) = exact(&g, &d) {
            let values = computed(derivation, &material.double, &g, &d);
            sampled.judge(Machine::F64, &reference, &values, State { gradient: g, direction: d });
        }
        let (single, direction) = (g.map(f32::nearest), d.map(f32::nearest));
        if let Some(reference) = exact(&single.map(f64::from), &direction.map(f64::from)) {
            let values = computed(derivation, &material.single, &single, &direction);
            let state = State { gradient: single.map(f64::from), direction: direction.map(f64::from) };
            let worst = sampled.judge(Machine::F32, &reference, &values, state);
            if ROTATIONS[r] == 0.0 && STRAINS[s] <= PLAIN.1 && reference.condition <= PLAIN.2 {
                let new = worst.map(|p| Plain { relative: p.relative, strain: STRAINS[s], material: m });
                let worse = new.filter(|new| sampled.plain.is_none_or(|old| new.relative > old.relative));
                sampled.plain = worse.or(sampled.plain);
            }
            let point = Point { constants: material.single.clone(), gradient: single, direction };
            sampled.singles.push(Single { place, point, reference });
        }
    }
    sampled
}

impl Sampled {
    /// Measures the three quantities; gives P's measure.
    fn judge(
        &mut self,
        machine: Machine,
        reference: &Reference,
        values: &[Vec<f64>; 3],
        state: State,
    ) -> Option<Measure> {
        let measures = QUANTITIES.map(|q| reference.measure(machine, q, &values[q as usize]));
        for (quantity, measure) in QUANTITIES.into_iter().zip(measures) {
            self.measures.extend(measure.map(|m| ((machine, quantity), m, state)));
        }
        measures[Quantity::P as usize]
    }
}

/// The device's values at all states at once, and at rest for each material.
fn on_device(
    subject: &Subject,
    device: &Device,
    prepared: &[Prepared],
    singles: &[Single],
    tally: &mut Tally,
    rest: &mut Vec<Rest>,
) -> Result<(), DeviceError> {
    let at_rest = |p: &Prepared| Point { constants: p.single.clone(), gradient: [0.0; 9], direction: [0.0; 9] };
    let points: Vec<Point> = prepared.iter().map(at_rest).chain(singles.iter().map(|s| s.point.clone())).collect();
    let values = device.values(subject, &points)?;
    let (zero, values) = values.split_at(prepared.len());
    for (material, v) in zero.iter().enumerate() {
        let stress = v.stress.iter().map(|x| x * x).sum::<f64>().sqrt();
        rest.push(Rest { machine: Machine::Wgsl, material, stress });
    }
    for (single, Values { energy, stress, differential }) in singles.iter().zip(values) {
        // As a program would count it: in the working precision.
        let energy = f64::from((*energy as f32) - (zero[single.place.0].energy as f32));
        for (quantity, value) in QUANTITIES.into_iter().zip([&stress[..], &[energy], &differential[..]]) {
            if let Some(measure) = single.reference.measure(Machine::Wgsl, quantity, value) {
                let Point { gradient, direction, .. } = &single.point;
                let state = State { gradient: gradient.map(f64::from), direction: direction.map(f64::from) };
                tally.add((Machine::Wgsl, quantity), single.place, measure, state);
            }
        }
    }
    Ok(())
}

/// The worst of each cell.
#[derive(Default)]
struct Tally(HashMap<(What, Place), (usize, Measure, Option<State>)>);

impl Tally {
    fn add(&mut self, what: What, place: Place, new: Measure, state: State) {
        let none = (0, Measure { gate: 0.0, relative: 0.0 }, None);
        let (count, worst, at) = self.0.entry((what, place)).or_insert(none);
        *count += 1;
        if at.is_none() || new.gate > worst.gate {
            *at = Some(state);
        }
        worst.gate = worst.gate.max(new.gate);
        worst.relative = worst.relative.max(new.relative);
    }

    fn cells(&self, machines: &[Machine], places: &[Place]) -> Vec<Cell> {
        let mut cells = vec![];
        for &machine in machines {
            for quantity in QUANTITIES {
                for &(material, s, r) in places {
                    let found = self.0.get(&((machine, quantity), (material, s, r)));
                    let (states, worst, state) =
                        found.copied().unwrap_or((0, Measure { gate: 0.0, relative: 0.0 }, None));
                    let (strain, rotation) = (STRAINS[s], ROTATIONS[r]);
                    let Measure { gate, relative } = worst;
                    cells.push(Cell { machine, quantity, material, strain, rotation, states, gate, relative, state });
                }
            }
        }
        cells
    }
}

/// Numbers with commas between them, the shortest text that reads back to the same bits.
fn list(values: &[f64]) -> String {
    values.iter().map(|x| format!("{x:e}")).collect::<Vec<_>>().join(",")
}

impl Extremes {
    /// What fails, a line each; nothing where the law keeps its promise.
    pub fn failures(&self) -> Vec<String> {
        let mut failures = vec![];
        for cell in self.worst() {
            if cell.gate > 1.0 {
                failures.push(format!(
                    "{} in {}: {:.3e} times its bound at strain {:e}, rotation {}, {}",
                    cell.quantity.name(),
                    cell.machine.name(),
                    cell.gate,
                    cell.strain,
                    cell.rotation,
                    self.label(cell.material)
                ));
            }
        }
        for rest in self.rest.iter().filter(|r| r.stress != 0.0) {
            let label = self.label(rest.material);
            failures.push(format!("|P(0)| in {} is {:.3e}, not 0, {label}", rest.machine.name(), rest.stress));
        }
        if let Some(plain) = self.plain.filter(|p| p.relative.is_nan() || p.relative > PLAIN.0) {
            failures.push(format!(
                "unrotated P in f32 is off by {:.3e} of its value at strain {:e}, {}; {:e} is allowed",
                plain.relative,
                plain.strain,
                self.label(plain.material),
                PLAIN.0
            ));
        }
        failures
    }

    /// For each cell above the gate among the worst, the arguments with which `law replay` shows its worst state.
    pub fn replays(&self, names: &[String]) -> Vec<String> {
        let line = |cell: &&Cell| {
            let state = cell.state?;
            let set = names.iter().zip(&self.materials[cell.material].parameters);
            let set = set.map(|(name, x)| format!("--set {name}={x:?} ")).collect::<String>();
            Some(format!("{set}--gradient={} --direction={}", list(&state.gradient), list(&state.direction)))
        };
        self.worst().iter().filter(|cell| cell.gate > 1.0).filter_map(line).collect()
    }

    /// The worst cell of each machine and quantity.
    pub fn worst(&self) -> Vec<&Cell> {
        let mut worst: Vec<&Cell> = vec![];
        for cell in &self.cells {
            match worst.iter_mut().find(|w| (w.machine, w.quantity) == (cell.machine, cell.quantity)) {
                Some(w) if cell.gate > w.gate => *w = cell,
                Some(_) => {}
                None => worst.push(cell),
            }
        }
        worst
    }

    /// A material for the reader: `nu = 0.3`.
    pub fn label(&self, material: usize) -> String {
        // Adding 0 makes a positive zero of a negative one.
        let poisson = (self.materials[material].moduli.poisson() * 1e4).round() / 1e4 + 0.0;
        format!("nu = {poisson:.4}")
    }
}

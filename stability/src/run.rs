//! Runs a specimen in memory, and gives its states in units of its own.

use std::path::Path;
use std::time::{Duration, Instant};

use tensormass_runtime::scene::Precision;
use tensormass_runtime::simulate::{Ending, Observer, Sample, run_on};
use tensormass_runtime::step_limit::StepLimits;
use tensormass_runtime::target::Target;

use crate::specimen::{Specimen, Tolerances, Units};

/// Times at which a run is looked at.
const LOOKS: u64 = 8;

/// A state: displacements in units of length, energy in those of stress and volume.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// After this step.
    pub step: u64,
    /// Of each node.
    pub displacement: Vec<[f64; 3]>,
    /// Kinetic, elastic and that of the loads together.
    pub energy: f64,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// All steps were taken.
    Done,
    /// The program stopped it and said why; its states are those before.
    Stopped(String),
    /// The program refused the scene and said why.
    Refused(String),
    /// It took too long.
    Unfinished,
}

/// A run.
#[derive(Debug, Clone, PartialEq)]
pub struct Ran {
    /// How it ended.
    pub end: End,
    /// Its states, those of the last three steps among them.
    pub looks: Vec<Look>,
    /// The last value of each probe, in units of stress and length.
    pub reaction: Option<f64>,
    /// What it warned of.
    pub warnings: Vec<String>,
    /// The error of displacements that it estimates itself.
    pub estimate: Option<f64>,
}

/// Runs a specimen in some units.
pub fn run(
    specimen: &Specimen<'_>,
    units: Units,
    target: &Target,
    precision: Precision,
    tolerances: Tolerances,
    (folder, longest): (&Path, Duration),
) -> Ran {
    let mut ran = Ran { end: End::Done, looks: vec![], reaction: None, warnings: vec![], estimate: None };
    let scene = match specimen.scene(units, precision, tolerances, folder) {
        Ok(scene) => scene,
        Err(e) => return Ran { end: End::Refused(first_line(&e.to_string())), ..ran },
    };
    let mut watch = Watch { samples: vec![], until: Instant::now() + longest };
    let outcome = match run_on(target, &scene, None, &mut watch) {
        Ok(outcome) => outcome,
        Err(e) => return Ran { end: End::Refused(first_line(&e.to_string())), ..ran },
    };
    let energy = units.stress * units.length.powi(3);
    ran.looks = watch.samples.into_iter().map(|s| look(s, units.length, energy)).collect();
    ran.reaction = outcome.probes.first().map(|(_, _, value)| value / (units.stress * units.length * units.length));
    ran.warnings = outcome.warnings;
    ran.estimate = outcome.summary["guards"]["residual"]["estimated_error"].as_f64();
    ran.end = match outcome.ending {
        Ending::Done => End::Done,
        Ending::Failed(e) => End::Stopped(e.to_string()),
        Ending::Interrupted => End::Unfinished,
    };
    ran
}

fn look(sample: Sample, length: f64, energy: f64) -> Look {
    Look {
        step: sample.step,
        displacement: sample.displacement.iter().map(|u| u.map(|x| x / length)).collect(),
        energy: sample.energies.total() / energy,
    }
}

/// The message without its place, and without the picture of it.
pub(crate) fn first_line(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    line.split_once("specimen.toml:").and_then(|(_, rest)| rest.split_once(": ")).map_or(line, |(_, rest)| rest).into()
}

struct Watch {
    samples: Vec<Sample>,
    until: Instant,
}

impl Observer for Watch {
    fn warning(&mut self, _: &str) {}
    fn limits(&mut self, _: StepLimits) {}
    fn progress(&mut self, _: u64, _: u64) {}
    fn interrupted(&self) -> bool {
        Instant::now() > self.until
    }
    fn samples(&self, steps: u64) -> Vec<u64> {
        let mut wanted: Vec<u64> = (1..=LOOKS).map(|k| k * steps / LOOKS).filter(|k| *k > 0).collect();
        wanted.extend([0, steps.saturating_sub(2), steps.saturating_sub(1)]);
        wanted.sort_unstable();
        wanted.dedup();
        wanted
    }
    fn sample(&mut self, sample: Sample) {
        self.samples.push(sample);
    }
}

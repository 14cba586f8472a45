//! Runs a setting within a time limit, and compares it with a reference.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tensormass_runtime::device::DeviceChoice;
use tensormass_runtime::model::build;
use tensormass_runtime::scene::Scene;
use tensormass_runtime::simulate::{Ending, Observer, Sample, run_on};
use tensormass_runtime::step_limit::StepLimits;
use tensormass_runtime::target::Target;

use crate::space::{Setting, TIMES};
use crate::trajectory::{Errors, Points, Trajectory};

/// How a setting ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// All steps were taken.
    Done,
    /// It was stopped after as long as one setting may take.
    TooSlow,
    /// Why it could not be computed to its end.
    Failed(String),
}

/// A setting that was run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Which.
    pub setting: Setting,
    /// How it ended.
    pub status: Status,
    /// How far it is from the reference, if it came to its end.
    pub errors: Option<Errors>,
    /// Times of all runs in s: of the steps, without reading the scene and meshing.
    pub walls: Vec<f64>,
    /// Forces and force differentials computed, each of the whole body.
    pub evaluations: u64,
    /// Elements times evaluations.
    pub kernels: u64,
    /// Bytes that the plan counts.
    pub bytes: u64,
    /// Steps.
    pub steps: u64,
    /// Elements.
    pub elements: u64,
}

impl Measured {
    /// The median of its times in s.
    pub fn wall(&self) -> f64 {
        let mut walls = self.walls.clone();
        walls.sort_by(f64::total_cmp);
        walls.get(walls.len() / 2).copied().unwrap_or(f64::INFINITY)
    }
}

/// A run, and what it cost.
pub(crate) struct Finished {
    pub status: Status,
    pub trajectory: Option<Trajectory>,
    pub wall: f64,
    pub evaluations: u64,
    pub bytes: u64,
    pub steps: u64,
    pub elements: u64,
}

/// Runs a scene on a device for no longer than a time.
pub(crate) fn run(scene: &Scene, device: &str, points: &Points, longest: Duration, stop: &AtomicBool) -> Finished {
    let mut finished = Finished {
        status: Status::Done,
        trajectory: None,
        wall: f64::INFINITY,
        evaluations: 0,
        bytes: 0,
        steps: scene.solver.steps(),
        elements: 0,
    };
    let failed = |finished: Finished, reason: String| Finished { status: Status::Failed(reason), ..finished };
    let choice: DeviceChoice = match device.parse() {
        Ok(choice) => choice,
        Err(e) => return failed(finished, format!("{e}")),
    };
    let target = match Target::open(&choice, scene.solver.precision) {
        Ok(target) => target,
        Err(e) => return failed(finished, e.to_string()),
    };
    let mut watch = Watch { samples: vec![], until: Instant::now() + longest, stop };
    let outcome = match run_on(&target, scene, None, &mut watch) {
        Ok(outcome) => outcome,
        Err(e) => return failed(finished, e.to_string()),
    };
    let summary = &outcome.summary;
    let number = |value: &serde_json::Value| value.as_u64().unwrap_or(0);
    finished.wall = summary["wall_time_s"].as_f64().unwrap_or(f64::INFINITY);
    finished.evaluations =
        number(&summary["solver"]["force_evaluations"]) + number(&summary["solver"]["tangent_products"]);
    finished.elements = number(&summary["elements"]);
    let buffers = summary["model"]["buffers_bytes"].as_object();
    finished.bytes = buffers.map_or(0, |all| all.values().map(number).sum());
    match outcome.ending {
        Ending::Done => {}
        Ending::Interrupted => return Finished { status: Status::TooSlow, ..finished },
        Ending::Failed(e) => return failed(finished, e.to_string()),
    }
    let mesh = match build(scene) {
        Ok(model) => model.mesh,
        Err(e) => return failed(finished, e.to_string()),
    };
    finished.trajectory = Trajectory::of(&mesh, points, &watch.samples);
    if finished.trajectory.is_none() {
        return failed(finished, "its mesh does not cover the scene's".into());
    }
    finished
}

/// The scene with what is recorded for comparisons, and nothing else.
pub(crate) fn bare(mut changes: Vec<String>, steps: u64) -> Vec<String> {
    changes.extend(["output.frames=0".to_string(), format!("output.probe_every={}", (steps / TIMES).max(1))]);
    changes
}

/// Collects samples, and stops a run that takes too long.
struct Watch<'a> {
    samples: Vec<Sample>,
    until: Instant,
    stop: &'a AtomicBool,
}

impl Observer for Watch<'_> {
    fn warning(&mut self, _: &str) {}
    fn limits(&mut self, _: StepLimits) {}
    fn progress(&mut self, _: u64, _: u64) {}
    fn interrupted(&self) -> bool {
        Instant::now() > self.until || self.stop.load(Ordering::SeqCst)
    }
    fn samples(&self, steps: u64) -> Vec<u64> {
        if steps < TIMES { vec![steps] } else { (1..=TIMES).map(|k| k * steps / TIMES).collect() }
    }
    fn sample(&mut self, sample: Sample) {
        self.samples.push(sample);
    }
}

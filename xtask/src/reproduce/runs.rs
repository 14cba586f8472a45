//! Runs scenes/traction.toml with changes, through the built program, and reads what a run leaves.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use serde_json::Value;

use super::paper::{ELONGATION, Scheme};
use super::series::{Hold, Series, wave_period};
use crate::process::{Failure, cargo, program, read, say};

/// Poisson's ratio of all runs: the largest round one whose critical step, 0.000208 s, admits Table 1's 0.0002 s.
pub const POISSON: f64 = 0.2;
/// End of the ramp and of a run in s, unless said otherwise. Each is a whole number of all nine steps.
pub const RAMP: f64 = 0.48;
/// See [`RAMP`].
pub const DURATION: f64 = 0.96;
/// Run times are measured over at most so many steps.
const TIMED_STEPS: f64 = 500.0;
/// And in the fastest of so many runs: other work on the machine only ever adds.
const TIMED_RUNS: usize = 3;

/// One run to make.
#[derive(Debug, Clone)]
pub struct Spec {
    /// The integrator.
    pub scheme: Scheme,
    /// Time step in s.
    pub step: f64,
    /// When the ramp ends, in s.
    pub ramp: f64,
    /// When the run ends, in s.
    pub duration: f64,
    /// Further changes to the scene, as KEY=VALUE.
    pub set: Vec<String>,
}

impl Spec {
    /// A run as in the tables.
    pub fn new(scheme: Scheme, step: f64) -> Self {
        Self { scheme, step, ramp: RAMP, duration: DURATION, set: Vec::new() }
    }

    /// With another ramp and duration in s.
    pub fn lasting(self, ramp: f64, duration: f64) -> Self {
        Self { ramp, duration, ..self }
    }

    /// With one more change to the scene.
    pub fn with(mut self, change: &str) -> Self {
        self.set.push(change.to_string());
        self
    }

    fn changes(&self) -> Vec<String> {
        let mut changes = vec![
            format!("material.0.parameters.poisson={POISSON}"),
            format!("solver.integrator={}", self.scheme.name()),
            format!("solver.step={}", self.step),
            format!("solver.duration={}", self.duration),
            format!("boundary.3.move={{ x = {{ ramp = [[0.0, 0.0], [{}, {ELONGATION}]] }} }}", self.ramp),
            "output.frames=0".to_string(),
        ];
        changes.extend(self.set.iter().cloned());
        changes
    }
}

/// What a run found.
#[derive(Debug, Clone)]
pub struct Measured {
    /// The modulus in Pa, as read in four ways.
    pub young: Hold,
    /// The modulus in Pa against time.
    pub series: Series,
    /// Steps taken.
    pub steps: u64,
    /// Products with the tangent a step: conjugate-gradient iterations and one or two besides.
    pub products: f64,
    /// The critical step in s, by power iteration.
    pub critical: f64,
}

/// The built program.
#[derive(Debug)]
pub struct Tensormass {
    executable: PathBuf,
    folder: PathBuf,
}

impl Tensormass {
    /// Builds it, optimised.
    ///
    /// # Errors
    /// It does not build.
    pub fn build() -> Result<Self, Failure> {
        say("building tensormass");
        let arguments = ["build", "--release", "--package", "tensormass", "--message-format=json-render-diagnostics"];
        let messages = read("cargo build", cargo(&arguments))?;
        let executable = messages
            .lines()
            .filter_map(|line| serde_json::from_str::<Value>(line).ok())
            .filter(|message| message["target"]["name"] == "tensormass")
            .find_map(|message| message["executable"].as_str().map(PathBuf::from))
            .ok_or_else(|| Failure::Step("cargo build names no program `tensormass`; build it by hand".to_string()))?;
        let folder = executable.with_file_name("reproduce");
        Ok(Self { executable, folder })
    }

    fn call(&self, spec: &Spec, device: &str) -> Command {
        let mut arguments = vec!["run", "scenes/traction.toml", "--quiet", "--device", device];
        let changes = spec.changes();
        arguments.extend(changes.iter().flat_map(|change| ["--set", change]));
        let mut command = program(&self.executable, &arguments);
        command.arg("--out").arg(&self.folder);
        command
    }

    /// The name of the device that `--device` chooses, or what the program says instead.
    pub fn device(&self, device: &str) -> Result<String, String> {
        let spec = Spec::new(Scheme::SemiImplicit, 0.0001).lasting(RAMP, 0.0002).with("mesh.beam.cells=[2, 1, 1]");
        let output = self.call(&spec, device).stdin(Stdio::null()).output().map_err(|e| e.to_string())?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            return Err(said.lines().last().unwrap_or("it says nothing").trim_start_matches("error: ").to_string());
        }
        let summary = self.summary().map_err(|_| "it writes no summary".to_string())?;
        Ok(match &summary["device"] {
            Value::String(name) => name.clone(),
            other => other.to_string(),
        })
    }

    /// Makes a run on a device, `cpu` or `gpu`.
    ///
    /// # Errors
    /// The run fails, or leaves no modulus.
    pub fn run(&self, label: &str, spec: &Spec, device: &str) -> Result<Measured, Failure> {
        say(&format!("{device}: {label}"));
        let summary = self.finish(spec, device)?;
        let path = self.folder.join("probes.csv");
        let table = std::fs::read_to_string(&path).map_err(|e| Failure::Step(format!("{}: {e}", path.display())))?;
        let series = Series::read(&table, "young").ok_or_else(|| {
            Failure::Step("scenes/traction.toml has lost its probe `young`: add it again".to_string())
        })?;
        let steps = summary["steps"].as_u64().unwrap_or_default();
        Ok(Measured {
            young: series.hold(spec.ramp, wave_period()),
            series,
            steps,
            products: summary["solver"]["tangent_products"].as_f64().unwrap_or(f64::NAN) / steps as f64,
            critical: summary["step_limits"]["power_s"].as_f64().unwrap_or(f64::NAN),
        })
    }

    /// Run time of a step in ms: of the first steps without probes, less `start` s that every run takes.
    ///
    /// # Errors
    /// The run fails.
    pub fn step_time(&self, spec: &Spec, device: &str, start: f64) -> Result<f64, Failure> {
        let duration = spec.duration.min(TIMED_STEPS * spec.step);
        let spec = spec.clone().lasting(spec.ramp, duration).with("probe=[]");
        let (seconds, steps) = self.fastest(&spec, device)?;
        Ok((seconds - start).max(0.0) / steps * 1e3)
    }

    /// Seconds that a run of one explicit step takes: reading, critical steps, pipelines.
    ///
    /// # Errors
    /// The run fails.
    pub fn start_time(&self, device: &str) -> Result<f64, Failure> {
        let spec = Spec::new(Scheme::SemiImplicit, 0.0001).lasting(RAMP, 0.0001).with("probe=[]");
        Ok(self.fastest(&spec, device)?.0)
    }

    /// Run time in s of the fastest of some equal runs, and their number of steps.
    fn fastest(&self, spec: &Spec, device: &str) -> Result<(f64, f64), Failure> {
        let mut fastest = (f64::INFINITY, f64::NAN);
        for _ in 0..TIMED_RUNS {
            let summary = self.finish(spec, device)?;
            let number = |key: &str| summary[key].as_f64().unwrap_or(f64::NAN);
            if number("wall_time_s") < fastest.0 {
                fastest = (number("wall_time_s"), number("steps"));
            }
        }
        Ok(fastest)
    }

    fn finish(&self, spec: &Spec, device: &str) -> Result<Value, Failure> {
        let mut command = self.call(spec, device);
        read(&format!("tensormass run with {:?}", spec.changes()), {
            command.stdin(Stdio::null());
            command
        })?;
        self.summary()
    }

    fn summary(&self) -> Result<Value, Failure> {
        let path = self.folder.join("summary.json");
        let text = std::fs::read_to_string(&path).map_err(|e| Failure::Step(format!("{}: {e}", path.display())))?;
        serde_json::from_str(&text).map_err(|e| Failure::Step(format!("{}: {e}", path.display())))
    }
}

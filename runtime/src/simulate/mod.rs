//! Runs a scene: steps a model through time and writes probes, frames and the summary.

mod checkpoint;
mod impulses;
mod run;
mod setup;
mod watch;

use std::path::Path;
#[cfg(feature = "gpu")]
use std::sync::Arc;

use serde_json::Value;

use crate::cpu::{CpuBackend, CpuField, Precision};
use crate::device::DeviceError;
#[cfg(feature = "gpu")]
use crate::gpu::{GpuBackend, GpuField};
use crate::model::{BuildError, Model, build};
use crate::output::OutputError;
use crate::plan::Layout;
use crate::probe::Energies;
use crate::scene::{self, Scene};
use crate::step_limit::StepLimits;
use crate::system::SolveError;
use crate::tangent::{ChosenBy, Tangent};
use crate::target::Target;

use run::Run;

pub use checkpoint::{Checkpoint, CheckpointError};

/// Why a run could not be carried out at all.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The scene cannot be computed.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// Results cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The device cannot compute the scene.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The checkpoint is of another run.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// Threads cannot be started.
    #[error("cannot start {threads} threads: {reason}; set solver.threads to fewer")]
    Threads {
        /// Threads asked for.
        threads: u32,
        /// What the system said.
        reason: String,
    },
}

/// How a run ended. Results were written in every case.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// All steps were taken.
    Done,
    /// The simulation failed; what was computed before is kept.
    Failed(SolveError),
    /// The observer asked to stop.
    Interrupted,
}

/// A finished run.
#[derive(Debug)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// What `summary.json` says.
    pub summary: Value,
    /// Name, unit and last value of each probe.
    pub probes: Vec<(String, &'static str, f64)>,
    /// The critical steps in s, for integrators that step through time.
    pub limits: Option<StepLimits>,
    /// What is allowed but looks wrong.
    pub warnings: Vec<String>,
}

/// Follows a run.
pub trait Observer {
    /// Something that the user should know before the run goes on.
    fn warning(&mut self, text: &str);
    /// The critical steps in s are known; nothing has been stepped yet.
    fn limits(&mut self, limits: StepLimits);
    /// This many of all steps are taken.
    fn progress(&mut self, step: u64, steps: u64);
    /// Whether to stop after the current step.
    fn interrupted(&self) -> bool;
    /// The steps, ascending, after which it wants a [`Sample`]; 0 is the beginning.
    fn samples(&self, _steps: u64) -> Vec<u64> {
        vec![]
    }
    /// The state after one of those.
    fn sample(&mut self, _sample: Sample) {}
}

/// A state for an observer.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// After this step.
    pub step: u64,
    /// Its time in s.
    pub time: f64,
    /// The displacement of each node in m.
    pub displacement: Vec<[f64; 3]>,
    /// Energies in J.
    pub energies: Energies,
    /// The value of each probe, in the scene's order, where probes are recorded at this step; else none.
    pub probes: Vec<f64>,
}

/// An observer that follows nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn warning(&mut self, _: &str) {}
    fn limits(&mut self, _: StepLimits) {}
    fn progress(&mut self, _: u64, _: u64) {}
    fn interrupted(&self) -> bool {
        false
    }
}

/// Runs a scene on the CPU and writes its results into a folder, if one is given.
///
/// # Errors
/// See [`RunError`]; a simulation that fails on its way is not an error but [`Ending::Failed`].
pub fn run(scene: &Scene, out: Option<&Path>, observer: &mut (dyn Observer + Send)) -> Result<Outcome, RunError> {
    run_on(&Target::Cpu, scene, out, observer)
}

/// As [`run`], on a device.
///
/// # Errors
/// See [`RunError`]; a simulation that fails on its way, or whose device does, is not an error but [`Ending::Failed`].
pub fn run_on(
    target: &Target,
    scene: &Scene,
    out: Option<&Path>,
    observer: &mut (dyn Observer + Send),
) -> Result<Outcome, RunError> {
    run_from(target, scene, out, None, observer)
}

/// As [`run_on`], from a checkpoint of the same scene on, if one is given: as if the run had never stopped, bit for bit on the
/// same device. Results that the folder has until then are kept, later ones are replaced.
///
/// # Errors
/// See [`RunError`].
pub fn run_from(
    target: &Target,
    scene: &Scene,
    out: Option<&Path>,
    from: Option<&Checkpoint>,
    observer: &mut (dyn Observer + Send),
) -> Result<Outcome, RunError> {
    let model = build(scene)?;
    let threads = scene.solver.threads;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads as usize)
        .build()
        .map_err(|e| RunError::Threads { threads, reason: e.to_string() })?;
    pool.install(|| match (target, scene.solver.precision) {
        (Target::Cpu, scene::Precision::F32) => on_cpu::<f32>(scene, model, out, from, observer),
        (Target::Cpu, scene::Precision::F64) => on_cpu::<f64>(scene, model, out, from, observer),
        #[cfg(feature = "gpu")]
        (Target::Gpu(gpu, options), scene::Precision::F32) => {
            let backend = GpuBackend::new(Arc::clone(gpu), &model.body, *options)?;
            let field = GpuField::new(&backend, &model.body)?;
            let mut run = Run::new(scene, model, backend, field, Layout::Gpu);
            run.warnings.extend(target.warning());
            if scene.solver.cg.tangent != scene::TangentChoice::Auto {
                run.warnings.push("solver.cg.tangent has no effect on a GPU: there products store nothing".to_owned());
            }
            run.all(out, from, observer)
        }
        #[cfg(feature = "gpu")]
        (Target::Gpu(..), scene::Precision::F64) => Err(DeviceError::Precision.into()),
    })
}

/// Runs a scene on the CPU.
fn on_cpu<R: Precision>(
    scene: &Scene,
    model: Model,
    out: Option<&Path>,
    from: Option<&Checkpoint>,
    observer: &mut (dyn Observer + Send),
) -> Result<Outcome, RunError> {
    let body = &model.body;
    let backend = CpuBackend::<R>::new(body);
    let field = CpuField::<R>::new(&backend, body);
    let (field, tangents, by) = match from.map(Checkpoint::tangents) {
        Some(known) if known.len() == body.batches.len() && !scene.solver.integrator.is_explicit() => {
            (field.with_tangents(known), known.to_vec(), ChosenBy::Checkpoint)
        }
        _ => setup::with_tangents(scene, body, &backend, field),
    };
    let mut run = Run::new(scene, model, backend, field, Layout::Cpu);
    if scene.solver.precision == scene::Precision::F32
        && tangents.contains(&Tangent::Assembled)
        && !scene.solver.integrator.is_explicit()
    {
        run.warnings.push(
            "solver.cg.tangent = \"assembled\" in f32 loses digits where stiffnesses differ: take solver.precision = \"f64\", or \
             another tangent"
                .to_owned(),
        );
    }
    run.tangents = Some((tangents, by));
    run.all(out, from, observer)
}

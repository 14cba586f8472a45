//! `tensormass run`: runs a scene, shows its progress, prints what it found and where the results are.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use tensormass_runtime::device::{DeviceChoice, DeviceError};
use tensormass_runtime::scene::{Override, Scene, load};
use tensormass_runtime::simulate::{Checkpoint, Ending, Observer, Outcome, RunError, run_from};
use tensormass_runtime::step_limit::StepLimits;
use tensormass_runtime::system::SolveError;
use tensormass_runtime::target::Target;

use crate::failure::Failure;
use crate::text;

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Folder for the results [default: out/NAME for scene NAME.toml].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Where to compute: auto is a hardware GPU if there is one and this version can use it, otherwise the CPU; gpu is
    /// any GPU; `tensormass devices` lists their names.
    #[arg(long, value_name = "auto|cpu|gpu|gpu:NAME", default_value_t = DeviceChoice::Auto)]
    device: DeviceChoice,
    /// A checkpoint of the same scene from which to go on, checkpoint.tmc in the folder of the results of the run that wrote it.
    /// Results in --out until then are kept.
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// Measure before the first step how products with the tangent are faster on this CPU; as --set
    /// solver.cg.tangent=measured. Results depend on it in their last digits only.
    #[arg(long)]
    tune: bool,
    /// Print nothing but errors.
    #[arg(long)]
    quiet: bool,
    /// Print the summary as JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// A scene and changes to it; shared by the commands that take a scene.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// The scene file.
    scene: PathBuf,
    /// A change to the scene, such as solver.step=0.01; may be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Number type of state and kernels; as --set solver.precision=...
    #[arg(long, value_name = "f32|f64")]
    precision: Option<String>,
}

impl SceneArguments {
    /// Reads the scene with its changes, and maybe one more.
    pub fn load(&self, also: Option<&str>) -> Result<Scene, Failure> {
        let precision = self.precision.iter().map(|p| format!("solver.precision={p}"));
        let changes: Result<Vec<Override>, _> = self
            .set
            .iter()
            .cloned()
            .chain(precision)
            .chain(also.map(str::to_owned))
            .map(|s| Override::parse(&s))
            .collect();
        let changes = changes.map_err(|e| Failure::bad_input(e.to_string()))?;
        load(&self.scene, &changes).map_err(|e| Failure::bad_input(e.to_string()))
    }
}

/// Runs a scene.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let scene = arguments.scene.load(arguments.tune.then_some("solver.cg.tangent=measured"))?;
    let target = Target::open(&arguments.device, scene.solver.precision)
        .map_err(|e| Failure::bad_input(format!("--device {}: {e}", arguments.device)))?;
    let out = arguments.out.clone().unwrap_or_else(|| default_out(&scene));
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    // Without a handler an interruption ends the process as it always did: nothing else depends on it.
    let _ = ctrlc::set_handler(move || flag.store(true, Ordering::SeqCst));
    let from = arguments.resume.as_deref().map(Checkpoint::read).transpose();
    let from = from.map_err(|e| Failure::bad_input(format!("--resume {e}")))?;
    let mut display = Display::new(interrupted, arguments.quiet || arguments.json, arguments.quiet);
    let outcome = run_from(&target, &scene, Some(&out), from.as_ref(), &mut display).map_err(|e| match e {
        RunError::Checkpoint(e) => Failure::bad_input(format!("--resume {e}")),
        RunError::Build(e) => Failure::bad_input(e.to_string()),
        RunError::Output(e) => Failure::bad_input(e.to_string()),
        RunError::Threads { .. } => Failure::bad_input(e.to_string()),
        RunError::Device(
            e @ (DeviceError::OutOfMemory { .. } | DeviceError::Lost { .. } | DeviceError::Refused(_)),
        ) => Failure::Other(e.to_string()),
        RunError::Device(e) => Failure::bad_input(e.to_string()),
    })?;
    display.finish();
    if arguments.json {
        text::print_json(&outcome.summary)?;
    } else if !arguments.quiet {
        text::print(&report(&outcome, &out.display().to_string()))?;
    }
    match outcome.ending {
        Ending::Done => Ok(()),
        Ending::Failed(e) => {
            let text = format!("{e}\nwhat was computed until then is in {}", out.display());
            // The simulation itself may be sound.
            let device = matches!(e, SolveError::Device(_));
            Err(if device { Failure::Other(text) } else { Failure::Simulation(text) })
        }
        Ending::Interrupted => Err(Failure::Interrupted(format!(
            "interrupted; the results are in {out}; go on with --resume {out}/checkpoint.tmc",
            out = out.display()
        ))),
    }
}

fn default_out(scene: &Scene) -> PathBuf {
    PathBuf::from("out").join(scene.path().file_stem().unwrap_or_default())
}

fn report(outcome: &Outcome, out: &str) -> String {
    let s = &outcome.summary;
    let ended = match outcome.ending {
        Ending::Done => "done",
        Ending::Failed(_) => "failed",
        Ending::Interrupted => "interrupted",
    };
    let mut text = format!(
        "{ended}: {} steps, {} s simulated in {:.2} s ({} force evaluations, {} tangent products)\n",
        s["steps"],
        s["simulated_time_s"],
        s["wall_time_s"].as_f64().unwrap_or_default(),
        s["solver"]["force_evaluations"],
        s["solver"]["tangent_products"]
    );
    let rows: Vec<Vec<String>> =
        outcome.probes.iter().map(|(n, unit, v)| vec![n.clone(), format!("{v:.9e} {unit}")]).collect();
    text += &text::columns("  ", &rows);
    text += &format!("results: {out}/summary.json, probes.csv, frames.pvd\n");
    text
}

/// Shows a run on the terminal.
struct Display {
    interrupted: Arc<AtomicBool>,
    bar: Option<ProgressBar>,
    plain: bool,
    silent: bool,
}

impl Display {
    fn new(interrupted: Arc<AtomicBool>, silent: bool, quiet: bool) -> Self {
        let show = !silent && std::io::stderr().is_terminal();
        let bar = show.then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{bar:40} {pos}/{len} steps, {eta} left");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        Self { interrupted, bar, plain: silent, silent: quiet }
    }

    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| eprintln!("{text}")),
            None => eprintln!("{text}"),
        }
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Observer for Display {
    fn warning(&mut self, text: &str) {
        if !self.silent {
            self.line(&format!("warning: {text}"));
        }
    }

    fn limits(&mut self, limits: StepLimits) {
        if !self.plain {
            self.line(&format!(
                "critical step of explicit integrators: {:.4e} s (element bound, safe), {:.4e} s (power iteration)",
                limits.element, limits.power
            ));
        }
    }

    fn progress(&mut self, step: u64, steps: u64) {
        if let Some(bar) = &self.bar {
            bar.set_length(steps);
            bar.set_position(step);
        }
    }

    fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::SeqCst)
    }
}

//! `tensormass tradeoff`: measures what accuracy of a scene costs, and says which setting is the cheapest for an error.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use tensormass_tradeoff::report::Report;
use tensormass_tradeoff::{Budget, Follow, Metric, Space, Study, StudyError};

use crate::failure::Failure;
use crate::text;

/// Arguments of `tradeoff`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The scene file.
    scene: PathBuf,
    /// A change to the scene, such as solver.duration=1; may be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for the results; a study that it holds already is gone on with.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seconds that it may take.
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0)]
    budget: f64,
    /// Print the cheapest setting measured that has at most this error, as arguments of `run`, and nothing else.
    #[arg(long, value_name = "X")]
    target_error: Option<f64>,
    /// The error by which settings are judged: of the displacement in the mean square, or the greatest; of the probes; of energy.
    #[arg(long, value_name = "displacement|greatest|probes|energy", default_value = "displacement")]
    error: String,
    /// Also measure on this device, besides the CPU: gpu, or gpu:NAME; may be given several times.
    #[arg(long = "device", value_name = "gpu|gpu:NAME")]
    devices: Vec<String>,
}

/// Measures the trade.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let metric = Metric::ALL.into_iter().find(|m| m.name() == arguments.error).ok_or_else(|| {
        let known = Metric::ALL.map(Metric::name).join(", ");
        Failure::bad_input(format!("--error {}: there is no such error; known are {known}", arguments.error))
    })?;
    let is_positive = |x: f64| x > 0.0 && x.is_finite();
    if !is_positive(arguments.budget) || arguments.target_error.is_some_and(|x| !is_positive(x)) {
        return Err(Failure::bad_input("--budget and --target-error must be above 0 and finite"));
    }
    let budget = Budget {
        total: Duration::try_from_secs_f64(arguments.budget)
            .map_err(|e| Failure::bad_input(format!("--budget {}: {e}", arguments.budget)))?,
        metric,
        target: arguments.target_error,
    };
    let space = Space::of(&arguments.scene, &arguments.set, &arguments.devices)
        .map_err(|e| Failure::bad_input(e.to_string()))?;
    let mut display = Display::new(arguments.budget);
    let flag = Arc::clone(&display.stop);
    let _ = ctrlc::set_handler(move || flag.store(true, Ordering::SeqCst));
    let study = Study::conduct(&space, &arguments.out, budget, &mut display).map_err(|e| match e {
        StudyError::Reference(e) => Failure::Other(e.to_string()),
        e => Failure::bad_input(e.to_string()),
    })?;
    let stopped = display.finish();
    let report = Report::new(&space, &study, budget);
    report.write(&arguments.out).map_err(|e| Failure::bad_input(e.to_string()))?;
    if stopped {
        let out = arguments.out.display();
        return Err(Failure::Interrupted(format!(
            "interrupted; what was measured is in {out}; the same command goes on"
        )));
    }
    match arguments.target_error {
        None => text::print(&format!("{}results: {}/report.html\n", report.text(), arguments.out.display())),
        Some(target) => {
            let found = report.recommended().into_iter().find(|(t, _)| *t == target).and_then(|(_, found)| found);
            let found = found.ok_or_else(|| {
                Failure::Other(format!(
                    "no setting measured has an error of {target} or less ({}); give a larger --budget to go on; the front is in {}",
                    report.why_not(target),
                    arguments.out.join("report.html").display()
                ))
            })?;
            text::print(&format!("{}\n", report.arguments(found).join(" ")))
        }
    }
}

/// Shows what a study does.
struct Display {
    stop: Arc<AtomicBool>,
    bar: Option<ProgressBar>,
}

impl Display {
    fn new(budget: f64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{bar:30} {elapsed} of {prefix}: {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_prefix(format!("{budget} s"));
            bar.enable_steady_tick(Duration::from_millis(500));
            bar
        });
        Self { stop: Arc::default(), bar }
    }

    /// Whether the user stopped it.
    fn finish(&self) -> bool {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        self.stop.load(Ordering::SeqCst)
    }
}

impl Follow for Display {
    fn does(&mut self, text: &str, part: f64) {
        match &self.bar {
            Some(bar) => {
                bar.set_position((1000.0 * part) as u64);
                bar.set_message(text.to_string());
            }
            None => eprintln!("{:3.0} % of the budget: {text}", 100.0 * part),
        }
    }

    fn stop(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stop)
    }
}

//! `tensormass law check`: whether a law is what a hyperelastic law should be.

use tensormass_lawbench::check::{Report, Verdict, check};
use tensormass_lawbench::extremes::Options;
use tensormass_lawbench::subject::Subject;
use tensormass_runtime::device::DeviceChoice;

use super::bench;
use crate::failure::Failure;
use crate::text;

/// Arguments of `law check`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A law of this build, or the path of a law file.
    #[arg(value_name = "NAME_OR_FILE")]
    law: String,
    /// States of each combination of strain, rotation and material at which the accuracy is measured.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..))]
    samples: u16,
    /// Of the random states.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// What runs the WGSL: see `law extremes`.
    #[arg(long)]
    device: Option<DeviceChoice>,
    /// Print one object.
    #[arg(long)]
    json: bool,
}

/// Checks and prints.
///
/// # Errors
/// There is no such law, or it cannot be differentiated (bad input); a finding fails (status 3).
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let subject = Subject::open(&arguments.law).map_err(bench::subject)?;
    let device = bench::device(arguments.device.as_ref())?;
    let options = Options { samples: arguments.samples.into(), seed: arguments.seed };
    let report = check(&subject, options, device.as_ref().map_err(Clone::clone)).map_err(bench::extremes)?;
    if arguments.json {
        text::print_json(&bench::json(&report)?)?
    } else {
        text::print(&page(&report))?
    }
    match report.failed().as_slice() {
        [] => Ok(()),
        failed => Err(Failure::Simulation(format!("law `{}` fails: {}", report.law, failed.join("; ")))),
    }
}

fn page(report: &Report) -> String {
    let rows = report.findings.iter().map(|f| {
        let verdict = match f.verdict {
            Verdict::Passed => "ok",
            Verdict::Failed => "FAILED",
            Verdict::Noted => "note",
        };
        vec![verdict.to_string(), f.name.to_string(), f.detail.clone()]
    });
    format!("{}\n{}", report.law, text::columns("  ", &rows.collect::<Vec<_>>()))
}

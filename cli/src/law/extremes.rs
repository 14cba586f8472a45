//! `tensormass law extremes`: how accurate a law's kernels are, over strains, rotations and materials.

use std::path::PathBuf;

use tensormass_lawbench::extremes::{Extremes, Options, extremes};
use tensormass_lawbench::subject::Subject;
use tensormass_lawbench::{csv, heat_map, material, table};
use tensormass_runtime::device::DeviceChoice;

use super::bench;
use crate::failure::Failure;
use crate::text;

/// Arguments of `law extremes`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A law of this build, or the path of a law file.
    #[arg(value_name = "NAME_OR_FILE", required_unless_present = "all", conflicts_with = "all")]
    law: Option<String>,
    /// Every law of this build.
    #[arg(long)]
    all: bool,
    /// Write NAME.csv and NAME.svg (a heat map) into this folder; it is made if need be.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// States of each combination of strain, rotation and material.
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u16).range(1..))]
    samples: u16,
    /// Of the random states.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// What runs the WGSL: cpu (nothing does), gpu (a software one too), auto (a hardware one only) or gpu:NAME [default:
    /// gpu, or nothing where there is none]
    #[arg(long)]
    device: Option<DeviceChoice>,
    /// Print an array with one object a law.
    #[arg(long)]
    json: bool,
}

/// Measures, prints and writes.
///
/// # Errors
/// There is no such law, or it cannot be differentiated (bad input); a law is above the gate (status 3).
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let subjects = match &arguments.law {
        Some(law) => vec![Subject::open(law).map_err(bench::subject)?],
        None => tensormass_runtime::laws().iter().map(Subject::of_build).collect(),
    };
    let device = bench::device(arguments.device.as_ref())?;
    let options = Options { samples: arguments.samples.into(), seed: arguments.seed };
    let mut all: Vec<Extremes> = vec![];
    for subject in &subjects {
        let device = device.as_ref().map_err(Clone::clone);
        let found = extremes(subject, options, device).map_err(bench::extremes)?;
        if let Some(folder) = &arguments.out {
            bench::write(folder, &format!("{}.csv", found.law), &csv::extremes(&found))?;
            bench::write(folder, &format!("{}.svg", found.law), &heat_map::heat_map(&found))?;
        }
        if !arguments.json {
            let names: Vec<String> = material::names(&subject.law).into_iter().map(|(name, _)| name).collect();
            let gap = if all.is_empty() { "" } else { "\n" };
            text::print(&format!("{gap}{}", table::extremes(&found, &names)))?;
            let law = arguments.law.as_deref().unwrap_or(&found.law);
            for replay in found.replays(&names) {
                text::print(&format!("  tensormass law replay {law} {replay}\n"))?;
            }
        }
        all.push(found);
    }
    if arguments.json {
        let objects = all.iter().map(|found| {
            let mut object = bench::json(found)?;
            object["failures"] = found.failures().into();
            Ok(object)
        });
        text::print_json(&objects.collect::<Result<Vec<_>, Failure>>()?.into())?;
    }
    let failed: Vec<&str> = all.iter().filter(|e| !e.failures().is_empty()).map(|e| e.law.as_str()).collect();
    match failed.as_slice() {
        [] => Ok(()),
        names => Err(Failure::Simulation(format!(
            "above the gate: {}; their kernels lose digits that the input carries",
            names.join(", ")
        ))),
    }
}

//! `cargo xtask reproduce tables-1-2`: makes docs/reproduction.md from runs of the traction test; `extremes`: the accuracy
//! of laws; `accuracy`: that of elements.

mod chain;
pub mod choices;
mod conclusions;
pub mod convergence;
mod document;
mod experiments;
pub mod extremes;
mod paper;
mod runs;
mod series;

use crate::process::{Failure, root, say};
use paper::{ROWS, Row};
use runs::{Measured, Spec, Tensormass};

/// One of the paper's rows, run on one device.
#[derive(Debug)]
struct Ours {
    /// What the run found.
    measured: Measured,
    /// Run time of a step in ms.
    step_time: f64,
}

/// A device and the nine rows on it.
#[derive(Debug)]
struct OnDevice {
    /// Its name in the run's summary.
    name: String,
    /// In the order of [`ROWS`].
    rows: Vec<Ours>,
}

/// All that the document reports.
#[derive(Debug)]
struct Results {
    cpu: OnDevice,
    /// Or why there is none.
    gpu: Result<OnDevice, String>,
    experiments: experiments::Experiments,
}

/// Runs all and writes the document.
///
/// # Errors
/// Wrong arguments; the program does not build or a run fails; the asked device is not there.
pub fn call(arguments: &[&str]) -> Result<(), Failure> {
    let asked = devices(arguments)?;
    let tensormass = Tensormass::build()?;
    let gpu = match asked {
        Asked::Cpu => Err("not asked for: `--device cpu`".to_string()),
        Asked::WhatIsThere => tensormass.device("gpu"),
        Asked::Both => Ok(tensormass.device("gpu").map_err(|reason| {
            Failure::Step(format!("--device cpu,gpu: {reason}; use --device cpu, or install a Vulkan device"))
        })?),
    };
    let cpu =
        tensormass.device("cpu").map_err(|reason| Failure::Step(format!("the program does not run: {reason}")))?;
    let results = Results {
        cpu: rows(&tensormass, "cpu", cpu)?,
        gpu: match gpu {
            Ok(name) => Ok(rows(&tensormass, "gpu", name)?),
            Err(reason) => Err(reason),
        },
        experiments: experiments::all(&tensormass)?,
    };
    let path = root().join("docs/reproduction.md");
    std::fs::write(&path, document::document(&results))
        .map_err(|e| Failure::Step(format!("cannot write docs/reproduction.md: {e}; make the folder writable")))?;
    say("wrote docs/reproduction.md: review and commit it");
    Ok(())
}

#[derive(Debug, PartialEq, Eq)]
enum Asked {
    Cpu,
    Both,
    WhatIsThere,
}

fn devices(arguments: &[&str]) -> Result<Asked, Failure> {
    match arguments {
        [] => Ok(Asked::WhatIsThere),
        ["--device", "cpu"] => Ok(Asked::Cpu),
        ["--device", "cpu,gpu"] => Ok(Asked::Both),
        ["--device", other] => Err(Failure::Usage(format!(
            "--device {other}: the comparison needs the CPU; use `cpu` or `cpu,gpu`, or leave it out"
        ))),
        other => Err(Failure::Usage(format!("`reproduce tables-1-2` takes --device only, not `{}`", other.join(" ")))),
    }
}

fn rows(tensormass: &Tensormass, device: &str, name: String) -> Result<OnDevice, Failure> {
    let start = tensormass.start_time(device)?;
    let row = |row: &Row| {
        let spec = Spec::new(row.scheme, row.step);
        let label = format!("{}, step {} s", row.scheme.words(), row.step);
        let step_time = tensormass.step_time(&spec, device, start)?;
        Ok(Ours { measured: tensormass.run(&label, &spec, device)?, step_time })
    };
    Ok(OnDevice { name, rows: ROWS.iter().map(row).collect::<Result<_, Failure>>()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_without_the_cpu_is_refused() {
        assert!(matches!(devices(&["--device", "cpu,gpu"]), Ok(Asked::Both)));
        assert!(matches!(devices(&[]), Ok(Asked::WhatIsThere)));
        assert!(matches!(devices(&["--device", "gpu"]), Err(Failure::Usage(m)) if m.contains("cpu,gpu")));
        assert!(matches!(devices(&["--devices", "cpu"]), Err(Failure::Usage(_))));
    }
}

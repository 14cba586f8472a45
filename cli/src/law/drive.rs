//! `tensormass law drive`: stress-stretch curves of a material point.

use std::path::PathBuf;

use tensormass_lawbench::curve;
use tensormass_lawbench::drive::{DriveError, MODES, Mode, Path, drive};
use tensormass_lawbench::material::{Material, names};
use tensormass_lawbench::subject::Subject;

use super::bench;
use crate::failure::Failure;
use crate::text;

/// Arguments of `law drive`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// uniaxial, biaxial, shear, volumetric or cyclic; faces that are not driven are free.
    #[arg(value_name = "MODE", value_parser = mode)]
    mode: Mode,
    /// A law of this build, or the path of a law file.
    #[arg(value_name = "NAME_OR_FILE")]
    law: String,
    /// The least stretch, or shear.
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    from: Option<f64>,
    /// The greatest.
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Points of the curve; of a cycle, those of each of its four parts.
    #[arg(long, value_name = "N", default_value_t = 41)]
    points: u16,
    /// A material parameter, an array's component as `name[k]`; may be given several times. The others are the law's
    /// defaults, or the middle of their range.
    #[arg(long = "set", value_name = "PARAMETER=VALUE", value_parser = assignment, allow_hyphen_values = true)]
    set: Vec<(String, f64)>,
    /// Write NAME-MODE.csv and NAME-MODE.svg into this folder instead of printing the CSV.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one object instead of CSV.
    #[arg(long)]
    json: bool,
}

fn mode(text: &str) -> Result<Mode, String> {
    let known = || MODES.map(|(name, _)| name).join(", ");
    MODES.iter().find(|(name, _)| *name == text).map(|(_, m)| *m).ok_or_else(|| format!("the modes are {}", known()))
}

pub(super) fn assignment(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("write PARAMETER=VALUE, as young=1e6")?;
    let value =
        value.trim().parse().map_err(|_| format!("`{}` is not a number; write PARAMETER=VALUE", value.trim()))?;
    Ok((name.trim().to_string(), value))
}

/// Drives, and prints or writes the curve.
///
/// # Errors
/// There is no such law, parameter or range (bad input); a point has no equilibrium (status 3).
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let subject = Subject::open(&arguments.law).map_err(bench::subject)?;
    let material = Material::with(&subject, &arguments.set).map_err(bench::material)?;
    let mode = arguments.mode;
    let (from, to) = mode.usual();
    let (from, to) = (arguments.from.unwrap_or(from), arguments.to.unwrap_or(to));
    let path = Path { mode, from, to, points: arguments.points.into() };
    let points = drive(&subject, &material, path).map_err(|error| match error {
        DriveError::Range(_) => Failure::bad_input(error.to_string()),
        DriveError::NoEquilibrium { .. } => Failure::Simulation(error.to_string()),
    })?;
    let values: Vec<String> =
        names(&subject.law).iter().zip(&material.parameters).map(|((name, _), x)| format!("{name} = {x:?}")).collect();
    let name = MODES.iter().find(|(_, m)| *m == mode).map_or("", |(name, _)| name);
    if let Some(folder) = &arguments.out {
        let stem = format!("{}-{name}", subject.name());
        let title = format!("{}, {name}: {}", subject.name(), values.join(", "));
        bench::write(folder, &format!("{stem}.csv"), &curve::table(mode, &points))?;
        bench::write(folder, &format!("{stem}.svg"), &curve::drawing(&title, mode, &points))?;
    }
    if arguments.json {
        let object = serde_json::json!({
            "law": subject.name(),
            "mode": name,
            "material": bench::json(&material)?,
            "points": bench::json(&points)?,
        });
        return text::print_json(&object);
    }
    match &arguments.out {
        Some(folder) => text::print(&format!("wrote {0}/{1}-{name}.csv and .svg\n", folder.display(), subject.name())),
        None => text::print(&curve::table(mode, &points)),
    }
}

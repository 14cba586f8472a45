//! `tensormass law replay`: one state of a material point again, as `law extremes` prints it for what is above the gate.

use tensormass_lawbench::material::Material;
use tensormass_lawbench::replay::{Row, replay};
use tensormass_lawbench::states::State;
use tensormass_lawbench::subject::Subject;
use tensormass_lawbench::table;

use super::bench;
use super::drive::assignment;
use crate::failure::Failure;
use crate::text;

/// Arguments of `law replay`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A law of this build, or the path of a law file.
    #[arg(value_name = "NAME_OR_FILE")]
    law: String,
    /// The displacement gradient G, nine numbers row by row.
    #[arg(
        long,
        value_name = "G00,G01,..",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        required = true
    )]
    gradient: Vec<f64>,
    /// The direction D of dP = dP/dG : D, nine numbers row by row [default: G]
    #[arg(long, value_name = "D00,D01,..", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    direction: Vec<f64>,
    /// A material parameter, an array's component as `name[k]`; see `law drive`.
    #[arg(long = "set", value_name = "PARAMETER=VALUE", value_parser = assignment, allow_hyphen_values = true)]
    set: Vec<(String, f64)>,
    /// Print an array with one object a precision and quantity.
    #[arg(long)]
    json: bool,
}

/// Replays and prints.
///
/// # Errors
/// There is no such law, parameter or state (bad input); a value is above the gate (status 3).
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let subject = Subject::open(&arguments.law).map_err(bench::subject)?;
    let material = Material::with(&subject, &arguments.set).map_err(bench::material)?;
    let gradient = nine("gradient", &arguments.gradient)?;
    let direction = if arguments.direction.is_empty() { gradient } else { nine("direction", &arguments.direction)? };
    let Some(rows) = replay(&subject, &material, &State { gradient, direction }) else {
        let domain = subject.law.domain.as_ref().map_or("its values are defined", |d| d.text.as_str());
        let reason = format!("the state is outside the law's domain; give a gradient where {domain}");
        return Err(Failure::bad_input(reason));
    };
    if arguments.json {
        text::print_json(&bench::json(&rows)?)?
    } else {
        text::print(&page(&subject, &rows))?
    }
    let above: Vec<String> = rows
        .iter()
        .filter(|row| row.gate.is_some_and(|gate| gate.is_nan() || gate > 1.0))
        .map(|row| format!("{} in {}", row.quantity.name(), row.machine.name()))
        .collect();
    if above.is_empty() { Ok(()) } else { Err(Failure::Simulation(format!("above the gate: {}", above.join(", ")))) }
}

fn nine(name: &str, values: &[f64]) -> Result<[f64; 9], Failure> {
    let finite = values.iter().all(|x| x.is_finite());
    values.try_into().ok().filter(|_| finite).ok_or_else(|| {
        Failure::bad_input(format!("--{name} has {} numbers; give nine finite ones, row by row", values.len()))
    })
}

fn page(subject: &Subject, rows: &[Row]) -> String {
    let titles = ["quantity", "in", "form", "gate", "relative", "computed, exact"].map(String::from).to_vec();
    let mut lines = vec![titles];
    for row in rows {
        for (k, (computed, exact)) in row.computed.iter().zip(&row.exact).enumerate() {
            let head = [
                row.quantity.name().to_string(),
                row.machine.name().to_string(),
                row.form.to_string(),
                table::short(row.gate),
                table::short(row.relative),
            ];
            let mut line = if k == 0 { head.to_vec() } else { vec![String::new(); 5] };
            line.push(format!("{computed:.17e}, {exact:.17e}"));
            lines.push(line);
        }
    }
    let mut told = vec![["quantity", "in", "expected", "by the roundings of"].map(String::from).to_vec()];
    for row in rows {
        let most = row.roundings.iter().map(|(what, weight)| format!("{what} {}", table::short(Some(*weight))));
        let (quantity, machine) = (row.quantity.name().to_string(), row.machine.name().to_string());
        told.push(vec![quantity, machine, table::short(Some(row.expected)), most.collect::<Vec<_>>().join(", ")]);
    }
    let (values, told) = (text::columns("  ", &lines), text::columns("  ", &told));
    format!("{}\n{values}\nOf the gate's bounds, for roundings of one unit round-off each:\n{told}", subject.name())
}

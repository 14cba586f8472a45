//! Another program measured in turn with this one, and the ratios of the two: a shared machine's speed cancels in them.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use tensormass_runtime::measure::{Bench, Subject};
use tensormass_runtime::target::Target;

use super::failed;
use super::report::as_json;
use crate::failure::Failure;
use crate::text;

/// An operation of a subject, with its elements a second in each round, of this program and of the other.
struct Row {
    /// Law, element, elements, precision, device, operation.
    name: Vec<String>,
    rounds: Vec<[f64; 2]>,
}

impl Row {
    /// This program's rate over the other's: least, median, greatest.
    fn ratios(&self) -> [f64; 3] {
        let mut ratios: Vec<f64> = self.rounds.iter().map(|[ours, theirs]| ours / theirs).collect();
        ratios.sort_by(f64::total_cmp);
        [ratios[0], ratios[ratios.len() / 2], ratios[ratios.len() - 1]]
    }

    /// The median rate of this program (0) or of the other (1).
    fn rate(&self, which: usize) -> f64 {
        let mut rates: Vec<f64> = self.rounds.iter().map(|r| r[which]).collect();
        rates.sort_by(f64::total_cmp);
        rates[rates.len() / 2]
    }
}

/// The names and rates of all operations in what `bench --json` prints.
fn rates(measured: &[Value]) -> impl Iterator<Item = (Vec<String>, f64)> {
    measured.iter().flat_map(|one| {
        let name = ["law", "element", "elements", "precision", "device"].map(|key| match &one[key] {
            Value::String(s) => s.clone(),
            other => other.to_string(),
        });
        let timings = one["timings"].as_array().map_or(&[][..], Vec::as_slice);
        timings.iter().filter_map(move |t| {
            let operation = t["operation"].as_str()?.to_string();
            Some((name.iter().cloned().chain([operation]).collect(), t["elements_per_s"].as_f64()?))
        })
    })
}

/// What the other program measures.
fn theirs(program: &Path) -> Result<Vec<(Vec<String>, f64)>, Failure> {
    let refused = |reason: String| Failure::bad_input(format!("--baseline {}: {reason}", program.display()));
    // This call's arguments but those of the comparison.
    let mut arguments = vec![];
    let mut given = std::env::args_os().skip(1);
    while let Some(argument) = given.next() {
        let text = argument.to_string_lossy().into_owned();
        match text.as_str() {
            "--baseline" | "--rounds" => drop(given.next()),
            "--json" => {}
            _ if text.starts_with("--baseline=") || text.starts_with("--rounds=") => {}
            _ => arguments.push(argument),
        }
    }
    let output = Command::new(program).args(arguments).arg("--json").output();
    let output = output.map_err(|e| refused(format!("it does not start: {e}")))?;
    if !output.status.success() {
        let error = String::from_utf8_lossy(&output.stderr);
        return Err(refused(format!("it ended with {}: {}", output.status, error.trim())));
    }
    let value: Value = serde_json::from_slice(&output.stdout)
        .map_err(|e| refused(format!("it has to print JSON as `tensormass bench --json` does: {e}")))?;
    let measured = value["measured"].as_array().map_or(&[][..], Vec::as_slice);
    let all: Vec<_> = rates(measured).collect();
    if all.is_empty() {
        return Err(refused("it measured nothing: `measured` has no operation with `elements_per_s`".to_string()));
    }
    Ok(all)
}

/// Measures both in turn and prints the ratios of what both have.
pub fn compare(
    bench: &Bench,
    subjects: &[(Target, Subject)],
    program: &Path,
    rounds: u32,
    as_values: bool,
) -> Result<(), Failure> {
    let mut rows: Vec<Row> = vec![];
    for _ in 0..rounds {
        let mut ours = vec![];
        for (target, subject) in subjects {
            let measured = bench.measure(target, subject).map_err(failed)?;
            ours.push(as_json(subject, &measured, &target.name(), f64::INFINITY));
        }
        let theirs = theirs(program)?;
        for (name, rate) in rates(&ours) {
            let Some((_, other)) = theirs.iter().find(|(n, _)| *n == name) else { continue };
            match rows.iter_mut().find(|row| row.name == name) {
                Some(row) => row.rounds.push([rate, *other]),
                None => rows.push(Row { name, rounds: vec![[rate, *other]] }),
            }
        }
    }
    if rows.is_empty() {
        return Err(Failure::bad_input(format!(
            "--baseline {}: it has none of the operations measured here (law, element, elements, precision, device and \
             operation have to be the same)",
            program.display()
        )));
    }
    if as_values {
        let row = |r: &Row| {
            json!({
                "law": r.name[0], "element": r.name[1], "elements": r.name[2], "precision": r.name[3],
                "device": r.name[4], "operation": r.name[5], "ratios": r.ratios(),
                "elements_per_s": [r.rate(0), r.rate(1)],
            })
        };
        let threads = bench.threads();
        return text::print_json(&json!({
            "rounds": rounds, "threads": threads, "compared": rows.iter().map(row).collect::<Vec<_>>(),
        }));
    }
    let heads =
        ["law", "element", "elements", "precision", "device", "operation", "ratio", "min", "max", "Melements/s"];
    let mut lines = vec![heads.map(String::from).to_vec()];
    lines[0].push("the other's".into());
    for row in &rows {
        let [least, median, greatest] = row.ratios();
        let figures = [median, least, greatest].map(|x| format!("{x:.3}"));
        let rates = [0, 1].map(|which| format!("{:.1}", row.rate(which) / 1e6));
        lines.push(row.name.iter().cloned().chain(figures).chain(rates).collect());
    }
    text::print(&format!(
        "speed as a multiple of the other's: medians of {rounds} rounds in turn, on {} threads\n{}",
        bench.threads(),
        text::columns("  ", &lines)
    ))
}

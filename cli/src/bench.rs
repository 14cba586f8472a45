//! `tensormass bench`: how many elements a second kernels and steps compute on this machine.

mod baseline;

use clap::Args;
use serde_json::{Value, json};
use tensormass_runtime::device::DeviceChoice;
use tensormass_runtime::measure::{self, Bench, MeasureError, Measured, Subject, Timing};
use tensormass_runtime::plan::precision_name;
use tensormass_runtime::scene::Precision;
use tensormass_runtime::target::Target;
use tensormass_runtime::{LawEntry, elements, law, laws, linear_tetrahedron};

use crate::failure::Failure;
use crate::text;

/// Arguments of `bench`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A law, and others if given again; all laws without.
    #[arg(long = "law", value_name = "NAME")]
    laws: Vec<String>,
    /// What the beam is made of; linear tetrahedra without.
    #[arg(long, value_name = "NAME")]
    element: Option<String>,
    /// Elements of the beam, about; other sizes if given again.
    #[arg(long, value_name = "COUNT", default_values_t = [60_000], value_parser = clap::value_parser!(u32).range(1..=50_000_000))]
    elements: Vec<u32>,
    /// Cells of the beam along x, y and z instead, 20x10x10 say.
    #[arg(long, value_name = "XxYxZ", value_parser = cells, conflicts_with = "elements")]
    cells: Vec<[usize; 3]>,
    /// Numbers of state and kernels; the other if given again.
    #[arg(long, value_name = "f32|f64", default_values = ["f32"], value_parser = precision)]
    precision: Vec<Precision>,
    /// The device; GPUs compute in f32.
    #[arg(long, value_name = "auto|cpu|gpu|gpu:NAME", default_value_t = DeviceChoice::Auto)]
    device: DeviceChoice,
    /// Times that each operation is repeated.
    #[arg(long, value_name = "COUNT", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeats: u32,
    /// CPU threads; 0 takes all cores.
    #[arg(long, value_name = "COUNT", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1024))]
    threads: u32,
    /// A program to measure in turn, as often: it is called with the arguments of this call and --json, and has to print what
    /// this program prints then. Another build of tensormass, say.
    #[arg(long, value_name = "PROGRAM")]
    baseline: Option<std::path::PathBuf>,
    /// Rounds of this program and the baseline.
    #[arg(long, value_name = "COUNT", default_value_t = 5, requires = "baseline", value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Print the figures as JSON instead of text.
    #[arg(long)]
    json: bool,
}

fn cells(text: &str) -> Result<[usize; 3], String> {
    let numbers: Option<Vec<usize>> =
        text.split('x').map(|n| n.parse().ok().filter(|n| (1..=10_000).contains(n))).collect();
    let cells = numbers.and_then(|n| <[usize; 3]>::try_from(n).ok());
    cells.filter(|c| c.iter().product::<usize>() <= 10_000_000).ok_or_else(|| {
        "cells are three numbers from 1 to 10000, ten million cells at most, such as 20x10x10".to_string()
    })
}

fn precision(text: &str) -> Result<Precision, String> {
    [Precision::F32, Precision::F64]
        .into_iter()
        .find(|p| precision_name(*p) == text)
        .ok_or_else(|| "precisions are f32 and f64".to_string())
}

/// Measures and prints.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let chosen: Vec<&'static LawEntry> = if arguments.laws.is_empty() {
        laws().iter().collect()
    } else {
        let find = |name: &String| law(name).ok_or_else(|| unknown("law", name, laws().iter().map(|l| l.info.name)));
        arguments.laws.iter().map(find).collect::<Result<_, _>>()?
    };
    let bodies = || elements().iter().filter(|e| e.info.dimension > 1);
    let element = match &arguments.element {
        None => linear_tetrahedron(),
        Some(name) => bodies()
            .find(|e| e.info.name == *name)
            .ok_or_else(|| unknown("element", name, bodies().map(|e| e.info.name)))?,
    };
    let bench = Bench::new(arguments.threads as usize).map_err(failed)?;
    let beams: Vec<[usize; 3]> = match arguments.cells.as_slice() {
        [] => arguments.elements.iter().map(|&count| measure::cells(element, count as usize)).collect(),
        given => given.to_vec(),
    };
    let mut subjects = vec![];
    for &precision in &arguments.precision {
        let target = Target::open(&arguments.device, precision)
            .map_err(|e| Failure::bad_input(format!("--device {}: {e}", arguments.device)))?;
        for &cells in &beams {
            for &law in &chosen {
                let repeats = arguments.repeats as usize;
                subjects.push((target.clone(), Subject { law, element, cells, precision, repeats }));
            }
        }
    }
    if let Some(program) = &arguments.baseline {
        return baseline::compare(&bench, &subjects, program, arguments.rounds, arguments.json);
    }
    let bandwidth = bench.triad();
    if !arguments.json {
        text::print(&format!(
            "memory triad {:.1} GB/s on {} threads; medians of {}; compare figures of one call only\n",
            bandwidth / 1e9,
            bench.threads(),
            arguments.repeats
        ))?;
    }
    let mut rows = vec![];
    for (target, subject) in &subjects {
        let measured = bench.measure(target, subject).map_err(failed)?;
        if arguments.json {
            rows.push(as_json(subject, &measured, &target.name(), bandwidth));
        } else {
            text::print(&as_text(subject, &measured, &target.name(), bandwidth))?;
        }
    }
    if arguments.json {
        let (triad, threads) = (bandwidth, bench.threads());
        text::print_json(&json!({ "triad_bytes_per_s": triad, "threads": threads, "measured": rows }))?;
    }
    Ok(())
}

fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Failure {
    let known: Vec<&str> = known.collect();
    Failure::bad_input(format!("there is no {what} `{name}`; {}", text::suggest(name, &known, &format!("{what}s"))))
}

fn failed(error: MeasureError) -> Failure {
    match error {
        MeasureError::Build(_) | MeasureError::Device(_) | MeasureError::Threads { .. } => {
            Failure::bad_input(error.to_string())
        }
        MeasureError::LeftDomain(_) | MeasureError::Step(_) => Failure::Simulation(error.to_string()),
    }
}

/// The share of the triad's bandwidth that an operation's least traffic takes.
fn share(bytes: f64, elements: usize, seconds: f64, bandwidth: f64) -> f64 {
    bytes * elements as f64 / seconds / bandwidth
}

fn as_text(subject: &Subject, measured: &Measured, device: &str, bandwidth: f64) -> String {
    let elements = measured.elements;
    let mut rows = vec![
        ["", "median ms", "min", "max", "Melements/s", "flops/element", "Gflop/s", "bytes/element", "of the triad"]
            .map(String::from)
            .to_vec(),
    ];
    for timing in &measured.timings {
        let median = timing.median();
        let ms = |s: f64| format!("{:.3}", 1e3 * s);
        let rate = |each: f64| each * timing.rate(elements);
        let [flops, gflops] = match timing.flops {
            Some(flops) => [flops.to_string(), format!("{:.2}", rate(flops.into()) / 1e9)],
            None => [String::new(), String::new()],
        };
        let [bytes, part] = match timing.bytes {
            Some(bytes) => {
                [format!("{bytes:.0}"), format!("{:.0} %", 100.0 * share(bytes, elements, median, bandwidth))]
            }
            None => [String::new(), String::new()],
        };
        let (first, last) = (timing.seconds[0], timing.seconds[timing.seconds.len() - 1]);
        let melements = format!("{:.2}", rate(1.0) / 1e6);
        rows.push(vec![
            timing.operation.into(),
            ms(median),
            ms(first),
            ms(last),
            melements,
            flops,
            gflops,
            bytes,
            part,
        ]);
    }
    format!(
        "{}, {} {}, {} nodes, {}, {device}\n{}",
        subject.law.info.name,
        elements,
        subject.element.info.name,
        measured.nodes,
        precision_name(subject.precision),
        text::columns("  ", &rows)
    )
}

fn as_json(subject: &Subject, measured: &Measured, device: &str, bandwidth: f64) -> Value {
    let elements = measured.elements;
    let timing = |t: &Timing| {
        json!({
            "operation": t.operation, "seconds": t.seconds, "median_s": t.median(),
            "elements_per_s": t.rate(elements), "flops_per_element": t.flops,
            "bytes_per_element": t.bytes,
            "share_of_triad": t.bytes.map(|bytes| share(bytes, elements, t.median(), bandwidth)),
        })
    };
    json!({
        "law": subject.law.info.name, "element": subject.element.info.name, "elements": elements,
        "nodes": measured.nodes, "precision": precision_name(subject.precision), "device": device,
        "timings": measured.timings.iter().map(timing).collect::<Vec<_>>(),
    })
}

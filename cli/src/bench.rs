//! `tensormass bench`: how many elements a second kernels and steps compute on this machine.

mod baseline;
mod omissions;
mod report;
mod roofline;

use std::io::Write;

use clap::Args;
use serde_json::json;
use tensormass_runtime::device::DeviceChoice;
#[cfg(feature = "gpu")]
use tensormass_runtime::gpu::GpuOptions;
use tensormass_runtime::measure::{self, Bench, Body, MeasureError, Subject};
use tensormass_runtime::plan::precision_name;
use tensormass_runtime::scene::{Precision, TangentChoice};
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
    /// A Gmsh file in metres instead, of elements of one kind; others if given again.
    #[arg(long, value_name = "FILE.msh", conflicts_with_all = ["elements", "cells"])]
    mesh: Vec<std::path::PathBuf>,
    /// Numbers of state and kernels; the other if given again.
    #[arg(long, value_name = "f32|f64", default_values = ["f32"], value_parser = precision)]
    precision: Vec<Precision>,
    /// The device; GPUs compute in f32.
    #[arg(long, value_name = "auto|cpu|gpu|gpu:NAME", default_value_t = DeviceChoice::Auto)]
    device: DeviceChoice,
    /// Times that each operation is repeated.
    #[arg(long, value_name = "COUNT", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeats: u32,
    /// Measure an implicit step too: with and without a preconditioner, and its parts.
    #[arg(long, conflicts_with = "baseline")]
    implicit: bool,
    /// Measure instead what it gains to leave out what a scene does not require: steps of scenes with something and without
    /// it, in turn.
    #[arg(long, conflicts_with_all = ["baseline", "implicit", "mesh", "laws", "stiffness_ratio", "tangent", "roofline"])]
    omissions: bool,
    /// How many times stiffer the material is in one half of the beam than in the other.
    #[arg(long, value_name = "RATIO", default_value_t = 1.0, value_parser = ratio)]
    stiffness_ratio: f64,
    /// How products with the tangent are computed on a CPU, as `solver.cg.tangent` of scenes.
    #[arg(long, value_name = "auto|stored|recomputed|assembled", default_value = "auto", value_parser = tangent)]
    tangent: TangentChoice,
    /// Invocations of a GPU's work group, a power of two up to 256; others if given again [default: 64].
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=256))]
    work_group: Vec<u32>,
    /// Elements that one invocation on a GPU computes; others if given again [default: 1].
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=1024))]
    per_invocation: Vec<u32>,
    /// A file for a picture: what was measured under the roofs of this machine's bandwidth and operations a second.
    #[arg(long, value_name = "FILE.svg", conflicts_with = "baseline")]
    roofline: Option<std::path::PathBuf>,
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

fn ratio(text: &str) -> Result<f64, String> {
    let ratio = text.parse().ok().filter(|r: &f64| (1e-9..=1e9).contains(r));
    ratio.ok_or_else(|| "a ratio is a number from 1e-9 to 1e9".to_string())
}

fn precision(text: &str) -> Result<Precision, String> {
    [Precision::F32, Precision::F64]
        .into_iter()
        .find(|p| precision_name(*p) == text)
        .ok_or_else(|| "precisions are f32 and f64".to_string())
}

fn tangent(text: &str) -> Result<TangentChoice, String> {
    let all = TangentChoice::ALL.into_iter().filter(|choice| *choice != TangentChoice::Measured);
    all.into_iter()
        .find(|choice| choice.name() == text)
        .ok_or_else(|| "tangents are auto, stored, recomputed and assembled".to_string())
}

/// Measures and prints.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let chosen: Vec<&'static LawEntry> = if arguments.laws.is_empty() {
        laws().iter().collect()
    } else {
        let find = |name: &String| law(name).ok_or_else(|| unknown("law", name, laws().iter().map(|l| l.info.name)));
        arguments.laws.iter().map(find).collect::<Result<_, _>>()?
    };
    let solids = || elements().iter().filter(|e| e.info.dimension > 1);
    let element = match &arguments.element {
        None => linear_tetrahedron(),
        Some(name) => solids()
            .find(|e| e.info.name == *name)
            .ok_or_else(|| unknown("element", name, solids().map(|e| e.info.name)))?,
    };
    let bench = Bench::new(arguments.threads as usize).map_err(failed)?;
    if arguments.omissions {
        return omissions::call(arguments, &bench, element);
    }
    let mut bodies: Vec<Body> = arguments.cells.iter().map(|&cells| Body::Beam(cells)).collect();
    for file in &arguments.mesh {
        // A scene takes files as relative to its own place.
        let whole = std::path::absolute(file);
        bodies.push(Body::File(whole.map_err(|e| Failure::bad_input(format!("--mesh {}: {e}", file.display())))?));
    }
    if bodies.is_empty() {
        let cells = arguments.elements.iter().map(|&count| measure::cells(element, count as usize));
        bodies.extend(cells.map(Body::Beam));
    }
    let mut subjects = vec![];
    for &precision in &arguments.precision {
        let target = Target::open(&arguments.device, precision)
            .map_err(|e| Failure::bad_input(format!("--device {}: {e}", arguments.device)))?;
        for target in tuned(&target, arguments)? {
            for body in &bodies {
                for &law in &chosen {
                    let (repeats, stiffness_ratio) = (arguments.repeats as usize, arguments.stiffness_ratio);
                    let (body, tangent) = (body.clone(), arguments.tangent);
                    let subject = Subject { law, element, body, precision, repeats, stiffness_ratio, tangent };
                    subjects.push((target.clone(), subject));
                }
            }
        }
    }
    if let Some(program) = &arguments.baseline {
        return baseline::compare(&bench, &subjects, program, arguments.rounds, arguments.json);
    }
    // What cannot be written is said before anything is measured.
    let mut picture = match &arguments.roofline {
        Some(file) => Some(std::fs::File::create(file).map_err(|e| no_picture(file, &e))?),
        None => None,
    };
    let bandwidth = bench.triad();
    let peaks: Vec<(Precision, f64)> = arguments.precision.iter().map(|&p| (p, bench.peak(p))).collect();
    if !arguments.json {
        let of_precision =
            |(p, peak): &(Precision, f64)| format!(", {:.0} Gflop/s in {}", peak / 1e9, precision_name(*p));
        text::print(&format!(
            "memory triad {:.1} GB/s{} on {} threads; medians of {}; compare figures of one call only\n",
            bandwidth / 1e9,
            peaks.iter().map(of_precision).collect::<String>(),
            bench.threads(),
            arguments.repeats
        ))?;
    }
    let (mut rows, mut dots) = (vec![], vec![]);
    for (target, subject) in &subjects {
        let measured = bench.measure(target, subject).map_err(failed)?;
        let implicit = if arguments.implicit { Some(bench.implicit(target, subject).map_err(failed)?) } else { None };
        dots.extend(roofline::dots(subject, &measured));
        if arguments.json {
            let mut row = report::as_json(subject, &measured, &name(target), bandwidth);
            if let Some(implicit) = &implicit {
                row["implicit_step"] = report::implicit_as_json(subject, implicit);
            }
            rows.push(row);
        } else {
            text::print(&report::as_text(subject, &measured, &name(target), bandwidth))?;
            if let Some(implicit) = &implicit {
                text::print(&report::implicit_as_text(subject, implicit))?;
            }
        }
    }
    if let (Some(picture), Some(file)) = (&mut picture, &arguments.roofline) {
        let drawn = roofline::picture(bandwidth, &peaks, &dots);
        picture.write_all(drawn.as_bytes()).map_err(|e| no_picture(file, &e))?;
    }
    if arguments.json {
        let (triad, threads) = (bandwidth, bench.threads());
        let of_precision = |(p, peak): &(Precision, f64)| (precision_name(*p).to_string(), json!(peak));
        let peaks: serde_json::Map<_, _> = peaks.iter().map(of_precision).collect();
        text::print_json(&json!({
            "triad_bytes_per_s": triad, "peak_flops_per_s": peaks, "threads": threads, "measured": rows,
        }))?;
    }
    Ok(())
}

fn no_picture(file: &std::path::Path, error: &std::io::Error) -> Failure {
    Failure::bad_input(format!("--roofline {}: {error}", file.display()))
}

/// A target with each combination of what may be tuned on a GPU.
fn tuned(target: &Target, arguments: &Arguments) -> Result<Vec<Target>, Failure> {
    let given = !arguments.work_group.is_empty() || !arguments.per_invocation.is_empty();
    match target {
        Target::Cpu if given => Err(Failure::bad_input(
            "--work-group and --per-invocation are of GPUs, and this call measures the CPU; add --device gpu",
        )),
        Target::Cpu => Ok(vec![Target::Cpu]),
        #[cfg(feature = "gpu")]
        Target::Gpu(gpu, options) => {
            let or = |given: &[u32], default| if given.is_empty() { vec![default] } else { given.to_vec() };
            let mut targets = vec![];
            for work_group_size in or(&arguments.work_group, options.work_group_size) {
                if !work_group_size.is_power_of_two() {
                    return Err(Failure::bad_input(format!("--work-group {work_group_size}: not a power of two")));
                }
                for elements_per_invocation in or(&arguments.per_invocation, options.elements_per_invocation) {
                    let options = GpuOptions { work_group_size, elements_per_invocation, ..*options };
                    targets.push(Target::Gpu(std::sync::Arc::clone(gpu), options));
                }
            }
            Ok(targets)
        }
    }
}

/// A target's name, with what is tuned on it.
fn name(target: &Target) -> String {
    match target {
        Target::Cpu => target.name(),
        #[cfg(feature = "gpu")]
        Target::Gpu(_, GpuOptions { work_group_size, elements_per_invocation, .. }) => {
            let elements = if *elements_per_invocation == 1 { "element" } else { "elements" };
            format!("{}, groups of {work_group_size}, {elements_per_invocation} {elements} each", target.name())
        }
    }
}

fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Failure {
    let known: Vec<&str> = known.collect();
    Failure::bad_input(format!("there is no {what} `{name}`; {}", text::suggest(name, &known, &format!("{what}s"))))
}

fn failed(error: MeasureError) -> Failure {
    match error {
        MeasureError::Build(_) | MeasureError::Device(_) | MeasureError::Kind { .. } | MeasureError::Threads { .. } => {
            Failure::bad_input(error.to_string())
        }
        MeasureError::Run(error) => Failure::bad_input(error.to_string()),
        MeasureError::LeftDomain(_) | MeasureError::Step(_) => Failure::Simulation(error.to_string()),
    }
}

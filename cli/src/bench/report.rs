//! What was measured, as text and as JSON.

use serde_json::{Value, json};
use tensormass_runtime::measure::{Implicit, Measured, STEP, Subject, TOLERANCE, Timing};
use tensormass_runtime::plan::precision_name;

use crate::text;

/// The share of the triad's bandwidth that an operation's least traffic takes.
fn share(bytes: f64, elements: usize, seconds: f64, bandwidth: f64) -> f64 {
    bytes * elements as f64 / seconds / bandwidth
}

/// The operations of a subject.
pub(super) fn as_text(subject: &Subject, measured: &Measured, device: &str, bandwidth: f64) -> String {
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

/// As [`as_text`].
pub(super) fn as_json(subject: &Subject, measured: &Measured, device: &str, bandwidth: f64) -> Value {
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

/// An implicit step of a subject.
pub(super) fn implicit_as_text(subject: &Subject, implicit: &Implicit) -> String {
    let ms = |s: f64| format!("{:.3}", 1e3 * s);
    let mut rows = vec![["", "iterations", "residual", "median ms", "min", "max"].map(String::from).to_vec()];
    for s in &implicit.solutions {
        let (median, last) = (s.median(), s.seconds[s.seconds.len() - 1]);
        let residual = format!("{:.1e}", s.residual);
        let reached = if s.residual <= TOLERANCE { "" } else { " (not reached)" };
        let name = format!("{}{reached}", s.preconditioner);
        rows.push(vec![name, s.iterations.to_string(), residual, ms(median), ms(s.seconds[0]), ms(last)]);
    }
    let all: f64 = implicit.parts.iter().map(|(_, seconds)| seconds).sum();
    let part = |(name, seconds): &(&str, f64)| {
        vec![(*name).to_string(), ms(*seconds), format!("{:.1} %", 100.0 * seconds / all)]
    };
    let parts: Vec<Vec<String>> = implicit.parts.iter().map(part).collect();
    format!(
        "  implicit step of {STEP} s to {TOLERANCE:.0e} in the true residual, stiffness ratio {}\n{}  its parts with {}, ms\n{}",
        subject.stiffness_ratio,
        text::columns("    ", &rows),
        implicit.solutions[0].preconditioner,
        text::columns("    ", &parts)
    )
}

/// As [`implicit_as_text`].
pub(super) fn implicit_as_json(subject: &Subject, implicit: &Implicit) -> Value {
    let solutions: Vec<Value> = implicit
        .solutions
        .iter()
        .map(|s| {
            json!({
                "preconditioner": s.preconditioner, "iterations": s.iterations, "residual": s.residual,
                "seconds": s.seconds, "median_s": s.median(),
            })
        })
        .collect();
    let parts: serde_json::Map<String, Value> =
        implicit.parts.iter().map(|(name, seconds)| ((*name).to_string(), json!(seconds))).collect();
    json!({
        "step_s": STEP, "tolerance": TOLERANCE, "stiffness_ratio": subject.stiffness_ratio, "solutions": solutions,
        "parts_s": parts,
    })
}

//! `tensormass bench --omissions`: what it gains to leave out what a scene does not require.

use serde_json::{Value, json};
use tensormass_runtime::ElementEntry;
use tensormass_runtime::measure::{Bench, Omission, Setting, cells};
use tensormass_runtime::plan::precision_name;
use tensormass_runtime::target::Target;

use super::{Arguments, failed, name};
use crate::failure::Failure;
use crate::text;

/// Measures and prints.
pub(super) fn call(arguments: &Arguments, bench: &Bench, element: &'static ElementEntry) -> Result<(), Failure> {
    let beams: Vec<[usize; 3]> = if arguments.cells.is_empty() {
        arguments.elements.iter().map(|&count| cells(element, count as usize)).collect()
    } else {
        arguments.cells.clone()
    };
    let mut rows = vec![];
    for &precision in &arguments.precision {
        let target = Target::open(&arguments.device, precision)
            .map_err(|e| Failure::bad_input(format!("--device {}: {e}", arguments.device)))?;
        for &cells in &beams {
            let (repeats, threads) = (arguments.repeats as usize, arguments.threads as usize);
            let setting = Setting { element, cells, precision, repeats, threads };
            let measured = bench.omissions(&target, &setting).map_err(failed)?;
            if arguments.json {
                rows.push(as_json(&setting, &target, &measured));
            } else {
                text::print(&as_text(&setting, &target, bench.threads(), &measured))?;
            }
        }
    }
    if arguments.json {
        return text::print_json(&json!({ "threads": bench.threads(), "omissions": rows }));
    }
    Ok(())
}

fn as_text(setting: &Setting, target: &Target, threads: usize, measured: &[Omission]) -> String {
    let title = ["what is left out", "law", "ms with", "without", "ratio", "least", "most", "MB with", "without"];
    let mut rows = vec![title.map(String::from).to_vec()];
    for omission in measured {
        let ratios = omission.ratios();
        let ms = |seconds: &[f64]| {
            let mut ascending = seconds.to_vec();
            ascending.sort_by(f64::total_cmp);
            format!("{:.3}", 1e3 * ascending[ascending.len() / 2])
        };
        let mb = |bytes: usize| format!("{:.2}", bytes as f64 / 1e6);
        let ratio = |ratio: f64| format!("{ratio:.2}");
        rows.push(vec![
            omission.name.to_string(),
            omission.law.to_string(),
            ms(&omission.with.seconds),
            ms(&omission.without.seconds),
            ratio(omission.ratio()),
            ratio(ratios[0]),
            ratio(ratios[ratios.len() - 1]),
            mb(omission.with.bytes),
            mb(omission.without.bytes),
        ]);
    }
    format!(
        "times of a step with and without, medians of {} runs in turn on {threads} threads; {:?} cells of {}, {}, {}\n{}",
        setting.repeats,
        setting.cells,
        setting.element.info.name,
        precision_name(setting.precision),
        name(target),
        text::columns("  ", &rows)
    )
}

fn as_json(setting: &Setting, target: &Target, measured: &[Omission]) -> Value {
    let side = |side: &tensormass_runtime::measure::Side| json!({ "step_seconds": side.seconds, "allocated_bytes": side.bytes, "own_kernels": side.kernels });
    let one = |omission: &Omission| {
        json!({
            "name": omission.name, "law": omission.law, "ratio": omission.ratio(), "with": side(&omission.with),
            "without": side(&omission.without),
        })
    };
    json!({
        "device": name(target), "precision": precision_name(setting.precision), "cells": setting.cells,
        "element": setting.element.info.name, "measured": measured.iter().map(one).collect::<Vec<_>>(),
    })
}

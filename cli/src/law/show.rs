//! `tensormass law show`: all that is known about one law.

use serde_json::{Value, json};
use tensormass_runtime::{Acceptance, LawEntry, Operations, ParameterInfo};

use super::{names, review};
use crate::failure::Failure;
use crate::text;

/// Arguments of `law show`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The law's name, as `law list` prints it.
    name: String,
    /// Print one object, for programs.
    #[arg(long)]
    json: bool,
}

/// Prints one law.
///
/// # Errors
/// No law has this name; the output cannot be written.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let name = &arguments.name;
    let Some(law) = tensormass_runtime::law(name) else {
        let remedy = text::suggest(name, &names(), "the laws of this build are");
        return Err(Failure::bad_input(format!("there is no law `{name}`; {remedy}")));
    };
    if arguments.json { text::print_json(&json(law)) } else { text::print(&page(law)) }
}

/// A law as JSON.
pub fn json(entry: &LawEntry) -> Value {
    let law = entry.info;
    json!({
        "name": law.name,
        "docs": law.docs,
        "reviewed": law.reviewed,
        "hash": format!("{:016x}", law.hash),
        "domain": law.domain,
        "small_strain": law.small_strain,
        "dissipative": entry.damping.is_some(),
        "moduli": law.moduli,
        "valid_stretches": law.valid_stretches.map(|(least, greatest)| [least, greatest]),
        "accepted": law.accepted.iter().map(accepted_json).collect::<Value>(),
        "parameters": law.parameters.iter().map(parameter_json).collect::<Value>(),
        "constants": law.constants,
        "structure": {
            "linear": law.structure.linear,
            "isotropic": law.structure.isotropic,
            "uses_j": law.structure.uses_j,
            "uses_fibres": law.structure.uses_fibres,
            "polynomial": law.structure.polynomial,
        },
        "operations": law.operations.iter().map(operations_json).collect::<Value>(),
    })
}

fn accepted_json(a: &Acceptance) -> Value {
    json!({ "kind": a.kind, "constant": a.constant, "reason": a.reason })
}

fn parameter_json(p: &ParameterInfo) -> Value {
    json!({
        "name": p.name,
        "docs": p.docs,
        "unit": p.unit,
        "range": [p.range.0, p.range.1],
        "default": p.default,
        "per_element": p.per_element,
        "components": p.len,
        "direction": p.direction,
    })
}

fn operations_json(o: &Operations) -> Value {
    json!({
        "kernel": o.kernel,
        "additions": o.additions,
        "multiplications": o.multiplications,
        "divisions": o.divisions,
        "functions": o.functions,
        "selects": o.selects,
        "arithmetic": o.arithmetic(),
    })
}

/// A law as a page of text.
fn page(entry: &LawEntry) -> String {
    let law = entry.info;
    let dissipation = match entry.damping {
        None => "none",
        Some(damping) if damping.linear => "yes: damping is linear in the strain rate",
        Some(_) => "yes",
    };
    let mut page = format!("{} ({})\n", law.name, review(law.reviewed));
    for line in law.docs.lines() {
        page += &format!("  {}\n", line.trim());
    }
    let trusted = law.valid_stretches.map(|(least, greatest)| format!("{least} to {greatest}"));
    let facts = [
        ["domain", law.domain.unwrap_or("everywhere")],
        ["small strain", if law.small_strain { "yes: rotation stresses it" } else { "no" }],
        ["dissipation", dissipation],
        ["small-strain moduli", law.moduli.unwrap_or("not declared")],
        ["trusted stretches", trusted.as_deref().unwrap_or("not declared")],
        ["linear", if law.structure.linear { "yes: dP does not depend on G" } else { "no" }],
        ["isotropic", if law.structure.isotropic { "yes" } else { "no" }],
        ["uses J", if law.structure.uses_j { "yes" } else { "no" }],
        ["uses fibres", if law.structure.uses_fibres { "yes" } else { "no" }],
        ["polynomial", if law.structure.polynomial { "yes: P and dP are polynomials in G" } else { "no" }],
    ];
    page += "\n";
    page += &text::columns("", &facts.map(|row| row.map(String::from).to_vec()));
    if !law.accepted.is_empty() {
        page += "\naccepted without proof\n";
        let rows = law.accepted.iter().map(|a| [a.kind, a.constant, a.reason].map(String::from).to_vec());
        page += &text::columns("  ", &rows.collect::<Vec<_>>());
    }
    page += "\nparameters\n";
    page += &text::columns("  ", &law.parameters.iter().map(parameter).collect::<Vec<_>>());
    page += "\nconstants, computed once a material\n";
    let constants = law.constants.iter().enumerate().map(|(k, c)| vec![k.to_string(), (*c).to_string()]);
    page += &text::columns("  ", &constants.collect::<Vec<_>>());
    page += "\noperations of one evaluation\n";
    let mut rows = vec![["kernel", "+ -", "*", "/", "sum", "functions", "selects"].map(String::from).to_vec()];
    rows.extend(law.operations.iter().map(|o| {
        let counts = [o.additions, o.multiplications, o.divisions, o.arithmetic(), o.functions, o.selects];
        std::iter::once(o.kernel.to_string()).chain(counts.map(|n| n.to_string())).collect()
    }));
    page += &text::columns("  ", &rows);
    page
}

fn parameter(p: &ParameterInfo) -> Vec<String> {
    let range = format!("{} to {}", number(p.range.0), number(p.range.1));
    let name = if p.len > 1 && !p.direction { format!("{}[{}]", p.name, p.len) } else { p.name.to_string() };
    let default = match p.default {
        None => "no default".to_string(),
        Some(values) => format!("default {}", values.iter().copied().map(number).collect::<Vec<_>>().join(", ")),
    };
    let scope = if p.per_element { "per element" } else { "" };
    vec![
        name,
        p.unit.to_string(),
        if p.direction { "direction".to_string() } else { range },
        default,
        scope.to_string(),
        p.docs.lines().map(str::trim).collect::<Vec<_>>().join(" "),
    ]
}

/// A number as one would write it in a scene: without an exponent where that is short.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
}

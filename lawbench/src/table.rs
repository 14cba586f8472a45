//! Measurements as text for the reader.

use crate::extremes::{Adapter, Cell, Extremes};
use crate::gate::{Machine, QUANTITIES, Quantity};
use crate::states::STRAINS;

/// Rows of cells as lines, columns aligned to the right but the first.
pub fn columns(rows: &[Vec<String>]) -> String {
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|t| t.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..count).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().enumerate().map(|(c, text)| {
            let width = widths[c];
            if c == 0 { format!("{text:<width$}") } else { format!("{text:>width$}") }
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_string() + "\n"
    };
    rows.iter().map(line).collect()
}

/// An error in two digits: `3.2e-7`, `0.41`, `-` where nothing was measured.
pub fn short(x: Option<f64>) -> String {
    match x {
        None => "-".into(),
        Some(x) if x == 0.0 || (0.01..100.0).contains(&x) => format!("{x:.2}"),
        Some(x) if x.is_finite() => format!("{x:.1e}"),
        Some(x) => x.to_string(),
    }
}

/// The column titles of [`rows`].
pub fn titles() -> Vec<String> {
    let of = |q: Quantity| [format!("{} gate", q.name()), "relative".to_string(), "turned".to_string()];
    std::iter::once("strain".to_string()).chain(QUANTITIES.into_iter().flat_map(of)).collect()
}

/// One row a strain: of each quantity the worst part of its bound, and the worst relative error, unrotated and turned,
/// over the materials.
pub fn rows(extremes: &Extremes, machine: Machine) -> Vec<Vec<String>> {
    let worst = |q: Quantity, strain: f64, of: &dyn Fn(&Cell) -> Option<f64>| {
        let cells = extremes.cells.iter().filter(|c| (c.machine, c.quantity, c.strain) == (machine, q, strain));
        cells.filter(|c| c.states > 0).filter_map(of).reduce(f64::max)
    };
    let row = |strain: f64| {
        let mut row = vec![format!("{strain:e}")];
        for q in QUANTITIES {
            row.push(short(worst(q, strain, &|c| Some(c.gate))));
            row.push(short(worst(q, strain, &|c| (c.rotation == 0.0).then_some(c.relative))));
            row.push(short(worst(q, strain, &|c| (c.rotation != 0.0).then_some(c.relative))));
        }
        row
    };
    STRAINS.iter().map(|s| row(*s)).collect()
}

/// The machines that were measured.
pub fn machines(extremes: &Extremes) -> Vec<Machine> {
    let mut machines: Vec<Machine> = extremes.cells.iter().map(|c| c.machine).collect();
    machines.dedup();
    machines
}

/// The parameters of each material: `nu = 0.3000: young = 1e6, poisson = 0.3`.
pub fn materials(extremes: &Extremes, names: &[String]) -> Vec<String> {
    let one = |(k, m): (usize, &crate::material::Material)| {
        let values = names.iter().zip(&m.parameters).map(|(name, x)| format!("{name} = {x:?}"));
        format!("{}: {}", extremes.label(k), values.collect::<Vec<_>>().join(", "))
    };
    extremes.materials.iter().enumerate().map(one).collect()
}

/// All of it, and what fails.
pub fn extremes(extremes: &Extremes, names: &[String]) -> String {
    let mut text = format!("{}\n", extremes.law);
    for material in materials(extremes, names) {
        text += &format!("  {material}\n");
    }
    for machine in machines(extremes) {
        text += &format!("\n{}", machine.name());
        if let (Machine::Wgsl, Adapter::Device(name)) = (machine, &extremes.wgsl) {
            text += &format!(" on {name}");
        }
        text += ": worst error as a part of its bound (gate), and of the value, unrotated and turned\n";
        let mut all = vec![titles()];
        all.extend(rows(extremes, machine));
        text += &columns(&all);
    }
    if let Adapter::Skipped(reason) = &extremes.wgsl {
        text += &format!("\nwgsl: skipped, {reason}\n");
    }
    for line in &extremes.accepted {
        text += &format!("\naccepted without proof: {line}\n");
    }
    let failures = extremes.failures();
    text += "\n";
    match failures.as_slice() {
        [] => text += "within the gate everywhere\n",
        _ => failures.iter().for_each(|f| text += &format!("above the gate: {f}\n")),
    }
    text
}

//! The measurements of a law as a heat map: one panel a machine and quantity, strain across, rotation and material down.

use crate::extremes::{Adapter, Cell, Extremes};
use crate::gate::QUANTITIES;
use crate::states::{ROTATIONS, STRAINS};
use crate::svg::{Anchor, Drawing};
use crate::table::{machines, short};

/// Sizes in pixels.
const CELL: [f64; 2] = [26.0, 14.0];
const LEFT: f64 = 150.0;
const TOP: f64 = 64.0;
const GAP: [f64; 2] = [24.0, 46.0];
const BETWEEN_MATERIALS: f64 = 5.0;

/// Colours of errors up to these parts of the bound: blue inside, red outside, so that also who sees no green can tell.
const SCALE: [(f64, &str, &str); 8] = [
    (0.1, "#deebf7", "< 0.1"),
    (0.3, "#b5d0e8", "< 0.3"),
    (1.0, "#6aaed6", "within the bound"),
    (10.0, "#fdd0a2", "< 10"),
    (1e3, "#fd8d3c", "< 1e3"),
    (1e6, "#d94801", "< 1e6"),
    (1e10, "#8c2d04", "< 1e10"),
    (f64::INFINITY, "#3f0f02", "above"),
];
const NOTHING: &str = "#eeeeee";

/// The colour of an error; NaN, which no kernel should give, is as bad as can be.
fn colour(gate: f64) -> &'static str {
    SCALE.iter().find(|(most, ..)| gate <= *most).unwrap_or(&SCALE[SCALE.len() - 1]).1
}

/// The heat map as SVG.
pub fn heat_map(extremes: &Extremes) -> String {
    let (machines, materials) = (machines(extremes), extremes.materials.len());
    let panel =
        [CELL[0] * STRAINS.len() as f64, (CELL[1] * ROTATIONS.len() as f64 + BETWEEN_MATERIALS) * materials as f64];
    let width = LEFT + (panel[0] + GAP[0]) * QUANTITIES.len() as f64;
    let height = TOP + (panel[1] + GAP[1]) * machines.len() as f64 + 30.0;
    let mut drawing = Drawing::new(width, height);
    let title = format!("{}: worst error as a part of its bound", extremes.law);
    drawing.text([16.0, 24.0], 16.0, Anchor::Start, &title);
    let device = match &extremes.wgsl {
        Adapter::Device(name) => format!("wgsl on {name}"),
        Adapter::Skipped(reason) => format!("wgsl skipped: {}", reason.lines().next().unwrap_or_default()),
    };
    drawing.text([16.0, 42.0], 11.0, Anchor::Start, &device);
    for (row, machine) in machines.iter().enumerate() {
        let y = TOP + (panel[1] + GAP[1]) * row as f64;
        for (column, quantity) in QUANTITIES.iter().enumerate() {
            let x = LEFT + (panel[0] + GAP[0]) * column as f64;
            drawing.text([x, y - 6.0], 12.0, Anchor::Start, &format!("{} in {}", quantity.name(), machine.name()));
            for cell in extremes.cells.iter().filter(|c| (c.machine, c.quantity) == (*machine, *quantity)) {
                self::cell(&mut drawing, extremes, cell, [x, y]);
            }
            for (k, strain) in STRAINS.iter().enumerate() {
                let at = [x + CELL[0] * (k as f64 + 0.5), y + panel[1] + 10.0];
                drawing.text(at, 8.0, Anchor::Middle, &exponent(*strain));
            }
            let at = [x + 0.5 * panel[0], y + panel[1] + 22.0];
            drawing.text(at, 9.0, Anchor::Middle, "strain");
        }
        for material in 0..materials {
            let y = y + (CELL[1] * ROTATIONS.len() as f64 + BETWEEN_MATERIALS) * material as f64;
            let middle = y + 0.5 * CELL[1] * ROTATIONS.len() as f64 + 3.0;
            drawing.text([16.0, middle], 10.0, Anchor::Start, &extremes.label(material));
            for (k, rotation) in ROTATIONS.iter().enumerate() {
                let at = [LEFT - 6.0, y + CELL[1] * (k as f64 + 0.75)];
                drawing.text(at, 9.0, Anchor::End, &format!("{rotation} rad"));
            }
        }
    }
    legend(&mut drawing, height - 22.0);
    drawing.finish()
}

fn cell(drawing: &mut Drawing, extremes: &Extremes, cell: &Cell, [x, y]: [f64; 2]) {
    let strain = STRAINS.iter().position(|s| *s == cell.strain).unwrap_or(0);
    let rotation = ROTATIONS.iter().position(|r| *r == cell.rotation).unwrap_or(0);
    let row = (CELL[1] * ROTATIONS.len() as f64 + BETWEEN_MATERIALS) * cell.material as f64;
    let place = [x + CELL[0] * strain as f64, y + row + CELL[1] * rotation as f64, CELL[0] - 1.0, CELL[1] - 1.0];
    let (fill, value) = match cell.states {
        0 => (NOTHING, "no state inside the domain and the range of normal numbers".to_string()),
        n => {
            let [gate, relative] = [cell.gate, cell.relative].map(|x| short(Some(x)));
            (colour(cell.gate), format!("{gate} of the bound, {relative} of the value, {n} states"))
        }
    };
    let title = format!(
        "{} in {}, strain {:e}, {} rad, {}: {value}",
        cell.quantity.name(),
        cell.machine.name(),
        cell.strain,
        cell.rotation,
        extremes.label(cell.material)
    );
    drawing.rectangle(place, fill, &title);
}

fn legend(drawing: &mut Drawing, y: f64) {
    let entries = SCALE.iter().map(|(_, fill, words)| (*fill, *words)).chain([(NOTHING, "nothing to measure")]);
    for (k, (fill, words)) in entries.enumerate() {
        let x = 16.0 + 118.0 * k as f64;
        drawing.rectangle([x, y, 14.0, 12.0], fill, "");
        drawing.text([x + 19.0, y + 10.0], 10.0, Anchor::Start, words);
    }
}

/// `1e-8`, `0.3`.
fn exponent(x: f64) -> String {
    if x < 0.1 { format!("{x:e}") } else { x.to_string() }
}

#[cfg(test)]
mod tests {
    use super::colour;

    #[test]
    fn what_is_above_the_bound_is_not_coloured_as_inside() {
        let inside: Vec<&str> = [0.0, 0.05, 0.2, 1.0].map(colour).to_vec();
        for above in [1.0 + f64::EPSILON, 5.0, 1e5, 1e9, 1e20, f64::INFINITY, f64::NAN] {
            assert!(!inside.contains(&colour(above)), "{above}");
        }
    }
}

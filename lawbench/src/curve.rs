//! A stress-stretch curve as CSV and SVG.

use crate::csv::csv;
use crate::drive::{Mode, Point};
use crate::svg::{Anchor, Drawing};

const SIZE: [f64; 2] = [640.0, 420.0];
const MARGIN: [f64; 4] = [92.0, 56.0, 24.0, 52.0];
const NOMINAL: &str = "#1f77b4";
const CAUCHY: &str = "#d95f02";

/// One row a point.
pub fn table(mode: Mode, curve: &[Point]) -> String {
    let gradient: Vec<String> = (0..9).map(|k| format!("G{}{}", k / 3 + 1, k % 3 + 1)).collect();
    let mut columns = vec![mode.axis(), "nominal_stress", "cauchy_stress", "volume_ratio", "energy", "work"];
    columns.extend(gradient.iter().map(String::as_str));
    let row = |p: &Point| {
        let values = [p.imposed, p.nominal, p.cauchy, p.volume, p.energy, p.work];
        values.iter().chain(&p.gradient).map(|x| format!("{x:?}")).collect()
    };
    csv(&columns, curve.iter().map(row))
}

/// Nominal and Cauchy stress over what is imposed.
pub fn drawing(title: &str, mode: Mode, curve: &[Point]) -> String {
    let [left, top, right, bottom] = MARGIN;
    let mut drawing = Drawing::new(SIZE[0], SIZE[1]);
    let xs = axis(curve.iter().map(|p| p.imposed));
    let ys = axis(curve.iter().flat_map(|p| [p.nominal, p.cauchy]).chain([0.0]));
    let at = |x: f64, y: f64| {
        let part = |v: f64, ticks: &[f64]| (v - ticks[0]) / (ticks[ticks.len() - 1] - ticks[0]);
        [left + part(x, &xs) * (SIZE[0] - left - right), SIZE[1] - bottom - part(y, &ys) * (SIZE[1] - top - bottom)]
    };
    let (low, high) = ([xs[0], ys[0]], [xs[xs.len() - 1], ys[ys.len() - 1]]);
    for &x in &xs {
        drawing.line(&[at(x, low[1]), at(x, high[1])], "#e0e0e0", 1.0);
        let [px, py] = at(x, low[1]);
        drawing.text([px, py + 16.0], 11.0, Anchor::Middle, &number(x));
    }
    for &y in &ys {
        let stroke = if y == 0.0 { "#888" } else { "#e0e0e0" };
        drawing.line(&[at(low[0], y), at(high[0], y)], stroke, 1.0);
        let [px, py] = at(low[0], y);
        drawing.text([px - 6.0, py + 4.0], 11.0, Anchor::End, &number(y));
    }
    let line = |stress: fn(&Point) -> f64| curve.iter().map(|p| at(p.imposed, stress(p))).collect::<Vec<_>>();
    drawing.line(&line(|p| p.cauchy), CAUCHY, 1.5);
    drawing.line(&line(|p| p.nominal), NOMINAL, 2.0);
    drawing.text([16.0, 24.0], 15.0, Anchor::Start, title);
    for (k, (colour, words)) in [(NOMINAL, "nominal stress (Pa)"), (CAUCHY, "Cauchy stress (Pa)")].iter().enumerate() {
        let x = left + 170.0 * k as f64;
        drawing.rectangle([x, 36.0, 18.0, 4.0], colour, "");
        drawing.text([x + 24.0, 42.0], 11.0, Anchor::Start, words);
    }
    let middle = 0.5 * (left + SIZE[0] - right);
    drawing.text([middle, SIZE[1] - 14.0], 12.0, Anchor::Middle, mode.axis());
    drawing.finish()
}

/// Round numbers around the values, ascending; at least two.
fn axis(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let (low, high) = values
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let (low, high) = if low < high { (low, high) } else { (low.min(0.0) - 1.0, low.max(0.0) + 1.0) };
    let (low, high) = if low.is_finite() && high.is_finite() { (low, high) } else { (-1.0, 1.0) };
    let rough = (high - low) / 6.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough).unwrap_or(10.0 * power);
    let (first, last) = ((low / step).floor() as i64, (high / step).ceil() as i64);
    (first..=last.max(first + 1)).map(|k| k as f64 * step).collect()
}

fn number(x: f64) -> String {
    let rounded = (x * 1e9).round() / 1e9;
    if x == 0.0 || (1e-3..1e5).contains(&x.abs()) { rounded.to_string() } else { format!("{:e}", float(x)) }
}

/// Three digits of a tick that is a round number but for its last bits.
fn float(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_round_and_hold_their_values() {
        for (low, high) in [(0.6, 2.0), (-3.2e6, 1.7e7), (0.0, 0.0), (1e-9, 1.1e-9), (-5.0, -4.0), (f64::NAN, f64::NAN)]
        {
            let ticks = axis([low, high].into_iter());
            assert!((2..=12).contains(&ticks.len()), "{ticks:?}");
            assert!(ticks.windows(2).all(|w| w[0] < w[1]), "{ticks:?}");
            if low.is_finite() {
                assert!(ticks[0] <= low && high <= ticks[ticks.len() - 1], "{low} {high} {ticks:?}");
            }
        }
    }
}

//! A picture of what was measured under this machine's roofs (Williams, Waterman & Patterson 2009): operations a second over
//! operations a byte, both logarithmic.

use std::fmt::Write;

use tensormass_runtime::measure::{Measured, Subject};
use tensormass_runtime::plan::precision_name;
use tensormass_runtime::scene::Precision;

/// Of the picture: the width, and the height unless the list of dots needs more.
const SIZE: [f64; 2] = [880.0, 520.0];
/// Of a row of the list.
const ROW: f64 = 14.0;
/// Of what is drawn in it: left, top, right, bottom.
const FRAME: [f64; 4] = [70.0, 40.0, 560.0, 460.0];

/// What was measured of an operation.
pub(super) struct Dot {
    what: String,
    precision: Precision,
    /// Operations a byte.
    intensity: f64,
    /// Operations a second.
    rate: f64,
}

/// The operations of a subject of which bytes and operations are counted.
pub(super) fn dots(subject: &Subject, measured: &Measured) -> Vec<Dot> {
    let dot = |t: &tensormass_runtime::measure::Timing| {
        let (flops, bytes) = (f64::from(t.flops?), t.bytes?);
        let precision = subject.precision;
        let name = precision_name(precision);
        (flops > 0.0).then(|| Dot {
            what: format!("{} of {}, {name}, {}", t.operation, subject.law.info.name, measured.elements),
            precision,
            intensity: flops / bytes,
            rate: flops * t.rate(measured.elements),
        })
    };
    measured.timings.iter().filter_map(dot).collect()
}

/// Decades around some positive numbers.
fn decades(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
    [low.log10().floor(), high.log10().ceil()]
}

/// The picture, as SVG.
pub(super) fn picture(bandwidth: f64, peaks: &[(Precision, f64)], dots: &[Dot]) -> String {
    let corners = peaks.iter().map(|(_, peak)| peak / bandwidth);
    let [x_low, x_high] = decades(dots.iter().map(|d| d.intensity).chain(corners));
    let [y_low, y_high] = decades(dots.iter().map(|d| d.rate / 1e9).chain(peaks.iter().map(|(_, peak)| peak / 1e9)));
    let [left, top, right, bottom] = FRAME;
    let x = |v: f64| left + (v.log10() - x_low) / (x_high - x_low) * (right - left);
    let y = |v: f64| bottom - (v.log10() - y_low) / (y_high - y_low) * (bottom - top);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        SIZE[0],
        SIZE[1].max(FRAME[1] + ROW * (dots.len() + 1) as f64)
    );
    let mut line = |from: [f64; 2], to: [f64; 2], style: &str| {
        let ([x1, y1], [x2, y2]) = (from, to);
        let _ = writeln!(out, "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>");
    };
    let mut labels = String::new();
    let mut label = |[x, y]: [f64; 2], anchor: &str, text: &str| {
        let _ = writeln!(labels, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>");
    };
    let grid = "stroke=\"#ddd\"";
    for k in x_low as i32..=x_high as i32 {
        let v = 10f64.powi(k);
        line([x(v), top], [x(v), bottom], grid);
        label([x(v), bottom + 16.0], "middle", &v.to_string());
    }
    for k in y_low as i32..=y_high as i32 {
        let v = 10f64.powi(k);
        line([left, y(v)], [right, y(v)], grid);
        label([left - 6.0, y(v) + 4.0], "end", &v.to_string());
    }
    label([0.5 * (left + right), bottom + 36.0], "middle", "operations a byte");
    label([left, top - 22.0], "middle", "Gflop/s");
    // Each roof: along the bandwidth up to a precision's peak, then level.
    let (first, last) = (10f64.powf(x_low), 10f64.powf(x_high));
    for (precision, peak) in peaks {
        let corner = (peak / bandwidth).clamp(first, last);
        let start = first.max(10f64.powf(y_low) * 1e9 / bandwidth);
        let roof = "stroke=\"black\" stroke-width=\"1.5\"";
        line([x(start), y(start * bandwidth / 1e9)], [x(corner), y(corner * bandwidth / 1e9)], roof);
        line([x(corner), y(peak / 1e9)], [x(last), y(peak / 1e9)], roof);
        let text = format!("{:.0} Gflop/s, {}", peak / 1e9, precision_name(*precision));
        label([right - 4.0, y(peak / 1e9) - 5.0], "end", &text);
    }
    let triad = format!("triad {:.1} GB/s", bandwidth / 1e9);
    label([left + 6.0, top + 12.0], "start", &triad);
    for (k, dot) in dots.iter().enumerate() {
        let fill = if dot.precision == Precision::F32 { "#1f77b4" } else { "#d62728" };
        let (x, y) = (x(dot.intensity), y(dot.rate / 1e9));
        let _ = writeln!(labels, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{fill}\"/>");
        let _ = writeln!(labels, "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"9\">{}</text>", x + 5.0, y - 3.0, k + 1);
        let row = top + ROW * k as f64;
        let _ = writeln!(
            labels,
            "<text x=\"{:.1}\" y=\"{row:.1}\" font-size=\"9\" fill=\"{fill}\">{} {}</text>",
            right + 12.0,
            k + 1,
            dot.what
        );
    }
    out + labels.as_str() + "</svg>\n"
}

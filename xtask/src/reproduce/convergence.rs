//! `cargo xtask reproduce convergence`: makes docs/convergence.md and its pictures from the example `convergence`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::process::Stdio;

use crate::process::{Failure, cargo, root, say};

const INTRODUCTION: &str = "\
<!-- Made by `cargo xtask reproduce convergence`. Do not edit: change xtask/src/reproduce/convergence.rs and make it again. -->
# Accuracy of every element

`cargo xtask reproduce convergence` writes this page and its pictures from `runtime/examples/convergence.rs`.

## Orders of convergence

A displacement is chosen on the unit cube (in two dimensions the unit square), the load that balances it follows from the
law's own tangent, and the mesh's solution is compared with what was chosen: the displacement in L2 as a part of its size,
the potential energy as a part of itself. Theory gives order p + 1 and 2 p for elements that reproduce polynomials of order p.
*order* is the slope between the two finest meshes.
";

/// The deflection of CANTI_SMALL by Timoshenko's beam with Cowper's factor, m (Cowper 1966).
const TIMOSHENKO: f64 = 4.0306e-3;

/// One line of the example.
struct Line {
    what: String,
    element: String,
    law: String,
    cells: f64,
    unknowns: f64,
    displacement: f64,
    energy: f64,
}

/// Runs the example and writes the page.
///
/// # Errors
/// The example does not build or run; the page cannot be written.
pub fn call() -> Result<(), Failure> {
    say("== cargo run --example convergence");
    let arguments = ["run", "--release", "--quiet", "--package", "tensormass-runtime", "--example", "convergence"];
    let output = cargo(&arguments)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| Failure::Step(format!("convergence: cannot run cargo: {error}")))?;
    if !output.status.success() {
        return Err(Failure::Step(format!("convergence: {}; see above", output.status)));
    }
    let text = String::from_utf8(output.stdout).map_err(|error| Failure::Step(format!("convergence: {error}")))?;
    let lines = read(&text)?;
    let write = |path: &str, text: String| {
        std::fs::write(root().join(path), text)
            .map_err(|e| Failure::Step(format!("cannot write {path}: {e}; make the folder writable")))
    };
    write("docs/images/convergence_displacement.svg", plot(&lines, "error of the displacement", |l| l.displacement))?;
    write("docs/images/convergence_energy.svg", plot(&lines, "error of the energy", |l| l.energy))?;
    write("docs/convergence.md", page(&lines))?;
    say("wrote docs/convergence.md and docs/images/convergence_*.svg: review and commit them");
    Ok(())
}

fn read(text: &str) -> Result<Vec<Line>, Failure> {
    let one = |line: &str| -> Option<Line> {
        let [what, element, _, law, cells, unknowns, displacement, energy] =
            line.split(',').collect::<Vec<_>>().try_into().ok()?;
        let [what, element, law] = [what, element, law].map(str::to_string);
        let [cells, unknowns, displacement, energy]: [Option<f64>; 4] =
            [cells, unknowns, displacement, energy].map(|x| x.parse().ok());
        Some(Line {
            what,
            element,
            law,
            cells: cells?,
            unknowns: unknowns?,
            displacement: displacement?,
            energy: energy?,
        })
    };
    let lines = text.lines().skip(1).map(|l| one(l).ok_or_else(|| Failure::Step(format!("convergence: `{l}`"))));
    lines.collect()
}

/// The lines of each element and law, in the order of the text.
fn series(lines: &[Line]) -> Vec<Vec<&Line>> {
    let mut all: Vec<Vec<&Line>> = vec![];
    for line in lines.iter().filter(|l| l.what == "manufactured") {
        match all.last_mut().filter(|s| (&s[0].element, &s[0].law) == (&line.element, &line.law)) {
            Some(series) => series.push(line),
            None => all.push(vec![line]),
        }
    }
    all
}

/// The slope between the two finest meshes.
fn slope(series: &[&Line], of: impl Fn(&Line) -> f64) -> f64 {
    let [.., a, b] = series else { return f64::NAN };
    (of(a) / of(b)).ln() / (b.cells / a.cells).ln()
}

fn page(lines: &[Line]) -> String {
    let mut page = INTRODUCTION.to_string();
    page += "\n![Errors of the displacement](images/convergence_displacement.svg)\n";
    page += "![Errors of the energy](images/convergence_energy.svg)\n\n";
    page += "| element | law | cells a side | unknowns | displacement | order | energy | order |\n|---|---|---|---|---|---|---|---|\n";
    for series in series(lines) {
        for (k, l) in series.iter().enumerate() {
            let last = k + 1 == series.len();
            let order = |value: f64| if last { format!("{value:.2}") } else { String::new() };
            let _ = writeln!(
                page,
                "| {} | {} | {} | {} | {:.2e} | {} | {:.2e} | {} |",
                l.element,
                l.law,
                l.cells,
                l.unknowns,
                l.displacement,
                order(slope(&series, |l| l.displacement)),
                l.energy,
                order(slope(&series, |l| l.energy)),
            );
        }
    }
    page += "\n## What a beam pays for\n\nThe end-loaded cantilever of 10:1 with Hooke's law, nu = .3: the tip's mean deflection as a part \
             of Timoshenko's\n4.0306 mm (Cowper's factor; a solid body clamped at its end is stiffer by about 1 %).\n\n";
    let across: Vec<f64> = vec![1.0, 2.0, 4.0, 6.0];
    page += "| element | 1 cell across | 2 | 4 | 6 |\n|---|---|---|---|---|\n";
    let mut by_element: BTreeMap<&str, Vec<&Line>> = BTreeMap::new();
    for line in lines.iter().filter(|l| l.what == "cantilever") {
        by_element.entry(&line.element).or_default().push(line);
    }
    for (element, lines) in &by_element {
        let cell = |n: &f64| match lines.iter().find(|l| l.cells == *n) {
            Some(l) => format!(" {:.1} % of {} unknowns |", 100.0 * l.displacement / TIMOSHENKO, l.unknowns),
            None => " |".to_string(),
        };
        let _ = writeln!(page, "| {element} |{}", across.iter().map(cell).collect::<String>());
    }
    page + &frequencies(lines)
}

/// What masses cost in accuracy.
fn frequencies(lines: &[Line]) -> String {
    let mut page = "\n## Frequencies with consistent and lumped masses\n\nThe lowest longitudinal vibration of a bar, clamped at \
                    one end, with one cell across and no strain across: its\nfrequency over the exact one, less 1. *order* is \
                    the slope between the two finest meshes. `solver.mass` chooses; explicit\nintegrators need lumped \
                    masses. Lumped masses are of second order whatever the element.\n\n| element | cells along | unknowns | consistent | order | lumped | order |\n\
                    |---|---|---|---|---|---|---|\n"
        .to_string();
    let all: Vec<&Line> = lines.iter().filter(|l| l.what == "frequency").collect();
    for series in all.chunk_by(|a, b| a.element == b.element) {
        for (k, l) in series.iter().enumerate() {
            let order = |of: fn(&Line) -> f64| {
                if k + 1 == series.len() { format!("{:.2}", slope(series, |l| of(l).abs())) } else { String::new() }
            };
            let _ = writeln!(
                page,
                "| {} | {} | {} | {:+.2e} | {} | {:+.2e} | {} |",
                l.element,
                l.cells,
                l.unknowns,
                l.displacement,
                order(|l| l.displacement),
                l.energy,
                order(|l| l.energy),
            );
        }
    }
    page
}

const COLOURS: [&str; 9] =
    ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#999999", "#000000", "#bb5500"];

/// A drawing of errors over cells, both as powers of ten; the first law full, the second dashed.
fn plot(lines: &[Line], title: &str, of: impl Fn(&Line) -> f64) -> String {
    let all = series(lines);
    let values = || all.iter().flatten().map(|l| (l.cells.log10(), of(l).log10()));
    let range = |of: &dyn Fn((f64, f64)) -> f64| {
        let (low, high) = values().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        (low, high)
    };
    let ((left, right), (low, high)) = (range(&|v| v.0), range(&|v| v.1));
    let (low, high) = (low.floor(), high.ceil());
    let (width, height, margin) = (800.0, 480.0, 56.0);
    let x = |v: f64| margin + (v - left) / (right - left) * (width - margin - 260.0);
    let y = |v: f64| height - margin - (v - low) / (high - low) * (height - 2.0 * margin);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"{margin}\" y=\"28\" font-size=\"15\">{title} over cells a side</text>\n"
    );
    for power in (low as i32)..=(high as i32) {
        let at = y(f64::from(power));
        let end = x(right);
        let _ = writeln!(
            svg,
            "<line x1=\"{margin}\" x2=\"{end:.1}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#dddddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">1e{power}</text>",
            margin - 6.0,
            at + 4.0
        );
    }
    for cells in [2.0, 4.0, 8.0, 16.0, 32.0, 64.0_f64] {
        let at = x(cells.log10());
        let _ = writeln!(
            svg,
            "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{:.1}\" y2=\"{:.1}\" stroke=\"#eeeeee\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{cells}</text>",
            y(high),
            y(low),
            y(low) + 18.0
        );
    }
    let mut elements: Vec<&str> = vec![];
    let first_law = &all[0][0].law;
    for series in &all {
        let element = series[0].element.as_str();
        let k = elements.iter().position(|e| *e == element).unwrap_or_else(|| {
            elements.push(element);
            elements.len() - 1
        });
        let colour = COLOURS[k % COLOURS.len()];
        let dash = if series[0].law == *first_law { "" } else { " stroke-dasharray=\"5 4\"" };
        let points: Vec<String> =
            series.iter().map(|l| format!("{:.1},{:.1}", x(l.cells.log10()), y(of(l).log10()))).collect();
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"{dash}/>",
            points.join(" ")
        );
        if dash.is_empty() {
            let at = 40.0 + 20.0 * k as f64;
            let _ = writeln!(
                svg,
                "<line x1=\"{0}\" x2=\"{1}\" y1=\"{at}\" y2=\"{at}\" stroke=\"{colour}\" stroke-width=\"2\"/>\
                 <text x=\"{2}\" y=\"{3}\">{element}: slope {4:.2}</text>",
                width - 245.0,
                width - 225.0,
                width - 218.0,
                at + 4.0,
                slope(series, &of)
            );
        }
    }
    let laws: Vec<&str> = all.iter().map(|s| s[0].law.as_str()).collect();
    let other = laws.iter().find(|law| *law != first_law).copied().unwrap_or("");
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\">full: {first_law}, dashed: {other}</text>",
        width - 245.0,
        50.0 + 20.0 * elements.len() as f64
    );
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::{page, read, slope};

    #[test]
    fn slopes_are_those_of_the_finest_meshes() {
        let text = "what,element,order,law,cells,unknowns,displacement,energy\n\
                    manufactured,a,1,l,4,10,1.6e-1,1e-1\nmanufactured,a,1,l,8,20,4e-2,5e-2\n\
                    cantilever,a,1,l,2,30,2e-3,0\n\
                    frequency,b,1,l,2,3,4e-2,-1e-2\nfrequency,b,1,l,4,5,1e-2,-5e-3\n";
        let lines = read(text).expect("lines");
        let two: Vec<_> = lines[..2].iter().collect();
        assert!((slope(&two, |l| l.displacement) - 2.0).abs() < 1e-12);
        let page = page(&lines);
        assert!(page.contains("| a | l | 8 | 20 | 4.00e-2 | 2.00 | 5.00e-2 | 1.00 |\n"), "{page}");
        assert!(page.contains("49.6 % of 30 unknowns"), "{page}");
        assert!(page.contains("| b | 4 | 5 | +1.00e-2 | 2.00 | -5.00e-3 | 1.00 |\n"), "{page}");
        assert!(read("head\nmanufactured,a\n").is_err());
    }
}

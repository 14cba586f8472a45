//! `cargo xtask reproduce choices`: makes docs/accuracy.md and its pictures from `tensormass tradeoff` of four scenes.

use std::fmt::Write as _;
use std::path::Path;

use crate::process::{Failure, cargo, read, root, run, say};

/// A scene, the axis whose picture is shown, what it shows, and seconds for it.
struct Study {
    scene: &'static str,
    axis: &'static str,
    shows: &'static str,
    budget: &'static str,
    /// What was found, in words: to be read against the table when it is made again.
    found: &'static str,
}

const STUDIES: [Study; 4] = [
    Study {
        scene: "gravity-svk",
        axis: "integrator",
        shows: "Explicit against implicit steps",
        budget: "540",
        found: "\
Explicit steps of .0013 s take a third of the time of implicit ones of .05 s, and are no less accurate: their error, 10.8 %, is the
mesh's. Of implicit Euler's 11.8 % some 1 % is its own, of first order in the step: half the step makes 11.3 %, an eighth 10.9 %, twice
12.6 %, four times 13.7 %. Tolerances from 1e-2 to 1e-9 agree in four digits: they are no part of it. So implicit steps are not the cheaper ones as such: they
are where they take fewer products than explicit steps fit into one of them. Of a beam let go at once, .4 s long, implicit Euler's
damping made 17 % of error at steps of .08 s, where central differences had .05 %; here the load grows over a period, little swings, and
little is damped.

The mesh's error is the largest: 6.3, 11.8, 29.8 and 62.4 % of linear tetrahedra, with 20, 10, 5 and 2 cells across; quadratic ones with 2
cells and explicit steps in f32 have 2.9 % in a hundredth of the time.",
    },
    Study {
        scene: "gravity-hooke",
        axis: "element",
        shows: "Linear against quadratic elements",
        budget: "250",
        found: "\
With 10, 5 and 2 cells across, linear tetrahedra are off by 11.4, 30.4 and 63.2 %: they are too stiff in bending. (Of a beam of 10:1 they
reached 89, 79 and 49 % of the deflection with 6, 4 and 2 cells across; cells here are two and a half times as long as high, and
not all of the error is the mesh's.) As many prisms and hexahedra have 5.6 and 5.4 %, in .75 and .4 of the time. Quadratic tetrahedra have
2.7 % with 2 cells across, in .04 s, and .7 % with 5, in .8 s; no mesh of linear tetrahedra that was tried comes near either. Laws of
finite strain differ from Hooke's by 21 to 22 % here, with the mesh's error in it.",
    },
    Study {
        scene: "bending",
        axis: "law",
        shows: "What a law is worth where a body is bent",
        budget: "120",
        found: "\
Both ends turn by 45 degrees, and strains reach 16 %: Hooke's law is off by 11.9 %, neo-Hookean laws differ from St Venant-Kirchhoff's by 5
to 6 % (1.1 % of each is the mesh's). (Of a beam that sags, against a neo-Hookean law: at 1.2 degrees and .55 % of strain Hooke's is off by .7 %, St
Venant-Kirchhoff's by .12 %, a stable neo-Hookean one by .02 %; at 11 degrees and 5.6 % by 6.9, 1.1 and .16 %; at 55 degrees and 31 % by 53, 4.6
and .8 %.) Two things make the difference here: the ends' places are given, so that a linear law cannot throw them off as it does
a free end; and displacements, of which errors are a part, are about a fifth as large for the same turn.",
    },
    Study {
        scene: "torsion",
        axis: "precision",
        shows: "f32 against f64, and a law's worth where a body is turned",
        budget: "80",
        found: "\
f32 and f64 give the same errors, as they did of central differences in the first measurements: what rounds is a hundredth or less of the
least error of any setting in all four scenes. Explicit steps take two thirds to four fifths of the time
in f32. Implicit steps of bodies of this size on a CPU take longer: in f64 their tangent is assembled, which would lose too much in f32.

Turned by 90 degrees, Hooke's law is off by 57 %; the others agree within .1 %, since strains are small.",
    },
];

const INTRODUCTION: &str = "\
<!-- Made by `cargo xtask reproduce choices`. Do not edit: change xtask/src/reproduce/choices.rs and make it again. -->
# How to choose

`cargo xtask reproduce choices` writes this page and its pictures from `tensormass tradeoff` of four scenes, in 1 to 9 minutes each, on the
machine where it runs; [tradeoff.md](tradeoff.md) says how errors are measured. For a scene of your own run `tensormass tradeoff SCENE --out DIR
--target-error 0.05`: it prints the cheapest setting measured that is as accurate, as arguments of `run`.

In this order:

1. **The law.** Where a body turns by more than a few degrees a linear law is wrong by about half the angle in radians, whatever else is
   done; `summary.json` and a warning say so (`guards.linear`). Laws of finite strain that have the same moduli agree at small strains.
2. **Elements and mesh.** The mesh's error is the largest of all in most scenes. Quadratic elements and hexahedra on a coarse mesh beat linear
   tetrahedra on a fine one; linear tetrahedra lock in bending, and where Poisson's ratio is .45 and more ([convergence.md](convergence.md)).
3. **The integrator.** Explicit steps where the safe step is no shorter than the wanted one over twice the iterations of an implicit
   step: small, soft, coarse bodies. Implicit steps where only the slow part of a motion matters, or bodies are stiff, or meshes have slivers. Implicit
   Euler damps what it does not resolve.
4. **Tolerances.** Looser than the error of the step is enough: 1e-3 does not show in most scenes. In statics a small residual says
   little where parts differ in stiffness; `guards.residual.estimated_error` is an estimate of the error itself.
5. **Precision.** f32 is as accurate as f64 until lambda/mu or a ratio of stiffnesses passes a thousand; explicit steps take two
   thirds to four fifths of the time in it, implicit ones of small bodies on a CPU are a fifth to a half longer, and GPUs have nothing else.

Below, what is said in brackets of other beams are first measurements by another program, of a cantilever of neo-Hookean material.
";

/// One setting of runs.csv.
struct Row {
    choices: Vec<String>,
    error: Option<f64>,
    wall: f64,
    status: String,
}

/// The axes in runs.csv, before everything else.
const AXES: [&str; 8] = ["law", "element", "mesh", "integrator", "step", "tolerance", "precision", "device"];

/// Runs all and writes the page.
///
/// # Errors
/// The program does not build or run; a file cannot be read or written.
pub fn call() -> Result<(), Failure> {
    let mut page = INTRODUCTION.to_string();
    let images = root().join("docs/images");
    for study in &STUDIES {
        let out = root().join("target/reproduce/choices").join(study.scene);
        if out.exists() {
            std::fs::remove_dir_all(&out).map_err(|e| failed(&out, &e))?;
        }
        let (scene, folder) = (format!("scenes/{}.toml", study.scene), out.display().to_string());
        let arguments = ["run", "--release", "--quiet", "--package", "tensormass", "--", "tradeoff", &scene];
        let options = ["--target-error", "0.05", "--budget", study.budget, "--out", &folder];
        run(&format!("tradeoff of {scene}"), cargo(&[&arguments[..], &options[..]].concat()))?;
        let picture = format!("choice-{}-{}.svg", study.axis, study.scene);
        let from = out.join(format!("time-by-{}.svg", study.axis));
        std::fs::copy(&from, images.join(&picture)).map_err(|e| failed(&from, &e))?;
        let _ = write!(
            page,
            "\n## {}\n\n`{scene}`; {}\n\n![Error and time by {}](images/{picture})\n\n{}\n\n",
            study.shows,
            converged(&out)?,
            study.axis,
            study.found
        );
        let rows = rows(&out.join("runs.csv"))?;
        page += &table(&rows);
        page += &precisions(&rows);
    }
    let path = root().join("docs/accuracy.md");
    std::fs::write(&path, page).map_err(|e| failed(&path, &e))?;
    say("wrote docs/accuracy.md and its pictures: look at them, review and commit");
    Ok(())
}

fn failed(path: &Path, error: &std::io::Error) -> Failure {
    Failure::Step(format!("{}: {error}", path.display()))
}

/// What the report says of its reference, and of the machine.
fn converged(out: &Path) -> Result<String, Failure> {
    let path = out.join("report.json");
    let text = std::fs::read_to_string(&path).map_err(|e| failed(&path, &e))?;
    let report: serde_json::Value =
        serde_json::from_str(&text).map_err(|e| Failure::Step(format!("{}: {e}", path.display())))?;
    let load = read("uptime", crate::process::program("uptime", &[]))?;
    let load = load
        .rsplit("load average: ")
        .next()
        .unwrap_or_default()
        .split(',')
        .next()
        .unwrap_or_default()
        .trim()
        .to_string();
    let said = report["converged"].as_str().unwrap_or_default();
    let mut text = format!("{said} {} processors, load {load}.", report["processors"]);
    for found in report["recommended"].as_array().into_iter().flatten() {
        let (Some(target), Some(error), Some(wall)) = (
            found["target"].as_f64(),
            found["setting"]["errors"]["displacement"].as_f64(),
            found["setting"]["wall_s"].as_f64(),
        ) else {
            continue;
        };
        let names: Vec<&str> = AXES[..7].iter().filter_map(|axis| found["setting"]["setting"][axis].as_str()).collect();
        let _ = write!(
            text,
            " Cheapest within {} %: {} ({}, {wall:.3} s).",
            100.0 * target,
            names.join(", "),
            percent(error)
        );
    }
    Ok(text)
}

fn rows(path: &Path) -> Result<Vec<Row>, Failure> {
    let text = std::fs::read_to_string(path).map_err(|e| failed(path, &e))?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let place = |name: &str| {
        let missing = || Failure::Step(format!("{} has no column {name}", path.display()));
        header.iter().position(|h| *h == name).ok_or_else(missing)
    };
    let (status, error, wall) = (place("status")?, place("error_displacement")?, place("wall_s")?);
    // Reasons of failures may have commas, and are in quotes: such settings have no error to show.
    let of = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |k: usize| cells.get(k).and_then(|c| c.parse().ok());
        Row {
            choices: cells.iter().take(AXES.len()).map(|c| (*c).to_string()).collect(),
            error: number(error),
            wall: number(wall).unwrap_or(f64::NAN),
            status: cells.get(status).copied().unwrap_or_default().to_string(),
        }
    };
    Ok(lines.map(of).collect())
}

/// What one choice alone changes: rows of the settings that differ from the scene's own, the first one, on one axis.
fn table(rows: &[Row]) -> String {
    let Some(base) = rows.first() else { return String::new() };
    let mut text = format!(
        "The scene as it is: {}, {:.2} s ({}). One choice alone changes:\n\n| axis | choice | error | time over that of the scene |\n|---|---|---:|---:|\n",
        base.error.map_or("no error".to_string(), percent),
        base.wall,
        base.choices[..7].join(", ")
    );
    for (k, axis) in AXES.iter().enumerate() {
        for row in rows {
            let differs: Vec<usize> = (0..AXES.len()).filter(|i| row.choices.get(*i) != base.choices.get(*i)).collect();
            if differs != [k] {
                continue;
            }
            let error = row.error.map_or_else(|| row.status.clone(), percent);
            let _ = writeln!(text, "| {axis} | {} | {error} | {:.2} |", row.choices[k], row.wall / base.wall);
        }
    }
    text
}

/// What f32 changes beside f64, in pairs of settings that differ in nothing else.
fn precisions(rows: &[Row]) -> String {
    let [precision, integrator] = ["precision", "integrator"].map(|name| AXES.iter().position(|a| *a == name));
    let (Some(precision), Some(integrator)) = (precision, integrator) else { return String::new() };
    let mut text = String::new();
    for (steps, is_implicit) in [("explicit", false), ("implicit", true)] {
        let of = |name: &'static str| {
            rows.iter().filter(move |row| {
                row.choices[precision] == name && row.choices[integrator].starts_with("implicit") == is_implicit
            })
        };
        let (mut ratios, mut apart) = (vec![], 0.0_f64);
        for single in of("f32") {
            let is_twin = |row: &&Row| (0..AXES.len()).all(|k| k == precision || row.choices[k] == single.choices[k]);
            let Some(double) = of("f64").find(is_twin) else { continue };
            if let (Some(a), Some(b)) = (single.error, double.error) {
                ratios.push(single.wall / double.wall);
                apart = apart.max((a - b).abs());
            }
        }
        ratios.sort_by(f64::total_cmp);
        if let Some(median) = ratios.get(ratios.len() / 2) {
            let _ = write!(
                text,
                "\nf32 beside f64, {} pairs of settings with {steps} steps: {median:.2} of the time (median), errors apart by {} at most.\n",
                ratios.len(),
                percent(apart)
            );
        }
    }
    text
}

fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    if percent >= 0.01 { format!("{percent:.2} %") } else { format!("{percent:.0e} %") }
}

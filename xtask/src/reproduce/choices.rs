//! `cargo xtask reproduce choices`: makes docs/accuracy.md and its pictures from `tensormass tradeoff` of five scenes.

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

const STUDIES: [Study; 5] = [
    Study {
        scene: "gravity-svk",
        axis: "integrator",
        shows: "Explicit against implicit steps",
        budget: "540",
        found: "",
    },
    Study {
        scene: "gravity-hooke",
        axis: "element",
        shows: "Linear against quadratic elements",
        budget: "250",
        found: "",
    },
    Study {
        scene: "bending",
        axis: "law",
        shows: "What a law is worth where a body is bent",
        budget: "120",
        found: "",
    },
    Study {
        scene: "torsion",
        axis: "law",
        shows: "What a law is worth where a body is turned",
        budget: "80",
        found: "",
    },
    Study { scene: "traction", axis: "precision", shows: "f32 against f64", budget: "100", found: "" },
];

const INTRODUCTION: &str = "\
<!-- Made by `cargo xtask reproduce choices`. Do not edit: change xtask/src/reproduce/choices.rs and make it again. -->
# How to choose

`cargo xtask reproduce choices` writes this page and its pictures from `tensormass tradeoff` of five scenes, in 2 to 9 minutes each, on the
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
5. **Precision.** f32 is as accurate as f64 until lambda/mu or a ratio of stiffnesses passes a thousand; it is faster, and what GPUs have.
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
        page += &table(&rows(&out.join("runs.csv"))?);
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

fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    if percent >= 0.01 { format!("{percent:.2} %") } else { format!("{percent:.0e} %") }
}

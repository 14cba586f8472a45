//! `cargo xtask extremes`: makes docs/stability.md from the suite of extremes.

mod planted;

use std::process::Stdio;

use crate::process::{Failure, cargo, root, say};

/// The exit status of the suite where a cell is wrong: a result too.
const WRONG: i32 = 3;
/// What begins the part of the page that `--planted` makes.
const PLANTED: &str = "\n## Planted faults\n";

const INTRODUCTION: &str = "\
<!-- Made by `cargo xtask extremes`. Do not edit: change xtask/src/extremes/ or stability/ and make it again. -->
# Stability at the extremes

`cargo xtask extremes` writes this page: whole scenes of small bodies, each law of the build, each integrator, in f64 and f32 on the
CPU; with `--gpu` one law of each kind at the ends of each range on a GPU besides, but for a hundred thousand implicit steps (12 minutes on two
cores where the GPU is software). `cargo test` runs a short form of it. A cell is the outcome of all laws:

- a number alone: all are *right*, within this part of the greatest displacement (of reaction and energy too where the curve is exact).
  Right is 1e-5 and less in f64, 5e-3 and less in f32;
- `n: number`: so many laws are right, the others are
- *another solution*: not the one that is the same everywhere, but its equations are satisfied: compressed blocks buckle;
- *told*: off by more, and a warning or the estimate in summary.json says so;
- *stopped*: exit status 3 with a reason, results kept; *refused*: exit status 2 with a message;
- **wrong**: a NaN, a silent inversion, or an error that nothing speaks of.

References are a law's curve in exact arithmetic where a block is stretched the same everywhere, else the same scene in other units
(lengths times 1.7, densities times 0.7, stiffness times 1.3 or 0.7), in f64 and with tolerances of 1e-11, whose last step has to satisfy the
integrator's equations to 1e-5 by code of its own: the law's textbook form on each tetrahedron by itself. Steps of the twin are as long in its own unit of time, so that the error of the step is no part
of what is measured here (docs/accuracy.md has that). Bodies have 48 to 96 linear tetrahedra, f32 tolerances of 1e-6, f64 1e-9. The unit of time is what a wave
along a bar takes for a unit of length.

What stops at these extremes goes on with a better method, and that is known: energies of log J cannot recover once a step or an imposed
motion has turned an element inside out (sub-steps until J is above .1, and a line search on the energy); explicit steps above the critical
one have no remedy but a smaller step (or one that follows the stretch); equilibria of parts that differ a million times in stiffness need a
stopping rule in the norm of the energy.
";

/// Runs the suite and writes the page; with `--planted` the part of planted faults too, with `--gpu` on a GPU too.
///
/// # Errors
/// Wrong arguments; the suite does not build or run; the page cannot be written; a cell is wrong.
pub fn call(options: &[&str]) -> Result<(), Failure> {
    if let Some(other) = options.iter().find(|option| !["--planted", "--gpu"].contains(*option)) {
        return Err(Failure::Usage(format!("`extremes` takes --planted and --gpu, not {other}")));
    }
    let (plant, gpu) = (options.contains(&"--planted"), options.contains(&"--gpu"));
    let path = root().join("docs/stability.md");
    let before = std::fs::read_to_string(&path).unwrap_or_default();
    let known = before.find(PLANTED).map(|at| before[at..].to_string()).unwrap_or_default();
    let planted = if plant { format!("{PLANTED}{}", planted::section()?) } else { known };
    say("== the suite of extremes");
    let arguments = ["run", "--release", "--quiet", "--package", "tensormass-stability", "--"];
    let places = if gpu { &[][..] } else { &["--place", "f64", "--place", "f32"][..] };
    let mut command = cargo(&[&arguments[..], places].concat());
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| Failure::Step(format!("extremes: cannot run cargo: {error}")))?;
    let wrong = output.status.code() == Some(WRONG);
    if !output.status.success() && !wrong {
        return Err(Failure::Step(format!("extremes: {}; see above", output.status)));
    }
    let tables = String::from_utf8(output.stdout).map_err(|error| Failure::Step(format!("extremes: {error}")))?;
    std::fs::write(&path, format!("{INTRODUCTION}{tables}{planted}"))
        .map_err(|e| Failure::Step(format!("cannot write docs/stability.md: {e}; make the folder writable")))?;
    say("wrote docs/stability.md: review and commit it");
    if wrong { Err(Failure::Step("extremes: a cell is wrong; see docs/stability.md".to_string())) } else { Ok(()) }
}

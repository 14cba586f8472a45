//! The runs that vary one axis at a time, to separate what may lie behind the paper's errors.

use super::paper::Scheme::{Implicit, SemiImplicit};
use super::runs::{DURATION, Measured, RAMP, Spec, Tensormass};
use crate::process::Failure;

/// One axis: a heading, what is varied and why, and a run for each value.
#[derive(Debug)]
pub struct Experiment {
    /// Heading.
    pub title: &'static str,
    /// What is varied.
    pub text: String,
    /// The varied run in words, how it was made, what it found.
    pub runs: Vec<(String, Spec, Measured)>,
}

/// All axes.
#[derive(Debug)]
pub struct Experiments {
    /// 64 bits instead of 32.
    pub precision: Experiment,
    /// The length of the ramp, with the same hold after it.
    pub ramp: Experiment,
    /// No hold: read when the ramp ends.
    pub no_hold: Experiment,
    /// Mass damping, in 1/s.
    pub damping: Experiment,
    /// Conjugate gradients' tolerance.
    pub tolerance: Experiment,
}

/// Mass damping of the damped runs in 1/s: free vibrations fall by exp(-alpha t / 2), here by exp(-9.6) in the hold.
pub const DAMPING: f64 = 40.0;

/// Makes all runs, on the CPU.
///
/// # Errors
/// A run fails.
pub fn all(tensormass: &Tensormass) -> Result<Experiments, Failure> {
    let explicit = |step| Spec::new(SemiImplicit, step);
    let implicit = |step| Spec::new(Implicit, step);
    let steps = [0.00005, 0.0001, 0.0002];
    let run = |title, text: String, specs: Vec<(String, Spec)>| {
        let measure = |(what, spec): (String, Spec)| {
            let label = format!("{title}: {what}, {}, step {} s", spec.scheme.words(), spec.step);
            let measured = tensormass.run(&label, &spec, "cpu")?;
            Ok((what, spec, measured))
        };
        Ok(Experiment { title, text, runs: specs.into_iter().map(measure).collect::<Result<_, Failure>>()? })
    };
    let wide = |spec: Spec| ("f64".to_string(), spec.with("solver.precision=f64"));
    let precision = run(
        "Precision",
        "f64 instead of the tables' f32. Both store displacements, never positions.".to_string(),
        [explicit(0.00005), explicit(0.0002), implicit(0.04), implicit(0.16)].map(wide).to_vec(),
    )?;
    let hold = DURATION - RAMP;
    let ramp = run(
        "Ramp",
        format!("The ramp's length, with the same {hold} s of hold after it."),
        [0.12, 0.24, 0.96].map(|r| (format!("ramp {r} s"), explicit(0.0001).lasting(r, r + hold))).to_vec(),
    )?;
    let ended = |spec: Spec| (format!("ramp {DURATION} s"), spec.lasting(DURATION, DURATION));
    let mut no_hold = steps.map(explicit).map(ended).to_vec();
    no_hold.extend([0.00005, 0.0002, 0.04, 0.16].map(implicit).map(ended));
    let no_hold = run(
        "No hold",
        format!("The ramp lasts for the whole {DURATION} s, and the modulus is read at the instant when it ends."),
        no_hold,
    )?;
    let damped = |step| (format!("alpha {DAMPING}/s"), explicit(step).with(&format!("solver.mass_damping={DAMPING}")));
    let damping = run(
        "Damping",
        format!("Mass damping of {DAMPING}/s, which leaves exp(-9.6) of a vibration at the end of the hold."),
        steps.map(damped).to_vec(),
    )?;
    let loose = |(step, tolerance): (f64, &str)| {
        let spec = implicit(step).with(&format!("solver.cg.tolerance={tolerance}"));
        (format!("tolerance {tolerance}"), spec)
    };
    let tolerance = run(
        "Tolerance of conjugate gradients",
        "Looser than the tables' 1e-6.".to_string(),
        [(0.00005, "1e-1"), (0.0002, "1e-1"), (0.04, "1e-1"), (0.04, "1e-2"), (0.04, "1e-4"), (0.16, "1e-1")]
            .into_iter()
            .chain([(0.16, "1e-2"), (0.16, "1e-4")])
            .map(loose)
            .collect(),
    )?;
    Ok(Experiments { precision, ramp, no_hold, damping, tolerance })
}

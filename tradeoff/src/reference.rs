//! A reference for a scene, and how well it has converged.
//!
//! It is computed in f64, with the element of the highest order that its mesh can have, central differences at the safe step (or in
//! equilibrium with tight tolerances), on meshes that are refined as far as the budget allows. How far the finest is from the one
//! before bounds the error of the one before; where three meshes show an order of convergence, Richardson's extrapolation gives
//! that of the finest. That, and how far a run with half the step is, add up to the reference's uncertainty.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tensormass_runtime::elements;
use tensormass_runtime::scene::{Integrator, Mesh};

use crate::experiment::{Finished, Status, bare, run};
use crate::space::{Axis, Setting, Space, SpaceError};
use crate::trajectory::{Errors, Points, Trajectory};

/// A refinement that was compared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Of what.
    pub what: String,
    /// Of meshes, the finer one of two.
    pub mesh: Option<usize>,
    /// How far the two are apart.
    pub difference: Errors,
}

/// What errors are measured against.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// The changes to the scene that it is.
    pub changes: Vec<String>,
    /// What it found.
    pub trajectory: Trajectory,
    /// At which points.
    pub points: Points,
    /// The refinements that were compared; their sum is its uncertainty.
    pub checks: Vec<Check>,
    /// Seconds that all of its runs took.
    pub wall: f64,
    /// What could not be refined.
    pub unrefined: Vec<String>,
}

/// Why there is no reference.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The scene's setting is none.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// Its first run failed.
    #[error("no reference could be computed: {reason}; {remedy}")]
    Run {
        /// Why.
        reason: String,
        /// What to do about it.
        remedy: &'static str,
    },
}

impl Reference {
    /// Its uncertainty: errors below ten times that are not resolved.
    pub fn uncertainty(&self) -> Errors {
        let meshes: Vec<&Errors> = self.checks.iter().filter(|c| c.mesh.is_some()).map(|c| &c.difference).collect();
        let of_mesh = match meshes[..] {
            [] => Errors::default(),
            [only] => *only,
            [.., coarse, fine] => coarse.both(fine, extrapolated),
        };
        let others = self.checks.iter().filter(|c| c.mesh.is_none()).map(|c| &c.difference);
        others.fold(of_mesh, |sum, difference| sum.both(difference, |a, b| a + b))
    }

    /// Computes one within a time.
    ///
    /// # Errors
    /// Not even the coarsest run came to its end.
    pub fn compute(
        space: &Space,
        points: &Points,
        within: Duration,
        stop: &AtomicBool,
        says: &mut dyn FnMut(&str),
    ) -> Result<Self, ReferenceError> {
        let started = Instant::now();
        let left = || within.saturating_sub(started.elapsed());
        let is_static = space.scene().solver.integrator == Integrator::Static;
        let base = best(space);
        let levels = space.choices(Axis::Mesh).len();
        let attempt = |setting: &Setting, within: Duration| -> Result<(Vec<String>, Finished), SpaceError> {
            let mut changes = space.changes(setting)?;
            if is_static {
                changes.push("solver.newton.tolerance=1e-8".into());
            }
            let steps = space.changed(&changes)?.solver.steps();
            let scene = space.changed(&bare(changes.clone(), steps))?;
            Ok((changes, run(&scene, "cpu", points, within, stop)))
        };
        let coarsest = if levels > 1 { base.with(Axis::Mesh, 0) } else { base };
        says("reference: the coarsest mesh");
        let (changes, first) = attempt(&coarsest, left())?;
        let Some(trajectory) = first.trajectory else { return Err(failed(first.status)) };
        let (mut finest, mut changes, mut wall) = (trajectory.clone(), changes, first.wall);
        let (mut checks, mut unrefined) = (vec![], vec![]);
        if !is_static {
            let halved = space.choices(Axis::Step).iter().position(|c| c.name == "x0.5");
            says("reference: half the step");
            let half = halved.map(|k| attempt(&coarsest.with(Axis::Step, k), left())).transpose()?;
            match half.and_then(|(_, run)| run.trajectory) {
                Some(half) => {
                    let difference = trajectory.errors(&half, points);
                    checks.push(Check { what: "half the step".into(), mesh: None, difference });
                }
                None => unrefined.push("the step: its half took too long".to_string()),
            }
        }
        // Twice as many cells each way: eight times the elements, and twice the steps or iterations.
        for level in 1..levels {
            let predicted = wall * 16.0;
            if predicted > left().as_secs_f64() {
                unrefined.push(format!(
                    "the mesh beyond {}: about {predicted:.0} s more would be needed",
                    space.choices(Axis::Mesh)[level - 1].name
                ));
                break;
            }
            says(&format!("reference: mesh {}, about {predicted:.0} s", space.choices(Axis::Mesh)[level].name));
            let (finer, run) = attempt(&base.with(Axis::Mesh, level), 2 * left())?;
            let Some(next) = run.trajectory else {
                unrefined.push(format!(
                    "the mesh to {}: {}",
                    space.choices(Axis::Mesh)[level].name,
                    reason(&run.status)
                ));
                break;
            };
            let difference = finest.errors(&next, points);
            let what = format!(
                "mesh {} and {}",
                space.choices(Axis::Mesh)[level - 1].name,
                space.choices(Axis::Mesh)[level].name
            );
            checks.push(Check { what, mesh: Some(level), difference });
            (finest, changes, wall) = (next, finer, run.wall);
        }
        // What is coarsest of a file is the scene's own mesh: a budget that has no more is still worth a study on it.
        let is_file = matches!(space.scene().mesh, Mesh::File { .. });
        if !is_file && !checks.iter().any(|check| check.mesh.is_some()) {
            return Err(ReferenceError::Run {
                reason: format!("the budget is too small to refine its mesh ({wall:.1} s for the coarsest)"),
                remedy: "give a larger --budget, or a coarser scene",
            });
        }
        let wall = started.elapsed().as_secs_f64();
        Ok(Self { changes, trajectory: finest, points: points.clone(), checks, wall, unrefined })
    }
}

/// The error of the finest of three meshes, each with half the size of the one before, from how far they are apart; at most the
/// last distance, which it is without a sound order of convergence.
fn extrapolated(coarse: f64, fine: f64) -> f64 {
    // Of order p: fine / (2^p - 1), where 2^p = coarse / fine; orders above 4 would be luck.
    let ratio = coarse / fine;
    if ratio > 2.0 { fine / (ratio.min(16.0) - 1.0) } else { fine }
}

fn failed(status: Status) -> ReferenceError {
    let remedy = "give a larger --budget, or a coarser scene";
    ReferenceError::Run { reason: reason(&status), remedy }
}

fn reason(status: &Status) -> String {
    match status {
        Status::Done => "it has no samples".into(),
        Status::TooSlow => "it takes too long".into(),
        Status::Failed(reason) => reason.clone(),
    }
}

/// The most accurate setting of the scene's own law, but for its mesh and step.
fn best(space: &Space) -> Setting {
    let named = |axis: Axis, name: &str| space.choices(axis).iter().position(|c| c.name == name);
    let mut setting = space.base();
    let info = |name: &str| elements().iter().find(|e| e.info.name == name).map(|e| e.info);
    let made = space.choices(Axis::Element).iter().enumerate().filter_map(|(k, choice)| Some((k, info(&choice.name)?)));
    // Of one order those with the most nodes need the fewest elements.
    let highest = made.max_by_key(|(_, e)| (e.order, e.nodes));
    if let Some((k, _)) = highest {
        setting = setting.with(Axis::Element, k);
    }
    for (axis, name) in [(Axis::Precision, "f64"), (Axis::Integrator, "central-difference")] {
        if let Some(k) = named(axis, name) {
            setting = setting.with(axis, k);
        }
    }
    if space.integrator(&setting) == Integrator::Static {
        setting = setting.with(Axis::Tolerance, space.choices(Axis::Tolerance).len() - 1);
    }
    let own_step = space.choices(Axis::Step).iter().position(|c| c.name == "x1").unwrap_or(0);
    setting.with(Axis::Step, own_step).with(Axis::Device, 0)
}

//! A study of a scene within a budget: the reference, settings one after the other, repeats; kept after each run, so that it can
//! be gone on with.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tensormass_runtime::model::build;
use tensormass_runtime::output::{OutputError, create_folder, write_json_atomic};

use crate::experiment::{Measured, Status, bare, run};
use crate::front::{cheapest, front};
use crate::reference::{Reference, ReferenceError};
use crate::search::next;
use crate::space::{Setting, Space, SpaceError};
use crate::trajectory::{Metric, Points};

/// The part of a budget that a reference may take, and one setting; and that after which settings are repeated.
const OF_REFERENCE: f64 = 0.4;
const OF_SETTING: f64 = 0.12;
const EXPLORES: f64 = 0.8;
/// Runs of a setting on the front, at most.
const REPEATS: usize = 3;
/// The errors for which a cheapest setting is named.
pub(crate) const TARGETS: [f64; 3] = [0.1, 0.01, 0.001];

/// How long a study may take.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    /// All of it.
    pub total: Duration,
    /// By which error settings are judged.
    pub metric: Metric,
    /// An error for which the cheapest setting is wanted, besides 10 %, 1 % and .1 %.
    pub target: Option<f64>,
}

/// Follows a study.
pub trait Follow {
    /// What is being done, and which part of the budget is used.
    fn does(&mut self, text: &str, part: f64);
    /// Set when the study shall stop what it is doing.
    fn stop(&self) -> Arc<AtomicBool>;
}

/// Why there is no study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The scene has no settings.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// There is no reference.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// Results cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The folder holds another study.
    #[error("{path} is of another scene, other changes to it or another version; give another --out, or remove it")]
    Other {
        /// The file.
        path: String,
    },
}

/// What was found so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Of which scene, by which version.
    key: String,
    /// What errors are measured against.
    pub reference: Reference,
    /// The settings that were run.
    pub measured: Vec<Measured>,
    /// Whether it ended because nothing was left to run.
    pub is_exhausted: bool,
    /// How many seconds it has taken, all calls together.
    #[serde(default)]
    pub taken: f64,
}

impl Study {
    /// Goes on with the study in a folder, or begins it. What it has taken counts: the same call again changes nothing.
    ///
    /// # Errors
    /// See [`StudyError`].
    pub fn conduct(space: &Space, out: &Path, budget: Budget, follow: &mut dyn Follow) -> Result<Self, StudyError> {
        let (started, stop) = (Instant::now(), follow.stop());
        create_folder(out)?;
        let file = out.join("study.json");
        let key = format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::json!(**space.scene()));
        let known = match read(&file) {
            Some(study) if study.key != key => return Err(StudyError::Other { path: file.display().to_string() }),
            known => known,
        };
        let before = known.as_ref().map_or(0.0, |study| study.taken);
        let taken = || before + started.elapsed().as_secs_f64();
        let used = || taken() / budget.total.as_secs_f64();
        let mut study = match known {
            Some(study) => study,
            None => {
                let points = points(space)?;
                let within = budget.total.mul_f64(OF_REFERENCE);
                let mut says = |text: &str| follow.does(text, used());
                let reference = Reference::compute(space, &points, within, &stop, &mut says)?;
                Self { key, reference, measured: vec![], is_exhausted: false, taken: 0.0 }
            }
        };
        study.keep(&file, taken())?;
        let longest = budget.total.mul_f64(OF_SETTING);
        while used() < EXPLORES && !stop.load(Ordering::SeqCst) {
            let found = next(space, &study.measured, budget.metric, longest.as_secs_f64());
            let Some((setting, limit)) = found else {
                study.is_exhausted = true;
                break;
            };
            study.is_exhausted = false;
            let left = budget.total.mul_f64((EXPLORES + 0.1 - used()).max(0.0));
            follow.does(&space.names(&setting).join(", "), used());
            let measured = study.measure(space, setting, left.min(Duration::from_secs_f64(limit)), &stop);
            if stop.load(Ordering::SeqCst) {
                break;
            }
            // Of one that was stopped before only the longer time counts.
            study.measured.retain(|m| m.setting != setting);
            study.measured.push(measured);
            study.keep(&file, taken())?;
        }
        study.repeat(space, budget, &used, follow)?;
        study.keep(&file, taken())?;
        Ok(study)
    }

    /// Writes what a later call goes on with.
    fn keep(&mut self, file: &Path, taken: f64) -> Result<(), OutputError> {
        self.taken = taken;
        write_json_atomic(file, &serde_json::json!(self))
    }

    /// Runs a setting.
    fn measure(&self, space: &Space, setting: Setting, longest: Duration, stop: &AtomicBool) -> Measured {
        let mut measured = Measured {
            setting,
            status: Status::Done,
            errors: None,
            walls: vec![],
            evaluations: 0,
            kernels: 0,
            bytes: 0,
            steps: 0,
            elements: 0,
        };
        let scene = space.changes(&setting).and_then(|changes| {
            let steps = space.changed(&changes)?.solver.steps();
            space.changed(&bare(changes, steps))
        });
        let scene = match scene {
            Ok(scene) => scene,
            Err(e) => return Measured { status: Status::Failed(e.to_string()), ..measured },
        };
        let device = space.names(&setting)[crate::Axis::Device as usize].to_string();
        let finished = run(&scene, &device, &self.reference.points, longest, stop);
        measured.status = finished.status;
        measured.walls.extend(Some(finished.wall).filter(|wall| wall.is_finite()));
        (measured.evaluations, measured.bytes) = (finished.evaluations, finished.bytes);
        (measured.steps, measured.elements) = (finished.steps, finished.elements);
        measured.kernels = finished.evaluations * finished.elements;
        let points = &self.reference.points;
        measured.errors = finished.trajectory.map(|t| t.errors(&self.reference.trajectory, points));
        measured
    }

    /// Times the settings that matter again, in turn, so that a machine that changes its pace does not choose.
    fn repeat(
        &mut self,
        space: &Space,
        budget: Budget,
        used: &dyn Fn() -> f64,
        follow: &mut dyn Follow,
    ) -> Result<(), StudyError> {
        let stop = follow.stop();
        for round in 1..REPEATS {
            let wanted: Vec<Setting> = self.that_matter(budget).iter().map(|m| m.setting).collect();
            for setting in wanted {
                let Some(k) = self.measured.iter().position(|m| m.setting == setting) else { continue };
                let part = self.measured[k].wall() / budget.total.as_secs_f64();
                let is_stopped = stop.load(Ordering::SeqCst);
                if self.measured[k].walls.len() > round || used() + 1.2 * part > 0.95 || is_stopped {
                    continue;
                }
                follow.does(&format!("again: {}", space.names(&setting).join(", ")), used());
                let again = self.measure(space, setting, budget.total, &stop);
                if again.status == Status::Done {
                    self.measured[k].walls.extend(again.walls);
                }
            }
        }
        Ok(())
    }

    /// Runs a setting afresh, and compares it.
    pub fn run_afresh(&self, space: &Space, setting: Setting) -> Measured {
        self.measure(space, setting, Duration::from_secs(86_400), &AtomicBool::new(false))
    }

    /// Those on the front, and the cheapest ones for each target.
    fn that_matter(&self, budget: Budget) -> Vec<&Measured> {
        let mut matter = front(&self.measured, budget.metric);
        for target in TARGETS.into_iter().chain(budget.target) {
            if let Some(found) = cheapest(&self.measured, &self.reference, budget.metric, target)
                && !matter.iter().any(|m| m.setting == found.setting)
            {
                matter.push(found);
            }
        }
        matter
    }
}

fn read(file: &Path) -> Option<Study> {
    serde_json::from_str(&std::fs::read_to_string(file).ok()?).ok()
}

/// The scene's own nodes, weighed by their masses.
fn points(space: &Space) -> Result<Points, StudyError> {
    let model = build(space.scene()).map_err(SpaceError::from)?;
    Ok(Points { positions: model.mesh.nodes().to_vec(), weights: model.body.masses.clone() })
}

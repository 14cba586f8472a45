//! What a study found, for people and programs: a table, a JSON file, diagrams, a page, lines of text.

mod diagram;
mod page;
mod table;

use std::path::Path;

use serde_json::{Value, json};
use tensormass_runtime::output::{OutputError, write_atomic, write_json_atomic};

use crate::experiment::Measured;
use crate::front::{cheapest, front};
use crate::space::{Axis, Space};
use crate::study::{Budget, Study, TARGETS};
use crate::trajectory::{Errors, Metric};

/// A reference is converged if it is uncertain by less than this part of the least error reported.
const CONVERGED: f64 = 0.1;

/// What is written of a study.
pub struct Report<'a> {
    space: &'a Space,
    study: &'a Study,
    budget: Budget,
}

impl<'a> Report<'a> {
    /// Of a study within a budget.
    pub fn new(space: &'a Space, study: &'a Study, budget: Budget) -> Self {
        Self { space, study, budget }
    }

    /// Writes runs.csv, report.json, the diagrams and report.html.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn write(&self, out: &Path) -> Result<(), OutputError> {
        let text = |name: &str, text: String| {
            write_atomic(&out.join(name), |file| std::io::Write::write_all(file, text.as_bytes()))
        };
        text("runs.csv", table::csv(self.space, &self.study.measured))?;
        write_json_atomic(&out.join("report.json"), &self.json())?;
        let diagrams = diagram::all(self);
        for (name, svg) in &diagrams {
            text(name, svg.clone())?;
        }
        text("report.html", page::html(self, &diagrams))
    }

    /// The error by which settings are judged.
    pub fn metric(&self) -> Metric {
        self.budget.metric
    }

    /// The settings that none beats.
    pub fn front(&self) -> Vec<&'a Measured> {
        front(&self.study.measured, self.budget.metric)
    }

    /// For each error wanted, the cheapest setting measured that has it: its error and the reference's uncertainty add up to no more.
    pub fn recommended(&self) -> Vec<(f64, Option<&'a Measured>)> {
        let own = self.budget.target.filter(|target| !TARGETS.contains(target));
        let mut targets: Vec<f64> = TARGETS.into_iter().chain(own).collect();
        targets.sort_by(|a, b| b.total_cmp(a));
        let of = |target| cheapest(&self.study.measured, &self.study.reference, self.budget.metric, target);
        targets.into_iter().map(|target| (target, of(target))).collect()
    }

    /// A setting as arguments of `tensormass run`, each a word.
    pub fn arguments(&self, measured: &Measured) -> Vec<String> {
        let changes = self.space.changes(&measured.setting).unwrap_or_default();
        let device = self.space.names(&measured.setting)[Axis::Device as usize].to_string();
        let set = changes.into_iter().flat_map(|change| ["--set".to_string(), change]);
        set.chain(["--device".to_string(), device]).collect()
    }

    /// The same to be typed: what a shell would take for a pattern is in quotation marks.
    pub fn typed(&self, measured: &Measured) -> String {
        let word = |word: String| if word.contains(['{', '[']) { format!("'{word}'") } else { word };
        self.arguments(measured).into_iter().map(word).collect::<Vec<_>>().join(" ")
    }

    /// A setting in words: what differs from the scene's own.
    pub fn words(&self, measured: &Measured) -> String {
        let (names, base) = (self.space.names(&measured.setting), self.space.base());
        let differs = measured.setting.differs(&base);
        if differs.is_empty() {
            return "as the scene is".into();
        }
        differs.iter().map(|axis| format!("{} {}", axis.name(), names[*axis as usize])).collect::<Vec<_>>().join(", ")
    }

    /// How well the reference has converged, in a sentence.
    pub fn convergence(&self) -> String {
        let metric = self.budget.metric;
        let uncertainty = self.study.reference.uncertainty().of(metric);
        let errors = self.study.measured.iter().filter_map(|m| Some(m.errors?.of(metric)));
        // What computes the reference itself differs from it by nothing.
        let least = errors.filter(|error| *error > 0.0).fold(f64::INFINITY, f64::min);
        let unrefined = &self.study.reference.unrefined;
        let also =
            if unrefined.is_empty() { String::new() } else { format!(" Not refined: {}.", unrefined.join("; ")) };
        if uncertainty <= CONVERGED * least {
            format!(
                "The reference has converged: refining it changes it by {}, less than a tenth of the least error, {}.{also}",
                percent(uncertainty),
                percent(least)
            )
        } else {
            format!(
                "The reference has not converged for all settings: refining it changes it by {}, so that errors below {} are not \
                 resolved; the least reported is {}.{also}",
                percent(uncertainty),
                percent(uncertainty / CONVERGED),
                percent(least)
            )
        }
    }

    /// What `tensormass tradeoff` prints.
    pub fn text(&self) -> String {
        let mut text = format!("{}\nfront, by time and error of {}:\n", self.convergence(), self.metric().name());
        for m in self.front() {
            let error = m.errors.map_or(f64::NAN, |e| e.of(self.metric()));
            text += &format!("  {:>9.3} s  {:>8}  {}\n", m.wall(), percent(error), self.words(m));
        }
        for (target, found) in self.recommended() {
            text += &match found {
                Some(m) => format!("{}: {:.3} s with {}\n", percent(target), m.wall(), self.typed(m)),
                None => format!("{}: {}\n", percent(target), self.why_not(target)),
            };
        }
        text
    }

    /// Why no setting has an error.
    pub fn why_not(&self, target: f64) -> String {
        let uncertainty = self.study.reference.uncertainty().of(self.budget.metric);
        if uncertainty >= target {
            format!("not resolved: the reference is uncertain by {}", percent(uncertainty))
        } else {
            "not reached".into()
        }
    }

    fn json(&self) -> Value {
        let errors = |e: Option<Errors>| e.map(|e| json!(e));
        let one = |m: &Measured| {
            let names = self.space.names(&m.setting);
            let choices: serde_json::Map<String, Value> =
                Axis::ALL.iter().zip(names).map(|(axis, name)| (axis.name().to_string(), json!(name))).collect();
            json!({
                "setting": choices, "status": m.status, "errors": errors(m.errors), "wall_s": m.wall(), "walls_s": m.walls,
                "evaluations": m.evaluations, "kernels": m.kernels, "bytes": m.bytes, "steps": m.steps,
                "elements": m.elements,
            })
        };
        let reference = &self.study.reference;
        let fronts: serde_json::Map<String, Value> = Metric::ALL
            .iter()
            .map(|metric| {
                let members = front(&self.study.measured, *metric);
                (metric.name().to_string(), json!(members.iter().map(|m| one(m)).collect::<Vec<_>>()))
            })
            .collect();
        let recommended: Vec<Value> = self
            .recommended()
            .into_iter()
            .map(|(target, found)| {
                let arguments = found.map(|m| self.arguments(m));
                json!({ "target": target, "arguments": arguments, "setting": found.map(one) })
            })
            .collect();
        json!({
            "scene": self.space.scene().path().display().to_string(),
            "metric": self.metric().name(),
            "processors": std::thread::available_parallelism().map_or(1, usize::from),
            "reference": {
                "changes": reference.changes, "uncertainty": reference.uncertainty(), "checks": reference.checks,
                "unrefined": reference.unrefined, "wall_s": reference.wall,
            },
            "converged": self.convergence(),
            "settings": self.study.measured.iter().map(one).collect::<Vec<_>>(),
            "fronts": fronts,
            "recommended": recommended,
            "exhausted": self.study.is_exhausted,
        })
    }
}

/// A part as a percentage.
fn percent(part: f64) -> String {
    match 100.0 * part {
        x if !x.is_finite() => "unknown".into(),
        x if x >= 0.001 => format!("{x:.3} %"),
        x => format!("{x:.1e} %"),
    }
}

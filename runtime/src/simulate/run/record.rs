//! What a run records: probes, frames and samples in SI units, and the files that they go to.

use std::path::{Path, PathBuf};

use crate::backend::{Backend, ForceField, LeftDomain};
use crate::frames::{FrameData, Frames};
use crate::model::Model;
use crate::output::{OutputError, ProbeTable, create_folder, remove_file};
use crate::probe::{Energies, Needs, Snapshot};
use crate::scene::Scene;
use crate::system::{SolveError, System};

use super::super::impulses::Record;
use super::super::{Observer, Sample};
use super::Run;

impl<B: Backend + 'static, F: ForceField<B> + 'static> Run<'_, B, F> {
    /// Records probes and a frame, where the scene wants them now.
    pub(super) fn record(
        &mut self,
        results: &mut Results,
        observer: &mut (dyn Observer + Send),
    ) -> Result<Result<(), SolveError>, OutputError> {
        let time = self.state.time * self.model.scale.time;
        if self.scene.output.wants_probes(self.state.step, self.steps) {
            let snapshot = match self.snapshot(self.model.recorder.needs()) {
                Ok(snapshot) => snapshot,
                Err(e) => return Ok(Err(e)),
            };
            results.last = self.model.recorder.read(&self.model.mesh, &snapshot);
            if let Some(table) = &mut results.probes {
                let mut row = vec![time];
                row.extend(&results.last);
                table.append(&row)?;
            }
        }
        if self.samples.binary_search(&self.state.step).is_ok() {
            match self.sample(results) {
                Ok(sample) => observer.sample(sample),
                Err(e) => return Ok(Err(e)),
            }
        }
        if let Some(frames) = &mut results.frames
            && self.scene.output.wants_frame(self.state.step, self.steps)
        {
            let needs = frames.needs();
            match self.frame(needs) {
                Ok(data) => frames.write(&self.model.mesh, time, &data)?,
                Err(e) => return Ok(Err(e)),
            }
        }
        if self.guards.is_due(self.state.step) {
            self.look();
        }
        Ok(Ok(()))
    }

    /// The state for an observer.
    pub(super) fn sample(&mut self, results: &Results) -> Result<Sample, SolveError> {
        let has_probes = self.scene.output.wants_probes(self.state.step, self.steps);
        let sample = Sample {
            step: self.state.step,
            time: self.state.time * self.model.scale.time,
            displacement: self.in_si(&self.state.u, self.model.scale.length),
            energies: self.energies()?,
            probes: if has_probes { results.last.clone() } else { vec![] },
        };
        self.system.backend.check()?;
        Ok(sample)
    }

    pub(super) fn snapshot(&mut self, needs: Needs) -> Result<Snapshot, SolveError> {
        let scale = self.model.scale;
        let mut snapshot = Snapshot::default();
        if needs.displacement {
            snapshot.displacement = self.in_si(&self.state.u, scale.length);
        }
        if needs.reactions {
            let mut f = self.system.backend.zeros();
            self.system.force(&self.state.u, self.state.time, &mut f)?;
            if let Some(v) = &self.state.v {
                self.system.add_damping(&self.state.u, v, &mut f);
            }
            snapshot.reactions = self.in_si(&f, -scale.force());
        }
        if needs.energies {
            snapshot.energies = self.energies()?;
        }
        if needs.stresses {
            snapshot.stresses = self.stresses();
        }
        if needs.contact {
            snapshot.contact = self.contact(Record::Probes);
        }
        self.system.backend.check()?;
        Ok(snapshot)
    }

    pub(super) fn frame(&mut self, needs: Needs) -> Result<FrameData, SolveError> {
        let scale = self.model.scale;
        let mut data = FrameData { displacement: self.in_si(&self.state.u, scale.length), ..FrameData::default() };
        if needs.velocity {
            let still = || vec![[0.0; 3]; self.model.mesh.nodes().len()];
            let v = self.state.v.as_ref();
            data.velocity = v.map_or_else(still, |v| self.in_si(v, scale.velocity()));
        }
        if needs.stresses {
            data.stresses = self.stresses();
        }
        if needs.contact {
            data.contact = self.contact(Record::Frames);
        }
        if needs.energies {
            let energies = self.system.field.element_energies(&self.system.backend, &self.state.u)?;
            data.energies = energies.into_iter().map(|w| w * scale.energy()).collect();
        } else {
            data.energies = vec![f64::NAN; self.system.body.elements.len()];
        }
        self.system.backend.check()?;
        Ok(data)
    }

    pub(super) fn stresses(&mut self) -> Vec<[f64; 9]> {
        let stress = self.model.scale.stress;
        self.system
            .field
            .cauchy(&self.system.backend, &self.state.u)
            .into_iter()
            .map(|s| s.map(|x| x * stress))
            .collect()
    }

    /// The mean force of contact on each node since the last record of a kind, in N.
    pub(super) fn contact(&mut self, of: Record) -> Vec<[f64; 3]> {
        let unit = self.model.scale.force();
        let forces = self.impulses.forces(&mut self.system, of, self.state.time);
        forces.into_iter().map(|f| f.map(|x| x * unit)).collect()
    }

    pub(super) fn energies(&mut self) -> Result<Energies, LeftDomain> {
        let System { backend, field, .. } = &mut self.system;
        let elastic = field.potential_energy(backend, &self.state.u)?;
        let unit = self.model.scale.energy();
        Ok(Energies {
            kinetic: self.state.v.as_ref().map_or(0.0, |v| self.system.kinetic_energy(v) * unit),
            elastic: elastic * unit,
            external: -self.system.load_work(&self.state.u, self.state.time) * unit,
        })
    }

    pub(super) fn in_si(&self, x: &B::Vector, unit: f64) -> Vec<[f64; 3]> {
        self.system.backend.download(x).into_iter().map(|v| v.map(|c| c * unit)).collect()
    }
}

/// The files of a run.
pub(super) struct Results {
    pub(super) folder: Option<PathBuf>,
    pub(super) probes: Option<ProbeTable>,
    pub(super) frames: Option<Frames>,
    pub(super) last: Vec<f64>,
}

impl Results {
    /// Files in a folder; those of a run until a time are kept, if it goes on from there.
    pub(super) fn create(
        scene: &Scene,
        model: &Model,
        out: Option<&Path>,
        until: Option<f64>,
    ) -> Result<Self, OutputError> {
        let Some(out) = out else { return Ok(Self { folder: None, probes: None, frames: None, last: vec![] }) };
        create_folder(out)?;
        // What an earlier run left under the names that this one may not write.
        for stale in ["summary.json", "failure.json"] {
            remove_file(&out.join(stale))?;
        }
        let mut columns = vec!["time_s".to_string()];
        columns.extend(model.recorder.names().iter().map(|(name, unit)| format!("{name} [{unit}]")));
        let (table, fields) = (out.join("probes.csv"), &scene.output.fields);
        let probes = match until {
            Some(until) => ProbeTable::resume(&table, &columns, until)?,
            None => ProbeTable::create(&table, &columns)?,
        };
        let frames = match (scene.output.frames, until) {
            (Some(0), _) => None,
            (_, Some(until)) => Some(Frames::resume(out, &model.mesh, fields, until)?),
            (_, None) => Some(Frames::create(out, &model.mesh, fields)?),
        };
        Ok(Self { folder: Some(out.to_owned()), probes: Some(probes), frames, last: vec![] })
    }
}

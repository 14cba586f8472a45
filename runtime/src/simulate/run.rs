//! One run on one backend: steps, records, and what is written of them.

mod judge;
mod record;
mod summary;

use std::path::Path;
use std::time::Instant;

use crate::backend::{Backend, ForceField};
use crate::guard::Guards;
use crate::model::Model;
use crate::output::write_json_atomic;
use crate::plan::Layout;
use crate::probe::Needs;
use crate::scene::{self, Scene};
use crate::step_limit::StepLimits;
use crate::system::{SolveError, State, StepReport, System};
use crate::tangent::{ChosenBy, Tangent};

use super::checkpoint::{Checkpoint, header};
use super::impulses::Impulses;
use record::Results;

use super::setup::{Stepper, integrator, limits, stepping};
use super::watch::Watch;
use super::{Ending, Observer, Outcome, RunError};

/// The name of the file of the newest checkpoint.
const CHECKPOINT: &str = "checkpoint.tmc";

/// A run of a scene on a backend.
pub(super) struct Run<'a, B: Backend, F: ForceField<B>> {
    scene: &'a Scene,
    model: Model,
    system: System<B, F>,
    state: State<B>,
    integrator: Stepper<B, F>,
    /// Step length and number of steps, scaled units.
    step: f64,
    steps: u64,
    cost: StepReport,
    pub(super) warnings: Vec<String>,
    guards: Guards,
    /// Displacement and velocity before the last step, where its residual will be looked at.
    before_last: Option<[Vec<[f64; 3]>; 2]>,
    limits: Option<StepLimits>,
    started: Instant,
    /// Steps whose states the observer wants.
    samples: Vec<u64>,
    watch: Watch,
    impulses: Impulses,
    layout: Layout,
    /// How products with the tangent are computed on a CPU, and who chose that.
    pub(super) tangents: Option<(Vec<Tangent>, ChosenBy)>,
}

impl<'a, B: Backend + 'static, F: ForceField<B> + 'static> Run<'a, B, F> {
    pub(super) fn new(scene: &'a Scene, mut model: Model, backend: B, field: F, layout: Layout) -> Self {
        let started = Instant::now();
        let (seconds, steps) = stepping(scene);
        let guards = Guards::new(&model.body, scene.solver.precision, steps);
        let mut system = System::new(backend, field, model.body.clone());
        let state = system.start(&model.start);
        // First, so that steps take the memory that this leaves.
        let limits = limits(scene, &mut system, &state, model.scale.time);
        let integrator = integrator(scene, &system.backend);
        let mut warnings = std::mem::take(&mut model.warnings);
        warnings.extend(guards.before());
        let step = seconds / model.scale.time;
        Self {
            scene,
            model,
            system,
            state,
            integrator,
            step,
            steps,
            cost: StepReport::default(),
            warnings,
            guards,
            before_last: None,
            limits,
            started,
            samples: vec![],
            watch: Watch::default(),
            impulses: Impulses::default(),
            layout,
            tangents: None,
        }
    }

    /// Takes all steps and writes the results.
    pub(super) fn all(
        mut self,
        out: Option<&Path>,
        from: Option<&Checkpoint>,
        observer: &mut (dyn Observer + Send),
    ) -> Result<Outcome, RunError> {
        if let Some(from) = from {
            from.check(self.scene, &self.model, self.step * self.model.scale.time, self.steps)?;
            let device = self.system.backend.name();
            if from.device() != device {
                self.warnings.push(format!(
                    "the run goes on on {device}, and began on {}: results agree to rounding only",
                    from.device()
                ));
            }
        }
        self.samples = observer.samples(self.steps);
        let until = from.map(|from| self.step * from.step() as f64 * self.model.scale.time);
        let mut results = Results::create(self.scene, &self.model, out, until)?;
        let of_frames = results.frames.as_ref().is_some_and(|frames| frames.needs().contact);
        if let Some(touch) = &mut self.system.touch
            && (of_frames || self.model.recorder.needs().contact)
        {
            touch.is_recorded = true;
        }
        self.tell_limits(observer);
        for warning in &self.warnings {
            observer.warning(warning);
        }
        let begun = match from {
            // The state of a checkpoint was recorded before, if it was to be.
            Some(from) => {
                self.go_on(from);
                Ok(())
            }
            None => {
                if self.model.start.displacement.is_some() {
                    self.look();
                }
                self.record(&mut results, observer)?
            }
        };
        let ending = match begun {
            Err(e) => Ending::Failed(e),
            Ok(()) => self.step_through(&mut results, observer)?,
        };
        if ending == Ending::Interrupted
            && let Some(out) = out
        {
            self.checkpoint().write(&out.join(CHECKPOINT))?;
        }
        if ending != Ending::Done
            && let Some(frames) = &mut results.frames
        {
            // The last state that was computed, wherever the run stopped.
            // Its energy may be undefined: that is how some runs end.
            let needs = Needs { energies: false, ..frames.needs() };
            if let Ok(data) = self.frame(needs) {
                let time = self.state.time * self.model.scale.time;
                frames.write(&self.model.mesh, time, &data)?;
            }
        }
        let energies = self.energies().ok().filter(|_| self.system.backend.check().is_ok());
        self.look_back(&ending, energies, observer);
        let summary = self.summary(&ending, energies, &results, self.started.elapsed().as_secs_f64());
        if let Some(out) = out {
            write_json_atomic(&out.join("summary.json"), &summary)?;
            if let Ending::Failed(SolveError::LeftDomain(e)) = &ending {
                write_json_atomic(&out.join("failure.json"), &self.failure(e))?;
            }
        }
        let names = self.model.recorder.names();
        let probes = names.iter().zip(&results.last).map(|((n, unit), v)| (n.clone(), *unit, *v)).collect();
        Ok(Outcome { ending, summary, probes, limits: self.limits, warnings: self.warnings })
    }

    fn step_through(
        &mut self,
        results: &mut Results,
        observer: &mut (dyn Observer + Send),
    ) -> Result<Ending, RunError> {
        // The step up to which every state is looked at: the first one, then those of a stretch that went wrong.
        let mut careful = self.state.step + 1;
        while self.state.step < self.steps {
            let before = self.state.step;
            let ahead = if before < careful { 1 } else { self.stretch() };
            self.watch.before(&mut self.system, &self.state, ahead, self.step);
            match if ahead == 1 { self.one_step() } else { self.steps_unseen(ahead) } {
                Ok(true) => {}
                // Once more, with contact.
                Ok(false) => continue,
                Err(e) if ahead == 1 || matches!(e, SolveError::Device(_)) => return Ok(Ending::Failed(e)),
                // Once more, to find the step.
                Err(_) => {
                    careful = before + ahead;
                    continue;
                }
            }
            if self.is_recorded(self.state.step)
                && let Err(e) = self.record(results, observer)?
            {
                return Ok(Ending::Failed(e));
            }
            if let Some(out) = &results.folder
                && self.scene.output.wants_checkpoint(self.state.step, self.steps)
            {
                self.checkpoint().write(&out.join(CHECKPOINT))?;
            }
            observer.progress(self.state.step, self.steps);
            if self.state.step < self.steps && observer.interrupted() {
                return Ok(Ending::Interrupted);
            }
        }
        Ok(Ending::Done)
    }

    /// Whether anything is recorded of the state after a step.
    fn is_recorded(&self, step: u64) -> bool {
        let output = &self.scene.output;
        let probes = !self.model.recorder.names().is_empty() || step == self.steps;
        (probes && output.wants_probes(step, self.steps))
            || output.wants_frame(step, self.steps)
            || output.wants_checkpoint(step, self.steps)
            || self.samples.binary_search(&step).is_ok()
    }

    /// Steps that may be taken before anything is recorded, as many as the backend likes to take without being looked at.
    fn stretch(&self) -> u64 {
        if !self.scene.solver.integrator.is_explicit() {
            return 1;
        }
        let most = self.system.backend.steps_between_checks().min(self.steps - self.state.step);
        (1..most).find(|ahead| self.is_recorded(self.state.step + ahead)).unwrap_or(most)
    }

    /// Takes a step, and says that it is good. After an error the state is the last one that is.
    fn one_step(&mut self) -> Result<bool, SolveError> {
        let k = self.state.step + 1;
        let explicit = self.scene.solver.integrator.is_explicit();
        let may_miss = self.system.touch.as_ref().is_some_and(|touch| !touch.is_looked_for);
        let before = (may_miss && !explicit).then(|| self.copies());
        let solver = &self.scene.solver;
        let is_static = solver.integrator == scene::Integrator::Static;
        let is_judged = is_static || solver.precision == scene::Precision::F32;
        if k == self.steps && !explicit && is_judged {
            // An equilibrium has no past.
            let [u, v] = [Some(&self.state.u), self.state.v.as_ref()]
                .map(|x| x.filter(|_| !is_static).map(|x| self.system.backend.download(x)).unwrap_or_default());
            self.before_last = Some([u, v]);
        }
        let mut stepped = self.integrator.step(&mut self.system, &mut self.state, self.step);
        if stepped.is_ok() && self.watch.missed(&mut self.system, &self.state, self.state.time, 1, self.step) {
            match before {
                // Contact is the last thing in an explicit step.
                None => self.system.meet_obstacles(&mut self.state, self.step),
                Some(before) => {
                    self.restore(&before);
                    stepped = self.integrator.step(&mut self.system, &mut self.state, self.step);
                }
            }
        }
        // What a failed device did to a solver is not the reason.
        let report = self.system.backend.check().map_err(SolveError::from).and(stepped)?;
        self.passed(k, report);
        let bounded = self.system.check_bounded(&self.state);
        if let Err(SolveError::Device(_)) = bounded {
            // What the device returned of this step is not known to be good.
            self.at(k - 1);
        }
        bounded.map(|()| true)
    }

    /// Takes some steps without looking at the states between; whether they are good, or have to be taken again because they
    /// may have missed contact. Then, and after an error, the state is that before all of them.
    fn steps_unseen(&mut self, ahead: u64) -> Result<bool, SolveError> {
        let copies = self.copies();
        let (before, cost) = (self.state.step, self.cost);
        self.system.field.defer_domains(true);
        let mut stepped = Ok(());
        for k in before + 1..=before + ahead {
            match self.integrator.step(&mut self.system, &mut self.state, self.step) {
                Ok(report) => self.passed(k, report),
                Err(e) => {
                    stepped = Err(e);
                    break;
                }
            }
        }
        let inside = self.system.field.check_domains(&self.system.backend).map_err(SolveError::from);
        self.system.field.defer_domains(false);
        let good = self.system.backend.check().map_err(SolveError::from).and(stepped).and(inside);
        let good = good.and_then(|()| self.system.check_bounded(&self.state));
        let from = self.step * before as f64;
        let good = good.map(|()| !self.watch.missed(&mut self.system, &self.state, from, ahead, self.step));
        if !matches!(good, Ok(true)) {
            self.restore(&copies);
            self.cost = cost;
            self.at(before);
        }
        good
    }

    /// All that it takes to go on from here.
    fn checkpoint(&self) -> Checkpoint {
        let (scale, nodes) = (self.model.scale, self.model.mesh.nodes().len() as u64);
        let device = self.system.backend.name();
        let mut header = header(self.scene, &self.model, device, [self.state.step, nodes], self.step * scale.time);
        header.integrator = self.integrator.memory();
        header.tangents = self.tangents.as_ref().map(|(tangents, _)| tangents.clone()).unwrap_or_default();
        let velocity = || vec![[0.0; 3]; self.system.body.masses.len()];
        let of = |x: &B::Vector| self.system.backend.download(x);
        let mut vectors = vec![of(&self.state.u), self.state.v.as_ref().map_or_else(velocity, of)];
        if let Some((impulses, recorded)) = self.impulses.kept(&self.system) {
            header.recorded = Some(recorded);
            vectors.extend(impulses);
        }
        Checkpoint::new(header, vectors)
    }

    /// Takes the state of a checkpoint, which was checked.
    fn go_on(&mut self, from: &Checkpoint) {
        self.state.u = self.system.backend.upload(&from.vectors[0]);
        self.state.v = self.system.body.moves.then(|| self.system.backend.upload(&from.vectors[1]));
        self.at(from.step());
        self.integrator.recall(&from.header.integrator);
        let kept = from.header.recorded.map(|recorded| ([2, 3, 4].map(|k| from.vectors[k].as_slice()), recorded));
        self.impulses.resume(&mut self.system, kept, self.state.time);
    }

    /// Displacement and velocity, to come back to.
    fn copies(&self) -> [B::Vector; 2] {
        let backend = &self.system.backend;
        [&self.state.u, self.state.velocity()].map(|x| {
            let mut copy = backend.zeros();
            backend.copy(x, &mut copy);
            copy
        })
    }

    fn restore(&mut self, [u, v]: &[B::Vector; 2]) {
        for (copy, x) in [u, v].into_iter().zip(self.state.motion()) {
            self.system.backend.copy(copy, x);
        }
    }

    fn passed(&mut self, step: u64, report: StepReport) {
        self.cost += report;
        self.at(step);
    }

    fn at(&mut self, step: u64) {
        self.state.step = step;
        // By multiplication, so that rounding does not add up over the steps.
        self.state.time = self.step * step as f64;
    }

    /// Tells the critical steps and warns of a step above them.
    fn tell_limits(&mut self, observer: &mut (dyn Observer + Send)) {
        let Some(limits) = self.limits else { return };
        observer.limits(limits);
        let step = self.step * self.model.scale.time;
        if self.scene.solver.integrator.is_explicit() {
            self.guards.step(step, limits);
        }
        if self.scene.solver.integrator.is_explicit() && step > limits.power {
            self.warnings.push(format!(
                "the step {step:.4e} s is above the critical step {:.4e} s (power iteration): the simulation will blow up; \
                 a step below {:.4e} s (element bound) is safe at rest",
                limits.power, limits.element
            ));
        }
    }
}

//! The choices that a scene leaves: axes, and settings as changes to the scene.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tensormass_runtime::model::{BuildError, Model, build};
use tensormass_runtime::moduli::moduli;
use tensormass_runtime::scene::{
    Integrator, MOST_PARTS, Mesh, Override, Parameter, ParameterValue, Scene, SceneError, load,
};
use tensormass_runtime::step_limit::element_limit;
use tensormass_runtime::{elements, laws};

use crate::twins;

/// Times at which a run is looked at, evenly spread; steps are counted in multiples of it.
pub(crate) const TIMES: u64 = 8;
/// Explicit steps are taken at this part of the critical one.
const SAFE: f64 = 0.9;
/// An implicit step, where a scene has an explicit one: so many of those.
const IMPLICIT: f64 = 16.0;

/// What is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// The constitutive law.
    Law,
    /// What the mesh is made of.
    Element,
    /// How many cells there are.
    Mesh,
    /// The integrator.
    Integrator,
    /// The time step.
    Step,
    /// The tolerance of linear solutions.
    Tolerance,
    /// The number type.
    Precision,
    /// Where it is computed.
    Device,
}

impl Axis {
    /// All of them, in the order of [`Setting`].
    pub const ALL: [Self; 8] = [
        Self::Law,
        Self::Element,
        Self::Mesh,
        Self::Integrator,
        Self::Step,
        Self::Tolerance,
        Self::Precision,
        Self::Device,
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Law => "law",
            Self::Element => "element",
            Self::Mesh => "mesh",
            Self::Integrator => "integrator",
            Self::Step => "step",
            Self::Tolerance => "tolerance",
            Self::Precision => "precision",
            Self::Device => "device",
        }
    }
}

/// A choice on each axis, by its number in [`Space::choices`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Setting(pub [usize; 8]);

impl Setting {
    /// The choice on an axis.
    pub fn on(&self, axis: Axis) -> usize {
        self.0[axis as usize]
    }

    /// The same with another choice on an axis.
    pub fn with(mut self, axis: Axis, choice: usize) -> Self {
        self.0[axis as usize] = choice;
        self
    }

    /// The axes on which two settings differ.
    pub fn differs(&self, other: &Self) -> Vec<Axis> {
        Axis::ALL.into_iter().filter(|axis| self.on(*axis) != other.on(*axis)).collect()
    }
}

/// One choice on an axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// Its name in reports.
    pub name: String,
    /// Changes to the scene that it means; without spaces, so that shells take each for a word.
    changes: Vec<String>,
}

/// Why a scene has no choices.
#[derive(Debug, thiserror::Error)]
pub enum SpaceError {
    /// The scene is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// It cannot be computed.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// The choices that a scene leaves.
#[derive(Debug)]
pub struct Space {
    path: PathBuf,
    changes: Vec<String>,
    scene: Scene,
    choices: [Vec<Choice>; 8],
    base: Setting,
    integrators: Vec<Integrator>,
    factors: Vec<f64>,
}

impl Space {
    /// The choices of a scene with some changes; GPUs are among them if `devices` names any, as `--device` takes them.
    ///
    /// # Errors
    /// The scene is wrong.
    pub fn of(path: &Path, changes: &[String], devices: &[String]) -> Result<Self, SpaceError> {
        let scene = read(path, changes)?;
        let model = build(&scene)?;
        let (law, law_base) = law_choices(&scene, &model);
        let (element, element_base) = element_choices(&scene);
        let (mesh, mesh_base) = mesh_choices(&scene);
        let integrators = match scene.solver.integrator {
            Integrator::Static => vec![Integrator::Static],
            _ => vec![Integrator::ImplicitEuler, Integrator::SemiImplicitEuler, Integrator::CentralDifference],
        };
        let integrator_base = integrators.iter().position(|i| *i == scene.solver.integrator).unwrap_or(0);
        let integrator = integrators.iter().map(|i| named(*i, "solver.integrator")).collect();
        let factors = match scene.solver.integrator {
            Integrator::Static => vec![1.0],
            _ => vec![0.125, 0.25, 0.5, 1.0, 2.0, 4.0],
        };
        let step_base = factors.iter().position(|f| *f == 1.0).unwrap_or(0);
        let step = factors.iter().map(|f| Choice { name: format!("x{f}"), changes: vec![] }).collect();
        let own = scene.solver.cg.tolerance;
        let mut tolerances: Vec<f64> =
            [1e-2, 1e-3, 1e-5, 1e-9].into_iter().filter(|t| *t != own).chain([own]).collect();
        tolerances.sort_by(|a, b| b.total_cmp(a));
        let tolerance_base = tolerances.iter().position(|t| *t == own).unwrap_or(0);
        let tolerance = tolerances
            .iter()
            .map(|t| Choice { name: format!("{t:e}"), changes: vec![format!("solver.cg.tolerance={t:?}")] })
            .collect();
        let precisions = [tensormass_runtime::scene::Precision::F32, tensormass_runtime::scene::Precision::F64];
        let precision_base = precisions.iter().position(|p| *p == scene.solver.precision).unwrap_or(0);
        let precision = precisions.iter().map(|p| named(*p, "solver.precision")).collect();
        let device = std::iter::once("cpu").chain(devices.iter().map(String::as_str));
        let device = device.map(|name| Choice { name: name.to_string(), changes: vec![] }).collect();
        Ok(Self {
            path: path.to_owned(),
            changes: changes.to_vec(),
            scene,
            choices: [law, element, mesh, integrator, step, tolerance, precision, device],
            base: Setting([
                law_base,
                element_base,
                mesh_base,
                integrator_base,
                step_base,
                tolerance_base,
                precision_base,
                0,
            ]),
            integrators,
            factors,
        })
    }

    /// The scene as it is.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene's own setting.
    pub fn base(&self) -> Setting {
        self.base
    }

    /// The choices on an axis.
    pub fn choices(&self, axis: Axis) -> &[Choice] {
        &self.choices[axis as usize]
    }

    /// A setting's choices by name, in the order of the axes.
    pub fn names(&self, setting: &Setting) -> Vec<&str> {
        Axis::ALL.iter().map(|axis| self.choices(*axis)[setting.on(*axis)].name.as_str()).collect()
    }

    /// The integrator of a setting.
    pub fn integrator(&self, setting: &Setting) -> Integrator {
        self.integrators[setting.on(Axis::Integrator)]
    }

    /// Whether a setting is one to measure: devices other than CPUs compute in f32, explicit steps are below the critical one and
    /// solve for nothing, and the finest mesh is for references.
    pub fn allows(&self, setting: &Setting) -> bool {
        let explicit = self.integrator(setting).is_explicit();
        let base = |axis: Axis| setting.on(axis) == self.base.on(axis);
        let f32 = self.choices(Axis::Precision)[setting.on(Axis::Precision)].name == "f32";
        let steps = !explicit || self.factors[setting.on(Axis::Step)] <= 1.0;
        let mesh = setting.on(Axis::Mesh) <= self.base.on(Axis::Mesh) + 1;
        mesh && (setting.on(Axis::Device) == 0 || f32) && steps && (!explicit || base(Axis::Tolerance))
    }

    /// The changes that make the scene this setting, as `--set` takes them; with the model, because explicit steps depend on it.
    ///
    /// # Errors
    /// The setting is not one of the scene: an element that its boundary does not fit, for instance.
    pub fn changes(&self, setting: &Setting) -> Result<Vec<String>, SpaceError> {
        let mut changes: Vec<String> = vec![];
        for axis in Axis::ALL {
            if setting.on(axis) != self.base.on(axis) {
                changes.extend(self.choices(axis)[setting.on(axis)].changes.iter().cloned());
            }
        }
        if let Some(step) = self.step(setting, &changes)? {
            changes.push(format!("solver.step={step:?}"));
        }
        Ok(changes)
    }

    /// The step of a setting in s; none in statics.
    fn step(&self, setting: &Setting, changes: &[String]) -> Result<Option<f64>, SpaceError> {
        let (Some(duration), Some(own)) = (self.scene.solver.duration, self.scene.solver.step) else { return Ok(None) };
        if self.integrator(setting) == Integrator::Static {
            return Ok(None);
        }
        let own_explicit = self.scene.solver.integrator.is_explicit();
        let wanted = match (self.integrator(setting).is_explicit(), own_explicit) {
            (true, _) => {
                let model = build(&read(&self.path, &[&self.changes, changes].concat())?)?;
                let safe = SAFE * element_limit(&model.body) * model.scale.time;
                if own_explicit { own.min(safe) } else { safe }
            }
            (false, true) => IMPLICIT * own,
            (false, false) => own,
        };
        let wanted = wanted * self.factors[setting.on(Axis::Step)];
        let rounds = (duration / (wanted * TIMES as f64) * (1.0 - 1e-9)).ceil().max(1.0);
        Ok(Some(duration / (rounds * TIMES as f64)))
    }

    /// The scene with some changes.
    ///
    /// # Errors
    /// They do not fit.
    pub fn changed(&self, changes: &[String]) -> Result<Scene, SpaceError> {
        Ok(read(&self.path, &[&self.changes, changes].concat())?)
    }
}

fn read(path: &Path, changes: &[String]) -> Result<Scene, SceneError> {
    let changes: Vec<Override> = changes.iter().map(|text| Override::parse(text)).collect::<Result<_, _>>()?;
    load(path, &changes)
}

/// A choice by what it is called in scenes.
fn named(value: impl Serialize, key: &str) -> Choice {
    let name = serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_string)).unwrap_or_default();
    Choice { changes: vec![format!("{key}={name}")], name }
}

/// The scene's own laws, and those that answer small strains alike, if its materials are isotropic ones of constant parameters.
fn law_choices(scene: &Scene, model: &Model) -> (Vec<Choice>, usize) {
    let own: Vec<&str> = scene.material.iter().map(|m| m.law.as_str()).collect();
    let alike = |law: &str| own.iter().all(|name| *name == law);
    let of_material = |m: &tensormass_runtime::scene::Material| {
        let law = laws().iter().find(|l| l.info.name == m.law)?;
        let mut values = vec![];
        for parameter in law.info.parameters {
            match (m.parameters.get(parameter.name), parameter.default) {
                (Some(Parameter::Constant(ParameterValue::Number(x))), _) => values.push(*x),
                (Some(Parameter::Constant(ParameterValue::Array(x))), _) => values.extend(x),
                (Some(Parameter::PerElement { .. }), _) | (None, None) => return None,
                (None, Some(default)) => values.extend(default),
            }
        }
        moduli(law, &law.constants(&values))
    };
    let mut choices = vec![Choice { name: own.join(" + "), changes: vec![] }];
    let moduli: Option<Vec<[f64; 2]>> = scene.material.iter().map(of_material).collect();
    if let Some(moduli) = moduli.filter(|_| !model.body.is_viscous()) {
        for law in twins::by_moduli().filter(|law| !alike(law.info.name)) {
            let of = |(k, [young, poisson]): (usize, &[f64; 2])| {
                vec![
                    format!("material.{k}.law={}", law.info.name),
                    format!("material.{k}.parameters={{young={young:?},poisson={poisson:?}}}"),
                ]
            };
            let changes = moduli.iter().enumerate().flat_map(of).collect();
            choices.push(Choice { name: law.info.name.to_string(), changes });
        }
    }
    (choices, 0)
}

/// The elements that a made mesh may have.
fn element_choices(scene: &Scene) -> (Vec<Choice>, usize) {
    let (own, key) = match &scene.mesh {
        Mesh::Beam { beam } => (beam.element.as_str(), "mesh.beam.element"),
        Mesh::Torus { torus } => (torus.element.as_str(), "mesh.torus.element"),
        Mesh::File { .. } => return (vec![Choice { name: "file".into(), changes: vec![] }], 0),
    };
    let dimension = elements().iter().find(|e| e.info.name == own).map_or(3, |e| e.info.dimension);
    let fitting: Vec<&str> = elements().iter().filter(|e| e.info.dimension == dimension).map(|e| e.info.name).collect();
    let base = fitting.iter().position(|name| *name == own).unwrap_or(0);
    let choice = |name: &&str| Choice { name: (*name).to_string(), changes: vec![format!("{key}={name}")] };
    (fitting.iter().map(choice).collect(), base)
}

/// A made mesh with a quarter as many to four times as many cells each way, a file's with as many parts of its elements as make these;
/// the last is for references.
fn mesh_choices(scene: &Scene) -> (Vec<Choice>, usize) {
    let factors = [(1, 4), (1, 2), (1, 1), (2, 1), (4, 1)];
    let scaled = |n: u32, (times, over): (u32, u32)| (n * times / over).max(1);
    let choice = |changes: Vec<String>, (times, over): (u32, u32)| Choice {
        name: format!("x{}", f64::from(times) / f64::from(over)),
        changes,
    };
    match &scene.mesh {
        Mesh::Beam { beam } => {
            let of = |f| {
                let [x, y, z] = beam.cells.map(|n| scaled(n, f));
                choice(vec![format!("mesh.beam.cells=[{x},{y},{z}]")], f)
            };
            (factors.into_iter().map(of).collect(), 2)
        }
        Mesh::Torus { torus } => {
            let of = |f| {
                let (across, around) = (scaled(torus.across, f), scaled(torus.around, f).max(3));
                choice(vec![format!("mesh.torus.across={across}"), format!("mesh.torus.around={around}")], f)
            };
            (factors.into_iter().map(of).collect(), 2)
        }
        Mesh::File { refine, .. } => {
            // What a file has cannot be made coarser; more parts than scenes may ask for are refused.
            let fits = |(times, over): &(u32, u32)| refine.is_multiple_of(*over) && refine * times / over <= MOST_PARTS;
            let fitting: Vec<(u32, u32)> = factors.into_iter().filter(fits).collect();
            let own = fitting.iter().position(|f| *f == (1, 1)).unwrap_or(0);
            let of = |f| choice(vec![format!("mesh.refine={}", scaled(*refine, f))], f);
            (fitting.into_iter().map(of).collect(), own)
        }
    }
}

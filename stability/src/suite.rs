//! All cells of the suite: each extreme, value and law, with each integrator, precision and device.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use tensormass_lawbench::material::{Material, Moduli, names};
use tensormass_lawbench::subject::Subject;
use tensormass_runtime::device::DeviceChoice;
use tensormass_runtime::mesh::{Mesh, beam};
use tensormass_runtime::model::build;
use tensormass_runtime::scene::{Integrator, Precision};
use tensormass_runtime::target::Target;
use tensormass_runtime::{LawEntry, laws};

use crate::extreme::Extreme;
use crate::reference::{Reference, unsolved};
use crate::run::{first_line, run};
use crate::specimen::{Fabric, Specimen, Tolerances};
use crate::verdict::{Verdict, judge};

/// The integrators, whether their steps are linearised, and their names, in the order of reports.
pub const INTEGRATORS: [(Integrator, bool, &str); 5] = [
    (Integrator::Static, false, "static"),
    (Integrator::ImplicitEuler, false, "implicit Euler"),
    (Integrator::ImplicitEuler, true, "implicit Euler, linearised"),
    (Integrator::SemiImplicitEuler, false, "semi-implicit Euler"),
    (Integrator::CentralDifference, false, "central differences"),
];

/// Where and in which precision a specimen is computed.
#[derive(Debug, Clone)]
pub struct Place {
    /// Its name in reports.
    pub name: &'static str,
    /// The device.
    pub target: Target,
    /// The precision.
    pub precision: Precision,
    /// Whether all cells are computed there, or those of one law of each kind at the ends of ranges.
    pub every_cell: bool,
}

impl Place {
    /// The CPU in both precisions, and a GPU if there is one.
    pub fn all() -> Vec<Self> {
        let mut places = vec![
            Self { name: "f64", target: Target::Cpu, precision: Precision::F64, every_cell: true },
            Self { name: "f32", target: Target::Cpu, precision: Precision::F32, every_cell: true },
        ];
        if let Ok(target) = Target::open(&DeviceChoice::Gpu, Precision::F32) {
            places.push(Self { name: "GPU", target, precision: Precision::F32, every_cell: false });
        }
        places
    }
}

/// One outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// What was driven to an extreme.
    pub extreme: Extreme,
    /// Which.
    pub value: f64,
    /// The law.
    pub law: &'static str,
    /// The integrator's place in [`INTEGRATORS`].
    pub integrator: usize,
    /// The name of the place.
    pub place: &'static str,
    /// What came of it.
    pub verdict: Verdict,
}

/// Which cells.
#[derive(Debug, Clone)]
pub struct Choice {
    /// The laws.
    pub laws: Vec<&'static LawEntry>,
    /// The extremes with their values.
    pub questions: Vec<(Extreme, Vec<f64>)>,
    /// Where they are computed.
    pub places: Vec<Place>,
    /// How long one run may take.
    pub longest: Duration,
}

impl Choice {
    /// All that there is.
    pub fn all() -> Self {
        Self {
            laws: laws().iter().collect(),
            questions: Extreme::ALL.into_iter().map(|e| (e, e.values())).collect(),
            places: Place::all(),
            longest: Duration::from_secs(120),
        }
    }

    /// What takes a minute or two: one law of each kind, and the ends of each range, on the CPU.
    pub fn short() -> Self {
        let mut all = Self::all();
        all.laws = one_of_each_kind(&all.laws);
        all.places.retain(|place| place.name != "GPU");
        let all_questions = std::mem::take(&mut all.questions);
        let mut choice = all;
        for (extreme, values) in all_questions {
            let mut ends = vec![values[0], values[values.len() / 2], values[values.len() - 1]];
            ends.dedup();
            // A hundred thousand steps are for the whole suite.
            if extreme == Extreme::Drift {
                ends = vec![2e3];
            }
            choice.questions.push((extreme, ends));
        }
        choice
    }

    /// Runs all of them; `done` is told of each law of a value.
    pub fn run(&self, done: &(dyn Fn(&[Cell]) + Sync)) -> Vec<Cell> {
        let mut each = vec![];
        for (extreme, values) in &self.questions {
            each.extend(values.iter().flat_map(|value| self.laws.iter().map(|law| (*extreme, *value, *law))));
        }
        // Threads of our own: runs have pools of theirs, and a pool that waits for another takes up more work meanwhile.
        let (next, found) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
        let work = || {
            while let Some((k, (extreme, value, law))) = {
                let k = next.fetch_add(1, Ordering::Relaxed);
                each.get(k).map(|one| (k, *one))
            } {
                let cells = self.cells(extreme, value, law);
                done(&cells);
                found.lock().unwrap_or_else(PoisonError::into_inner).insert(k, cells);
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
                scope.spawn(work);
            }
        });
        let found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
        found.into_values().flatten().collect()
    }

    fn values(&self, extreme: Extreme) -> &[f64] {
        self.questions.iter().find(|(e, _)| *e == extreme).map_or(&[], |(_, values)| values)
    }

    fn cells(&self, extreme: Extreme, value: f64, law: &'static LawEntry) -> Vec<Cell> {
        let subject = Subject::of_build(law);
        let ends = [0, self.values(extreme).len().saturating_sub(1)].map(|k| self.values(extreme).get(k));
        let is_one_of_its_kind = one_of_each_kind(&self.laws).iter().any(|one| one.info.name == law.info.name);
        // Of a hundred thousand implicit steps devices in software have no end.
        let asks = |p: &&Place, integrator: Integrator| {
            let is_short = extreme != Extreme::Drift || integrator.is_explicit();
            p.every_cell || is_one_of_its_kind && is_short && ends.contains(&Some(&value))
        };
        let poisson = if extreme == Extreme::Poisson { value } else { 0.3 };
        let integrators = INTEGRATORS.iter().enumerate().filter(|(_, (integrator, _, _))| extreme.asks(*integrator));
        let mut cells = vec![];
        for (k, (integrator, linearised, _)) in integrators {
            let places: Vec<&Place> = self.places.iter().filter(|p| asks(p, *integrator)).collect();
            let verdicts = match material(&subject, poisson) {
                Ok(material) => match extreme.specimen(value, law, &material, (*integrator, *linearised)) {
                    Ok(specimen) => self.verdicts(extreme, &specimen, &subject, &places),
                    Err(why) => vec![Verdict::Refused(first_line(&why)); places.len()],
                },
                Err(why) => vec![Verdict::Unjudged(why); places.len()],
            };
            let cell = |(place, verdict): (&Place, Verdict)| Cell {
                extreme,
                value,
                law: law.info.name,
                integrator: k,
                place: place.name,
                verdict,
            };
            cells.extend(places.iter().copied().zip(verdicts).map(cell));
        }
        cells
    }

    fn verdicts(
        &self,
        extreme: Extreme,
        specimen: &Specimen<'_>,
        subject: &Subject,
        places: &[&Place],
    ) -> Vec<Verdict> {
        let folder = match tempfile::tempdir() {
            Ok(folder) => folder,
            Err(e) => return vec![Verdict::Unjudged(e.to_string()); places.len()],
        };
        let at = (folder.path(), self.longest);
        let reference = Reference::of(extreme, specimen, subject, at);
        let rest = match rest(specimen, folder.path()) {
            Ok(rest) => rest,
            Err(why) => return vec![Verdict::Refused(first_line(&why)); places.len()],
        };
        let verdict = |place: &&Place| {
            let tolerances = Tolerances::usual(place.precision);
            let ran = run(specimen, specimen.units, &place.target, place.precision, tolerances, at);
            let unsolved = || unsolved(specimen, subject, specimen.units, &ran.looks, folder.path());
            let keeps_energy = specimen.integrator.is_explicit() && specimen.law.damping.is_none();
            judge(&ran, &reference, &rest, (place.precision, keeps_energy), unsolved)
        };
        places.iter().map(verdict).collect()
    }
}

/// The first law of each kind: linear or not, with a domain or not, with a preferred direction or not, with damping or not.
fn one_of_each_kind(laws: &[&'static LawEntry]) -> Vec<&'static LawEntry> {
    let kind = |law: &LawEntry| {
        let info = law.info;
        (info.structure.linear, info.domain.is_some(), info.structure.isotropic, law.damping.is_some())
    };
    let mut found: Vec<&LawEntry> = vec![];
    for law in laws {
        if !found.iter().any(|other| kind(other) == kind(law)) {
            found.push(law);
        }
    }
    found
}

/// The body at rest, in units of length; a sliver's in m.
fn rest(specimen: &Specimen<'_>, folder: &std::path::Path) -> Result<Mesh, String> {
    if specimen.fabric == Fabric::Uniform {
        let (size, cells) = specimen.beam();
        return beam(size, cells.map(|n| n as usize), [0.0; 3]).map_err(|e| e.to_string());
    }
    let scene = specimen.scene(specimen.units, Precision::F64, Tolerances::TIGHT, folder).map_err(|e| e.to_string())?;
    Ok(build(&scene).map_err(|e| e.to_string())?.mesh)
}

/// A law's usual material at a Poisson's ratio, its fibres along x.
fn material(subject: &Subject, poisson: f64) -> Result<Material, String> {
    let mut material = Material::near(subject, poisson).map_err(|e| e.to_string())?;
    for ((name, parameter), value) in names(&subject.law).iter().zip(&mut material.parameters) {
        if parameter.direction {
            *value = f64::from(u8::from(name.ends_with("[0]")));
        }
    }
    material.moduli = Moduli::at_rest(&subject.derivation, &material.parameters);
    Ok(material)
}

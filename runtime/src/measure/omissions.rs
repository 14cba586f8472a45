//! What it gains to leave out what a scene does not require: the same scene with something and without it, in turn.
//!
//! Times are of steps alone: a run's clock starts after its first step, when kernels are compiled and caches are filled.

use std::fmt::Write as _;
use std::time::Instant;

use tensormass_kernels::{ElementEntry, LawEntry, laws};

use super::body::parameter;
use super::{MeasureError, median};
use crate::plan::precision_name;
use crate::scene::{self, Precision};
use crate::simulate::{Ending, Observer, run_on};
use crate::step_limit::StepLimits;
use crate::target::Target;

/// What omissions are measured on.
#[derive(Debug, Clone)]
pub struct Setting {
    /// What the beam of 5 x 1 x 1 m is made of.
    pub element: &'static ElementEntry,
    /// Its cells.
    pub cells: [usize; 3],
    /// Numbers of state and kernels.
    pub precision: Precision,
    /// Runs of each scene, at least 1.
    pub repeats: usize,
    /// CPU threads; 0 takes all cores.
    pub threads: usize,
}

/// A scene with or without something.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Side {
    /// Seconds of a step, run after run.
    pub seconds: Vec<f64>,
    /// Bytes that were held at once.
    pub bytes: usize,
    /// Kernels that ran in it, and less often or not at all in the other.
    pub kernels: Vec<String>,
}

/// What was measured of something that scenes may leave out.
#[derive(Debug, Clone, PartialEq)]
pub struct Omission {
    /// What it is.
    pub name: &'static str,
    /// The law of the scene that has it.
    pub law: &'static str,
    /// The scene that has it.
    pub with: Side,
    /// The same scene without it.
    pub without: Side,
}

impl Omission {
    /// How many times as long a step takes with it: of the runs in turn, ascending.
    pub fn ratios(&self) -> Vec<f64> {
        let pairs = self.with.seconds.iter().zip(&self.without.seconds);
        let mut ratios: Vec<f64> = pairs.map(|(with, without)| with / without).collect();
        ratios.sort_by(f64::total_cmp);
        ratios
    }

    /// The median of these.
    pub fn ratio(&self) -> f64 {
        median(&self.ratios())
    }
}

/// A clock that starts after the first step.
#[derive(Default)]
struct Clock {
    first: Option<(u64, Instant)>,
    last: Option<(u64, Instant)>,
}

impl Observer for Clock {
    fn warning(&mut self, _: &str) {}
    fn limits(&mut self, _: StepLimits) {}
    fn progress(&mut self, step: u64, _: u64) {
        let now = (step, Instant::now());
        self.first.get_or_insert(now);
        self.last = Some(now);
    }
    fn interrupted(&self) -> bool {
        false
    }
}

impl Clock {
    /// Seconds of a step.
    fn seconds(&self) -> f64 {
        match (self.first, self.last) {
            (Some((from, start)), Some((to, end))) if to > from => (end - start).as_secs_f64() / (to - from) as f64,
            _ => f64::NAN,
        }
    }
}

/// A thing to leave out, the law, and the scene with it and without.
type Pair = (&'static str, &'static str, String, String);

/// Measures each omission that this build's laws allow for.
///
/// # Errors
/// A scene cannot be run.
pub(super) fn omissions(target: &Target, setting: &Setting) -> Result<Vec<Omission>, MeasureError> {
    let measured = |(name, law, with, without): Pair| -> Result<Omission, MeasureError> {
        let [with, without] = [with, without].map(|text| scene::parse(&text, "bench.toml", &[]));
        let scenes = [with?, without?];
        let mut sides = [Side::default(), Side::default()];
        let mut kernels: [Vec<(String, u64)>; 2] = [vec![], vec![]];
        for repeat in 0..setting.repeats.max(1) {
            // In turn, and each first as often: a drift of the machine does not become a result.
            for k in if repeat % 2 == 0 { [0, 1] } else { [1, 0] } {
                let mut clock = Clock::default();
                let outcome = run_on(target, &scenes[k], None, &mut clock)?;
                if let Ending::Failed(error) = outcome.ending {
                    return Err(error.into());
                }
                let inventory = &outcome.summary["inventory"];
                sides[k].seconds.push(clock.seconds());
                sides[k].bytes = inventory["allocated_bytes"].as_u64().unwrap_or(0) as usize;
                let names = inventory["kernel_runs"].as_object().into_iter().flatten();
                kernels[k] = names.map(|(name, runs)| (name.clone(), runs.as_u64().unwrap_or(0))).collect();
            }
        }
        for k in 0..2 {
            let others = |name: &str| kernels[1 - k].iter().find(|(n, _)| n == name).map_or(0, |(_, runs)| *runs);
            let more = kernels[k].iter().filter(|(name, runs)| *runs > others(name));
            sides[k].kernels = more.map(|(name, _)| name.clone()).collect();
        }
        let [with, without] = sides;
        Ok(Omission { name, law, with, without })
    };
    pairs(target, setting).into_iter().map(measured).collect()
}

const EXPLICIT: &str = "integrator = \"semi-implicit-euler\"\nstep = 1e-6\nduration = 6.5e-5\n";
const IMPLICIT: &str =
    "integrator = \"implicit-euler\"\nstep = 1e-3\nduration = 4e-3\nnewton = { max_iterations = 1 }\n";
/// As many vectors of Newton's method in statics as in steps.
const ITERATED: &str = "integrator = \"implicit-euler\"\nstep = 1e-3\nduration = 4e-3\nnewton = { tolerance = 1e-3 }\n";
const STATIC: &str = "integrator = \"static\"\nstep = 1e-3\nduration = 4e-3\nnewton = { tolerance = 1e-3 }\n";
const CLAMPED: &str = "[[boundary]]\nnodes = \"near(x, xmin)\"\nfix = [\"x\", \"y\", \"z\"]\n";
const WEIGHT: &str = "[[load]]\nkind = \"gravity\"\nacceleration = [0, 0, -1e-3]\n";

fn floor(z: f64) -> String {
    format!("[[obstacle]]\nshape = {{ plane = {{ point = [0, 0, {z:?}], normal = [0, 0, 1] }} }}\n")
}

fn pairs(target: &Target, setting: &Setting) -> Vec<Pair> {
    let find = |wanted: &dyn Fn(&LawEntry) -> bool| laws().iter().find(|law| wanted(law));
    let plain = |law: &LawEntry| {
        law.damping.is_none() && law.info.domain.is_none() && !law.info.parameters.iter().any(|p| p.direction)
    };
    let linear = find(&|law| plain(law) && law.info.structure.linear);
    let finite = find(&|law| plain(law) && !law.info.structure.linear);
    let mut pairs = vec![];
    if let Some(law) = finite.or(linear) {
        let text = |solver: &str, parts: &[&str]| scene_text(setting, law, &[], solver, parts);
        let [stress, energy] = ["stress\"\ncomponent = \"von_mises", "energy\"\npart = \"total"];
        let probe = |kind: &str| format!("[[probe]]\nname = \"probe\"\nkind = \"{kind}\"\n");
        let [near, far] = [floor(0.0), floor(-100.0)];
        let beta = format!("{EXPLICIT}stiffness_damping = 1e-9\n");
        let alpha = format!("{IMPLICIT}mass_damping = 1.0\n");
        let consistent = format!("{IMPLICIT}mass = \"consistent\"\n");
        let parts = [CLAMPED, WEIGHT];
        let explicit = |more: &str| text(EXPLICIT, &[CLAMPED, WEIGHT, more]);
        let name = law.info.name;
        pairs.extend([
            ("contact", name, text(EXPLICIT, &[&near]), text(EXPLICIT, &[])),
            ("contact while the gap cannot close", name, text(EXPLICIT, &[&near]), text(EXPLICIT, &[&far])),
            ("supports", name, text(EXPLICIT, &[CLAMPED]), text(EXPLICIT, &[])),
            ("stiffness damping, explicit", name, text(&beta, &parts), text(EXPLICIT, &parts)),
            ("mass damping, implicit", name, text(&alpha, &parts), text(IMPLICIT, &parts)),
            ("consistent masses, implicit", name, text(&consistent, &parts), text(IMPLICIT, &parts)),
            ("a probe of stresses in each step", name, explicit(&probe(stress)), explicit("")),
            ("a probe of energies in each step", name, explicit(&probe(energy)), explicit("")),
            ("velocities and inertia (static)", name, text(ITERATED, &parts), text(STATIC, &parts)),
            ("the tangent (explicit)", name, text(IMPLICIT, &parts), text(EXPLICIT, &parts)),
        ]);
        if matches!(target, Target::Cpu) {
            let [double, single] = [Precision::F64, Precision::F32]
                .map(|precision| scene_text(&Setting { precision, ..setting.clone() }, law, &[], EXPLICIT, &parts));
            pairs.push(("double precision", name, double, single));
        }
    }
    if let (Some(law), Target::Cpu) = (linear, target) {
        // What a law costs whose tangent is not known to be constant: G is gathered, and everything computed.
        let text = |tangent: &str| {
            let solver = format!("{IMPLICIT}cg = {{ tangent = \"{tangent}\" }}\n");
            scene_text(setting, law, &[], &solver, &[CLAMPED, WEIGHT])
        };
        let name = "a tangent that depends on the state, of a linear law";
        pairs.push((name, law.info.name, text("recomputed"), text("stored")));
    }
    if let Some([viscous, elastic]) = damped_and_not() {
        for (name, solver) in [("viscosity, explicit", EXPLICIT), ("viscosity, implicit", IMPLICIT)] {
            let [with, without] =
                [viscous, elastic].map(|law| scene_text(setting, law, &[], solver, &[CLAMPED, WEIGHT]));
            pairs.push((name, viscous.info.name, with, without));
        }
    }
    if let Some((law, name)) = with_fibres() {
        let elements = crate::mesh::beam_of(setting.element, [5.0, 1.0, 1.0], setting.cells, [0.0; 3]);
        let mut rows = String::new();
        for e in 0..elements.map_or(0, |mesh| mesh.len()) {
            let _ = write!(rows, "[1.0, {:?}, 0.0],", (e % 1000) as f64 / 1000.0);
        }
        let each = format!("{name} = {{ per_element = [{rows}] }}");
        let text = |own: &[(&str, &str)]| scene_text(setting, law, own, EXPLICIT, &[CLAMPED, WEIGHT]);
        pairs.push(("a direction for each element", law.info.name, text(&[(name, &each)]), text(&[])));
    }
    pairs
}

/// A law with a dissipation and one that is the same without it, by the operations of their kernels.
fn damped_and_not() -> Option<[&'static LawEntry; 2]> {
    let count = |law: &LawEntry, kernel: &str| crate::plan::point_operations(law.info, kernel);
    let same = |a: &LawEntry, b: &LawEntry| {
        ["energy", "force", "dforce", "diagonal"].iter().all(|kernel| count(a, kernel) == count(b, kernel))
            && a.info.domain == b.info.domain
            && a.info.stored == b.info.stored
    };
    let dissipative = laws().iter().filter(|law| law.damping.is_some());
    let mut pairs = dissipative.filter_map(|viscous| {
        let elastic = laws().iter().find(|law| law.damping.is_none() && same(law, viscous))?;
        Some([viscous, elastic])
    });
    pairs.next()
}

/// A law with a direction that may be given for each element, and the parameter's name.
fn with_fibres() -> Option<(&'static LawEntry, &'static str)> {
    laws().iter().find_map(|law| {
        let own = law.info.parameters.iter().find(|p| p.direction && p.per_element)?;
        Some((law, own.name))
    })
}

/// A scene of a beam of a law, whose parameters are in the middle of their ranges but for some.
fn scene_text(setting: &Setting, law: &LawEntry, own: &[(&str, &str)], solver: &str, parts: &[&str]) -> String {
    let value = |p: &tensormass_kernels::ParameterInfo| {
        let found = own.iter().find(|(name, _)| *name == p.name);
        match found {
            Some((_, text)) => (*text).to_string(),
            // The middle of a viscosity's range would ask for steps shorter than these.
            None if p.dimensions == [0, 1, 1] && p.len == 1 => format!("{} = 1.0", p.name),
            None => parameter(p, 1.0),
        }
    };
    let parameters: Vec<String> = law.info.parameters.iter().map(value).collect();
    format!(
        "[mesh]\nbeam = {{ size = [5, 1, 1], cells = {:?}, element = \"{}\" }}\n[[material]]\nlaw = \"{}\"\n\
         density = 1000.0\nparameters = {{ {} }}\n{}[output]\nframes = 0\n[solver]\nprecision = \"{}\"\nthreads = {}\n{solver}",
        setting.cells,
        setting.element.info.name,
        law.info.name,
        parameters.join(", "),
        parts.concat(),
        precision_name(setting.precision),
        setting.threads,
    )
}

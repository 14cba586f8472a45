//! What is driven to extremes, and the specimens that are.

use tensormass_lawbench::material::Material;
use tensormass_runtime::LawEntry;
use tensormass_runtime::model::build;
use tensormass_runtime::scene::{Integrator, Precision};
use tensormass_runtime::step_limit::element_limit;

use crate::specimen::{Drive, Fabric, Specimen, Tolerances, Units};

/// What is driven to extremes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extreme {
    /// Poisson's ratio.
    Poisson,
    /// Young's modulus.
    Stiffness,
    /// Lengths.
    Size,
    /// Stiffnesses in one mesh.
    StiffnessRatio,
    /// Densities in one mesh.
    DensityRatio,
    /// The height of one element.
    Sliver,
    /// The step.
    Step,
    /// The stretch.
    Stretch,
    /// How a body begins.
    Start,
    /// How fast it spins.
    Spin,
    /// How many steps are taken.
    Drift,
}

/// How bodies begin: the gradient of the displacement, and what it is.
const STARTS: [(&str, [f64; 3]); 4] = [
    ("stretched to 2.5", [1.5, -0.37, -0.37]),
    ("flattened to 1e-3", [0.0, 0.0, -0.999]),
    ("collapsed to a plane", [0.0, 0.0, -1.0]),
    ("inside out", [0.0, 0.0, -2.0]),
];

/// The weight of a beam, as a part of its stiffness over its length: its end sags by a tenth of its length.
const WEIGHT: f64 = 5e-4;
/// The duration of motions, in units of time: half a period of the beam.
const DURATION: f64 = 50.0;
/// Explicit steps, as a part of the critical one, and at most how many.
const EXPLICIT: f64 = 0.5;
const STEPS: f64 = 2000.0;
/// Implicit steps of the same duration.
const IMPLICIT: u64 = 40;

impl Extreme {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Poisson,
        Self::Stiffness,
        Self::Size,
        Self::StiffnessRatio,
        Self::DensityRatio,
        Self::Sliver,
        Self::Step,
        Self::Stretch,
        Self::Start,
        Self::Spin,
        Self::Drift,
    ];

    /// A title, and what is done.
    pub fn about(self) -> [&'static str; 2] {
        match self {
            Self::Poisson => [
                "Poisson's ratio",
                "A law's usual material, as nearly incompressible as its parameters allow. Static: a block stretched by 10 %, against the law's exact curve; else a beam that sags.",
            ],
            Self::Stiffness => [
                "Young's modulus (Pa)",
                "Static: a block stretched by 10 %, against the law's exact curve; else a beam that sags under a weight in proportion.",
            ],
            Self::Size => ["Size (m)", "As before, of a block and beam whose sides are so long."],
            Self::StiffnessRatio => ["Ratio of stiffnesses", "A beam whose outer half is so many times as stiff."],
            Self::DensityRatio => [
                "Ratio of densities",
                "A beam whose outer half is so many times as dense, under a weight of as much less.",
            ],
            Self::Sliver => ["Height of a sliver", "A beam with one tetrahedron squeezed to this part of its height."],
            Self::Step => [
                "Step over the critical one",
                "A beam that sags, in steps of this part of the critical one (element bound).",
            ],
            Self::Stretch => [
                "Stretch",
                "A block between planes, its sides free, stretched by so much. Static: against the law's exact curve; else pulled within 50 units of time.",
            ],
            Self::Start => {
                ["Start", "A free block that begins with this gradient of displacement, for 5 units of time."]
            }
            Self::Spin => {
                ["Spin (rad for each unit of time)", "A free block that spins once, or as long as its steps last."]
            }
            Self::Drift => [
                "Steps",
                "A free block of 12 elements that begins stretched by 1 % and spins, so many steps: its energy is kept by explicit integrators, and never grows by implicit ones.",
            ],
        }
    }

    /// Its values.
    pub fn values(self) -> Vec<f64> {
        match self {
            Self::Poisson => vec![0.0, 0.3, 0.45, 0.49, 0.499, 0.4999],
            Self::Stiffness => vec![1.0, 1e3, 1e6, 1e9, 1e12],
            Self::Size => vec![1e-6, 1e-3, 1.0, 1e3],
            Self::StiffnessRatio => vec![1e2, 1e4, 1e6],
            Self::DensityRatio => vec![1e2, 1e4],
            Self::Sliver => vec![1e-1, 1e-2, 1e-3, 1e-4],
            Self::Step => vec![1e-3, 1e-1, 0.9, 2.0, 10.0, 100.0],
            Self::Stretch => vec![0.01, 0.1, 0.5, 1.0 - 1e-6, 1.0 + 1e-9, 2.0, 10.0, 100.0],
            Self::Start => (0..STARTS.len()).map(|k| k as f64).collect(),
            Self::Spin => vec![1e-3, 1e-2, 1e-1, 1.0],
            Self::Drift => vec![1e5],
        }
    }

    /// A value in words.
    pub fn label(self, value: f64) -> String {
        match self {
            Self::Start => STARTS[value as usize].0.to_string(),
            Self::Stretch if (value - 1.0).abs() < 1e-3 => {
                format!("1 {} {:.0e}", if value < 1.0 { '-' } else { '+' }, (value - 1.0).abs())
            }
            _ if value != 0.0 && !(1e-2..1e3).contains(&value) => format!("{value:e}"),
            _ => format!("{value}"),
        }
    }

    /// Whether it is a question to an integrator.
    pub fn asks(self, integrator: Integrator) -> bool {
        let moves = matches!(self, Self::Step | Self::Start | Self::Spin | Self::Drift);
        !(moves && integrator == Integrator::Static)
    }

    /// The specimen of a value; none where its step cannot be found, with the reason.
    ///
    /// # Errors
    /// The program refuses the scene.
    pub fn specimen<'a>(
        self,
        value: f64,
        law: &'a LawEntry,
        material: &'a Material,
        (integrator, linearised): (Integrator, bool),
    ) -> Result<Specimen<'a>, String> {
        let is_static = integrator == Integrator::Static;
        let (mut units, mut fabric) = (Units::USUAL, Fabric::Uniform);
        let mut drive = if is_static { Drive::Stretch(1.1) } else { Drive::Weight(WEIGHT) };
        match self {
            Self::Poisson | Self::Step => {}
            Self::Stiffness => units.stress = value,
            Self::Size => units.length = value,
            Self::StiffnessRatio => (fabric, drive) = (Fabric::Halves(value, 1.0), Drive::Weight(WEIGHT)),
            Self::DensityRatio => (fabric, drive) = (Fabric::Halves(1.0, value), Drive::Weight(WEIGHT / value)),
            Self::Sliver => (fabric, drive) = (Fabric::Sliver(value), Drive::Weight(WEIGHT)),
            Self::Stretch => drive = Drive::Stretch(value),
            Self::Start => drive = Drive::Start(diagonal(STARTS[value as usize].1)),
            Self::Spin => drive = Drive::Spin(value),
            Self::Drift => drive = Drive::Begun(diagonal([0.01, 0.0, 0.0]), 0.05),
        }
        let mut specimen =
            Specimen { law, material, units, fabric, drive, integrator, linearised, step: 1.0, steps: 1 };
        if is_static {
            // So that no element is asked for more than some tenths at once.
            let logarithm = if self == Self::Stretch { value.ln().abs() } else { 0.0 };
            specimen.steps = ((10.0 * logarithm).ceil() as u64).max(1);
            return Ok(specimen);
        }
        let critical = specimen.critical_step()?;
        let duration = match self {
            Self::Spin => std::f64::consts::TAU / value,
            // Large motions of free bodies part exponentially, whatever rounds.
            Self::Start => 5.0,
            _ => DURATION,
        };
        (specimen.step, specimen.steps) = match self {
            Self::Step => (value * critical, (DURATION / (value * critical)).clamp(8.0, STEPS).round() as u64),
            Self::Drift => (0.1 * critical, value as u64),
            _ => {
                let steps = (duration / (EXPLICIT * critical)).clamp(8.0, STEPS).round();
                let duration = duration.min(steps * EXPLICIT * critical);
                let steps = if integrator.is_explicit() { steps as u64 } else { IMPLICIT };
                (duration / steps as f64, steps)
            }
        };
        Ok(specimen)
    }
}

fn diagonal(d: [f64; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { d[i] } else { 0.0 }))
}

impl Specimen<'_> {
    /// The critical step at rest (element bound), in units of time.
    fn critical_step(&self) -> Result<f64, String> {
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        let scene =
            self.scene(self.units, Precision::F64, Tolerances::TIGHT, folder.path()).map_err(|e| e.to_string())?;
        let model = build(&scene).map_err(|e| e.to_string())?;
        Ok(element_limit(&model.body) * model.scale.time / self.units.time())
    }
}

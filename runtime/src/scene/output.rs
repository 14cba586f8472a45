//! What a scene records: probes (numbers over time) and frames (fields for viewing).

use super::model::Axis;
use super::selection::Selection;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A number recorded over time, by its name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Probe {
    /// Displacement of nodes in m.
    Displacement {
        /// The probe's name in the results; unique.
        #[schemars(length(min = 1))]
        name: String,
        /// The nodes.
        nodes: Selection,
        /// The component, or the magnitude of the vector.
        component: Component,
        /// How the nodes' values become one number.
        #[serde(default)]
        statistic: Statistic,
    },
    /// Sum of the support forces at nodes with a boundary condition, in N.
    Reaction {
        /// The probe's name in the results; unique.
        #[schemars(length(min = 1))]
        name: String,
        /// The nodes.
        nodes: Selection,
        /// The component, or the magnitude of the sum.
        component: Component,
    },
    /// Sum of the forces that obstacles exert on nodes, in N: their mean since the last record.
    ContactForce {
        /// The probe's name in the results; unique.
        #[schemars(length(min = 1))]
        name: String,
        /// The nodes.
        #[serde(default)]
        nodes: Selection,
        /// The component, or the magnitude of the sum.
        component: Component,
    },
    /// Young's modulus that a traction test shows, in Pa: (axial reaction / area at rest) / (elongation / length).
    ApparentYoungModulus {
        /// The probe's name in the results; unique.
        #[schemars(length(min = 1))]
        name: String,
        /// The axis of traction.
        axis: Axis,
        /// Nodes of the end that is held.
        fixed: Selection,
        /// Nodes of the end that is pulled.
        moved: Selection,
    },
    /// An energy of the whole body in J.
    Energy {
        /// The probe's name in the results; unique.
        #[schemars(length(min = 1))]
        name: String,
        /// Which energy.
        part: EnergyPart,
    },
    /// Current volume of elements in m3.
    Volume {
        /// The probe's name in the results; unique.
        #[schemars(length(min = 1))]
        name: String,
        /// The elements; expressions and boxes test an element's centroid at rest.
        #[serde(default)]
        elements: Selection,
    },
    /// Cauchy stress of elements in Pa.
    Stress {
        /// The probe's name in the results; unique.
        #[schemars(length(min = 1))]
        name: String,
        /// The elements; expressions and boxes test an element's centroid at rest.
        #[serde(default)]
        elements: Selection,
        /// The component, or an invariant.
        component: StressComponent,
        /// How the elements' values become one number; the mean is weighted by the volume at rest.
        #[serde(default)]
        statistic: Statistic,
    },
    /// Cauchy stress at a point of the body, which moves with it, in Pa.
    PointStress {
        /// The probe's name in the results; unique.
        #[schemars(length(min = 1))]
        name: String,
        /// Where the point is at rest, m; in plane bodies z does not matter.
        #[schemars(inner(range(min = -1e6, max = 1e6)))]
        point: [f64; 3],
        /// The component, or an invariant.
        component: StressComponent,
    },
}

impl Probe {
    /// The probe's name in the results.
    pub fn name(&self) -> &str {
        match self {
            Self::Displacement { name, .. }
            | Self::Reaction { name, .. }
            | Self::ContactForce { name, .. }
            | Self::ApparentYoungModulus { name, .. }
            | Self::Energy { name, .. }
            | Self::Volume { name, .. }
            | Self::Stress { name, .. }
            | Self::PointStress { name, .. } => name,
        }
    }

    /// The unit of the recorded number.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Displacement { .. } => "m",
            Self::Reaction { .. } | Self::ContactForce { .. } => "N",
            Self::ApparentYoungModulus { .. } | Self::Stress { .. } | Self::PointStress { .. } => "Pa",
            Self::Energy { .. } => "J",
            Self::Volume { .. } => "m3",
        }
    }
}

/// A component of a vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
    /// The vector's length.
    Magnitude,
}

/// How several values become one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Statistic {
    /// Their mean.
    #[default]
    Mean,
    /// The greatest.
    Max,
    /// The least.
    Min,
}

/// An energy of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EnergyPart {
    /// Of motion.
    Kinetic,
    /// Stored by deformation.
    Elastic,
    /// Potential of the loads; 0 at rest.
    External,
    /// The sum of the other three.
    Total,
}

/// A component or an invariant of the Cauchy stress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StressComponent {
    /// Normal stress along x.
    Xx,
    /// Normal stress along y.
    Yy,
    /// Normal stress along z.
    Zz,
    /// Shear stress in the x-y plane.
    Xy,
    /// Shear stress in the y-z plane.
    Yz,
    /// Shear stress in the x-z plane.
    Xz,
    /// Von Mises' equivalent stress.
    VonMises,
    /// Minus a third of the trace.
    Pressure,
}

/// A field written into frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub enum Field {
    /// Displacement of nodes in m.
    #[serde(rename = "displacement")]
    Displacement,
    /// Velocity of nodes in m/s.
    #[serde(rename = "velocity")]
    Velocity,
    /// Force of contact on nodes in N, its mean since the last frame.
    #[serde(rename = "contact")]
    Contact,
    /// Cauchy stress of elements in Pa.
    #[serde(rename = "cauchy")]
    Cauchy,
    /// Von Mises' equivalent stress of elements in Pa.
    #[serde(rename = "von_mises")]
    VonMises,
    /// Current volume over volume at rest of elements.
    #[serde(rename = "J")]
    J,
    /// Strain energy for each volume at rest of elements in J/m3.
    #[serde(rename = "energy_density")]
    EnergyDensity,
}

/// What is written for viewing: at most one of `frames` and `every`; without either, the first and the last state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Number of frames over the whole run besides the one at time 0, from 0 to 100000; 0 writes none at all.
    #[schemars(range(min = 0, max = 100_000))]
    pub frames: Option<u32>,
    /// A frame every so many steps, from 1 to 1000000000.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub every: Option<u32>,
    /// The fields in each frame.
    pub fields: Vec<Field>,
    /// Probes are recorded every so many steps, and at the first and the last; from 1 to 1000000000.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub probe_every: u32,
    /// A checkpoint every so many steps, and after the last; from 1 to 1000000000. Without it there is one only where a run is
    /// interrupted.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub checkpoint_every: Option<u32>,
}

impl Default for Output {
    fn default() -> Self {
        Self { frames: None, every: None, fields: vec![Field::Displacement], probe_every: 1, checkpoint_every: None }
    }
}

impl Output {
    /// Whether probes are recorded after `step` of `steps` steps.
    pub fn wants_probes(&self, step: u64, steps: u64) -> bool {
        step == 0 || step == steps || step.is_multiple_of(u64::from(self.probe_every))
    }

    /// Whether there is a checkpoint after `step` of `steps` steps.
    pub fn wants_checkpoint(&self, step: u64, steps: u64) -> bool {
        self.checkpoint_every.is_some_and(|every| step == steps || step.is_multiple_of(u64::from(every)))
    }

    /// Whether the state after `step` of `steps` steps is written (step 0 is the initial state).
    pub fn wants_frame(&self, step: u64, steps: u64) -> bool {
        let ends = step == 0 || step == steps;
        match (self.frames, self.every) {
            (Some(0), _) => false,
            // Frame k is the first step at or after k / frames of the run.
            (Some(frames), _) => {
                let (frames, steps) = (u128::from(frames), u128::from(steps.max(1)));
                let passed = |step: u64| u128::from(step) * frames / steps;
                ends || passed(step) > passed(step - 1)
            }
            (None, Some(every)) => ends || step.is_multiple_of(u64::from(every)),
            (None, None) => ends,
        }
    }
}

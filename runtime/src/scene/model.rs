//! What a scene says: mesh, materials, boundary conditions, loads, initial state.
//!
//! These types are read by serde, and the JSON schema that checks scene text is made from them; a range written here
//! is therefore the range that is enforced and the range that is documented. All quantities are in SI units.

use super::obstacle::{Obstacle, Rotate};
use super::output::{Output, Probe};
use super::selection::Selection;
use super::solver::Solver;
use crate::history::History as Table;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A whole scene file, after defaults were filled in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneData {
    /// About the scene itself.
    #[serde(default)]
    pub scene: About,
    /// The body, one a scene: exactly one source of nodes and elements. Bodies do not touch each other, but obstacles.
    pub mesh: Mesh,
    /// What the body is made of; one entry a law, or several of one law over different elements.
    #[schemars(length(min = 1))]
    pub material: Vec<Material>,
    /// Nodes whose displacement is given.
    #[serde(default)]
    pub boundary: Vec<Boundary>,
    /// Forces from outside.
    #[serde(default)]
    pub load: Vec<Load>,
    /// What the body's surface cannot enter.
    #[serde(default)]
    pub obstacle: Vec<Obstacle>,
    /// The state at time 0; the displacement is zero.
    #[serde(default)]
    pub initial: Initial,
    /// How the equations of motion or of equilibrium are solved.
    pub solver: Solver,
    /// Numbers to record over time.
    #[serde(default)]
    pub probe: Vec<Probe>,
    /// What is written for viewing.
    #[serde(default)]
    pub output: Output,
}

/// About the scene itself.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct About {
    /// A title for reports.
    #[serde(default)]
    pub title: Option<String>,
}

/// The most parts into which an edge of an element of a file may be cut.
pub const MOST_PARTS: u32 = 16;

/// Where the nodes and elements come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, deny_unknown_fields)]
pub enum Mesh {
    /// A rectangular beam made by the program.
    Beam {
        /// The beam's size and division.
        beam: Beam,
    },
    /// A torus made by the program.
    Torus {
        /// The torus's size and division.
        torus: Torus,
    },
    /// A mesh file.
    File {
        /// Path of the mesh file, relative to the scene file.
        #[schemars(length(min = 1))]
        file: PathBuf,
        /// Renumber the nodes of inside-out elements instead of refusing them.
        #[serde(default)]
        orient: bool,
        /// Length of the file's unit in m (0.001 for a mesh in mm), from 1e-9 to 1e9.
        #[serde(default = "one")]
        #[schemars(range(min = 1e-9, max = 1e9))]
        scale: f64,
        /// Number of parts into which each edge of an element is cut, from 1 to 16: 2 makes 8 elements of each solid one.
        #[serde(default = "once")]
        #[schemars(range(min = 1, max = MOST_PARTS))]
        refine: u32,
    },
}

/// A rectangular beam with its edges along the axes: cells are boxes, each of 6 tetrahedra, 1 hexahedron or 2 prisms; of
/// plane elements a rectangle of 1 m thickness, each cell 2 triangles or 1 quadrangle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Beam {
    /// Edge lengths along x, y, z in m, each from 1e-9 to 1e6.
    #[schemars(inner(range(min = 1e-9, max = 1e6)))]
    pub size: [f64; 3],
    /// Number of cells along x, y, z, each from 1 to 10000, 100000000 in all.
    #[schemars(inner(range(min = 1, max = 10_000)))]
    pub cells: [u32; 3],
    /// The corner of least x, y, z in m, each within +-1e6.
    #[serde(default)]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub origin: [f64; 3],
    /// What the cells are made of: `tetrahedron_p1`, or another solid or plane element of the build.
    #[serde(default = "linear")]
    #[schemars(length(min = 1))]
    pub element: String,
}

/// A torus around an axis of coordinates, a bar of cells as those of a beam that is bent to a ring and rounded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Torus {
    /// The radius of the circle in the middle of its tube in m, from 1e-9 to 1e6.
    #[schemars(range(min = 1e-9, max = 1e6))]
    pub major_radius: f64,
    /// The radius of its tube in m, from 1e-9 to 1e6, below the other.
    #[schemars(range(min = 1e-9, max = 1e6))]
    pub minor_radius: f64,
    /// Number of cells across its tube, both ways, from 1 to 1000.
    #[schemars(range(min = 1, max = 1000))]
    pub across: u32,
    /// Number of cells around, from 3 to 10000, 100000000 in all.
    #[schemars(range(min = 3, max = 10_000))]
    pub around: u32,
    /// Its middle in m, each component within +-1e6.
    #[serde(default)]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub centre: [f64; 3],
    /// The axis around which it runs.
    #[serde(default = "upwards")]
    pub axis: Axis,
    /// What the cells are made of: `tetrahedron_p1`, or another solid element of the build.
    #[serde(default = "linear")]
    #[schemars(length(min = 1))]
    pub element: String,
}

/// The axis of a torus that names none.
fn upwards() -> Axis {
    Axis::Z
}

/// The element of a beam that names none.
fn linear() -> String {
    "tetrahedron_p1".to_string()
}

/// A constitutive law with its parameters, over some elements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// A name for reports; unique.
    #[serde(default)]
    #[schemars(length(min = 1))]
    pub name: Option<String>,
    /// The law's name, as `tensormass law list` prints it.
    #[schemars(length(min = 1))]
    pub law: String,
    /// Mass density at rest in kg/m3, above 0, at most 1e9.
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0))]
    pub density: f64,
    /// The elements made of it; expressions and boxes test an element's centroid.
    #[serde(default)]
    pub elements: Selection,
    /// The law's parameters by the law's own names; `tensormass law show NAME` gives units and ranges.
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
}

/// A material parameter: one value for the whole material, or one for each element.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, deny_unknown_fields)]
pub enum Parameter {
    /// One value for all elements of the material.
    Constant(ParameterValue),
    /// One value an element, where the law allows it.
    PerElement {
        /// The values, in the order of the mesh's elements.
        per_element: PerElement,
    },
}

/// The value of a parameter, in the law's unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ParameterValue {
    /// A number within +-1e30; the law's own range is checked later.
    Number(#[schemars(range(min = -1e30, max = 1e30))] f64),
    /// An array of numbers within +-1e30 (a direction, or the law's array of coefficients).
    Array(#[schemars(length(min = 1), inner(range(min = -1e30, max = 1e30)))] Vec<f64>),
}

/// Values for each element of the mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum PerElement {
    /// A CSV file, relative to the scene file: one row an element of the mesh.
    File(#[schemars(length(min = 1))] PathBuf),
    /// The values themselves: one an element of the mesh.
    Values(#[schemars(length(min = 1))] Vec<ParameterValue>),
}

/// A direction of space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
}

impl Axis {
    /// 0, 1 or 2.
    pub fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }
}

/// A Dirichlet condition: the displacement of some nodes, in some components, is given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, deny_unknown_fields)]
pub enum Boundary {
    /// Components that stay at zero.
    Fixed {
        /// The nodes.
        nodes: Selection,
        /// The components of displacement that are held at zero.
        #[schemars(length(min = 1))]
        fix: Vec<Axis>,
    },
    /// Components that follow a given history.
    Moved {
        /// The nodes.
        nodes: Selection,
        /// The history of each moved component.
        #[serde(rename = "move")]
        motion: Motion,
    },
    /// All components follow a turn about an axis.
    Turned {
        /// The nodes.
        nodes: Selection,
        /// The turn.
        rotate: Rotate,
    },
}

impl Boundary {
    /// The nodes that the condition holds for.
    pub fn nodes(&self) -> &Selection {
        match self {
            Self::Fixed { nodes, .. } | Self::Moved { nodes, .. } | Self::Turned { nodes, .. } => nodes,
        }
    }
}

/// The moved components; the others stay free.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Displacement along x.
    #[serde(default)]
    pub x: Option<History>,
    /// Displacement along y.
    #[serde(default)]
    pub y: Option<History>,
    /// Displacement along z.
    #[serde(default)]
    pub z: Option<History>,
}

/// A displacement over time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum History {
    /// A table of [time in s, displacement in m].
    Ramp(Ramp),
    /// A constant velocity in m/s from time 0 on, within +-1e6.
    Velocity(#[schemars(range(min = -1e6, max = 1e6))] f64),
}

impl History {
    /// The displacement in m over time in s.
    pub fn table(&self) -> Table {
        match self {
            Self::Ramp(ramp) => ramp.table(),
            // A velocity is a table that ends with the longest duration a scene may have.
            Self::Velocity(velocity) => {
                Table::table(vec![(0.0, 0.0), (LONGEST, velocity * LONGEST)]).expect("two finite, increasing entries")
            }
        }
    }
}

/// The longest duration of a scene in s.
const LONGEST: f64 = 1e9;

/// A piecewise linear table of [time in s, value]: constant before its first and after its last row. Times are within
/// 0 and 1e9, strictly increasing; values within +-1e12 (m for a displacement, a factor of 1 for a load).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Ramp(Vec<[f64; 2]>);

impl Ramp {
    /// The rows, [time in s, value].
    pub fn rows(&self) -> &[[f64; 2]] {
        &self.0
    }

    /// The value over time in s. Its times increase: no scene is read whose times do not.
    pub fn table(&self) -> Table {
        Table::table(self.0.iter().map(|row| (row[0], row[1])).collect()).unwrap_or_else(|| Table::constant(0.0))
    }

    /// The time in s after which the value no longer changes.
    pub fn end(&self) -> f64 {
        self.0.last().map_or(0.0, |row| row[0])
    }
}

impl JsonSchema for Ramp {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Ramp".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "A piecewise linear table of [time in s, value]: constant before its first and after its last row. \
                            Times are within 0 and 1e9, strictly increasing; values within +-1e12 (m for a displacement, a \
                            factor of 1 for a load).",
            "type": "array",
            "minItems": 1,
            "items": {
                "type": "array",
                "prefixItems": [
                    { "type": "number", "minimum": 0.0, "maximum": 1e9 },
                    { "type": "number", "minimum": -1e12, "maximum": 1e12 }
                ],
                "minItems": 2,
                "maxItems": 2
            }
        })
    }
}

/// A force from outside. Loads add up; all of them but pressure keep their direction while the body moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Load {
    /// Weight.
    Gravity {
        /// Acceleration in m/s2, each component within +-1e6.
        #[schemars(inner(range(min = -1e6, max = 1e6)))]
        acceleration: [f64; 3],
        /// A factor over time, instead of 1.
        #[serde(default)]
        ramp: Option<Ramp>,
    },
    /// A force for each area at rest, on faces of the body's surface.
    Traction {
        /// The faces; expressions and boxes test a face's centroid at rest.
        faces: Selection,
        /// Force for each area at rest in Pa, each component within +-1e15.
        #[schemars(inner(range(min = -1e15, max = 1e15)))]
        value: [f64; 3],
        /// A factor over time, instead of 1.
        #[serde(default)]
        ramp: Option<Ramp>,
    },
    /// A pressure on faces of the body's surface, normal to them and for each area as they are while the body moves.
    Pressure {
        /// The faces; expressions and boxes test a face's centroid at rest.
        faces: Selection,
        /// The pressure in Pa, positive where it presses on the body, within +-1e15.
        #[schemars(range(min = -1e15, max = 1e15))]
        value: f64,
        /// A factor over time, instead of 1.
        #[serde(default)]
        ramp: Option<Ramp>,
    },
    /// Forces at nodes: exactly one of `value` and `total`.
    Force {
        /// The nodes.
        nodes: Selection,
        /// Force at every selected node in N, each component within +-1e15.
        #[serde(default)]
        #[schemars(inner(range(min = -1e15, max = 1e15)))]
        value: Option<[f64; 3]>,
        /// Force over all selected nodes together in N, in equal parts; each component within +-1e15.
        #[serde(default)]
        #[schemars(inner(range(min = -1e15, max = 1e15)))]
        total: Option<[f64; 3]>,
        /// A factor over time, instead of 1.
        #[serde(default)]
        ramp: Option<Ramp>,
    },
}

impl Load {
    /// The factor of 1 that the load has at a time in s.
    pub fn factor(&self, time: f64) -> f64 {
        match self {
            Self::Gravity { ramp, .. }
            | Self::Traction { ramp, .. }
            | Self::Pressure { ramp, .. }
            | Self::Force { ramp, .. } => ramp.as_ref().map_or(1.0, |ramp| ramp.table().at(time)),
        }
    }
}

/// The state at time 0.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// Velocity of every node in m/s, each component within +-1e6.
    #[serde(default)]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub velocity: [f64; 3],
    /// Angular velocity of the body as a whole about its centre of mass in rad/s, each component within +-1e6.
    #[serde(default)]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub angular_velocity: [f64; 3],
    /// Gradient of the displacement, row by row, the same everywhere, each component within +-1e6.
    #[serde(default)]
    #[schemars(inner(inner(range(min = -1e6, max = 1e6))))]
    pub gradient: [[f64; 3]; 3],
    /// The point in m that this gradient does not move, each coordinate within +-1e6; without it the centre of mass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub about: Option<[f64; 3]>,
}

fn one() -> f64 {
    1.0
}

fn once() -> u32 {
    1
}

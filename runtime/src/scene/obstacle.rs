//! Obstacles: what the body's surface cannot enter, and how it moves.

use super::model::{History, Motion, Ramp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Something that does not deform, and that the body's surface cannot enter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// A name for reports; unique.
    #[serde(default)]
    #[schemars(length(min = 1))]
    pub name: Option<String>,
    /// What it is, and where at time 0.
    pub shape: Shape,
    /// Coulomb's coefficient of friction, of 1: one for what sticks and slides, or one for each.
    #[serde(default)]
    pub friction: Friction,
    /// Its translation over time; none without.
    #[serde(default, rename = "move")]
    pub translation: Option<Motion>,
    /// Its turn over time; none without.
    #[serde(default)]
    pub rotate: Option<Rotate>,
}

/// The shape of an obstacle, lengths in m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A half-space, a floor or a wall.
    Plane {
        /// A point of its surface in m, each component within +-1e6.
        #[schemars(inner(range(min = -1e6, max = 1e6)))]
        point: [f64; 3],
        /// The direction out of it, of any length but 0; each component within +-1e6.
        #[schemars(inner(range(min = -1e6, max = 1e6)))]
        normal: [f64; 3],
    },
    /// A box; its edges are along the axes at time 0, unless it is turned.
    Box {
        /// Its middle in m, each component within +-1e6.
        #[schemars(inner(range(min = -1e6, max = 1e6)))]
        centre: [f64; 3],
        /// Edge lengths along x, y, z in m, each from 1e-9 to 1e6.
        #[schemars(inner(range(min = 1e-9, max = 1e6)))]
        size: [f64; 3],
        /// A rotation about its middle: a vector along the axis, as long as the angle in rad; each component within +-1e3.
        #[serde(default)]
        #[schemars(inner(range(min = -1e3, max = 1e3)))]
        rotation: [f64; 3],
    },
    /// A sphere.
    Sphere {
        /// Its middle in m, each component within +-1e6.
        #[schemars(inner(range(min = -1e6, max = 1e6)))]
        centre: [f64; 3],
        /// Its radius in m, from 1e-9 to 1e6.
        #[schemars(range(min = 1e-9, max = 1e6))]
        radius: f64,
    },
    /// What is no farther than the radius from a line segment.
    Capsule(Rod),
    /// A straight cylinder with flat ends.
    Cylinder(Rod),
    /// What a closed surface of triangles encloses; its triangles turn counterclockwise seen from outside.
    Mesh(Surface),
}

/// A surface of triangles from a file, scaled, turned, then moved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Path of an STL or OBJ file, relative to the scene file.
    #[schemars(length(min = 1))]
    pub file: PathBuf,
    /// Length of the file's unit in m (0.001 for a surface in mm), from 1e-9 to 1e9.
    #[serde(default = "one")]
    #[schemars(range(min = 1e-9, max = 1e9))]
    pub scale: f64,
    /// A rotation about the file's origin: a vector along the axis, as long as the angle in rad; each component within +-1e3.
    #[serde(default)]
    #[schemars(inner(range(min = -1e3, max = 1e3)))]
    pub rotation: [f64; 3],
    /// Where that takes the file's origin, in m; each component within +-1e6.
    #[serde(default)]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub translation: [f64; 3],
    /// Cells along its longest side of the grid of distances that a GPU reads, from 8 to 256: finer is more accurate.
    #[serde(default = "cells")]
    #[schemars(range(min = 8, max = 256))]
    pub cells: u32,
}

fn one() -> f64 {
    1.0
}

fn cells() -> u32 {
    64
}

/// A segment and a radius.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rod {
    /// One end of the axis in m, each component within +-1e6.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub from: [f64; 3],
    /// The other end in m, each component within +-1e6.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub to: [f64; 3],
    /// The radius in m, from 1e-9 to 1e6.
    #[schemars(range(min = 1e-9, max = 1e6))]
    pub radius: f64,
}

/// Coulomb's friction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, deny_unknown_fields)]
pub enum Friction {
    /// One coefficient for what sticks and what slides, of 1, from 0 to 1e6.
    Same(#[schemars(range(min = 0.0, max = 1e6))] f64),
    /// One for each.
    Each {
        /// The coefficient that it takes to set something sliding that sticks, of 1, from 0 to 1e6.
        #[serde(rename = "static")]
        #[schemars(range(min = 0.0, max = 1e6))]
        sticking: f64,
        /// The coefficient of what slides, of 1, at most the static one.
        #[serde(rename = "kinetic")]
        #[schemars(range(min = 0.0, max = 1e6))]
        sliding: f64,
    },
}

impl Default for Friction {
    fn default() -> Self {
        Self::Same(0.0)
    }
}

impl Friction {
    /// The coefficients of what sticks and of what slides.
    pub fn coefficients(&self) -> [f64; 2] {
        match *self {
            Self::Same(both) => [both; 2],
            Self::Each { sticking, sliding } => [sticking, sliding],
        }
    }
}

/// A turn about an axis that does not move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rotate {
    /// A point of the axis in m, each component within +-1e6.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub centre: [f64; 3],
    /// The axis's direction, of any length but 0; each component within +-1e6.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub axis: [f64; 3],
    /// The angle over time, by the right hand.
    pub angle: Angle,
}

/// An angle over time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Angle {
    /// A table of [time in s, angle in rad].
    Ramp(Ramp),
    /// A constant angular velocity in rad/s from time 0 on, within +-1e6.
    Velocity(#[schemars(range(min = -1e6, max = 1e6))] f64),
}

impl Angle {
    /// The angle in rad over time in s.
    pub fn table(&self) -> crate::history::History {
        match self {
            Self::Ramp(ramp) => History::Ramp(ramp.clone()).table(),
            Self::Velocity(velocity) => History::Velocity(*velocity).table(),
        }
    }
}

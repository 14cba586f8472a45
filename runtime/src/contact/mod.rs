//! Contact of a body's surface with obstacles that move as they are told.
//!
//! | file | what |
//! |---|---|
//! | `shape` | an obstacle's surface, seen from a point |
//! | `solid` | that of a surface of triangles |
//! | `grid` | the same, tabulated |
//! | `pose` | where it is over time |
//! | `rule` | what meeting it does to a node in a step |
//! | `held` | which nodes an implicit step holds on obstacles |
//! | `friction` | what friction does to them |
//!
//! All are independent of devices: a backend runs the rule over the nodes of the surface. Coordinates are relative to
//! the middle of the body at rest, so that their roundings are those of its size.

mod friction;
mod grid;
mod held;
mod pose;
mod rule;
mod shape;
mod solid;

pub use friction::Grip;
pub use grid::Grid;
pub use held::{ATTEMPTS, Attempt, Held, Holding};
pub use pose::{Pose, RigidMotion, Turn, facing};
pub use rule::{Move, NUMBERS, Passage, Response, Surface, at_end, further, meets, respond, seen_before};
pub use shape::{Approach, Convex, Nearest, Shape};
pub use solid::Solid;

use crate::body::Constraint;

/// How often a node is taken through all obstacles in a step, at most: what one does to it may bring it into another.
pub const SWEEPS: usize = 4;

/// Distances up to so many roundings of the scene's size are contact. A node that lies on a surface is not moved to and fro by
/// the roundings of its place.
const ROUNDINGS: f64 = 2.0;

/// Something that does not deform, and that the body's surface cannot enter.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// Its shape.
    pub shape: Shape,
    /// Where it is at rest.
    pub rest: Pose,
    /// How it moves.
    pub motion: RigidMotion,
    /// The coefficient of friction of what sticks to it.
    pub sticking: f64,
    /// The coefficient of friction of what slides on it.
    pub sliding: f64,
}

/// What may touch what.
#[derive(Debug, Clone)]
pub struct Contact {
    /// The nodes of the body's surface, ascending; those that cannot move left out.
    pub nodes: Vec<u32>,
    /// Where each of them is at rest.
    pub positions: Vec<[f64; 3]>,
    /// Which components of each are free.
    pub free: Vec<[bool; 3]>,
    /// What they may meet.
    pub obstacles: Vec<Obstacle>,
    /// The size of the scene: how far from the middle of the body a node or an obstacle is at time 0.
    pub size: f64,
}

impl Contact {
    /// Contact of these nodes, at these positions, with some obstacles.
    pub fn new(
        nodes: impl Iterator<Item = (u32, [f64; 3])>,
        constraints: &[Constraint],
        obstacles: Vec<Obstacle>,
    ) -> Self {
        let (mut numbers, mut positions, mut free) = (vec![], vec![], vec![]);
        for (node, position) in nodes {
            let start = constraints.partition_point(|c| c.node < node);
            let mut components = [true; 3];
            for c in constraints[start..].iter().take_while(|c| c.node == node) {
                components[usize::from(c.component)] = false;
            }
            if components != [false; 3] {
                numbers.push(node);
                positions.push(position);
                free.push(components);
            }
        }
        let length = |x: &[f64; 3]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let body = positions.iter().map(length).fold(0.0, f64::max);
        let farthest = |o: &Obstacle| match &o.shape {
            Shape::Convex(Convex::Plane) => (o.rest.rotation.inverse() * o.rest.origin.coords).z.abs(),
            shape => o.rest.origin.coords.norm() + shape.reach(),
        };
        let size = obstacles.iter().map(farthest).fold(body, f64::max);
        Self { nodes: numbers, positions, free, obstacles, size }
    }

    /// Whether no obstacle is a surface of triangles.
    pub fn is_tabulated(&self) -> bool {
        self.obstacles.iter().all(|o| o.shape.solid().is_none())
    }

    /// The same with distances on grids in place of surfaces of triangles.
    pub fn baked(&self) -> Self {
        let bake = |o: &Obstacle| Obstacle { shape: o.shape.baked(), ..o.clone() };
        Self { obstacles: self.obstacles.iter().map(bake).collect(), ..self.clone() }
    }

    /// How the obstacles move between two times.
    pub fn passages(&self, from: f64, to: f64) -> Vec<Passage<f64>> {
        let of = |o: &Obstacle| Passage::between(&o.motion.of(&o.rest, from), &o.motion.of(&o.rest, to));
        self.obstacles.iter().map(of).collect()
    }

    /// Where a node is, by its number here, when the nodes of the body have these displacements.
    pub fn place(&self, index: usize, u: &[[f64; 3]]) -> [f64; 3] {
        let (rest, u) = (self.positions[index], u[self.nodes[index] as usize]);
        std::array::from_fn(|i| rest[i] + u[i])
    }

    /// Distances that are rounding, where numbers have this unit round-off.
    pub fn tolerance(&self, epsilon: f64) -> f64 {
        ROUNDINGS * epsilon * self.size
    }
}

//! A body ready to be computed: elements, rest data, materials by law, masses, supports and loads, in scaled units.
//!
//! Everything here is in the units of [`crate::scale::Scale`] and in f64; a backend rounds it to its own precision.

use std::ops::Index;
use std::sync::Arc;

use tensormass_kernels::{ElementEntry, ElementInfo, LawEntry, RestPoint};

use crate::contact::Contact;
use crate::history::History;
use crate::mass::MassMatrix;

/// Rows of any lengths, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows<T> {
    ends: Vec<u32>,
    values: Vec<T>,
}

impl<T> Default for Rows<T> {
    fn default() -> Self {
        Self { ends: vec![], values: vec![] }
    }
}

impl<T> Rows<T> {
    /// Adds a row.
    ///
    /// # Panics
    /// There are more values than a `u32` can count: a mesh has not so many.
    pub fn push(&mut self, row: impl IntoIterator<Item = T>) {
        self.values.extend(row);
        self.ends.push(u32::try_from(self.values.len()).expect("a mesh numbers its slots in u32"));
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The rows in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[T]> {
        (0..self.len()).map(|row| &self[row])
    }

    /// All values, row after row.
    pub fn values(&self) -> &[T] {
        &self.values
    }
}

impl<T, I: IntoIterator<Item = T>> FromIterator<I> for Rows<T> {
    fn from_iter<A: IntoIterator<Item = I>>(rows: A) -> Self {
        let mut all = Self::default();
        rows.into_iter().for_each(|row| all.push(row));
        all
    }
}

impl<T> Index<usize> for Rows<T> {
    type Output = [T];

    fn index(&self, row: usize) -> &[T] {
        let start = row.checked_sub(1).map_or(0, |before| self.ends[before]) as usize;
        &self.values[start..self.ends[row] as usize]
    }
}

/// The elements of one law and kind.
#[derive(Debug, Clone)]
pub struct LawBatch {
    /// The law.
    pub law: &'static LawEntry,
    /// The kind of element.
    pub element: &'static ElementEntry,
    /// The mesh's number of each element, those near each other together (see [`crate::order`]).
    pub elements: Vec<u32>,
    /// The law's constants: one set, or one set an element.
    pub constants: Vec<f64>,
    /// Whether `constants` has a set for each element.
    pub per_element: bool,
}

/// A component of displacement that is imposed.
#[derive(Debug, Clone, Copy)]
pub struct Constraint {
    /// The node.
    pub node: u32,
    /// 0, 1, 2 for x, y, z.
    pub component: u8,
    /// Which of [`Body::motions`] it follows.
    pub motion: usize,
}

/// Nodal forces that follow one history.
#[derive(Debug, Clone)]
pub struct Load {
    /// Force on each node at history value 1.
    pub forces: Vec<[f64; 3]>,
    /// The factor over time.
    pub history: History,
}

/// A face that pressure acts on.
#[derive(Debug, Clone)]
pub struct PressedFace {
    /// The element that it is.
    pub kind: &'static ElementInfo,
    /// Its nodes; their order turns to the right around the outward normal.
    pub nodes: Vec<u32>,
    /// At each quadrature point the derivatives of the position at rest by the two reference coordinates.
    pub tangents: Vec<[[f64; 3]; 2]>,
}

impl PressedFace {
    /// The forces of a pressure on the nodes, displaced by u: -p times the integrals of their functions over the face as it is
    /// now, times its normal.
    pub fn forces(&self, pressure: f64, u: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut forces = vec![[0.0; 3]; u.len()];
        for (point, rest) in self.kind.points.iter().zip(&self.tangents) {
            let tangent = |k: usize| -> [f64; 3] {
                let moved = |i: usize| -> f64 {
                    // Differences first: the motion of the whole has no digits to spare.
                    let each = point.gradients.iter().zip(u).skip(1);
                    each.map(|(slopes, x)| slopes[k] * (x[i] - u[0][i])).sum()
                };
                std::array::from_fn(|i| rest[k][i] + moved(i))
            };
            let (a, b) = (tangent(0), tangent(1));
            let area = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
            for (force, function) in forces.iter_mut().zip(point.functions) {
                (0..3).for_each(|i| force[i] -= pressure * point.weight * function * area[i]);
            }
        }
        forces
    }
}

/// Faces under one pressure, which stays normal to them while they move.
#[derive(Debug, Clone)]
pub struct Pressure {
    /// The faces.
    pub faces: Vec<PressedFace>,
    /// The pressure over time, positive where it presses on the body.
    pub history: History,
}

/// A body, in scaled units.
#[derive(Debug, Clone)]
pub struct Body {
    /// Nodes of each element.
    pub elements: Rows<u32>,
    /// The quadrature points of each element.
    pub rest: Rows<RestPoint<f64>>,
    /// Elements by law and kind; every element is in exactly one batch.
    pub batches: Vec<LawBatch>,
    /// Lumped mass of each node.
    pub masses: Vec<f64>,
    /// The consistent mass, where inertia is not lumped.
    pub mass_matrix: Option<MassMatrix>,
    /// Mass of each element.
    pub element_masses: Vec<f64>,
    /// Imposed components, ascending by node and component, each once.
    pub constraints: Vec<Constraint>,
    /// Histories of imposed displacement.
    pub motions: Vec<History>,
    /// Loads other than the elements' own forces.
    pub loads: Vec<Load>,
    /// Pressures on its surface.
    pub pressures: Vec<Pressure>,
    /// What its surface may touch.
    pub contact: Option<Arc<Contact>>,
    /// Whether it has inertia and velocities: statics have neither.
    pub moves: bool,
    /// Mass-proportional damping coefficient alpha.
    pub mass_damping: f64,
    /// Stiffness-proportional damping coefficient beta.
    pub stiffness_damping: f64,
    /// The length of the bounding box's diagonal at rest.
    pub diameter: f64,
    /// Volume at rest.
    pub volume: f64,
}

impl Body {
    /// The displacement of each motion at a time.
    pub fn motions_at(&self, time: f64) -> Vec<f64> {
        self.motions.iter().map(|m| m.at(time)).collect()
    }

    /// Whether every law is linear, in the strain and in its rate.
    pub fn is_linear(&self) -> bool {
        self.is_elastically_linear() && self.batches.iter().all(|b| b.law.damping.is_none_or(|d| d.linear))
    }

    /// Whether every law's stress without damping is linear.
    pub fn is_elastically_linear(&self) -> bool {
        self.batches.iter().all(|b| b.law.info.structure.linear)
    }

    /// Whether it moves and a law has a dissipation.
    pub fn is_viscous(&self) -> bool {
        self.moves && self.batches.iter().any(|b| b.law.damping.is_some())
    }
}

/// The state of the nodes at time 0, in scaled units; imposed components have their own.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Start {
    /// Displacements; none where they are zero.
    pub displacement: Option<Vec<[f64; 3]>>,
    /// Velocities; none where they are the same.
    pub velocities: Option<Vec<[f64; 3]>>,
    /// The velocity of every node, where they are the same.
    pub velocity: [f64; 3],
}

impl Start {
    /// The state of nodes that have this velocity and are at rest otherwise.
    pub fn moving(velocity: [f64; 3]) -> Self {
        Self { velocity, ..Self::default() }
    }
}

//! A body ready to be computed: elements, rest data, materials by law, masses, supports and loads, in scaled units.
//!
//! Everything here is in the units of [`crate::scale::Scale`] and in f64; a backend rounds it to its own precision.

use tensormass_kernels::LawEntry;
use tensormass_kernels::batch::RestElement;

use crate::history::History;

/// The elements of one law.
#[derive(Debug, Clone)]
pub struct LawBatch {
    /// The law.
    pub law: &'static LawEntry,
    /// The mesh's number of each element, ascending.
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

/// A body, in scaled units.
#[derive(Debug, Clone)]
pub struct Body {
    /// Nodes of each element.
    pub elements: Vec<[u32; 4]>,
    /// Rest data of each element.
    pub rest: Vec<RestElement<f64>>,
    /// Elements by law; every element is in exactly one batch.
    pub batches: Vec<LawBatch>,
    /// Lumped mass of each node.
    pub masses: Vec<f64>,
    /// Mass of each element.
    pub element_masses: Vec<f64>,
    /// Imposed components, ascending by node and component, each once.
    pub constraints: Vec<Constraint>,
    /// Histories of imposed displacement.
    pub motions: Vec<History>,
    /// Loads other than the elements' own forces.
    pub loads: Vec<Load>,
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

    /// Whether a law has a dissipation.
    pub fn is_viscous(&self) -> bool {
        self.batches.iter().any(|b| b.law.damping.is_some())
    }
}

/// Lumped masses: an element gives a quarter of its mass to each of its nodes.
pub fn lump(nodes: usize, elements: &[[u32; 4]], element_masses: &[f64]) -> Vec<f64> {
    let mut masses = vec![0.0; nodes];
    for (nodes, m) in elements.iter().zip(element_masses) {
        for &n in nodes {
            masses[n as usize] += m / 4.0;
        }
    }
    masses
}

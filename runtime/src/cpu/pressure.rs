//! Pressure on the CPU: forces of faces side by side, added to nodes in the order of faces.

use rayon::prelude::*;

use super::Precision;
use super::vectors::CpuVector;
use crate::body::PressedFace;

/// Faces under a pressure on the CPU.
#[derive(Debug)]
pub struct CpuPressure(Vec<PressedFace>);

impl CpuPressure {
    /// Faces whose nodes have these places.
    pub(super) fn new(faces: &[PressedFace], places: &[u32]) -> Self {
        let placed = |face: &PressedFace| PressedFace {
            nodes: face.nodes.iter().map(|n| places[*n as usize]).collect(),
            ..face.clone()
        };
        Self(faces.iter().map(placed).collect())
    }

    /// f += the forces of a pressure at displacement u.
    pub(super) fn add<R: Precision>(&self, pressure: f64, u: &CpuVector<R>, f: &mut CpuVector<R>) {
        let forces = |face: &PressedFace| {
            let u: Vec<[f64; 3]> = face.nodes.iter().map(|n| u.0[*n as usize].map(R::to_f64)).collect();
            face.forces(pressure, &u)
        };
        let all: Vec<Vec<[f64; 3]>> = self.0.par_iter().map(forces).collect();
        for (face, forces) in self.0.iter().zip(all) {
            for (node, force) in face.nodes.iter().zip(forces) {
                let f = &mut f.0[*node as usize];
                (0..3).for_each(|i| f[i] = f[i] + R::from_f64(force[i]));
            }
        }
    }
}

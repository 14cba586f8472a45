//! Pressure on the CPU: forces of faces side by side, added to nodes in the order of faces.

use rayon::prelude::*;

use super::Precision;
use super::vectors::CpuVector;
use crate::body::PressedFace;
use crate::inventory::names::PRESSED;
use crate::inventory::{Lease, Ledger};

/// Faces under a pressure on the CPU.
#[derive(Debug)]
pub struct CpuPressure {
    faces: Vec<PressedFace>,
    _lease: Lease,
}

/// Bytes of a face under pressure.
pub fn pressed_bytes(face: &PressedFace) -> usize {
    size_of_val(face) + size_of_val(&*face.nodes) + size_of_val(&*face.tangents)
}

impl CpuPressure {
    /// Faces whose nodes have these places.
    pub(super) fn new(faces: &[PressedFace], places: &[u32], ledger: &Ledger) -> Self {
        let placed = |face: &PressedFace| PressedFace {
            nodes: face.nodes.iter().map(|n| places[*n as usize]).collect(),
            ..face.clone()
        };
        let lease = ledger.hold(PRESSED, faces.iter().map(pressed_bytes).sum());
        Self { faces: faces.iter().map(placed).collect(), _lease: lease }
    }

    /// f += the forces of a pressure at displacement u.
    pub(super) fn add<R: Precision>(&self, pressure: f64, u: &CpuVector<R>, f: &mut CpuVector<R>) {
        let forces = |face: &PressedFace| {
            let u: Vec<[f64; 3]> = face.nodes.iter().map(|n| u.0[*n as usize].map(R::to_f64)).collect();
            face.forces(pressure, &u)
        };
        let all: Vec<Vec<[f64; 3]>> = self.faces.par_iter().map(forces).collect();
        for (face, forces) in self.faces.iter().zip(all) {
            for (node, force) in face.nodes.iter().zip(forces) {
                let f = &mut f.0[*node as usize];
                (0..3).for_each(|i| f[i] = f[i] + R::from_f64(force[i]));
            }
        }
    }
}

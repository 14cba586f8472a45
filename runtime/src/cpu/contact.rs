//! Contact on the CPU: the rule over the nodes of the surface, in f64 whatever the precision of vectors.

use rayon::prelude::*;

use super::Precision;
use super::vectors::{BLOCK, CpuVector};
use crate::backend::Meeting;
use crate::contact::{Approach, Contact, Move, Obstacle, Passage, SWEEPS, Surface, meets, respond};
use crate::cpu::CpuBackend;
use crate::inventory::names::{SURFACE, TRIANGLES};
use crate::inventory::{Lease, Ledger};

/// A node that may touch something.
#[derive(Debug, Clone, Copy)]
struct Touching {
    place: usize,
    /// At rest.
    position: [f64; 3],
    free: [bool; 3],
}

/// Bytes of a node that may touch something.
pub const TOUCHING_BYTES: usize = size_of::<Touching>();

/// Contact of a body on the CPU.
#[derive(Debug)]
pub struct CpuContact {
    /// By places, ascending.
    nodes: Vec<Touching>,
    obstacles: Vec<Obstacle>,
    /// What one convex obstacle does brings nobody into it.
    is_one_sweep_enough: bool,
    tolerance: f64,
    _leases: [Lease; 2],
}

impl CpuContact {
    /// Contact where nodes have these places, and numbers this unit round-off.
    pub(super) fn new(contact: &Contact, places: &[u32], epsilon: f64, ledger: &Ledger) -> Self {
        let each = contact.nodes.iter().zip(&contact.positions).zip(&contact.free);
        let mut nodes: Vec<Touching> = each
            .map(|((node, position), free)| Touching {
                place: places[*node as usize] as usize,
                position: *position,
                free: *free,
            })
            .collect();
        nodes.sort_unstable_by_key(|n| n.place);
        let obstacles = contact.obstacles.clone();
        let triangles = obstacles.iter().map(|o| o.shape.bytes()).sum();
        Self {
            _leases: [ledger.hold(SURFACE, size_of_val(&*nodes)), ledger.hold(TRIANGLES, triangles)],
            nodes,
            is_one_sweep_enough: matches!(&obstacles[..], [one] if one.shape.approach() == Approach::Tangents),
            obstacles,
            tolerance: contact.tolerance(epsilon),
        }
    }

    /// The nodes of a block.
    fn of(&self, block: usize) -> &[Touching] {
        let start = self.nodes.partition_point(|n| n.place < block * BLOCK);
        let end = self.nodes.partition_point(|n| n.place < (block + 1) * BLOCK);
        &self.nodes[start..end]
    }

    /// What contact changes of the displacement of a node that moves: in all, and as a velocity.
    fn response(&self, passages: &[Passage<f64>], free: [bool; 3], node: Move<f64>) -> Option<[[f64; 3]; 2]> {
        let (mut by, mut change) = (node.by, [0.0; 3]);
        for _ in 0..SWEEPS {
            let mut met = false;
            for (obstacle, passage) in self.obstacles.iter().zip(passages) {
                let seen = passage.seen(Move { from: node.from, by });
                let nearest = |x| obstacle.shape.nearest(x);
                let travel = seen.by.iter().map(|x| x * x).sum::<f64>().sqrt();
                if nearest(seen.from).distance > travel + self.tolerance {
                    continue;
                }
                let Obstacle { sticking, sliding, .. } = *obstacle;
                let surface = Surface { sticking, sliding, tolerance: self.tolerance };
                let response = respond(meets(nearest, obstacle.shape.approach(), seen, self.tolerance), seen, surface);
                let [kick, push] = [response.change, response.push].map(|x| passage.outside(x));
                for i in (0..3).filter(|i| free[*i]) {
                    by[i] += kick[i] + push[i];
                    change[i] += kick[i];
                    met |= kick[i] + push[i] != 0.0;
                }
            }
            if !met || self.is_one_sweep_enough {
                break;
            }
        }
        (by != node.by).then(|| [std::array::from_fn(|i| by[i] - node.by[i]), change])
    }

    /// Moves and slows down the nodes that meet something.
    pub(super) fn touch<R: Precision>(&self, meeting: Meeting<CpuBackend<R>>) {
        let Meeting { contact: _, passages, h, masses, v, u, impulse } = meeting;
        let mut none = vec![];
        let impulse = impulse.map_or(&mut none, |i| &mut i.0);
        // Blocks of nothing where no impulses are wanted.
        let mut impulses: Vec<&mut [[R; 3]]> = impulse.chunks_mut(BLOCK).collect();
        impulses.resize_with(u.0.len().div_ceil(BLOCK), || &mut []);
        let vectors = v.0.par_chunks_mut(BLOCK).zip(u.0.par_chunks_mut(BLOCK)).zip(masses.0.par_chunks(BLOCK));
        vectors.zip(impulses).enumerate().for_each(|(block, (((v, u), masses), impulse))| {
            for node in self.of(block) {
                let at = node.place - block * BLOCK;
                let by = v[at].map(|v| h * v.to_f64());
                let from = std::array::from_fn(|i| node.position[i] + (u[at][i].to_f64() - by[i]));
                let Some([shift, change]) = self.response(passages, node.free, Move { from, by }) else { continue };
                for i in 0..3 {
                    u[at][i] = u[at][i] + R::from_f64(shift[i]);
                    v[at][i] = v[at][i] + R::from_f64(change[i] / h);
                    if let Some(impulse) = impulse.get_mut(at) {
                        impulse[i] = impulse[i] + masses[at][i] * R::from_f64(change[i] / h);
                    }
                }
            }
        });
    }

    /// The least distance of a node from an obstacle.
    pub(super) fn gap<R: Precision>(&self, passages: &[Passage<f64>], u: &CpuVector<R>) -> f64 {
        let of = |node: &Touching| {
            let point = std::array::from_fn(|i| node.position[i] + u.0[node.place][i].to_f64());
            let seen = self.obstacles.iter().zip(passages);
            seen.map(|(o, passage)| o.shape.nearest(passage.local(point)).distance).fold(f64::INFINITY, f64::min)
        };
        self.nodes.par_iter().map(of).reduce(|| f64::INFINITY, f64::min)
    }
}

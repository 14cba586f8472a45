//! The structured torus: a bar of cells bent to a ring, whose square section is rounded to a disc.

use std::collections::HashMap;

use tensormass_kernels::ElementEntry;

use super::beam::beam_of;
use super::error::MeshError;
use super::topology::{Block, Groups, Mesh, NodeId};

/// A torus in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// The radius of the circle in the middle of its tube, m.
    pub major: f64,
    /// The radius of its tube, m, below the other.
    pub minor: f64,
    /// Its middle, m.
    pub centre: [f64; 3],
    /// The axis of coordinates around which it runs: 0, 1 or 2.
    pub axis: usize,
}

/// A torus of cells as those of [`beam_of`]: `across` and `across` in the section of the tube, and `around` along it, the
/// first section at the end of the next axis of coordinates after `ring.axis`, counted round.
///
/// A point (a, b) of the section, from -1 to 1, is at (a sqrt(1 - b^2/2), b sqrt(1 - a^2/2)) of the disc.
///
/// # Errors
/// [`MeshError`] if cells cannot be made of the element or it is plane, there are fewer than three around or none across, a
/// radius is not positive and finite or the minor one not below the major one, the middle is not finite, or the cells are too
/// many to number.
pub fn torus_of(element: &'static ElementEntry, ring: Ring, [across, around]: [usize; 2]) -> Result<Mesh, MeshError> {
    let Ring { major, minor, centre, axis } = ring;
    if !(minor > 0.0 && minor < major && major.is_finite() && centre.iter().all(|x| x.is_finite())) {
        return Err(MeshError::TorusRadii { major, minor });
    }
    if around < 3 {
        return Err(MeshError::TorusCells { around });
    }
    if element.info.dimension != 3 {
        return Err(MeshError::TorusElement { element: element.info.name });
    }
    let bar = beam_of(element, [1.0; 3], [around, across, across], [0.0; 3])?;
    // The last section is the first one.
    let section = |x: &[f64; 3]| [x[1].to_bits(), x[2].to_bits()];
    let first: HashMap<[u64; 2], u32> =
        (0..).zip(bar.nodes()).filter(|(_, x)| x[0] == 0.0).map(|(n, x)| (section(x), n)).collect();
    let (mut numbers, mut nodes) = (vec![], vec![]);
    for x in bar.nodes() {
        match first.get(&section(x)).filter(|_| x[0] == 1.0) {
            // Nodes of the first section come first.
            Some(n) => numbers.push(numbers[*n as usize]),
            None => {
                // `as u32` is exact: the bar has more nodes.
                numbers.push(nodes.len() as u32);
                nodes.push(bent(x, major, minor, centre, axis));
            }
        }
    }
    let renumbered = |node: &NodeId| NodeId(numbers[node.index()]);
    let blocks =
        bar.blocks().iter().map(|b| Block { element: b.element, nodes: b.nodes.iter().map(renumbered).collect() });
    Mesh::new(nodes, blocks.collect(), Groups::default())
}

/// Where a point of the unit bar comes to be.
fn bent([along, y, z]: &[f64; 3], major: f64, minor: f64, centre: [f64; 3], axis: usize) -> [f64; 3] {
    let (a, b) = (2.0 * y - 1.0, 2.0 * z - 1.0);
    let (aside, outwards) = (minor * a * (1.0 - 0.5 * b * b).sqrt(), minor * b * (1.0 - 0.5 * a * a).sqrt());
    let (sine, cosine) = (std::f64::consts::TAU * along).sin_cos();
    let mut x = centre;
    x[axis] += aside;
    x[(axis + 1) % 3] += (major + outwards) * cosine;
    x[(axis + 2) % 3] += (major + outwards) * sine;
    x
}

//! The structured beam: a box of hexahedra, each split into six Kuhn tetrahedra.

use super::error::MeshError;
use super::gradients::six_volumes;
use super::tet_mesh::{Groups, NodeId, TetMesh, face_of};

/// The six Kuhn tetrahedra of a hexahedron, by corner (bit 0 is x, bit 1 is y, bit 2 is z). All share the diagonal from
/// corner 0 to corner 7, and every face of the hexahedron is cut along the diagonal from its lowest to its highest
/// corner, so that neighbours agree. Those with a negative volume get their second and third node swapped.
const KUHN: [[usize; 4]; 6] = [[0, 1, 3, 7], [0, 1, 7, 5], [0, 5, 7, 4], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 7, 6]];

const AXES: [char; 3] = ['x', 'y', 'z'];

/// A box of `size` (m) with its lowest corner at `origin` (m), in `cells` hexahedra of six tetrahedra each.
///
/// Node (ix, iy, iz) has the number `(ix * (ny + 1) + iy) * (nz + 1) + iz`; elements follow their cells in the same
/// order. Groups of nodes and of faces: `xmin`, `xmax`, `ymin`, `ymax`, `zmin`, `zmax`.
///
/// # Errors
/// [`MeshError`] if an axis has no cells, a size is not positive and finite, the origin is not finite, the cells are
/// too many to number, or so thin (1e14 times longer than wide) that they are degenerate.
pub fn beam(size: [f64; 3], cells: [usize; 3], origin: [f64; 3]) -> Result<TetMesh, MeshError> {
    for (axis, name) in AXES.into_iter().enumerate() {
        if cells[axis] == 0 {
            return Err(MeshError::BeamCells { axis: name });
        }
        if !(size[axis] > 0.0 && size[axis].is_finite()) {
            return Err(MeshError::BeamSize { axis: name, size: size[axis] });
        }
        if !origin[axis].is_finite() {
            return Err(MeshError::BeamOrigin { axis: name, value: origin[axis] });
        }
    }
    let (node_count, element_count) =
        counts(cells).ok_or(MeshError::BeamTooLarge { cells, limit: TetMesh::MAX_ELEMENTS })?;
    let [nx, ny, nz] = cells;

    let mut nodes = Vec::with_capacity(node_count);
    let at = |axis: usize, i: usize| origin[axis] + size[axis] * i as f64 / cells[axis] as f64;
    for ix in 0..=nx {
        for iy in 0..=ny {
            nodes.extend((0..=nz).map(|iz| [at(0, ix), at(1, iy), at(2, iz)]));
        }
    }

    let mut tets = Vec::with_capacity(element_count);
    // `as u32` is exact: `counts` has bounded the number of nodes.
    let number = |ix: usize, iy: usize, iz: usize| NodeId(((ix * (ny + 1) + iy) * (nz + 1) + iz) as u32);
    for ix in 0..nx {
        for iy in 0..ny {
            for iz in 0..nz {
                let corner = |c: usize| number(ix + (c & 1), iy + (c >> 1 & 1), iz + (c >> 2 & 1));
                for kuhn in KUHN {
                    let mut tet = kuhn.map(corner);
                    if six_volumes(&tet.map(|node| nodes[node.index()])) < 0.0 {
                        tet.swap(1, 2);
                    }
                    tets.push(tet);
                }
            }
        }
    }
    let groups = sides(cells, node_count, &tets);
    TetMesh::new(nodes, tets, groups)
}

/// The numbers of nodes and elements, if both can be numbered.
fn counts([nx, ny, nz]: [usize; 3]) -> Option<(usize, usize)> {
    let elements = nx.checked_mul(ny)?.checked_mul(nz)?.checked_mul(KUHN.len())?;
    // The elements bound each factor, so these sums cannot overflow; their product can.
    let nodes = nx.checked_add(1)?.checked_mul(ny.checked_add(1)?)?.checked_mul(nz.checked_add(1)?)?;
    (elements <= TetMesh::MAX_ELEMENTS && nodes <= u32::MAX as usize).then_some((nodes, elements))
}

/// The six sides, found by lattice coordinates: exact, whatever the size and the origin.
fn sides(cells: [usize; 3], node_count: usize, tets: &[[NodeId; 4]]) -> Groups {
    let [_, ny, nz] = cells;
    let lattice = |node: NodeId| {
        let n = node.index();
        [n / ((ny + 1) * (nz + 1)), n / (nz + 1) % (ny + 1), n % (nz + 1)]
    };
    let mut groups = Groups::default();
    for (axis, name) in AXES.into_iter().enumerate() {
        for (end, place) in [("min", 0), ("max", cells[axis])] {
            let on_side = |node: &NodeId| lattice(*node)[axis] == place;
            let nodes = (0..node_count as u32).map(NodeId).filter(on_side).collect();
            let faces = tets.iter().flat_map(|tet| (0..4).map(|opposite| face_of(tet, opposite)));
            groups.nodes.insert(format!("{name}{end}"), nodes);
            groups.faces.insert(format!("{name}{end}"), faces.filter(|face| face.iter().all(on_side)).collect());
        }
    }
    groups
}

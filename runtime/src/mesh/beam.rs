//! The structured beam: a box of cells, each split into elements of one kind.

use super::error::MeshError;
use super::topology::{Block, Groups, Mesh, NodeId};
use std::collections::BTreeMap;
use tensormass_kernels::{ElementEntry, ElementInfo};

const AXES: [char; 3] = ['x', 'y', 'z'];

/// The corners of a unit cell, by number: bit 0 is x, bit 1 is y, bit 2 is z.
type Corner = usize;

/// The six Kuhn tetrahedra of a cell. All share the diagonal from corner 0 to corner 7, and every face of the cell is cut
/// along the diagonal from its lowest to its highest corner, so that neighbours agree.
const KUHN: [[Corner; 4]; 6] = [[0, 1, 3, 7], [0, 1, 7, 5], [0, 5, 7, 4], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 7, 6]];

/// The cell's corners that are the images of the reference origin and of the unit points along each axis, for each of the
/// elements that make the cell; what runs from -1 to 1 is the whole of the cell along that axis.
fn parts(shape: &str) -> Option<Vec<[Corner; 4]>> {
    Some(match shape {
        "tetrahedron" => KUHN.to_vec(),
        "hexahedron" => vec![[0, 1, 2, 4]],
        // Cut along the diagonal of its lower side, as tetrahedra are.
        "prism" => vec![[0, 1, 3, 4], [0, 3, 2, 4]],
        "quadrangle" => vec![[0, 1, 2, 4]],
        "triangle" => vec![[0, 1, 3, 4], [0, 3, 2, 4]],
        _ => return None,
    })
}

/// A point of a part in cell coordinates from 0 to 1.
fn in_cell(info: &ElementInfo, part: &[Corner; 4], reference: &[f64; 3]) -> [f64; 3] {
    let corner = |c: Corner| [0, 1, 2].map(|axis| (c >> axis & 1) as f64);
    let from_zero = |axis: usize| match info.shape {
        "tetrahedron" | "triangle" => true,
        "prism" => axis < 2,
        _ => false,
    };
    let origin = corner(part[0]);
    let mut x = origin;
    for (axis, unit) in part[1..].iter().enumerate().take(info.dimension) {
        let t = if from_zero(axis) { reference[axis] } else { 0.5 * (1.0 + reference[axis]) };
        for (i, (x, end)) in x.iter_mut().zip(corner(*unit)).enumerate() {
            *x += t * (end - origin[i]);
        }
    }
    x
}

/// A box of `size` (m) with its lowest corner at `origin` (m), in `cells` cells of six linear tetrahedra each.
///
/// Node (ix, iy, iz) has the number `(ix * (ny + 1) + iy) * (nz + 1) + iz`; elements follow their cells in the same
/// order. Groups of nodes and of faces: `xmin`, `xmax`, `ymin`, `ymax`, `zmin`, `zmax`.
///
/// # Errors
/// As [`beam_of`].
pub fn beam(size: [f64; 3], cells: [usize; 3], origin: [f64; 3]) -> Result<Mesh, MeshError> {
    beam_of(tensormass_kernels::linear_tetrahedron(), size, cells, origin)
}

/// A box of `size` (m) with its lowest corner at `origin` (m), in `cells` cells of elements of one kind: six tetrahedra,
/// one hexahedron or two prisms each. Of plane elements, two triangles or one quadrangle each, a rectangle at z = 0, whose
/// thickness is 1 m in one cell.
///
/// Nodes are numbered by their place, x before y before z; elements follow their cells in the same order. Groups as
/// [`beam`] has them.
///
/// # Errors
/// [`MeshError`] if cells cannot be made of the element, a plane body is not one metre thick, an axis has no cells, a size is not positive and finite, the
/// origin is not finite, the cells are too many to number, or so thin (1e14 times longer than wide) that they are
/// degenerate.
pub fn beam_of(
    element: &'static ElementEntry,
    size: [f64; 3],
    cells: [usize; 3],
    origin: [f64; 3],
) -> Result<Mesh, MeshError> {
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
    let info = element.info;
    let cell = Cell::of(info).ok_or(MeshError::BeamElement { element: info.name })?;
    let lattice = cell.lattice(cells).ok_or(MeshError::BeamTooLarge { cells, limit: Mesh::MAX_SLOTS / info.nodes })?;
    if info.dimension == 2 && (size[2], cells[2]) != (1.0, 1) {
        return Err(MeshError::BeamThickness { size: size[2], cells: cells[2] });
    }
    let [nx, ny, nz] = cells;

    // Which places of the lattice have a node, and then its number.
    let mut numbers = vec![u32::MAX; lattice.iter().product()];
    let place = |x: [usize; 3]| (x[0] * lattice[1] + x[1]) * lattice[2] + x[2];
    let each_cell = || (0..nx).flat_map(move |ix| (0..ny).flat_map(move |iy| (0..nz).map(move |iz| [ix, iy, iz])));
    let at =
        |cell_at: [usize; 3], node: &[usize; 3]| std::array::from_fn(|axis| cell_at[axis] * cell.refined + node[axis]);
    for cell_at in each_cell() {
        for node in cell.parts.iter().flatten() {
            numbers[place(at(cell_at, node))] = 0;
        }
    }
    let mut places: Vec<[usize; 3]> = vec![];
    for x in (0..lattice[0]).flat_map(|x| (0..lattice[1]).map(move |y| [x, y])) {
        for z in 0..lattice[2] {
            let number = &mut numbers[place([x[0], x[1], z])];
            if *number == 0 {
                // `as u32` is exact: `lattice` has bounded the number of places.
                *number = places.len() as u32;
                places.push([x[0], x[1], z]);
            }
        }
    }
    let coordinate = |axis: usize, i: usize| match lattice[axis] {
        1 => origin[axis],
        places => origin[axis] + size[axis] * i as f64 / (places - 1) as f64,
    };
    let nodes: Vec<[f64; 3]> = places.iter().map(|x| std::array::from_fn(|axis| coordinate(axis, x[axis]))).collect();
    let mut block = Block { element, nodes: vec![] };
    for cell_at in each_cell() {
        let number = |node: &[usize; 3]| NodeId(numbers[place(at(cell_at, node))]);
        block.nodes.extend(cell.parts.iter().flatten().map(number));
    }
    let groups = sides(&block, &places, lattice);
    Mesh::new(nodes, vec![block], groups)
}

/// How a cell is made of elements.
struct Cell {
    /// Places of the lattice along each side of a cell.
    refined: usize,
    /// The lattice places of the nodes of each element.
    parts: Vec<Vec<[usize; 3]>>,
    /// 3, or 2 of a rectangle.
    dimension: usize,
}

/// The finest lattice on which the nodes of an element may lie.
const FINEST: usize = 12;

impl Cell {
    fn of(info: &ElementInfo) -> Option<Self> {
        let parts: Vec<Vec<[f64; 3]>> = parts(info.shape)?
            .iter()
            .map(|part| info.reference.iter().map(|x| in_cell(info, part, x)).collect())
            .collect();
        let refined = (1..=FINEST).find(|m| {
            let on_lattice = |x: &f64| (x * *m as f64 - (x * *m as f64).round()).abs() < 1e-9;
            parts.iter().flatten().flatten().all(on_lattice)
        })?;
        let place = |x: &[f64; 3]| x.map(|x| (x * refined as f64).round() as usize);
        Some(Self {
            refined,
            parts: parts.iter().map(|part| part.iter().map(place).collect()).collect(),
            dimension: info.dimension,
        })
    }

    /// The places along each axis, if nodes and slots can be numbered.
    fn lattice(&self, cells: [usize; 3]) -> Option<[usize; 3]> {
        let slots_of_cell = self.parts.iter().map(Vec::len).sum::<usize>();
        let slots = cells.iter().try_fold(slots_of_cell, |product, n| product.checked_mul(*n))?;
        let mut lattice = [1; 3];
        for (places, n) in lattice.iter_mut().zip(cells).take(self.dimension) {
            *places = n.checked_mul(self.refined)?.checked_add(1)?;
        }
        let all = lattice.iter().try_fold(1_usize, |product, n| product.checked_mul(*n))?;
        (slots <= Mesh::MAX_SLOTS && all < u32::MAX as usize).then_some(lattice)
    }
}

/// The six sides, or the four of a rectangle, found by lattice coordinates: exact, whatever the size and the origin.
fn sides(block: &Block, places: &[[usize; 3]], lattice: [usize; 3]) -> Groups {
    let mut groups = Groups::default();
    let mut named: BTreeMap<(usize, usize), String> = BTreeMap::new();
    for (axis, name) in AXES.into_iter().enumerate().take(block.info().dimension) {
        for (end, place) in [("min", 0), ("max", lattice[axis] - 1)] {
            let nodes = (0..places.len()).filter(|n| places[*n][axis] == place).map(|n| NodeId(n as u32)).collect();
            groups.nodes.insert(format!("{name}{end}"), nodes);
            groups.faces.insert(format!("{name}{end}"), vec![]);
            named.insert((axis, place), format!("{name}{end}"));
        }
    }
    for nodes in block.elements() {
        for face in block.info().faces {
            let face: Vec<NodeId> = face.nodes.iter().map(|j| nodes[*j]).collect();
            for ((axis, place), name) in &named {
                if face.iter().all(|node| places[node.index()][*axis] == *place) {
                    groups.faces.get_mut(name).expect("it was named").push(face.clone());
                }
            }
        }
    }
    groups
}

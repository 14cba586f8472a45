//! Masses: lumped at nodes, or the consistent matrix of the interpolation functions.
//!
//! M_ij = integral of rho Lambda_i Lambda_j, one number for the three components of two nodes. It does not change with the
//! displacement, so it is assembled once, in f64, and multiplied row by row.

use rayon::prelude::*;
use tensormass_kernels::{ElementEntry, ElementInfo};

use crate::backend::Backend;
use crate::body::Body;
use crate::mesh::{Incidence, Mesh, NodeId, point_volumes};

/// Elements whose matrices are computed at once.
const CHUNK: usize = 1024;

/// Lumped masses: an element of mass m gives each of its nodes the part of it that its kind declares.
pub fn lump<'a>(nodes: usize, elements: impl Iterator<Item = (&'a ElementEntry, &'a [u32], f64)>) -> Vec<f64> {
    let mut masses = vec![0.0; nodes];
    for (kind, nodes, mass) in elements {
        for (n, part) in nodes.iter().zip(kind.info.lumping) {
            masses[*n as usize] += mass * part;
        }
    }
    masses
}

/// A symmetric matrix over the nodes, in compressed rows.
#[derive(Debug, Clone, PartialEq)]
pub struct MassMatrix {
    /// Where each row begins, and one end.
    pub offsets: Vec<u32>,
    /// The node of each entry, ascending in a row.
    pub columns: Vec<u32>,
    /// The entries.
    pub values: Vec<f64>,
}

impl MassMatrix {
    /// The matrix with the row and the column of each node at its place; the entries of a row keep their order.
    pub fn placed(&self, places: &[u32]) -> Self {
        let mut node_at = vec![0; places.len()];
        places.iter().enumerate().for_each(|(node, place)| node_at[*place as usize] = node);
        let mut placed = Self { offsets: vec![0], columns: vec![], values: vec![] };
        for node in node_at {
            let row = self.row(node);
            placed.columns.extend(self.columns[row.clone()].iter().map(|n| places[*n as usize]));
            placed.values.extend_from_slice(&self.values[row]);
            // `as u32` is exact: there are as many entries as in the matrix.
            placed.offsets.push(placed.columns.len() as u32);
        }
        placed
    }

    /// The consistent mass of a mesh from the density of each element, lengths divided by `length`; none if it has more
    /// entries than a `u32` counts.
    pub fn assemble(mesh: &Mesh, densities: &[f64], length: f64) -> Option<Self> {
        let mut matrix = Self::pattern(mesh)?;
        let mut first = 0;
        for block in mesh.blocks() {
            let table = Table::new(block.info());
            let n = block.info().nodes;
            for chunk in block.nodes.chunks(CHUNK * n) {
                let elements: Vec<(&[NodeId], f64)> =
                    chunk.chunks_exact(n).zip(&densities[first..]).map(|(nodes, d)| (nodes, *d)).collect();
                let density = |d: f64| d / length.powi(3);
                let local: Vec<Vec<f64>> = elements
                    .par_iter()
                    .map(|(nodes, d)| table.matrix(block.info(), &mesh.positions(nodes), density(*d)))
                    .collect();
                // In the mesh's order, whatever the number of threads.
                for ((nodes, _), local) in elements.iter().zip(&local) {
                    matrix.add(nodes, local);
                }
                first += elements.len();
            }
        }
        Some(matrix)
    }

    /// Zeros where two nodes share an element.
    fn pattern(mesh: &Mesh) -> Option<Self> {
        let elements: Vec<&[NodeId]> = mesh.elements().map(|e| mesh.element_nodes(e)).collect();
        let slots = elements.iter().flat_map(|nodes| nodes.iter().map(|n| n.index()));
        let incidence = Incidence::of_slots(mesh.nodes().len(), slots);
        let element_of: Vec<u32> =
            elements.iter().enumerate().flat_map(|(e, nodes)| nodes.iter().map(move |_| e as u32)).collect();
        let row = |node: u32| {
            let around = incidence.of(NodeId(node)).iter().map(|slot| elements[element_of[*slot as usize] as usize]);
            let mut columns: Vec<u32> = around.flatten().map(|n| n.0).collect();
            columns.sort_unstable();
            columns.dedup();
            columns
        };
        let rows: Vec<Vec<u32>> = (0..mesh.nodes().len() as u32).into_par_iter().map(row).collect();
        let mut offsets = vec![0];
        for row in &rows {
            offsets.push(u32::try_from(offsets[offsets.len() - 1] as usize + row.len()).ok()?);
        }
        let columns = rows.concat();
        Some(Self { offsets, values: vec![0.0; columns.len()], columns })
    }

    fn add(&mut self, nodes: &[NodeId], local: &[f64]) {
        for (row, values) in nodes.iter().zip(local.chunks_exact(nodes.len())) {
            let row = self.row(row.index());
            for (column, value) in nodes.iter().zip(values) {
                let place = self.columns[row.clone()].binary_search(&column.0).expect("nodes of one element");
                self.values[row.start + place] += value;
            }
        }
    }

    /// Where the entries of a row are.
    pub fn row(&self, node: usize) -> std::ops::Range<usize> {
        self.offsets[node] as usize..self.offsets[node + 1] as usize
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The matrix with numbers added to the diagonal at some nodes.
    pub fn with_added(mut self, added: &[(u32, f64)]) -> Self {
        for (node, value) in added {
            let row = self.row(*node as usize);
            let place = self.columns[row.clone()].binary_search(node).expect("a node is a neighbour of itself");
            self.values[row.start + place] += value;
        }
        self
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        let entry = |i: usize| {
            let row = self.row(i);
            let place = self.columns[row.clone()].binary_search(&(i as u32));
            place.map_or(0.0, |place| self.values[row.start + place])
        };
        (0..self.len()).map(entry).collect()
    }

    /// The sum of each row: what its node bears of a weight, so that a body falls as a whole.
    pub fn row_sums(&self) -> Vec<f64> {
        (0..self.len()).map(|i| self.values[self.row(i)].iter().sum()).collect()
    }
}

/// The functions of an element at the points of its rule for masses.
struct Table {
    functions: Vec<Vec<f64>>,
    slopes: Vec<Vec<[f64; 3]>>,
}

impl Table {
    fn new(info: &ElementInfo) -> Self {
        let (functions, slopes) = info.mass_rule.iter().map(|(xi, _)| info.functions_at(*xi)).unzip();
        Self { functions, slopes }
    }

    /// The matrix of an element, row by row.
    fn matrix(&self, info: &ElementInfo, positions: &[[f64; 3]], density: f64) -> Vec<f64> {
        let n = positions.len();
        let mut matrix = vec![0.0; n * n];
        for (volume, functions) in point_volumes(info, &self.slopes, positions).zip(&self.functions) {
            for i in 0..n {
                let factor = density * volume * functions[i];
                for j in 0..=i {
                    matrix[n * i + j] += factor * functions[j];
                }
            }
        }
        for i in 0..n {
            for j in 0..i {
                matrix[n * j + i] = matrix[n * i + j];
            }
        }
        matrix
    }
}

/// The masses of a body on a backend: M is diagonal, or the consistent matrix; a body that does not move has none.
pub struct Masses<B: Backend> {
    diagonal: Option<B::Vector>,
    matrix: Option<B::Matrix>,
}

impl<B: Backend> Masses<B> {
    /// Lumped masses, one entry a component.
    pub fn lumped(masses: B::Vector) -> Self {
        Self { diagonal: Some(masses), matrix: None }
    }

    /// The consistent matrix.
    pub fn consistent(backend: &B, matrix: &MassMatrix) -> Self {
        let diagonal: Vec<[f64; 3]> = matrix.diagonal().iter().map(|m| [*m; 3]).collect();
        Self { diagonal: Some(backend.upload(&diagonal)), matrix: Some(backend.matrix(matrix)) }
    }

    /// The masses of a body, with some added at nodes.
    pub fn of(backend: &B, body: &Body, added: &[(u32, f64)]) -> Self {
        if !body.moves {
            return Self { diagonal: None, matrix: None };
        }
        if let Some(matrix) = &body.mass_matrix {
            return Self::consistent(backend, &matrix.clone().with_added(added));
        }
        let mut masses: Vec<[f64; 3]> = body.masses.iter().map(|m| [*m; 3]).collect();
        for (node, value) in added {
            masses[*node as usize].iter_mut().for_each(|m| *m += value);
        }
        Self::lumped(backend.upload(&masses))
    }

    /// The diagonal of M: all of it where masses are lumped; none in statics.
    pub fn diagonal(&self) -> Option<&B::Vector> {
        self.diagonal.as_ref()
    }

    /// The diagonal of M of a body that moves.
    ///
    /// # Panics
    /// It does not.
    pub fn of_motion(&self) -> &B::Vector {
        self.diagonal.as_ref().expect("a body that moves has masses")
    }

    /// The matrix; none where masses are lumped.
    pub fn matrix(&self) -> Option<&B::Matrix> {
        self.matrix.as_ref()
    }

    /// y += a M x.
    pub fn add(&self, backend: &B, a: f64, x: &B::Vector, y: &mut B::Vector) {
        match (&self.matrix, &self.diagonal) {
            (Some(matrix), _) => backend.add_product(a, matrix, x, y),
            (None, Some(diagonal)) => backend.multiply_add(a, diagonal, x, y),
            (None, None) => {}
        }
    }
}

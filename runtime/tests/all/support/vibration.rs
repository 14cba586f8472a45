//! Vibrations of a bar with consistent and with lumped masses, by dense matrices.

use nalgebra::{DMatrix, DVector};
use tensormass_kernels::ElementEntry;
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::laws;
use tensormass_runtime::mass::MassMatrix;
use tensormass_runtime::mesh::{Mesh, beam_of};

use super::{body, system};

/// Mass of a unit of volume.
pub const DENSITY: f64 = 1000.0;

/// The consistent mass of a mesh.
pub fn matrix(mesh: &Mesh) -> MassMatrix {
    let densities = vec![DENSITY; mesh.len()];
    MassMatrix::assemble(mesh, &densities, 1.0).expect("a small mesh")
}

/// The circular frequency of the lowest longitudinal vibration of a bar of unit length, clamped at one end and free
/// at the other, with no strain across, over its exact value.
pub struct Frequency {
    /// Unknowns.
    #[allow(dead_code)] // the example `convergence` prints it
    pub unknowns: usize,
    /// With the consistent mass.
    pub consistent: f64,
    /// With lumped masses.
    #[allow(dead_code)] // the example `convergence` prints it
    pub lumped: f64,
}

/// The bar in so many cells along it, with one across.
pub fn frequency(element: &'static ElementEntry, cells: usize) -> Frequency {
    let width = 1.0 / cells as f64;
    let depth = if element.info.dimension == 2 { 1.0 } else { width };
    let mesh = beam_of(element, [1.0, width, depth], [cells, 1, 1], [0.0; 3]).unwrap_or_else(|e| panic!("{e}"));
    let hooke = laws().iter().find(|law| law.info.structure.linear && law.damping.is_none()).expect("a linear law");
    let values: Vec<f64> =
        hooke.info.parameters.iter().map(|p| if p.dimensions == [0, 1, 0] { 1e6 } else { 0.0 }).collect();
    let nodes = mesh.nodes();
    let free: Vec<usize> = (0..nodes.len()).filter(|n| nodes[*n][0] > 0.0).collect();
    let mut system = system::<f64>(body(&mesh, hooke, &values, &[]));
    let mut column = |n: usize| {
        let mut u = vec![[0.0; 3]; nodes.len()];
        u[n][0] = 1.0;
        let mut f = system.backend.zeros();
        system.field.prepare(&system.backend, &system.backend.zeros());
        system.field.add_dforce(&system.backend, &system.backend.upload(&u), -1.0, &mut f);
        let f = system.backend.download(&f);
        DVector::from_iterator(free.len(), free.iter().map(|n| f[*n][0]))
    };
    let stiffness = DMatrix::from_columns(&free.iter().map(|n| column(*n)).collect::<Vec<_>>());
    let m = matrix(&mesh);
    let entry =
        |i: usize, j: usize| m.row(free[i]).find(|k| m.columns[*k] as usize == free[j]).map_or(0.0, |k| m.values[k]);
    let consistent = DMatrix::from_fn(free.len(), free.len(), entry);
    let masses = DVector::from_iterator(free.len(), free.iter().map(|n| system.body.masses[*n]));
    let over_exact = |mass: DMatrix<f64>| {
        // M = L L': the eigenvalues of L^-1 K L^-T are squares of frequencies.
        let inverse = mass.cholesky().expect("a positive mass").l().try_inverse().expect("its factor");
        let lowest = (&inverse * &stiffness * inverse.transpose()).symmetric_eigenvalues().min();
        lowest.sqrt() / (std::f64::consts::FRAC_PI_2 * (1e6_f64 / DENSITY).sqrt())
    };
    Frequency {
        unknowns: free.len(),
        consistent: over_exact(consistent),
        lumped: over_exact(DMatrix::from_diagonal(&masses)),
    }
}

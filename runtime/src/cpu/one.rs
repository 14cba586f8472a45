//! A law on one element, in double precision: what step limits and tests ask of it.

use tensormass_kernels::{
    Blocks, Cluster, Compute, ElementEntry, Engine, Extent, LawEntry, Node, RestPoint, compose, linear_tetrahedron,
};

/// One element with its kernels; vectors are given at its nodes.
pub struct One {
    compute: Box<dyn Compute<f64>>,
    blocks: Blocks<f64>,
}

fn padded(u: &[[f64; 3]]) -> Vec<Node<f64>> {
    u.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect()
}

/// Displacements of the tetrahedron's nodes with this gradient: those of the last three nodes' functions are the unit vectors.
fn at_nodes(g: &[f64; 9]) -> [[f64; 3]; 4] {
    let mut u = [[0.0; 3]; 4];
    (0..9).for_each(|k| u[1 + k % 3][k / 3] = g[k]);
    u
}

impl std::fmt::Debug for One {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("One").finish_non_exhaustive()
    }
}

impl One {
    /// A law on an element with these points at rest and constants.
    ///
    /// # Panics
    /// They are not those of the element or the law.
    pub fn new(element: &ElementEntry, law: &LawEntry, rest: &[RestPoint<f64>], constants: &[f64]) -> Self {
        let nodes: Vec<u32> = (0..element.info.nodes as u32).collect();
        let compute = compose::<f64>(Engine::SCALAR, element, law);
        let shape = [element.info.nodes, element.info.points.len(), law.info.constants.len()];
        let mut blocks = Blocks::new(compute.lanes(), shape, false, &[Extent::of(1)]);
        blocks.fill(0, &Cluster { nodes: &nodes, rest, constants });
        Self { blocks, compute }
    }

    /// A law alone, at a point where the displacement gradient is given.
    ///
    /// # Panics
    /// The constants are not those of the law.
    pub fn point(law: &LawEntry, constants: &[f64]) -> Self {
        let rest = RestPoint { inverse_jacobian: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], weight: 1.0 };
        Self::new(linear_tetrahedron(), law, &[rest], constants)
    }

    /// The Cauchy stress, row by row, of a [`One::point`] with this displacement gradient.
    pub fn cauchy(&self, g: &[f64; 9]) -> [f64; 9] {
        let mut stress = [[0.0; 9]];
        self.compute.cauchy(self.blocks.part(0), &padded(&at_nodes(g)), &mut stress);
        stress[0]
    }

    /// The differential of the first Piola-Kirchhoff stress, row by row, of a [`One::point`] at a displacement gradient in the
    /// direction of another.
    pub fn stress_differential(&self, g: &[f64; 9], dg: &[f64; 9]) -> [f64; 9] {
        let mut df = [[0.0; 3]; 4];
        self.dforce(&at_nodes(g), &at_nodes(dg), &mut df);
        // Of weight 1: the force differential at a node is minus dP times the gradient of its function.
        std::array::from_fn(|k| -df[1 + k % 3][k / 3])
    }

    /// What is added to zeros at the nodes.
    fn nodal<T>(&self, out: &mut [[f64; 3]], add: impl FnOnce(&mut [Node<f64>]) -> T) -> T {
        let mut nodes = vec![[0.0; 4]; out.len()];
        let result = add(&mut nodes);
        out.iter_mut().zip(nodes).for_each(|(out, [x, y, z, _])| *out = [x, y, z]);
        result
    }

    /// The strain energy, where the element is inside the law's domain.
    pub fn energy(&self, u: &[[f64; 3]]) -> Option<f64> {
        let mut energy = [0.0];
        let outside = self.compute.energy(self.blocks.part(0), &padded(u), &mut energy);
        outside.is_none().then_some(energy[0])
    }

    /// Nodal forces; whether the element is inside the law's domain.
    pub fn force(&self, u: &[[f64; 3]], out: &mut [[f64; 3]]) -> bool {
        self.nodal(out, |f| self.compute.force(self.blocks.part(0), &padded(u), f).is_none())
    }

    /// Their differentials where u changes by du.
    pub fn dforce(&self, u: &[[f64; 3]], du: &[[f64; 3]], out: &mut [[f64; 3]]) {
        self.nodal(out, |f| self.compute.dforce(self.blocks.part(0), [&padded(u), &padded(du)], f));
    }

    /// The diagonal of the tangent stiffness.
    pub fn diagonal(&self, u: &[[f64; 3]], out: &mut [[f64; 3]]) {
        self.nodal(out, |f| self.compute.diagonal(self.blocks.part(0), &padded(u), f));
    }

    /// The differentials of damping forces where v changes by dv.
    pub fn ddamping(&self, [u, v, dv]: [&[[f64; 3]]; 3], out: &mut [[f64; 3]]) {
        self.nodal(out, |f| self.compute.ddamping(self.blocks.part(0), [&padded(u), &padded(v), &padded(dv)], f));
    }
}

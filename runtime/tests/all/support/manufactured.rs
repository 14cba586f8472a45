//! Manufactured solutions: a displacement is chosen, the load that balances it is derived from the law's own tangent, and
//! the mesh's solution is compared with what was chosen.
//!
//! u_i(X) = A sin(k_i . X + p_i), so that G_ij = A k_ij cos(..) and dG_ij/dX_l = -A k_ij k_il sin(..). The body force is
//! b_i = -sum_l dP_il(G; dG/dX_l): whatever the law, without a formula for it. All nodes of the boundary are at u(X).

use tensormass_kernels::point::Material;
use tensormass_kernels::{ElementEntry, RestPoint};
use tensormass_runtime::LawEntry;
use tensormass_runtime::backend::Backend;
use tensormass_runtime::body::Load;
use tensormass_runtime::cg::CgLimits;
use tensormass_runtime::history::History;
use tensormass_runtime::integrate::{NewtonLimits, SolverSettings, Statics};
use tensormass_runtime::mesh::{ElementId, Mesh};
use tensormass_runtime::scene::Preconditioner;
use tensormass_runtime::system::Integrator;
use tensormass_testing::codegen::element::Polynomial;

use super::elements::{declaration, unit};
use super::{body, parameters, system};

/// Wave vectors and phases: no symmetry of the mesh.
const WAVES: [[f64; 3]; 3] = [[2.1, 1.3, -0.7], [-1.1, 1.9, 1.5], [0.9, -1.7, 2.3]];
const PHASES: [f64; 3] = [0.3, 1.1, -0.6];
/// m on a cube of 1 m: strains of about .1.
const AMPLITUDE: f64 = 0.04;

/// The chosen displacement, in the plane or in space.
pub struct Chosen {
    plane: bool,
}

impl Chosen {
    fn angle(&self, i: usize, x: &[f64; 3]) -> f64 {
        (0..3).map(|k| self.wave(i, k) * x[k]).sum::<f64>() + PHASES[i]
    }

    /// Nothing moves along z in the plane, and nothing depends on it.
    fn wave(&self, i: usize, k: usize) -> f64 {
        if self.plane && k == 2 { 0.0 } else { WAVES[i][k] }
    }

    fn amplitude(&self, i: usize) -> f64 {
        if self.plane && i == 2 { 0.0 } else { AMPLITUDE }
    }

    pub fn displacement(&self, x: &[f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.amplitude(i) * self.angle(i, x).sin())
    }

    fn gradient(&self, x: &[f64; 3]) -> [f64; 9] {
        std::array::from_fn(|k| self.amplitude(k / 3) * self.wave(k / 3, k % 3) * self.angle(k / 3, x).cos())
    }

    fn gradient_along(&self, x: &[f64; 3], l: usize) -> [f64; 9] {
        std::array::from_fn(|k| {
            let i = k / 3;
            -self.amplitude(i) * self.wave(i, k % 3) * self.wave(i, l) * self.angle(i, x).sin()
        })
    }
}

/// A law's stress at points, of one material.
struct Points {
    kernels: tensormass_kernels::point::PointKernels<f64>,
    constants: Vec<f64>,
}

impl Points {
    fn material(&self) -> Material<'_, f64> {
        Material { constants: &self.constants, stride: 0, count: self.constants.len(), points: 1 }
    }

    fn energy(&self, g: &[f64; 9]) -> f64 {
        let mut w = [0.0];
        assert!((self.kernels.energy)(&self.material(), &[*g], &mut w).is_none(), "outside the domain");
        w[0]
    }

    fn body_force(&self, chosen: &Chosen, x: &[f64; 3]) -> [f64; 3] {
        let mut force = [0.0; 3];
        for l in 0..3 {
            let mut dp = [[0.0; 9]];
            (self.kernels.dforce)(&self.material(), &[chosen.gradient(x)], &[chosen.gradient_along(x, l)], &mut dp);
            (0..3).for_each(|i| force[i] -= dp[0][3 * i + l]);
        }
        force
    }
}

/// What a mesh's solution is off by.
#[derive(Debug, Clone, Copy)]
pub struct Errors {
    /// Cells along a side.
    pub cells: usize,
    /// Unknowns.
    #[allow(dead_code)] // the example `convergence` prints it
    pub unknowns: usize,
    /// sqrt of the integral of |u - u_h|^2, over that of |u|^2.
    pub displacement: f64,
    /// |E - E_h| / E, E the potential energy's elastic part less the work of the load.
    pub energy: f64,
}

/// The functions of an element and their slopes at the points of its rule for masses, which is finer than that of forces.
struct Rule {
    points: Vec<(f64, Vec<f64>, Vec<[f64; 3]>)>,
}

impl Rule {
    fn new(element: &ElementEntry) -> Self {
        let declared = declaration(element.info);
        let slopes: Vec<[Polynomial; 3]> =
            declared.functions.iter().map(|f| std::array::from_fn(|k| f.derivative(k))).collect();
        let point = |(x, weight): ([f64; 3], f64)| {
            let functions = declared.functions.iter().map(|f| f.at_f64(&x)).collect();
            (weight, functions, slopes.iter().map(|s| s.each_ref().map(|p| p.at_f64(&x))).collect())
        };
        Self { points: element.info.mass_rule.iter().copied().map(point).collect() }
    }

    /// Calls at each point with its position, weight, functions and the gradients of the functions.
    fn each(&self, mesh: &Mesh, e: ElementId, mut call: impl FnMut([f64; 3], f64, &[f64], &[[f64; 3]])) {
        let positions = mesh.positions(mesh.element_nodes(e));
        let plane = mesh.kind(e).info.dimension == 2;
        for (weight, functions, slopes) in &self.points {
            let x = std::array::from_fn(|i| positions.iter().zip(functions).map(|(p, f)| p[i] * f).sum());
            let mut jacobian =
                nalgebra::Matrix3::from_fn(|i, a| positions.iter().zip(slopes).map(|(p, s)| p[i] * s[a]).sum());
            if plane {
                jacobian[(2, 2)] = 1.0;
            }
            let inverse = jacobian.try_inverse().expect("a valid element");
            let gradients: Vec<[f64; 3]> =
                slopes.iter().map(|s| std::array::from_fn(|k| (0..3).map(|a| inverse[(a, k)] * s[a]).sum())).collect();
            call(x, weight * jacobian.determinant(), functions, &gradients);
        }
    }
}

/// Solves on a mesh of the unit cube or square.
pub fn solve(element: &'static ElementEntry, law: &'static LawEntry, cells: usize) -> Errors {
    let mesh = unit(element, cells);
    let chosen = Chosen { plane: element.info.dimension == 2 };
    let given = parameters(law);
    let points = Points { kernels: law.points(), constants: law.constants(&given) };
    let surface = mesh.surface_nodes();
    let imposed: Vec<(u32, u8, f64)> = (0..mesh.nodes().len() as u32)
        .flat_map(|n| (0..3).map(move |c| (n, c)))
        .filter(|(n, c)| {
            (chosen.plane && *c == 2) || surface.binary_search(&tensormass_runtime::mesh::NodeId(*n)).is_ok()
        })
        .map(|(n, c)| (n, c, chosen.displacement(&mesh.nodes()[n as usize])[c as usize]))
        .collect();
    let mut forces = vec![[0.0; 3]; mesh.nodes().len()];
    for e in mesh.elements() {
        let (nodes, info) = (mesh.element_nodes(e), mesh.kind(e).info);
        let positions = mesh.positions(nodes);
        for (point, rest) in info.points.iter().zip(mesh.rest(e)) {
            let RestPoint { weight, .. } = rest;
            let x = std::array::from_fn(|i| positions.iter().zip(point.functions).map(|(p, f)| p[i] * f).sum());
            let b = points.body_force(&chosen, &x);
            for (node, function) in nodes.iter().zip(point.functions) {
                (0..3).for_each(|i| forces[node.index()][i] += weight * function * b[i]);
            }
        }
    }
    let mut body = body(&mesh, law, &given, &imposed);
    body.loads = vec![Load { forces, history: History::constant(1.0) }];
    for (motion, (_, _, value)) in body.motions.iter_mut().zip(&imposed) {
        *motion = History::table(vec![(0.0, 0.0), (1.0, *value)]).expect("a ramp");
    }
    let unknowns = 3 * mesh.nodes().len() - imposed.len();
    let mut system = system::<f64>(body);
    let settings = SolverSettings {
        cg: CgLimits { tolerance: 1e-11, max_iterations: 5000 },
        preconditioner: Preconditioner::Jacobi,
        newton: NewtonLimits { tolerance: 1e-11, max_iterations: 30 },
    };
    let mut state = system.initial_state([0.0; 3]);
    let mut statics = Statics::new(&system.backend, settings);
    statics
        .step(&mut system, &mut state, 1.0)
        .unwrap_or_else(|e| panic!("{}, {}: {e}", element.info.name, law.info.name));
    let u = system.backend.download(&state.u);
    let rule = Rule::new(element);
    let (mut off, mut size, mut exact, mut found) = (0.0, 0.0, 0.0, 0.0);
    let at_rest = points.energy(&[0.0; 9]);
    for e in mesh.elements() {
        let nodal: Vec<[f64; 3]> = mesh.element_nodes(e).iter().map(|n| u[n.index()]).collect();
        rule.each(&mesh, e, |x, weight, functions, gradients| {
            let b = points.body_force(&chosen, &x);
            let wanted = chosen.displacement(&x);
            let here: [f64; 3] = std::array::from_fn(|i| nodal.iter().zip(functions).map(|(u, f)| u[i] * f).sum());
            let g: [f64; 9] =
                std::array::from_fn(|k| nodal.iter().zip(gradients).map(|(u, n)| u[k / 3] * n[k % 3]).sum());
            let work = |u: &[f64; 3]| (0..3).map(|i| b[i] * u[i]).sum::<f64>();
            off += weight * (0..3).map(|i| (here[i] - wanted[i]).powi(2)).sum::<f64>();
            size += weight * wanted.iter().map(|x| x * x).sum::<f64>();
            exact += weight * (points.energy(&chosen.gradient(&x)) - at_rest - work(&wanted));
            found += weight * (points.energy(&g) - at_rest - work(&here));
        });
    }
    Errors { cells, unknowns, displacement: (off / size).sqrt(), energy: ((found - exact) / exact).abs() }
}

/// The orders between two meshes: of displacement, and of energy.
pub fn orders(coarse: &Errors, fine: &Errors) -> [f64; 2] {
    let refined = (fine.cells as f64 / coarse.cells as f64).ln();
    [(coarse.displacement / fine.displacement).ln() / refined, (coarse.energy / fine.energy).ln() / refined]
}

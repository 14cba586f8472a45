//! Every law and element on every kind of registers that this machine has, against one number at a time.
//!
//! The arithmetic is the same but for products that are added without being rounded, the last digit of logarithms and
//! exponentials, and the order in which a node's forces are added.

use crate::support::elements::{distorted, of_dimension, unit};
use crate::support::{Random, body, parameters};
use tensormass_kernels::{ElementEntry, elements, laws};
use tensormass_runtime::LawEntry;
use tensormass_runtime::backend::{Backend, ForceField, LeftDomain};
use tensormass_runtime::cpu::{CpuBackend, CpuField, CpuVector, Engine, Precision};
use tensormass_runtime::tangent::Tangent;

/// Roundings in a kernel's longest chain of operations, and what they may be magnified by at strains of a third: that of
/// what cancels in stresses, a few times their size.
const ROUNDINGS: f64 = 200.0;

/// A body of one element and law with vectors at its nodes.
struct Case {
    name: String,
    body: tensormass_runtime::body::Body,
    vectors: [Vec<[f64; 3]>; 3],
}

impl Case {
    fn new(element: &'static ElementEntry, law: &'static LawEntry, cells: usize, size: f64) -> Self {
        let mesh = distorted(&unit(element, cells), 0.2, 11);
        let mut random = Random(12);
        let flat = |x: [f64; 3]| if element.info.dimension == 2 { [x[0], x[1], 0.0] } else { x };
        // Nodes of a quadratic element are half as far apart.
        let apart = (cells * element.info.order as usize) as f64;
        let mut vector = |size: f64| mesh.nodes().iter().map(|_| flat(random.vector(size / apart))).collect();
        Self {
            name: format!("{} of {}, {size}", element.info.name, law.info.name),
            body: body(&mesh, law, &parameters(law), &[]),
            vectors: [vector(size), vector(1.0), vector(1.0)],
        }
    }

    /// What a field computes on some registers: vectors at the nodes, and energies.
    fn all<R: Precision>(&self, engine: Engine) -> Result<Vec<(&'static str, Vec<f64>)>, LeftDomain> {
        let backend = CpuBackend::<R>::new(&self.body);
        let mut field = CpuField::<R>::on(&backend, &self.body, engine);
        let [u, v, du] = self.vectors.each_ref().map(|x| backend.upload(x));
        let mut all = vec![];
        let kept = |out: &mut CpuVector<R>| {
            let values = backend.download(out).as_flattened().to_vec();
            backend.clear(out);
            values
        };
        let mut out = backend.zeros();
        field.add_force(&backend, &u, &mut out)?;
        all.push(("force", kept(&mut out)));
        field.add_dforce_at(&backend, &u, &du, 1.0, &mut out);
        all.push(("dforce", kept(&mut out)));
        for (product, tangent) in [("apply", Tangent::Stored), ("assembled", Tangent::Assembled)] {
            field = field.with_tangents(&[tangent]);
            field.prepare(&backend, &u);
            field.add_dforce(&backend, &du, 1.0, &mut out);
            all.push((product, kept(&mut out)));
        }
        field.add_diagonal_at(&backend, &u, 1.0, &mut out);
        all.push(("diagonal", kept(&mut out)));
        field.add_damping(&backend, [&u, &v], 1.0, &mut out);
        all.push(("damping", kept(&mut out)));
        field.add_ddamping(&backend, [&u, &v], &du, 1.0, &mut out);
        all.push(("ddamping", kept(&mut out)));
        field.add_damping_diagonal(&backend, [&u, &v], 1.0, &mut out);
        all.push(("damping_diagonal", kept(&mut out)));
        all.push(("energy", field.element_energies(&backend, &u)?));
        all.push(("cauchy", field.cauchy(&backend, &u).as_flattened().to_vec()));
        Ok(all)
    }

    fn check<R: Precision>(&self) {
        let wanted = self.all::<R>(Engine::SCALAR).unwrap_or_else(|e| panic!("{}: {e}", self.name));
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for engine in Engine::available() {
            let found = self.all::<R>(engine).unwrap_or_else(|e| panic!("{}: {e}", self.name));
            let of = |name: &str| found.iter().find(|(kernel, _)| *kernel == name).expect("it is computed");
            let products = ["apply", "assembled"].map(|product| (of("dforce"), of(product)));
            let pairs = products.into_iter().chain(wanted.iter().zip(&found));
            for ((kernel, wanted), (_, found)) in pairs {
                assert_eq!(wanted.len(), found.len());
                let off = wanted.iter().zip(found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                let size = largest(wanted);
                assert!(size.is_finite() && found.iter().all(|x| x.is_finite()), "{}, {kernel}", self.name);
                assert!(
                    off <= ROUNDINGS * R::EPSILON * size,
                    "{}, {kernel} on {} in {}: {off:.2e} of {size:.2e}",
                    self.name,
                    engine.name(),
                    std::any::type_name::<R>()
                );
            }
        }
    }
}

/// Near rest, and as far as random displacements of nodes can go; no number of elements is a multiple of lanes.
#[test]
fn lanes_compute_what_single_numbers_do() {
    for law in laws() {
        for (element, cells) in of_dimension(3).chain(of_dimension(2)).zip([3, 3, 3, 3, 3, 7, 7, 7, 7]) {
            for size in [1e-5, 0.01, 0.15] {
                let case = Case::new(element, law, cells, size);
                case.check::<f32>();
                case.check::<f64>();
            }
        }
    }
}

/// One element of many that is turned inside out is found, whichever lane it is in.
#[test]
fn elements_outside_a_domain_are_found() {
    let law = laws().iter().find(|l| l.info.domain.is_some()).expect("a law with a domain");
    let element = elements().iter().find(|e| e.info.is_linear_simplex).expect("linear tetrahedra");
    let mut case = Case::new(element, law, 4, 0.0);
    for node in [0, 31, 62, 124] {
        case.vectors[0] = vec![[0.0; 3]; case.body.masses.len()];
        case.vectors[0][node] = [3.0, -2.5, 3.5].map(|x| if node == 0 { x } else { -x });
        for engine in Engine::available() {
            let left = case.all::<f64>(engine).expect_err("the node was moved through the body");
            let nodes = &case.body.elements[left.element as usize];
            assert!(nodes.contains(&(node as u32)), "on {}: {left}", engine.name());
        }
    }
}

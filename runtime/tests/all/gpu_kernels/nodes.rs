//! Sums at nodes that elements share, products with the operator, bodies in pages, and the options that change nothing.

use std::sync::Arc;

use tensormass_runtime::backend::{Backend, Damping, ForceField, Operator, REGISTERS, RUNNING, SUM, Scalar, Update};
use tensormass_runtime::body::{Body, Constraint, LawBatch};
use tensormass_runtime::gpu::{Gpu, GpuOptions};
use tensormass_runtime::history::History;
use tensormass_runtime::mass::{MassMatrix, Masses};
use tensormass_runtime::mesh::{Mesh, beam};
use tensormass_runtime::order::DeviceOrder;
use tensormass_runtime::{LawEntry, laws, linear_tetrahedron};
use tensormass_testing::random::Rng;

use super::states::{
    Analysis, Bound, DEALT, Dealt, Kernel, Vector, batches, compare, in_pieces, in_turn, of_mesh, other_elements,
    representatives, single, two_laws, vectors,
};
use super::{On, on_cpu, on_gpu};
use crate::support::elements::{boxes_beside_wedges, distorted, renumbered, unit};
use crate::support::gpu::test_device;

/// Bytes that divide the body into pages.
const SMALL: u64 = 12 << 10;
/// Factors of sums; numbers of f32.
const FACTORS: [(Kernel, f64); 6] = [
    (Kernel::Force, 1.0),
    (Kernel::DForce, -0.75),
    (Kernel::Diagonal, 1.5),
    (Kernel::Damping, 1.25),
    (Kernel::DDamping, -0.5),
    (Kernel::DampingDiagonal, 0.75),
];
/// Factors of the masses and of the stiffness.
const OPERATOR: (f64, f64) = (3.25, 0.625);
/// Factors of the viscosity, which brings its forces to the size of the others, and of the stiffness that damps.
const DAMPING: (f64, f64) = (524_288.0, 0.375);
/// Where the tests' update keeps the sum.
const KEPT: usize = 7;

/// A body of some laws, one material and a material each, whose displacement strains and turns it a little.
struct Shared {
    body: Body,
    u: Vector,
    du: Vector,
    old: Vector,
}

impl Shared {
    /// A beam of linear tetrahedra of all laws.
    fn new(seed: u64) -> Self {
        let all: Vec<&'static LawEntry> = laws().iter().collect();
        let mesh = beam([4.0, 1.0, 1.5], [8, 3, 3], [0.5, -1.0, 2.0]).expect("a beam");
        // Edges are about 0.4 long: strains of up to about 0.1.
        Self::of(&mesh, &all, 0.02, seed)
    }

    /// A mesh, with displacements of up to a magnitude.
    fn of(mesh: &Mesh, laws: &[&'static LawEntry], magnitude: f64, seed: u64) -> Self {
        Self::dealt(mesh, laws, in_turn, magnitude, seed)
    }

    fn dealt(mesh: &Mesh, laws: &[&'static LawEntry], dealt: Dealt, magnitude: f64, seed: u64) -> Self {
        let mut rng = Rng::new(seed);
        let batches = batches(laws, mesh, dealt, &mut rng);
        let mut body = of_mesh(mesh, batches, &mut rng);
        let nodes = mesh.nodes().len();
        let plane = mesh.blocks()[0].info().dimension == 2;
        // Every combination of components is imposed at some node, and none at others; all of z in the plane.
        let is_imposed = |n: u32, c: u8| ((n % 11) >> c) & 1 == 1 || (plane && c == 2);
        let imposed = (0..nodes as u32).flat_map(|n| (0..3).filter(move |&c| is_imposed(n, c)).map(move |c| (n, c)));
        body.constraints = imposed.map(|(node, component)| Constraint { node, component, motion: 0 }).collect();
        body.motions = vec![History::constant(0.0)];
        let u = vectors(nodes, magnitude, &mut rng);
        Self { body, u, du: vectors(nodes, 1.0, &mut rng), old: vectors(nodes, 10.0, &mut rng) }
    }

    /// old + factor times the sum of each node's slots; bodies in `pages` add a sum a page.
    fn sums(&self, kernel: Kernel, factor: f64, analysis: &Analysis, pages: usize, old: &[Bound]) -> Vec<Bound> {
        let mut sums: Vec<Sum> = old.iter().map(|_| Sum::default()).collect();
        for batch in self.body.batches.iter().filter(|batch| kernel.function(batch.law).is_some()) {
            let values = analysis.batch(kernel, &self.body, batch, &self.u, &self.du);
            for (&e, slots) in batch.elements.iter().zip(values.chunks(3 * batch.element.info.nodes)) {
                for (node, slot) in self.body.elements[e as usize].iter().zip(slots.chunks(3)) {
                    (0..3).for_each(|c| sums[3 * *node as usize + c].add(slot[c]));
                }
            }
        }
        sums.iter().zip(old).map(|(sum, old)| sum.added(factor, *old, pages as f64)).collect()
    }

    /// M x: three different masses a node, or the rows of the matrix, one term after the other.
    fn masses_times(&self, x: &[Bound]) -> Vec<Bound> {
        let Some(matrix) = &self.body.mass_matrix else {
            let masses = self.body.masses.iter().flat_map(|&m| [m, 2.0 * m, 4.0 * m]).map(Bound::exact);
            return masses.zip(x).map(|(m, &x)| m * x).collect();
        };
        let entry = |k: usize, c: usize| Bound::exact(matrix.values[k]) * x[3 * matrix.columns[k] as usize + c];
        let component = |i: usize, c: usize| matrix.row(i).map(|k| entry(k, c)).reduce(|a, b| a + b);
        let node = |i: usize| (0..3).map(move |c| component(i, c).expect("a node of an element"));
        (0..matrix.len()).flat_map(node).collect()
    }

    fn is_imposed(&self, k: usize) -> bool {
        self.body.constraints.iter().any(|c| 3 * c.node as usize + usize::from(c.component) == k)
    }
}

/// The slots of one component of a node.
#[derive(Default)]
struct Sum {
    terms: f64,
    value: f64,
    magnitudes: f64,
    errors: f64,
}

impl Sum {
    fn add(&mut self, slot: Bound) {
        self.terms += 1.0;
        self.value += slot.value;
        self.magnitudes += slot.value.abs();
        self.errors += slot.error;
    }

    /// old + factor times the sum. Each page sums its slots, n - 1 roundings for all in all, multiplies, and adds, each
    /// of them at most the magnitudes' sum.
    fn added(&self, factor: f64, old: Bound, pages: f64) -> Bound {
        let roundings = (self.terms - 1.0).max(0.0) + 1.0 + pages;
        let error = factor.abs() * (self.errors + roundings * self.magnitudes);
        Bound::new(old.value + factor * self.value, old.error + pages * old.value.abs() + error)
    }
}

/// A vector's imposed components after ones are added and they are projected out: 0 if it still has its mask.
fn imposed_after_projection<B: Backend>(backend: &B, body: &Shared, y: &mut B::Vector) -> Vec<f64> {
    backend.axpy(1.0, &backend.upload(&vec![[1.0; 3]; body.u.len()]), y);
    backend.project(y);
    let all = backend.download(y).into_flattened();
    (0..all.len()).filter(|&k| body.is_imposed(k)).map(|k| all[k]).collect()
}

/// Keeps the sum that is pending.
struct Keep;

impl Update for Keep {
    const SUMS: bool = true;
    fn apply<S: Scalar>(registers: &mut [S; REGISTERS]) {
        registers[KEPT] = registers[SUM];
    }
}

/// y = A x and x . y, where the solver runs; y before.
fn product<B: Backend, F: ForceField<B>>(
    on: &mut On<B, F>,
    body: &Shared,
    running: f64,
    damped: bool,
) -> (Vec<f64>, f64) {
    let On { backend, field } = on;
    let (x, mut y) = (backend.upload(&body.du), backend.upload(&body.old));
    let masses = match &body.body.mass_matrix {
        Some(matrix) => Masses::consistent(backend, matrix),
        None => {
            Masses::lumped(backend.upload(&body.body.masses.iter().map(|&m| [m, 2.0 * m, 4.0 * m]).collect::<Vec<_>>()))
        }
    };
    let mut registers = [0.0; REGISTERS];
    registers[RUNNING] = running;
    let mut registers = backend.registers(registers);
    let u = backend.upload(&body.u);
    field.prepare(backend, &u);
    let damping = Damping { u: &u, v: &x, viscosity: DAMPING.0, stiffness: DAMPING.1 };
    let operator =
        Operator { masses: &masses, mass: OPERATOR.0, stiffness: OPERATOR.1, damping: damped.then_some(damping) };
    field.product(backend, &operator, &x, &mut y, &mut registers);
    backend.update::<Keep>(&mut registers);
    let values = backend.download(&y).into_flattened();
    let imposed = imposed_after_projection(backend, body, &mut y);
    assert!(imposed.iter().all(|&y| y == 0.0), "the product has lost its mask");
    (values, backend.read(&registers)[KEPT])
}

#[test]
fn sums_keep_masks() {
    let Some(gpu) = test_device() else { return };
    let body = Shared::new(8);
    let On { backend, mut field } = on_gpu(&gpu, &body.body, GpuOptions::default());
    let (u, mut f) = (backend.upload(&body.u), backend.zeros());
    field.add_force(&backend, &u, &mut f).expect("inside the domain");
    let imposed = imposed_after_projection(&backend, &body, &mut f);
    assert_eq!(imposed, vec![0.0; body.body.constraints.len()]);
}

/// Force, differential, diagonal and product of a body in at least this many pages; their bits for another run.
fn check(gpu: &Arc<Gpu>, body: &Shared, options: GpuOptions, analysis: &Analysis, least: usize) -> Vec<Vec<f64>> {
    let mut cpu = on_cpu(&body.body);
    let mut on = on_gpu(gpu, &body.body, options);
    let pages = on.field.pages();
    assert!(if least > 1 { pages >= least } else { pages == 1 }, "{pages} pages, not {least}");
    let mut all = vec![];
    let old: Vec<Bound> = body.old.iter().flatten().copied().map(Bound::exact).collect();
    for (kernel, factor) in FACTORS {
        let wanted = cpu.values(kernel, &body.u, &body.du, factor, &body.old);
        let found = on.values(kernel, &body.u, &body.du, factor, &body.old);
        let what = format!("{kernel:?} at nodes, {pages} pages");
        let bounds = body.sums(kernel, factor, analysis, pages, &old);
        println!("{what}: {:.3} of the bound", compare(&what, &found, &wanted, &bounds));
        all.push(found);
    }
    let x: Vec<Bound> = body.du.iter().flatten().copied().map(Bound::exact).collect();
    let first = body.masses_times(&x).into_iter().map(|m| Bound::exact(OPERATOR.0) * m).collect::<Vec<_>>();
    // Slots hold -K x.
    let undamped = body.sums(Kernel::DForce, -OPERATOR.1, analysis, pages, &first);
    for damped in [false, true] {
        let (wanted, _) = product(&mut cpu, body, 1.0, damped);
        let (found, dot) = product(&mut on, body, 1.0, damped);
        let mut bounds = undamped.clone();
        if damped {
            bounds = body.sums(Kernel::DDamping, -DAMPING.0, analysis, pages, &bounds);
            bounds = body.sums(Kernel::DForce, -DAMPING.1, analysis, pages, &bounds);
        }
        let imposed = |k: &usize| body.is_imposed(*k);
        (0..bounds.len()).filter(imposed).for_each(|k| bounds[k] = Bound::exact(0.0));
        let what = format!("product, damped {damped}, {pages} pages");
        println!("{what}: {:.3} of the bound", compare(&what, &found, &wanted, &bounds));
        // Of the product as it was found. A term is rounded as a product, meets two others of its node, then halves of its
        // group, then the sums of groups.
        let groups = body.body.masses.len().div_ceil(options.work_group_size as usize);
        let depth = 1.0 + 2.0 + f64::from(options.work_group_size).log2() + groups.div_ceil(256) as f64 + 8.0;
        let terms = || x.iter().zip(&found).map(|(x, y)| x.value * y);
        let bound = Bound::new(terms().sum(), depth * terms().map(f64::abs).sum::<f64>());
        println!("x . y, {what}: {:.3} of the bound", compare(&what, &[dot], &[bound.value], &[bound]));
        all.extend([found, vec![dot]]);
    }
    all
}

#[test]
fn sums_at_nodes_are_those_of_f64_rounded() {
    let Some(gpu) = test_device() else { return };
    let (body, analysis) = (Shared::new(5), Analysis::new());
    for (least, binding_bytes) in [(1, None), (3, Some(SMALL))] {
        let run = || check(&gpu, &body, GpuOptions { binding_bytes, ..GpuOptions::default() }, &analysis, least);
        let first = run();
        assert!(first == run(), "a second run gives other bits");
    }
}

/// Where nodes are numbered at random, elements and nodes have an order of their own.
#[test]
fn sums_of_any_numbering_are_those_of_f64_rounded() {
    let Some(gpu) = test_device() else { return };
    let mesh = beam([5.0, 2.0, 2.0], [12, 6, 6], [0.5, -1.0, 2.0]).expect("a beam");
    let laws = representatives();
    let places = |body: &Body| DeviceOrder::of(body).places;
    assert!(places(&Shared::of(&mesh, &laws, 0.02, 5).body).is_sorted(), "a beam is numbered layer by layer");
    let body = Shared::of(&renumbered(&mesh, 3), &laws, 0.02, 5);
    assert!(!places(&body.body).is_sorted());
    for (least, binding_bytes) in [(1, None), (3, Some(SMALL))] {
        check(&gpu, &body, GpuOptions { binding_bytes, ..GpuOptions::default() }, &Analysis::new(), least);
    }
}

/// Three elements in a row an invocation, where there are many of a law; the numbers of each element, too.
#[test]
fn sums_of_strips_are_those_of_f64_rounded() {
    let Some(gpu) = test_device() else { return };
    let analysis = Analysis::new();
    let mesh = distorted(&unit(linear_tetrahedron(), 11), 0.2, 9);
    let laws = representatives();
    // Edges are a tenth long.
    let body = Shared::dealt(&mesh, &laws, in_pieces, 0.003, 5);
    let order = DeviceOrder::of(&body.body).elements;
    assert!(order.iter().any(|batch| !batch.strips.is_empty() && !batch.alone.is_empty()), "both kinds of passes");
    assert!(body.body.batches.iter().zip(&order).all(|(b, o)| b.law.damping.is_none() || !o.strips.is_empty()));
    // Pages end within strips.
    for (least, binding_bytes) in [(1, None), (3, Some(48 * 7986 / 4))] {
        check(&gpu, &body, GpuOptions { binding_bytes, ..GpuOptions::default() }, &analysis, least);
    }
    let mut cpu = on_cpu(&body.body);
    let mut on = on_gpu(&gpu, &body.body, GpuOptions::default());
    for (kernel, width) in [(Kernel::Energy, 1), (Kernel::Cauchy, 9)] {
        let (wanted, found) = (cpu.fresh(kernel, &body.u, &body.du), on.fresh(kernel, &body.u, &body.du));
        let mut bounds = vec![Bound::exact(0.0); found.len()];
        for batch in &body.body.batches {
            let values = analysis.batch(kernel, &body.body, batch, &body.u, &body.du);
            for (e, value) in batch.elements.iter().zip(values.chunks(width)) {
                bounds[width * *e as usize..][..width].copy_from_slice(value);
            }
        }
        let what = format!("{kernel:?} of strips");
        println!("{what}: {:.3} of the bound", compare(&what, &found, &wanted, &bounds));
    }
}

/// Any element, and two kinds that share nodes: how slots are summed is the same of all laws.
#[test]
fn sums_of_every_element_are_those_of_f64_rounded() {
    let Some(gpu) = test_device() else { return };
    let analysis = Analysis::new();
    let laws = two_laws();
    let mixed = distorted(&boxes_beside_wedges(3), 0.3, 17);
    for mesh in other_elements().map(|element| distorted(&unit(element, 3), 0.3, 5)).chain([mixed]) {
        let kinds: Vec<&str> = mesh.blocks().iter().map(|b| b.info().name).collect();
        println!("{}", kinds.join(" and "));
        // Nodes of quadratic elements are about 1/6 apart.
        let body = Shared::of(&mesh, &laws, 0.005, 5);
        // A page has the slopes of its reference elements, too: room for those of one kind and half of all points.
        let table = |batch: &LawBatch| batch.element.info.points.len() * (batch.element.info.nodes - 1);
        let table = body.body.batches.iter().map(table).max().expect("a batch");
        let half = (16 * table + 24 * body.body.rest.values().len()) as u64;
        for (least, binding_bytes) in [(1, None), (2, Some(half))] {
            check(&gpu, &body, GpuOptions { binding_bytes, ..GpuOptions::default() }, &analysis, least);
        }
    }
}

/// The same with the consistent mass, of two kinds that share nodes.
#[test]
fn products_with_the_consistent_mass_are_those_of_f64_rounded() {
    let Some(gpu) = test_device() else { return };
    let body = with_matrix();
    check(&gpu, &body, GpuOptions::default(), &Analysis::new(), 1);
    let mut on = on_gpu(&gpu, &body.body, GpuOptions::default());
    assert_eq!(product(&mut on, &body, 0.0, false).0, body.old.as_flattened(), "a solver that has stopped");
}

/// A body with a consistent mass of numbers of f32.
fn with_matrix() -> Shared {
    let mesh = distorted(&boxes_beside_wedges(3), 0.3, 17);
    let mut shared = Shared::of(&mesh, &two_laws(), 0.005, 5);
    let mut matrix = MassMatrix::assemble(&mesh, &vec![1.0; mesh.len()], 1.0).expect("a small mesh");
    matrix.values.iter_mut().for_each(|value| *value = single(*value));
    shared.body.mass_matrix = Some(matrix);
    shared
}

#[test]
fn a_solver_that_has_stopped_is_left_alone() {
    let Some(gpu) = test_device() else { return };
    let body = Shared::new(6);
    for binding_bytes in [None, Some(SMALL)] {
        let mut on = on_gpu(&gpu, &body.body, GpuOptions { binding_bytes, ..GpuOptions::default() });
        for damped in [false, true] {
            assert_eq!(product(&mut on, &body, 0.0, damped).0, body.old.as_flattened());
        }
    }
}

#[test]
fn sums_do_not_depend_on_how_elements_are_dealt_to_invocations() {
    let Some(gpu) = test_device() else { return };
    let mesh = beam([4.0, 1.0, 1.5], [8, 3, 3], [0.5, -1.0, 2.0]).expect("a beam");
    let body = Shared::of(&mesh, &two_laws(), 0.02, 7);
    let force = |options| on_gpu(&gpu, &body.body, options).fresh(Kernel::Force, &body.u, &body.du);
    let usual = force(GpuOptions::default());
    for (work_group_size, elements_per_invocation) in DEALT {
        let options = GpuOptions { work_group_size, elements_per_invocation, ..GpuOptions::default() };
        assert!(force(options) == usual, "{options:?}");
    }
}

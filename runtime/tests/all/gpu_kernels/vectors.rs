//! Vectors and registers: every operation against f64 on the host, with imposed components that no operation forgets.

use std::sync::Arc;

use tensormass_kernels::RestPoint;
use tensormass_runtime::backend::{ALPHA, BETA, Backend, Descent, REGISTERS, RUNNING, SUM, Scalar, Update};
use tensormass_runtime::body::{Body, Constraint};
use tensormass_runtime::gpu::{Gpu, GpuBackend, GpuOptions, GpuVector};
use tensormass_runtime::history::History;
use tensormass_testing::random::Rng;
use tensormass_testing::rounding::SINGLE;

use super::states::{Bound, Vector, body, compare, vectors};
use crate::support::gpu::test_device;

/// Nodes: fewer than a work group, one more, several groups, and more groups than a group adds up at once.
const NODES: [usize; 5] = [1, 255, 257, 2000, 70_000];
/// The factor of operations; a number of f32.
const A: f64 = -0.687_5;
/// The motions that imposed components follow; numbers of f32.
const MOTIONS: [f64; 3] = [0.25, -3.5, 0.0];

/// Constraints at some nodes: every combination of components, each component following one of the motions.
fn constrained(nodes: usize) -> Body {
    let rest = [[RestPoint { inverse_jacobian: [0.0; 9], weight: 1.0 }]].into_iter().collect();
    let elements = [[0, 0, 0, nodes as u32 - 1]].into_iter().collect();
    let mut body = body(elements, &rest, vec![], &mut Rng::new(0));
    (body.elements, body.rest) = Default::default();
    let components = (0..nodes as u32).flat_map(|n| (0..3u8).map(move |c| (n, c)));
    let imposed = components.filter(|(n, c)| ((n % 9) >> c) & 1 == 1);
    let constraint = |(motion, (node, component))| Constraint { node, component, motion: motion % MOTIONS.len() };
    body.constraints = imposed.enumerate().map(constraint).collect();
    body.motions = MOTIONS.iter().map(|&m| History::constant(m)).collect();
    body
}

/// What a component's operation takes: x, d, the old y, and the motion that an imposed component follows.
struct Component {
    x: Bound,
    d: Bound,
    y: Bound,
    motion: Option<f64>,
}

/// An operation y = f(x, d, y).
struct Operation {
    name: &'static str,
    run: fn(&GpuBackend, &GpuVector, &GpuVector, &mut GpuVector),
    exact: fn(&Component) -> Bound,
}

fn number(x: f64) -> Bound {
    Bound::exact(x)
}

const OPERATIONS: [Operation; 11] = [
    Operation { name: "copy", run: |b, x, _, y| b.copy(x, y), exact: |c| c.x },
    Operation { name: "clear", run: |b, _, _, y| b.clear(y), exact: |_| number(0.0) },
    Operation { name: "axpy", run: |b, x, _, y| b.axpy(A, x, y), exact: |c| c.y + number(A) * c.x },
    Operation { name: "xpby", run: |b, x, _, y| b.xpby(x, A, y), exact: |c| c.x + number(A) * c.y },
    Operation { name: "scale", run: |b, _, _, y| b.scale(A, y), exact: |c| number(A) * c.y },
    Operation {
        name: "multiply_add",
        run: |b, x, d, y| b.multiply_add(A, d, x, y),
        exact: |c| c.y + number(A) * (c.d * c.x),
    },
    Operation { name: "divide", run: |b, x, d, y| b.divide(x, d, y), exact: |c| c.x / c.d },
    Operation {
        name: "project",
        run: |b, _, _, y| b.project(y),
        exact: |c| if c.motion.is_some() { number(0.0) } else { c.y },
    },
    Operation { name: "impose", run: |b, _, _, y| b.impose(&MOTIONS, y), exact: |c| c.motion.map_or(c.y, number) },
    Operation {
        name: "impose_change",
        run: |b, x, _, y| b.impose_change(&MOTIONS, x, y),
        exact: |c| c.motion.map_or(c.y, |m| number(m) - c.x),
    },
    Operation {
        name: "make_positive",
        run: |b, _, _, y| b.make_positive(y),
        exact: |c| number(if c.y.value == 0.0 { 1.0 } else { c.y.value.abs() }),
    },
];

/// A backend, random vectors x and y, and d without small components; y has zeros.
struct Case {
    backend: GpuBackend,
    body: Body,
    x: Vector,
    d: Vector,
    y: Vector,
}

impl Case {
    fn new(gpu: &Arc<Gpu>, nodes: usize) -> Self {
        let mut rng = Rng::new(nodes as u64);
        let body = constrained(nodes);
        let backend = GpuBackend::new(Arc::clone(gpu), &body, GpuOptions::default()).expect("the body is small");
        let [x, mut d, mut y] = [0; 3].map(|_| vectors(nodes, 2.0, &mut rng));
        d.as_flattened_mut().iter_mut().for_each(|d| *d += 0.5_f64.copysign(*d));
        d.iter_mut().flatten().for_each(|d| *d = f64::from(*d as f32));
        y.as_flattened_mut().iter_mut().step_by(7).for_each(|y| *y = 0.0);
        Self { backend, body, x, d, y }
    }

    /// The operands of each component.
    fn components(&self) -> Vec<Component> {
        let at = |v: &Vector, k: usize| number(v.as_flattened()[k]);
        let operands =
            |k| Component { x: at(&self.x, k), d: at(&self.d, k), y: at(&self.y, k), motion: self.motion(k) };
        (0..3 * self.x.len()).map(operands).collect()
    }

    fn motion(&self, k: usize) -> Option<f64> {
        let (all, component) = (&self.body.constraints, ((k / 3) as u32, (k % 3) as u8));
        let place = all.binary_search_by_key(&component, |c| (c.node, c.component));
        place.ok().map(|place| MOTIONS[all[place].motion])
    }

    fn compare(&self, what: &str, found: &GpuVector, bounds: &[Bound]) {
        let what = format!("{what}, {} nodes", self.x.len());
        let wanted: Vec<f64> = bounds.iter().map(|b| b.value).collect();
        compare(&what, self.backend.download(found).as_flattened(), &wanted, bounds);
    }

    /// The same, and again with imposed components projected out: the vector has kept its mask.
    fn compare_with_mask(&self, what: &str, found: &mut GpuVector, mut bounds: Vec<Bound>) {
        self.compare(what, found, &bounds);
        self.backend.project(found);
        (0..bounds.len()).filter(|&k| self.motion(k).is_some()).for_each(|k| bounds[k] = number(0.0));
        self.compare(&format!("{what}, projected"), found, &bounds);
    }

    /// The sum of x_i y_i on a device: a term is rounded as a product, meets two others of its node, halves of its
    /// group, and `more` roundings of the sum of groups.
    fn dot(&self, x: &[f64], y: &[f64], more: f64) -> Bound {
        let terms = || x.iter().zip(y).map(|(x, y)| x * y);
        Bound::new(terms().sum(), (1.0 + 2.0 + 8.0 + more) * terms().map(f64::abs).sum::<f64>())
    }
}

#[test]
fn operations_are_those_of_f64_rounded_and_keep_masks() {
    let Some(gpu) = test_device() else { return };
    for case in NODES.map(|nodes| Case::new(&gpu, nodes)) {
        let b = &case.backend;
        let (x, d) = (b.upload(&case.x), b.upload(&case.d));
        let components = case.components();
        for Operation { name, run, exact } in OPERATIONS {
            let mut y = b.upload(&case.y);
            run(b, &x, &d, &mut y);
            case.compare_with_mask(name, &mut y, components.iter().map(exact).collect());
        }
        assert_eq!(b.download(&x), case.x, "x is only read");
        assert_eq!(b.download(&d), case.d, "d is only read");
        assert_eq!(b.download(&b.zeros()), vec![[0.0; 3]; case.x.len()]);
        b.check().expect("the device works");
    }
}

/// Motions of several impositions travel with one submission, each with its own values; and beyond what one takes.
#[test]
fn impositions_in_one_submission_have_their_own_values() {
    let Some(gpu) = test_device() else { return };
    let case = Case::new(&gpu, 100);
    for impositions in [3, 700] {
        let b = &case.backend;
        let all: Vec<f64> = (0..impositions).map(f64::from).collect();
        let vectors: Vec<GpuVector> = all
            .iter()
            .map(|&k| {
                let mut y = b.zeros();
                b.impose(&MOTIONS.map(|m| m + k), &mut y);
                y
            })
            .collect();
        for (k, y) in all.iter().zip(&vectors) {
            let wanted: Vec<f64> = (0..300).map(|i| case.motion(i).map_or(0.0, |m| m + k)).collect();
            assert_eq!(b.download(y).as_flattened(), wanted, "imposition {k} of {impositions}");
        }
    }
}

#[test]
fn scalar_products_and_maxima() {
    let Some(gpu) = test_device() else { return };
    for case in NODES.map(|nodes| Case::new(&gpu, nodes)) {
        let b = &case.backend;
        let (x, y, what) = (b.upload(&case.x), b.upload(&case.y), format!("x . y, {} nodes", case.x.len()));
        let groups = case.x.len().div_ceil(256) as f64;
        let exact = |more| case.dot(case.x.as_flattened(), case.y.as_flattened(), more);
        // The scale of terms that cancel is not the sum's: no check of usefulness.
        let check = |found: f64, bound: Bound| {
            assert!((found - bound.value).abs() <= bound.bound(SINGLE), "{what}: {found} against {bound:?}");
        };
        check(b.dot(&x, &y), exact(0.0));
        let before: [f64; REGISTERS] = std::array::from_fn(|k| k as f64);
        let mut registers = b.registers(before);
        b.dot_to(&x, &y, &mut registers, 5);
        let after = b.read(&registers);
        check(after[5], exact(groups + 8.0));
        (0..REGISTERS).filter(|&k| k != 5).for_each(|k| assert_eq!(after[k], before[k], "register {k}"));
        b.load([0.5; REGISTERS], &mut registers);
        assert_eq!(b.read(&registers), [0.5; REGISTERS]);

        let largest = case.x.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
        assert_eq!(b.max_abs(&x), largest);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for place in [0, 3 * case.x.len() - 1] {
                let mut x = case.x.clone();
                x.as_flattened_mut()[place] = bad;
                assert_eq!(b.max_abs(&b.upload(&x)), f64::INFINITY, "{bad} at {place}");
            }
        }
    }
}

/// Arithmetic and a choice, on a sum.
struct Recurrence;

impl Update for Recurrence {
    const SUMS: bool = true;
    fn apply<S: Scalar>(s: &mut [S; REGISTERS]) {
        s[8] = s[SUM];
        s[9] = (s[9] + s[10]) * s[11] / (s[10] - s[11]);
        s[12] = S::select_greater(s[10], s[11], s[12], S::number(-0.1));
        s[13] = S::select_greater(s[11], s[10], s[13], S::number(1e-30));
    }
}

#[test]
fn a_descent_a_turn_and_a_recurrence() {
    let Some(gpu) = test_device() else { return };
    for (case, running) in NODES.iter().flat_map(|&nodes| [1.0, 0.0].map(|on| (Case::new(&gpu, nodes), on))) {
        let b = &case.backend;
        let (d, q, preconditioner) = (b.upload(&case.x), b.upload(&case.y), b.upload(&case.d));
        let [mut x, mut r, mut z] = [&case.y, &case.d, &case.x].map(|v| b.upload(v));
        let mut values = [0.0; REGISTERS];
        (values[RUNNING], values[ALPHA], values[BETA]) = (running, A, 0.375);
        (values[9], values[10], values[11], values[12], values[13]) = (2.0, 0.75, 0.25, 7.0, 7.0);
        let mut registers = b.registers(values);
        let descent = Descent { d: &d, q: &q, preconditioner: &preconditioner, x: &mut x, r: &mut r, z: &mut z };
        b.descend(descent, &mut registers);
        b.update::<Recurrence>(&mut registers);
        let mut turned = b.upload(&case.x);
        b.turn(&z, &mut turned, &registers);

        let on = running > 0.0;
        let components = case.components();
        let residual = |c: &Component| if on { c.d - number(A) * c.y } else { c.d };
        let scaled = |c: &Component| if on { residual(c) / c.d } else { c.x };
        let each = |f: &dyn Fn(&Component) -> Bound| components.iter().map(f).collect::<Vec<_>>();
        let found = [&x, &r, &z, &turned].map(|v| b.download(v));
        for (name, vector, exact) in [
            ("x", &mut x, each(&|c| if on { c.y + number(A) * c.x } else { c.y })),
            ("r", &mut r, each(&residual)),
            ("z", &mut z, each(&scaled)),
            ("d", &mut turned, each(&|c| if on { scaled(c) + number(0.375) * c.x } else { c.x })),
        ] {
            case.compare_with_mask(name, vector, exact);
        }
        let after = b.read(&registers);
        let recurrence = (number(2.0) + number(0.75)) * number(0.25) / (number(0.75) - number(0.25));
        compare("a recurrence", &[after[9]], &[recurrence.value], &[recurrence]);
        assert_eq!([after[12], after[13]], [7.0, f64::from(1e-30f32)]);
        if on {
            let [_, r, z, _] = &found;
            let more = case.x.len().div_ceil(256) as f64 + 8.0;
            let sum = case.dot(r.as_flattened(), z.as_flattened(), more);
            assert!((after[8] - sum.value).abs() <= sum.bound(SINGLE), "r . z: {} against {sum:?}", after[8]);
        }
        b.check().expect("the device works");
    }
}

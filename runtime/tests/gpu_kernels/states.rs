//! Elements at random states, and what their kernels' f32 values may differ by from the f64 values.
//!
//! All inputs are numbers of f32, which both precisions take alike: what differs is the rounding of the kernels alone.
//! Its bound is found by interpreting the derivation from which the kernels were printed, with WGSL's accuracies.

use std::collections::HashMap;

use tensormass_kernels::GENERATED;
use tensormass_kernels::RestPoint;
use tensormass_runtime::body::{Body, LawBatch};
use tensormass_runtime::mesh::{Mesh, shape_gradients};
use tensormass_runtime::{LawEntry, laws};
use tensormass_testing::codegen::derivation::Derivation;
use tensormass_testing::codegen::element::{ElementKernels, kernels, tetrahedron_p1};
use tensormass_testing::codegen::ir::{Input, Output};
use tensormass_testing::derivation;
use tensormass_testing::random::Rng;
use tensormass_testing::rounding::{Bounded, SINGLE, Wgsl};

/// Bounds above this part of the values, on average, would prove nothing. Textbook energies lose half the digits of f32.
const USEFUL: f64 = 1.0 / 64.0;

/// A number as WGSL computes it.
pub type Bound = Bounded<Wgsl>;
/// Three components a node.
pub type Vector = Vec<[f64; 3]>;

/// The nearest number of f32.
pub fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

/// Random vectors of numbers of f32, with components up to a magnitude.
pub fn vectors(count: usize, magnitude: f64, rng: &mut Rng) -> Vector {
    (0..count).map(|_| [0; 3].map(|_| single(rng.uniform(-magnitude, magnitude)))).collect()
}

/// A body without supports and loads, with random masses; rest data and constants become numbers of f32.
pub fn body(elements: Vec<[u32; 4]>, rest: &[RestPoint<f64>], batches: Vec<LawBatch>, rng: &mut Rng) -> Body {
    let round =
        |r: &RestPoint<f64>| RestPoint { inverse_jacobian: r.inverse_jacobian.map(single), weight: single(r.weight) };
    let nodes = elements.iter().flatten().max().map_or(0, |n| *n as usize + 1);
    Body {
        rest: rest.iter().map(|r| [round(r)]).collect(),
        batches,
        masses: (0..nodes).map(|_| single(rng.uniform(0.5, 2.0))).collect(),
        element_masses: vec![1.0; elements.len()],
        constraints: vec![],
        motions: vec![],
        loads: vec![],
        mass_damping: 0.0,
        stiffness_damping: 0.0,
        diameter: 1.0,
        volume: rest.iter().map(|r| r.weight).sum(),
        elements: elements.into_iter().collect(),
    }
}

/// Two batches a law, one with a material for all elements and one with a material each; elements are dealt out in turn.
pub fn batches(laws: &[&'static LawEntry], elements: usize, rng: &mut Rng) -> Vec<LawBatch> {
    let count = 2 * laws.len();
    let mut batch = |k: usize| {
        let law = laws[k / 2];
        let (elements, per_element) = ((k as u32..elements as u32).step_by(count).collect::<Vec<_>>(), k % 2 == 1);
        let materials = if per_element { elements.len() } else { 1 };
        let material = |_| law.constants(&rng.parameters(law.info));
        let constants = (0..materials).flat_map(material).map(single).collect();
        LawBatch { law, element: tensormass_kernels::linear_tetrahedron(), elements, constants, per_element }
    };
    (0..count).map(&mut batch).collect()
}

/// The rest data of a mesh.
pub fn rest(mesh: &Mesh) -> Vec<RestPoint<f64>> {
    mesh.elements().map(|e| rest_element(mesh.shape_gradients(e))).collect()
}

fn rest_element(g: tensormass_runtime::mesh::ShapeGradients) -> RestPoint<f64> {
    let rows = g.gradients.as_flattened();
    RestPoint { inverse_jacobian: std::array::from_fn(|k| rows[k]), weight: g.volume }
}

/// Elements that share no node: a node's sum is one slot.
pub struct Disjoint {
    /// The body.
    pub body: Body,
    /// Displacements inside the laws' domains.
    pub u: Vector,
    /// Their increments.
    pub du: Vector,
}

impl Disjoint {
    /// Elements of random shape and size, strained by 1e-3 to 0.3, turned, and moved by up to ten times their size.
    pub fn new(laws: &[&'static LawEntry], count: usize, analysis: &Analysis, rng: &mut Rng) -> Self {
        let elements: Vec<[u32; 4]> = (0..count as u32).map(|e| [0, 1, 2, 3].map(|k| 4 * e + k)).collect();
        let corners: Vec<[[f64; 3]; 4]> = (0..count).map(|_| tetrahedron(rng)).collect();
        let rest: Vec<RestPoint<f64>> = corners.iter().map(|c| rest_element(shape_gradients(c))).collect();
        let batches = batches(laws, count, rng);
        let body = body(elements, &rest, batches, rng);
        let mut all = Self { body, u: vec![[0.0; 3]; 4 * count], du: vec![[0.0; 3]; 4 * count] };
        for batch in &all.body.batches {
            for (place, &e) in batch.elements.iter().enumerate() {
                let nodes = 4 * e as usize..4 * e as usize + 4;
                let direction = rng.direction();
                all.du[nodes.clone()].copy_from_slice(&moved(&direction, &corners[e as usize], rng));
                let mut strain = 10f64.powf(rng.uniform(-3.0, 0.3f64.log10()));
                loop {
                    let g = rng.gradient(1.0 - strain, 1.0 + strain);
                    all.u[nodes.clone()].copy_from_slice(&moved(&g, &corners[e as usize], rng));
                    if analysis.inside(&all.body, batch, place, &all.u) {
                        break;
                    }
                    strain *= 0.5;
                    assert!(strain > 1e-12, "{}: no state is inside the domain", batch.law.info.name);
                }
            }
        }
        all
    }
}

/// The corners of a tetrahedron of random shape and size, not flat, node 0 at the origin.
fn tetrahedron(rng: &mut Rng) -> [[f64; 3]; 4] {
    loop {
        let (size, edges) = (2f64.powf(rng.uniform(-2.0, 2.0)), rng.direction());
        let corners = std::array::from_fn(|n| match n {
            0 => [0.0; 3],
            n => std::array::from_fn(|i| size * (f64::from(u8::from(i == n - 1)) + 0.5 * edges[3 * (n - 1) + i])),
        });
        if shape_gradients(&corners).volume > 0.05 * size.powi(3) {
            return corners;
        }
    }
}

/// G x + a translation, for each corner x, rounded to f32.
fn moved(g: &[f64; 9], corners: &[[f64; 3]; 4], rng: &mut Rng) -> [[f64; 3]; 4] {
    let size = corners[1].iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let by = [0; 3].map(|_| rng.uniform(-10.0, 10.0) * size);
    corners.map(|x| std::array::from_fn(|i| single(by[i] + (0..3).map(|k| g[3 * i + k] * x[k]).sum::<f64>())))
}

/// What a law's kernels compute of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// Strain energy: 1 number.
    Energy,
    /// Forces at the nodes: 12 numbers.
    Force,
    /// Force differentials at the nodes: 12 numbers.
    DForce,
    /// The tangent's diagonal at the nodes: 12 numbers.
    Diagonal,
    /// Cauchy stress: 9 numbers.
    Cauchy,
    /// Damping forces at the nodes, the increment as velocity: 12 numbers.
    Damping,
    /// Their differentials at that velocity in its direction: 12 numbers.
    DDamping,
    /// Minus their diagonal at that velocity: 12 numbers.
    DampingDiagonal,
}

impl Kernel {
    /// Whether a law has it.
    pub fn is_of(self, law: &LawEntry) -> bool {
        let damps = matches!(self, Kernel::Damping | Kernel::DDamping | Kernel::DampingDiagonal);
        law.damping.is_some() || !damps
    }
}

/// Every kernel.
pub const KERNELS: [Kernel; 8] = [
    Kernel::Energy,
    Kernel::Force,
    Kernel::DForce,
    Kernel::Diagonal,
    Kernel::Cauchy,
    Kernel::Damping,
    Kernel::DDamping,
    Kernel::DampingDiagonal,
];

/// The derivations of all laws, to be interpreted.
pub struct Analysis {
    derivations: HashMap<&'static str, Derivation>,
    element: ElementKernels,
}

impl Analysis {
    /// Reads the derivation of every law of the build.
    pub fn new() -> Self {
        let read = |law: &LawEntry| (law.info.name, derivation(GENERATED, law.info.name));
        let element = kernels(&tetrahedron_p1()).expect("the linear tetrahedron is an element");
        Self { derivations: laws().iter().map(read).collect(), element }
    }

    /// Interprets a point kernel; the outputs by role.
    fn point(&self, law: &str, kernel: &str, inputs: &[(Input, &[Bound])]) -> Vec<(Output, Vec<Bound>)> {
        let kernel = self.derivations[law].point(kernel);
        let values = kernel.interpret(inputs).expect("the inputs of a point kernel");
        kernel.outputs().map(|(role, _)| *role).zip(values).collect()
    }

    fn gradient(&self, nodes: &[u32], u: &[[f64; 3]], shape: &[Bound]) -> Vec<Bound> {
        let nodal: Vec<Bound> = nodes.iter().flat_map(|n| u[*n as usize]).map(Bound::exact).collect();
        let inputs = [(Input::NodalDisplacement, nodal.as_slice()), (Input::ShapeGradients, shape)];
        self.element.gradient.interpret(&inputs).expect("the inputs of a gather").remove(0)
    }

    fn inside(&self, body: &Body, batch: &LawBatch, place: usize, u: &[[f64; 3]]) -> bool {
        let (c, shape, _) = given(body, batch, place);
        let g = self.gradient(&body.elements[batch.elements[place] as usize], u, &shape);
        let inputs = [(Input::Constants, c.as_slice()), (Input::DisplacementGradient, g.as_slice())];
        let outputs = self.point(batch.law.info.name, "force", &inputs);
        outputs.iter().all(|(role, margin)| *role != Output::DomainMargin || margin[0].value > margin[0].bound(SINGLE))
    }

    /// The numbers that a kernel computes of the element in this place of a batch.
    pub fn element(
        &self,
        kernel: Kernel,
        body: &Body,
        (batch, place): (&LawBatch, usize),
        u: &[[f64; 3]],
        du: &[[f64; 3]],
    ) -> Vec<Bound> {
        let (c, shape, volume) = given(body, batch, place);
        let nodes = &body.elements[batch.elements[place] as usize];
        let g = self.gradient(nodes, u, &shape);
        let mut inputs = vec![(Input::Constants, c.as_slice()), (Input::DisplacementGradient, g.as_slice())];
        let law = batch.law.info.name;
        let first = |kernel, inputs: &[_]| self.point(law, kernel, inputs).remove(0).1;
        let contract = |stress: Vec<Bound>| {
            let inputs = [
                (Input::StressIn, stress.as_slice()),
                (Input::ShapeGradients, shape.as_slice()),
                (Input::Weight, &[volume]),
            ];
            self.element.contract.interpret(&inputs).expect("the inputs of a contraction").remove(0)
        };
        let rate = self.gradient(nodes, du, &shape);
        if matches!(kernel, Kernel::Damping | Kernel::DDamping | Kernel::DampingDiagonal) {
            inputs.push((Input::GradientRate, rate.as_slice()));
        }
        match kernel {
            Kernel::Energy => vec![first("energy", &inputs)[0] * volume],
            Kernel::Damping => contract(first("damping", &inputs)),
            Kernel::DDamping => {
                inputs.push((Input::GradientIncrement, rate.as_slice()));
                contract(first("ddamping", &inputs))
            }
            Kernel::Force => contract(first("force", &inputs)),
            Kernel::DForce => {
                let dg = self.gradient(nodes, du, &shape);
                inputs.push((Input::GradientIncrement, dg.as_slice()));
                contract(first("dforce", &inputs))
            }
            Kernel::Diagonal | Kernel::DampingDiagonal => {
                let name = if kernel == Kernel::Diagonal { "diagonal" } else { "damping_diagonal" };
                let shape = [(Input::ShapeGradients, shape.as_slice())];
                let n = self.element.node_gradients.interpret(&shape).expect("shape gradients").remove(0);
                let node = |n| {
                    let mut inputs = inputs.clone();
                    inputs.push((Input::NodeGradient, n));
                    first(name, &inputs).into_iter().map(|d| volume * d)
                };
                n.chunks(3).flat_map(node).collect()
            }
            Kernel::Cauchy => first("cauchy", &inputs),
        }
    }

    /// The numbers of all elements of a batch, element after element.
    pub fn batch(&self, kernel: Kernel, body: &Body, batch: &LawBatch, u: &[[f64; 3]], du: &[[f64; 3]]) -> Vec<Bound> {
        (0..batch.elements.len()).flat_map(|place| self.element(kernel, body, (batch, place), u, du)).collect()
    }
}

/// Constants, shape gradients and volume of the element in this place of a batch.
fn given(body: &Body, batch: &LawBatch, place: usize) -> (Vec<Bound>, Vec<Bound>, Bound) {
    let count = batch.law.info.constants.len();
    let first = if batch.per_element { place * count } else { 0 };
    let rest = &body.rest[batch.elements[place] as usize][0];
    let exact = |x: &[f64]| x.iter().copied().map(Bound::exact).collect::<Vec<_>>();
    (exact(&batch.constants[first..first + count]), exact(&rest.inverse_jacobian), Bound::exact(rest.weight))
}

/// The greatest |found - wanted| as a part of its bound, which it must not exceed.
///
/// # Panics
/// A difference is beyond its bound, or beyond what would prove nothing: running bounds of rotations, which do not know
/// that the results are the same in any frame, may be.
pub fn compare(what: &str, found: &[f64], wanted: &[f64], bounds: &[Bound]) -> f64 {
    assert_eq!([found.len(), wanted.len()], [bounds.len(); 2], "{what}: numbers");
    let total: f64 = wanted.iter().map(|x| x.abs()).sum();
    let useful = USEFUL * total / wanted.len() as f64;
    let mut worst = 0.0f64;
    for (k, bound) in bounds.iter().enumerate() {
        let (difference, bound) = ((found[k] - wanted[k]).abs(), bound.bound(SINGLE).min(useful));
        // So that NaN fails.
        assert!(difference <= bound, "{what}, number {k}: {} against {}, bound {bound:e}", found[k], wanted[k]);
        worst = worst.max(if difference > 0.0 { difference / bound } else { 0.0 });
    }
    worst
}

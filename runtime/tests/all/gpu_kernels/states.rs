//! Elements at random states, and what their kernels' f32 values may differ by from the f64 values.
//!
//! All inputs are numbers of f32, which both precisions take alike: what differs is the rounding of the kernels alone.
//! Its bound is found by interpreting the derivation from which the kernels were printed, with WGSL's accuracies.

use std::collections::HashMap;

use tensormass_kernels::{ElementEntry, GENERATED, RestPoint, elements};
use tensormass_runtime::body::{Body, LawBatch, Rows};
use tensormass_runtime::mesh::{Block, Groups, Mesh, NodeId};
use tensormass_runtime::order::DeviceOrder;
use tensormass_runtime::strips::reordered;
use tensormass_runtime::{LawEntry, laws};
use tensormass_testing::codegen::derivation::Derivation;
use tensormass_testing::codegen::element::{ElementKernels, declarations, kernels};
use tensormass_testing::codegen::ir::{Input, Output, ValidKernel};
use tensormass_testing::derivation;
use tensormass_testing::random::Rng;
use tensormass_testing::rounding::{Bounded, SINGLE, Wgsl};

/// What is computed of an element; damping takes the increment as velocity, and its differential is in that direction.
pub use tensormass_kernels::shader::{PASSES, Pass as Kernel};

/// Bounds above this part of the values, on average, would prove nothing. Textbook energies lose half the digits of f32.
const USEFUL: f64 = 1.0 / 64.0;

/// The elements of which bodies can be made, but the linear tetrahedron, which has tests of its own.
pub fn other_elements() -> impl Iterator<Item = &'static ElementEntry> {
    elements().iter().filter(|e| e.info.dimension > 1 && !e.info.is_linear_simplex)
}

/// The greatest strain of laws that are tested by themselves.
pub const STRAIN: f64 = 0.3;

/// Of the laws whose functions take and give the same, which is all that passes know of them, that with the fewest
/// operations.
pub fn representatives() -> Vec<&'static LawEntry> {
    let mut chosen: Vec<&'static LawEntry> = vec![];
    let operations = |law: &LawEntry| law.info.operations.iter().map(|o| o.arithmetic()).sum::<u32>();
    let signature = |law: &LawEntry| PASSES.map(|pass| pass.function(law).map(|f| (f.arguments, f.field)));
    for law in laws() {
        match chosen.iter_mut().find(|other| signature(other) == signature(law)) {
            None => chosen.push(law),
            Some(other) if operations(law) < operations(other) => *other = law,
            Some(_) => {}
        }
    }
    chosen
}

/// Of these one with a dissipation and one without, for what is the same of all laws: drivers take a second for a kernel.
pub fn two_laws() -> Vec<&'static LawEntry> {
    let all = representatives();
    [true, false]
        .into_iter()
        .filter_map(|damped| all.iter().copied().find(|law| law.damping.is_some() == damped))
        .collect()
}

/// Sizes of work groups, and how many elements an invocation computes: each of both twice.
pub const DEALT: [(u32, u32); 8] = [(32, 1), (32, 7), (64, 2), (64, 1), (128, 3), (128, 2), (256, 7), (256, 3)];

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
pub fn body(elements: Rows<u32>, rest: &Rows<RestPoint<f64>>, batches: Vec<LawBatch>, rng: &mut Rng) -> Body {
    let round =
        |r: &RestPoint<f64>| RestPoint { inverse_jacobian: r.inverse_jacobian.map(single), weight: single(r.weight) };
    let nodes = elements.values().iter().max().map_or(0, |n| *n as usize + 1);
    Body {
        rest: rest.iter().map(|r| r.iter().map(round).collect::<Vec<_>>()).collect(),
        batches,
        masses: (0..nodes).map(|_| single(rng.uniform(0.5, 2.0))).collect(),
        mass_matrix: None,
        element_masses: vec![1.0; elements.len()],
        constraints: vec![],
        motions: vec![],
        loads: vec![],
        pressures: vec![],
        contact: None,
        moves: true,
        mass_damping: 0.0,
        stiffness_damping: 0.0,
        diameter: 1.0,
        volume: rest.values().iter().map(|r| r.weight).sum(),
        elements,
    }
}

/// Which of a range of elements one of so many batches has.
pub type Dealt = fn(std::ops::Range<u32>, usize, usize) -> Vec<u32>;

/// One of each few.
pub fn in_turn(range: std::ops::Range<u32>, k: usize, count: usize) -> Vec<u32> {
    range.skip(k).step_by(count).collect()
}

/// A part in one piece.
pub fn in_pieces(range: std::ops::Range<u32>, k: usize, count: usize) -> Vec<u32> {
    let end = |k: usize| range.start + (range.len() * k / count) as u32;
    (end(k)..end(k + 1)).collect()
}

/// Two batches a law and kind, one with a material for all elements and one with a material each; elements of a kind are
/// dealt out in turn.
pub fn batches(laws: &[&'static LawEntry], mesh: &Mesh, dealt: Dealt, rng: &mut Rng) -> Vec<LawBatch> {
    let count = 2 * laws.len();
    let mut first = 0;
    let mut all = vec![];
    for block in mesh.blocks() {
        let end = first + block.len() as u32;
        for k in 0..count {
            let law = laws[k / 2];
            let (elements, per_element) = (dealt(first..end, k, count), k % 2 == 1);
            let materials = if per_element { elements.len() } else { 1 };
            let material = |_| law.constants(&rng.parameters(law.info));
            let constants = (0..materials).flat_map(material).map(single).collect();
            all.push(LawBatch { law, element: block.element, elements, constants, per_element });
        }
        first = end;
    }
    all
}

/// The elements of a mesh as a body has them.
pub fn of_mesh(mesh: &Mesh, batches: Vec<LawBatch>, rng: &mut Rng) -> Body {
    let elements = mesh.elements().map(|e| mesh.element_nodes(e).iter().map(|n| n.0)).collect();
    body(elements, &mesh.elements().map(|e| mesh.rest(e)).collect(), batches, rng)
}

/// Elements of one kind that share no node: a node's sum is one slot.
pub struct Disjoint {
    /// The body.
    pub body: Body,
    /// Positions of the nodes.
    pub nodes: Vector,
    /// Displacements inside the laws' domains.
    pub u: Vector,
    /// Their increments.
    pub du: Vector,
}

impl Disjoint {
    /// So many elements of random shape and size, strained by 1e-3 to what is given, turned, and moved by up to ten times
    /// their size.
    pub fn new(
        laws: &[&'static LawEntry],
        element: &'static ElementEntry,
        (count, strain): (usize, f64),
        analysis: &Analysis,
        rng: &mut Rng,
    ) -> Self {
        let each = element.info.nodes;
        let positions: Vector = (0..count).flat_map(|_| shape(element, rng)).collect();
        let block = Block { element, nodes: (0..(count * each) as u32).map(NodeId).collect() };
        let mesh = Mesh::new(positions, vec![block], Groups::default()).unwrap_or_else(|e| panic!("{e}"));
        let body = of_mesh(&mesh, batches(laws, &mesh, in_turn, rng), rng);
        let zero = vec![[0.0; 3]; count * each];
        let mut all = Self { body, nodes: mesh.nodes().to_vec(), u: zero.clone(), du: zero };
        for batch in &all.body.batches {
            for (place, &e) in batch.elements.iter().enumerate() {
                let nodes = each * e as usize..each * (e as usize + 1);
                let positions = &all.nodes[nodes.clone()];
                let plane = element.info.dimension == 2;
                all.du[nodes.clone()].copy_from_slice(&moved(&rng.direction(), positions, plane, rng));
                let mut strain = 10f64.powf(rng.uniform(-3.0, strain.log10()));
                loop {
                    let g = rng.gradient(1.0 - strain, 1.0 + strain);
                    all.u[nodes.clone()].copy_from_slice(&moved(&g, positions, plane, rng));
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

/// The nodes of an element of random shape and size, not flat, node 0 at the origin; edges and faces may be curved where
/// there are more nodes than corners of a simplex.
fn shape(element: &'static ElementEntry, rng: &mut Rng) -> Vector {
    let info = element.info;
    let jitter = if info.nodes > info.dimension + 1 { 0.04 } else { 0.0 };
    loop {
        let (size, turn) = (2f64.powf(rng.uniform(-2.0, 2.0)), rng.direction());
        let of = |x: &[f64; 3], rng: &mut Rng| -> [f64; 3] {
            std::array::from_fn(|i| {
                let turned: f64 = (0..info.dimension).map(|k| turn[3 * i + k] * x[k]).sum();
                let inside = i < info.dimension;
                if inside { size * (x[i] + 0.5 * turned + rng.uniform(-jitter, jitter)) } else { 0.0 }
            })
        };
        let all: Vector = info.reference.iter().map(|x| of(x, rng)).collect();
        let all: Vector = all.iter().map(|x| std::array::from_fn(|i| x[i] - all[0][i])).collect();
        let block = Block { element, nodes: (0..info.nodes as u32).map(NodeId).collect() };
        let Ok(mesh) = Mesh::new(all.clone(), vec![block], Groups::default()) else { continue };
        let rest = mesh.rest(mesh.elements().next().expect("one element"));
        let least = 0.3 * size.powi(info.dimension as i32);
        if rest.iter().zip(info.points).all(|(r, point)| r.weight > least * point.weight) {
            return all;
        }
    }
}

/// G x + a translation, for each node x, rounded to f32; nothing along z in the plane.
fn moved(g: &[f64; 9], nodes: &[[f64; 3]], plane: bool, rng: &mut Rng) -> Vector {
    let size = nodes[1].iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let by = [0; 3].map(|_| rng.uniform(-10.0, 10.0) * size);
    let at = |i: usize, x: &[f64; 3]| single(by[i] + (0..3).map(|k| g[3 * i + k] * x[k]).sum::<f64>());
    nodes.iter().map(|x| std::array::from_fn(|i| if plane && i == 2 { 0.0 } else { at(i, x) })).collect()
}

/// The derivations of all laws and the kernels of all elements, to be interpreted.
pub struct Analysis {
    derivations: HashMap<&'static str, Derivation>,
    elements: HashMap<String, ElementKernels>,
}

/// A quadrature point of an element: what kernels read of it.
struct Point {
    slopes: Vec<Bound>,
    inverse: Vec<Bound>,
    weight: Bound,
}

impl Point {
    /// An element's kernel at the point; its other input is a vector at each node, or a stress.
    fn run(&self, kernel: &ValidKernel, other: &[Bound]) -> Vec<Bound> {
        let input = |role: Input| match role {
            Input::ReferenceGradients => self.slopes.as_slice(),
            // Of a linear simplex they are one.
            Input::ShapeGradients | Input::InverseJacobian => self.inverse.as_slice(),
            Input::Weight => std::slice::from_ref(&self.weight),
            _ => other,
        };
        let inputs: Vec<_> = kernel.ir().inputs.iter().map(|&(role, _)| (role, input(role))).collect();
        kernel.interpret(&inputs).expect("the inputs of an element's kernel").remove(0)
    }
}

impl Analysis {
    /// Reads the derivation of every law of the build.
    pub fn new() -> Self {
        let read = |law: &LawEntry| (law.info.name, derivation(GENERATED, law.info.name));
        let declared = declarations().expect("the build has read them");
        let of = |d| (kernels(&d).expect("a declared element"), d.name);
        let elements = declared.into_iter().map(of).map(|(kernels, name)| (name, kernels));
        Self { derivations: laws().iter().map(read).collect(), elements: elements.collect() }
    }

    /// Interprets a point kernel; the outputs by role.
    fn point(&self, law: &str, kernel: &str, inputs: &[(Input, &[Bound])]) -> Vec<(Output, Vec<Bound>)> {
        let kernel = self.derivations[law].point(kernel);
        let values = kernel.interpret(inputs).expect("the inputs of a point kernel");
        kernel.outputs().map(|(role, _)| *role).zip(values).collect()
    }

    fn inside(&self, body: &Body, batch: &LawBatch, place: usize, u: &[[f64; 3]]) -> bool {
        let (c, points) = given(body, batch, place);
        let nodes = nodal(&body.elements[batch.elements[place] as usize], u);
        points.iter().all(|point| {
            let g = point.run(&self.elements[batch.element.info.name].gradient, &nodes);
            let inputs = [(Input::Constants, c.as_slice()), (Input::DisplacementGradient, g.as_slice())];
            let outputs = self.point(batch.law.info.name, "force", &inputs);
            let is_inside = |margin: &Bound| margin.value > margin.bound(SINGLE);
            outputs.iter().all(|(role, margin)| *role != Output::DomainMargin || is_inside(&margin[0]))
        })
    }

    /// The numbers that a kernel computes of the element in this place of a batch, with its nodes in the order of a strip.
    fn element(
        &self,
        kernel: Kernel,
        body: &Body,
        (batch, place, order): (&LawBatch, usize, Option<[u8; 4]>),
        u: &[[f64; 3]],
        du: &[[f64; 3]],
    ) -> Vec<Bound> {
        let (c, mut points) = given(body, batch, place);
        let mut nodes = body.elements[batch.elements[place] as usize].to_vec();
        if let Some(order) = order {
            nodes = order.iter().map(|n| nodes[usize::from(*n)]).collect();
            let rest = reordered(&body.rest[batch.elements[place] as usize][0], order);
            // A device has them in f32.
            points[0].inverse = rest.inverse_jacobian.into_iter().map(Bound::nearest).collect();
        }
        let nodes = [nodal(&nodes, u), nodal(&nodes, du)];
        let at = |point: &Point| self.at_point(kernel, batch, point, &c, &nodes);
        let sum = |a: Vec<Bound>, b: Vec<Bound>| a.into_iter().zip(b).map(|(a, b)| a + b).collect();
        let values = points.iter().map(at).reduce(sum).expect("an element has a point");
        if let (Some(order), 12) = (order, values.len()) {
            let mut by_node = values.clone();
            for (n, value) in order.iter().zip(values.chunks(3)) {
                by_node[3 * usize::from(*n)..][..3].copy_from_slice(value);
            }
            return by_node;
        }
        if kernel != Kernel::Cauchy || points.len() == 1 {
            return values;
        }
        let volume = points.iter().map(|point| point.weight).reduce(|a, b| a + b).expect("an element has a point");
        values.into_iter().map(|value| value / volume).collect()
    }

    /// A point's part of an element's numbers: of the stress of an element with several points, that times its weight.
    fn at_point(
        &self,
        kernel: Kernel,
        batch: &LawBatch,
        point: &Point,
        c: &[Bound],
        [u, du]: &[Vec<Bound>; 2],
    ) -> Vec<Bound> {
        let element = &self.elements[batch.element.info.name];
        let (g, rate) = (point.run(&element.gradient, u), point.run(&element.gradient, du));
        let mut inputs = vec![(Input::Constants, c), (Input::DisplacementGradient, g.as_slice())];
        let first = |kernel, inputs: &[_]| self.point(batch.law.info.name, kernel, inputs).remove(0).1;
        let contract = |stress: Vec<Bound>| point.run(&element.contract, &stress);
        if matches!(kernel, Kernel::Damping | Kernel::DDamping | Kernel::DampingDiagonal) {
            inputs.push((Input::GradientRate, rate.as_slice()));
        }
        match kernel {
            Kernel::Energy => vec![first("energy", &inputs)[0] * point.weight],
            Kernel::Damping => contract(first("damping", &inputs)),
            Kernel::Force => contract(first("force", &inputs)),
            Kernel::DForce | Kernel::DDamping => {
                let name = if kernel == Kernel::DForce { "dforce" } else { "ddamping" };
                inputs.push((Input::GradientIncrement, rate.as_slice()));
                contract(first(name, &inputs))
            }
            Kernel::Diagonal | Kernel::DampingDiagonal => {
                let name = if kernel == Kernel::Diagonal { "diagonal" } else { "damping_diagonal" };
                let node = |n| {
                    let mut inputs = inputs.clone();
                    inputs.push((Input::NodeGradient, n));
                    first(name, &inputs).into_iter().map(|d| point.weight * d)
                };
                point.run(&element.node_gradients, &[]).chunks(3).flat_map(node).collect()
            }
            Kernel::Cauchy => {
                let sigma = first("cauchy", &inputs);
                let single = batch.element.info.points.len() == 1;
                if single { sigma } else { sigma.into_iter().map(|s| s * point.weight).collect() }
            }
        }
    }

    /// The numbers of all elements of a batch, element after element.
    pub fn batch(&self, kernel: Kernel, body: &Body, batch: &LawBatch, u: &[[f64; 3]], du: &[[f64; 3]]) -> Vec<Bound> {
        let orders = orders(body, batch);
        let element =
            |(place, order): (usize, &Option<[u8; 4]>)| self.element(kernel, body, (batch, place, *order), u, du);
        orders.iter().enumerate().flat_map(element).collect()
    }
}

/// In which order a device has the nodes of each element of a batch, where that is a strip's.
fn orders(body: &Body, batch: &LawBatch) -> Vec<Option<[u8; 4]>> {
    let number = body.batches.iter().position(|other| std::ptr::eq(other, batch)).expect("a batch of the body");
    let mut orders = vec![None; batch.elements.len()];
    for strip in &DeviceOrder::of(body).elements[number].strips {
        for (place, member) in strip.iter().enumerate() {
            orders[member.element as usize] = Some(member.along(place));
        }
    }
    orders
}

fn nodal(nodes: &[u32], u: &[[f64; 3]]) -> Vec<Bound> {
    nodes.iter().flat_map(|n| u[*n as usize]).map(Bound::exact).collect()
}

/// Constants and quadrature points of the element in this place of a batch.
fn given(body: &Body, batch: &LawBatch, place: usize) -> (Vec<Bound>, Vec<Point>) {
    let (count, info) = (batch.law.info.constants.len(), batch.element.info);
    let first = if batch.per_element { place * count } else { 0 };
    let exact = |x: &[f64]| x.iter().copied().map(Bound::exact).collect::<Vec<_>>();
    let rest = &body.rest[batch.elements[place] as usize];
    let points = rest.iter().zip(info.points).map(|(rest, point)| {
        // A device has them in f32.
        let slopes = point.gradients[1..].iter().flat_map(|g| &g[..info.dimension]).copied().map(Bound::nearest);
        Point { slopes: slopes.collect(), inverse: exact(&rest.inverse_jacobian), weight: Bound::exact(rest.weight) }
    });
    (exact(&batch.constants[first..first + count]), points.collect())
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

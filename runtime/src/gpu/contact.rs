//! Contact on a GPU: one invocation a node of the surface, and the rule of [`crate::contact`] in its trace.
//!
//! A scene has kernels of its own, with the obstacles that it has: nothing is looked up, and what there is not costs nothing.

use std::rc::Rc;

use crate::backend::{Meeting, Scalar};
use crate::contact::{
    Contact, Move, NUMBERS, Nearest, Obstacle, Passage, Pose, Response, RigidMotion, SWEEPS, Shape, Surface, respond,
};
use crate::history::History;

use super::GpuBackend;
use super::backend::GpuVector;
use super::recorder::{Kernel, Memory};
use super::shaders::{Access, Argument, Frame, module, vector};
use super::trace::{self, Traced, components, define, function};

/// Contact of a body on a GPU.
#[derive(Debug)]
pub struct GpuContact {
    /// Where each node is at rest, and its place in vectors.
    nodes: Memory,
    count: usize,
    touch: Rc<Kernel>,
    touch_with_impulse: Rc<Kernel>,
    gap: Rc<Kernel>,
}

/// The bits of a position, and a place.
const NODES: Argument = ("nodes", "vec4<u32>", Access::Read);
const VALUES: Argument = ("values", "f32", Access::Read);

/// What a kernel with impulses binds after the uniform; without them, all but the last two.
fn arguments(impulse: bool) -> Vec<Argument> {
    let (u, v) = (vector("u", Access::Write), vector("v", Access::Write));
    let mut arguments = vec![NODES, VALUES, v, u];
    if impulse {
        arguments.extend([vector("masses", Access::Read), vector("impulse", Access::Write)]);
    }
    arguments
}

impl GpuContact {
    /// Contact on a backend.
    ///
    /// # Panics
    /// The device cannot bind as much as for a vector over the nodes, which it could.
    pub(super) fn new(backend: &GpuBackend, contact: &Contact) -> Self {
        let bits = |x: f64| (x as f32).to_bits();
        let each = contact.nodes.iter().zip(&contact.positions);
        let place = |node: &u32| backend.order().places[*node as usize];
        let nodes: Vec<[u32; 4]> = each.map(|(node, [x, y, z])| [bits(*x), bits(*y), bits(*z), place(node)]).collect();
        let kernel = |label: &str, text: &str, arguments: &[Argument]| backend.kernel(label, text, arguments);
        let tolerance = contact.tolerance(f64::from(f32::EPSILON) / 2.0);
        let touch =
            |impulse| kernel("contact", &touch_text(&contact.obstacles, tolerance, impulse), &arguments(impulse));
        Self {
            count: nodes.len(),
            nodes: backend.recorder().filled("nodes of the surface", &nodes).expect("fewer than nodes"),
            touch: touch(false),
            touch_with_impulse: touch(true),
            gap: kernel("gap", &gap_text(&contact.obstacles), &gap_arguments()),
        }
    }

    pub(super) fn touch(backend: &GpuBackend, meeting: Meeting<GpuBackend>) {
        let Meeting { contact, passages, h, masses, v, u, impulse } = meeting;
        let recorder = backend.recorder();
        let base = recorder.motions(&numbers(passages));
        let numbers = [contact.count as u32, 0, (h as f32).to_bits(), base];
        let mut storage = vec![&contact.nodes, recorder.values(), v.memory(), u.memory()];
        let mut kernel = &contact.touch;
        if let Some(impulse) = &impulse {
            storage.extend([masses.memory(), impulse.memory()]);
            kernel = &contact.touch_with_impulse;
        }
        backend.dispatch_each(kernel, numbers, &storage);
    }

    /// The least distance, where it is less than the limit.
    pub(super) fn gap(&self, backend: &GpuBackend, passages: &[Passage<f64>], limit: f64, u: &GpuVector) -> f64 {
        let base = backend.recorder().motions(&numbers(passages));
        let numbers = [self.count as u32, 0, (limit as f32).to_bits(), base];
        let storage = [&self.nodes, backend.recorder().values(), u.memory(), backend.partials()];
        let groups = backend.dispatch_each(&self.gap, numbers, &storage);
        let nearer = backend.recorder().read::<f32>(backend.partials(), (groups[0] * groups[1]) as usize);
        nearer.map_or(f64::NAN, |nearer| limit - f64::from(nearer.into_iter().fold(0.0, f32::max)))
    }
}

fn numbers(passages: &[Passage<f64>]) -> Vec<f64> {
    passages.iter().flat_map(Passage::numbers).collect()
}

fn gap_arguments() -> Vec<Argument> {
    vec![NODES, VALUES, vector("u", Access::Read), ("partials", "f32", Access::Write)]
}

/// The passage of an obstacle, whose numbers begin at `base`.
fn passage() -> Passage<Traced> {
    Passage::of(std::array::from_fn::<_, NUMBERS, _>(|k| define(&format!("values[base + {k}u]"))))
}

/// Obstacle k seen from a point of its frame: normal, and distance.
fn nearest_text(k: usize, obstacle: &Obstacle) -> String {
    function(&format!("fn nearest_{k}(x: vec3<f32>) -> vec4<f32>"), || {
        let Nearest { normal: [x, y, z], distance } = obstacle.shape.nearest(components("x"));
        trace::vector([x, y, z, distance])
    })
}

/// A call of it.
fn nearest(k: usize, x: [Traced; 3]) -> Nearest<Traced> {
    let seen = define(&format!("nearest_{k}({})", trace::vector(x)));
    let [x, y, z, distance] = components(&seen.to_string());
    Nearest { normal: [x, y, z], distance }
}

/// The pass over the nodes of the surface at the end of a step.
pub(super) fn touch_text(obstacles: &[Obstacle], tolerance: f64, impulse: bool) -> String {
    let mut text = "struct Response {\n    change: vec3<f32>,\n    push: vec3<f32>,\n}\n".to_string();
    let mut all = String::new();
    for (k, obstacle) in obstacles.iter().enumerate() {
        text += &nearest_text(k, obstacle);
        text += &function(&format!("fn obstacle_{k}(base: u32, start: vec3<f32>, by: vec3<f32>) -> Response"), || {
            let passage = passage();
            let seen = passage.seen(Move { from: components("start"), by: components("by") });
            let [sticking, sliding, tolerance] = [obstacle.sticking, obstacle.sliding, tolerance].map(Scalar::number);
            let Response { change, push } = respond(|x| nearest(k, x), seen, Surface { sticking, sliding, tolerance });
            let [change, push] = [change, push].map(|x| trace::vector(passage.outside(x)));
            format!("Response({change}, {push})")
        });
        all += &format!(
            "        {{
            let response = obstacle_{k}(numbers.base + {}u, start, by);
            change += free * response.change;
            let moved = free * (response.change + response.push);
            by += moved;
            met = met || any(moved != vec3<f32>(0.0f));
        }}\n",
            k * NUMBERS
        );
    }
    let impulses = if impulse {
        "    impulse[place] = vec4<f32>(impulse[place].xyz + masses[place].xyz * (change / numbers.a), impulse[place].w);\n"
    } else {
        ""
    };
    text += &format!(
        "fn each(i: u32) {{
    let place = nodes[i].w;
    let displacement = u[place];
    let velocity = v[place];
    let mask = vec3<u32>(u32(displacement.w)) & vec3<u32>(1u, 2u, 4u);
    let free = select(vec3<f32>(0.0f), vec3<f32>(1.0f), mask == vec3<u32>(0u));
    let step = numbers.a * velocity.xyz;
    let start = bitcast<vec3<f32>>(nodes[i].xyz) + (displacement.xyz - step);
    var by = step;
    var change = vec3<f32>(0.0f);
    for (var sweep = 0u; sweep < {SWEEPS}u; sweep++) {{
        var met = false;
{all}        if !met {{
            break;
        }}
    }}
    u[place] = vec4<f32>(displacement.xyz + (by - step), displacement.w);
    v[place] = vec4<f32>(velocity.xyz + change / numbers.a, velocity.w);
{impulses}}}
"
    );
    module("Contact.", &arguments(impulse), &text, Frame::Each)
}

/// The modules of a scene with an obstacle of each shape, for tests.
pub(super) fn samples() -> Vec<(String, String)> {
    let half = [0.5; 3];
    let shapes = [
        Shape::Plane,
        Shape::Capsule { half: 0.5, radius: 0.5 },
        Shape::Box { half },
        Shape::Cylinder { half: 0.5, radius: 0.5 },
    ];
    let obstacles = shapes.map(|shape| Obstacle {
        shape,
        rest: Pose { rotation: nalgebra::Rotation3::identity(), origin: nalgebra::Point3::origin() },
        motion: RigidMotion { translation: std::array::from_fn(|_| History::constant(0.0)), turn: None },
        sticking: 0.5,
        sliding: 0.4,
    });
    let touch = |impulse| touch_text(&obstacles, 1e-7, impulse);
    vec![
        ("contact".to_string(), touch(false)),
        ("contact with impulses".to_string(), touch(true)),
        ("gap".to_string(), gap_text(&obstacles)),
    ]
}

/// Partial maxima of how much nearer than the limit a node is.
pub(super) fn gap_text(obstacles: &[Obstacle]) -> String {
    let mut text = String::new();
    let mut all = String::new();
    for (k, obstacle) in obstacles.iter().enumerate() {
        text += &nearest_text(k, obstacle);
        text += &function(&format!("fn distance_{k}(base: u32, point: vec3<f32>) -> f32"), || {
            let local = passage().local(components("point"));
            nearest(k, local).distance.to_string()
        });
        all +=
            &format!("    nearer = max(nearer, numbers.a - distance_{k}(numbers.base + {}u, point));\n", k * NUMBERS);
    }
    text += &format!(
        "fn term(i: u32) -> f32 {{
    let point = bitcast<vec3<f32>>(nodes[i].xyz) + u[nodes[i].w].xyz;
    var nearer = 0.0f;
{all}    return nearer;
}}
"
    );
    module("Gap.", &gap_arguments(), &text, Frame::Greatest)
}

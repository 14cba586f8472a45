//! Contact on a GPU: one invocation a node of the surface, and the rule of [`crate::contact`] in its trace.
//!
//! A scene has kernels of its own, with the obstacles that it has: nothing is looked up, and what there is not costs nothing.

use std::cell::OnceCell;
use std::rc::Rc;

use crate::backend::{Meeting, Scalar};
use crate::contact::{
    Approach, Contact, Convex, Grid, Move, NUMBERS, Nearest, Obstacle, Passage, Pose, Response, RigidMotion, SWEEPS,
    Shape, Solid, Surface, at_end, further, respond, seen_before,
};
use crate::history::History;
use crate::inventory::names;

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
    /// The distances of all grids, if there are any.
    grids: Option<Memory>,
    count: usize,
    obstacles: Vec<Obstacle>,
    tolerance: f64,
    /// The pass without and with impulses, compiled when a step first needs it.
    touch: [OnceCell<Rc<Kernel>>; 2],
    /// That which measures the gap, likewise.
    gap: OnceCell<Rc<Kernel>>,
}

/// The bits of a position, and a place.
const NODES: Argument = ("nodes", "vec4<u32>", Access::Read);
const VALUES: Argument = ("values", "f32", Access::Read);

const GRIDS: Argument = ("grids", "f32", Access::Read);

/// What a kernel binds after the uniform: grids where an obstacle has one, and what impulses need.
fn arguments(obstacles: &[Obstacle], impulse: bool) -> Vec<Argument> {
    let (u, v) = (vector("u", Access::Write), vector("v", Access::Write));
    let mut arguments = vec![NODES, VALUES, v, u];
    arguments.extend(grids(obstacles).next().map(|_| GRIDS));
    if impulse {
        arguments.extend([vector("masses", Access::Read), vector("impulse", Access::Write)]);
    }
    arguments
}

/// The grids of those obstacles that have one.
fn grids(obstacles: &[Obstacle]) -> impl Iterator<Item = &Grid> {
    obstacles.iter().filter_map(|o| match &o.shape {
        Shape::Grid(grid) => Some(&**grid),
        Shape::Convex(_) | Shape::Solid(_) => None,
    })
}

impl GpuContact {
    /// Contact on a backend.
    ///
    /// # Panics
    /// The device cannot bind as much as for a vector over the nodes, which it could; or a surface of triangles has no grid.
    pub(super) fn new(backend: &GpuBackend, contact: &Contact) -> Self {
        let bits = |x: f64| (x as f32).to_bits();
        let each = contact.nodes.iter().zip(&contact.positions);
        let place = |node: &u32| backend.order().places[*node as usize];
        let nodes: Vec<[u32; 4]> = each.map(|(node, [x, y, z])| [bits(*x), bits(*y), bits(*z), place(node)]).collect();
        let obstacles = &contact.obstacles;
        let values: Vec<f32> = grids(obstacles).flat_map(|grid| grid.values()).copied().collect();
        let grids = (!values.is_empty()).then(|| backend.recorder().filled_or_failed(names::GRIDS, &values));
        Self {
            grids,
            count: nodes.len(),
            nodes: backend.recorder().filled(names::SURFACE, &nodes).expect("fewer than nodes"),
            obstacles: obstacles.clone(),
            tolerance: contact.tolerance(f64::from(f32::EPSILON) / 2.0),
            touch: Default::default(),
            gap: OnceCell::new(),
        }
    }

    pub(super) fn touch(backend: &GpuBackend, meeting: Meeting<GpuBackend>) {
        let Meeting { contact, passages, h, masses, v, u, impulse } = meeting;
        let recorder = backend.recorder();
        let base = recorder.motions(&numbers(passages));
        let numbers = [contact.count as u32, 0, (h as f32).to_bits(), base];
        let mut storage = vec![&contact.nodes, recorder.values(), v.memory(), u.memory()];
        storage.extend(&contact.grids);
        if let Some(impulse) = &impulse {
            storage.extend([masses.memory(), impulse.memory()]);
        }
        let wanted = impulse.is_some();
        let kernel = contact.touch[usize::from(wanted)].get_or_init(|| {
            let text = touch_text(&contact.obstacles, contact.tolerance, wanted);
            backend.kernel("contact", &text, &arguments(&contact.obstacles, wanted))
        });
        backend.dispatch_each(kernel, numbers, &storage);
    }

    /// The least distance, where it is less than the limit.
    pub(super) fn gap(&self, backend: &GpuBackend, passages: &[Passage<f64>], limit: f64, u: &GpuVector) -> f64 {
        let base = backend.recorder().motions(&numbers(passages));
        let numbers = [self.count as u32, 0, (limit as f32).to_bits(), base];
        let mut storage = vec![&self.nodes, backend.recorder().values(), u.memory(), backend.partials()];
        storage.extend(&self.grids);
        let text = || gap_text(&self.obstacles);
        let kernel = self.gap.get_or_init(|| backend.kernel("gap", &text(), &gap_arguments(&self.obstacles)));
        let groups = backend.dispatch_each(kernel, numbers, &storage);
        let nearer = backend.recorder().read::<f32>(backend.partials(), (groups[0] * groups[1]) as usize);
        nearer.map_or(f64::NAN, |nearer| limit - f64::from(nearer.into_iter().fold(0.0, f32::max)))
    }
}

fn numbers(passages: &[Passage<f64>]) -> Vec<f64> {
    passages.iter().flat_map(Passage::numbers).collect()
}

fn gap_arguments(obstacles: &[Obstacle]) -> Vec<Argument> {
    let mut arguments = vec![NODES, VALUES, vector("u", Access::Read), ("partials", "f32", Access::Write)];
    arguments.extend(grids(obstacles).next().map(|_| GRIDS));
    arguments
}

/// The passage of an obstacle, whose numbers begin at `base`.
fn passage() -> Passage<Traced> {
    Passage::of(std::array::from_fn::<_, NUMBERS, _>(|k| define(&format!("values[base + {k}u]"))))
}

/// Each obstacle, by its number, seen from a point of its frame: normal, and distance.
fn nearest_texts(obstacles: &[Obstacle]) -> String {
    let (mut text, mut before) = (String::new(), 0);
    for (k, obstacle) in obstacles.iter().enumerate() {
        text += &function(&format!("fn nearest_{k}(x: vec3<f32>) -> vec4<f32>"), || {
            let x = components("x");
            let Nearest { normal: [nx, ny, nz], distance } = match &obstacle.shape {
                Shape::Convex(shape) => shape.nearest(x),
                Shape::Grid(grid) => {
                    let seen = grid.nearest_by(x, |place| cell(grid, before, place));
                    before += grid.values().len();
                    seen
                }
                Shape::Solid(_) => panic!("a device has no triangles, but their distances on a grid"),
            };
            trace::vector([nx, ny, nz, distance])
        });
    }
    text
}

/// The cell of a grid, whose distances begin after some, at a place counted in cells: the place within it, and the distances at
/// its corners.
fn cell(grid: &Grid, before: usize, place: [Traced; 3]) -> ([Traced; 3], [Traced; 8]) {
    let [nx, ny, _] = grid.counts();
    let index: [Traced; 3] =
        std::array::from_fn(|i| define(&format!("min(u32(max({}, 0.0f)), {}u)", place[i], grid.counts()[i] - 2)));
    let [i, j, k] = index;
    let first = define(&format!("{before}u + {i} + {nx}u * ({j} + {ny}u * {k})"));
    let corner = |k: u32| (k & 1) + nx * (k >> 1 & 1) + nx * ny * (k >> 2);
    (
        std::array::from_fn(|i| define(&format!("{} - f32({})", place[i], index[i]))),
        std::array::from_fn(|k| define(&format!("grids[{first} + {}u]", corner(k as u32)))),
    )
}

/// A call of it.
fn nearest(k: usize, x: [Traced; 3]) -> Nearest<Traced> {
    let seen = define(&format!("nearest_{k}({})", trace::vector(x)));
    let [x, y, z, distance] = components(&seen.to_string());
    Nearest { normal: [x, y, z], distance }
}

/// What obstacle k does to a node: the arithmetic is [`crate::contact`]'s, and the path is followed as [`crate::contact::meets`]
/// does.
fn obstacle_text(k: usize, obstacle: &Obstacle, tolerance: f64) -> String {
    let approach = obstacle.shape.approach();
    let near = |text: &str| {
        let [x, y, z, distance] = components(text);
        Nearest { normal: [x, y, z], distance }
    };
    let four = |Nearest { normal: [x, y, z], distance }: Nearest<Traced>| trace::vector([x, y, z, distance]);
    let by = || components("by");
    let path = [
        function(&format!("fn start_{k}(base: u32, start: vec3<f32>) -> vec3<f32>"), || {
            trace::vector(passage().local(components("start")))
        }),
        function(&format!("fn way_{k}(base: u32, start: vec3<f32>, by: vec3<f32>) -> vec3<f32>"), || {
            trace::vector(passage().seen(Move { from: components("start"), by: by() }).by)
        }),
        function(&format!("fn further_{k}(seen: vec4<f32>, by: vec3<f32>, t: f32) -> f32"), || {
            further(approach, near("seen"), by(), define("t")).to_string()
        }),
        function(&format!("fn at_end_{k}(seen: vec4<f32>, by: vec3<f32>, t: f32) -> vec4<f32>"), || {
            four(at_end(near("seen"), by(), define("t")))
        }),
        function(&format!("fn seen_before_{k}(end: vec4<f32>, by: vec3<f32>, t: f32) -> vec4<f32>"), || {
            four(seen_before(near("end"), by(), define("t")))
        }),
        function(
            &format!("fn respond_{k}(base: u32, t: f32, seen: vec4<f32>, start: vec3<f32>, by: vec3<f32>) -> Response"),
            || {
                let passage = passage();
                let [sticking, sliding, tolerance] =
                    [obstacle.sticking, obstacle.sliding, tolerance].map(Scalar::number);
                let node = Move { from: components("start"), by: by() };
                let surface = Surface { sticking, sliding, tolerance };
                let Response { change, push } = respond((define("t"), near("seen")), node, surface);
                let [change, push] = [change, push].map(|x| trace::vector(passage.outside(x)));
                format!("Response({change}, {push})")
            },
        ),
    ];
    let hollows = match approach {
        Approach::Tangents => String::new(),
        Approach::Distances => format!(
            "    if at_end_{k}(seen, by, t).w >= 0.0f {{
        let end = nearest_{k}(first + by);
        if end.w < -tolerance {{
            seen = seen_before_{k}(end, by, t);
        }}
    }}\n"
        ),
    };
    let [from, way, further, at_end, seen_before, respond] = path;
    let between = match approach {
        Approach::Tangents => String::new(),
        Approach::Distances => at_end + &seen_before,
    };
    format!(
        "{from}{way}{further}{between}{respond}fn obstacle_{k}(base: u32, start: vec3<f32>, across: vec3<f32>) -> Response {{
    let tolerance = f32({:?}f);
    let first = start_{k}(base, start);
    let by = way_{k}(base, start, across);
    var seen = nearest_{k}(first);
    if seen.w > length(by) + tolerance {{
        return Response(vec3<f32>(0.0f), vec3<f32>(0.0f));
    }}
    var t = 0.0f;
    for (var step = 0u; step < {}u; step++) {{
        if seen.w <= tolerance || t >= 1.0f {{
            break;
        }}
        t = further_{k}(seen, by, t);
        seen = nearest_{k}(first + t * by);
    }}
{hollows}    return respond_{k}(base, t, seen, first, by);
}}\n",
        tolerance as f32,
        approach.steps(),
    )
}

/// The pass over the nodes of the surface at the end of a step.
pub(super) fn touch_text(obstacles: &[Obstacle], tolerance: f64, impulse: bool) -> String {
    let mut text = "struct Response {\n    change: vec3<f32>,\n    push: vec3<f32>,\n}\n".to_string();
    text += &nearest_texts(obstacles);
    let mut all = String::new();
    for (k, obstacle) in obstacles.iter().enumerate() {
        text += &obstacle_text(k, obstacle, tolerance);
        all += &format!(
            "        {{
            let response = obstacle_{k}(numbers.base + {base}u, start, by);
            change += free * response.change;
            let moved = free * (response.change + response.push);
            by += moved;
            met = met || any(moved != vec3<f32>(0.0f));
        }}\n",
            base = k * NUMBERS,
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
    module("Contact.", &arguments(obstacles, impulse), &text, Frame::Each)
}

/// The modules of a scene with an obstacle of each shape, for tests.
pub(super) fn samples() -> Vec<(String, String)> {
    let half = [0.5; 3];
    let convex = [
        Convex::Plane,
        Convex::Capsule { half: 0.5, radius: 0.5 },
        Convex::Box { half },
        Convex::Cylinder { half: 0.5, radius: 0.5 },
    ];
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let sides = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let solid = Solid::new(corners.into_iter(), sides, 8).expect("a tetrahedron");
    let shapes = convex.map(Shape::Convex).into_iter().chain([Shape::Grid(Grid::bake(&solid).into())]);
    let obstacles: Vec<Obstacle> = shapes
        .map(|shape| Obstacle {
            shape,
            rest: Pose { rotation: nalgebra::Rotation3::identity(), origin: nalgebra::Point3::origin() },
            motion: RigidMotion { translation: std::array::from_fn(|_| History::constant(0.0)), turn: None },
            sticking: 0.5,
            sliding: 0.4,
        })
        .collect();
    let touch = |impulse| touch_text(&obstacles, 1e-7, impulse);
    vec![
        ("contact".to_string(), touch(false)),
        ("contact with impulses".to_string(), touch(true)),
        ("gap".to_string(), gap_text(&obstacles)),
    ]
}

/// Partial maxima of how much nearer than the limit a node is.
pub(super) fn gap_text(obstacles: &[Obstacle]) -> String {
    let mut text = nearest_texts(obstacles);
    let mut all = String::new();
    for k in 0..obstacles.len() {
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
    module("Gap.", &gap_arguments(obstacles), &text, Frame::Greatest)
}

//! Throughput of kernels and steps on a device: what `tensormass bench` shows.
//!
//! Wall-clock times of whole operations, each waited for. Machines are shared and their clocks vary: compare figures of one
//! call only, as ratios. Operations and bytes are counted, not measured: the generator's operation counts, and what an
//! operation has to move at the least where nothing but a node's own vectors stays in a cache.

use std::time::Instant;

use rayon::prelude::*;
use tensormass_kernels::{ElementEntry, ElementInfo, LawEntry, ParameterInfo};

use crate::backend::{Backend, ForceField, LeftDomain, Operator};
use crate::body::Body;
use crate::cg::{CgLimits, ConjugateGradient};
use crate::cpu::{CpuBackend, CpuField, Precision};
use crate::device::DeviceError;
#[cfg(feature = "gpu")]
use crate::gpu::{GpuBackend, GpuField};
use crate::integrate::SemiImplicitEuler;
use crate::mesh::beam_of;
use crate::model::{BuildError, Model, build};
use crate::order::cluster_nodes;
use crate::plan::{operations, point_operations, tangent_operations};
use crate::scene::{self, SceneError};
use crate::system::{Integrator, SolveError, System};
use crate::target::Target;

/// Iterations of the linear solver in one of its figures.
pub const ITERATIONS: u32 = 50;
/// Numbers of each of the triad's three arrays: far more than a cache holds.
const TRIAD: usize = 1 << 23;

/// What is measured.
#[derive(Debug, Clone, Copy)]
pub struct Subject {
    /// The law.
    pub law: &'static LawEntry,
    /// What the beam is made of.
    pub element: &'static ElementEntry,
    /// Cells of the beam along x, y and z (see [`cells`]).
    pub cells: [usize; 3],
    /// Numbers of state and kernels.
    pub precision: scene::Precision,
    /// Times that an operation is repeated, at least 1.
    pub repeats: usize,
}

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The beam cannot be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The device is no good, or has failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The beam's small wave is outside the law's domain.
    #[error(transparent)]
    LeftDomain(#[from] LeftDomain),
    /// A step failed.
    #[error(transparent)]
    Step(#[from] SolveError),
    /// The threads cannot be started.
    #[error("{threads} threads cannot be started: {reason}; ask for fewer")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system said.
        reason: String,
    },
}

impl From<SceneError> for MeasureError {
    fn from(error: SceneError) -> Self {
        Self::Build(error.into())
    }
}

/// Times of one operation over all elements; bodies that fit into a cache move less through memory than what is counted.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// What was done.
    pub operation: &'static str,
    /// Seconds of each repetition, ascending.
    pub seconds: Vec<f64>,
    /// How often each element is computed in it.
    pub times: u32,
    /// Additions, multiplications and divisions an element; none where an operation is more than element kernels.
    pub flops: Option<u32>,
    /// Bytes that an element has to move, at least; none as above.
    pub bytes: Option<f64>,
}

impl Timing {
    /// Elements a second, in the median time.
    pub fn rate(&self, elements: usize) -> f64 {
        f64::from(self.times) * elements as f64 / self.median()
    }

    /// The median time in seconds.
    pub fn median(&self) -> f64 {
        self.seconds[self.seconds.len() / 2]
    }
}

/// What was measured of one subject.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Nodes of the beam.
    pub nodes: usize,
    /// Elements of the beam.
    pub elements: usize,
    /// Its operations.
    pub timings: Vec<Timing>,
}

/// Threads to measure on.
#[derive(Debug)]
pub struct Bench {
    pool: rayon::ThreadPool,
}

impl Bench {
    /// So many threads; all cores for 0.
    ///
    /// # Errors
    /// They cannot be started.
    pub fn new(threads: usize) -> Result<Self, MeasureError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map(|pool| Self { pool }).map_err(|e| MeasureError::Threads { threads, reason: e.to_string() })
    }

    /// How many there are.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// The machine's memory bandwidth in bytes/s, by a = b + 3 c over long arrays of f64: the best of a few.
    pub fn triad(&self) -> f64 {
        self.pool.install(triad)
    }

    /// Measures a subject on a device.
    ///
    /// # Errors
    /// See [`MeasureError`].
    pub fn measure(&self, target: &Target, subject: &Subject) -> Result<Measured, MeasureError> {
        self.pool.install(|| measure(target, subject))
    }
}

fn triad() -> f64 {
    let (mut a, b, c) = (vec![0.0_f64; TRIAD], vec![1.0_f64; TRIAD], vec![2.0_f64; TRIAD]);
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        a.par_chunks_mut(1 << 16).zip(b.par_chunks(1 << 16)).zip(c.par_chunks(1 << 16)).for_each(|((a, b), c)| {
            for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                *a = b + 3.0 * c;
            }
        });
        best = best.min(start.elapsed().as_secs_f64());
        std::hint::black_box(&mut a);
    }
    3.0 * 8.0 * TRIAD as f64 / best
}

/// A scene of a beam of 5 x 1 x 1 m, or of 5 x 1 m, of one law; parameters in the middle of their ranges where no default is
/// given.
pub fn scene_text(law: &LawEntry, element: &ElementInfo, cells: [usize; 3], precision: scene::Precision) -> String {
    let parameter = |p: &ParameterInfo| {
        let (low, high) = p.range;
        let middle = if low > 0.0 { (low * high).sqrt() } else { 0.5 * (low + high) };
        // The middle of a direction's components would be none.
        let value = p.default.map_or(if p.direction { 1.0 } else { middle }, |d| d[0]);
        let text = if p.len == 1 { format!("{value:?}") } else { format!("{:?}", vec![value; p.len]) };
        format!("{} = {text}", p.name)
    };
    let parameters: Vec<String> = law.info.parameters.iter().map(parameter).collect();
    format!(
        "[mesh]\nbeam = {{ size = [5, 1, 1], cells = {cells:?}, element = \"{}\" }}\n[[material]]\nlaw = \"{}\"\n\
         density = 1000.0\nparameters = {{ {} }}\n[solver]\nintegrator = \"implicit-euler\"\nprecision = \"{}\"\n\
         step = 1e-5\nduration = 1e-5\n",
        element.name,
        law.info.name,
        parameters.join(", "),
        crate::plan::precision_name(precision)
    )
}

/// A small smooth displacement at a place.
pub fn wave(p: &[f64; 3]) -> [f64; 3] {
    [1e-3 * (p[0] + p[1]).sin(), 1e-3 * (2.0 * p[2]).cos(), 1e-3 * (p[0] * p[1]).sin()]
}

/// Cells of a beam of about so many elements.
pub fn cells(element: &'static ElementEntry, elements: usize) -> [usize; 3] {
    let a_cell = beam_of(element, [1.0; 3], [1; 3], [0.0; 3]).map_or(1, |mesh| mesh.len());
    let wanted = elements as f64 / (5 * a_cell) as f64;
    if element.info.dimension == 2 {
        let across = wanted.sqrt().round().max(1.0) as usize;
        return [5 * across, across, 1];
    }
    let across = wanted.cbrt().round().max(1.0) as usize;
    [5 * across, across, across]
}

fn measure(target: &Target, subject: &Subject) -> Result<Measured, MeasureError> {
    let text = scene_text(subject.law, subject.element.info, subject.cells, subject.precision);
    let model = build(&scene::parse(&text, "bench.toml", &[])?)?;
    match (target, subject.precision) {
        (Target::Cpu, scene::Precision::F32) => on_cpu::<f32>(subject, model),
        (Target::Cpu, scene::Precision::F64) => on_cpu::<f64>(subject, model),
        #[cfg(feature = "gpu")]
        (Target::Gpu(gpu, options), scene::Precision::F32) => {
            let backend = GpuBackend::new(std::sync::Arc::clone(gpu), &model.body, *options)?;
            let field = GpuField::new(&backend, &model.body)?;
            // Each node of each element has a slot.
            let slots = subject.element.info.nodes as f64;
            let layout = Layout { real: 4.0, vector: 16.0, slot: 16.0, point: 48.0, place: 4.0, slots, local: 0.0 };
            all(subject, model, backend, field, layout)
        }
        #[cfg(feature = "gpu")]
        (Target::Gpu(..), scene::Precision::F64) => Err(DeviceError::Precision.into()),
    }
}

fn on_cpu<R: Precision>(subject: &Subject, model: Model) -> Result<Measured, MeasureError> {
    let backend = CpuBackend::<R>::new(model.body.masses.len(), model.body.constraints.clone());
    let field = CpuField::<R>::new(&model.body);
    let real = size_of::<R>() as f64;
    let clustered: usize = model.body.batches.iter().map(|b| cluster_nodes(&model.body, b)).sum();
    let slots = clustered as f64 / model.body.elements.len() as f64;
    let layout =
        Layout { real, vector: 3.0 * real, slot: 4.0 * real, point: 10.0 * real, place: 2.0, slots, local: 4.0 };
    all(subject, model, backend, field, layout)
}

/// Bytes of a device's structures.
#[derive(Clone, Copy)]
struct Layout {
    /// A number.
    real: f64,
    /// A vector at a node.
    vector: f64,
    /// A partial force.
    slot: f64,
    /// Rest data of a quadrature point.
    point: f64,
    /// What tells an element where its node is.
    place: f64,
    /// Partial forces an element.
    slots: f64,
    /// What tells a cluster which node of the body each of its own is; 0 without clusters.
    local: f64,
}

/// Counts an element's operations and bytes.
struct Count<'a> {
    subject: &'a Subject,
    layout: Layout,
    /// Nodes of the body an element.
    nodes: f64,
}

impl Count<'_> {
    /// Point kernels that gather some vectors, and what else a point takes.
    fn flops(&self, gathers: u32, kernel: &str, times: u32, contract: bool) -> u32 {
        let info = self.subject.element.info;
        let contract = if contract { info.contract_operations } else { 0 };
        operations(info, gathers, times * point_operations(self.subject.law.info, kernel) + contract)
    }

    /// What every element pass reads: nodes, rest data, so many vectors once each, and so many stored numbers a point.
    fn read(&self, vectors: u32, stored: usize) -> f64 {
        let (info, layout) = (self.subject.element.info, &self.layout);
        let point = layout.point + layout.real * stored as f64;
        layout.place * info.nodes as f64
            + layout.local * layout.slots
            + point * info.points.len() as f64
            + f64::from(vectors) * layout.vector * self.nodes
    }

    /// Slots that are written and read, their numbers, and the sums that are read and written.
    fn two_passes(&self, vectors: u32, stored: usize) -> f64 {
        let layout = &self.layout;
        self.read(vectors, stored) + layout.slots * (2.0 * layout.slot + 4.0) + 2.0 * layout.vector * self.nodes
    }
}

/// Times an operation, after one that is not counted; it waits until it is done, and says what its time is to be multiplied
/// by.
fn time(
    operation: &'static str,
    repeats: usize,
    mut run: impl FnMut() -> Result<f64, MeasureError>,
) -> Result<Timing, MeasureError> {
    let mut seconds = Vec::with_capacity(repeats);
    for repeat in 0..=repeats {
        let start = Instant::now();
        let factor = run()?;
        if repeat > 0 {
            seconds.push(factor * start.elapsed().as_secs_f64());
        }
    }
    seconds.sort_by(f64::total_cmp);
    Ok(Timing { operation, seconds, times: 1, flops: None, bytes: None })
}

fn all<B: Backend, F: ForceField<B>>(
    subject: &Subject,
    model: Model,
    backend: B,
    mut field: F,
    layout: Layout,
) -> Result<Measured, MeasureError> {
    let Body { elements, .. } = &model.body;
    let (nodes, elements) = (model.mesh.nodes().len(), elements.len());
    let count = Count { subject, layout, nodes: nodes as f64 / elements as f64 };
    let plane = subject.element.info.dimension == 2;
    let at = |p: &[f64; 3]| if plane { [wave(p)[0], wave(p)[1], 0.0] } else { wave(p) };
    let scaled = |p: &[f64; 3]| at(p).map(|u| u / model.scale.length);
    let u = backend.upload(&model.mesh.nodes().iter().map(scaled).collect::<Vec<_>>());
    let direction = |p: &[f64; 3]| at(&[p[1], p[2], p[0]]);
    let du = backend.upload(&model.mesh.nodes().iter().map(direction).collect::<Vec<_>>());
    let mut f = backend.zeros();
    let on_cpu = layout.local > 0.0;
    let repeats = subject.repeats.max(1);
    let linear = subject.law.info.structure.linear;
    let (vectors, per_node) = (if linear { 1 } else { 2 }, subject.element.info.nodes as u32);

    let done = |backend: &B| Ok(backend.wait().map(|()| 1.0)?);
    let energy = time("energy", repeats, || {
        field.element_energies(&backend, &u)?;
        done(&backend)
    })?;
    let force = time("force", repeats, || {
        field.add_force(&backend, &u, &mut f)?;
        done(&backend)
    })?;
    let dforce = time("dforce", repeats, || {
        field.add_dforce_at(&backend, &u, &du, 1.0, &mut f);
        done(&backend)
    })?;
    let linearize = time("linearize", repeats, || {
        field.prepare(&backend, &u);
        done(&backend)
    })?;
    let apply = time("apply", repeats, || {
        field.add_dforce(&backend, &du, 1.0, &mut f);
        done(&backend)
    })?;
    let diagonal = time("diagonal", repeats, || {
        field.add_diagonal(&backend, 1.0, &mut f);
        done(&backend)
    })?;
    let stored = if on_cpu { subject.law.info.stored } else { 0 };
    let counted = |timing, flops, bytes| Timing { flops: Some(flops), bytes: Some(bytes), ..timing };
    let (contract, apply_flops) = (subject.element.info.contract_operations, tangent_operations(subject.law.info));
    let of_apply = match on_cpu {
        true => operations(subject.element.info, 1, apply_flops + contract),
        false => count.flops(vectors, "dforce", 1, true),
    };
    // A device that stores nothing copies the state, and has to read it again.
    let applied = if on_cpu { 1 } else { vectors };
    let written = count.layout.real * (stored * subject.element.info.points.len()) as f64;
    let of_linearize = if stored > 0 { count.flops(1, "linearize", 1, false) } else { 0 };
    let mut timings = vec![
        counted(energy, count.flops(1, "energy", 1, false), count.read(1, 0) + count.layout.real),
        counted(force, count.flops(1, "force", 1, true), count.two_passes(1, 0)),
        counted(dforce, count.flops(vectors, "dforce", 1, true), count.two_passes(vectors, 0)),
        counted(linearize, of_linearize, count.read(1, 0) + written),
        counted(apply, of_apply, count.two_passes(applied, stored)),
        counted(diagonal, count.flops(vectors - 1, "diagonal", per_node, false), count.two_passes(vectors - 1, 0)),
    ];
    let mut system = System::new(backend, field, model.body);
    timings.push(explicit(&mut system, repeats)?);
    timings.push(solver(&mut system, &u, repeats)?);
    Ok(Measured { nodes, elements, timings })
}

/// Explicit steps, too short to go anywhere.
fn explicit<B: Backend, F: ForceField<B>>(system: &mut System<B, F>, repeats: usize) -> Result<Timing, MeasureError> {
    let mut state = system.initial_state([0.0; 3]);
    let mut integrator = SemiImplicitEuler::new(&system.backend);
    time("explicit step", repeats, || {
        integrator.step(system, &mut state, 1e-9)?;
        Ok(system.backend.wait().map(|()| 1.0)?)
    })
}

/// Iterations of the solver of an implicit step; those of a solution that stops before are scaled up.
fn solver<B: Backend, F: ForceField<B>>(
    system: &mut System<B, F>,
    b: &B::Vector,
    repeats: usize,
) -> Result<Timing, MeasureError> {
    let System { backend, field, masses, body, .. } = system;
    let rest = backend.zeros();
    field.prepare(backend, &rest);
    let ones = backend.upload(&vec![[1.0; 3]; body.masses.len()]);
    let operator = Operator { masses, mass: 1.0, stiffness: 1.0, damping: None };
    let mut cg = ConjugateGradient::new(backend);
    let limits = CgLimits { tolerance: f64::MIN_POSITIVE.sqrt(), max_iterations: ITERATIONS };
    let iterations = time("50 iterations of CG", repeats, || {
        let mut x = backend.zeros();
        let report = cg.solve(backend, field, &operator, &ones, b, &mut x, limits);
        backend.wait()?;
        Ok(f64::from(ITERATIONS) / f64::from(report.iterations.max(1)))
    })?;
    Ok(Timing { times: ITERATIONS, ..iterations })
}

//! Throughput of kernels and steps on a device: what `tensormass bench` shows.
//!
//! Wall-clock times of whole operations, each waited for. Machines are shared and their clocks vary: compare figures of one
//! call only, as ratios.

mod body;
mod count;
mod implicit;
mod omissions;
mod operations;
mod peak;

use std::path::PathBuf;

use tensormass_kernels::{ElementEntry, LawEntry};

use crate::backend::{Backend, ForceField, LeftDomain};
use crate::cpu::{CpuBackend, CpuField, Precision, element_bytes};
use crate::device::DeviceError;
#[cfg(feature = "gpu")]
use crate::gpu::{GpuBackend, GpuField};
use crate::model::{BuildError, Model, build};
use crate::order::sharing;
use crate::scene::{self, SceneError};
use crate::simulate::RunError;
use crate::system::SolveError;
use crate::tangent::{Tangent, asked_for, blocks};
use crate::target::Target;

pub use body::{cells, scene_text, wave};
use count::Layout;
pub use implicit::{Implicit, STEP, Solution, TOLERANCE};
pub use omissions::{Omission, Setting, Side};

/// Iterations of the linear solver in one of its figures.
pub const ITERATIONS: u32 = 50;

/// The mesh of what is measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Body {
    /// A beam of 5 x 1 x 1 m, or of 5 x 1 m, of so many cells along x, y and z (see [`cells`]).
    Beam([usize; 3]),
    /// A mesh file, in metres.
    File(PathBuf),
}

/// What is measured.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The law.
    pub law: &'static LawEntry,
    /// What the body is made of.
    pub element: &'static ElementEntry,
    /// Its mesh.
    pub body: Body,
    /// Numbers of state and kernels.
    pub precision: scene::Precision,
    /// Times that an operation is repeated, at least 1.
    pub repeats: usize,
    /// How many times stiffer the material is in one half of a beam than in the other.
    pub stiffness_ratio: f64,
    /// How products with the tangent are computed on a CPU.
    pub tangent: scene::TangentChoice,
}

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The body cannot be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The device is no good, or has failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// A mesh has elements of another kind.
    #[error("{file}: the mesh has elements of kind {found}, and {wanted} is measured; give --element {found}")]
    Kind {
        /// The mesh file.
        file: String,
        /// What it has.
        found: &'static str,
        /// What was asked for.
        wanted: &'static str,
    },
    /// The body's small wave is outside the law's domain.
    #[error(transparent)]
    LeftDomain(#[from] LeftDomain),
    /// A step failed.
    #[error(transparent)]
    Step(#[from] SolveError),
    /// A scene cannot be run.
    #[error(transparent)]
    Run(#[from] RunError),
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
        median(&self.seconds)
    }
}

/// What was measured of one subject.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Nodes of the body.
    pub nodes: usize,
    /// Elements of the body.
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
        self.pool.install(peak::triad)
    }

    /// Operations a second that the machine's cores do at most in this precision: multiplications and additions of numbers in
    /// registers, the best of a few.
    pub fn peak(&self, precision: scene::Precision) -> f64 {
        self.pool.install(|| match precision {
            scene::Precision::F32 => peak::peak::<f32>(),
            scene::Precision::F64 => peak::peak::<f64>(),
        })
    }

    /// Measures a subject on a device.
    ///
    /// # Errors
    /// See [`MeasureError`].
    pub fn measure(&self, target: &Target, subject: &Subject) -> Result<Measured, MeasureError> {
        self.pool.install(|| on(target, subject, Operations))
    }

    /// Measures what it gains to leave out what scenes may leave out.
    ///
    /// # Errors
    /// See [`MeasureError`].
    pub fn omissions(&self, target: &Target, setting: &Setting) -> Result<Vec<Omission>, MeasureError> {
        omissions::omissions(target, setting)
    }

    /// Measures an implicit step of a subject on a device.
    ///
    /// # Errors
    /// See [`MeasureError`].
    pub fn implicit(&self, target: &Target, subject: &Subject) -> Result<Implicit, MeasureError> {
        self.pool.install(|| on(target, subject, Step))
    }
}

/// The middle one of ascending times.
fn median(ascending: &[f64]) -> f64 {
    ascending[ascending.len() / 2]
}

/// What is measured on a backend.
trait Measurement {
    /// What comes of it.
    type Result;
    fn on<B: Backend, F: ForceField<B>>(
        self,
        subject: &Subject,
        model: Model,
        backend: B,
        field: F,
        layout: Layout,
    ) -> Result<Self::Result, MeasureError>;
}

/// Kernels, explicit steps and iterations of the linear solver.
struct Operations;

impl Measurement for Operations {
    type Result = Measured;
    fn on<B: Backend, F: ForceField<B>>(
        self,
        subject: &Subject,
        model: Model,
        backend: B,
        field: F,
        layout: Layout,
    ) -> Result<Measured, MeasureError> {
        operations::all(subject, model, backend, field, layout)
    }
}

/// An implicit step.
struct Step;

impl Measurement for Step {
    type Result = Implicit;
    fn on<B: Backend, F: ForceField<B>>(
        self,
        subject: &Subject,
        model: Model,
        backend: B,
        field: F,
        _: Layout,
    ) -> Result<Implicit, MeasureError> {
        implicit::implicit(subject, model, backend, field)
    }
}

/// Measures a subject on a device.
fn on<M: Measurement>(target: &Target, subject: &Subject, measurement: M) -> Result<M::Result, MeasureError> {
    let scene = scene::parse(&scene_text(subject), "bench.toml", &[])?;
    let model = build(&scene)?;
    let (tangents, _) = asked_for(&scene, &model.body);
    let other = model.body.batches.iter().find(|batch| batch.element.info.name != subject.element.info.name);
    if let (Body::File(file), Some(other)) = (&subject.body, other) {
        let (found, wanted) = (other.element.info.name, subject.element.info.name);
        return Err(MeasureError::Kind { file: file.display().to_string(), found, wanted });
    }
    match (target, subject.precision) {
        (Target::Cpu, scene::Precision::F32) => on_cpu::<f32, M>(subject, model, &tangents, measurement),
        (Target::Cpu, scene::Precision::F64) => on_cpu::<f64, M>(subject, model, &tangents, measurement),
        #[cfg(feature = "gpu")]
        (Target::Gpu(gpu, options), scene::Precision::F32) => {
            let backend = GpuBackend::new(std::sync::Arc::clone(gpu), &model.body, *options)?;
            let field = GpuField::new(&backend, &model.body)?;
            let (elements, nodes) = (model.body.elements.len() as f64, subject.element.info.nodes);
            let grouped = &backend.order().elements;
            let slots = grouped.iter().map(|g| g.slots(nodes)).sum::<usize>() as f64 / elements;
            let places = grouped.iter().map(|g| 16 * g.fours(nodes)).sum::<usize>() as f64 / elements;
            let sizes = Layout { real: 4.0, vector: 16.0, slot: 16.0, ..Layout::default() };
            let layout = Layout { point: 48.0, places, slots, ..sizes };
            measurement.on(subject, model, backend, field, layout)
        }
        #[cfg(feature = "gpu")]
        (Target::Gpu(..), scene::Precision::F64) => Err(DeviceError::Precision.into()),
    }
}

fn on_cpu<R: Precision, M: Measurement>(
    subject: &Subject,
    model: Model,
    tangents: &[Tangent],
    measurement: M,
) -> Result<M::Result, MeasureError> {
    let backend = CpuBackend::<R>::new(&model.body);
    let field = CpuField::<R>::new(&backend, &model.body).with_tangents(tangents);
    let real = size_of::<R>() as f64;
    let slots = sharing(&model.body).foreign as f64 / model.body.elements.len() as f64;
    let sizes = Layout { real, vector: 3.0 * real, slot: 3.0 * real, point: 10.0 * real, ..Layout::default() };
    let blocks: usize = model.body.batches.iter().map(|batch| blocks(&model.body, batch)).sum();
    let blocks = blocks as f64 / model.body.elements.len() as f64;
    let tangent = tangents[0];
    let places =
        model.body.batches.iter().map(|batch| element_bytes::<R>(&model.body, batch).places).sum::<usize>() as f64;
    let places = places / model.body.elements.len() as f64;
    let layout = Layout { places, column: 2.0, slots, local: 4.0, own: 3.0 * real, tangent, blocks, ..sizes };
    measurement.on(subject, model, backend, field, layout)
}

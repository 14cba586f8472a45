//! The GPU backend: vectors on the device, f32, every operation a dispatch; results are waited for only where the host
//! asks for one.

use std::any::TypeId;
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use crate::backend::{Advance, Backend, Counts, Descent, Meeting, REGISTERS, RUNNING, Update};
use crate::body::{Body, Constraint, PressedFace};
use crate::contact::{Contact, Held, Passage};
use crate::device::DeviceError;
use crate::device_memory::{GROUP, WORK_GROUP, motions, partial_sums};
use crate::inventory::Ledger;
use crate::inventory::names::{CONSTRAINED, HELD, MASS_MATRIX, PARTIALS, REGISTERS as REGISTERS_HELD, VECTORS};
use crate::mass::MassMatrix;
use crate::order::{DeviceOrder, placed_constraints};

use super::contact::GpuContact;
use super::device::Gpu;
use super::pressure::GpuPressure;
use super::recorder::{Kernel, Memory, Numbers, Recorder};
use super::shaders::{Access, Argument, Operation, update_arguments, update_text};
use super::trace;

/// No motion: a component that is not constrained.
const FREE: u32 = u32::MAX;

/// What a user of a GPU may tune. Nothing here changes what is computed but the last digits of sums. Values that no device
/// takes are replaced by the nearest that all do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GpuOptions {
    /// Invocations of a work group of the element and node passes (Faure et al. 2012, Fig. 4): a power of two, at most
    /// 256.
    pub work_group_size: u32,
    /// Elements that one invocation computes (Faure et al. 2012, Fig. 5).
    pub elements_per_invocation: u32,
    /// Iterations of a linear solver in one submission.
    pub iterations_per_submission: u32,
    /// Explicit steps between two looks at the state.
    pub steps_between_checks: u32,
    /// Bytes that a kernel may bind of one buffer; none for the device's limit. A mesh beyond it is split.
    pub binding_bytes: Option<u64>,
}

impl Default for GpuOptions {
    fn default() -> Self {
        Self {
            work_group_size: WORK_GROUP,
            elements_per_invocation: 1,
            iterations_per_submission: 32,
            steps_between_checks: 32,
            binding_bytes: None,
        }
    }
}

impl GpuOptions {
    /// The nearest options that every device takes.
    fn valid(self) -> Self {
        Self {
            work_group_size: self.work_group_size.clamp(1, GROUP).next_power_of_two(),
            elements_per_invocation: self.elements_per_invocation.max(1),
            iterations_per_submission: self.iterations_per_submission.max(1),
            steps_between_checks: self.steps_between_checks.max(1),
            binding_bytes: self.binding_bytes,
        }
    }
}

/// A vector over nodes on the device, in the backend's order: four f32 a node, the fourth the node's constraint mask.
#[derive(Debug)]
pub struct GpuVector {
    memory: Rc<Memory>,
    /// Where the buffer goes when the vector is dropped: steps that make a vector each time take it from here.
    unused: Rc<RefCell<Vec<Rc<Memory>>>>,
}

impl GpuVector {
    pub(super) fn memory(&self) -> &Memory {
        &self.memory
    }
}

impl Drop for GpuVector {
    fn drop(&mut self) {
        self.unused.borrow_mut().push(Rc::clone(&self.memory));
    }
}

/// A mass matrix on the device, in compressed rows, f32.
#[derive(Debug)]
pub struct GpuMatrix {
    offsets: Memory,
    columns: Memory,
    entries: Memory,
}

/// Registers of a solver on the device, f32.
#[derive(Debug)]
pub struct GpuRegisters(Memory);

impl GpuRegisters {
    pub(super) fn memory(&self) -> &Memory {
        &self.0
    }
}

/// Vectors and registers on a GPU.
#[derive(Debug)]
pub struct GpuBackend {
    recorder: Rc<Recorder>,
    options: GpuOptions,
    /// How elements are ordered, and where each node of the body is in a vector.
    order: DeviceOrder,
    /// The zero vector, with the constraint masks.
    origin: Memory,
    masks: Vec<f32>,
    /// Constrained nodes and the motions of their components, if there are any.
    constrained: Option<Memory>,
    constrained_nodes: usize,
    motions: usize,
    /// Nodes on obstacles, of which so many are held now: made when some first are.
    held: Option<Memory>,
    held_nodes: usize,
    /// Nodes that may be held.
    surface: usize,
    partials: Memory,
    gate: Rc<Memory>,
    /// Partial sums that the next update adds up.
    pending: Cell<u32>,
    unused: Rc<RefCell<Vec<Rc<Memory>>>>,
    operations: RefCell<HashMap<Operation, Rc<Kernel>>>,
    updates: RefCell<HashMap<TypeId, Rc<Kernel>>>,
}

impl GpuBackend {
    /// A backend for a body.
    ///
    /// # Errors
    /// A vector over the body's nodes or its mass matrix is larger than the device can bind, or the device has failed.
    pub fn new(gpu: Arc<Gpu>, body: &Body, options: GpuOptions) -> Result<Self, DeviceError> {
        let options = options.valid();
        let recorder = Rc::new(Recorder::new(gpu, motions(body)));
        let order = DeviceOrder::of(body);
        let places = &order.places;
        // [`Backend::matrix`] cannot refuse it.
        let entries = body.mass_matrix.as_ref().map_or(0, |matrix| 4 * matrix.values.len() as u64);
        recorder.fits("the consistent mass", entries)?;
        let (origin, constrained) = constrained(places.len(), &placed_constraints(body, places));
        recorder.fits("a vector over the nodes", size_of_val(&*origin) as u64)?;
        let has_supports = !constrained.is_empty();
        let backend = Self {
            origin: recorder.filled(VECTORS, &origin)?,
            masks: origin.iter().map(|v| v[3]).collect(),
            constrained: if has_supports { Some(recorder.filled(CONSTRAINED, &constrained)?) } else { None },
            constrained_nodes: constrained.len(),
            motions: body.motions.len(),
            held: None,
            held_nodes: 0,
            surface: body.contact.as_ref().map_or(0, |c| c.nodes.len()),
            partials: recorder.memory(PARTIALS, 4 * partial_sums(body, options.work_group_size) as u64)?,
            gate: Rc::new(recorder.filled(REGISTERS_HELD, &open_gate())?),
            recorder,
            options,
            order,
            pending: Cell::new(0),
            unused: Rc::default(),
            operations: RefCell::default(),
            updates: RefCell::default(),
        };
        backend.check()?;
        Ok(backend)
    }

    pub(super) fn recorder(&self) -> &Rc<Recorder> {
        &self.recorder
    }

    pub(super) fn options(&self) -> &GpuOptions {
        &self.options
    }

    pub(super) fn nodes(&self) -> usize {
        self.order.places.len()
    }

    /// How the body's elements and nodes are ordered.
    pub(crate) fn order(&self) -> &DeviceOrder {
        &self.order
    }

    pub(super) fn partials(&self) -> &Memory {
        &self.partials
    }

    /// Says how many partial sums the next update adds up.
    pub(super) fn sum_is_pending(&self, groups: [u32; 2]) {
        self.pending.set(groups[0] * groups[1]);
    }

    fn vector(&self) -> GpuVector {
        let kept = self.unused.borrow_mut().pop();
        // A vector as large as `origin`, which the device could bind.
        let made = || self.recorder.memory(VECTORS, 16 * self.nodes() as u64).expect("as large as one that was made");
        GpuVector { memory: kept.unwrap_or_else(|| Rc::new(made())), unused: Rc::clone(&self.unused) }
    }

    /// Compiles a module of ours: the numbers of the pass, then its arguments.
    pub(super) fn kernel(&self, label: &str, text: &str, arguments: &[Argument]) -> Rc<Kernel> {
        let accesses = arguments.iter().map(|(_, _, access)| *access);
        let bindings: Vec<Access> = std::iter::once(Access::Uniform).chain(accesses).collect();
        self.recorder.kernel(label, text, &bindings, &[("work_group_size", GROUP.into())])
    }

    /// Records an operation over `count` things.
    pub(super) fn run(&self, operation: Operation, numbers: Numbers, storage: &[&Memory]) -> [u32; 2] {
        let kernel = Rc::clone(
            self.operations
                .borrow_mut()
                .entry(operation)
                .or_insert_with(|| self.kernel(&format!("{operation:?}"), &operation.text(), &operation.arguments())),
        );
        match operation {
            // One group adds up all partial sums.
            Operation::Sum => {
                self.recorder.dispatch(&kernel, numbers, storage, [1, 1]);
                [1, 1]
            }
            _ => self.dispatch_each(&kernel, numbers, storage),
        }
    }

    /// Records a kernel over `numbers[0]` things; the groups that it takes.
    pub(super) fn dispatch_each(&self, kernel: &Kernel, numbers: Numbers, storage: &[&Memory]) -> [u32; 2] {
        let groups = self.recorder.groups(numbers[0] as usize, GROUP);
        self.recorder.dispatch(kernel, numbers, storage, groups);
        groups
    }

    fn numbers(&self, a: f64) -> Numbers {
        [self.nodes() as u32, 0, (a as f32).to_bits(), 0]
    }

    /// Records an operation over the nodes.
    fn each(&self, operation: Operation, a: f64, storage: &[&Memory]) {
        self.run(operation, self.numbers(a), storage);
    }

    /// The gate of passes that nothing stops.
    pub(super) fn gate(&self) -> &Rc<Memory> {
        &self.gate
    }

    /// Records y = a M x, or y += a M x; nothing where the gate's solver has stopped.
    pub(super) fn product(&self, a: f64, m: &GpuMatrix, [x, y]: [&GpuVector; 2], fresh: bool, gate: &Memory) {
        let numbers = [self.nodes() as u32, u32::from(fresh), (a as f32).to_bits(), 0];
        let storage = [&m.offsets, &m.columns, &m.entries, &*x.memory, &*y.memory, gate];
        self.run(Operation::Product, numbers, &storage);
    }

    /// Partial sums or maxima over the nodes, read by the host.
    fn reduced(&self, operation: Operation, storage: &[&Memory]) -> Option<Vec<f32>> {
        let [columns, rows] = self.run(operation, self.numbers(0.0), storage);
        self.recorder.read(&self.partials, (columns * rows) as usize)
    }
}

/// The zero vector with the masks of the nodes, and the list of constrained nodes.
fn constrained(nodes: usize, constraints: &[Constraint]) -> (Vec<[f32; 4]>, Vec<[u32; 4]>) {
    let mut masks = vec![0_u32; nodes];
    let mut list: Vec<[u32; 4]> = Vec::new();
    for c in constraints {
        masks[c.node as usize] |= 1 << c.component;
        if list.last().is_none_or(|last| last[0] != c.node) {
            list.push([c.node, FREE, FREE, FREE]);
        }
        let last = list.last_mut().expect("it was pushed above");
        last[1 + c.component as usize] = c.motion as u32;
    }
    (masks.into_iter().map(|mask| [0.0, 0.0, 0.0, mask as f32]).collect(), list)
}

impl Backend for GpuBackend {
    type Vector = GpuVector;
    type Registers = GpuRegisters;
    type Matrix = GpuMatrix;
    type Contact = GpuContact;
    type Pressure = GpuPressure;

    fn zeros(&self) -> GpuVector {
        let mut x = self.vector();
        self.clear(&mut x);
        x
    }

    fn upload(&self, values: &[[f64; 3]]) -> GpuVector {
        let x = self.vector();
        let mut content: Vec<[f32; 4]> = self.masks.iter().map(|mask| [0.0, 0.0, 0.0, *mask]).collect();
        for (place, v) in self.order.places.iter().zip(values) {
            content[*place as usize][..3].copy_from_slice(&v.map(|x| x as f32));
        }
        self.recorder.write(&x.memory, &content);
        x
    }

    fn download(&self, x: &GpuVector) -> Vec<[f64; 3]> {
        match self.recorder.read::<[f32; 4]>(&x.memory, self.nodes()) {
            Some(values) => {
                let at = |place: &u32| values[*place as usize];
                self.order.places.iter().map(at).map(|[x, y, z, _]| [x, y, z].map(f64::from)).collect()
            }
            None => vec![[f64::NAN; 3]; self.nodes()],
        }
    }

    fn copy(&self, x: &GpuVector, y: &mut GpuVector) {
        self.each(Operation::Copy, 0.0, &[&x.memory, &y.memory]);
    }

    fn clear(&self, x: &mut GpuVector) {
        self.each(Operation::Copy, 0.0, &[&self.origin, &x.memory]);
    }

    fn axpy(&self, a: f64, x: &GpuVector, y: &mut GpuVector) {
        self.each(Operation::Axpy, a, &[&x.memory, &y.memory]);
    }

    fn xpby(&self, x: &GpuVector, b: f64, y: &mut GpuVector) {
        self.each(Operation::Xpby, b, &[&x.memory, &y.memory]);
    }

    fn scale(&self, b: f64, y: &mut GpuVector) {
        self.each(Operation::Scale, b, &[&y.memory]);
    }

    fn multiply_add(&self, a: f64, d: &GpuVector, x: &GpuVector, y: &mut GpuVector) {
        self.each(Operation::MultiplyAdd, a, &[&d.memory, &x.memory, &y.memory]);
    }

    fn matrix(&self, matrix: &MassMatrix) -> GpuMatrix {
        let filled = "the backend was made for a body with this matrix";
        let matrix = matrix.placed(&self.order.places);
        let entries: Vec<f32> = matrix.values.iter().map(|&v| v as f32).collect();
        GpuMatrix {
            offsets: self.recorder.filled(MASS_MATRIX, &matrix.offsets).expect(filled),
            columns: self.recorder.filled(MASS_MATRIX, &matrix.columns).expect(filled),
            entries: self.recorder.filled(MASS_MATRIX, &entries).expect(filled),
        }
    }

    fn add_product(&self, a: f64, matrix: &GpuMatrix, x: &GpuVector, y: &mut GpuVector) {
        self.product(a, matrix, [x, y], false, &self.gate);
    }

    fn divide(&self, x: &GpuVector, d: &GpuVector, y: &mut GpuVector) {
        self.each(Operation::Divide, 0.0, &[&x.memory, &d.memory, &y.memory]);
    }

    fn dot(&self, x: &GpuVector, y: &GpuVector) -> f64 {
        match self.reduced(Operation::Dot, &[&x.memory, &y.memory, &self.partials]) {
            Some(partials) => partials.into_iter().map(f64::from).sum(),
            None => f64::NAN,
        }
    }

    fn max_abs(&self, x: &GpuVector) -> f64 {
        match self.reduced(Operation::MaxAbs, &[&x.memory, &self.partials]) {
            Some(partials) => match partials.into_iter().fold(0.0, f32::max) {
                f32::MAX => f64::INFINITY,
                largest => largest.into(),
            },
            None => f64::NAN,
        }
    }

    fn project(&self, x: &mut GpuVector) {
        self.each(Operation::Project, 0.0, &[&x.memory]);
        self.project_held(x);
    }

    fn hold(&mut self, held: &[Held]) {
        let node = |held: &Held| {
            let [x, y, z] = held.normal.map(|x| if held.grip.sticks { 0 } else { (x as f32).to_bits() });
            [x, y, z, self.order.places[held.node as usize]]
        };
        let content: Vec<[u32; 4]> = held.iter().map(node).collect();
        self.held_nodes = content.len();
        if !content.is_empty() {
            let made = || self.recorder.memory(HELD, 16 * self.surface as u64).expect("less than a vector");
            self.recorder.write(self.held.get_or_insert_with(made), &content);
        }
    }

    fn project_held(&self, x: &mut GpuVector) {
        if let Some(held) = self.held.as_ref().filter(|_| self.held_nodes > 0) {
            self.run(Operation::ProjectHeld, [self.held_nodes as u32, 0, 0, 0], &[held, &x.memory]);
        }
    }

    fn even_out(&self, x: &mut GpuVector) {
        if let Some(held) = self.held.as_ref().filter(|_| self.held_nodes > 0) {
            self.run(Operation::EvenOut, [self.held_nodes as u32, 0, 0, 0], &[held, &x.memory]);
        }
    }

    fn impose(&self, motions: &[f64], x: &mut GpuVector) {
        if let Some(constrained) = &self.constrained {
            debug_assert_eq!(motions.len(), self.motions);
            let numbers = [self.constrained_nodes as u32, self.recorder.motions(motions), 0, 0];
            self.run(Operation::Impose, numbers, &[constrained, self.recorder.values(), &x.memory]);
        }
    }

    fn impose_change(&self, motions: &[f64], x: &GpuVector, y: &mut GpuVector) {
        if let Some(constrained) = &self.constrained {
            debug_assert_eq!(motions.len(), self.motions);
            let numbers = [self.constrained_nodes as u32, self.recorder.motions(motions), 0, 0];
            let values = self.recorder.values();
            self.run(Operation::ImposeChange, numbers, &[constrained, values, &x.memory, &y.memory]);
        }
    }

    fn make_positive(&self, x: &mut GpuVector) {
        self.each(Operation::MakePositive, 0.0, &[&x.memory]);
    }

    fn epsilon(&self) -> f64 {
        f64::from(f32::EPSILON) / 2.0
    }

    fn smallest(&self) -> f64 {
        f32::MIN_POSITIVE.into()
    }

    fn registers(&self, values: [f64; REGISTERS]) -> GpuRegisters {
        let values = values.map(|v| v as f32);
        GpuRegisters(self.recorder.filled(REGISTERS_HELD, &values).expect("every device binds 64 bytes"))
    }

    fn load(&self, values: [f64; REGISTERS], registers: &mut GpuRegisters) {
        self.recorder.write(&registers.0, &values.map(|v| v as f32));
    }

    fn read(&self, registers: &GpuRegisters) -> [f64; REGISTERS] {
        match self.recorder.read::<f32>(&registers.0, REGISTERS) {
            Some(values) => std::array::from_fn(|k| values[k].into()),
            None => [f64::NAN; REGISTERS],
        }
    }

    fn dot_to(&self, x: &GpuVector, y: &GpuVector, registers: &mut GpuRegisters, k: usize) {
        let storage = [&*x.memory, &*y.memory, &self.partials];
        let [columns, rows] = self.run(Operation::Dot, self.numbers(0.0), &storage);
        self.run(Operation::Sum, [columns * rows, k as u32, 0, 0], &[&self.partials, &registers.0]);
    }

    fn update<U: Update>(&self, registers: &mut GpuRegisters) {
        let kernel = Rc::clone(self.updates.borrow_mut().entry(TypeId::of::<U>()).or_insert_with(|| {
            let text = update_text(U::SUMS, &trace::statements::<U>());
            self.kernel(std::any::type_name::<U>(), &text, &update_arguments(U::SUMS))
        }));
        let numbers = [self.pending.get(), 0, 0, 0];
        if U::SUMS {
            self.recorder.dispatch(&kernel, numbers, &[&self.partials, &registers.0], [1, 1]);
        } else {
            self.recorder.dispatch(&kernel, numbers, &[&registers.0], [1, 1]);
        }
    }

    fn descend(&self, descent: Descent<Self>, registers: &mut GpuRegisters) {
        let Descent { d, q, preconditioner, x, r, z } = descent;
        let vectors = [d, q, preconditioner, &*x, &*r, &*z].map(|v| &*v.memory);
        let [d, q, preconditioner, x, r, z] = vectors;
        let storage = [&registers.0, d, q, preconditioner, x, r, z, &self.partials];
        let groups = self.run(Operation::Descend, self.numbers(0.0), &storage);
        self.sum_is_pending(groups);
    }

    fn advance(&self, advance: Advance<Self>) {
        let Advance { force, masses, keep, kick, drift, v, u } = advance;
        let [keep, kick, drift] = [keep, kick, drift].map(|x| (x as f32).to_bits());
        let vectors = [force, masses, &*v, &*u].map(|v| &*v.memory);
        self.run(Operation::Advance, [self.nodes() as u32, keep, kick, drift], &vectors);
    }

    fn pressure(&self, faces: &[PressedFace]) -> GpuPressure {
        GpuPressure::new(self, faces).expect("fewer than slots of elements, which the field has bound")
    }

    fn add_pressure(&self, faces: &GpuPressure, pressure: f64, u: &GpuVector, f: &mut GpuVector) {
        faces.add(self, pressure, u, f);
    }

    fn contact_here(&self, contact: Arc<Contact>) -> Arc<Contact> {
        if contact.is_tabulated() { contact } else { Arc::new(contact.baked()) }
    }

    fn contact(&self, contact: &Contact) -> GpuContact {
        GpuContact::new(self, contact)
    }

    fn touch(&self, meeting: Meeting<Self>) {
        GpuContact::touch(self, meeting);
    }

    fn gap(&self, contact: &GpuContact, passages: &[Passage<f64>], limit: f64, u: &GpuVector) -> f64 {
        contact.gap(self, passages, limit, u)
    }

    fn turn(&self, z: &GpuVector, d: &mut GpuVector, registers: &GpuRegisters) {
        self.each(Operation::Turn, 0.0, &[&registers.0, &z.memory, &d.memory]);
    }

    fn iterations_between_readings(&self) -> u32 {
        self.options.iterations_per_submission
    }

    fn steps_between_checks(&self) -> u64 {
        self.options.steps_between_checks.into()
    }

    fn name(&self) -> String {
        self.recorder.gpu().info().name.clone()
    }

    fn wait(&self) -> Result<(), DeviceError> {
        self.recorder.submit();
        self.recorder.gpu().wait()
    }

    fn counts(&self) -> Counts {
        self.recorder.counts()
    }

    fn ledger(&self) -> &Ledger {
        self.recorder.ledger()
    }

    fn trim(&self) {
        self.recorder.unbind();
        self.unused.borrow_mut().clear();
    }

    fn check(&self) -> Result<(), DeviceError> {
        self.recorder.gpu().check()
    }
}

/// The gate of passes that nothing stops: registers of a solver that runs.
fn open_gate() -> [f32; REGISTERS] {
    let mut gate = [0.0; REGISTERS];
    gate[RUNNING] = 1.0;
    gate
}

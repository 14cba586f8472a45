//! The elements of a body on a GPU: two passes (Faure et al. 2012, Algorithm 1), a page of the mesh at a time.
//!
//! Pass 1: one invocation an element, or a strip of three, writes the partial force of each of its nodes into a slot of its
//! own. Pass 2: one invocation a node sums the slots of its elements in ascending order. No two invocations write one place.
//! A page is as much of the mesh as the device can bind; smaller bodies have one. Pages take turns with one buffer of slots.

use std::rc::Rc;

use tensormass_kernels::LawEntry;
use tensormass_kernels::shader::{Argument, Binding, Pass};

use crate::backend::{Backend, ForceField, LeftDomain, Operator};
use crate::body::{Body, LawBatch};
use crate::device::DeviceError;
use crate::inventory::names::{OUTPUTS, PARTIAL_FORCES};

use super::backend::{GpuBackend, GpuRegisters, GpuVector};
use super::page::{Page, Range, pages};
use super::passes::Passes;
use super::recorder::{Memory, Recorder};
use super::shaders::Operation;

/// Which elements a pass runs over.
#[derive(Debug, Clone, Copy)]
enum Of {
    All,
    /// Those of laws with a dissipation.
    Damped,
}

/// All elements of a body.
pub struct GpuField {
    recorder: Rc<Recorder>,
    pages: Vec<Page>,
    /// The elements of laws with a dissipation, with slots of their own, where some laws have one and some do not.
    damped: Option<Vec<Page>>,
    slots: Memory,
    /// The displacement at which the tangent is taken; none where no law's tangent depends on it, or none was prepared.
    state: Option<GpuVector>,
    /// Whether the tangent of a law depends on it.
    depends: bool,
    gate: Rc<Memory>,
    elements: usize,
    passes: Passes,
    work_group_size: u32,
    elements_per_invocation: u32,
    domains: Domains,
}

/// When it is said whether elements are inside their laws' domains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Domains {
    /// After each force.
    AtOnce,
    /// When it is asked for; no force was computed yet.
    Deferred,
    /// When it is asked for; forces keep the margins of elements that are outside.
    Kept,
}

/// The buffers of a pass that are not its range's own.
#[derive(Default)]
struct Bound<'a> {
    displacement: Option<&'a Memory>,
    velocity: Option<&'a Memory>,
    increment: Option<&'a Memory>,
    gate: Option<&'a Memory>,
}

impl GpuField {
    /// The elements of a body, in pages.
    ///
    /// # Errors
    /// A buffer is larger than the device can bind, or the device has failed.
    pub fn new(backend: &GpuBackend, body: &Body) -> Result<Self, DeviceError> {
        let recorder = Rc::clone(backend.recorder());
        let options = backend.options();
        let limit = recorder.gpu().limits().storage_binding_bytes;
        let limit = options.binding_bytes.map_or(limit, |bytes| bytes.min(limit));
        let made = |of: &dyn Fn(&LawBatch) -> bool| {
            let batches = body.batches.iter().zip(&backend.order().elements).filter(|(b, _)| of(b));
            pages(&recorder, (body, &backend.order().places), batches, limit)
        };
        let dissipative = |b: &LawBatch| b.law.damping.is_some();
        let mixed = body.is_viscous() && !body.batches.iter().all(dissipative);
        let damped = if mixed { Some(made(&dissipative)?) } else { None };
        let pages = made(&|_| true)?;
        // A page of damped elements alone may have more of them than any other.
        let slot_bytes = pages.iter().chain(damped.iter().flatten()).map(Page::slot_bytes).max().unwrap_or(0);
        let depends = |law: &LawEntry, pass: Pass| {
            pass.function(law).is_some_and(|f| f.arguments.contains(&Argument::DisplacementGradient))
        };
        let field = Self {
            slots: recorder.memory(PARTIAL_FORCES, slot_bytes)?,
            state: None,
            depends: body.batches.iter().any(|b| depends(b.law, Pass::DForce) || depends(b.law, Pass::Diagonal)),
            gate: Rc::clone(backend.gate()),
            elements: body.elements.len(),
            passes: Passes::new(&recorder, options),
            work_group_size: options.work_group_size,
            elements_per_invocation: options.elements_per_invocation,
            domains: Domains::AtOnce,
            recorder,
            pages,
            damped,
        };
        backend.check()?;
        Ok(field)
    }

    /// The pages of the mesh: 1 unless it is larger than the device can bind.
    pub fn pages(&self) -> usize {
        self.pages.len()
    }

    /// The passes over elements that the device has compiled so far: those of the laws and kinds that were computed.
    pub fn compiled_element_passes(&self) -> usize {
        self.passes.of_elements()
    }

    /// The pages of some elements: where every law has a dissipation, those of all.
    fn pages_of(&self, of: Of) -> &[Page] {
        match (of, &self.damped) {
            (Of::Damped, Some(damped)) => damped,
            (Of::All | Of::Damped, _) => &self.pages,
        }
    }

    /// Pass 1 of one page: a pass of each law and kind.
    fn element_passes(&mut self, of: Of, page: usize, pass: Pass, bound: &Bound) {
        for range in 0..self.pages_of(of)[page].ranges.len() {
            self.range_pass(of, (page, range), pass, bound);
        }
    }

    /// The pass of one law and kind.
    fn range_pass(&mut self, of: Of, (page, range): (usize, usize), pass: Pass, bound: &Bound) {
        let Range { stride, law, element, unit, units, .. } = self.pages_of(of)[page].ranges[range];
        let compiled = self.passes.element((law, element, unit), stride, pass);
        let range = &self.pages_of(of)[page].ranges[range];
        let storage: Vec<&Memory> = compiled.bindings[1..].iter().map(|&b| self.buffer(b, range, bound)).collect();
        let invocations = units.div_ceil(self.elements_per_invocation as usize);
        let groups = self.recorder.groups(invocations, self.work_group_size);
        let keeps = u32::from(pass == Pass::Force && self.domains == Domains::Kept);
        self.recorder.dispatch(&compiled.kernel, [units as u32, keeps, range.first_slot, 0], &storage, groups);
    }

    fn buffer<'a>(&'a self, binding: Binding, range: &'a Range, bound: &Bound<'a>) -> &'a Memory {
        let state = || self.state.as_ref().map(GpuVector::memory);
        let found = match binding {
            Binding::Nodes => Some(&range.nodes),
            Binding::Rest => Some(&range.rest),
            Binding::Constants => Some(&range.constants),
            Binding::Slots => Some(&self.slots),
            Binding::Margins => range.margins.as_ref(),
            // Fewer numbers than an element's partial forces, and read before the next ones are written.
            Binding::Energies => Some(&self.slots),
            Binding::Stresses => range.output.as_ref(),
            Binding::Displacement => bound.displacement.or_else(state),
            Binding::Velocity => bound.velocity,
            Binding::Increment => bound.increment,
            Binding::Gate => Some(bound.gate.unwrap_or(&self.gate)),
            Binding::ElementPass
            | Binding::NodePass
            | Binding::Incidence
            | Binding::Sum
            | Binding::Masses
            | Binding::Product
            | Binding::Partials => None,
        };
        found.expect("element passes bind what a range has or the caller gives")
    }

    /// Takes the tangent at rest, if none was taken and it depends on the state.
    fn tangent_is_taken(&mut self, backend: &GpuBackend) {
        if self.depends {
            self.state.get_or_insert_with(|| backend.zeros());
        }
    }

    /// Pass 2 of one page: y += factor times the sum of each node's slots.
    fn node_pass(&mut self, of: Of, page: usize, nodes: usize, factor: f64, y: &GpuVector) {
        let compiled = self.passes.node(false);
        let numbers = [nodes as u32, 0, (factor as f32).to_bits(), 0];
        let storage = [&self.slots, &self.pages_of(of)[page].incidence, y.memory()];
        let groups = self.recorder.groups(nodes, self.work_group_size);
        self.recorder.dispatch(&compiled.kernel, numbers, &storage, groups);
    }

    /// Both passes of every page: y += factor times the sums.
    fn passes(&mut self, backend: &GpuBackend, (of, pass): (Of, Pass), bound: &Bound, factor: f64, y: &GpuVector) {
        for page in 0..self.pages_of(of).len() {
            self.element_passes(of, page, pass, bound);
            self.node_pass(of, page, backend.nodes(), factor, y);
        }
    }

    /// Adds a part of a product: y += factor times the sums, and their partial scalar products with x. The first part of a
    /// product brings the masses.
    fn part_of_product(
        &mut self,
        backend: &GpuBackend,
        (of, pass): (Of, Pass),
        bound: &Bound,
        (factor, first): (f64, Option<f64>),
        masses: &GpuVector,
        [x, y]: [&GpuVector; 2],
    ) {
        let nodes = backend.nodes();
        let groups = self.recorder.groups(nodes, self.work_group_size);
        for page in 0..self.pages_of(of).len() {
            self.element_passes(of, page, pass, bound);
            let compiled = self.passes.node(true);
            let mass = first.filter(|_| page == 0);
            // The slots hold -K x or -C x.
            let factors = [-factor, mass.or(first).unwrap_or(0.0)].map(|f| (f as f32).to_bits());
            let numbers = [nodes as u32, u32::from(mass.is_some()), factors[0], factors[1]];
            let storage = [
                &self.slots,
                &self.pages_of(of)[page].incidence,
                x.memory(),
                masses.memory(),
                y.memory(),
                backend.partials(),
                bound.gate.unwrap_or(&self.gate),
            ];
            self.recorder.dispatch(&compiled.kernel, numbers, &storage, groups);
        }
    }

    /// Whether every element was inside its law's domain in the last pass that wrote margins: waits for the device,
    /// unless no law has a domain.
    fn inside(&self, backend: &GpuBackend) -> Result<(), LeftDomain> {
        let ranges = || self.pages.iter().flat_map(|p| &p.ranges);
        let mut counts = 0;
        for range in ranges() {
            if let Some(margins) = &range.margins {
                let numbers = [range.elements.len() as u32, counts, 0, 0];
                let [columns, rows] = backend.run(Operation::Outside, numbers, &[margins, backend.partials()]);
                counts += columns * rows;
            }
        }
        if counts == 0 {
            return Ok(());
        }
        let outside = self.recorder.read::<f32>(backend.partials(), counts as usize);
        // A device that has failed is found out by whoever asks it for the next result.
        if outside.is_none_or(|counts| counts.iter().all(|&c| c == 0.0)) {
            return Ok(());
        }
        let first = |range: &Range| {
            let margins = self.recorder.read::<f32>(range.margins.as_ref()?, range.elements.len())?;
            let place = margins.iter().position(|&m| m <= 0.0 || m.is_nan())?;
            let domain = range.law.info.domain.unwrap_or("everywhere");
            Some(LeftDomain {
                element: range.elements[place],
                law: range.law.info.name.to_string(),
                domain: domain.to_string(),
            })
        };
        ranges().find_map(first).map_or(Ok(()), Err)
    }

    /// Runs an output pass of `width` numbers an element; the numbers in the mesh's order. NaN if the device fails.
    fn output(&mut self, u: &GpuVector, pass: Pass, width: usize) -> Vec<f64> {
        let mut values = vec![f64::NAN; width * self.elements];
        let bound = Bound { displacement: Some(u.memory()), ..Bound::default() };
        for page in 0..self.pages.len() {
            for k in 0..self.pages[page].ranges.len() {
                let range = &mut self.pages[page].ranges[k];
                let count = width * range.elements.len();
                if pass != Pass::Energy && range.output.is_none() {
                    range.output = self.recorder.memory(OUTPUTS, 4 * count as u64).ok();
                    if range.output.is_none() {
                        continue;
                    }
                }
                self.range_pass(Of::All, (page, k), pass, &bound);
                let range = &self.pages[page].ranges[k];
                let output = range.output.as_ref().filter(|_| pass != Pass::Energy).unwrap_or(&self.slots);
                let read = self.recorder.read::<f32>(output, count);
                for (&e, read) in range.elements.iter().zip(read.iter().flat_map(|r| r.chunks(width))) {
                    for (value, &read) in values[width * e as usize..].iter_mut().zip(read) {
                        *value = read.into();
                    }
                }
            }
        }
        values
    }
}

/// What damping binds of a displacement and a velocity.
fn rate_at<'a>([u, v]: [&'a GpuVector; 2]) -> Bound<'a> {
    Bound { displacement: Some(u.memory()), velocity: Some(v.memory()), ..Bound::default() }
}

impl ForceField<GpuBackend> for GpuField {
    fn element_energies(&mut self, backend: &GpuBackend, u: &GpuVector) -> Result<Vec<f64>, LeftDomain> {
        let energies = self.output(u, Pass::Energy, 1);
        self.inside(backend)?;
        Ok(energies)
    }

    fn cauchy(&mut self, _: &GpuBackend, u: &GpuVector) -> Vec<[f64; 9]> {
        let values = self.output(u, Pass::Cauchy, 9);
        values.chunks_exact(9).map(|s| std::array::from_fn(|k| s[k])).collect()
    }

    fn add_force(&mut self, backend: &GpuBackend, u: &GpuVector, f: &mut GpuVector) -> Result<(), LeftDomain> {
        let bound = Bound { displacement: Some(u.memory()), ..Bound::default() };
        self.passes(backend, (Of::All, Pass::Force), &bound, 1.0, f);
        if self.domains == Domains::AtOnce {
            return self.inside(backend);
        }
        self.domains = Domains::Kept;
        Ok(())
    }

    fn defer_domains(&mut self, defer: bool) {
        self.domains = if defer { Domains::Deferred } else { Domains::AtOnce };
    }

    fn check_domains(&mut self, backend: &GpuBackend) -> Result<(), LeftDomain> {
        self.inside(backend)
    }

    fn prepare(&mut self, backend: &GpuBackend, u: &GpuVector) {
        if self.depends {
            backend.copy(u, self.state.get_or_insert_with(|| backend.zeros()));
        }
    }

    fn forget_tangent(&mut self, _: &GpuBackend) {
        self.state = None;
        self.passes.forget_tangent();
    }

    fn add_dforce(&mut self, backend: &GpuBackend, du: &GpuVector, factor: f64, df: &mut GpuVector) {
        self.tangent_is_taken(backend);
        let bound = Bound { increment: Some(du.memory()), ..Bound::default() };
        self.passes(backend, (Of::All, Pass::DForce), &bound, factor, df);
    }

    fn add_diagonal(&mut self, backend: &GpuBackend, factor: f64, d: &mut GpuVector) {
        self.tangent_is_taken(backend);
        self.passes(backend, (Of::All, Pass::Diagonal), &Bound::default(), factor, d);
    }

    fn add_dforce_at(&mut self, backend: &GpuBackend, u: &GpuVector, du: &GpuVector, factor: f64, df: &mut GpuVector) {
        let bound = Bound { displacement: Some(u.memory()), increment: Some(du.memory()), ..Bound::default() };
        self.passes(backend, (Of::All, Pass::DForce), &bound, factor, df);
    }

    fn add_diagonal_at(&mut self, backend: &GpuBackend, u: &GpuVector, factor: f64, d: &mut GpuVector) {
        let bound = Bound { displacement: Some(u.memory()), ..Bound::default() };
        self.passes(backend, (Of::All, Pass::Diagonal), &bound, factor, d);
    }

    fn add_damping(&mut self, backend: &GpuBackend, at: [&GpuVector; 2], factor: f64, f: &mut GpuVector) {
        self.passes(backend, (Of::Damped, Pass::Damping), &rate_at(at), factor, f);
    }

    fn add_ddamping(
        &mut self,
        backend: &GpuBackend,
        at: [&GpuVector; 2],
        dv: &GpuVector,
        factor: f64,
        df: &mut GpuVector,
    ) {
        let bound = Bound { increment: Some(dv.memory()), ..rate_at(at) };
        self.passes(backend, (Of::Damped, Pass::DDamping), &bound, factor, df);
    }

    fn add_damping_diagonal(&mut self, backend: &GpuBackend, at: [&GpuVector; 2], factor: f64, d: &mut GpuVector) {
        self.passes(backend, (Of::Damped, Pass::DampingDiagonal), &rate_at(at), factor, d);
    }

    fn product(
        &mut self,
        backend: &GpuBackend,
        operator: &Operator<GpuBackend>,
        x: &GpuVector,
        y: &mut GpuVector,
        registers: &mut GpuRegisters,
    ) {
        self.tangent_is_taken(backend);
        let bound = Bound { increment: Some(x.memory()), gate: Some(registers.memory()), ..Bound::default() };
        // Without masses their factor is 0, and x as good as any.
        let (masses, vectors) = (operator.masses.diagonal().unwrap_or(x), [x, &*y]);
        // Lumped masses come with the first part; the consistent matrix has a pass of its own before it.
        let lumped = operator.masses.matrix().is_none().then_some(operator.mass);
        if let Some(matrix) = operator.masses.matrix() {
            backend.product(operator.mass, matrix, vectors, true, registers.memory());
        }
        let first = (operator.stiffness, lumped);
        self.part_of_product(backend, (Of::All, Pass::DForce), &bound, first, masses, vectors);
        if let Some(damping) = &operator.damping {
            let [u, v] = [damping.u, damping.v].map(|vector| Some(vector.memory()));
            let bound = Bound { displacement: u, velocity: v, ..bound };
            for (factor, pass) in
                [(damping.viscosity, (Of::Damped, Pass::DDamping)), (damping.stiffness, (Of::All, Pass::DForce))]
            {
                if factor != 0.0 {
                    self.part_of_product(backend, pass, &bound, (factor, None), masses, vectors);
                }
            }
        }
        // x has nothing along what is held: the sum is that of the projected product too.
        backend.project_held(y);
        let groups = self.recorder.groups(backend.nodes(), self.work_group_size);
        backend.sum_is_pending(groups);
    }
}

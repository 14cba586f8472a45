//! The elements of a body on a GPU: two passes (Faure et al. 2012, Algorithm 1), a page of the mesh at a time.
//!
//! Pass 1: one invocation an element writes the partial force of each of its nodes into that node's own slot. Pass 2: one
//! invocation a node sums its slots in ascending order. No two invocations write one place. A page is as much of the mesh
//! as the device can bind; smaller bodies have one. Pages take turns with one buffer of slots.

use std::collections::HashMap;
use std::rc::Rc;

use tensormass_kernels::LawEntry;
use tensormass_kernels::generated::{NODE_PRODUCT, NODE_SUM};
use tensormass_kernels::shader::{Binding, Shader};

use crate::backend::{Backend, ForceField, LeftDomain, Operator};
use crate::body::{Body, LawBatch};
use crate::device::DeviceError;
use crate::mesh::{Incidence, NodeId};

use super::backend::{GpuBackend, GpuRegisters, GpuVector, open_gate};
use super::recorder::{Kernel, Memory, Recorder};
use super::shaders::{Access, Operation};

/// Bytes of slots an element: the largest of its buffers.
const SLOT_BYTES: u64 = 64;

/// Elements of one law within a page.
struct Range {
    law: &'static LawEntry,
    /// The mesh's number of each element.
    elements: Vec<u32>,
    /// Constants between one element's set and the next.
    stride: u32,
    nodes: Memory,
    rest: Memory,
    constants: Memory,
    slot_index: Memory,
    /// Only where the law has a domain.
    margins: Option<Memory>,
    /// For what an output pass writes, made when one is asked for.
    output: Option<Memory>,
}

/// Elements whose slots fit into one binding, and where each node's slots begin.
struct Page {
    ranges: Vec<Range>,
    offsets: Memory,
}

/// A pass of a law; none of damping where the law has no dissipation.
type Pass = fn(&LawEntry) -> Option<&'static Shader>;

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
    /// The displacement at which the tangent is taken; none where no law's tangent depends on it.
    state: Option<GpuVector>,
    gate: Memory,
    elements: usize,
    /// Compiled passes, by the place of their text and the stride of their constants.
    kernels: HashMap<(*const u8, u32), Rc<Kernel>>,
    work_group_size: u32,
    elements_per_invocation: u32,
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
    /// An element has no kernels here, a buffer is larger than the device can bind, or the device has failed.
    pub fn new(backend: &GpuBackend, body: &Body) -> Result<Self, DeviceError> {
        if let Some(other) = body.batches.iter().find(|batch| !batch.element.info.is_linear_simplex) {
            return Err(DeviceError::Element { element: other.element.info.name });
        }
        let recorder = Rc::clone(backend.recorder());
        let options = backend.options();
        let limit = recorder.gpu().limits().storage_binding_bytes;
        let limit = options.binding_bytes.map_or(limit, |bytes| bytes.min(limit));
        let pages = |of: &dyn Fn(&LawBatch) -> bool| -> Result<Vec<Page>, DeviceError> {
            paged(body.batches.iter().filter(|b| of(b)), limit).iter().map(|p| Page::new(&recorder, body, p)).collect()
        };
        let dissipative = |b: &LawBatch| b.law.damping.is_some();
        let mixed = body.is_viscous() && !body.batches.iter().all(dissipative);
        let damped = if mixed { Some(pages(&dissipative)?) } else { None };
        let pages = pages(&|_| true)?;
        let largest = pages.iter().map(Page::elements).max().unwrap_or(0);
        let depends = |shader: &Shader| shader.bindings.contains(&Binding::Displacement);
        let state = body.batches.iter().map(|b| b.law.shaders).any(|s| depends(&s.dforce) || depends(&s.diagonal));
        let field = Self {
            slots: recorder.memory("partial forces", SLOT_BYTES * largest as u64)?,
            state: state.then(|| backend.zeros()),
            gate: recorder.filled("a gate", &open_gate())?,
            elements: body.elements.len(),
            kernels: HashMap::new(),
            work_group_size: options.work_group_size,
            elements_per_invocation: options.elements_per_invocation,
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

    fn kernel(&mut self, shader: &Shader, stride: u32, label: &str) -> Rc<Kernel> {
        let Self { kernels, recorder, work_group_size, elements_per_invocation, .. } = self;
        let made = kernels.entry((shader.text.as_ptr(), stride)).or_insert_with(|| {
            let access = |b: &Binding| match (b.is_uniform(), b.is_written()) {
                (true, _) => Access::Uniform,
                (false, true) => Access::Write,
                (false, false) => Access::Read,
            };
            let bindings: Vec<Access> = shader.bindings.iter().map(access).collect();
            let mut constants = vec![("work_group_size", f64::from(*work_group_size))];
            if shader.bindings.contains(&Binding::ElementPass) {
                constants.push(("elements_per_invocation", f64::from(*elements_per_invocation)));
            }
            if shader.bindings.contains(&Binding::Constants) {
                constants.push(("constants_stride", f64::from(stride)));
            }
            recorder.kernel(label, shader.text, &bindings, &constants)
        });
        Rc::clone(made)
    }

    /// The pages of some elements: where every law has a dissipation, those of all.
    fn pages_of(&self, of: Of) -> &[Page] {
        match (of, &self.damped) {
            (Of::Damped, Some(damped)) => damped,
            (Of::All | Of::Damped, _) => &self.pages,
        }
    }

    /// Pass 1 of one page: a pass of each law.
    fn element_passes(&mut self, of: Of, page: usize, pass: Pass, bound: &Bound) {
        for range in 0..self.pages_of(of)[page].ranges.len() {
            let Range { stride, law, .. } = self.pages_of(of)[page].ranges[range];
            let shader = pass(law).expect("damping runs over laws with a dissipation");
            let kernel = self.kernel(shader, stride, law.info.name);
            let range = &self.pages_of(of)[page].ranges[range];
            let storage: Vec<&Memory> = shader.bindings[1..].iter().map(|&b| self.buffer(b, range, bound)).collect();
            let count = range.elements.len();
            let invocations = count.div_ceil(self.elements_per_invocation as usize);
            let groups = self.recorder.groups(invocations, self.work_group_size);
            self.recorder.dispatch(&kernel, [count as u32, 0, 0, 0], &storage, groups);
        }
    }

    fn buffer<'a>(&'a self, binding: Binding, range: &'a Range, bound: &Bound<'a>) -> &'a Memory {
        let state = || self.state.as_ref().map(GpuVector::memory);
        let found = match binding {
            Binding::Nodes => Some(&range.nodes),
            Binding::Rest => Some(&range.rest),
            Binding::Constants => Some(&range.constants),
            Binding::SlotIndex => Some(&range.slot_index),
            Binding::Slots => Some(&self.slots),
            Binding::Margins => range.margins.as_ref(),
            Binding::Energies | Binding::Stresses => range.output.as_ref(),
            Binding::Displacement => bound.displacement.or_else(state),
            Binding::Velocity => bound.velocity,
            Binding::Increment => bound.increment,
            Binding::Gate => Some(bound.gate.unwrap_or(&self.gate)),
            Binding::ElementPass
            | Binding::NodePass
            | Binding::Offsets
            | Binding::Sum
            | Binding::Masses
            | Binding::Product
            | Binding::Partials => None,
        };
        found.expect("element passes bind what a range has or the caller gives")
    }

    /// Pass 2 of one page: y += factor times the sum of each node's slots.
    fn node_pass(&mut self, of: Of, page: usize, nodes: usize, factor: f64, y: &GpuVector) {
        let kernel = self.kernel(&NODE_SUM, 0, "sum of slots");
        let numbers = [nodes as u32, 0, (factor as f32).to_bits(), 0];
        let storage = [&self.slots, &self.pages_of(of)[page].offsets, y.memory()];
        let groups = self.recorder.groups(nodes, self.work_group_size);
        self.recorder.dispatch(&kernel, numbers, &storage, groups);
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
            let kernel = self.kernel(&NODE_PRODUCT, 0, "product at nodes");
            let mass = first.filter(|_| page == 0);
            // The slots hold -K x or -C x.
            let factors = [-factor, mass.or(first).unwrap_or(0.0)].map(|f| (f as f32).to_bits());
            let numbers = [nodes as u32, u32::from(mass.is_some()), factors[0], factors[1]];
            let storage = [
                &self.slots,
                &self.pages_of(of)[page].offsets,
                x.memory(),
                masses.memory(),
                y.memory(),
                backend.partials(),
                bound.gate.unwrap_or(&self.gate),
            ];
            self.recorder.dispatch(&kernel, numbers, &storage, groups);
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
        for page in 0..self.pages.len() {
            for range in &mut self.pages[page].ranges {
                // As large as the widest pass that was asked for: energies alone take a ninth of stresses.
                let bytes = 4 * (width * range.elements.len()) as u64;
                if range.output.as_ref().is_none_or(|output| output.bytes() < bytes) {
                    range.output = self.recorder.memory("values of elements", bytes).ok();
                }
            }
            let bound = Bound { displacement: Some(u.memory()), ..Bound::default() };
            self.element_passes(Of::All, page, pass, &bound);
        }
        let mut values = vec![f64::NAN; width * self.elements];
        for range in self.pages.iter().flat_map(|p| &p.ranges) {
            let count = width * range.elements.len();
            let read = range.output.as_ref().and_then(|output| self.recorder.read::<f32>(output, count));
            for (&e, read) in range.elements.iter().zip(read.iter().flat_map(|r| r.chunks(width))) {
                for (value, &read) in values[width * e as usize..].iter_mut().zip(read) {
                    *value = read.into();
                }
            }
        }
        values
    }
}

/// A part of one law's elements: the batch, and which of its elements.
type Part<'a> = (&'a LawBatch, std::ops::Range<usize>);

/// Elements in pages whose buffers have at most `limit` bytes.
fn paged<'a>(batches: impl Iterator<Item = &'a LawBatch>, limit: u64) -> Vec<Vec<Part<'a>>> {
    let mut pages = vec![];
    let (mut page, mut room) = (vec![], limit);
    for batch in batches {
        let count = batch.law.info.constants.len() as u64;
        let widest = if batch.per_element { SLOT_BYTES.max(4 * count) } else { SLOT_BYTES };
        let mut start = 0;
        while start < batch.elements.len() {
            let fits = (room / widest) as usize;
            if fits == 0 && !page.is_empty() {
                pages.push(std::mem::take(&mut page));
                room = limit;
                continue;
            }
            // A device that cannot bind one element cannot be used; the buffer's own error says so.
            let end = (start + fits.max(1)).min(batch.elements.len());
            page.push((batch, start..end));
            room = room.saturating_sub(widest * (end - start) as u64);
            start = end;
        }
    }
    if !page.is_empty() {
        pages.push(page);
    }
    pages
}

/// The nodes of a linear tetrahedron.
fn four(nodes: &[u32]) -> [u32; 4] {
    std::array::from_fn(|a| nodes[a])
}

impl Page {
    fn new(recorder: &Recorder, body: &Body, parts: &[Part]) -> Result<Self, DeviceError> {
        let numbers = |(batch, part): &Part| batch.elements[part.clone()].to_vec();
        let all = parts.iter().flat_map(numbers).map(|e| four(&body.elements[e as usize]).map(|n| n as usize));
        let all = all.collect::<Vec<_>>().into_flattened();
        let incidence = Incidence::of_slots(body.masses.len(), all.iter().copied());
        let mut offsets = vec![0_u32];
        let mut slot_index: Vec<[u32; 4]> = vec![[0; 4]; incidence.slots().len() / 4];
        for node in 0..body.masses.len() {
            let slots = incidence.of(NodeId(node as u32));
            let first = offsets[node];
            for (k, &slot) in slots.iter().enumerate() {
                slot_index[slot as usize / 4][slot as usize % 4] = first + k as u32;
            }
            offsets.push(first + slots.len() as u32);
        }
        let mut rest = slot_index.as_slice();
        let mut ranges = vec![];
        for (batch, part) in parts {
            let (own, others) = rest.split_at(part.len());
            rest = others;
            ranges.push(Range::new(recorder, body, batch, part.clone(), own)?);
        }
        Ok(Self { ranges, offsets: recorder.filled("slots of nodes", &offsets)? })
    }

    fn elements(&self) -> usize {
        self.ranges.iter().map(|r| r.elements.len()).sum()
    }
}

impl Range {
    fn new(
        recorder: &Recorder,
        body: &Body,
        batch: &LawBatch,
        part: std::ops::Range<usize>,
        slot_index: &[[u32; 4]],
    ) -> Result<Self, DeviceError> {
        let count = batch.law.info.constants.len();
        let constants = if batch.per_element {
            &batch.constants[part.start * count..part.end * count]
        } else {
            batch.constants.as_slice()
        };
        let elements = batch.elements[part].to_vec();
        let nodes: Vec<[u32; 4]> = elements.iter().map(|&e| four(&body.elements[e as usize])).collect();
        let row = |k: usize| {
            elements.iter().map(move |&e| {
                let r = &body.rest[e as usize][0];
                let g = &r.inverse_jacobian[3 * k..3 * k + 3];
                [g[0] as f32, g[1] as f32, g[2] as f32, if k == 0 { r.weight as f32 } else { 0.0 }]
            })
        };
        let rest: Vec<[f32; 4]> = (0..3).flat_map(row).collect();
        let constants: Vec<f32> = constants.iter().map(|&c| c as f32).collect();
        let margins = match batch.law.shaders.force.bindings.contains(&Binding::Margins) {
            true => Some(recorder.memory("margins of elements", 4 * elements.len() as u64)?),
            false => None,
        };
        Ok(Self {
            law: batch.law,
            stride: if batch.per_element { count as u32 } else { 0 },
            nodes: recorder.filled("nodes of elements", &nodes)?,
            rest: recorder.filled("rest data of elements", &rest)?,
            constants: recorder.filled("constants of materials", &constants)?,
            slot_index: recorder.filled("slots of elements", slot_index)?,
            margins,
            output: None,
            elements,
        })
    }
}

const DFORCE: Pass = |law| Some(&law.shaders.dforce);
const DIAGONAL: Pass = |law| Some(&law.shaders.diagonal);
const DDAMPING: Pass = |law| law.damping.map(|damping| &damping.shaders.ddamping);

/// What damping binds of a displacement and a velocity.
fn rate_at<'a>([u, v]: [&'a GpuVector; 2]) -> Bound<'a> {
    Bound { displacement: Some(u.memory()), velocity: Some(v.memory()), ..Bound::default() }
}

impl ForceField<GpuBackend> for GpuField {
    fn element_energies(&mut self, backend: &GpuBackend, u: &GpuVector) -> Result<Vec<f64>, LeftDomain> {
        let energies = self.output(u, |law| Some(&law.shaders.energy), 1);
        self.inside(backend)?;
        Ok(energies)
    }

    fn cauchy(&mut self, _: &GpuBackend, u: &GpuVector) -> Vec<[f64; 9]> {
        let values = self.output(u, |law| Some(&law.shaders.cauchy), 9);
        values.chunks_exact(9).map(|s| std::array::from_fn(|k| s[k])).collect()
    }

    fn add_force(&mut self, backend: &GpuBackend, u: &GpuVector, f: &mut GpuVector) -> Result<(), LeftDomain> {
        let bound = Bound { displacement: Some(u.memory()), ..Bound::default() };
        self.passes(backend, (Of::All, |law| Some(&law.shaders.force)), &bound, 1.0, f);
        self.inside(backend)
    }

    fn prepare(&mut self, backend: &GpuBackend, u: &GpuVector) {
        if let Some(state) = &mut self.state {
            backend.copy(u, state);
        }
    }

    fn add_dforce(&mut self, backend: &GpuBackend, du: &GpuVector, factor: f64, df: &mut GpuVector) {
        let bound = Bound { increment: Some(du.memory()), ..Bound::default() };
        self.passes(backend, (Of::All, DFORCE), &bound, factor, df);
    }

    fn add_diagonal(&mut self, backend: &GpuBackend, factor: f64, d: &mut GpuVector) {
        self.passes(backend, (Of::All, DIAGONAL), &Bound::default(), factor, d);
    }

    fn add_dforce_at(&mut self, backend: &GpuBackend, u: &GpuVector, du: &GpuVector, factor: f64, df: &mut GpuVector) {
        let bound = Bound { displacement: Some(u.memory()), increment: Some(du.memory()), ..Bound::default() };
        self.passes(backend, (Of::All, DFORCE), &bound, factor, df);
    }

    fn add_diagonal_at(&mut self, backend: &GpuBackend, u: &GpuVector, factor: f64, d: &mut GpuVector) {
        let bound = Bound { displacement: Some(u.memory()), ..Bound::default() };
        self.passes(backend, (Of::All, DIAGONAL), &bound, factor, d);
    }

    fn add_damping(&mut self, backend: &GpuBackend, at: [&GpuVector; 2], factor: f64, f: &mut GpuVector) {
        self.passes(backend, (Of::Damped, |law| law.damping.map(|d| &d.shaders.damping)), &rate_at(at), factor, f);
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
        self.passes(backend, (Of::Damped, DDAMPING), &bound, factor, df);
    }

    fn add_damping_diagonal(&mut self, backend: &GpuBackend, at: [&GpuVector; 2], factor: f64, d: &mut GpuVector) {
        self.passes(backend, (Of::Damped, |law| law.damping.map(|d| &d.shaders.diagonal)), &rate_at(at), factor, d);
    }

    fn product(
        &mut self,
        backend: &GpuBackend,
        operator: &Operator<GpuBackend>,
        x: &GpuVector,
        y: &mut GpuVector,
        registers: &mut GpuRegisters,
    ) {
        let bound = Bound { increment: Some(x.memory()), gate: Some(registers.memory()), ..Bound::default() };
        let (masses, vectors) = (operator.masses, [x, &*y]);
        let first = (operator.stiffness, Some(operator.mass));
        self.part_of_product(backend, (Of::All, DFORCE), &bound, first, masses, vectors);
        if let Some(damping) = &operator.damping {
            let [u, v] = [damping.u, damping.v].map(|vector| Some(vector.memory()));
            let bound = Bound { displacement: u, velocity: v, ..bound };
            for (factor, pass) in [(damping.viscosity, (Of::Damped, DDAMPING)), (damping.stiffness, (Of::All, DFORCE))]
            {
                if factor != 0.0 {
                    self.part_of_product(backend, pass, &bound, (factor, None), masses, vectors);
                }
            }
        }
        let groups = self.recorder.groups(backend.nodes(), self.work_group_size);
        backend.sum_is_pending(groups);
    }
}

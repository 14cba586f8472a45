//! Kernels, buffers and the list of dispatches: recorded until a result is wanted, then submitted at once.
//!
//! Dispatches run in the order in which they were recorded. What the host writes is ordered with them: numbers of a
//! pass and values of motions travel with the submission that uses them; a buffer is written between two submissions.

use std::cell::{Cell, OnceCell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use crate::backend::Counts;
use crate::device::DeviceError;
use crate::device_memory::{self, ALIGNMENT, PASSES};
use crate::inventory::names::{MOTIONS, NUMBERS, RESULTS};
use crate::inventory::{Lease, Ledger, Tally};

use super::device::Gpu;
use super::pipelines::Pipeline;
use super::shaders::Access;

/// Bytes of the numbers of all passes of a submission.
const NUMBERS_BYTES: u64 = PASSES * ALIGNMENT;

/// The numbers of a pass, as bits: four of 32 bits each.
pub(super) type Numbers = [u32; 4];

/// A buffer on the device.
#[derive(Debug)]
pub(super) struct Memory {
    id: u64,
    buffer: wgpu::Buffer,
    _lease: Lease,
}

/// A compiled shader.
#[derive(Debug)]
pub(super) struct Kernel {
    id: u64,
    tally: Tally,
    compiled: Pipeline,
}

/// Records dispatches and hands them over; counts both.
#[derive(Debug)]
pub(super) struct Recorder {
    gpu: Arc<Gpu>,
    ledger: Ledger,
    uniforms: wgpu::Buffer,
    _lease: Lease,
    /// Values of motions, where there are some.
    values: OnceCell<Memory>,
    /// Values of motions that one submission takes.
    capacity: usize,
    next: Cell<u64>,
    list: RefCell<List>,
    groups: RefCell<HashMap<(u64, Vec<u64>), wgpu::BindGroup>>,
    staging: RefCell<Option<(wgpu::Buffer, Lease)>>,
    counts: Cell<Counts>,
}

/// What was recorded since the last submission.
#[derive(Debug, Default)]
struct List {
    // In this order: the pass ends before its encoder.
    pass: Option<wgpu::ComputePass<'static>>,
    encoder: Option<wgpu::CommandEncoder>,
    uniforms: Vec<u8>,
    /// The numbers of the last submission, which are on the device: those of a solver's iterations are often the same.
    written: Vec<u8>,
    offsets: HashMap<Numbers, u32>,
    values: Vec<f32>,
}

impl Recorder {
    /// A recorder whose submissions take this many values of motions.
    pub(super) fn new(gpu: Arc<Gpu>, capacity: usize) -> Self {
        let uniforms = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(NUMBERS),
            size: NUMBERS_BYTES,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let ledger = Ledger::default();
        Self {
            _lease: ledger.hold(NUMBERS, NUMBERS_BYTES as usize),
            ledger,
            uniforms,
            values: OnceCell::new(),
            capacity,
            gpu,
            next: Cell::new(1),
            list: RefCell::default(),
            groups: RefCell::default(),
            staging: RefCell::default(),
            counts: Cell::default(),
        }
    }

    pub(super) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    pub(super) fn counts(&self) -> Counts {
        self.counts.get()
    }

    pub(super) fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// The values that [`Recorder::motions`] records, as an argument.
    pub(super) fn values(&self) -> &Memory {
        self.values.get_or_init(|| self.memory(MOTIONS, 4 * self.capacity as u64).expect("a few numbers a motion"))
    }

    fn id(&self) -> u64 {
        self.next.replace(self.next.get() + 1)
    }

    /// A buffer of zeros for storage; at least 16 bytes, because an empty one cannot be bound.
    ///
    /// # Errors
    /// It is larger than the device can bind.
    pub(super) fn memory(&self, what: &'static str, bytes: u64) -> Result<Memory, DeviceError> {
        self.fits(what, bytes)?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let size = device_memory::bytes(bytes);
        let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size,
            usage,
            mapped_at_creation: false,
        });
        Ok(Memory { id: self.id(), buffer, _lease: self.ledger.hold(what, size as usize) })
    }

    /// Whether the device can bind a buffer of this size.
    ///
    /// # Errors
    /// It cannot.
    pub(super) fn fits(&self, what: &str, bytes: u64) -> Result<(), DeviceError> {
        let limit = self.gpu.limits().storage_binding_bytes.min(self.gpu.limits().buffer_bytes);
        if bytes > limit {
            return Err(DeviceError::TooLarge { what: what.to_string(), bytes, limit });
        }
        Ok(())
    }

    /// A buffer with this content.
    ///
    /// # Errors
    /// It is larger than the device can bind.
    pub(super) fn filled<T: bytemuck::Pod>(&self, what: &'static str, content: &[T]) -> Result<Memory, DeviceError> {
        let memory = self.memory(what, size_of_val(content) as u64)?;
        self.write(&memory, content);
        Ok(memory)
    }

    /// As [`Recorder::filled`]; a buffer of nothing where the device cannot bind as much, which it says when it is checked.
    pub(super) fn filled_or_failed<T: bytemuck::Pod>(&self, what: &'static str, content: &[T]) -> Memory {
        self.filled(what, content).unwrap_or_else(|error| {
            self.gpu.fail(error);
            self.memory(what, 0).expect("16 bytes")
        })
    }

    /// Writes a buffer, after everything that was recorded until now.
    pub(super) fn write<T: bytemuck::Pod>(&self, memory: &Memory, content: &[T]) {
        self.submit();
        self.gpu.queue.write_buffer(&memory.buffer, 0, bytemuck::cast_slice(content));
    }

    /// A compiled shader that binds these in order; constants are the pipeline's parameters.
    pub(super) fn kernel(&self, label: &str, text: &str, bindings: &[Access], constants: &[(&str, f64)]) -> Rc<Kernel> {
        let compiled = self.gpu.pipeline(label, (text, bindings, constants));
        Rc::new(Kernel { id: self.id(), tally: self.ledger.kernel(label), compiled })
    }

    /// Work groups in two dimensions for this many invocations; their product may be a little more than needed.
    pub(super) fn groups(&self, invocations: usize, group: u32) -> [u32; 2] {
        let all = invocations.div_ceil(group as usize).max(1);
        let rows = all.div_ceil(self.gpu.limits().workgroups_per_dimension as usize);
        [all.div_ceil(rows) as u32, rows as u32]
    }

    /// Records one dispatch; `storage` follows the uniform, which is binding 0.
    pub(super) fn dispatch(&self, kernel: &Kernel, numbers: Numbers, storage: &[&Memory], groups: [u32; 2]) {
        if self.list.borrow().offsets.len() as u64 == PASSES {
            self.submit();
        }
        let mut list = self.list.borrow_mut();
        let offset = list.offset(numbers);
        let pass = list.pass(&self.gpu.device);
        pass.set_pipeline(&kernel.compiled.pipeline);
        let key = (kernel.id, storage.iter().map(|m| m.id).collect());
        let mut bound = self.groups.borrow_mut();
        let group = bound.entry(key).or_insert_with(|| self.bind(kernel, storage));
        pass.set_bind_group(0, &*group, &[offset]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
        kernel.tally.ran();
        self.count(|c| c.dispatches += 1);
    }

    /// Lets go of what binds buffers and kernels that are gone: it keeps them.
    pub(super) fn unbind(&self) {
        self.submit();
        self.groups.borrow_mut().clear();
    }

    fn bind(&self, kernel: &Kernel, storage: &[&Memory]) -> wgpu::BindGroup {
        let size = wgpu::BufferSize::new(size_of::<Numbers>() as u64);
        let uniform = wgpu::BufferBinding { buffer: &self.uniforms, offset: 0, size };
        let first = wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(uniform) };
        let others = storage
            .iter()
            .enumerate()
            .map(|(k, m)| wgpu::BindGroupEntry { binding: k as u32 + 1, resource: m.buffer.as_entire_binding() });
        let entries: Vec<_> = std::iter::once(first).chain(others).collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &kernel.compiled.layout,
            entries: &entries,
        })
    }

    /// Records values of motions for dispatches of the same submission; where they begin in [`Recorder::values`].
    pub(super) fn motions(&self, values: &[f64]) -> u32 {
        if self.list.borrow().values.len() + values.len() > self.capacity {
            self.submit();
        }
        let mut list = self.list.borrow_mut();
        let first = list.values.len() as u32;
        list.values.extend(values.iter().map(|&v| v as f32));
        first
    }

    /// Hands over what was recorded.
    pub(super) fn submit(&self) {
        let mut list = self.list.borrow_mut();
        list.pass = None;
        let Some(encoder) = list.encoder.take() else { return };
        let queue = &self.gpu.queue;
        if !list.written.starts_with(&list.uniforms) {
            queue.write_buffer(&self.uniforms, 0, &list.uniforms);
            list.written = list.uniforms.clone();
        }
        if !list.values.is_empty() {
            queue.write_buffer(&self.values().buffer, 0, bytemuck::cast_slice(&list.values));
        }
        queue.submit([encoder.finish()]);
        list.uniforms.clear();
        list.offsets.clear();
        list.values.clear();
        self.count(|c| c.submissions += 1);
    }

    /// The first `count` numbers of a buffer, after everything that was recorded: waits for the device. None if it has
    /// failed; the reason is in [`Gpu::check`].
    pub(super) fn read<T: bytemuck::Pod>(&self, memory: &Memory, count: usize) -> Option<Vec<T>> {
        let bytes = (count * size_of::<T>()) as u64;
        let staging = self.staging(bytes);
        {
            let mut list = self.list.borrow_mut();
            list.pass = None;
            let encoder = list.encoder(&self.gpu.device);
            encoder.copy_buffer_to_buffer(&memory.buffer, 0, &staging, 0, bytes);
        }
        self.submit();
        self.count(|c| {
            c.readbacks += 1;
            c.bytes_read += bytes;
        });
        staging.map_async(wgpu::MapMode::Read, 0..bytes, |_| {});
        let content = match self.gpu.wait() {
            Ok(()) => staging.get_mapped_range(0..bytes).ok().map(|range| bytemuck::pod_collect_to_vec(&range)),
            Err(_) => None,
        };
        staging.unmap();
        content
    }

    /// A buffer that the host can read, of at least this size.
    fn staging(&self, bytes: u64) -> wgpu::Buffer {
        let mut kept = self.staging.borrow_mut();
        match &*kept {
            Some((buffer, _)) if buffer.size() >= bytes => buffer.clone(),
            _ => {
                // The old one goes first.
                *kept = None;
                let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
                let size = bytes.next_power_of_two();
                let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(RESULTS),
                    size,
                    usage,
                    mapped_at_creation: false,
                });
                let lease = self.ledger.hold(RESULTS, size as usize);
                kept.insert((buffer, lease)).0.clone()
            }
        }
    }

    fn count(&self, change: impl FnOnce(&mut Counts)) {
        let mut counts = self.counts.get();
        change(&mut counts);
        self.counts.set(counts);
    }
}

impl List {
    fn encoder(&mut self, device: &wgpu::Device) -> &mut wgpu::CommandEncoder {
        self.encoder.get_or_insert_with(|| device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default()))
    }

    fn pass(&mut self, device: &wgpu::Device) -> &mut wgpu::ComputePass<'static> {
        if self.pass.is_none() {
            let pass = self.encoder(device).begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            self.pass = Some(pass.forget_lifetime());
        }
        self.pass.as_mut().expect("it was begun above")
    }

    /// Where the numbers of a pass lie: once for equal ones.
    fn offset(&mut self, numbers: Numbers) -> u32 {
        let List { uniforms, offsets, .. } = self;
        *offsets.entry(numbers).or_insert_with(|| {
            let offset = uniforms.len();
            uniforms.extend_from_slice(bytemuck::bytes_of(&numbers));
            uniforms.resize(offset + ALIGNMENT as usize, 0);
            offset as u32
        })
    }
}

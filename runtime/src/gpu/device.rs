//! The GPUs of this machine: listing them, opening one, and hearing of what goes wrong on it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};

use crate::device::{DeviceChoice, DeviceError, DeviceFeatures, DeviceInfo, DeviceKind, DeviceLimits, select};

use super::pipelines::{Pipeline, Pipelines};
use super::shaders::Access;

/// Sizes that we ask for beyond WebGPU's are multiples of this: wherever a buffer is split, its parts can be bound.
const ALIGNMENT: u64 = 256;

/// The GPUs of this machine, software devices included: hardware first (discrete, integrated, virtual, other); within
/// a kind in the order in which the drivers list them, which is the same each time.
pub fn adapters() -> Vec<DeviceInfo> {
    enumerate().into_iter().map(|(_, info)| info).collect()
}

/// Opens the chosen device; none if that is the CPU.
///
/// `auto` takes a hardware GPU if there is one, otherwise the CPU, never a software device. `gpu` takes any, hardware
/// first; [`Gpu::is_software`] tells the caller, who warns. `gpu:NAME` takes the device of that name, otherwise the
/// first of [`adapters`] whose name contains it, in whatever case; see [`select`].
///
/// # Errors
/// [`DeviceError::NoAdapter`] if a GPU is asked for and there is none, or if it cannot be opened;
/// [`DeviceError::UnknownName`] if none has that name.
pub fn open(choice: &DeviceChoice) -> Result<Option<Gpu>, DeviceError> {
    if *choice == DeviceChoice::Cpu {
        return Ok(None);
    }
    let (adapters, infos): (Vec<_>, Vec<_>) = enumerate().into_iter().unzip();
    match select(choice, &infos)? {
        Some(place) => Gpu::new(&adapters[place], infos[place].clone()).map(Some),
        None => Ok(None),
    }
}

/// An open device, its queue, and the first thing that went wrong on it.
#[derive(Debug)]
pub struct Gpu {
    /// Makes buffers, pipelines and encoders. Poll it through [`Gpu::wait`] only, which cannot panic.
    pub device: wgpu::Device,
    /// Takes commands.
    pub queue: wgpu::Queue,
    info: DeviceInfo,
    limits: DeviceLimits,
    pipelines: Pipelines,
    faults: Faults,
}

impl Gpu {
    /// Opens an adapter with WebGPU's default limits, and with buffers and bindings as large as it offers.
    fn new(adapter: &wgpu::Adapter, info: DeviceInfo) -> Result<Self, DeviceError> {
        let request = wgpu::DeviceDescriptor {
            label: Some("tensormass"),
            required_limits: required(&adapter.limits()),
            // Buffers are made once a run: what counts is the memory they take, not the time to make them.
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&request))
            .map_err(|e| DeviceError::NoAdapter { reason: format!("`{}` cannot be opened: {e}", info.name) })?;
        let faults = Faults::default();
        // Without a handler of ours, wgpu ends the process.
        let uncaptured = faults.clone();
        device.on_uncaptured_error(Arc::new(move |error| uncaptured.record(fault(error))));
        let lost = faults.clone();
        device.set_device_lost_callback(move |reason, text| {
            let reason = match (reason, text.trim()) {
                (wgpu::DeviceLostReason::Destroyed, _) => "it was closed".to_owned(),
                (wgpu::DeviceLostReason::Unknown, "") => "its driver gives no reason".to_owned(),
                (wgpu::DeviceLostReason::Unknown, text) => text.to_owned(),
            };
            lost.record(DeviceError::Lost { reason });
        });
        let limits = limits(&device.limits());
        Ok(Self { device, queue, info, limits, pipelines: Pipelines::default(), faults })
    }

    /// What it is.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// What may be used of it: WebGPU's defaults, with buffers and bindings as large as the adapter offers, in
    /// multiples of 256 bytes. [`DeviceInfo::limits`] is what the adapter has.
    pub fn limits(&self) -> &DeviceLimits {
        &self.limits
    }

    /// Whether it is a driver that computes on the CPU.
    pub fn is_software(&self) -> bool {
        !self.info.kind.is_hardware()
    }

    /// A shader's text compiled for the device, with how it binds buffers and its parameters: once.
    pub(super) fn pipeline(&self, label: &str, shader: (&str, &[Access], &[(&str, f64)])) -> Pipeline {
        self.pipelines.get(&self.device, label, shader)
    }

    /// How many different kernels it has compiled.
    pub fn kernels(&self) -> usize {
        self.pipelines.count()
    }

    /// The first thing that went wrong, as far as it is known by now.
    ///
    /// # Errors
    /// That thing: [`DeviceError::OutOfMemory`], [`DeviceError::Refused`] or [`DeviceError::Lost`].
    pub fn check(&self) -> Result<(), DeviceError> {
        match self.faults.first() {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    /// Says that something went wrong where no error can be returned.
    pub(super) fn fail(&self, error: DeviceError) {
        self.faults.record(error);
    }

    /// Waits until everything submitted is done and its callbacks have been called.
    ///
    /// # Errors
    /// As [`Gpu::check`]; a device that is lost meanwhile is [`DeviceError::Lost`].
    pub fn wait(&self) -> Result<(), DeviceError> {
        if let Err(reason) = finished(|| self.device.poll(wgpu::PollType::wait_indefinitely())) {
            // Kept only if wgpu has not called back before, with what the driver said.
            self.faults.record(DeviceError::Lost { reason });
        }
        self.check()
    }

    /// Closes the device: from here on nothing is computed, and [`Gpu::wait`] reports the loss. Tests provoke it so.
    pub fn destroy(&self) {
        self.device.destroy();
    }
}

/// Whether a wait came to its end; why not, otherwise. wgpu panics if the driver reports a failure meanwhile: that the
/// device is lost is news from outside, not a defect, and must not end the process.
fn finished<T>(wait: impl FnOnce() -> Result<T, wgpu::PollError>) -> Result<(), String> {
    match catch_unwind(AssertUnwindSafe(wait)) {
        Ok(Ok(_)) => Ok(()),
        Ok(Err(error)) => Err(error.to_string()),
        Err(panic) => {
            let formatted = panic.downcast_ref::<String>().map(String::as_str);
            let text = formatted.or_else(|| panic.downcast_ref::<&str>().copied());
            Err(text.unwrap_or("its driver reported a failure").trim().to_owned())
        }
    }
}

/// The first thing that went wrong, shared with wgpu's callbacks. What follows from it says less.
#[derive(Debug, Clone, Default)]
struct Faults(Arc<Mutex<Option<DeviceError>>>);

impl Faults {
    fn record(&self, error: DeviceError) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    fn first(&self) -> Option<DeviceError> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// wgpu's error as ours.
fn fault(error: wgpu::Error) -> DeviceError {
    match error {
        wgpu::Error::OutOfMemory { source } => DeviceError::OutOfMemory { what: source.to_string() },
        wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
            DeviceError::Refused(description.trim().to_owned())
        }
    }
}

/// The adapters and what they are, in the order of [`adapters`].
fn enumerate() -> Vec<(wgpu::Adapter, DeviceInfo)> {
    // wgpu panics where it knows no backend for the system at all.
    if wgpu::Instance::enabled_backend_features().is_empty() {
        return Vec::new();
    }
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let describe = |adapter| {
        let info = describe(&adapter);
        (adapter, info)
    };
    let mut all: Vec<_> = adapters.into_iter().map(describe).collect();
    // A stable sort: within a kind the drivers' order stays.
    all.sort_by_key(|(_, info)| info.kind);
    all
}

/// What an adapter is.
fn describe(adapter: &wgpu::Adapter) -> DeviceInfo {
    let info = adapter.get_info();
    let features = adapter.features();
    DeviceInfo {
        name: info.name,
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => DeviceKind::Discrete,
            wgpu::DeviceType::IntegratedGpu => DeviceKind::Integrated,
            wgpu::DeviceType::VirtualGpu => DeviceKind::Virtual,
            wgpu::DeviceType::Other => DeviceKind::Other,
            wgpu::DeviceType::Cpu => DeviceKind::Software,
        },
        backend: info.backend.to_str().to_owned(),
        driver: info.driver,
        driver_info: info.driver_info,
        limits: limits(&adapter.limits()),
        features: DeviceFeatures {
            shader_f64: features.contains(wgpu::Features::SHADER_F64),
            subgroup: features.contains(wgpu::Features::SUBGROUP),
            shader_float32_atomic: features.contains(wgpu::Features::SHADER_FLOAT32_ATOMIC),
            timestamp_query: features.contains(wgpu::Features::TIMESTAMP_QUERY),
        },
        unusable: unusable(&adapter.limits()),
    }
}

/// Those of wgpu's limits that we depend on.
fn limits(limits: &wgpu::Limits) -> DeviceLimits {
    DeviceLimits {
        storage_buffers_per_stage: limits.max_storage_buffers_per_shader_stage,
        invocations_per_workgroup: limits.max_compute_invocations_per_workgroup,
        workgroup_bytes: limits.max_compute_workgroup_storage_size,
        storage_binding_bytes: limits.max_storage_buffer_binding_size,
        buffer_bytes: limits.max_buffer_size,
        workgroups_per_dimension: limits.max_compute_workgroups_per_dimension,
    }
}

/// What we ask of an adapter: WebGPU's defaults, and its own largest buffers and bindings.
fn required(offered: &wgpu::Limits) -> wgpu::Limits {
    let defaults = wgpu::Limits::defaults();
    let largest = |ours: u64, theirs: u64| ours.max(theirs / ALIGNMENT * ALIGNMENT);
    wgpu::Limits {
        max_storage_buffer_binding_size: largest(
            defaults.max_storage_buffer_binding_size,
            offered.max_storage_buffer_binding_size,
        ),
        max_buffer_size: largest(defaults.max_buffer_size, offered.max_buffer_size),
        ..defaults
    }
}

/// Which of WebGPU's default limits are beyond an adapter; none if it has them all.
fn unusable(offered: &wgpu::Limits) -> Option<String> {
    let mut missing = Vec::new();
    required(offered).check_limits_with_fail_fn(offered, false, |name, needed, found| {
        missing.push(format!("{name} is {found}, needed is {needed}"));
    });
    (!missing.is_empty()).then(|| missing.join(", "))
}

#[cfg(test)]
mod tests {
    use super::{Faults, finished};
    use crate::device::DeviceError;

    #[test]
    fn a_wait_that_fails_or_panics_gives_a_reason() {
        assert_eq!(finished(|| Ok(())), Ok(()));
        assert_eq!(finished(|| Err::<(), _>(wgpu::PollError::Timeout)), Err(wgpu::PollError::Timeout.to_string()));
        // As wgpu does.
        let reason = "lost".to_owned();
        let lost = || -> Result<(), wgpu::PollError> { panic!("Error in Device::poll: {reason}\n") };
        assert_eq!(finished(lost), Err("Error in Device::poll: lost".to_owned()));
        assert_eq!(finished(|| -> Result<(), wgpu::PollError> { panic!("plain") }), Err("plain".to_owned()));
    }

    #[test]
    fn the_first_fault_stays() {
        let faults = Faults::default();
        assert_eq!(faults.first(), None);
        let [first, second] = ["first", "second"].map(|text| DeviceError::Refused(text.to_owned()));
        faults.record(first.clone());
        faults.clone().record(second);
        assert_eq!(faults.first(), Some(first));
    }
}

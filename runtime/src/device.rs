//! Where to compute: the choice a user makes, the devices there are, the rule that picks one, and what can go wrong.
//!
//! Nothing here knows wgpu: a build without the feature `gpu` parses the same choices and refuses with the same words.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

/// Where a user wants to compute: `auto`, `cpu`, `gpu` or `gpu:NAME`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum DeviceChoice {
    /// A hardware GPU if there is one that can be used, otherwise the CPU; never a software device.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// Any GPU, hardware preferred; a software device if there is nothing else.
    Gpu,
    /// The GPU of this name, or whose name contains it, in whatever case.
    Named(String),
}

impl fmt::Display for DeviceChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Cpu => f.write_str("cpu"),
            Self::Gpu => f.write_str("gpu"),
            Self::Named(name) => write!(f, "gpu:{name}"),
        }
    }
}

/// A text that is no [`DeviceChoice`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a device; choose auto, cpu, gpu, or gpu:NAME with a name from `tensormass devices`")]
pub struct NotADevice(String);

impl FromStr for DeviceChoice {
    type Err = NotADevice;

    fn from_str(text: &str) -> Result<Self, NotADevice> {
        match text {
            "auto" => Ok(Self::Auto),
            "cpu" => Ok(Self::Cpu),
            "gpu" => Ok(Self::Gpu),
            _ => match text.strip_prefix("gpu:").map(str::trim) {
                Some(name) if !name.is_empty() => Ok(Self::Named(name.to_owned())),
                Some(_) | None => Err(NotADevice(text.to_owned())),
            },
        }
    }
}

/// Why a device cannot compute, or could not go on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// There is no GPU, or none that can be used.
    #[error(
        "no GPU can be used: {reason}\n  = help: install a Vulkan driver (Debian: mesa-vulkan-drivers), or choose \
         --device cpu"
    )]
    NoAdapter {
        /// What was found instead.
        reason: String,
    },
    /// No GPU has the name that was asked for.
    #[error("no GPU is named `{asked}`\n  = help: {}", known(asked, available))]
    UnknownName {
        /// The name that was asked for.
        asked: String,
        /// The names there are; at least one.
        available: Vec<String>,
    },
    /// The program was built without GPU support.
    #[error(
        "this program was built without GPU support\n  = help: build it with the feature `gpu`, or choose --device cpu"
    )]
    NoGpuSupport,
    /// A GPU was asked for, and double precision.
    #[error("a GPU computes in f32, and f64 is asked for\n  = help: choose --precision f32, or --device cpu")]
    Precision,
    /// One buffer is larger than the device can bind.
    #[error(
        "{what} would take {bytes} bytes in one buffer, and this GPU binds at most {limit}\n  = help: use a coarser \
         mesh, another GPU (`tensormass devices` tells the limits), or --device cpu"
    )]
    TooLarge {
        /// What the buffer holds.
        what: String,
        /// Its size in bytes.
        bytes: u64,
        /// The device's limit in bytes.
        limit: u64,
    },
    /// The device has no memory left.
    #[error(
        "the GPU has no memory left: {what}\n  = help: end other programs that use it, use a coarser mesh, or choose \
         --device cpu"
    )]
    OutOfMemory {
        /// What it was needed for.
        what: String,
    },
    /// The device stopped answering: its driver was reset, it hung, or it was unplugged.
    #[error(
        "the GPU was lost: {reason}\n  = help: run again, or choose --device cpu; results written until then are kept"
    )]
    Lost {
        /// What the driver said.
        reason: String,
    },
    /// A call was refused that should have been valid.
    #[error(
        "the GPU refused a call: {0}\n  = help: this is a defect of tensormass; please report it with the output of \
         `tensormass devices`, and choose --device cpu meanwhile"
    )]
    Refused(String),
}

/// "did you mean gpu:NAME? there are `a`, `b`". Names of devices are long ("llvmpipe (LLVM 15.0.6, 256 bits)"): one of
/// their words may be meant.
fn known(asked: &str, available: &[String]) -> String {
    let asked = asked.to_lowercase();
    let nearest = available
        .iter()
        .flat_map(|name| {
            let words = name.split(|c: char| !c.is_alphanumeric()).filter(|w| w.chars().count() > 2);
            words.chain([name.as_str()])
        })
        .map(|word| (strsim::osa_distance(&asked, &word.to_lowercase()), word))
        .filter(|(distance, word)| *distance <= word.chars().count() / 3)
        .min();
    let meant = nearest.map(|(_, word)| format!("did you mean gpu:{word}? ")).unwrap_or_default();
    let list: Vec<String> = available.iter().map(|name| format!("`{name}`")).collect();
    format!("{meant}available: {}", list.join(", "))
}

/// What a device is made of; in the order of preference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// A GPU with memory of its own.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A GPU that a hypervisor passes on.
    Virtual,
    /// Hardware of another kind.
    Other,
    /// A driver that computes on the CPU, such as lavapipe: right, and slower than computing on the CPU.
    Software,
}

impl DeviceKind {
    /// Whether it is more than a program on the CPU.
    pub fn is_hardware(self) -> bool {
        match self {
            Self::Discrete | Self::Integrated | Self::Virtual | Self::Other => true,
            Self::Software => false,
        }
    }
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Other => "other",
            Self::Software => "software",
        })
    }
}

/// What a device can hold and run, as far as we depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct DeviceLimits {
    /// Storage buffers that one kernel can bind.
    pub storage_buffers_per_stage: u32,
    /// Invocations of a work group.
    pub invocations_per_workgroup: u32,
    /// Memory that a work group shares, in bytes.
    pub workgroup_bytes: u32,
    /// Largest part of a buffer that a kernel can bind, in bytes.
    pub storage_binding_bytes: u64,
    /// Largest buffer, in bytes.
    pub buffer_bytes: u64,
    /// Work groups of a dispatch in each of its three dimensions.
    pub workgroups_per_dimension: u32,
}

/// What a device offers beyond what we need.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct DeviceFeatures {
    /// f64 in shaders.
    pub shader_f64: bool,
    /// Operations across the lanes of a subgroup.
    pub subgroup: bool,
    /// Atomic addition of f32.
    pub shader_float32_atomic: bool,
    /// Time stamps of passes.
    pub timestamp_query: bool,
}

impl DeviceFeatures {
    /// The names of those that are there.
    pub fn names(&self) -> Vec<&'static str> {
        [
            (self.shader_f64, "SHADER_F64"),
            (self.subgroup, "SUBGROUP"),
            (self.shader_float32_atomic, "SHADER_FLOAT32_ATOMIC"),
            (self.timestamp_query, "TIMESTAMP_QUERY"),
        ]
        .into_iter()
        .filter_map(|(there, name)| there.then_some(name))
        .collect()
    }
}

/// A GPU, or a driver that acts as one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DeviceInfo {
    /// Its name, as the driver gives it.
    pub name: String,
    /// What it is made of.
    pub kind: DeviceKind,
    /// The interface it is reached through: vulkan, metal, dx12.
    pub backend: String,
    /// The driver's name.
    pub driver: String,
    /// The driver's version.
    pub driver_info: String,
    /// What it can hold and run.
    pub limits: DeviceLimits,
    /// What it offers beyond that.
    pub features: DeviceFeatures,
    /// Why it cannot be used; none if it can.
    pub unusable: Option<String>,
}

/// The place of the chosen device in the list of all; none for the CPU.
///
/// A device that cannot be used is never chosen. Of several that can, the kind decides, in the order of
/// [`DeviceKind`], then the place in the list; an equal name comes before one that contains what is asked for.
///
/// # Errors
/// [`DeviceError::NoAdapter`] or [`DeviceError::UnknownName`] if a GPU is asked for by `gpu` or by name and there is
/// none such.
pub fn select(choice: &DeviceChoice, devices: &[DeviceInfo]) -> Result<Option<usize>, DeviceError> {
    let best = |fits: &dyn Fn(&DeviceInfo) -> bool| {
        let usable = devices.iter().enumerate().filter(|(_, d)| d.unusable.is_none() && fits(d));
        usable.min_by_key(|(_, d)| d.kind).map(|(place, _)| place)
    };
    match choice {
        DeviceChoice::Cpu => Ok(None),
        DeviceChoice::Auto => Ok(best(&|d| d.kind.is_hardware())),
        DeviceChoice::Gpu => match best(&|_| true) {
            Some(place) => Ok(Some(place)),
            None => Err(none_usable(devices.iter())),
        },
        DeviceChoice::Named(asked) => {
            let wanted = asked.to_lowercase();
            let fits = |d: &DeviceInfo| d.name.to_lowercase().contains(&wanted);
            match best(&|d| d.name.to_lowercase() == wanted).or_else(|| best(&fits)) {
                Some(place) => Ok(Some(place)),
                None if devices.is_empty() || devices.iter().any(fits) => {
                    Err(none_usable(devices.iter().filter(|d| fits(d))))
                }
                None => Err(DeviceError::UnknownName {
                    asked: asked.clone(),
                    available: devices.iter().map(|d| d.name.clone()).collect(),
                }),
            }
        }
    }
}

/// None of these devices can be used.
fn none_usable<'a>(devices: impl Iterator<Item = &'a DeviceInfo>) -> DeviceError {
    let reasons: Vec<String> = devices
        .filter_map(|d| d.unusable.as_ref().map(|reason| format!("`{}` cannot be used, {reason}", d.name)))
        .collect();
    let reason = if reasons.is_empty() { "there is none".to_owned() } else { reasons.join("; ") };
    DeviceError::NoAdapter { reason }
}

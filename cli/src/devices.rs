//! `tensormass devices`: the GPUs of this machine, whether they can be used, and which one `--device auto` takes.

use clap::Args;
use serde_json::json;
use tensormass_runtime::device::{DeviceChoice, DeviceInfo, DeviceKind, select};

use crate::failure::Failure;
use crate::text;

/// Arguments of `devices`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Print the devices as JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Prints the devices. That there is none is no failure: everything computes on the CPU too.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let devices = adapters();
    let automatic = select(&DeviceChoice::Auto, &devices).map_err(|e| Failure::Other(e.to_string()))?;
    let automatic = automatic.map(|place| devices[place].name.as_str());
    if arguments.json {
        let auto = automatic.map_or("cpu".to_owned(), |name| format!("gpu:{name}"));
        return text::print_json(&json!({ "devices": devices, "auto": auto }));
    }
    let mut out: String = devices.iter().map(page).collect();
    out += &match automatic {
        Some(name) => format!("--device auto: {name} for scenes in f32, the CPU for scenes in f64\n"),
        None => format!("--device auto: the CPU; {}\n", reason(&devices)),
    };
    text::print(&out)
}

#[cfg(feature = "gpu")]
fn adapters() -> Vec<DeviceInfo> {
    tensormass_runtime::gpu::adapters()
}

#[cfg(not(feature = "gpu"))]
fn adapters() -> Vec<DeviceInfo> {
    Vec::new()
}

/// Why `auto` takes the CPU.
fn reason(devices: &[DeviceInfo]) -> &'static str {
    if cfg!(not(feature = "gpu")) {
        "this program was built without GPU support"
    } else if devices.is_empty() {
        "no GPU is found (a GPU needs its Vulkan driver; Debian: mesa-vulkan-drivers)"
    } else if devices.iter().any(|d| d.kind.is_hardware()) {
        "no hardware GPU can be used"
    } else {
        "there is no hardware GPU"
    }
}

/// What is known of a device.
fn page(device: &DeviceInfo) -> String {
    let limits = &device.limits;
    let nature = match device.kind {
        DeviceKind::Software => "software: for tests, slower than --device cpu".to_owned(),
        DeviceKind::Discrete | DeviceKind::Integrated | DeviceKind::Virtual | DeviceKind::Other => {
            device.kind.to_string()
        }
    };
    let driver = [&device.backend, &device.driver, &device.driver_info];
    let driver: Vec<&str> = driver.into_iter().map(|s| s.as_str()).filter(|s| !s.is_empty()).collect();
    let features = device.features.names();
    let rows = [
        ("type", nature),
        ("driver", driver.join(", ")),
        (
            "kernels",
            format!(
                "{} storage buffers, {} invocations and {} bytes a work group, {} work groups a dimension",
                limits.storage_buffers_per_stage,
                limits.invocations_per_workgroup,
                limits.workgroup_bytes,
                limits.workgroups_per_dimension
            ),
        ),
        (
            "memory",
            format!("{} MiB a binding, {} MiB a buffer", limits.storage_binding_bytes >> 20, limits.buffer_bytes >> 20),
        ),
        ("features", if features.is_empty() { "none".to_owned() } else { features.join(", ") }),
        ("usable", device.unusable.as_ref().map_or("yes".to_owned(), |reason| format!("no: {reason}"))),
    ];
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    format!("{}\n{}", device.name, text::columns("  ", &rows))
}

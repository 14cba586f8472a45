//! A device for tests: any adapter will do, a software one too. Without one a test says that it is skipped.

use std::io::Write;
use std::sync::Arc;
use std::thread;

use tensormass_runtime::device::{DeviceChoice, DeviceError};
use tensormass_runtime::gpu::{Gpu, open};

/// If set to anything but nothing or 0, a missing adapter fails the test instead of skipping it.
pub const REQUIRE: &str = "TENSORMASS_REQUIRE_GPU";

/// An open device, hardware preferred; none if there is no adapter, after a line that says so. Each test has one of its own:
/// one that all share would compile and compute for one test at a time.
///
/// # Panics
/// If a device cannot be had, and [`REQUIRE`] is set or the reason is another than that there is no adapter.
pub fn test_device() -> Option<Arc<Gpu>> {
    match open(&DeviceChoice::Gpu) {
        Ok(gpu) => Some(Arc::new(gpu.expect("a GPU was asked for, not the CPU"))),
        Err(error @ DeviceError::NoAdapter { .. }) => {
            let required = std::env::var(REQUIRE).is_ok_and(|value| demands(&value));
            assert!(!required, "{REQUIRE} is set, and {error}");
            let thread = thread::current();
            // Not eprintln: the test harness would keep the line of a test that passes to itself.
            let _ = writeln!(
                std::io::stderr(),
                "skipped: no GPU adapter (install mesa-vulkan-drivers), 1 test: {}",
                thread.name().unwrap_or("unnamed")
            );
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Whether this value of [`REQUIRE`] asks for an adapter.
pub fn demands(value: &str) -> bool {
    !matches!(value.trim(), "" | "0")
}

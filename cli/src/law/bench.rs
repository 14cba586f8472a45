//! What the commands that examine laws share: errors as exit statuses, the device, files.

use std::path::Path;

use serde_json::Value;
use tensormass_codegen::worker::WorkerError;
use tensormass_lawbench::extremes::ExtremesError;
use tensormass_lawbench::material::MaterialError;
use tensormass_lawbench::subject::SubjectError;
use tensormass_lawbench::wgsl::{Device, DeviceError};
use tensormass_runtime::device::DeviceChoice;
use tensormass_runtime::output::{create_folder, write_atomic};

use crate::failure::Failure;

/// A law that cannot be had is bad input, but a computer algebra system that is not there, or aborts, is not.
pub fn subject(error: SubjectError) -> Failure {
    match error {
        SubjectError::Law(errors) => Failure::BadInput(errors.iter().map(ToString::to_string).collect()),
        SubjectError::Worker(WorkerError::Refused(message)) => Failure::bad_input(message),
        SubjectError::Worker(_) | SubjectError::NotDerived { .. } => Failure::Other(error.to_string()),
        SubjectError::Unknown { .. } | SubjectError::Unreadable { .. } | SubjectError::Derivation { .. } => {
            Failure::bad_input(error.to_string())
        }
    }
}

/// Parameters that do not fit are bad input.
pub fn material(error: MaterialError) -> Failure {
    Failure::bad_input(error.to_string())
}

/// See [`material`]; a device that fails is neither.
pub fn extremes(error: ExtremesError) -> Failure {
    match error {
        ExtremesError::Material(error) => material(error),
        ExtremesError::Device(error) => Failure::Other(error.to_string()),
    }
}

/// What runs WGSL: the device that is asked for, or whichever there is, or why there is none.
///
/// # Errors
/// The device that was asked for is not there.
pub fn device(choice: Option<&DeviceChoice>) -> Result<Result<Device, String>, Failure> {
    let skipped = |reason: String| Ok(Err(reason.lines().next().unwrap_or_default().to_string()));
    match (Device::open(choice.unwrap_or(&DeviceChoice::Gpu)), choice) {
        (Ok(Some(device)), _) => Ok(Ok(device)),
        (Ok(None), _) => skipped("no device was asked for".into()),
        (Err(error @ (DeviceError::NoAdapter { .. } | DeviceError::NoGpuSupport)), None) => skipped(error.to_string()),
        (Err(error), Some(_)) => Err(Failure::bad_input(error.to_string())),
        (Err(error), None) => Err(Failure::Other(error.to_string())),
    }
}

/// Writes a file into a folder, which is made if need be; nothing half-written ever has its name.
///
/// # Errors
/// It cannot be written.
pub fn write(folder: &Path, name: &str, text: &str) -> Result<(), Failure> {
    use std::io::Write as _;
    create_folder(folder)
        .and_then(|()| write_atomic(&folder.join(name), |file| file.write_all(text.as_bytes())))
        .map_err(|error| Failure::bad_input(error.to_string()))
}

/// Data as JSON; infinite errors, which JSON does not have, are null.
///
/// # Errors
/// A defect of this program.
pub fn json(value: &impl serde::Serialize) -> Result<Value, Failure> {
    serde_json::to_value(value).map_err(|error| Failure::Other(error.to_string()))
}

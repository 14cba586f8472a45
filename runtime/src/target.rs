//! Where a run computes: what the user's choice comes to for a scene on this machine.

#[cfg(feature = "gpu")]
use std::sync::Arc;

use crate::device::{DeviceChoice, DeviceError};
#[cfg(feature = "gpu")]
use crate::gpu::{Gpu, GpuOptions, open};
use crate::scene::Precision;

/// Where a run computes.
#[derive(Debug, Clone, Default)]
pub enum Target {
    /// On the CPU.
    #[default]
    Cpu,
    /// On a GPU, in f32.
    #[cfg(feature = "gpu")]
    Gpu(Arc<Gpu>, GpuOptions),
}

impl Target {
    /// Opens what is chosen, for scenes of this precision. `auto` leaves scenes in f64 to the CPU: GPUs compute in f32.
    ///
    /// # Errors
    /// A GPU is asked for by `gpu` or by name, and there is none such, it cannot be opened, or f64 is asked for.
    pub fn open(choice: &DeviceChoice, precision: Precision) -> Result<Self, DeviceError> {
        match (choice, precision) {
            (DeviceChoice::Cpu, _) | (DeviceChoice::Auto, Precision::F64) => Ok(Self::Cpu),
            (DeviceChoice::Gpu | DeviceChoice::Named(_), Precision::F64) => Err(DeviceError::Precision),
            (DeviceChoice::Auto | DeviceChoice::Gpu | DeviceChoice::Named(_), Precision::F32) => Self::gpu(choice),
        }
    }

    #[cfg(feature = "gpu")]
    fn gpu(choice: &DeviceChoice) -> Result<Self, DeviceError> {
        Ok(open(choice)?.map_or(Self::Cpu, |gpu| Self::Gpu(Arc::new(gpu), GpuOptions::default())))
    }

    #[cfg(not(feature = "gpu"))]
    fn gpu(choice: &DeviceChoice) -> Result<Self, DeviceError> {
        if *choice == DeviceChoice::Auto { Ok(Self::Cpu) } else { Err(DeviceError::NoGpuSupport) }
    }

    /// The device's name.
    pub fn name(&self) -> String {
        match self {
            Self::Cpu => "cpu".to_string(),
            #[cfg(feature = "gpu")]
            Self::Gpu(gpu, _) => gpu.info().name.clone(),
        }
    }

    /// What a user should know of the target before a run.
    pub fn warning(&self) -> Option<String> {
        match self {
            Self::Cpu => None,
            #[cfg(feature = "gpu")]
            Self::Gpu(gpu, _) => gpu.is_software().then(|| {
                format!(
                    "{} is a software device: its results are right, but --device cpu computes them faster",
                    gpu.info().name
                )
            }),
        }
    }
}

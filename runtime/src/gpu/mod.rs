//! Computing on a GPU through wgpu: Vulkan, Metal or Direct3D 12, within the limits that WebGPU guarantees.

mod device;

pub use device::{Gpu, adapters, open};

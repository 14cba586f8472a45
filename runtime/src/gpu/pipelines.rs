//! What a device has compiled, by text: once, however many runs in turn compute on it.
//!
//! Constants of materials, sizes and steps are no part of a kernel's text, so that runs of one law on one kind of element
//! share theirs. They are kept as long as the device is open; their code is small beside any mesh.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use super::shaders::Access;

/// A compiled shader; clones share it.
#[derive(Debug, Clone)]
pub(super) struct Pipeline {
    pub pipeline: wgpu::ComputePipeline,
    pub layout: wgpu::BindGroupLayout,
}

/// A kernel's text, how it binds buffers in order, and its parameters (the bits of their values).
type Key = (String, Vec<Access>, Vec<(String, u64)>);

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Pipelines(Mutex<HashMap<Key, Pipeline>>);

impl Pipelines {
    /// The pipeline of a text with entry point `main`; the label is for messages of the driver.
    pub fn get(
        &self,
        device: &wgpu::Device,
        label: &str,
        (text, bindings, constants): (&str, &[Access], &[(&str, f64)]),
    ) -> Pipeline {
        let bits = constants.iter().map(|(name, value)| ((*name).to_string(), value.to_bits()));
        let key = (text.to_string(), bindings.to_vec(), bits.collect());
        if let Some(made) = self.made().get(&key) {
            return made.clone();
        }
        // Others need not wait meanwhile; two that want the same at once both compile it.
        let made = compiled(device, label, (text, bindings, constants));
        self.made().entry(key).or_insert(made).clone()
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.made().len()
    }

    fn made(&self) -> std::sync::MutexGuard<'_, HashMap<Key, Pipeline>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn compiled(
    device: &wgpu::Device,
    label: &str,
    (text, bindings, constants): (&str, &[Access], &[(&str, f64)]),
) -> Pipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let entry = |(binding, access): (usize, &Access)| wgpu::BindGroupLayoutEntry {
        binding: binding as u32,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: match access {
                Access::Uniform => wgpu::BufferBindingType::Uniform,
                Access::Read => wgpu::BufferBindingType::Storage { read_only: true },
                Access::Write => wgpu::BufferBindingType::Storage { read_only: false },
            },
            has_dynamic_offset: *access == Access::Uniform,
            min_binding_size: None,
        },
        count: None,
    };
    let entries: Vec<_> = bindings.iter().enumerate().map(entry).collect();
    let layout =
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(&layout)],
        ..Default::default()
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    });
    Pipeline { pipeline, layout }
}

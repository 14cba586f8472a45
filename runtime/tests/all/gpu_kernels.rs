//! The GPU against the CPU in f64: kernels of every law, sums at nodes, domains, vectors, and functions that WGSL lacks.
//!
//! No tolerance is chosen: see `states`. `--nocapture` prints the worst difference as a part of its bound.
#![cfg(feature = "gpu")]

mod domain;
mod elements;
mod functions;
mod nodes;
mod states;
mod vectors;

use std::sync::Arc;

use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::body::Body;
use tensormass_runtime::cpu::{CpuBackend, CpuField};
use tensormass_runtime::gpu::{Gpu, GpuBackend, GpuField, GpuOptions};

use states::{Kernel, Vector};

/// A body on one device.
struct On<B: Backend, F: ForceField<B>> {
    backend: B,
    field: F,
}

fn on_cpu(body: &Body) -> On<CpuBackend<f64>, CpuField<f64>> {
    let backend = CpuBackend::new(body);
    On { field: CpuField::new(&backend, body), backend }
}

fn on_gpu(gpu: &Arc<Gpu>, body: &Body, options: GpuOptions) -> On<GpuBackend, GpuField> {
    let backend = GpuBackend::new(Arc::clone(gpu), body, options).expect("the body is small");
    let field = GpuField::new(&backend, body).expect("the body is small");
    On { backend, field }
}

impl<B: Backend, F: ForceField<B>> On<B, F> {
    /// What a kernel gives, as numbers: of each element, or added to `old` at each node.
    fn values(&mut self, kernel: Kernel, u: &[[f64; 3]], du: &[[f64; 3]], factor: f64, old: &[[f64; 3]]) -> Vec<f64> {
        let Self { backend, field } = self;
        let (u, du, mut sum) = (backend.upload(u), backend.upload(du), backend.upload(old));
        match kernel {
            Kernel::Energy => return field.element_energies(backend, &u).expect("inside the domain"),
            Kernel::Cauchy => return field.cauchy(backend, &u).into_flattened(),
            Kernel::Damping => field.add_damping(backend, [&u, &du], factor, &mut sum),
            Kernel::DDamping => field.add_ddamping(backend, [&u, &du], &du, factor, &mut sum),
            Kernel::DampingDiagonal => field.add_damping_diagonal(backend, [&u, &du], factor, &mut sum),
            Kernel::Force => field.add_force(backend, &u, &mut sum).expect("inside the domain"),
            Kernel::DForce => {
                field.prepare(backend, &u);
                field.add_dforce(backend, &du, factor, &mut sum);
            }
            Kernel::Diagonal => {
                field.prepare(backend, &u);
                field.add_diagonal(backend, factor, &mut sum);
            }
        }
        backend.check().expect("the device works");
        backend.download(&sum).into_flattened()
    }

    /// The same at nodes whose sum is 0 before.
    fn fresh(&mut self, kernel: Kernel, u: &Vector, du: &Vector) -> Vec<f64> {
        self.values(kernel, u, du, 1.0, &vec![[0.0; 3]; u.len()])
    }
}

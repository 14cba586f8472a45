//! The two passes on a GPU for every law, and the paper's Figs. 4 and 5: work-group size, elements an invocation.
//!
//! A beam of 290,400 tetrahedra. On a software device this compares kernels with each other, never with a GPU's speed.

use std::sync::Arc;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use tensormass_benches::{beam, wave};
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::device::DeviceChoice;
use tensormass_runtime::gpu::{Gpu, GpuBackend, GpuField, GpuOptions, open};
use tensormass_runtime::laws;
use tensormass_runtime::model::Model;

const CELLS: [usize; 3] = [100, 22, 22];

fn passes(group: &mut BenchmarkGroup<WallTime>, gpu: &Arc<Gpu>, model: &Model, options: GpuOptions, name: &str) {
    let backend = GpuBackend::new(Arc::clone(gpu), &model.body, options).expect("it fits");
    let mut field = GpuField::new(&backend, &model.body).expect("it fits");
    let u = backend.upload(&model.mesh.nodes().iter().map(wave).collect::<Vec<_>>());
    let mut f = backend.zeros();
    group.throughput(Throughput::Elements(model.body.elements.len() as u64));
    group.bench_function(format!("force{name}"), |b| {
        b.iter(|| {
            field.add_force(&backend, &u, &mut f).expect("the state is in the domain");
            backend.wait().expect("the device works");
        });
    });
    field.prepare(&backend, &u);
    group.bench_function(format!("dforce{name}"), |b| {
        b.iter(|| {
            field.add_dforce(&backend, &u, 1.0, &mut f);
            backend.wait().expect("the device works");
        });
    });
}

fn all(c: &mut Criterion) {
    let gpu = match open(&DeviceChoice::Gpu) {
        Ok(Some(gpu)) => Arc::new(gpu),
        Ok(None) => return,
        Err(error) => return eprintln!("skipped: {error}"),
    };
    let mut group = c.benchmark_group(gpu.info().name.clone());
    for law in laws() {
        let name = format!("/{}", law.info.name);
        passes(&mut group, &gpu, &beam(law, CELLS), GpuOptions::default(), &name);
    }
    // The law with the most operations a byte shows the two parameters best.
    let busiest = laws().iter().max_by_key(|l| l.info.operations.iter().map(|o| o.arithmetic()).sum::<u32>());
    let model = beam(busiest.expect("there is a law"), CELLS);
    for work_group_size in [32, 64, 128, 256] {
        let options = GpuOptions { work_group_size, ..GpuOptions::default() };
        passes(&mut group, &gpu, &model, options, &format!("/work group of {work_group_size}"));
    }
    for elements_per_invocation in [1, 2, 4, 8] {
        let options = GpuOptions { elements_per_invocation, ..GpuOptions::default() };
        passes(&mut group, &gpu, &model, options, &format!("/{elements_per_invocation} elements an invocation"));
    }
    group.finish();
}

criterion_group! { name = benches; config = Criterion::default().sample_size(30); targets = all }
criterion_main!(benches);

//! Throughput of force and force differential for every law and precision, beside a memory triad in the same run.
//!
//! Compare figures of one run only: machines are shared, and a ratio survives what a time does not. `cargo bench`.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use tensormass_benches::{beam, wave};
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::cpu::{CpuBackend, CpuField, Precision};
use tensormass_runtime::laws;

fn kernels<R: Precision>(c: &mut Criterion, precision: &str) {
    for law in laws() {
        let model = beam(law, [100, 10, 10]);
        let nodes = model.mesh.nodes();
        let backend = CpuBackend::<R>::new(&model.body);
        let mut field = CpuField::<R>::new(&backend, &model.body);
        let u = backend.upload(&nodes.iter().map(wave).collect::<Vec<_>>());
        let mut f = backend.zeros();
        let mut group = c.benchmark_group(format!("{precision}/{}", law.info.name));
        group.throughput(Throughput::Elements(model.body.elements.len() as u64));
        group.bench_function("force", |b| {
            b.iter(|| field.add_force(&backend, black_box(&u), &mut f).expect("the state is in the domain"));
        });
        field.prepare(&backend, &u);
        group.bench_function("dforce", |b| b.iter(|| field.add_dforce(&backend, black_box(&u), 1.0, &mut f)));
        group.finish();
    }
}

/// a = b + s c on arrays far larger than any cache: the machine's bandwidth in this run.
fn triad(c: &mut Criterion) {
    let n = 1 << 24;
    let (mut a, b, s) = (vec![0.0_f64; n], vec![1.0_f64; n], vec![2.0_f64; n]);
    let mut group = c.benchmark_group("memory");
    group.throughput(Throughput::Bytes(3 * 8 * n as u64)).sample_size(10);
    group.bench_function(BenchmarkId::new("triad", n), |bench| {
        bench.iter(|| {
            for ((a, b), s) in a.iter_mut().zip(&b).zip(&s) {
                *a = b + 3.0 * s;
            }
            black_box(&mut a);
        });
    });
    group.finish();
}

fn all(c: &mut Criterion) {
    triad(c);
    kernels::<f32>(c, "f32");
    kernels::<f64>(c, "f64");
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = all }
criterion_main!(benches);

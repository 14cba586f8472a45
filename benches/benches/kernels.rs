//! Throughput of force and force differential for every law and precision, beside a memory triad in the same run; of two
//! laws beside kernels written by hand.
//!
//! Compare figures of one run only: machines are shared, and a ratio survives what a time does not. `cargo bench`.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use tensormass_benches::hand::{Hand, NeoHookean, StVenantKirchhoff, by_hand, moduli};
use tensormass_benches::{beam, wave};
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::body::Body;
use tensormass_runtime::cpu::{CpuBackend, CpuField, Precision};
use tensormass_runtime::laws;
use tensormass_runtime::model::Model;
use tensormass_runtime::tangent::{Tangent, by_rule};

const CELLS: [usize; 3] = [100, 10, 10];

fn kernels<R: Precision>(c: &mut Criterion, precision: &str) {
    for law in laws() {
        measure::<R>(c, &format!("{precision}/{}", law.info.name), &beam(law, CELLS), by_rule);
    }
}

/// Kernels of a law by hand beside those generated, every product computed in the same way.
fn beside<R: Precision, H: Hand>(c: &mut Criterion, precision: &str) {
    let (hand, generated) = by_hand::<H>();
    let model = beam(generated, CELLS);
    let mut other = beam(generated, CELLS);
    for batch in &mut other.body.batches {
        batch.constants = moduli(generated, &batch.constants).to_vec();
        batch.law = hand;
    }
    for tangent in [Tangent::Stored, Tangent::Recomputed] {
        let all = |body: &Body, _: usize| vec![tangent; body.batches.len()];
        let group = format!("{precision}/{}, {tangent:?}", H::NAME);
        let forces = measure::<R>(c, &format!("{group}/generated"), &model, all);
        let by_hand = measure::<R>(c, &format!("{group}/by hand"), &other, all);
        let largest = forces.as_flattened().iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        for (f, g) in forces.as_flattened().iter().zip(by_hand.as_flattened()) {
            // Textbook forms cancel: of strains of 1e-3 they lose three digits.
            assert!((f - g).abs() <= 1e5 * R::EPSILON * largest, "{group}: {f:e} beside {g:e}");
        }
    }
}

/// Measures force and differential; returns the forces.
fn measure<R: Precision>(
    c: &mut Criterion,
    name: &str,
    model: &Model,
    tangents: impl Fn(&Body, usize) -> Vec<Tangent>,
) -> Vec<[f64; 3]> {
    let nodes = model.mesh.nodes();
    let backend = CpuBackend::<R>::new(&model.body);
    let field = CpuField::<R>::new(&backend, &model.body);
    let mut field = field.with_tangents(&tangents(&model.body, size_of::<R>()));
    let u = backend.upload(&nodes.iter().map(wave).collect::<Vec<_>>());
    let mut f = backend.zeros();
    field.add_force(&backend, &u, &mut f).expect("the state is in the domain");
    let forces = backend.download(&f);
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Elements(model.body.elements.len() as u64));
    group.bench_function("force", |b| {
        b.iter(|| field.add_force(&backend, black_box(&u), &mut f).expect("the state is in the domain"));
    });
    field.prepare(&backend, &u);
    group.bench_function("dforce", |b| b.iter(|| field.add_dforce(&backend, black_box(&u), 1.0, &mut f)));
    group.finish();
    forces
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
    beside::<f32, StVenantKirchhoff>(c, "f32");
    beside::<f32, NeoHookean>(c, "f32");
    beside::<f64, StVenantKirchhoff>(c, "f64");
    beside::<f64, NeoHookean>(c, "f64");
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = all }
criterion_main!(benches);

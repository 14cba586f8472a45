//! Every kernel of every law, element by element: elements share no node, so that a node's sum is one slot.

use std::sync::Arc;

use tensormass_kernels::{ElementEntry, linear_tetrahedron};
use tensormass_runtime::body::LawBatch;
use tensormass_runtime::gpu::{Gpu, GpuOptions};
use tensormass_runtime::{LawEntry, laws};
use tensormass_testing::random::Rng;

use super::states::{
    Analysis, DEALT, Disjoint, Kernel, PASSES, STRAIN, compare, other_elements, representatives, two_laws,
};
use super::{on_cpu, on_gpu};
use crate::support::gpu::test_device;

/// Elements a law: not a multiple of a work group's size.
const ELEMENTS: usize = 333;
/// How many elements of other kinds, and how much they are strained: what laws do beyond is tested above.
const FEWER: (usize, f64) = (11, 0.1);

/// The numbers of a batch's elements from those of all elements.
fn of_batch(all: &[f64], kernel: Kernel, batch: &LawBatch) -> Vec<f64> {
    let width = match kernel {
        Kernel::Energy => 1,
        Kernel::Cauchy => 9,
        _ => 3 * batch.element.info.nodes,
    };
    batch.elements.iter().flat_map(|&e| &all[width * e as usize..][..width]).copied().collect()
}

fn check(
    gpu: &Arc<Gpu>,
    law: &'static LawEntry,
    element: &'static ElementEntry,
    count: (usize, f64),
    analysis: &Analysis,
) {
    let Disjoint { body, u, du, .. } = Disjoint::new(&[law], element, count, analysis, &mut Rng::new(1));
    let (mut cpu, mut gpu) = (on_cpu(&body), on_gpu(gpu, &body, GpuOptions::default()));
    for kernel in PASSES.into_iter().filter(|kernel| kernel.function(law).is_some()) {
        let (wanted, found) = (cpu.fresh(kernel, &u, &du), gpu.fresh(kernel, &u, &du));
        for batch in &body.batches {
            let materials = if batch.per_element { "a material each" } else { "one material" };
            let what = format!("{}, {}, {kernel:?}, {materials}", law.info.name, element.info.name);
            let bounds = analysis.batch(kernel, &body, batch, &u, &du);
            let [found, wanted] = [&found, &wanted].map(|all| of_batch(all, kernel, batch));
            println!("{what}: {:.3} of the bound", compare(&what, &found, &wanted, &bounds));
        }
    }
}

#[test]
fn kernels_of_every_law_are_the_f64_kernels_rounded() {
    let Some(gpu) = test_device() else { return };
    let analysis = Analysis::new();
    for law in laws() {
        check(&gpu, law, linear_tetrahedron(), (ELEMENTS, STRAIN), &analysis);
    }
}

#[test]
fn kernels_of_every_element_are_the_f64_kernels_rounded() {
    let Some(gpu) = test_device() else { return };
    let analysis = Analysis::new();
    for element in other_elements() {
        for law in representatives() {
            check(&gpu, law, element, FEWER, &analysis);
        }
    }
}

#[test]
fn slots_do_not_depend_on_how_elements_are_dealt_to_invocations() {
    let Some(gpu) = test_device() else { return };
    let Disjoint { body, u, du, .. } =
        Disjoint::new(&two_laws(), linear_tetrahedron(), (ELEMENTS, STRAIN), &Analysis::new(), &mut Rng::new(2));
    let force = |options| on_gpu(&gpu, &body, options).fresh(Kernel::Force, &u, &du);
    let usual = force(GpuOptions::default());
    for (work_group_size, elements_per_invocation) in DEALT {
        let options = GpuOptions { work_group_size, elements_per_invocation, ..GpuOptions::default() };
        assert!(force(options) == usual, "{options:?}");
    }
}

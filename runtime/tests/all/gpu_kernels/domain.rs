//! The domains of laws: an element outside is reported as the CPU reports it, elements inside are not.

use tensormass_kernels::linear_tetrahedron;
use tensormass_runtime::backend::{Backend, ForceField, LeftDomain};
use tensormass_runtime::body::LawBatch;
use tensormass_runtime::gpu::GpuOptions;
use tensormass_runtime::{LawEntry, laws};
use tensormass_testing::random::Rng;

use super::states::{Analysis, Disjoint, STRAIN, Vector, other_elements};
use super::{On, on_cpu, on_gpu};
use crate::support::gpu::test_device;

/// What energies and forces say at a displacement.
fn reports<B: Backend, F: ForceField<B>>(on: &mut On<B, F>, u: &Vector) -> [Result<(), LeftDomain>; 2] {
    let (u, mut f) = (on.backend.upload(u), on.backend.zeros());
    let energies = on.field.element_energies(&on.backend, &u).map(|_| ());
    [energies, on.field.add_force(&on.backend, &u, &mut f)]
}

/// Displacements with some elements turned inside out, mirrored along x.
fn inverted(all: &Disjoint, elements: &[u32]) -> Vector {
    let mut u = all.u.clone();
    for &e in elements {
        let nodes = &all.body.elements[e as usize];
        let first = nodes[0] as usize;
        for n in nodes.iter().map(|n| *n as usize) {
            u[n] = u[first];
            u[n][0] -= 2.0 * (all.nodes[n][0] - all.nodes[first][0]);
        }
    }
    u
}

/// Displacements with one node of an element beyond the others: some of its points are outside, and some are not.
fn torn(all: &Disjoint, element: u32) -> Vector {
    let mut u = all.u.clone();
    let nodes = &all.body.elements[element as usize];
    let [first, last] = [nodes[0] as usize, nodes[nodes.len() - 1] as usize];
    let at = |n: usize, i: usize| all.nodes[n][i] + all.u[n][i];
    (0..3).for_each(|i| u[first][i] += 6.0 * (at(last, i) - at(first, i)));
    u
}

#[test]
fn elements_outside_are_named_as_on_the_cpu() {
    let Some(gpu) = test_device() else { return };
    let all: Vec<&'static LawEntry> = laws().iter().collect();
    let elements = Disjoint::new(&all, linear_tetrahedron(), (700, STRAIN), &Analysis::new(), &mut Rng::new(3));
    let options = [GpuOptions::default(), GpuOptions { binding_bytes: Some(1 << 13), ..GpuOptions::default() }];
    let mut cpu = on_cpu(&elements.body);
    for mut gpu in options.map(|options| on_gpu(&gpu, &elements.body, options)) {
        assert_eq!(reports(&mut gpu, &elements.u), [Ok(()), Ok(())], "all are inside");
        let (with, without): (Vec<&LawBatch>, _) =
            elements.body.batches.iter().partition(|b| b.law.info.domain.is_some());
        assert!(!with.is_empty() && !without.is_empty(), "laws of both kinds");
        for batch in &with {
            let (first, last) = (batch.elements[0], *batch.elements.last().expect("an element"));
            let middle = batch.elements[batch.elements.len() / 2];
            for outside in [vec![first], vec![middle], vec![last], vec![last, middle]] {
                let u = inverted(&elements, &outside);
                let wanted = reports(&mut cpu, &u);
                assert_eq!(wanted[1].as_ref().map_err(|e| e.element), Err(*outside.last().expect("one")));
                assert_eq!(reports(&mut gpu, &u), wanted, "{}", batch.law.info.name);
            }
        }
        // One of each: the first batch is named. Those of laws without a domain are inside wherever they are.
        let one =
            |batches: &[&LawBatch]| inverted(&elements, &batches.iter().map(|b| b.elements[7]).collect::<Vec<_>>());
        let u = one(&with);
        assert_eq!(reports(&mut gpu, &u), reports(&mut cpu, &u));
        assert_eq!(reports(&mut gpu, &one(&without)), [Ok(()), Ok(())]);
    }
}

/// An element is outside where one of its points is.
#[test]
fn one_point_outside_is_enough() {
    let Some(gpu) = test_device() else { return };
    let law = laws().iter().find(|law| law.info.domain.is_some()).expect("a law with a domain");
    for element in other_elements().filter(|e| e.info.points.len() > 1) {
        let all = Disjoint::new(&[law], element, (9, 0.1), &Analysis::new(), &mut Rng::new(9));
        let (mut cpu, mut gpu) = (on_cpu(&all.body), on_gpu(&gpu, &all.body, GpuOptions::default()));
        for (what, u) in [("torn", torn(&all, 4)), ("inverted", inverted(&all, &[5]))] {
            let wanted = reports(&mut cpu, &u);
            assert!(wanted.iter().all(Result::is_err), "{} {what}", element.info.name);
            assert_eq!(reports(&mut gpu, &u), wanted, "{}", element.info.name);
        }
    }
}

//! The domains of laws: an element outside is reported as the CPU reports it, elements inside are not.

use std::sync::Arc;

use tensormass_runtime::backend::{Backend, ForceField, LeftDomain};
use tensormass_runtime::body::LawBatch;
use tensormass_runtime::gpu::GpuOptions;
use tensormass_runtime::{LawEntry, laws};
use tensormass_testing::random::Rng;

use crate::states::{Analysis, Disjoint, Vector};
use crate::support::gpu::test_device;
use crate::{On, on_cpu, on_gpu};

/// What energies and forces say at a displacement.
fn reports<B: Backend, F: ForceField<B>>(on: &mut On<B, F>, u: &Vector) -> [Result<(), LeftDomain>; 2] {
    let (u, mut f) = (on.backend.upload(u), on.backend.zeros());
    let energies = on.field.element_energies(&on.backend, &u).map(|_| ());
    [energies, on.field.add_force(&on.backend, &u, &mut f)]
}

/// Displacements with some elements turned inside out: the edges of each are reflected.
fn inverted(all: &Disjoint, elements: &[u32]) -> Vector {
    let mut u = all.u.clone();
    for &e in elements {
        let corner = 4 * e as usize;
        for i in 0..3 {
            // F = -I: edge k of the element becomes its negative.
            let edge = edges(&all.body.rest[e as usize][0].inverse_jacobian);
            for k in 0..3 {
                u[corner + 1 + k][i] = u[corner][i] - 2.0 * edge[k][i];
            }
        }
    }
    u
}

/// The edges from node 0 of an element with these gradients: columns of the inverse of their rows.
fn edges(g: &[f64; 9]) -> [[f64; 3]; 3] {
    let rows = [[g[0], g[1], g[2]], [g[3], g[4], g[5]], [g[6], g[7], g[8]]];
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let across = [cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])];
    let det: f64 = (0..3).map(|i| rows[0][i] * across[0][i]).sum();
    across.map(|c| c.map(|x| x / det))
}

#[test]
fn elements_outside_are_named_as_on_the_cpu() {
    let Some(gpu) = test_device().map(Arc::new) else { return };
    let all: Vec<&'static LawEntry> = laws().iter().collect();
    let elements = Disjoint::new(&all, 700, &Analysis::new(), &mut Rng::new(3));
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

//! Kernels of elements whose gradients vary: at one quadrature point, with J^-1 there.

use num_traits::Zero;

use crate::ir::{Builder, Input, KernelIr, Output, Rational, ValueId};

use super::minus_sum;

/// The derivative of the function of node j >= 1 by reference coordinate a.
fn slope(b: &mut Builder, dimension: usize, j: u32, a: usize) -> ValueId {
    b.input(Input::ReferenceGradients, dimension as u32 * (j - 1) + a as u32)
}

/// dxi_a/dX_k.
fn inverse(b: &mut Builder, a: usize, k: usize) -> ValueId {
    b.input(Input::InverseJacobian, (3 * a + k) as u32)
}

fn zero(b: &mut Builder) -> ValueId {
    b.number(Rational::zero())
}

fn sum_of_products(b: &mut Builder, pairs: impl IntoIterator<Item = (ValueId, ValueId)>) -> ValueId {
    let mut sum = None;
    for (x, y) in pairs {
        let term = b.mul(x, y);
        sum = Some(sum.map_or(term, |s| b.add(s, term)));
    }
    sum.expect("an element has more than one node")
}

fn inputs(nodes: u32, dimension: usize) -> [(Input, u32); 2] {
    [(Input::ReferenceGradients, dimension as u32 * (nodes - 1)), (Input::InverseJacobian, 9)]
}

/// G = (sum_j u_j (x) dLambda_j/dxi) J^-1.
pub(super) fn gradient(nodes: u32, dimension: usize) -> KernelIr {
    let mut b = Builder::new();
    let mut g = vec![];
    for i in 0..3 {
        if i >= dimension {
            g.extend([zero(&mut b); 3]);
            continue;
        }
        let first = b.input(Input::NodalDisplacement, i as u32);
        let relative: Vec<ValueId> = (1..nodes)
            .map(|j| {
                let u = b.input(Input::NodalDisplacement, 3 * j + i as u32);
                b.sub(u, first)
            })
            .collect();
        let by_reference: Vec<ValueId> = (0..dimension)
            .map(|a| {
                let pairs: Vec<_> =
                    (1..nodes).zip(&relative).map(|(j, u)| (*u, slope(&mut b, dimension, j, a))).collect();
                sum_of_products(&mut b, pairs)
            })
            .collect();
        for k in 0..3 {
            if k >= dimension {
                g.push(zero(&mut b));
                continue;
            }
            let pairs: Vec<_> = by_reference.iter().enumerate().map(|(a, h)| (*h, inverse(&mut b, a, k))).collect();
            g.push(sum_of_products(&mut b, pairs));
        }
    }
    let [slopes, inverse] = inputs(nodes, dimension);
    let inputs = vec![(Input::NodalDisplacement, 3 * nodes), slopes, inverse];
    b.finish("gradient", inputs, vec![(Output::DisplacementGradient, g)])
}

/// f_j = -w P J^-T dLambda_j/dxi.
pub(super) fn contract(nodes: u32, dimension: usize) -> KernelIr {
    let mut b = Builder::new();
    let weight = b.input(Input::Weight, 0);
    let minus = b.neg(weight);
    let mut q = vec![];
    for i in 0..dimension {
        for a in 0..dimension {
            let pairs: Vec<_> =
                (0..dimension).map(|k| (b.input(Input::StressIn, (3 * i + k) as u32), inverse(&mut b, a, k))).collect();
            let sum = sum_of_products(&mut b, pairs);
            q.push(b.mul(minus, sum));
        }
    }
    let mut forces = vec![];
    for j in 1..nodes {
        for i in 0..3 {
            if i >= dimension {
                forces.push(zero(&mut b));
                continue;
            }
            let pairs: Vec<_> =
                (0..dimension).map(|a| (q[dimension * i + a], slope(&mut b, dimension, j, a))).collect();
            forces.push(sum_of_products(&mut b, pairs));
        }
    }
    // The forces of an element sum to zero: the first node's is minus the others'.
    let first = first_of(&mut b, &forces, dimension);
    let [slopes, inverse] = inputs(nodes, dimension);
    let inputs = vec![(Input::StressIn, 9), slopes, inverse, (Input::Weight, 1)];
    b.finish("contract", inputs, vec![(Output::NodalForce, first.into_iter().chain(forces).collect())])
}

/// grad Lambda_j = J^-T dLambda_j/dxi.
pub(super) fn node_gradients(nodes: u32, dimension: usize) -> KernelIr {
    let mut b = Builder::new();
    let mut others = vec![];
    for j in 1..nodes {
        for k in 0..3 {
            if k >= dimension {
                others.push(zero(&mut b));
                continue;
            }
            let pairs: Vec<_> =
                (0..dimension).map(|a| (slope(&mut b, dimension, j, a), inverse(&mut b, a, k))).collect();
            others.push(sum_of_products(&mut b, pairs));
        }
    }
    let first = first_of(&mut b, &others, dimension);
    let inputs = inputs(nodes, dimension).to_vec();
    b.finish("node_gradients", inputs, vec![(Output::NodeGradients, first.into_iter().chain(others).collect())])
}

/// Minus the sum of the other nodes' vectors, in the dimensions that there are.
fn first_of(b: &mut Builder, others: &[ValueId], dimension: usize) -> Vec<ValueId> {
    let mut first = minus_sum(b, others);
    for component in first.iter_mut().skip(dimension) {
        *component = zero(b);
    }
    first
}

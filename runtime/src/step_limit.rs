//! The critical time step of explicit integrators, two ways, at the initial state.
//!
//! Central differences and semi-implicit Euler are stable for h < 2 / omega_max, omega_max^2 the largest eigenvalue of
//! M^-1 K. Each element's own largest eigenvalue bounds it from above (Irons and Treharne 1971), which gives a safe
//! step; a Krylov power iteration on the assembled operator finds it. The length over wave speed of Li et al. 2014,
//! eqs. (9), (10), is neither: for lumped tetrahedra it can lie above the limit.
//!
//! With damping forces -C v of the last known velocity both schemes are stable while 4 M - 2 h C - h^2 K is positive: of a
//! motion with k = omega^2 = x.Kx / x.Mx and c = x.Cx / x.Mx, for h < (sqrt(c^2 + 4 k) - c) / k, which with c = 2 xi omega is
//! 2 / omega (sqrt(1 + xi^2) - xi) (Belytschko, Liu & Moran, Nonlinear Finite Elements for Continua and
//! Structures, sec. 6.2).

use std::collections::HashMap;

use nalgebra::DMatrix;

use crate::backend::{Backend, ForceField};
use crate::body::Body;
use crate::cpu::One;
use crate::system::System;

/// The critical steps of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepLimits {
    /// Safe: from the largest element eigenvalue.
    pub element: f64,
    /// The limit itself, from the power iteration; infinite where nothing vibrates.
    pub power: f64,
}

/// The critical step of a motion with these k and c: the limit falls with both.
fn step_of(k: f64, c: f64) -> f64 {
    match (k > 0.0, c > 0.0) {
        (true, false) => 2.0 / k.sqrt(),
        (_, true) => 4.0 / ((c * c + 4.0 * k.max(0.0)).sqrt() + c),
        (false, false) => f64::INFINITY,
    }
}

/// The safe step: 2 / sqrt of the largest eigenvalue of any element's M_e^-1 K_e at rest.
///
/// Congruent elements of one material are computed once. Damping counts with its own largest eigenvalue, at rest.
pub fn element_limit(body: &Body) -> f64 {
    let mut known: HashMap<Vec<u64>, f64> = HashMap::new();
    let mut least = f64::INFINITY;
    for (number, batch) in body.batches.iter().enumerate() {
        let count = batch.law.info.constants.len();
        let nodes = batch.element.info.nodes;
        for (i, &e) in batch.elements.iter().enumerate() {
            let rest = &body.rest[e as usize];
            let start = if batch.per_element { i * count } else { 0 };
            let constants = &batch.constants[start..start + count];
            let mass = body.element_masses[e as usize];
            let numbers = rest.iter().flat_map(|r| r.inverse_jacobian.iter().chain([&r.weight]));
            let mut key = vec![number as u64];
            key.extend(numbers.chain(constants).chain([&mass]).map(|x| x.to_bits()));
            let value = *known.entry(key).or_insert_with(|| {
                let one = One::new(batch.element, batch.law, rest, constants);
                let still = vec![[0.0; 3]; nodes];
                let masses: Vec<f64> = batch.element.info.lumping.iter().map(|m| m * mass).collect();
                let k = element_eigenvalue(|x, y| one.dforce(&still, x, y), &masses);
                let viscous = match batch.law.damping {
                    Some(_) => element_eigenvalue(|x, y| one.ddamping([&still, &still, x], y), &masses),
                    None => 0.0,
                };
                step_of(k, viscous + body.stiffness_damping * k)
            });
            least = least.min(value);
        }
    }
    least
}

/// The largest eigenvalue of an element's M_e^-1 K_e, where `product` is -K_e du.
fn element_eigenvalue(product: impl Fn(&[[f64; 3]], &mut [[f64; 3]]), masses: &[f64]) -> f64 {
    let n = masses.len();
    let mut stiffness = DMatrix::<f64>::zeros(3 * n, 3 * n);
    for column in 0..3 * n {
        let (mut du, mut df) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
        du[column / 3][column % 3] = 1.0;
        product(&du, &mut df);
        for line in 0..3 * n {
            let scale = (masses[line / 3] * masses[column / 3]).sqrt();
            stiffness[(line, column)] = -df[line / 3][line % 3] / scale;
        }
    }
    let symmetric = (&stiffness + stiffness.transpose()) * 0.5;
    symmetric.symmetric_eigenvalues().max()
}

/// Iterations of the power iteration, at most.
const ITERATIONS: usize = 400;

/// Corrections of the limit where laws have a dissipation.
const CORRECTIONS: usize = 6;

/// The limit itself, at displacement u and velocity 0, by a Lanczos (Krylov power) iteration from a fixed start for the
/// largest eigenvalue of M^-1 K on the free components.
///
/// With viscosity the limit is the root of lambda(h) = 4, where lambda is the largest eigenvalue of
/// M^-1 ((h^2 + 2 beta h) K + 2 h C): convex in h, so that chords approach the root from both sides.
pub fn power_limit<B: Backend, F: ForceField<B>>(system: &mut System<B, F>, u: &B::Vector) -> f64 {
    let beta = system.body.stiffness_damping;
    let k = eigenvalue(system, u, 1.0, 0.0);
    if !system.body.is_viscous() {
        return step_of(k, beta * k);
    }
    // As if the stiffest motion were the most viscous one: not above the limit.
    let c = eigenvalue(system, u, 0.0, 1.0);
    let mut low = step_of(k, c + beta * k);
    if !low.is_finite() {
        return low;
    }
    let mut excess = |h: f64| eigenvalue(system, u, h * (h + 2.0 * beta), 2.0 * h) - 4.0;
    let mut of_low = excess(low);
    // The chord from (0, -4), where the function is -4, meets 0 at or beyond the root.
    let mut high = low * 4.0 / (4.0 + of_low);
    for _ in 0..CORRECTIONS {
        if high - low <= 1e-3 * high {
            break;
        }
        let of_high = excess(high);
        let root = low - of_low * (high - low) / (of_high - of_low);
        (low, of_low) = (root, excess(root));
        high = (low * 4.0 / (4.0 + of_low)).min(high);
    }
    low
}

/// The largest eigenvalue of M^-1 (stiffness K + viscosity C) on the free components at displacement u and velocity 0;
/// the iteration ends when ten further products change the step by less than 1e-4.
fn eigenvalue<B: Backend, F: ForceField<B>>(
    system: &mut System<B, F>,
    u: &B::Vector,
    stiffness: f64,
    viscosity: f64,
) -> f64 {
    let nodes = system.body.masses.len();
    let roots: Vec<[f64; 3]> = system.body.masses.iter().map(|m| [m.sqrt(); 3]).collect();
    let backend = &system.backend;
    let field = &mut system.field;
    field.prepare(backend, u);
    let root = backend.upload(&roots);
    let still = (viscosity != 0.0).then(|| backend.zeros());
    let mut q = backend.upload(&start_vector(nodes));
    backend.project(&mut q);
    let norm = backend.dot(&q, &q).sqrt();
    if norm == 0.0 {
        return 0.0;
    }
    backend.scale(1.0 / norm, &mut q);
    let (mut previous, mut w, mut scaled) = (backend.zeros(), backend.zeros(), backend.zeros());
    let (mut alphas, mut betas): (Vec<f64>, Vec<f64>) = (vec![], vec![]);
    let mut last = 0.0;
    for k in 1..=ITERATIONS {
        // w = M^-1/2 A M^-1/2 q, symmetric.
        backend.divide(&q, &root, &mut scaled);
        backend.clear(&mut w);
        if stiffness != 0.0 {
            field.add_dforce(backend, &scaled, -stiffness, &mut w);
        }
        if let Some(still) = &still {
            field.add_ddamping(backend, [u, still], &scaled, -viscosity, &mut w);
        }
        backend.project(&mut w);
        backend.divide(&w, &root, &mut scaled);
        std::mem::swap(&mut w, &mut scaled);
        let alpha = backend.dot(&q, &w);
        backend.axpy(-alpha, &q, &mut w);
        if let Some(&beta) = betas.last() {
            backend.axpy(-beta, &previous, &mut w);
        }
        alphas.push(alpha);
        let beta = backend.dot(&w, &w).sqrt();
        if k % 10 == 0 || beta <= 1e-12 * alpha.abs() {
            let value = largest_eigenvalue(&alphas, &betas);
            if (value - last).abs() <= 2e-4 * value.abs() || beta <= 1e-12 * alpha.abs() {
                return value;
            }
            last = value;
        }
        betas.push(beta);
        std::mem::swap(&mut previous, &mut q);
        backend.scale(1.0 / beta, &mut w);
        std::mem::swap(&mut q, &mut w);
    }
    last
}

/// Components in [-1, 1] from a fixed sequence: rich in short waves, where the largest eigenvalue lives.
fn start_vector(nodes: usize) -> Vec<[f64; 3]> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..nodes).map(|_| [next(), next(), next()]).collect()
}

/// The largest eigenvalue of a symmetric tridiagonal matrix, by bisection on Sturm's sequence.
fn largest_eigenvalue(diagonal: &[f64], off: &[f64]) -> f64 {
    let radius = |i: usize| {
        let left = if i > 0 { off[i - 1].abs() } else { 0.0 };
        let right = if i + 1 < diagonal.len() { off[i].abs() } else { 0.0 };
        left + right
    };
    let mut high = (0..diagonal.len()).map(|i| diagonal[i] + radius(i)).fold(f64::MIN, f64::max);
    let mut low = diagonal.iter().copied().fold(f64::MIN, f64::max);
    let all_below = |x: f64| {
        let mut d = 1.0;
        for (i, &a) in diagonal.iter().enumerate() {
            let b2 = if i > 0 { off[i - 1] * off[i - 1] } else { 0.0 };
            d = a - x - b2 / d;
            if d >= 0.0 {
                return false;
            }
        }
        true
    };
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if all_below(middle) { high = middle } else { low = middle }
    }
    high
}

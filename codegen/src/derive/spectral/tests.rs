//! Both decompositions, interpreted in f32 and f64, against references without eigenvalues: whole powers of C, and the
//! binomial series of (I + A)^r near rest, each with its differential.
//!
//! The tolerance counts roundings: twelve rotations, each of which is orthonormal to 4 u (the square, sum, root and
//! quotient of its cosine, and the product of its sine); a dyad holds two vectors; the functions and sums round 8 times
//! more: 2 * 12 * 4 + 8 = 104, for C and A themselves as much again.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::LazyLock;

use super::*;
use crate::ir::{Input, Number, Output, ValidKernel};
use crate::lower::Lowering;

const UNITS: f64 = 208.0;

type Matrix = [[f64; 3]; 3];
const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn combine(a: &Matrix, s: f64, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + s * b[i][j]))
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transpose(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn inverse(a: &Matrix) -> Matrix {
    let at = |i: usize, j: usize| a[i % 3][j % 3];
    let cofactor = |i: usize, j: usize| at(i + 1, j + 1) * at(i + 2, j + 2) - at(i + 1, j + 2) * at(i + 2, j + 1);
    let det: f64 = (0..3).map(|j| a[0][j] * cofactor(0, j)).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / det))
}

fn norm(a: &Matrix) -> f64 {
    a.as_flattened().iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn trace(a: &Matrix) -> f64 {
    a[0][0] + a[1][1] + a[2][2]
}

/// (I + A)^r - I and its differential at dA, from the first order on, for |A| below 1/2.
fn series(a: &Matrix, da: &Matrix, r: f64) -> (Matrix, Matrix) {
    let (mut power, mut dpower) = (IDENTITY, [[0.0; 3]; 3]);
    let (mut sum, mut dsum) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
    let mut binomial = 1.0;
    for k in 1..=60 {
        binomial *= (r - f64::from(k - 1)) / f64::from(k);
        dpower = combine(&product(&dpower, a), 1.0, &product(&power, da));
        power = product(&power, a);
        (sum, dsum) = (combine(&sum, binomial, &power), combine(&dsum, binomial, &dpower));
    }
    (sum, dsum)
}

/// C^n and its differential at dC.
fn whole(c: &Matrix, dc: &Matrix, n: i32) -> (Matrix, Matrix) {
    let (base, dbase) = if n < 0 {
        let c1 = inverse(c);
        (c1, combine(&[[0.0; 3]; 3], -1.0, &product(&product(&c1, dc), &c1)))
    } else {
        (*c, *dc)
    };
    let (mut power, mut dpower) = (IDENTITY, [[0.0; 3]; 3]);
    for _ in 0..n.abs() {
        dpower = combine(&product(&dpower, &base), 1.0, &product(&power, &dbase));
        power = product(&power, &base);
    }
    (power, dpower)
}

/// The differential of a quantity by given derivatives alone: no algebra system is needed.
fn differential(quantities: &Quantities, seeds: &BTreeMap<Symbol, Expr>, s: Symbol) -> Expr {
    if let Some(seed) = seeds.get(&s) {
        return seed.clone();
    }
    match &quantities.get(s).kind {
        Kind::Stage { partials: Some(partials), .. } => {
            partials.iter().fold(Expr::int(0), |sum, (by, e)| sum + e.clone() * differential(quantities, seeds, *by))
        }
        _ => panic!("{} is differentiated as it is computed", quantities.get(s).name),
    }
}

/// From a, G and dA to T_a, M, dM, dT_a, and for the decomposition near rest also M - I, T_a - 3 and its second order.
fn kernel(near_rest: bool) -> ValidKernel {
    let mut q = Quantities::default();
    let exponent = q.add("a", Kind::Input(Input::Parameters, 0));
    let g: [Symbol; 9] = std::array::from_fn(|k| q.add("G", Kind::Input(Input::DisplacementGradient, k as u32)));
    let da: [Symbol; 9] = std::array::from_fn(|k| q.add("dA", Kind::Input(Input::GradientIncrement, k as u32)));
    let at = |i: usize, j: usize| Expr::from(g[3 * i + j]);
    let f = std::array::from_fn(|k| if k % 4 == 0 { q.stage("F", Expr::int(1) + g[k].into()) } else { g[k] });
    let strain = SYMMETRIC.map(|(i, j)| {
        let square = Expr::Sum((0..3).map(|k| at(k, i) * at(k, j)).collect());
        q.stage("A", at(i, j) + at(j, i) + square)
    });
    let seeds: BTreeMap<Symbol, Expr> =
        (0..6).map(|kl| (strain[kl], da[3 * SYMMETRIC[kl].0 + SYMMETRIC[kl].1].into())).collect();
    let a = Expr::from(exponent);
    let mut spectrum =
        if near_rest { Spectrum::near_rest(&mut q, strain) } else { Spectrum::of_deformation(&mut q, f, strain) };
    let t = spectrum.stretch_sum(&mut q, &a);
    // dT_a/dA = (a/2) M.
    let m = moment(&q, t);
    let mut outputs = vec![Expr::from(t)];
    outputs.extend(m.map(Expr::from));
    outputs.extend(m.map(|s| differential(&q, &seeds, s)));
    outputs.push(differential(&q, &seeds, t));
    if near_rest {
        let from_rest = spectrum.moment_from_rest(&mut q, &a);
        outputs.extend(from_rest.map(Expr::from));
        outputs.push(spectrum.first_order(&mut q, &a, &from_rest).into());
        outputs.push(spectrum.second_order(&mut q, &a).into());
    }
    let mut lowering = Lowering::new(&q, None, Expr::clone);
    let values = outputs.iter().map(|e| lowering.value(e)).collect();
    let inputs = vec![(Input::Parameters, 1), (Input::DisplacementGradient, 9), (Input::GradientIncrement, 9)];
    lowering.finish("spectral", inputs, vec![(Output::Constants, values)]).validate().expect("a kernel")
}

/// The M that a T_a is differentiated by: the last symbol of each derivative.
fn moment(q: &Quantities, t: Symbol) -> [Symbol; 6] {
    let Kind::Stage { partials: Some(partials), .. } = &q.get(t).kind else { panic!("T_a has its derivatives") };
    std::array::from_fn(|kl| partials[kl].1.symbols().pop().expect("it reads M"))
}

fn symmetric(x: &[f64]) -> Matrix {
    let [xx, yy, zz, xy, xz, yz] = x.try_into().expect("six components");
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// From f64 to a working precision, and back.
type Cast<R> = (fn(f64) -> R, fn(&R) -> f64);

/// Compares one state in one precision; `u` is its unit round-off. Returns the worst share of the tolerance.
fn check<R: Number>(near_rest: bool, g: &Matrix, exponent: f64, u: f64, cast: Cast<R>) -> f64 {
    let (to, from) = cast;
    let da: Matrix = [[0.5, -0.25, 0.75], [-0.25, 1.0, 0.125], [0.75, 0.125, -0.625]];
    let numbers = |x: &[f64]| x.iter().map(|&x| to(x)).collect::<Vec<R>>();
    static KERNELS: LazyLock<[ValidKernel; 2]> = LazyLock::new(|| [kernel(false), kernel(true)]);
    let (a, g9, d9) = (numbers(&[exponent]), numbers(g.as_flattened()), numbers(da.as_flattened()));
    let inputs: [(Input, &[R]); 3] =
        [(Input::Parameters, &a), (Input::DisplacementGradient, &g9), (Input::GradientIncrement, &d9)];
    let out: Vec<f64> =
        KERNELS[usize::from(near_rest)].interpret(&inputs).expect("its inputs").concat().iter().map(from).collect();

    let strain = combine(&combine(g, 1.0, &transpose(g)), 1.0, &product(&transpose(g), g));
    let c = combine(&IDENTITY, 1.0, &strain);
    let r = exponent / 2.0 - 1.0;
    let small = norm(&strain) < 0.5;
    let (m, dm) = if small {
        let (m1, dm) = series(&strain, &da, r);
        (combine(&IDENTITY, 1.0, &m1), dm)
    } else {
        whole(&c, &da, r as i32)
    };
    // What errors of u make of M, dM and T: those of F or of A move the eigenvalue c by 2 |F| sqrt(c) u or by |A| u, and
    // that of the reference in f64 by |C| u.
    let half = exponent / 2.0;
    let (least, great) = (1.0 / norm(&inverse(&c)), norm(&c));
    let sup = |e: f64| least.powf(e).max(great.powf(e));
    let own = !small && u < f64::EPSILON;
    let moved = |factor: f64, e: f64| {
        let by_input = if near_rest { sup(e - 1.0) * norm(&strain) } else { 2.0 * sup(e - 0.5) * great.sqrt() };
        factor.abs() * (by_input + if own { sup(e - 1.0) * great } else { 0.0 })
    };
    let scale_m = norm(&m) + moved(r, r);
    let scale_dm = (r.abs() * sup(r - 1.0) + moved(r * (r - 1.0), r - 1.0)) * norm(&da);
    let worst = Cell::new(0.0f64);
    let compare = |what: &str, actual: f64, expected: f64, scale: f64| {
        let error = (actual - expected).abs();
        // What is zero has no scale: it has to be zero.
        let share = if error == 0.0 { 0.0 } else { error / (UNITS * u * scale) };
        let context = format!("near rest {near_rest}, a {exponent}, u {u:e}, G {g:?}");
        assert!(share <= 1.0, "{what}: {actual:e} against {expected:e}, {share} of the tolerance; {context}");
        worst.set(worst.get().max(share));
    };
    let components = |name: &str, at: usize| (name.to_string(), symmetric(&out[at..at + 6]));
    let matrices = |(name, actual): (String, Matrix), expected: &Matrix, scale: f64| {
        for k in 0..9 {
            compare(&format!("{name} {k}"), actual.as_flattened()[k], expected.as_flattened()[k], scale);
        }
    };
    matrices(components("M", 1), &m, scale_m);
    matrices(components("dM", 7), &dm, scale_dm);
    let power =
        if small { combine(&IDENTITY, 1.0, &series(&strain, &da, half).0) } else { whole(&c, &da, half as i32).0 };
    compare("T", out[0], trace(&power), trace(&power) + moved(half, half));
    compare("dT", out[13], half * trace(&product(&m, &da)), half.abs() * scale_m * norm(&da));
    if near_rest && small {
        let (m1, _) = series(&strain, &da, r);
        let (c1, _) = series(&strain, &da, half);
        matrices(components("M - I", 14), &m1, moved(r, r));
        compare("T - 3", out[20], trace(&c1), moved(half, half));
        // The two functions are the test's own here, exact to u of their arguments.
        let second = trace(&c1) - half * trace(&strain);
        compare("second order", out[21], second, moved(half, half));
    }
    worst.get()
}

/// R' diag(stretches) R - I, where R turns by the angles about the axes 0 and 2; rounded to f32.
fn state(strains: [f64; 3], angles: [f64; 2]) -> Matrix {
    let ([s0, s2], [c0, c2]) = (angles.map(f64::sin), angles.map(f64::cos));
    let turn =
        product(&[[1.0, 0.0, 0.0], [0.0, c0, -s0], [0.0, s0, c0]], &[[c2, -s2, 0.0], [s2, c2, 0.0], IDENTITY[2]]);
    let [x, y, z] = strains;
    let g = product(&product(&transpose(&turn), &[[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]), &turn);
    g.map(|row| row.map(|x| f64::from(x as f32)))
}

#[test]
fn powers_of_the_principal_stretches() {
    let single: Cast<f32> = (|x| x as f32, |x| f64::from(*x));
    let double: Cast<f64> = (|x| x, |x| *x);
    let mut worst = [0.0f64; 4];
    let mut at = |g: &Matrix, exponent: f64| {
        for (k, near_rest) in [false, true].into_iter().enumerate() {
            // In f64 the references, too, are computed in f64: no more than u apart from exact ones.
            worst[2 * k] = worst[2 * k].max(check(near_rest, g, exponent, f64::from(f32::EPSILON) / 2.0, single));
            worst[2 * k + 1] = worst[2 * k + 1].max(check(near_rest, g, exponent, f64::EPSILON / 2.0, double));
        }
    };
    for angles in [[0.0, 0.0], [0.3, 1.1], [1e-4, -2e-5], [-2.0, 0.7]] {
        for gap in [0.5, 1e-2, 1e-4, 1e-6, 1e-8, 0.0] {
            for strain in [1e-8, 1e-5, 1e-2, 0.1] {
                for strains in [[strain, strain * (1.0 + gap), -0.4 * strain], [strain, strain * (1.0 - gap), strain]] {
                    [1.3, 5.0, -2.0, 0.5, 2.0].iter().for_each(|a| at(&state(strains, angles), *a));
                }
            }
            for strains in [[2.0, 2.0 * (1.0 + gap), -0.7], [10.0, 10.0 * (1.0 - gap), -0.9], [-0.9, -0.9, -0.9]] {
                [6.0, 4.0, -2.0, 0.0].iter().for_each(|a| at(&state(strains, angles), *a));
            }
        }
    }
    // Many frames far apart from the axes, where the last sweep counts.
    for k in 1..400 {
        let angles = [0.37 * f64::from(k), 1.3 * f64::from(k)];
        [6.0, -2.0].iter().for_each(|a| at(&state([10.0, 3.0, -0.8], angles), *a));
        at(&state([0.1, 0.02, -0.1], angles), 1.3);
    }
    at(&[[0.0; 3]; 3], 1.3);
    eprintln!("worst shares of the tolerance: by F in f32 and f64, by A in f32 and f64: {worst:.2?}");
}

#[test]
fn rest_is_exactly_zero() {
    let inputs = [(Input::Parameters, [1.3f32].as_slice()), (Input::DisplacementGradient, &[0.0; 9])];
    let inputs = [inputs[0], inputs[1], (Input::GradientIncrement, &[1.0; 9])];
    let out = kernel(true).interpret(&inputs).expect("its inputs").concat();
    assert!(out[14..].iter().all(|x| *x == 0.0), "{out:?}");
    assert_eq!(out[0], 3.0);
}

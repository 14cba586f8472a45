//! The law files themselves as an oracle: compiled by rustc over second-order dual numbers that stand in for `f64`.
//!
//! The text of each law goes through `syn` alone (`tensormass_codegen::oracle`): neither our parser nor the symbolic
//! engine is between it and the W, dW and d2W that it gives here. The four parts of a dual number are numbers that
//! carry their rounding bound, and so are the kernels' results: the sum of the two is the tolerance.

use tensormass_kernels::{LawEntry, laws};
use tensormass_testing::point::Point;
use tensormass_testing::random::Rng;
use tensormass_testing::rounding::{DOUBLE, Rounded};
use tensormass_testing::tensor::exact;

#[path = "oracle/prelude.rs"]
#[allow(dead_code, reason = "the whole law language; the laws of one build need not use all of it")]
mod prelude;

include!(concat!(env!("TENSORMASS_GENERATED"), "/oracle/all.rs"));

/// Ordinary states, small strains under any rotation, and large ones.
const STRETCHES: [(f64, f64); 3] = [(0.5, 2.0), (0.99, 1.01), (0.2, 5.0)];
const STATES: u64 = 40;

/// Compares W, P and dP of a law with those of its own text at one state.
fn check(law: &'static LawEntry, seed: u64, stretch: (f64, f64)) {
    let name = law.info.name;
    let energy = ORACLE.iter().find(|(n, _)| *n == name).expect("every law has an oracle").1;
    let mut rng = Rng::new(seed);
    let point = Point::new(env!("TENSORMASS_GENERATED"), law, rng.parameters(law.info));
    let mut g = point.state(&mut rng, stretch);
    if law.info.domain.is_none() && seed % 4 == 3 {
        // Everywhere is everywhere: inverted states too.
        g[2] = -g[2];
        g[5] = -g[5];
        g[8] = -2.0 - g[8];
    }
    let d = rng.direction();
    let parameters: Vec<_> = point.rounded.iter().map(|&p| prelude::parameter(p)).collect();
    let (p, dp) = (point.force(&exact(&g)), point.dforce(&exact(&g), &exact(&d)));
    // W counts from rest: its value there has no meaning.
    let at_rest = energy(prelude::Strain::of([prelude::seeded(0.0, 0.0, 0.0); 9]), &parameters).x;
    let w = point.energy(&exact(&g)) - point.energy(&exact(&[0.0; 9]));
    let compare = |what: &str, kernel: Rounded, oracle: Rounded, magnitude: f64| {
        // A bound beyond this part of the tangent's magnitude would prove nothing: running bounds of rotations, which
        // do not know that the results are the same in any frame, may be beyond.
        let bound = kernel.bound(DOUBLE) + oracle.bound(DOUBLE);
        let (difference, tolerance) = ((kernel.value - oracle.value).abs(), bound.min(1e-9 * magnitude));
        let (kernel, oracle) = (kernel.value, oracle.value);
        let context = format!("{name}, seed {seed}, parameters {:?}, G {g:?}, dG {d:?}", point.parameters);
        assert!(difference <= tolerance, "{what}: {kernel} against {oracle}, tolerance {tolerance:e}; {context}");
    };
    let magnitude = |a: &[Rounded]| a.iter().fold(0.0f64, |m, x| m.max(x.value.abs()));
    let scale = magnitude(&dp).max(magnitude(&p));
    for k in 0..9 {
        let seeded = std::array::from_fn(|m| prelude::seeded(g[m], if m == k { 1.0 } else { 0.0 }, d[m]));
        let result = energy(prelude::Strain::of(seeded), &parameters);
        compare("W", w, result.x - at_rest, scale);
        compare(&format!("P{k}"), p[k], result.a, scale);
        compare(&format!("dP{k}"), dp[k], result.c, scale);
    }
}

/// Compares D, P_v and dP_v of a law with those of its own text at one state and rate.
fn check_damping(law: &'static LawEntry, dissipation: Dissipation, seed: u64, stretch: (f64, f64)) {
    let name = law.info.name;
    let mut rng = Rng::new(seed);
    let point = Point::new(env!("TENSORMASS_GENERATED"), law, rng.parameters(law.info));
    let g = point.state(&mut rng, stretch);
    let (rate, d) = (rng.direction(), rng.direction());
    let parameters: Vec<_> = point.rounded.iter().map(|&p| prelude::parameter(p)).collect();
    let still = g.map(|x| prelude::seeded(x, 0.0, 0.0));
    let strain = prelude::Strain::of(still);
    let (of_g, of_rate, of_d) = (exact(&g), exact(&rate), exact(&d));
    let w = point.dissipation(&of_g, &of_rate);
    let (p, dp) = (point.damping(&of_g, &of_rate), point.ddamping(&of_g, &of_rate, &of_d));
    let magnitude = |a: &[Rounded]| a.iter().fold(0.0f64, |m, x| m.max(x.value.abs()));
    let scale = magnitude(&dp).max(magnitude(&p));
    let compare = |what: &str, kernel: Rounded, oracle: Rounded| {
        let tolerance = (kernel.bound(DOUBLE) + oracle.bound(DOUBLE)).min(1e-9 * scale);
        let difference = (kernel.value - oracle.value).abs();
        let context = format!("{name}, seed {seed}, parameters {:?}, G {g:?}, rate {rate:?}", point.parameters);
        let (kernel, oracle) = (kernel.value, oracle.value);
        assert!(difference <= tolerance, "{what}: {kernel} against {oracle}, tolerance {tolerance:e}; {context}");
    };
    let of = |seeded| dissipation(strain, prelude::StrainRate::of(still, seeded), &parameters);
    let at_rest = of([prelude::seeded(0.0, 0.0, 0.0); 9]).x;
    for k in 0..9 {
        let seeded = std::array::from_fn(|m| prelude::seeded(rate[m], if m == k { 1.0 } else { 0.0 }, d[m]));
        let result = of(seeded);
        compare("D", w, result.x - at_rest);
        compare(&format!("P_v{k}"), p[k], result.a);
        compare(&format!("dP_v{k}"), dp[k], result.c);
    }
}

#[test]
fn damping_is_the_derivative_of_the_law_text() {
    let names: Vec<&str> = laws().iter().filter(|law| law.damping.is_some()).map(|law| law.info.name).collect();
    assert_eq!(DISSIPATION.iter().map(|(name, _)| *name).collect::<Vec<_>>(), names);
    for (name, dissipation) in DISSIPATION {
        let law = laws().iter().find(|law| law.info.name == *name).expect("compared above");
        for stretch in STRETCHES {
            (0..STATES).for_each(|seed| check_damping(law, *dissipation, seed, stretch));
        }
    }
}

#[test]
fn kernels_are_the_derivatives_of_the_law_text() {
    assert_eq!(ORACLE.len(), laws().len());
    for law in laws() {
        for stretch in STRETCHES {
            (0..STATES).for_each(|seed| check(law, seed, stretch));
        }
    }
}

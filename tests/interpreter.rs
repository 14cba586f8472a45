//! The compiled Rust kernels are the interpreted derivations, bit for bit: the same operations in the same order.
//!
//! No tolerance: a difference in one bit is a difference of the printed text.

use tensormass_kernels::{LawEntry, Precision, laws};
use tensormass_testing::codegen::derivation::Derivation;
use tensormass_testing::codegen::ir::{Input, Number};
use tensormass_testing::derivation;
use tensormass_testing::point::{Compiled, NODE_GRADIENTS};
use tensormass_testing::random::Rng;

const STATES: u64 = 100;

/// Compares every kernel of a law in one precision at one state.
fn check<R: Precision + Number>(law: &LawEntry, ir: &Derivation, seed: u64, stretch: (f64, f64)) {
    let mut rng = Rng::new(seed);
    let parameters = rng.parameters(law.info);
    let constants = law.constants(&parameters);
    let name = law.info.name;
    assert_eq!(ir.material(&parameters).expect("parameters"), constants, "{name}, material {parameters:?}");

    let g = rng.gradient(stretch.0, stretch.1);
    let d = rng.direction();
    let compiled = Compiled::<R>::new(law, &constants);
    let real = |x: &[f64]| x.iter().map(|&x| R::from_f64(x)).collect::<Vec<R>>();
    let (c, g9, d9): (Vec<R>, [R; 9], [R; 9]) = (real(&constants), g.map(R::from_f64), d.map(R::from_f64));
    let same = |kernel: &str, actual: &[R], extra: &[(Input, &[R])]| {
        let mut inputs = vec![(Input::Constants, c.as_slice()), (Input::DisplacementGradient, g9.as_slice())];
        inputs.extend_from_slice(extra);
        let expected = ir.point(kernel).interpret(&inputs).expect("the inputs of a point kernel");
        for (k, (a, e)) in actual.iter().zip(&expected[0]).enumerate() {
            let (a, e) = (a.to_f64(), e.to_f64());
            assert!(
                a == e || (a.is_nan() && e.is_nan()),
                "{name}, {kernel} {k} in {}: compiled {a:e}, interpreted {e:e}; seed {seed}, G {g:?}",
                std::any::type_name::<R>()
            );
        }
    };
    same("energy", &[compiled.energy(&g9).0], &[]);
    same("force", &compiled.force(&g9).0, &[]);
    same("dforce", &compiled.dforce(&g9, &d9), &[(Input::GradientIncrement, &d9)]);
    for (node, row) in NODE_GRADIENTS.iter().zip(compiled.diagonal(&g9)) {
        same("diagonal", &row, &[(Input::NodeGradient, &node.map(R::from_f64))]);
    }
    same("cauchy", &compiled.cauchy(&g9), &[]);
    if !compiled.is_dissipative() {
        return;
    }
    let r9 = rng.direction().map(R::from_f64);
    let rate = (Input::GradientRate, r9.as_slice());
    same("dissipation", &[compiled.dissipation(&g9, &r9)], &[rate]);
    same("damping", &compiled.damping(&g9, &r9), &[rate]);
    same("ddamping", &compiled.ddamping(&g9, &r9, &d9), &[rate, (Input::GradientIncrement, &d9)]);
    for (node, row) in NODE_GRADIENTS.iter().zip(compiled.damping_diagonal(&g9, &r9)) {
        same("damping_diagonal", &row, &[rate, (Input::NodeGradient, &node.map(R::from_f64))]);
    }
}

#[test]
fn compiled_kernels_are_the_interpreted_derivations() {
    for law in laws() {
        let ir = derivation(env!("TENSORMASS_GENERATED"), law.info.name);
        for seed in 0..STATES {
            // Near rest, where cancellation shows every reordered sum, and far from it.
            for stretch in [(0.999, 1.001), (0.3, 3.0), (0.1, 10.0)] {
                check::<f64>(law, &ir, seed, stretch);
                check::<f32>(law, &ir, seed, stretch);
            }
        }
    }
}

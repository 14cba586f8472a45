//! Logarithms and exponentials of every kind of lanes, against numbers of twice the digits.

use super::Constants;
use crate::lanes::{Engine, Lanes, Registers};
use crate::real::Real;
use crate::real::twofold::Twofold;
use crate::table::Precision;

type Function<R> = fn(R) -> R;

type Case<R> = (&'static str, Function<R>, Function<Twofold>, (f64, f64), f64);

/// Functions with what they are, the least and greatest argument, and the error allowed in units in the last place.
///
/// The sums' leading terms are exact, what is added to them less than a half of them, with a few roundings: within one unit.
/// exp(x) - 1 = 2 (exp(r) - 1) + 1 with r < 0 may be less than a half of what was rounded; remainders as documented.
fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        ("ln", R::ln, Twofold::ln, (1e-30, 1e30), 1.0),
        ("ln near 1", R::ln, Twofold::ln, (0.6, 1.7), 1.0),
        ("ln_1p", R::ln_1p, Real::ln_1p, (-0.999, 1e3), 1.5),
        ("ln_1p near 0", R::ln_1p, Real::ln_1p, (-1e-3, 1e-3), 1.0),
        ("exp", R::exp, Twofold::exp, (-80.0, 80.0), 1.0),
        ("exp near 0", R::exp, Twofold::exp, (-0.5, 0.5), 1.0),
        ("exp_m1", R::exp_m1, Real::exp_m1, (-80.0, 80.0), 2.0),
        ("exp_m1 near 0", R::exp_m1, Real::exp_m1, (-0.7, 0.7), 2.0),
        ("log1pmx", R::log1pmx, Real::log1pmx, (-0.99, 20.0), 4.0),
        ("log1pmx near 0", R::log1pmx, Real::log1pmx, (-0.01, 0.01), 4.0),
        ("expm1mx", R::expm1mx, Real::expm1mx, (-20.0, 20.0), 4.0),
        ("expm1mx near 0", R::expm1mx, Real::expm1mx, (-0.01, 0.01), 4.0),
    ]
}

/// Arguments spread over a range, in steps of equal size and of equal ratio.
fn arguments((low, high): (f64, f64)) -> Vec<f64> {
    let n = 20_000;
    let share = |k: i32| f64::from(k) / f64::from(n);
    let even = (0..=n).map(|k| low + (high - low) * share(k));
    if low > 0.0 { even.chain((0..=n).map(|k| low * (high / low).powf(share(k)))).collect() } else { even.collect() }
}

fn check<V: Lanes<Scalar: Constants>>(epsilon: f64) {
    for (name, function, exact, range, allowed) in cases::<V>() {
        let arguments: Vec<V::Scalar> = arguments(range).into_iter().map(V::Scalar::from_f64).collect();
        let mut worst = (0.0, 0.0);
        for group in arguments.chunks_exact(V::COUNT) {
            let mut values = group.to_vec();
            function(V::load(group)).store(&mut values);
            for (x, value) in group.iter().zip(values) {
                let wanted = exact(Twofold::from_f64(x.to_f64()));
                let error = Twofold::to_f64(wanted - Twofold::from_f64(value.to_f64())).abs();
                // Units in the last place of the exact value.
                let unit = 2.0 * epsilon * 2.0_f64.powf(Twofold::to_f64(wanted).abs().log2().floor());
                if error > worst.0 * unit {
                    worst = (error / unit, x.to_f64());
                }
            }
        }
        // A lane does not know what the others are.
        for x in arguments.iter().step_by(7).filter(|_| V::COUNT > 1) {
            let of = |last: f64| {
                let mut lanes = vec![*x; V::COUNT];
                lanes[V::COUNT - 1] = V::Scalar::from_f64(last);
                function(V::load(&lanes)).to_f64().to_bits()
            };
            assert_eq!(of(x.to_f64()), of(range.1), "{name} of {x:?}");
        }
        let lanes = std::any::type_name::<V>();
        assert!(worst.0 <= allowed, "{name} on {lanes}: {} units at {:e}", worst.0, worst.1);
    }
    // What is no ordinary number is what the number's own function says, in its lane alone.
    for (name, function, _, _, _) in cases::<V>() {
        let (_, of_one, _, _, _) = *cases::<V::Scalar>().iter().find(|c| c.0 == name).expect("the same functions");
        for odd in [0.0, -1.0, -2.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e-42, 1e300, -1e300] {
            let mut lanes = vec![V::Scalar::from_f64(0.75); V::COUNT];
            lanes[V::COUNT - 1] = V::Scalar::from_f64(odd);
            let mut values = lanes.clone();
            function(V::load(&lanes)).store(&mut values);
            let (value, wanted) = (values[V::COUNT - 1].to_f64(), of_one(lanes[V::COUNT - 1]).to_f64());
            let close = (value - wanted).abs() <= 8.0 * epsilon * wanted.abs();
            assert!(
                close || value == wanted || (value.is_nan() && wanted.is_nan()),
                "{name} of {odd}: {value}, {wanted}"
            );
        }
    }
}

fn on<R: Precision + Constants>(engine: Engine, epsilon: f64) {
    match engine.registers() {
        Registers::Scalar => {}
        #[cfg(target_arch = "x86_64")]
        Registers::Avx2(_) => check::<R::Avx2>(epsilon),
        #[cfg(target_arch = "x86_64")]
        Registers::Avx512(_) => check::<R::Avx512>(epsilon),
    }
}

#[test]
fn functions_of_lanes_are_accurate() {
    for engine in Engine::available() {
        on::<f32>(engine, f64::from(f32::EPSILON) / 2.0);
        on::<f64>(engine, f64::EPSILON / 2.0);
    }
}

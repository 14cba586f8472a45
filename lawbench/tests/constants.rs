//! A material's constants carry every digit that its parameters do, however nearly incompressible it is.
//!
//! They are computed in twofold precision and rounded once: off by half a unit in the last place, which is at most the
//! unit round-off times the constant, and by what is left of twofold precision, far below.

use tensormass_codegen::ir::{Number, Twofold};
use tensormass_lawbench::evaluate::constants;
use tensormass_lawbench::material::Material;
use tensormass_lawbench::number::Exact;
use tensormass_lawbench::states::Random;
use tensormass_lawbench::subject::Subject;

fn exactly(parameters: &[f64]) -> Vec<Exact> {
    parameters.iter().copied().map(Exact::from).collect()
}

/// |x - exact| as a part of |exact|; 0 where both are 0.
fn relative(x: &Exact, exact: &Exact) -> f64 {
    let error = x.sub(exact).abs();
    if error.is_positive() { error.div(&exact.abs()).to_f64() } else { 0.0 }
}

fn check(subject: &Subject) {
    let derivation = &subject.derivation;
    for material in Material::all(subject).expect("materials") {
        let exact = constants(derivation, &exactly(&material.parameters));
        for (k, (e, c)) in exact.iter().zip(material.constants(derivation)).enumerate() {
            let error = relative(&Exact::from(c), e) / (0.5 * f64::EPSILON);
            assert!(
                error <= 1.0 + 1e-6,
                "{}, {} = {c:e} is off by {error} unit round-offs, parameters {:?}",
                subject.name(),
                derivation.constants[k],
                material.parameters
            );
        }
    }
}

#[test]
fn constants_are_rounded_once() {
    for law in tensormass_kernels::laws() {
        check(&Subject::of_build(law));
    }
}

/// The bounds of Joldes, Muller and Popescu for + * /, and for functions the roundings of their series.
#[test]
fn twofold_arithmetic_keeps_twice_the_digits() {
    let u2 = (0.5 * f64::EPSILON).powi(2);
    let mut random = Random::new(&[11]);
    for _ in 0..2000 {
        let [a, b, c, d]: [f64; 4] = std::array::from_fn(|_| random.signed());
        // Sums of two f64, exactly.
        let (x, y) = (Twofold::from(a) + Twofold::from(b * 1e-17), Twofold::from(c) + Twofold::from(d * 1e-17));
        let [ex, ey] = [(a, b), (c, d)].map(|(h, l)| Exact::from(h).add(&Exact::from(l * 1e-17)));
        let positive = |x: Twofold, e: &Exact| if a > 0.0 { (x, e.clone()) } else { (-x, e.neg()) };
        let (px, epx) = positive(x, &ex);
        let ln = epx.ln();
        let cases = [
            ("+", x + y, ex.add(&ey), 3.0),
            ("*", x * y, ex.mul(&ey), 5.0),
            ("/", x / y, ex.div(&ey), 15.0),
            ("sqrt", Twofold::sqrt(px), epx.sqrt(), 8.0),
            ("exp", Twofold::exp(x), ex.exp(), 4096.0),
            // Of ln itself the digits beyond an absolute error of exp's are lost.
            ("ln", Twofold::ln(px), ln.clone(), 8192.0 / ln.abs().to_f64().min(1.0)),
            ("powf", Twofold::powf(px, y), epx.powf(&ey), 16384.0),
        ];
        for (name, value, exact, bound) in cases {
            let rest = Exact::from(value.to_f64()).sub(&exact);
            let low = value - Twofold::from(value.to_f64());
            let error = rest.add(&Exact::from(low.to_f64())).abs().div(&exact.abs()).to_f64();
            assert!(error <= bound * u2, "{name} at {a:e}, {c:e}: {} of {bound} u^2", error / u2);
        }
    }
}

//! Every law's kernels against each other: P is the derivative of W and dP that of P, and both transform as they must.
//!
//! Values come from the compiled f64 kernels. Every tolerance is the running error bound of the two sides (see
//! `tensormass_testing::rounding`), plus the truncation error where a difference stands for a derivative; a tolerance
//! so large that nothing could exceed it is itself a failure.

use tensormass_kernels::laws;
use tensormass_testing::point::{NODE_GRADIENTS, Point};
use tensormass_testing::random::Rng;
use tensormass_testing::rounding::{DOUBLE, Rounded, SINGLE};
use tensormass_testing::tensor::{self, Matrix, ddot, det, exact, magnitude, product, rotation, shifted, transpose};

#[path = "derivatives/damping.rs"]
mod damping;
use damping::{
    damping_diagonal_is_differential, damping_is_derivative_of_dissipation, damping_turns_with_the_body,
    ddamping_is_derivative_of_damping, ddamping_is_symmetric, dissipation_is_not_negative, rest_is_free_of_damping,
    rotation_is_not_damped, single_precision_damps_as_double,
};

/// States a law and property.
const STATES: u64 = 60;
/// Principal stretches: compression to half, extension to twice.
const STRETCHES: (f64, f64) = (0.5, 2.0);
/// A tolerance above this part of the values' magnitude would prove nothing.
const USEFUL: f64 = 1e-6;
/// The same for f32, as a multiple of it: between the two lie half the digits of f64.
const SINGLE_USEFUL: f64 = 1e-4 * SINGLE / DOUBLE;

/// One comparison of two values, their tolerance, and the magnitude of such values.
struct Comparison {
    what: String,
    left: f64,
    right: f64,
    tolerance: f64,
    magnitude: f64,
}

/// A law at a random state.
struct Case {
    point: Point,
    rng: Rng,
    g: [f64; 9],
}

impl Case {
    fn same(&self, what: &str, left: &[Rounded], right: &[Rounded]) -> Vec<Comparison> {
        let magnitude = left.iter().chain(right).fold(0.0f64, |m, x| m.max(x.value.abs()));
        let compare = |k: usize| Comparison {
            what: format!("{what} {k}"),
            left: left[k].value,
            right: right[k].value,
            tolerance: left[k].bound(DOUBLE) + right[k].bound(DOUBLE),
            magnitude,
        };
        (0..left.len()).map(compare).collect()
    }

    /// Whether a selection changes its branch between the states that a difference in direction D samples: across such a
    /// kink a difference is no derivative.
    fn crosses_a_kink(&self, d: &[f64; 9]) -> bool {
        let branches = |h: f64| self.point.branches(&moved(&self.g, h, d));
        let here = branches(0.0);
        STEPS.iter().any(|h| branches(*h) != here || branches(-h) != here)
    }

    /// The law is invariant under rotations of the deformed body; the small strain is not.
    fn objective(&self) -> bool {
        !self.point.entry.info.small_strain
    }
}

/// The steps of differences.
const STEPS: [f64; 4] = [1.0 / 128.0, 1.0 / 256.0, 1.0 / 512.0, 1.0 / 1024.0];

/// Central differences with steps h, h/2, h/4, h/8, extrapolated (Romberg): the error is O(h^8), and the difference to
/// the extrapolation one order lower bounds it.
fn derivative<const N: usize>(f: impl Fn(f64) -> [Rounded; N]) -> [(Rounded, f64); N] {
    let samples = STEPS.map(|h| (f(h), f(-h)));
    std::array::from_fn(|k| {
        let mut column: Vec<Rounded> =
            (0..4).map(|i| (samples[i].0[k] - samples[i].1[k]) * Rounded::exact(0.5 / STEPS[i])).collect();
        let mut lower = column[3];
        for order in 1..4 {
            lower = *column.last().expect("one column a level");
            let weight = f64::from(1 << (2 * order));
            column = column
                .windows(2)
                .map(|w| (Rounded::exact(weight) * w[1] - w[0]) / Rounded::exact(weight - 1.0))
                .collect();
        }
        (column[0], (column[0].value - lower.value).abs())
    })
}

/// G + h D, exact: the components of G have 24 digits, those of D and the steps are small multiples of powers of two.
fn moved(g: &[f64; 9], h: f64, d: &[f64; 9]) -> Matrix {
    std::array::from_fn(|k| Rounded::exact(g[k] + h * d[k]))
}

fn stress_is_derivative_of_energy(case: &mut Case) -> Vec<Comparison> {
    let d = case.rng.direction();
    if case.crosses_a_kink(&d) {
        return vec![];
    }
    let [(difference, truncation)] = derivative(|h| [case.point.energy(&moved(&case.g, h, &d))]);
    let p = case.point.force(&exact(&case.g));
    let scale = magnitude(&p);
    let mut all = case.same("dW against P : dG", &[difference], &[ddot(&p, &exact(&d))]);
    all[0].tolerance += truncation;
    all[0].magnitude = scale;
    all
}

fn increment_is_derivative_of_stress(case: &mut Case) -> Vec<Comparison> {
    let d = case.rng.direction();
    if case.crosses_a_kink(&d) {
        return vec![];
    }
    let differences = derivative(|h| case.point.force(&moved(&case.g, h, &d)));
    let increment = case.point.dforce(&exact(&case.g), &exact(&d));
    let mut all = case.same("differences of P against dP", &differences.map(|x| x.0), &increment);
    for (comparison, (_, truncation)) in all.iter_mut().zip(differences) {
        comparison.tolerance += truncation;
    }
    all
}

fn tangent_is_symmetric(case: &mut Case) -> Vec<Comparison> {
    let (a, b) = (exact(&case.rng.direction()), exact(&case.rng.direction()));
    let g = exact(&case.g);
    let (pa, pb) = (case.point.dforce(&g, &a), case.point.dforce(&g, &b));
    let scale = magnitude(&pa).max(magnitude(&pb));
    let mut all = case.same("dG1 : dP(dG2)", &[ddot(&a, &pb)], &[ddot(&b, &pa)]);
    all[0].magnitude = scale;
    all
}

fn diagonal_is_tangent(case: &mut Case) -> Vec<Comparison> {
    let g = exact(&case.g);
    let diagonal = case.point.diagonal(&g);
    let mut all = vec![];
    for (gradient, row) in NODE_GRADIENTS.iter().zip(diagonal) {
        let expected: [Rounded; 3] = std::array::from_fn(|i| {
            let direction = std::array::from_fn(|k| if k / 3 == i { gradient[k % 3] } else { 0.0 });
            ddot(&exact(&direction), &case.point.dforce(&g, &exact(&direction)))
        });
        all.extend(case.same("diagonal", &row, &expected));
    }
    all
}

/// Textbook kernels cancel at rest, each in its own way, to within their rounding bound: of the tangent's magnitude.
fn rest_is_free_of_stress(case: &mut Case) -> Vec<Comparison> {
    let rest = [0.0; 9];
    let bounds = case.point.force(&exact(&rest));
    let tangent = magnitude(&case.point.dforce(&exact(&rest), &exact(&case.rng.direction())));
    let single = case.point.single.force(&[0.0; 9]).0;
    let mut all = case.same("P(0)", &bounds, &[Rounded::exact(0.0); 9]);
    all.iter_mut().for_each(|c| c.magnitude = tangent);
    all.extend((0..9).map(|k| Comparison {
        what: format!("P(0) {k} in f32"),
        left: f64::from(single[k]),
        right: 0.0,
        tolerance: bounds[k].bound(SINGLE),
        magnitude: tangent * SINGLE_USEFUL,
    }));
    all
}

fn energy_and_stress_turn_with_the_body(case: &mut Case) -> Vec<Comparison> {
    if !case.objective() {
        return vec![];
    }
    let q = rotation(case.rng.quaternion());
    let (g, d) = (exact(&case.g), exact(&case.rng.direction()));
    let turned = shifted(&product(&q, &shifted(&g, 1.0)), -1.0);
    let point = &case.point;
    let mut all = case.same("W(QF)", &[point.energy(&turned)], &[point.energy(&g)]);
    all.extend(case.same("P(QF) = Q P(F)", &point.force(&turned), &product(&q, &point.force(&g))));
    let increment = point.dforce(&turned, &product(&q, &d));
    all.extend(case.same("dP(QF, Q dF) = Q dP", &increment, &product(&q, &point.dforce(&g, &d))));
    all
}

/// The material's parameters with its fibre directions turned: a becomes Q' a. A law without any keeps its own.
fn turned(point: &Point, q: &Matrix) -> Point {
    let mut parameters = point.rounded.clone();
    let mut first = 0;
    for p in point.entry.info.parameters {
        if p.direction {
            let a: [Rounded; 3] = std::array::from_fn(|k| parameters[first + k]);
            for k in 0..3 {
                parameters[first + k] = (0..3).map(|i| q[3 * i + k] * a[i]).sum();
            }
        }
        first += p.len;
    }
    Point::of(point.derivation.clone(), point.entry, parameters)
}

/// No direction is preferred but the fibres': W(Q' F Q; Q' a) = W(F; a). Stated so, it holds for small strains too.
fn only_fibres_are_preferred(case: &mut Case) -> Vec<Comparison> {
    let q = rotation(case.rng.quaternion());
    let g = exact(&case.g);
    let conjugate = |a: &Matrix| product(&transpose(&q), &product(a, &q));
    let (point, turned) = (&case.point, turned(&case.point, &q));
    let mut all = case.same("W(Q'FQ; Q'a)", &[turned.energy(&conjugate(&g))], &[point.energy(&g)]);
    all.extend(case.same("P(Q'FQ; Q'a) = Q' P Q", &turned.force(&conjugate(&g)), &conjugate(&point.force(&g))));
    all
}

fn cauchy_stress_is_p_f_over_j(case: &mut Case) -> Vec<Comparison> {
    let g = exact(&case.g);
    let f = shifted(&g, 1.0);
    let sigma = case.point.cauchy(&g);
    let j = det(&f);
    let mut all = case.same("J sigma = P F'", &sigma.map(|s| s * j), &product(&case.point.force(&g), &transpose(&f)));
    if case.objective() {
        all.extend(case.same("sigma is symmetric", &sigma, &transpose(&sigma)));
    }
    all
}

/// Each component in f32 against that in f64, with the bound of its roundings.
fn in_single(what: &str, double: &[Rounded], single: &[f32]) -> Vec<Comparison> {
    let magnitude = double.iter().fold(0.0f64, |m, x| m.max(x.value.abs()));
    let component = |k: usize| Comparison {
        what: format!("{what} {k} in f32"),
        left: f64::from(single[k]),
        right: double[k].value,
        tolerance: double[k].bound(SINGLE),
        magnitude: magnitude * SINGLE_USEFUL,
    };
    (0..single.len()).map(component).collect()
}

/// What f32 kernels lose is rounding, and no more.
fn single_precision_is_double_rounded(case: &mut Case) -> Vec<Comparison> {
    let d = case.rng.direction();
    let (g, g32, d32) = (exact(&case.g), case.g.map(|x| x as f32), d.map(|x| x as f32));
    let (point, single) = (&case.point, &case.point.single);
    let mut all = vec![];
    let mut compare = |what: &str, double: &[Rounded], single: &[f32]| all.extend(in_single(what, double, single));
    compare("W", &[point.energy(&g)], &[single.energy(&g32).0]);
    compare("P", &point.force(&g), &single.force(&g32).0);
    compare("dP", &point.dforce(&g, &exact(&d)), &single.dforce(&g32, &d32));
    compare("diagonal", point.diagonal(&g).as_flattened(), single.diagonal(&g32).as_flattened());
    compare("sigma", &point.cauchy(&g), &single.cauchy(&g32));
    all
}

/// A law with a domain reports the states outside, and no other law reports any; reported as 0 and 1.
fn domain_is_reported(case: &mut Case) -> Vec<Comparison> {
    let mut mirrored = case.g;
    // The first row of F changes sign: J becomes -J.
    mirrored[0] = -2.0 - mirrored[0];
    mirrored[1] = -mirrored[1];
    mirrored[2] = -mirrored[2];
    let mut all = vec![];
    for (name, g) in [("stretched", case.g), ("inverted", mirrored), ("not a number", [f64::NAN; 9])] {
        let g32 = g.map(|x| x as f32);
        let expected = match case.point.entry.info.domain {
            None => false,
            // The domain that nearly every law has is known without its kernels.
            Some("J > 0.0") => name != "stretched",
            Some(_) => case.point.margin(&exact(&g)).is_none_or(|m| m.value.is_nan() || m.value <= 0.0),
        };
        let (double, single) = (&case.point.double, &case.point.single);
        let reports = [double.energy(&g).1, double.force(&g).1, single.energy(&g32).1, single.force(&g32).1];
        all.extend(reports.map(|outside| Comparison {
            what: format!("outside when {name}"),
            left: f64::from(u8::from(outside)),
            right: f64::from(u8::from(expected)),
            tolerance: 0.0,
            magnitude: 1.0,
        }));
    }
    all
}

/// Evaluates a property of every law of the build at random states of random materials.
fn check(property: fn(&mut Case) -> Vec<Comparison>) {
    for entry in laws() {
        let name = entry.info.name;
        let (mut compared, mut bounded, mut all) = (0, 0, 0);
        for seed in 0..STATES {
            let mut rng = Rng::new(seed);
            let point = Point::new(env!("TENSORMASS_GENERATED"), entry, rng.parameters(entry.info));
            let g = point.state(&mut rng, STRETCHES);
            let mut case = Case { point, rng, g };
            let comparisons = property(&mut case);
            compared += usize::from(!comparisons.is_empty());
            all += comparisons.len();
            for c in comparisons {
                let context = format!("{name}, seed {seed}, parameters {:?}, G {g:?}", case.point.parameters);
                let Comparison { what, left, right, tolerance, magnitude } = c;
                let difference = (left - right).abs();
                // Running bounds grow through the rotations of principal axes until they say nothing.
                let useful = USEFUL * magnitude;
                assert!(
                    difference <= tolerance.min(useful),
                    "{what}: {left} against {right}, tolerance {tolerance:e}; {context}"
                );
                bounded += usize::from(tolerance <= useful);
            }
        }
        // The structure is that of the energy.
        let plain = entry.info.structure.polynomial && entry.damping.is_none();
        let rotates = !plain && entry.source.law.contains("stretch_sum");
        assert!(bounded == all || rotates, "{name}: {} of {all} tolerances prove nothing", all - bounded);
        // Some properties are not every law's; some states have a kink nearby.
        assert!(compared == 0 || 2 * compared > STATES as usize, "{name}: {compared} of {STATES} states were compared");
    }
}

macro_rules! properties {
    ($($name:ident),* $(,)?) => { mod each { $( #[test] fn $name() { super::check(super::$name); } )* } };
}
properties!(
    stress_is_derivative_of_energy,
    increment_is_derivative_of_stress,
    tangent_is_symmetric,
    diagonal_is_tangent,
    rest_is_free_of_stress,
    energy_and_stress_turn_with_the_body,
    only_fibres_are_preferred,
    cauchy_stress_is_p_f_over_j,
    single_precision_is_double_rounded,
    domain_is_reported,
    damping_is_derivative_of_dissipation,
    ddamping_is_derivative_of_damping,
    ddamping_is_symmetric,
    damping_diagonal_is_differential,
    rest_is_free_of_damping,
    dissipation_is_not_negative,
    rotation_is_not_damped,
    damping_turns_with_the_body,
    single_precision_damps_as_double,
);

#[test]
fn matrices_of_the_support_crate_are_right() {
    // The tests above would hold with a wrong rotation that is merely orthogonal; this pins it.
    let quarter_turn = tensor::values(&rotation([1.0, 0.0, 0.0, 1.0]));
    assert_eq!(quarter_turn, [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(det(&exact(&[2.0, 1.0, 0.0, 0.0, 3.0, 1.0, 1.0, 0.0, 4.0])).value, 25.0);
}

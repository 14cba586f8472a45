//! Laws with a dissipation: P_v is the derivative of D by the rate, its differential is symmetric, and nothing is damped
//! that only turns. Laws without one have nothing to compare.

use tensormass_testing::rounding::Rounded;
use tensormass_testing::tensor::{Matrix, ddot, exact, magnitude, product, rotation, shifted};

use super::{Case, Comparison, derivative, in_single, moved};

/// A random rate with the case's state, if its law has a dissipation.
fn rate(case: &mut Case) -> Option<[f64; 9]> {
    case.point.entry.damping.map(|_| case.rng.direction())
}

pub fn damping_is_derivative_of_dissipation(case: &mut Case) -> Vec<Comparison> {
    let Some(rate) = rate(case) else { return vec![] };
    let (g, d) = (exact(&case.g), case.rng.direction());
    let [(difference, truncation)] = derivative(|h| [case.point.dissipation(&g, &moved(&rate, h, &d))]);
    let p = case.point.damping(&g, &exact(&rate));
    let mut all = case.same("dD against P_v : dG", &[difference], &[ddot(&p, &exact(&d))]);
    all[0].tolerance += truncation;
    all[0].magnitude = magnitude(&p);
    all
}

pub fn ddamping_is_derivative_of_damping(case: &mut Case) -> Vec<Comparison> {
    let Some(rate) = rate(case) else { return vec![] };
    let (g, d) = (exact(&case.g), case.rng.direction());
    let differences = derivative(|h| case.point.damping(&g, &moved(&rate, h, &d)));
    let increment = case.point.ddamping(&g, &exact(&rate), &exact(&d));
    let mut all = case.same("differences of P_v against dP_v", &differences.map(|x| x.0), &increment);
    for (comparison, (_, truncation)) in all.iter_mut().zip(differences) {
        comparison.tolerance += truncation;
    }
    all
}

pub fn ddamping_is_symmetric(case: &mut Case) -> Vec<Comparison> {
    let Some(rate) = rate(case) else { return vec![] };
    let (a, b) = (exact(&case.rng.direction()), exact(&case.rng.direction()));
    let (g, rate) = (exact(&case.g), exact(&rate));
    let (pa, pb) = (case.point.ddamping(&g, &rate, &a), case.point.ddamping(&g, &rate, &b));
    let mut all = case.same("dG1 : dP_v(dG2)", &[ddot(&a, &pb)], &[ddot(&b, &pa)]);
    all[0].magnitude = magnitude(&pa).max(magnitude(&pb));
    all
}

pub fn damping_diagonal_is_differential(case: &mut Case) -> Vec<Comparison> {
    let Some(rate) = rate(case) else { return vec![] };
    let (g, rate) = (exact(&case.g), exact(&rate));
    let diagonal = case.point.damping_diagonal(&g, &rate);
    let mut all = vec![];
    for (gradient, row) in super::NODE_GRADIENTS.iter().zip(diagonal) {
        let expected: [Rounded; 3] = std::array::from_fn(|i| {
            let direction = std::array::from_fn(|k| if k / 3 == i { gradient[k % 3] } else { 0.0 });
            ddot(&exact(&direction), &case.point.ddamping(&g, &rate, &exact(&direction)))
        });
        all.extend(case.same("damping diagonal", &row, &expected));
    }
    all
}

/// Exactly: a rate of 0 gives products with 0.
pub fn rest_is_free_of_damping(case: &mut Case) -> Vec<Comparison> {
    if case.point.entry.damping.is_none() {
        return vec![];
    }
    let (double, single) = (&case.point.double, &case.point.single);
    let g32 = case.g.map(|x| x as f32);
    let p = double.damping(&case.g, &[0.0; 9]).into_iter();
    let p32 = single.damping(&g32, &[0.0; 9]).map(f64::from).into_iter();
    let density = [double.dissipation(&case.g, &[0.0; 9]), f64::from(single.dissipation(&g32, &[0.0; 9]))];
    let of = |left| Comparison { what: "P_v or D at rate 0".into(), left, right: 0.0, tolerance: 0.0, magnitude: 1.0 };
    p.chain(p32).chain(density).map(of).collect()
}

/// Neither D nor the power P_v : dG/dt that it takes out of the body.
pub fn dissipation_is_not_negative(case: &mut Case) -> Vec<Comparison> {
    let Some(rate) = rate(case) else { return vec![] };
    let (g, rate) = (exact(&case.g), exact(&rate));
    let p = case.point.damping(&g, &rate);
    let values = [("D", case.point.dissipation(&g, &rate)), ("power", ddot(&p, &rate))];
    let negative = |(what, value): (&str, Rounded)| Comparison {
        what: format!("negative {what}"),
        left: value.value.min(0.0),
        right: 0.0,
        tolerance: value.bound(super::DOUBLE),
        magnitude: magnitude(&p),
    };
    values.map(negative).into()
}

/// dF/dt = W F with a skew W: the strain does not change.
pub fn rotation_is_not_damped(case: &mut Case) -> Vec<Comparison> {
    let Some(rate) = rate(case) else { return vec![] };
    if !case.objective() {
        return vec![];
    }
    let skew: Matrix = std::array::from_fn(|k| {
        let (i, j) = (k / 3, k % 3);
        Rounded::exact(
            rate[3 * i.min(j) + i.max(j)] * if i == j { 0.0 } else { f64::from(i as i32 - j as i32).signum() },
        )
    });
    let g = exact(&case.g);
    let spin = product(&skew, &shifted(&g, 1.0));
    let p = case.point.damping(&g, &spin);
    let scale = magnitude(&case.point.damping(&g, &exact(&rate)));
    let mut all = case.same("P_v of a rotation", &p, &[Rounded::exact(0.0); 9]);
    all.iter_mut().for_each(|c| c.magnitude = scale);
    all
}

pub fn damping_turns_with_the_body(case: &mut Case) -> Vec<Comparison> {
    let Some(rate) = rate(case) else { return vec![] };
    if !case.objective() {
        return vec![];
    }
    let q = rotation(case.rng.quaternion());
    let (g, rate) = (exact(&case.g), exact(&rate));
    let (turned, rate_turned) = (shifted(&product(&q, &shifted(&g, 1.0)), -1.0), product(&q, &rate));
    let point = &case.point;
    let mut all = case.same("D(QF)", &[point.dissipation(&turned, &rate_turned)], &[point.dissipation(&g, &rate)]);
    let stress = product(&q, &point.damping(&g, &rate));
    all.extend(case.same("P_v(QF) = Q P_v(F)", &point.damping(&turned, &rate_turned), &stress));
    all
}

pub fn single_precision_damps_as_double(case: &mut Case) -> Vec<Comparison> {
    let Some(rate) = rate(case) else { return vec![] };
    let d = case.rng.direction();
    let [g32, r32, d32] = [case.g, rate, d].map(|m| m.map(|x| x as f32));
    let [g, rate, d] = [case.g, rate, d].map(|m| exact(&m));
    let (point, single) = (&case.point, &case.point.single);
    let mut all = vec![];
    let mut compare = |what: &str, double: &[Rounded], single: &[f32]| all.extend(in_single(what, double, single));
    compare("D", &[point.dissipation(&g, &rate)], &[single.dissipation(&g32, &r32)]);
    compare("P_v", &point.damping(&g, &rate), &single.damping(&g32, &r32));
    compare("dP_v", &point.ddamping(&g, &rate, &d), &single.ddamping(&g32, &r32, &d32));
    let diagonal = single.damping_diagonal(&g32, &r32);
    compare("damping diagonal", point.damping_diagonal(&g, &rate).as_flattened(), diagonal.as_flattened());
    all
}

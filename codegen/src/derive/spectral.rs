//! Sums of powers of the principal stretches, T_a = lambda_1^a + lambda_2^a + lambda_3^a = tr C^(a/2), and their
//! differentials, also where stretches are equal.
//!
//! With C = sum_p (1 + a_p) n_p n_p', dT_a/dC = (a/2) M, where M = C^(a/2 - 1). The differential of M is Daleckii and
//! Krein's (Bhatia, Matrix Analysis, theorem V.3.3): in the frame of the n_p, dM_pq = m_pq dC_pq with the divided
//! differences m_pq = (m(a_p) - m(a_q)) / (a_p - a_q), m(a) = (1 + a)^r, r = a/2 - 1. For the lesser b of the two and
//! h = |a_p - a_q| / (1 + b), this is m(b) expm1(r log1p(h)) / (h (1 + b)): nothing cancels. A tiny number beside h, at
//! which the quotient is r to the last digit, makes equal stretches no exception.
//!
//! There are two decompositions, to be chosen by what a kernel needs:
//!
//! | | gives | accurate |
//! |---|---|---|
//! | [`Spectrum::near_rest`] | a_p | to round-off times the greatest strain: for kernels split at rest |
//! | [`Spectrum::of_deformation`] | lambda_p^2 | each to round-off of itself: for all states; what is small at rest is lost |

mod jacobi;
#[cfg(test)]
mod tests;

use crate::expr::{Expr, Rational, Symbol};
use crate::quantity::{Kind, Quantities, Value};

use super::strain::SYMMETRIC;
use jacobi::{power, select, stage};

/// Beside h in the divided differences, 2^-64: less than the round-off of f64, and far above the least f32.
const DELTA: Rational = Rational::new_raw(1, 1 << 64);

/// What a decomposition gives for each principal axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// a_p, which is small at rest.
    Strain,
    /// lambda_p^2 = 1 + a_p.
    Square,
}

/// What the divided differences of one pair of axes read.
#[derive(Debug, Clone)]
struct Pair {
    /// a or lambda^2 of the first and of the second axis.
    squares: (Expr, Expr),
    /// |a_p - a_q| with the tiny number, and log1p of its ratio to the lesser lambda^2.
    gap: Expr,
    log: Expr,
}

/// The principal axes and stretches of C as stages, shared by all exponents.
#[derive(Debug, Clone)]
pub struct Spectrum {
    form: Form,
    values: [Expr; 3],
    /// ln lambda_p^2, and lambda_p^-2.
    logs: [Expr; 3],
    inverses: [Expr; 3],
    /// n_p o n_q made symmetric, by pair (p, q) and component (k, l), both in the order of `SYMMETRIC`: n_p n_p' where
    /// p = q, and n_p n_q' + n_q n_p' otherwise.
    dyads: [[Expr; 6]; 6],
    pairs: [Pair; 3],
    strain: [Symbol; 6],
    /// C - I in the frame, held while it is differentiated.
    turned: [Symbol; 6],
    sums: usize,
    /// M of each sum that was asked for.
    moments: Vec<[Symbol; 6]>,
}

impl Spectrum {
    /// From A = C - I, six components: exact at rest, where a_p = 0.
    pub fn near_rest(quantities: &mut Quantities, strain: [Symbol; 6]) -> Self {
        let (values, frame) = jacobi::of_symmetric(quantities, strain.map(Expr::from));
        Self::new(quantities, Form::Strain, values, &frame, strain)
    }

    /// From F, row by row; `strain` are the components of A = C - I, by which everything here is differentiated.
    pub fn of_deformation(quantities: &mut Quantities, deformation: [Symbol; 9], strain: [Symbol; 6]) -> Self {
        let (values, frame) = jacobi::of_columns(quantities, deformation.map(Expr::from));
        Self::new(quantities, Form::Square, values, &frame, strain)
    }

    fn new(
        quantities: &mut Quantities,
        form: Form,
        values: [Expr; 3],
        frame: &jacobi::Frame,
        strain: [Symbol; 6],
    ) -> Self {
        let logs = std::array::from_fn(|p| {
            let x = Box::new(values[p].clone());
            stage(quantities, format!("log{p}"), if form == Form::Strain { Expr::Log1p(x) } else { Expr::Ln(x) })
        });
        let inverses = std::array::from_fn(|p| {
            let square = if form == Form::Strain { Expr::int(1) + values[p].clone() } else { values[p].clone() };
            stage(quantities, format!("per_c{p}"), power(square, -1, 1))
        });
        let dyads = SYMMETRIC.map(|(p, q)| {
            SYMMETRIC.map(|(k, l)| {
                let product = |p: usize, q: usize| frame[p][k].clone() * frame[q][l].clone();
                let e = match (p == q, k == l) {
                    (true, _) => product(p, p),
                    (false, true) => Expr::int(2) * product(p, q),
                    (false, false) => product(p, q) + product(q, p),
                };
                stage(quantities, format!("n{p}{q}_{k}{l}"), e)
            })
        });
        let pairs = std::array::from_fn(|k| Pair::new(quantities, form, &values, SYMMETRIC[3 + k]));
        let turned = std::array::from_fn(|pq| {
            let (p, q) = SYMMETRIC[pq];
            let partials = (0..6).map(|kl| {
                // An off-diagonal component of A stands for two; the dyad of a pair counts each of its two.
                let twice = |(i, j): (usize, usize)| if i == j { 1 } else { 2 };
                (strain[kl], Expr::ratio(twice(SYMMETRIC[kl]), twice((p, q))) * dyads[pq][kl].clone())
            });
            let partials = Some(partials.collect());
            let value = Value::Expr(if p == q { values[p].clone() } else { Expr::int(0) });
            quantities.add(format!("A_n{p}{q}"), Kind::Stage { value, partials })
        });
        Self { form, values, logs, inverses, dyads, pairs, strain, turned, sums: 0, moments: vec![] }
    }

    /// lambda_p^a.
    fn power(&self, p: usize, half: &Expr) -> Expr {
        match self.form {
            Form::Strain => Expr::Exp(Box::new(half.clone() * self.logs[p].clone())),
            Form::Square => Expr::Power(Box::new(self.values[p].clone()), Box::new(half.clone())),
        }
    }

    /// lambda_p^(2 e) - 1, without cancellation where the decomposition keeps what is small.
    fn power_from_one(&self, p: usize, e: &Expr) -> Expr {
        Expr::Expm1(Box::new(e.clone() * self.logs[p].clone()))
    }

    /// T_a, with its derivatives by the components of A.
    pub fn stretch_sum(&mut self, quantities: &mut Quantities, exponent: &Expr) -> Symbol {
        let half = half(exponent);
        let powers = self.powers(quantities, &half);
        let moment = self.differentiated(quantities, &half, &powers, None);
        self.moments.push(moment);
        let partials = (0..6).map(|kl| {
            let (k, l) = SYMMETRIC[kl];
            (self.strain[kl], Expr::int(if k == l { 1 } else { 2 }) * half.clone() * moment[kl].into())
        });
        let partials = Some(partials.collect());
        let value = Value::Expr(Expr::Sum(powers.to_vec()));
        quantities.add(format!("T{}", self.sums - 1), Kind::Stage { value, partials })
    }

    /// M - I, six components, with its differential: zero exactly at rest with [`Spectrum::near_rest`].
    pub fn moment_from_rest(&mut self, quantities: &mut Quantities, exponent: &Expr) -> [Symbol; 6] {
        let half = half(exponent);
        let powers = self.powers(quantities, &half);
        let from_one = [0, 1, 2].map(|p| self.power_from_one(p, &less_one(&half)));
        self.differentiated(quantities, &half, &powers, Some(from_one))
    }

    /// The lambda_p^a of one more sum.
    fn powers(&mut self, quantities: &mut Quantities, half: &Expr) -> [Expr; 3] {
        self.sums += 1;
        std::array::from_fn(|p| stage(quantities, format!("power{}_{p}", self.sums - 1), self.power(p, half)))
    }

    /// sum_p m_p n_p n_p', where m_p is `values`, or else lambda_p^(2 r), r = a/2 - 1; with the differential of M.
    fn differentiated(
        &self,
        quantities: &mut Quantities,
        half: &Expr,
        powers: &[Expr; 3],
        values: Option<[Expr; 3]>,
    ) -> [Symbol; 6] {
        let (sum, r) = (self.sums - 1, less_one(half));
        let m: [Expr; 3] = std::array::from_fn(|p| {
            stage(quantities, format!("m{sum}_{p}"), powers[p].clone() * self.inverses[p].clone())
        });
        let values = values.unwrap_or_else(|| m.clone());
        let turned: [Symbol; 6] = std::array::from_fn(|pq| {
            let (p, q) = SYMMETRIC[pq];
            let slope = if p == q {
                r.clone() * m[p].clone() * self.inverses[p].clone()
            } else {
                self.divided_difference(quantities, pq, &r, &m)
            };
            let slope = stage(quantities, format!("m{sum}_{p}{q}"), slope);
            let value = Value::Expr(if p == q { values[p].clone() } else { Expr::int(0) });
            let partials = Some(vec![(self.turned[pq], slope)]);
            quantities.add(format!("M{sum}_n{p}{q}"), Kind::Stage { value, partials })
        });
        std::array::from_fn(|kl| {
            let (k, l) = SYMMETRIC[kl];
            let terms = (0..3).map(|p| values[p].clone() * self.dyads[p][kl].clone()).collect();
            let partials = Some((0..6).map(|pq| (turned[pq], self.dyads[pq][kl].clone())).collect());
            let value = Value::Expr(Expr::Sum(terms));
            quantities.add(format!("M{sum}_{k}{l}"), Kind::Stage { value, partials })
        })
    }

    /// (m_p - m_q) / (a_p - a_q) for p < q.
    fn divided_difference(&self, quantities: &mut Quantities, pq: usize, r: &Expr, m: &[Expr; 3]) -> Expr {
        let (p, q) = SYMMETRIC[pq];
        let Pair { squares, gap, log } = self.pairs[pq - 3].clone();
        let least = select(quantities, "m_least", squares, m[q].clone(), m[p].clone());
        let relative = Expr::Expm1(Box::new(r.clone() * log));
        least * relative / gap
    }

    /// T_a - 3, without cancellation near rest with [`Spectrum::near_rest`]; with its derivatives by M - I.
    pub fn first_order(&self, quantities: &mut Quantities, exponent: &Expr, moment_change: &[Symbol; 6]) -> Symbol {
        let half = half(exponent);
        let terms = (0..3).map(|p| self.power_from_one(p, &half)).collect();
        let partials = (0..6).map(|kl| {
            let (k, l) = SYMMETRIC[kl];
            let change = Expr::from(moment_change[kl]);
            let moment = if k == l { Expr::int(1) + change } else { change };
            (self.strain[kl], Expr::int(if k == l { 1 } else { 2 }) * half.clone() * moment)
        });
        let partials = Some(partials.collect());
        quantities.add("T_1", Kind::Stage { value: Value::Expr(Expr::Sum(terms)), partials })
    }

    /// T_a - 3 - (a/2) tr A, of second order in A: the sum over p of expm1mx(t_p) - (a/2) log1pmx(a_p), where
    /// t_p = (a/2) log1p(a_p). Only with [`Spectrum::near_rest`].
    pub fn second_order(&self, quantities: &mut Quantities, exponent: &Expr) -> Symbol {
        let half = half(exponent);
        let mut terms = vec![];
        for (value, log) in self.values.iter().zip(&self.logs) {
            terms.push(Expr::Expm1mx(Box::new(half.clone() * log.clone())));
            terms.push(Expr::int(-1) * half.clone() * Expr::Log1pmx(Box::new(value.clone())));
        }
        quantities.stage("T_2", Expr::Sum(terms))
    }

    /// The components of M of the k-th sum of [`Spectrum::stretch_sum`].
    pub fn moment(&self, k: usize) -> [Symbol; 6] {
        self.moments[k]
    }
}

impl Pair {
    fn new(quantities: &mut Quantities, form: Form, values: &[Expr; 3], (p, q): (usize, usize)) -> Self {
        let (x, y) = (values[p].clone(), values[q].clone());
        let mut named = |name: &str, then: Expr, otherwise: Expr| {
            select(quantities, format!("{name}{p}{q}"), (x.clone(), y.clone()), then, otherwise)
        };
        let difference = named("apart", x.clone() - y.clone(), y.clone() - x.clone());
        let least = named("least", y.clone(), x.clone());
        let square = |e: Expr| if form == Form::Strain { Expr::int(1) + e } else { e };
        let least = stage(quantities, format!("square{p}{q}"), square(least));
        let gap = stage(quantities, format!("gap{p}{q}"), difference + Expr::Number(DELTA) * least.clone());
        let relative = stage(quantities, format!("h{p}{q}"), gap.clone() * power(least, -1, 1));
        let log = stage(quantities, format!("log{p}{q}"), Expr::Log1p(Box::new(relative)));
        Self { squares: (x, y), gap, log }
    }
}

/// a/2.
pub fn half(exponent: &Expr) -> Expr {
    match exponent {
        Expr::Number(a) => Expr::Number(*a / 2),
        a => Expr::ratio(1, 2) * a.clone(),
    }
}

/// e - 1.
fn less_one(e: &Expr) -> Expr {
    match e {
        Expr::Number(q) => Expr::Number(*q - 1),
        e => e.clone() - Expr::int(1),
    }
}

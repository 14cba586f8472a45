//! What holds exactly for every dissipation density D: at each state and rate, how far it is from holding.

use tensormass_codegen::ir::Number;

use crate::exact::{ExactLaw, Matrix, ddot, difference, product, rotation, shifted};
use crate::identities::derivative;
use crate::number::Exact;
use crate::states::Random;

/// A state, a rate of G there and two directions in which the rate may change.
pub struct Moving<'a> {
    law: &'a ExactLaw<'a>,
    g: Matrix,
    rate: Matrix,
    d: [Matrix; 2],
    /// A random rotation.
    q: Matrix,
    /// A random skew matrix.
    spin: Matrix,
    damping: Matrix,
    differentials: [Matrix; 2],
    /// |P_v|.
    scale: Exact,
}

impl<'a> Moving<'a> {
    pub fn new(law: &'a ExactLaw<'a>, g: Matrix, random: &mut Random) -> Self {
        let [rate, first, second] = std::array::from_fn(|_| random.direction().map(Exact::from));
        let q = rotation(std::array::from_fn(|_| 1.5 + random.signed()));
        let (x, y, z) = (random.signed(), random.signed(), random.signed());
        let spin = [0.0, -z, y, z, 0.0, -x, -y, x, 0.0].map(Exact::from);
        let d = [first, second];
        let damping = law.damping(&g, &rate);
        let differentials = d.each_ref().map(|d| law.damping_differential(&g, &rate, d));
        let scale = Exact::norm(&damping);
        Self { law, g, rate, d, q, spin, damping, differentials, scale }
    }

    /// P_v at a rate of 0, as a part of P_v at the rate.
    pub fn rest(&self) -> f64 {
        let zero: Matrix = std::array::from_fn(|_| Exact::zero());
        difference(&self.law.damping(&self.g, &zero), &zero, &self.scale)
    }

    /// P_v : d against the derivative of D by the rate.
    pub fn dissipation_and_damping(&self) -> f64 {
        let [d, _] = &self.d;
        let rate = derivative(&self.rate, d, |rate| vec![self.law.dissipation(&self.g, rate)]);
        difference(&rate, &[ddot(&self.damping, d)], &self.scale.mul(&Exact::norm(d)))
    }

    /// dP_v against the derivative of P_v by the rate.
    pub fn damping_and_differential(&self) -> f64 {
        let [d, _] = &self.d;
        let rate = derivative(&self.rate, d, |rate| self.law.damping(&self.g, rate).to_vec());
        difference(&rate, &self.differentials[0], &Exact::norm(&self.differentials[0]))
    }

    /// d1 : dP_v(d2) against d2 : dP_v(d1).
    pub fn symmetry(&self) -> f64 {
        let ([a, b], [of_a, of_b]) = (&self.d, &self.differentials);
        let scale = Exact::norm(of_a).mul(&Exact::norm(b)).add(&Exact::norm(of_b).mul(&Exact::norm(a)));
        difference(&[ddot(a, of_b)], &[ddot(b, of_a)], &scale)
    }

    /// D(Q F, Q dF/dt) = D and P_v(Q F, Q dF/dt) = Q P_v; and no damping of dF/dt = W F with a skew W.
    pub fn objectivity(&self) -> f64 {
        let f = shifted(&self.g, 1.0);
        let turned = shifted(&product(&self.q, &f), -1.0);
        let rate = product(&self.q, &self.rate);
        let stress = difference(&self.law.damping(&turned, &rate), &product(&self.q, &self.damping), &self.scale);
        let [here, there] = [(&self.g, &self.rate), (&turned, &rate)].map(|(g, rate)| self.law.dissipation(g, rate));
        let zero: Matrix = std::array::from_fn(|_| Exact::zero());
        let of_spin = self.law.damping(&self.g, &product(&self.spin, &f));
        stress.max(difference(&[there], std::slice::from_ref(&here), &here.abs())).max(difference(
            &of_spin,
            &zero,
            &self.scale,
        ))
    }

    /// How far below 0 D or the power P_v : dG/dt is that leaves the body, as a part of |P_v| |dG/dt|.
    pub fn negative(&self) -> f64 {
        let scale = self.scale.mul(&Exact::norm(&self.rate));
        let below = |x: &Exact| if x.is_positive() || x.is_zero() { 0.0 } else { x.abs().div(&scale).to_f64() };
        below(&self.law.dissipation(&self.g, &self.rate)).max(below(&ddot(&self.damping, &self.rate)))
    }
}

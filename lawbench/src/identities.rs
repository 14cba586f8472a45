//! What holds exactly for every hyperelastic law: at each state, how far it is from holding.

use tensormass_codegen::ir::{Input, Number};

use crate::exact::{ExactLaw, Matrix, ddot, det, difference, moved, product, rotation, shifted, transpose};
use crate::number::Exact;
use crate::states::Random;

/// Identities are of 448 bits: what is left of 140 bits of cancellation, and 250 bits below what f64 could see.
pub const IDENTITY: f64 = 1e-90;

/// Central differences over h = 1e-24, extrapolated once, are off by h^4 times a ratio of derivatives, which at stretches
/// between 1/11 and 11 is below 1e36: exponentials of the strain's square come to 1e22.
pub const DIFFERENCE: f64 = 1e-60;

/// A state and a random direction, and what is needed to move them.
pub struct At<'a> {
    pub law: &'a ExactLaw<'a>,
    pub g: Matrix,
    pub d: Matrix,
    /// A random rotation.
    pub q: Matrix,
    stress: Matrix,
    tangent: [Matrix; 9],
    /// |dP/dG|.
    stiffness: Exact,
    /// The greatest stress that an error of the size of G could cause: |dP/dG| |G| + |P|.
    scale: Exact,
}

impl<'a> At<'a> {
    pub fn new(law: &'a ExactLaw<'a>, g: Matrix, random: &mut Random) -> Self {
        let d = random.direction().map(Exact::from);
        // No component of the quaternion is 0: no axis of coordinates is special.
        let q = rotation(std::array::from_fn(|_| 1.5 + random.signed()));
        let (stress, tangent) = (law.stress(&g), law.tangent(&g));
        let stiffness = Exact::norm(tangent.as_flattened());
        let scale = stiffness.fma(&Exact::norm(&g), &Exact::norm(&stress));
        Self { law, g, d, q, stress, tangent, stiffness, scale }
    }

    /// P : D against the derivative of W.
    pub fn energy_and_force(&self) -> f64 {
        let power = ddot(&self.stress, &self.d);
        let rate = derivative(&self.g, &self.d, |g| vec![self.law.energy(g)]);
        difference(&rate, &[power], &self.scale.mul(&Exact::norm(&self.d)))
    }

    /// dP against the derivative of P.
    pub fn force_and_dforce(&self) -> f64 {
        let differential = self.law.differential(&self.g, &self.d);
        let rate = derivative(&self.g, &self.d, |g| self.law.stress(g).to_vec());
        difference(&rate, &differential, &self.stiffness.mul(&Exact::norm(&self.d)))
    }

    /// The tangent against its transpose.
    pub fn symmetry(&self) -> f64 {
        let t = &self.tangent;
        let transposed: Vec<Exact> = (0..81).map(|k| t[k % 9][k / 9].clone()).collect();
        difference(t.as_flattened(), &transposed, &Exact::norm(t.as_flattened()))
    }

    /// W(QF) = W(F) and P(QF) = Q P(F).
    pub fn objectivity(&self) -> f64 {
        let turned = shifted(&product(&self.q, &shifted(&self.g, 1.0)), -1.0);
        self.moved_alike(&turned, |p| product(&self.q, p))
    }

    /// W(FQ) = W(F) and P(FQ) = P(F) Q.
    pub fn isotropy(&self) -> f64 {
        let turned = shifted(&product(&shifted(&self.g, 1.0), &self.q), -1.0);
        self.moved_alike(&turned, |p| product(p, &self.q))
    }

    fn moved_alike(&self, turned: &Matrix, stress: impl Fn(&Matrix) -> Matrix) -> f64 {
        let found = self.law.stress(turned);
        let wanted = stress(&self.stress);
        let (scale, size) = (&self.scale, Exact::norm(&self.g).add(&Exact::from(1.0)));
        let [w, moved] = [&self.g, turned].map(|g| self.law.energy(g));
        difference(&found, &wanted, scale).max(difference(&[moved], &[w], &scale.mul(&size)))
    }

    /// The kernels `diagonal` and `cauchy` against dP and P.
    pub fn other_kernels(&self) -> f64 {
        let n: [Exact; 3] = std::array::from_fn(|k| self.d[k].clone());
        let wanted: Vec<Exact> = (0..3)
            .map(|i| {
                let direction = std::array::from_fn(|k| if k / 3 == i { n[k % 3].clone() } else { Exact::zero() });
                ddot(&self.law.differential(&self.g, &direction), &direction)
            })
            .collect();
        let diagonal =
            difference(&self.law.diagonal(&self.g, &n), &wanted, &self.stiffness.mul(&ddot(&self.d, &self.d)));
        let f = shifted(&self.g, 1.0);
        let j = det(&f);
        let kirchhoff = product(&self.stress, &transpose(&f));
        let wanted = kirchhoff.map(|x| x.div(&j));
        let scale = self.scale.mul(&Exact::norm(&f)).div(&j.abs());
        diagonal.max(difference(&self.law.cauchy(&self.g), &wanted, &scale))
    }

    /// The printed kernels against the textbook form, where they are another form of the same.
    pub fn forms(&self) -> f64 {
        let rest: Matrix = std::array::from_fn(|_| Exact::zero());
        let count = |g: &Matrix| self.law.printed("energy", g, &[]).remove(0);
        let energy = count(&self.g).sub(&count(&rest));
        let wanted = self.law.energy(&self.g).sub(&self.law.energy(&rest));
        let (scale, size) = (&self.scale, Exact::norm(&self.g));
        let stress = self.law.printed("force", &self.g, &[]);
        let differential = self.law.printed("dforce", &self.g, &[(Input::GradientIncrement, &self.d)]);
        let stiffness = self.stiffness.mul(&Exact::norm(&self.d));
        difference(&[energy], &[wanted], &scale.mul(&size))
            .max(difference(&stress, &self.stress, scale))
            .max(difference(&differential, &self.law.differential(&self.g, &self.d), &stiffness))
    }
}

/// The derivative of `f` at G along D: central differences over h and h / 2, extrapolated (Richardson).
pub fn derivative(g: &Matrix, d: &Matrix, f: impl Fn(&Matrix) -> Vec<Exact>) -> Vec<Exact> {
    let over = |h: &Exact| -> Vec<Exact> {
        let (ahead, behind) = (f(&moved(g, h, d)), f(&moved(g, &h.neg(), d)));
        let twice = h.add(h);
        ahead.iter().zip(&behind).map(|(a, b)| a.sub(b).div(&twice)).collect()
    };
    let h = Exact::power_of_ten(-24);
    let (wide, narrow) = (over(&h), over(&h.mul(&Exact::from(0.5))));
    let (four, three) = (Exact::from(4.0), Exact::from(3.0));
    wide.iter().zip(&narrow).map(|(w, n)| four.mul(n).sub(w).div(&three)).collect()
}

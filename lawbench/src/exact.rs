//! A law's exact values at a state: its textbook form in 448 bits.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Input, Number};

use crate::evaluate::{printed, textbook};
use crate::lanes::tangent;
use crate::material::Material;
use crate::number::Exact;
use crate::undecided::Selections;

/// 3 by 3, row by row.
pub type Matrix = [Exact; 9];

/// A law and a material.
pub struct ExactLaw<'a> {
    derivation: &'a Derivation,
    constants: Vec<Exact>,
}

impl<'a> ExactLaw<'a> {
    pub fn new(derivation: &'a Derivation, material: &Material) -> Self {
        Self { derivation, constants: material.exact_constants(derivation) }
    }

    /// Whether the law has selections.
    pub fn selects(&self) -> bool {
        Selections::new(self.derivation).exist()
    }

    /// Whether a selection of the law is not decided by G in double precision.
    pub fn is_undecided(&self, gradient: &Matrix) -> bool {
        let here = tangent(self.derivation, &self.constants, gradient);
        let [undecided] =
            Selections::new(self.derivation).are_undecided(&self.constants, gradient, &here, [f64::EPSILON]);
        undecided
    }

    fn values(&self, kernel: &str, g: &Matrix, more: &[(Input, &[Exact])]) -> Vec<Exact> {
        textbook(self.derivation, kernel, &self.inputs(g, more)).value
    }

    fn inputs<'b>(&'b self, g: &'b Matrix, more: &[(Input, &'b [Exact])]) -> Vec<(Input, &'b [Exact])> {
        let mut inputs = vec![(Input::Constants, self.constants.as_slice()), (Input::DisplacementGradient, &g[..])];
        inputs.extend_from_slice(more);
        inputs
    }

    /// The domain's margin; none where the law holds everywhere.
    pub fn margin(&self, g: &Matrix) -> Option<Exact> {
        textbook(self.derivation, "force", &self.inputs(g, &[])).margin
    }

    /// Whether G is inside the domain.
    pub fn inside(&self, g: &Matrix) -> bool {
        self.margin(g).is_none_or(|m| m.is_positive())
    }

    /// W, from whatever the law file counts it.
    pub fn energy(&self, g: &Matrix) -> Exact {
        self.values("energy", g, &[]).remove(0)
    }

    /// P.
    pub fn stress(&self, g: &Matrix) -> Matrix {
        matrix(self.values("force", g, &[]))
    }

    /// dP in the direction D.
    pub fn differential(&self, g: &Matrix, d: &Matrix) -> Matrix {
        matrix(self.values("dforce", g, &[(Input::GradientIncrement, d)]))
    }

    /// dP/dG: entry [k][i] is the derivative of component i by G's component k.
    pub fn tangent(&self, g: &Matrix) -> [Matrix; 9] {
        tangent(self.derivation, &self.constants, g)
    }

    /// The tangent's diagonal for the gradient n of a node's interpolation function.
    pub fn diagonal(&self, g: &Matrix, n: &[Exact; 3]) -> Vec<Exact> {
        self.values("diagonal", g, &[(Input::NodeGradient, n)])
    }

    /// The Cauchy stress.
    pub fn cauchy(&self, g: &Matrix) -> Matrix {
        matrix(self.values("cauchy", g, &[]))
    }

    /// D at a rate of G.
    pub fn dissipation(&self, g: &Matrix, rate: &Matrix) -> Exact {
        self.values("dissipation", g, &[(Input::GradientRate, rate)]).remove(0)
    }

    /// P_v at a rate of G.
    pub fn damping(&self, g: &Matrix, rate: &Matrix) -> Matrix {
        matrix(self.values("damping", g, &[(Input::GradientRate, rate)]))
    }

    /// dP_v in the direction D of the rate.
    pub fn damping_differential(&self, g: &Matrix, rate: &Matrix, d: &Matrix) -> Matrix {
        matrix(self.values("ddamping", g, &[(Input::GradientRate, rate), (Input::GradientIncrement, d)]))
    }

    /// What the printed kernel of this name gives, exactly, in the place of the textbook form.
    pub fn printed(&self, kernel: &str, g: &Matrix, more: &[(Input, &[Exact])]) -> Vec<Exact> {
        printed(self.derivation, kernel, &self.inputs(g, more)).value
    }
}

fn matrix(values: Vec<Exact>) -> Matrix {
    values.try_into().expect("a kernel's tensors have nine components")
}

/// A matrix of f64.
pub fn exact(a: &[f64; 9]) -> Matrix {
    a.map(Exact::from)
}

/// A B.
pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|k| (0..3).fold(Exact::zero(), |sum, m| a[k / 3 * 3 + m].fma(&b[3 * m + k % 3], &sum)))
}

/// A'.
pub fn transpose(a: &Matrix) -> Matrix {
    std::array::from_fn(|k| a[3 * (k % 3) + k / 3].clone())
}

/// A + s B.
pub fn moved(a: &Matrix, s: &Exact, b: &Matrix) -> Matrix {
    std::array::from_fn(|k| s.fma(&b[k], &a[k]))
}

/// A + s 1.
pub fn shifted(a: &Matrix, s: f64) -> Matrix {
    std::array::from_fn(|k| if k % 4 == 0 { a[k].add(&Exact::from(s)) } else { a[k].clone() })
}

/// A : B.
pub fn ddot(a: &Matrix, b: &Matrix) -> Exact {
    (0..9).fold(Exact::zero(), |sum, k| a[k].fma(&b[k], &sum))
}

/// det A.
pub fn det(a: &Matrix) -> Exact {
    let minor = |p: usize, q: usize, r: usize, s: usize| a[p].mul(&a[s]).sub(&a[q].mul(&a[r]));
    a[0].mul(&minor(4, 5, 7, 8)).sub(&a[1].mul(&minor(3, 5, 6, 8))).add(&a[2].mul(&minor(3, 4, 6, 7)))
}

/// The rotation of a quaternion that need not have length one: orthogonal but for the last bits.
pub fn rotation(q: [f64; 4]) -> Matrix {
    let [w, x, y, z] = q.map(Exact::from);
    let square = |a: &Exact| a.mul(a);
    let s = Exact::from(2.0).div(&square(&w).add(&square(&x)).add(&square(&y)).add(&square(&z)));
    let sum = |a: &Exact, b: &Exact, c: &Exact, d: &Exact| s.mul(&a.mul(b).add(&c.mul(d)));
    let less = |a: &Exact, b: &Exact, c: &Exact, d: &Exact| s.mul(&a.mul(b).sub(&c.mul(d)));
    let diagonal = |a: &Exact, b: &Exact| Exact::from(1.0).sub(&sum(a, a, b, b));
    [
        diagonal(&y, &z),
        less(&x, &y, &w, &z),
        sum(&x, &z, &w, &y),
        sum(&x, &y, &w, &z),
        diagonal(&x, &z),
        less(&y, &z, &w, &x),
        less(&x, &z, &w, &y),
        sum(&y, &z, &w, &x),
        diagonal(&x, &y),
    ]
}

/// The size of the difference of two lists of numbers, as a part of `scale`; 0 where both are 0.
pub fn difference(a: &[Exact], b: &[Exact], scale: &Exact) -> f64 {
    let off: Vec<Exact> = a.iter().zip(b).map(|(a, b)| a.sub(b)).collect();
    let off = Exact::norm(&off);
    if off.is_zero() { 0.0 } else { off.div(scale).to_f64() }
}

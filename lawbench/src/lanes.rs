//! Nine numbers side by side: a whole tangent by one interpretation of the force differential.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Input, Number, Rational};

use crate::evaluate::textbook;
use crate::number::Exact;

/// A number that is the same in nine lanes, or one a lane. What depends on G alone is computed once.
#[derive(Debug, Clone)]
enum Lanes {
    Same(Exact),
    Each(Box<[Exact; 9]>),
}

impl Lanes {
    fn lane(&self, k: usize) -> &Exact {
        match self {
            Self::Same(x) => x,
            Self::Each(x) => &x[k],
        }
    }

    fn one(&self, f: impl Fn(&Exact) -> Exact) -> Self {
        match self {
            Self::Same(x) => Self::Same(f(x)),
            Self::Each(x) => Self::Each(Box::new(std::array::from_fn(|k| f(&x[k])))),
        }
    }

    fn two(&self, b: &Self, f: impl Fn(&Exact, &Exact) -> Exact) -> Self {
        match (self, b) {
            (Self::Same(a), Self::Same(b)) => Self::Same(f(a, b)),
            _ => Self::Each(Box::new(std::array::from_fn(|k| f(self.lane(k), b.lane(k))))),
        }
    }
}

impl Number for Lanes {
    fn from_rational(q: Rational) -> Self {
        Self::Same(Exact::from_rational(q))
    }
    fn add(&self, b: &Self) -> Self {
        self.two(b, Exact::add)
    }
    fn sub(&self, b: &Self) -> Self {
        self.two(b, Exact::sub)
    }
    fn mul(&self, b: &Self) -> Self {
        self.two(b, Exact::mul)
    }
    fn div(&self, b: &Self) -> Self {
        self.two(b, Exact::div)
    }
    fn neg(&self) -> Self {
        self.one(Exact::neg)
    }
    fn fma(&self, b: &Self, c: &Self) -> Self {
        self.mul(b).add(c)
    }
    fn sqrt(&self) -> Self {
        self.one(Exact::sqrt)
    }
    fn ln(&self) -> Self {
        self.one(Exact::ln)
    }
    fn exp(&self) -> Self {
        self.one(Exact::exp)
    }
    fn log1p(&self) -> Self {
        self.one(Exact::log1p)
    }
    fn expm1(&self) -> Self {
        self.one(Exact::expm1)
    }
    fn log1pmx(&self) -> Self {
        self.one(Exact::log1pmx)
    }
    fn expm1mx(&self) -> Self {
        self.one(Exact::expm1mx)
    }
    fn powf(&self, b: &Self) -> Self {
        self.two(b, Exact::powf)
    }
    /// Kernels compare what depends on G, which is the same in all lanes.
    fn greater(&self, b: &Self) -> bool {
        self.lane(0).greater(b.lane(0))
    }
}

/// The tangent dP/dG at G, exactly: entry [k][i] is the derivative of P's component i by G's component k.
pub fn tangent(derivation: &Derivation, constants: &[Exact], gradient: &[Exact; 9]) -> [[Exact; 9]; 9] {
    let same = |values: &[Exact]| values.iter().cloned().map(Lanes::Same).collect::<Vec<_>>();
    let unit =
        |k: usize| Lanes::Each(Box::new(std::array::from_fn(|lane| Exact::from(if lane == k { 1.0 } else { 0.0 }))));
    let (constants, gradient) = (same(constants), same(gradient));
    let increment: [Lanes; 9] = std::array::from_fn(unit);
    let inputs = [
        (Input::Constants, constants.as_slice()),
        (Input::DisplacementGradient, gradient.as_slice()),
        (Input::GradientIncrement, increment.as_slice()),
    ];
    let stress = textbook(derivation, "dforce", &inputs).value;
    std::array::from_fn(|k| std::array::from_fn(|i| stress[i].lane(k).clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::subject::Subject;

    /// Column by column, the tangent is the force differential in the direction of one component.
    #[test]
    fn columns_are_force_differentials() {
        for entry in tensormass_kernels::laws() {
            let subject = Subject::of_build(entry);
            let constants = Material::usual(&subject).expect("a material").exact_constants(&subject.derivation);
            let g: [Exact; 9] = std::array::from_fn(|k| Exact::from(0.05 * (k as f64 - 3.5) / 4.0));
            let all = tangent(&subject.derivation, &constants, &g);
            for k in 0..9 {
                let direction: [Exact; 9] = std::array::from_fn(|i| Exact::from(if i == k { 1.0 } else { 0.0 }));
                let inputs = [
                    (Input::Constants, constants.as_slice()),
                    (Input::DisplacementGradient, &g[..]),
                    (Input::GradientIncrement, &direction[..]),
                ];
                let one = textbook(&subject.derivation, "dforce", &inputs).value;
                for i in 0..9 {
                    assert!(all[k][i].sub(&one[i]).is_zero(), "{}: {k}, {i}", entry.info.name);
                }
            }
        }
    }
}

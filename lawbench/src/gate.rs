//! The accuracy that kernels owe: exact values at a state, and bounds that the state's own conditioning gives.
//!
//! G is given in the working precision, and the parameters as f64. Errors are against the exact values for these, so that
//! the rounding of the material's constants is part of a kernel's error. With u the unit round-off,
//!
//! ```text
//! |P^ - P|   <= k u (|dP/dG| |G| + |P|)                                k = 4
//! |dP^ - dP| <= k u (|d2P/dG2[D]| |G| + |dP/dG| |D|)                   k = 4
//! |W^ - W|   <= k u (|P| |G| + |W|) + (k u)^2 |dP/dG| |G|^2 / 2        k = 8
//! ```
//!
//! in Frobenius norms; WGSL is granted twice as much. A state counts where it is inside the law's domain, the values and
//! their bounds are normal numbers of the precision, and the tangent does not jump within the rounding of G: where a
//! selection of the law is not decided by the input ([`crate::undecided`]), nothing is promised.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Input, Number};

use crate::evaluate::textbook;
use crate::lanes::tangent;
use crate::number::Exact;
use crate::undecided::Selections;

/// What computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Machine {
    /// The printed Rust in single precision.
    F32,
    /// The printed Rust in double precision.
    F64,
    /// The printed WGSL on an adapter, in single precision.
    Wgsl,
}

impl Machine {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
            Self::Wgsl => "wgsl",
        }
    }

    /// Unit round-off.
    pub fn round_off(self) -> f64 {
        match self {
            Self::F32 | Self::Wgsl => f64::from(f32::EPSILON) / 2.0,
            Self::F64 => f64::EPSILON / 2.0,
        }
    }

    /// The least and the greatest normal number.
    fn normal(self) -> (f64, f64) {
        match self {
            Self::F32 | Self::Wgsl => (f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)),
            Self::F64 => (f64::MIN_POSITIVE, f64::MAX),
        }
    }
}

/// What is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
pub enum Quantity {
    /// The first Piola-Kirchhoff stress.
    P,
    /// The strain energy density, counted from rest.
    W,
    /// The differential of the stress.
    #[serde(rename = "dP")]
    DP,
}

/// Every quantity.
pub const QUANTITIES: [Quantity; 3] = [Quantity::P, Quantity::W, Quantity::DP];

impl Quantity {
    /// Its symbol.
    pub fn name(self) -> &'static str {
        match self {
            Self::P => "P",
            Self::W => "W",
            Self::DP => "dP",
        }
    }
}

/// An error, measured in two ways.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    /// As a part of the bound: above 1 the kernel owes more.
    pub gate: f64,
    /// As a part of the exact value.
    pub relative: f64,
}

/// The exact values at a state, and what bounds are made of.
#[derive(Debug, Clone)]
pub struct Reference {
    values: [Vec<Exact>; 3],
    /// The bound of each quantity divided by k u: condition times value.
    first: [Exact; 3],
    /// |dP/dG| |G|^2 / 2, of second order in W's bound.
    second: Exact,
    /// |dP/dG| |G| / |P|.
    pub condition: f64,
    /// Whether a selection is not decided by G in single and in double precision.
    undecided: [bool; 2],
}

impl Reference {
    /// At G in the direction D; none where the state is outside the law's domain, or a value is not defined there.
    ///
    /// `energy_at_rest` is W(0): W counts from rest.
    pub fn new(
        derivation: &Derivation,
        constants: &[Exact],
        energy_at_rest: &Exact,
        gradient: &[f64; 9],
        direction: &[f64; 9],
    ) -> Option<Self> {
        let (g, d) = (gradient.map(Exact::from), direction.map(Exact::from));
        let inputs = [(Input::Constants, constants), (Input::DisplacementGradient, &g[..])];
        let force = textbook(derivation, "force", &inputs);
        if force.margin.is_some_and(|m| !m.is_positive()) {
            return None;
        }
        let energy = textbook(derivation, "energy", &inputs).value[0].sub(energy_at_rest);
        let here = tangent(derivation, constants, &g);
        // A one-sided difference: its error is a part in 1e40 of the next derivative.
        let step = Exact::power_of_ten(-40);
        let curvature = tangent_change(derivation, constants, &here, (&g, &d), &step).div(&step);
        let differential: Vec<Exact> =
            (0..9).map(|i| (0..9).fold(Exact::zero(), |sum, k| here[k][i].fma(&d[k], &sum))).collect();

        let selections = Selections::new(derivation);
        let undecided = selections.are_undecided(constants, &g, &here, [f32::EPSILON.into(), f64::EPSILON]);
        let [g, d, p] = [&g[..], &d[..], &force.value].map(Exact::norm);
        let stiffness = Exact::norm(here.as_flattened());
        let pull = stiffness.mul(&g);
        let first = [pull.add(&p), p.fma(&g, &energy.abs()), curvature.fma(&g, &stiffness.mul(&d))];
        let second = pull.mul(&g).mul(&Exact::from(0.5));
        let condition = pull.div(&p).to_f64();
        let values = [force.value, vec![energy], differential];
        let finite = values.iter().flatten().chain(&first).all(Exact::is_finite);
        finite.then_some(Self { values, first, second, condition, undecided })
    }

    /// The exact value.
    pub fn value(&self, quantity: Quantity) -> &[Exact] {
        &self.values[quantity as usize]
    }

    /// What a value may be off by.
    pub fn bound(&self, machine: Machine, quantity: Quantity) -> Exact {
        let granted = if machine == Machine::Wgsl { 2.0 } else { 1.0 };
        let k = granted * if quantity == Quantity::W { 8.0 } else { 4.0 };
        let ku = Exact::from(k * machine.round_off());
        let bound = self.first[quantity as usize].mul(&ku);
        if quantity == Quantity::W { ku.mul(&ku).fma(&self.second, &bound) } else { bound }
    }

    /// How far a machine's value is off; none where the gate makes no promise.
    pub fn measure(&self, machine: Machine, quantity: Quantity, computed: &[f64]) -> Option<Measure> {
        if self.undecided[usize::from(machine == Machine::F64)] {
            return None;
        }
        let (least, greatest) = machine.normal();
        let bound = self.bound(machine, quantity);
        let value = self.value(quantity);
        let size = Exact::norm(value);
        let normal = |x: &Exact| !Exact::from(least).greater(x) && !x.greater(&Exact::from(greatest));
        if !normal(&size) || !normal(&bound) {
            return None;
        }
        if computed.iter().any(|x| !x.is_finite()) {
            return Some(Measure { gate: f64::INFINITY, relative: f64::INFINITY });
        }
        let error: Vec<Exact> = value.iter().zip(computed).map(|(x, c)| Exact::from(*c).sub(x)).collect();
        let error = Exact::norm(&error);
        Some(Measure { gate: error.div(&bound).to_f64(), relative: error.div(&size).to_f64() })
    }
}

/// |dP/dG at G + step D - dP/dG at G|, where `here` is the latter.
fn tangent_change(
    derivation: &Derivation,
    constants: &[Exact],
    here: &[[Exact; 9]; 9],
    (g, d): (&[Exact; 9], &[Exact; 9]),
    step: &Exact,
) -> Exact {
    let there = tangent(derivation, constants, &std::array::from_fn(|k| d[k].fma(step, &g[k])));
    let change: Vec<Exact> = there.as_flattened().iter().zip(here.as_flattened()).map(|(a, b)| a.sub(b)).collect();
    Exact::norm(&change)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::states::Random;
    use crate::subject::Subject;

    /// At a state of each law: the exact value rounded to the precision is inside the gate, the same value off by half
    /// its bound once more inside, and off by twice its bound outside.
    #[test]
    fn the_gate_is_where_the_bound_says() {
        for entry in tensormass_kernels::laws() {
            let subject = Subject::of_build(entry);
            let derivation = &subject.derivation;
            let constants = Material::usual(&subject).expect("a material").exact_constants(derivation);
            let mut random = Random::new(&[7]);
            for strain in [1e-6, 0.1] {
                let g = random.gradient(strain, 0.5, 0).map(|x| f64::from(x as f32));
                let d = random.direction().map(|x| f64::from(x as f32));
                let reference = Reference::new(derivation, &constants, &Exact::zero(), &g, &d).expect("inside");
                assert!(reference.condition > 0.5, "{}: {}", entry.info.name, reference.condition);
                for (quantity, k) in QUANTITIES.into_iter().zip([4.0, 8.0, 4.0]) {
                    let exact: Vec<f64> = reference.value(quantity).iter().map(Exact::to_f64).collect();
                    let rounded: Vec<f64> = exact.iter().map(|x| f64::from(*x as f32)).collect();
                    let gate = |values: &[f64]| reference.measure(Machine::F32, quantity, values).expect("normal").gate;
                    if reference.undecided[0] {
                        continue;
                    }
                    assert!(gate(&rounded) <= 1.0, "{} {quantity:?}", entry.info.name);
                    let unit = k * f64::from(f32::EPSILON) / 2.0 * reference.first[quantity as usize].to_f64();
                    // W's bound is greater by its part of second order.
                    let second = (k * f64::from(f32::EPSILON) / 2.0).powi(2) * reference.second.to_f64();
                    let unit = unit + if quantity == Quantity::W { second } else { 0.0 };
                    for (part, inside) in [(0.5, true), (2.0, false)] {
                        let mut off = exact.clone();
                        off[0] += part * unit;
                        assert_eq!(gate(&off) <= 1.0, inside, "{} {quantity:?} {part}", entry.info.name);
                        assert!((gate(&off) / part - 1.0).abs() < 1e-6, "{} {quantity:?}", entry.info.name);
                    }
                    let wgsl = reference.measure(Machine::Wgsl, quantity, &rounded).expect("normal");
                    assert!(wgsl.gate <= 0.5 * gate(&rounded) * (1.0 + 1e-6));
                    let nan = vec![f64::NAN; exact.len()];
                    assert_eq!(gate(&nan), f64::INFINITY);
                }
            }
        }
    }

    /// The second derivative's norm is the one that central differences of tangents in f64 give.
    #[test]
    fn curvature_is_the_tangents_rate() {
        for entry in tensormass_kernels::laws() {
            let subject = Subject::of_build(entry);
            let derivation = &subject.derivation;
            let constants = Material::usual(&subject).expect("a material").exact_constants(derivation);
            let mut random = Random::new(&[8]);
            let (g, d) = (random.gradient(0.2, 0.5, 0), random.direction());
            let reference = Reference::new(derivation, &constants, &Exact::zero(), &g, &d).expect("inside");
            let [size, length] = [&g, &d].map(|x| x.iter().map(|x| x * x).sum::<f64>().sqrt());
            let step = 1e-4;
            let at = |t: f64| -> Vec<f64> {
                let g = std::array::from_fn(|k| Exact::from(g[k] + t * d[k]));
                tangent(derivation, &constants, &g).as_flattened().iter().map(Exact::to_f64).collect()
            };
            let (ahead, behind) = (at(step), at(-step));
            let stiffness = at(0.0).iter().map(|x| x * x).sum::<f64>().sqrt();
            let rate = ahead.iter().zip(&behind).map(|(a, b)| ((a - b) / (2.0 * step)).powi(2)).sum::<f64>().sqrt();
            let wanted = rate * size + stiffness * length;
            let found = reference.first[Quantity::DP as usize].to_f64();
            // The difference's own error is of the order of step^2 times a ratio of derivatives.
            assert!((found / wanted - 1.0).abs() < 1e-5, "{}: {found} {wanted}", entry.info.name);
        }
    }

    /// What no normal number of the precision can hold is not promised.
    #[test]
    fn subnormal_values_are_not_measured() {
        let subject = Subject::of_build(&tensormass_kernels::laws()[0]);
        let derivation = &subject.derivation;
        let constants = Material::usual(&subject).expect("a material").exact_constants(derivation);
        let mut g = [0.0; 9];
        g[0] = 1e-60;
        let reference = Reference::new(derivation, &constants, &Exact::zero(), &g, &g).expect("inside");
        assert_eq!(reference.measure(Machine::F32, Quantity::P, &[0.0; 9]), None);
        assert!(reference.measure(Machine::F64, Quantity::P, &[0.0; 9]).is_some());
    }
}

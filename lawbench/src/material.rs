//! Parameter sets by role, not by name: a law's usual material, and nearly incompressible ones.
//!
//! What a parameter means is read off the tangent at rest: whichever parameter raises the ratio of bulk to shear modulus
//! makes the material less compressible.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::Input;
use tensormass_codegen::law::ast::{Law, Parameter};

use crate::evaluate::{constants, textbook};
use crate::number::Exact;
use crate::subject::Subject;

/// The Poisson's ratios of the materials at which laws are examined, where their parameters allow.
pub const POISSON: [f64; 3] = [0.3, 0.49, 0.4999];

/// Values that are tried for a parameter, over its range.
const TRIALS: usize = 64;

/// Where in their ranges parameters without a default are set, the middle first; the others are for laws that have no
/// stiffness there.
const PLACES: [f64; 6] = [0.5, 0.6, 0.4, 0.75, 0.25, 0.9];

/// The moduli of small strains at rest, of the isotropic average over directions (Voigt), in Pa.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Moduli {
    /// Shear modulus mu.
    pub shear: f64,
    /// Bulk modulus K.
    pub bulk: f64,
}

impl Moduli {
    /// From the tangent at rest, interpreted in f64.
    pub fn at_rest(derivation: &Derivation, parameters: &[f64]) -> Self {
        let constants = derivation.material(parameters).expect("one value a component");
        // D : C : D for a symmetric direction D.
        let stiffness = |d: &[f64; 9]| {
            let inputs = [
                (Input::Constants, constants.as_slice()),
                (Input::DisplacementGradient, &[0.0; 9][..]),
                (Input::GradientIncrement, &d[..]),
            ];
            textbook(derivation, "dforce", &inputs).value.iter().zip(d).map(|(p, d)| p * d).sum::<f64>()
        };
        let third = 1.0 / 3.0;
        let shear = |i: usize, j: usize| {
            let mut d = [0.0; 9];
            (d[3 * i + j], d[3 * j + i]) = (1.0, 1.0);
            stiffness(&d) / 2.0
        };
        let stretch = |i: usize| {
            stiffness(&std::array::from_fn(
                |k| if k == 4 * i { 1.0 } else { 0.0 } - if k % 4 == 0 { third } else { 0.0 },
            ))
        };
        // The trace of C over deviators is 10 mu: the shears are two thirds of a unit each, the three stretches sum to
        // the trace over diagonal deviators.
        let deviators = shear(0, 1) + shear(1, 2) + shear(2, 0) + stretch(0) + stretch(1) + stretch(2);
        Self { shear: deviators / 10.0, bulk: stiffness(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]) / 9.0 }
    }

    /// Young's modulus in Pa.
    pub fn young(&self) -> f64 {
        9.0 * self.bulk * self.shear / (3.0 * self.bulk + self.shear)
    }

    /// Poisson's ratio.
    pub fn poisson(&self) -> f64 {
        (3.0 * self.bulk - 2.0 * self.shear) / (2.0 * (3.0 * self.bulk + self.shear))
    }

    /// Whether both are finite and positive.
    pub fn are_positive(&self) -> bool {
        [self.shear, self.bulk].iter().all(|m| m.is_finite() && *m > 0.0)
    }

    fn ratio(&self) -> f64 {
        if self.are_positive() { self.bulk / self.shear } else { 0.0 }
    }
}

/// K / mu at a Poisson's ratio.
fn ratio(poisson: f64) -> f64 {
    2.0 * (1.0 + poisson) / (3.0 * (1.0 - 2.0 * poisson))
}

/// A parameter set and its moduli.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Material {
    /// The components of all parameters, in order.
    pub parameters: Vec<f64>,
    /// Its moduli at rest.
    pub moduli: Moduli,
}

/// Why a law has no material to be examined at.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MaterialError {
    /// Whatever was tried, the law is not stiff at rest.
    #[error(
        "law `{law}`: its shear and bulk moduli at rest are not both positive at any parameters that were tried; give \
         its parameters a #[default(..)] at which they are"
    )]
    NotStiff {
        /// The law.
        law: String,
    },
    /// A parameter that the law does not have.
    #[error("law `{law}` has no parameter `{name}`; it has {known}")]
    Unknown {
        /// The law.
        law: String,
        /// What was given.
        name: String,
        /// The names that there are, arrays with an index.
        known: String,
    },
    /// A value outside the parameter's range.
    #[error("parameter `{name}` = {value}: give a value from {low} to {high}")]
    Range {
        /// The parameter.
        name: String,
        /// What was given.
        value: String,
        /// The least value.
        low: String,
        /// The greatest value.
        high: String,
    },
}

impl Material {
    fn new(derivation: &Derivation, parameters: Vec<f64>) -> Self {
        let moduli = Moduli::at_rest(derivation, &parameters);
        Self { parameters, moduli }
    }

    /// The law's defaults; for parameters without one the geometric middle of the range where its ends are of one sign,
    /// the arithmetic one otherwise.
    ///
    /// # Errors
    /// [`MaterialError::NotStiff`] if neither these nor others of the ranges give a stable material.
    pub fn usual(subject: &Subject) -> Result<Self, MaterialError> {
        let at = |place: f64| Self::new(&subject.derivation, values(&subject.law, place));
        PLACES
            .iter()
            .map(|place| at(*place))
            .find(|m| m.moduli.are_positive())
            .ok_or_else(|| MaterialError::NotStiff { law: subject.law.name.clone() })
    }

    /// A material with values of the user's: `(name, value)`, an array's component as `name[k]`. The others are the law's
    /// defaults, or those at the first of [`POISSON`].
    ///
    /// # Errors
    /// [`MaterialError`]: an unknown name, a value out of range.
    pub fn with(subject: &Subject, given: &[(String, f64)]) -> Result<Self, MaterialError> {
        let defaults = subject.law.parameters.iter().all(|p| p.default.is_some());
        let mut parameters = match Self::usual(subject) {
            Ok(material) if defaults => material.parameters,
            Ok(material) => material.less_compressible(subject, ratio(POISSON[0])).parameters,
            // What is given may be what is missing.
            Err(_) => values(&subject.law, PLACES[0]),
        };
        let names = names(&subject.law);
        for (name, value) in given {
            let Some(at) = names.iter().position(|(n, _)| n == name) else {
                let known = names.iter().map(|(n, _)| format!("`{n}`")).collect::<Vec<_>>().join(", ");
                return Err(MaterialError::Unknown { law: subject.law.name.clone(), name: name.clone(), known });
            };
            let (low, high) = names[at].1.range;
            if !(low..=high).contains(value) {
                let [value, low, high] = [*value, low, high].map(|x| format!("{x:?}"));
                return Err(MaterialError::Range { name: name.clone(), value, low, high });
            }
            parameters[at] = *value;
        }
        Ok(Self::new(&subject.derivation, parameters))
    }

    /// The usual material at a Poisson's ratio below a half, as near as its parameters allow.
    ///
    /// # Errors
    /// See [`Material::usual`].
    pub fn near(subject: &Subject, poisson: f64) -> Result<Self, MaterialError> {
        Ok(Self::usual(subject)?.less_compressible(subject, ratio(poisson)))
    }

    /// The usual material at the Poisson's ratios of [`POISSON`], as near as its parameters allow; each set once.
    ///
    /// # Errors
    /// See [`Material::usual`].
    pub fn all(subject: &Subject) -> Result<Vec<Self>, MaterialError> {
        let mut all: Vec<Self> = vec![];
        for poisson in POISSON {
            let material = Self::near(subject, poisson)?;
            if !all.iter().any(|m| m.parameters == material.parameters) {
                all.push(material);
            }
        }
        Ok(all)
    }

    /// The material with one parameter changed so that K / mu is nearest to `wanted`; of parameters that can do it, the
    /// one that changes the shear modulus least.
    fn less_compressible(&self, subject: &Subject, wanted: f64) -> Self {
        // A part in a thousand counts as reached: parameters are rounded to four digits.
        let distance = |m: &Self| (m.moduli.ratio() / wanted).ln().abs().max(1e-3);
        let detour = |m: &Self| (m.moduli.shear / self.moduli.shear).ln().abs();
        let mut best = self.clone();
        for (at, (_, parameter)) in names(&subject.law).iter().enumerate().filter(|(_, (_, p))| !p.direction) {
            let with = |x: f64| {
                let mut parameters = self.parameters.clone();
                parameters[at] = x;
                Self::new(&subject.derivation, parameters)
            };
            let Some(found) = nearest(parameter.range, wanted, &with) else { continue };
            let (new, old) = (distance(&found), distance(&best));
            if new < old || (new == old && detour(&found) < detour(&best)) {
                best = found;
            }
        }
        best
    }

    /// The material's constants, exactly.
    pub fn exact_constants(&self, derivation: &Derivation) -> Vec<Exact> {
        constants(derivation, &self.parameters.iter().copied().map(Exact::from).collect::<Vec<_>>())
    }

    /// The constants as a program computes them.
    pub fn constants(&self, derivation: &Derivation) -> Vec<f64> {
        derivation.material(&self.parameters).expect("one value a component")
    }
}

/// The value of one parameter within its range at which the stable material's K / mu is nearest to `wanted`.
fn nearest(range: (f64, f64), wanted: f64, with: &impl Fn(f64) -> Material) -> Option<Material> {
    let trials: Vec<(f64, f64)> =
        (0..=TRIALS).map(|k| between(range, k as f64 / TRIALS as f64)).map(|x| (x, with(x).moduli.ratio())).collect();
    let crossing = trials.windows(2).find(|w| {
        let [a, b] = [w[0].1, w[1].1];
        a > 0.0 && b > 0.0 && (a - wanted) * (b - wanted) <= 0.0
    });
    let value = match crossing {
        Some(w) => {
            let (mut low, mut high) = (w[0].0, w[1].0);
            let rising = w[1].1 > w[0].1;
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                if (with(middle).moduli.ratio() > wanted) == rising { high = middle } else { low = middle }
            }
            0.5 * (low + high)
        }
        None => {
            let off = |ratio: f64| if ratio > 0.0 { (ratio / wanted).ln().abs() } else { f64::INFINITY };
            trials.iter().min_by(|a, b| off(a.1).total_cmp(&off(b.1)))?.0
        }
    };
    let material = with(four_digits(value).clamp(range.0, range.1));
    material.moduli.are_positive().then_some(material)
}

/// The nearest number of four decimal digits.
fn four_digits(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

/// A place of a range, 0 to 1: geometric where both ends are of one sign, arithmetic otherwise. A range of magnitudes
/// from 0, as that of a modulus that may be left out, begins at 1.
fn between((low, high): (f64, f64), place: f64) -> f64 {
    let (low, high) = match (low, high) {
        (0.0, high) if high > 1.0 => (1.0, high),
        (low, 0.0) if low < -1.0 => (low, -1.0),
        other => other,
    };
    let x = if low * high > 0.0 {
        low.signum() * (low.abs().ln() * (1.0 - place) + high.abs().ln() * place).exp()
    } else {
        low + (high - low) * place
    };
    x.clamp(low, high)
}

fn values(law: &Law, place: f64) -> Vec<f64> {
    let one = |p: &Parameter| match &p.default {
        Some(values) => values.clone(),
        // A unit vector that is no axis of coordinates.
        None if p.direction => [1.0, 2.0, 2.0].map(|x| x / 3.0).to_vec(),
        None => vec![four_digits(between(p.range, place)); p.len],
    };
    law.parameters.iter().flat_map(one).collect()
}

/// The name of each component, arrays with an index, and its parameter.
pub fn names(law: &Law) -> Vec<(String, &Parameter)> {
    let of = |p: &'_ Parameter| -> Vec<String> {
        if p.len == 1 { vec![p.name.clone()] } else { (0..p.len).map(|k| format!("{}[{k}]", p.name)).collect() }
    };
    law.parameters.iter().flat_map(|p| of(p).into_iter().map(move |name| (name, p))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_have_the_ratios_they_are_made_for() {
        for entry in tensormass_kernels::laws() {
            let subject = Subject::of_build(entry);
            let all = Material::all(&subject).expect("a material");
            assert!(!all.is_empty());
            for (material, wanted) in all.iter().zip(POISSON) {
                for ((name, p), value) in names(&subject.law).iter().zip(&material.parameters) {
                    assert!((p.range.0..=p.range.1).contains(value), "{}: {name}", entry.info.name);
                }
                // Four digits of a parameter move nu by less than that.
                let found = material.moduli.poisson();
                assert!((found - wanted).abs() < 1e-3, "{}: {found} for {wanted}", entry.info.name);
            }
        }
    }

    #[test]
    fn moduli_are_those_of_young_and_poisson() {
        for entry in tensormass_kernels::laws() {
            let subject = Subject::of_build(entry);
            let names = names(&subject.law);
            let at = |name: &str| names.iter().position(|(n, _)| n == name);
            let (Some(young), Some(poisson)) = (at("young"), at("poisson")) else { continue };
            if subject.law.parameters.iter().any(|p| p.direction) {
                continue;
            }
            let material = Material::with(&subject, &[("young".into(), 2e5), ("poisson".into(), 0.25)]).expect("valid");
            let (e, nu) = (material.parameters[young], material.parameters[poisson]);
            let (mu, bulk) = (e / (2.0 * (1.0 + nu)), e / (3.0 * (1.0 - 2.0 * nu)));
            let Moduli { shear, bulk: found } = material.moduli;
            assert!((shear / mu - 1.0).abs() < 1e-12 && (found / bulk - 1.0).abs() < 1e-12, "{}", entry.info.name);
        }
    }

    #[test]
    fn what_cannot_be_set_is_refused() {
        let subject = Subject::of_build(&tensormass_kernels::laws()[0]);
        let name = subject.law.parameters[0].name.clone();
        let high = subject.law.parameters[0].range.1;
        let error = |name: &str, value: f64| Material::with(&subject, &[(name.to_string(), value)]).unwrap_err();
        assert!(matches!(error("nothing", 1.0), MaterialError::Unknown { known, .. } if known.contains(&name)));
        assert!(matches!(error(&name, 2.0 * high.abs() + 1.0), MaterialError::Range { .. }));
        assert!(matches!(error(&name, f64::NAN), MaterialError::Range { .. }));
    }
}

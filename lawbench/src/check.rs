//! Whether a law is what a hyperelastic law should be: named findings with their numbers.

use rayon::prelude::*;
use serde::Serialize;
use tensormass_codegen::ir::{Number, Rational};
use tensormass_codegen::law::ast::{Law, Scalar};
use tensormass_codegen::law::evaluate;

use crate::dissipation::Moving;
use crate::edge::edge;
use crate::exact::{ExactLaw, difference, exact};
use crate::extremes::{ExtremesError, Options, extremes};
use crate::identities::{At, DIFFERENCE, IDENTITY};
use crate::material::{Material, Moduli};
use crate::number::Exact;
use crate::states::{ROTATIONS, Random, STRAINS};
use crate::subject::Subject;
use crate::wgsl::Device;

/// How a finding counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As it should be.
    Passed,
    /// Not as it should be.
    Failed,
    /// For the reader to know.
    Noted,
}

/// One thing that was examined.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What.
    pub name: &'static str,
    /// How it counts.
    pub verdict: Verdict,
    /// The numbers.
    pub detail: String,
}

/// The findings of a law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The law.
    pub law: String,
    /// The parameter sets that it was examined at.
    pub materials: Vec<Material>,
    /// In the order in which they were made.
    pub findings: Vec<Finding>,
}

impl Report {
    /// The names of what failed.
    pub fn failed(&self) -> Vec<&'static str> {
        self.findings.iter().filter(|f| f.verdict == Verdict::Failed).map(|f| f.name).collect()
    }
}

fn finding(name: &'static str, passed: bool, detail: String) -> Finding {
    Finding { name, verdict: if passed { Verdict::Passed } else { Verdict::Failed }, detail }
}

fn note(name: &'static str, detail: String) -> Finding {
    Finding { name, verdict: Verdict::Noted, detail }
}

/// Identities of laws of principal stretches: what four sweeps of rotations leave, 5e-16, by the greatest ratio of
/// stretches squared.
const ITERATED: f64 = 1e-12;

/// Rotations at which identities are tried: none, a small and a large one.
const TURNS: [usize; 3] = [0, 2, 4];

/// Examines a law. `options.samples` are those of the accuracy's measurement, which is left out
/// where there are none.
///
/// # Errors
/// See [`ExtremesError`].
pub fn check(subject: &Subject, options: Options, device: Result<&Device, String>) -> Result<Report, ExtremesError> {
    let materials = Material::all(subject)?;
    let mut findings = vec![];
    let rest = exact(&[0.0; 9]);
    let stress = materials.iter().map(|m| {
        let law = ExactLaw::new(&subject.derivation, m);
        Exact::norm(&law.stress(&rest)).div(&Exact::norm(law.tangent(&rest).as_flattened())).to_f64()
    });
    let stress = stress.fold(0.0, f64::max);
    let detail = format!("|P(0)| is {stress:.1e} of the stiffness, exactly evaluated");
    findings.push(finding("no stress at rest", stress <= IDENTITY, detail));
    for material in &materials {
        let m = material.moduli;
        let young = 9.0 * m.bulk * m.shear / (3.0 * m.bulk + m.shear);
        let detail = format!("mu = {:.6e}, K = {:.6e}, E = {young:.6e}, nu = {:.6}", m.shear, m.bulk, m.poisson());
        findings.push(note("small-strain moduli", detail));
    }
    findings.push(declared(subject, options.seed));
    for line in crate::explain::accepted(&subject.law) {
        findings.push(note("accepted without proof", line));
    }
    findings.push(stability(subject, &materials));
    findings.extend(identities(subject, &materials, options.seed));
    findings.extend(dissipation(subject, &materials, options.seed));
    findings.push(domain(subject, &materials, options.seed));
    findings.push(precision(subject, options, device)?);
    Ok(Report { law: subject.name().to_string(), materials, findings })
}

/// How far the tangent at rest may be from the declared moduli, as a part of it: declarations may be rounded numbers.
const MODULI: f64 = 1e-12;

/// Materials at which declared moduli are compared: no parameter keeps a value at which its part vanishes.
const DECLARED: u64 = 4;

/// The tangent at rest against the declared moduli: dP = 2 mu eps + (K - 2/3 mu) tr(eps) 1.
fn declared(subject: &Subject, seed: u64) -> Finding {
    let name = "declared small-strain moduli";
    let law = &subject.law;
    let Some(moduli) = &law.moduli else { return note(name, "none are declared".into()) };
    let mut worst = 0.0;
    for k in 0..DECLARED {
        let mut random = Random::new(&[seed, 3, k]);
        let parameters = random_parameters(law, &mut random);
        let mut components = parameters.iter().map(|x| Exact::from(*x));
        let by_parameter: Vec<Vec<Exact>> =
            law.parameters.iter().map(|p| components.by_ref().take(p.len).collect()).collect();
        let value = |m: &Scalar| evaluate::value(m, &by_parameter).expect("declared moduli depend on no strain");
        let (shear, bulk) = (value(&moduli.shear), value(&moduli.bulk));
        let material = Material { parameters, moduli: Moduli { shear: shear.to_f64(), bulk: bulk.to_f64() } };
        let tangent = ExactLaw::new(&subject.derivation, &material).tangent(&exact(&[0.0; 9]));
        let third = Exact::from_rational(Rational::new(1, 3));
        let lambda = bulk.sub(&shear.add(&shear).mul(&third));
        let wanted: Vec<Exact> = (0..81)
            .map(|at| {
                let (i, j, k, l) = (at / 27, at / 9 % 3, at / 3 % 3, at % 3);
                let times = |on: bool, x: &Exact| if on { x.clone() } else { Exact::zero() };
                let shears = times((i, j) == (k, l), &shear).add(&times((i, j) == (l, k), &shear));
                shears.add(&times(i == j && k == l, &lambda))
            })
            .collect();
        let off = difference(tangent.as_flattened(), &wanted, &Exact::norm(tangent.as_flattened()));
        worst = if off.is_nan() { f64::INFINITY } else { off.max(worst) };
    }
    let detail = format!("{}: {worst:.1e} from the tangent at rest, {MODULI:.0e} is allowed", moduli.text);
    finding(name, worst <= MODULI, detail)
}

/// Parameters anywhere in their ranges; orders of magnitude alike where a range is of one sign.
fn random_parameters(law: &Law, random: &mut Random) -> Vec<f64> {
    let component = |(low, high): (f64, f64), t: f64| {
        if low > 0.0 {
            low * (high / low).powf(t)
        } else if high < 0.0 {
            high * (low / high).powf(t)
        } else {
            low + (high - low) * t
        }
    };
    let ranges = law.parameters.iter().flat_map(|p| vec![p.range; p.len]);
    ranges.map(|range| component(range, 0.5 + 0.5 * random.signed())).collect()
}

/// The least eigenvalue of the tangent at rest, over symmetric strains.
fn stability(subject: &Subject, materials: &[Material]) -> Finding {
    let least = materials.iter().map(|material| {
        let tangent = ExactLaw::new(&subject.derivation, material).tangent(&exact(&[0.0; 9]));
        let half = 0.5f64.sqrt();
        // An orthonormal basis of symmetric matrices: three normal strains, three shears.
        let basis: [[f64; 9]; 6] = std::array::from_fn(|b| {
            let mut e = [0.0; 9];
            match b {
                0..3 => e[4 * b] = 1.0,
                _ => {
                    let (i, j) = [(1, 2), (0, 2), (0, 1)][b - 3];
                    (e[3 * i + j], e[3 * j + i]) = (half, half);
                }
            }
            e
        });
        let entry = |a: usize, b: usize| -> f64 {
            let pairs = (0..81).map(|k| basis[a][k / 9] * tangent[k / 9][k % 9].to_f64() * basis[b][k % 9]);
            pairs.sum()
        };
        let eigenvalues = nalgebra::SMatrix::<f64, 6, 6>::from_fn(entry).symmetric_eigenvalues();
        eigenvalues.min() / material.moduli.shear
    });
    let least = least.fold(f64::INFINITY, f64::min);
    let detail = format!("the least eigenvalue of the tangent over symmetric strains is {least:.4} mu");
    finding("positive definite at rest", least > 0.0, detail)
}

/// An identity: its name, how far it is from holding at a state, and how far it may be.
type Identity = (&'static str, fn(&At) -> f64, f64);

const IDENTITIES: [Identity; 5] = [
    ("force is the derivative of energy", |at| at.energy_and_force(), DIFFERENCE),
    ("dforce is the derivative of force", |at| at.force_and_dforce(), DIFFERENCE),
    ("symmetric tangent", |at| at.symmetry(), IDENTITY),
    ("diagonal and Cauchy stress agree with tangent and stress", |at| at.other_kernels(), IDENTITY),
    ("printed kernels are the textbook form", |at| at.forms(), IDENTITY),
];

fn identities(subject: &Subject, materials: &[Material], seed: u64) -> Vec<Finding> {
    let laws: Vec<ExactLaw> = materials.iter().map(|m| ExactLaw::new(&subject.derivation, m)).collect();
    let mut states = vec![];
    for (m, law) in laws.iter().enumerate() {
        for (s, strain) in STRAINS.iter().enumerate() {
            for (k, r) in TURNS.iter().enumerate() {
                let mut random = Random::new(&[seed, 1, m as u64, s as u64, *r as u64]);
                // Equal stretches are where the selections of fibres that bear no compression change.
                let kind = if law.selects() { 0 } else { s + k };
                let gradient = random.gradient(*strain, ROTATIONS[*r], kind);
                let g = exact(&gradient);
                if law.inside(&g) && !law.is_undecided(&g) {
                    states.push(At::new(law, g, &mut random));
                }
            }
        }
    }
    let worst = |f: fn(&At) -> f64| {
        // NaN is as bad as can be.
        states.par_iter().map(f).map(|x| if x.is_nan() { f64::INFINITY } else { x }).reduce(|| 0.0, f64::max)
    };
    let detail = |worst: f64, allowed: f64| format!("{worst:.1e} at {} states, {allowed:.0e} is allowed", states.len());
    // Principal axes are found by a fixed number of rotations, enough for f64: their kernels are no exact functions.
    let iterates = subject.law.text.contains(".stretch_sum(");
    let allowed = |bound: f64| if iterates { ITERATED } else { bound };
    let mut findings: Vec<Finding> = IDENTITIES
        .iter()
        .map(|(name, f, bound)| {
            let (worst, bound) = (worst(*f), allowed(*bound));
            finding(name, !states.is_empty() && worst <= bound, detail(worst, bound))
        })
        .collect();
    let (objectivity, isotropy) = (worst(|at| at.objectivity()), worst(|at| at.isotropy()));
    // A law of small strains changes under rotation, and says so by the strain that it takes.
    findings.push(if objectivity > allowed(IDENTITY) && subject.law.small_strain {
        note(
            "objective",
            format!("no, as every law of the small strain: {objectivity:.1e} of the stress under rotations"),
        )
    } else {
        finding("objective", objectivity <= allowed(IDENTITY), detail(objectivity, allowed(IDENTITY)))
    });
    let small_strain = subject.law.small_strain;
    findings.push(if isotropy <= allowed(IDENTITY) {
        finding("isotropic", true, detail(isotropy, allowed(IDENTITY)))
    } else if small_strain || subject.law.parameters.iter().any(|p| p.direction) {
        note("isotropic", format!("no: {isotropy:.1e} of the stress under rotations of the body at rest"))
    } else {
        finding("isotropic", false, detail(isotropy, allowed(IDENTITY)))
    });
    findings
}

/// An identity of dissipations.
type OfRates = (&'static str, fn(&Moving) -> f64, f64);

const OF_RATES: [OfRates; 5] = [
    ("nothing is damped at rest", |at| at.rest(), IDENTITY),
    ("damping is the derivative of dissipation", |at| at.dissipation_and_damping(), DIFFERENCE),
    ("ddamping is the derivative of damping", |at| at.damping_and_differential(), DIFFERENCE),
    ("symmetric damping", |at| at.symmetry(), IDENTITY),
    ("dissipation is not negative", |at| at.negative(), IDENTITY),
];

/// The dissipation's identities at random states and rates.
fn dissipation(subject: &Subject, materials: &[Material], seed: u64) -> Vec<Finding> {
    if !subject.derivation.is_dissipative() {
        return vec![note("dissipation", "none is declared".into())];
    }
    let laws: Vec<ExactLaw> = materials.iter().map(|m| ExactLaw::new(&subject.derivation, m)).collect();
    let mut states = vec![];
    for (m, law) in laws.iter().enumerate() {
        for (s, strain) in STRAINS.iter().enumerate() {
            let mut random = Random::new(&[seed, 4, m as u64, s as u64]);
            let g = exact(&random.gradient(*strain, ROTATIONS[TURNS[s % TURNS.len()]], s));
            if law.inside(&g) {
                states.push(Moving::new(law, g, &mut random));
            }
        }
    }
    let worst = |f: fn(&Moving) -> f64| {
        states.iter().map(f).map(|x| if x.is_nan() { f64::INFINITY } else { x }).fold(0.0, f64::max)
    };
    let detail = |worst: f64, allowed: f64| format!("{worst:.1e} at {} states, {allowed:.0e} is allowed", states.len());
    let mut findings: Vec<Finding> = OF_RATES
        .iter()
        .map(|(name, f, bound)| {
            let worst = worst(*f);
            finding(name, !states.is_empty() && worst <= *bound, detail(worst, *bound))
        })
        .collect();
    let (name, objectivity) = ("objective damping", worst(|at| at.objectivity()));
    findings.push(if objectivity > IDENTITY && subject.law.small_strain {
        note(name, format!("no, as of every law of the small strain: {objectivity:.1e} of the stress under rotations"))
    } else {
        finding(name, objectivity <= IDENTITY, detail(objectivity, IDENTITY))
    });
    findings
}

fn domain(subject: &Subject, materials: &[Material], seed: u64) -> Finding {
    let name = "edge of the domain";
    let Some(domain) = &subject.law.domain else { return note(name, "the law holds everywhere".into()) };
    let edges: Vec<_> = materials
        .iter()
        .enumerate()
        .map(|(m, material)| edge(&subject.derivation, material, &mut Random::new(&[seed, 2, m as u64])))
        .collect();
    let reached: usize = edges.iter().map(|e| e.reached).sum();
    let faults: Vec<&String> = edges.iter().flat_map(|e| &e.faults).collect();
    match faults.first() {
        _ if reached == 0 => note(name, format!("{}: no ray from rest comes to it", domain.text)),
        Some(first) => finding(name, false, format!("{}: {} faults, first {first}", domain.text, faults.len())),
        None => {
            let detail =
                format!("{}: the margin changes sign on {reached} rays, values before it are finite", domain.text);
            finding(name, true, detail)
        }
    }
}

fn precision(subject: &Subject, options: Options, device: Result<&Device, String>) -> Result<Finding, ExtremesError> {
    let name = "accurate in f32, f64 and WGSL";
    if options.samples == 0 {
        return Ok(note(name, "not measured: no samples were asked for".into()));
    }
    let measured = extremes(subject, options, device)?;
    let failures = measured.failures();
    let machines: Vec<String> = measured
        .worst()
        .iter()
        .map(|c| format!("{} in {} {:.2}", c.quantity.name(), c.machine.name(), c.gate))
        .collect();
    let detail = match failures.first() {
        Some(first) => format!("{first} ({} above the gate; `law extremes` shows all)", failures.len()),
        None => format!("worst parts of the bounds: {}", machines.join(", ")),
    };
    Ok(finding(name, failures.is_empty(), detail))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moduli are compared at every law that declares them; one part in a hundred too much of either is found.
    #[test]
    fn declared_moduli_are_those_at_rest() {
        let mut declared_ones = 0;
        for entry in tensormass_kernels::laws() {
            let right = Subject::of_build(entry);
            let isotropic = entry.info.structure.isotropic;
            assert_eq!(right.law.moduli.is_some(), isotropic, "{}: its moduli are declared", entry.info.name);
            assert_eq!(declared(&right, 1).verdict == Verdict::Passed, isotropic, "{}", entry.info.name);
            if !isotropic {
                continue;
            }
            declared_ones += 1;
            for name in ["shear = ", "bulk = ", "lame_lambda = "] {
                let text = entry.source.law;
                let wrong = text.replacen(name, &format!("{name}1.01 * "), 1);
                if wrong == text {
                    continue;
                }
                let path = format!("{}.rs", entry.info.name);
                let subject = Subject::from_texts(&path, &wrong, entry.source.derivation).expect("a law");
                assert_eq!(declared(&subject, 1).verdict, Verdict::Failed, "{}: {name}", entry.info.name);
            }
        }
        assert!(declared_ones > 0, "no law declares its moduli");
    }

    /// What has to hold of every law, however its kernels round.
    #[test]
    fn laws_of_this_build_are_hyperelastic() {
        for entry in tensormass_kernels::laws() {
            let subject = Subject::of_build(entry);
            let options = Options { samples: 0, seed: 3 };
            let report = check(&subject, options, Err("not asked for".into())).expect("a material");
            assert!(report.failed().is_empty(), "{}: {:?}", entry.info.name, report.findings);
            let of_rates = if subject.derivation.is_dissipative() { OF_RATES.len() + 1 } else { 1 };
            assert_eq!(report.findings.len() - report.materials.len(), 12 + of_rates, "every finding is made, once");
        }
    }
}

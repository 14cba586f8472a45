//! From a law to its kernels, by formal differentiation: once for the stress, twice for its differential.
//!
//! Stages, each a set of named quantities over the one before:
//! strain components (of G) -> invariants q_k -> W(q). The stress is collected backwards over these stages, S = dW/dE
//! first, then P = F S + ..; every differential is the sum of partial derivatives times differentials, stage by stage
//! (a staged tangent), so that no expression grows. The computer algebra system takes every partial derivative.

mod damping;
mod deformed;
mod differential;
mod energy;
mod far;
mod fibre;
mod place;
mod rest;
mod spectral;
mod strain;

use std::collections::BTreeMap;

use crate::cas::{Cas, UnexpectedTerm};
use crate::derivation::Derivation;
use crate::expr::{Expr, Symbol};
use crate::ir::{Input, InvalidKernel, KernelIr, Output, Rational};
use crate::law::LawError;
use crate::law::ast::{Law, Scalar};
use crate::lower::{Constants, Lowering};
use crate::quantity::{Kind, Quantities, Value};
use crate::split::{Rest, SplitError};

use differential::Differential;
use energy::Energy;
use strain::{Invariant, SYMMETRIC, Strain};

/// Why a law could not be differentiated.
#[derive(Debug, thiserror::Error)]
pub enum DeriveError {
    /// The computer algebra system answered in unknown terms.
    #[error(transparent)]
    Cas(#[from] UnexpectedTerm),
    /// The generated kernel breaks a rule of the language: a defect of the generator.
    #[error("the generator made a kernel that it refuses itself (please report this): {0}")]
    Invalid(#[from] InvalidKernel),
    /// The law cannot be split at rest.
    #[error(transparent)]
    Split(#[from] SplitError),
    /// The dissipation stresses a body whose strain does not change.
    #[error(
        "the dissipation begins with a term of first order in the strain rate, `{0}` (At is dC/dt, Jt is dJ/dt): a body at \
         rest would be stressed; write it in squares and products of rates"
    )]
    DampingAtRest(String),
    /// The law uses something that this version cannot differentiate.
    #[error("{0}")]
    Unsupported(String),
    /// What is wrong with the law, and where.
    #[error(transparent)]
    Law(Box<LawError>),
}

/// Differentiates a law.
///
/// # Errors
/// See [`DeriveError`].
pub fn derive(law: &Law) -> Result<Derivation, DeriveError> {
    let derived = Session::new(law, &[]).and_then(|(session, _)| session.derivation(law));
    derived.map_err(|error| place::placed(law, error))
}

struct Session {
    cas: Cas,
    quantities: Quantities,
    constants: Constants,
    strain: Strain,
    energy: Expr,
    margin: Option<Expr>,
    rest: Rest,
    /// The energy in C instead of C - I.
    far_energy: Expr,
    /// The domain's margin in C: where a body is compressed to almost nothing, 3 + tr A loses tr C.
    far_margin: Option<Expr>,
    /// The comparisons of the law's selections.
    conditions: Vec<(Expr, Expr)>,
    /// Whether the tangent is split at rest: see [`Session::is_steep`].
    splits_tangent: bool,
    /// The symbols of the parameters' components, parameter by parameter.
    parameters: Vec<Vec<Symbol>>,
}

impl Session {
    /// Reads the law, and `others` of its expressions.
    fn new(law: &Law, others: &[Scalar]) -> Result<(Self, Vec<Expr>), DeriveError> {
        let mut cas = Cas::new();
        let mut quantities = Quantities::default();
        let mut strain = Strain::new(&mut quantities);
        let mut reader = Energy::new(law, &mut cas, &mut quantities, &mut strain);
        let energy = reader.scalar(&law.energy)?;
        let margin = match &law.domain {
            Some(domain) => {
                let (left, right) = (reader.scalar(&domain.left)?, reader.scalar(&domain.right)?);
                Some(left - right)
            }
            None => None,
        };
        let others = others.iter().map(|e| reader.scalar(e)).collect::<Result<Vec<Expr>, _>>()?;
        let ranges = reader.ranges(law);
        let conditions = std::mem::take(&mut reader.conditions);
        let splits_tangent = reader.isochoric;
        let parameters = reader.parameters.clone();
        reader.far_from_rest();
        let far_energy = reader.scalar(&law.energy)?;
        let far_margin = match &law.domain {
            Some(domain) => Some(reader.scalar(&domain.left)? - reader.scalar(&domain.right)?),
            None => None,
        };
        let far_energy = cas.normalize(&far_energy)?;
        let far_margin = far_margin.map(|m| cas.normalize(&m)).transpose()?;
        let margin = margin.map(|m| cas.normalize(&m)).transpose()?;
        let energy = cas.normalize(&energy)?;
        let mut session = Self {
            cas,
            quantities,
            constants: Constants::default(),
            strain,
            energy,
            margin,
            rest: Rest::new(ranges, &law.acceptances),
            far_energy,
            far_margin,
            conditions,
            splits_tangent,
            parameters,
        };
        session.splits_tangent |= session.is_steep(&session.energy);
        Ok((session, others))
    }

    fn derivation(mut self, law: &Law) -> Result<Derivation, DeriveError> {
        let energy = self.energy.clone();
        let margin = self.margin.clone();
        let stress = self.stress()?;
        let dgradient = vector(&mut self.quantities, "dG", GradientIncrement, 9);
        let gradient = *self.strain.gradient();
        let increment = self.stress_increment(&stress, &gradient, &dgradient)?;
        let node = vector(&mut self.quantities, "g", NodeGradient, 3);
        let diagonal = self.diagonal(&stress, &gradient, &node)?;
        let (near_energy, at_rest) = self.near_energy()?;
        let near_stress = self.near_stress(&stress)?;
        let far_energy = self.far_energy.clone();
        let far_energy = if near_energy.is_some() { self.split_at_unit_volume(far_energy) } else { far_energy };
        let from_rest = |e: Expr| if at_rest.is_zero() { e } else { e - at_rest.clone() };
        let energy = from_rest(energy);
        let far_energy = self.far_from(far_energy, &at_rest)?;

        use Input::{DisplacementGradient as G, GradientIncrement, NodeGradient};
        let mut point = Vec::new();
        let with_margin = |role, outputs: Vec<Expr>, margin: &Option<Expr>| {
            let mut all = vec![(role, outputs)];
            all.extend(margin.iter().map(|m| (Output::DomainMargin, vec![m.clone()])));
            all
        };
        match near_energy {
            Some(near) => {
                let mut outputs = with_margin(Output::EnergyDensity, vec![near.value], &margin);
                outputs.push((Output::NearRest, vec![near.holds]));
                point.push(self.lower("energy", &[G], outputs));
                point.push(self.lower(
                    "energy_far",
                    &[G],
                    with_margin(Output::EnergyDensity, vec![far_energy], &self.far_margin.clone()),
                ));
            }
            None => point.push(self.lower("energy", &[G], with_margin(Output::EnergyDensity, vec![energy], &margin))),
        }
        let far_margin = self.far_margin.clone();
        match &near_stress {
            Some(near) => {
                let mut outputs = with_margin(Output::Stress, near.stress.to_vec(), &near.margin);
                outputs.push((Output::NearRest, vec![near.holds.clone()]));
                point.push(self.lower("force", &[G], outputs));
                let far_stress = self.of_deformation(&stress)?;
                point.push(self.lower("force_far", &[G], with_margin(Output::Stress, far_stress, &far_margin)));
            }
            None => point.push(self.lower("force", &[G], with_margin(Output::Stress, stress.to_vec(), &margin))),
        }
        let near_increment = match &near_stress {
            Some(near) if self.splits_tangent => {
                Some((self.near_increment(near, &dgradient)?, near.tangent_holds.clone()))
            }
            _ => None,
        };
        // Of every selection that the tangents have made.
        let accurate = self.accurate()?;
        match near_increment {
            Some(((near, split), holds)) => {
                let near = vec![(Output::StressIncrement, near), (Output::NearRest, vec![holds])];
                let instead = [accurate.as_slice(), &split].concat();
                point.push(self.lower_with("dforce", &[G, GradientIncrement], near, &instead));
                let far = vec![(Output::StressIncrement, self.of_deformation(&increment)?)];
                point.push(self.lower("dforce_far", &[G, GradientIncrement], far));
            }
            None => {
                let outputs = vec![(Output::StressIncrement, increment)];
                point.push(self.lower_with("dforce", &[G, GradientIncrement], outputs, &accurate));
            }
        }
        point.push(self.lower_with("diagonal", &[G, NodeGradient], vec![(Output::Diagonal, diagonal)], &accurate));
        match near_stress {
            Some(near) => {
                let outputs = vec![(Output::Cauchy, near.cauchy), (Output::NearRest, vec![near.holds])];
                point.push(self.lower("cauchy", &[G], outputs));
                let cauchy = self.cauchy(&stress);
                let cauchy = self.of_deformation(&cauchy)?;
                point.push(self.lower("cauchy_far", &[G], vec![(Output::Cauchy, cauchy)]));
            }
            None => {
                let cauchy = self.cauchy(&stress);
                point.push(self.lower("cauchy", &[G], vec![(Output::Cauchy, cauchy)]));
            }
        }
        // Last: what a law without a dissipation has does not depend on there being such a thing.
        if let Some(dissipation) = &law.dissipation {
            point.extend(self.damping(dissipation, &dgradient, &node)?);
        }
        let parameters: u32 = law.parameters.iter().map(|p| p.len as u32).sum();
        let (material, names) = self.material(parameters)?;
        let count = self.constants.expressions().len() as u32;
        let mut kernels = vec![material.validate()?];
        for mut kernel in point {
            kernel.inputs.insert(0, (Input::Constants, count));
            kernels.push(kernel.validate()?);
        }
        if let Some(unused) = self.rest.unused() {
            return Err(place::unused(law, unused));
        }
        Ok(Derivation {
            law: law.name.clone(),
            hash: crate::derivation::hash(&law.text),
            constants: names,
            energy_at_rest: crate::print::expression(&at_rest, &self.quantities),
            rewrites: self.rest.rewrites,
            kernels,
        })
    }

    fn lower(&mut self, name: &str, inputs: &[Input], outputs: Vec<(Output, Vec<Expr>)>) -> KernelIr {
        self.lower_with(name, inputs, outputs, &[])
    }

    /// As `lower`, computing the second quantity of each pair of `instead` for the first.
    fn lower_with(
        &mut self,
        name: &str,
        inputs: &[Input],
        outputs: Vec<(Output, Vec<Expr>)>,
        instead: &[(Symbol, Symbol)],
    ) -> KernelIr {
        let cas = &mut self.cas;
        // A normalisation that the system cannot express leaves the expression as it stands: still right.
        let normalize = |e: &Expr| cas.normalize(e).unwrap_or_else(|_| e.clone());
        let mut lowering = Lowering::new(&self.quantities, Some(&mut self.constants), normalize);
        for &(s, other) in instead {
            lowering.compute_instead(s, other);
        }
        let outputs =
            outputs.into_iter().map(|(role, es)| (role, es.iter().map(|e| lowering.value(e)).collect())).collect();
        let length = |role: Input| if role == Input::NodeGradient { 3 } else { 9 };
        lowering.finish(name, inputs.iter().map(|&r| (r, length(r))).collect(), outputs)
    }

    /// The kernel from parameters to constants, and the constants as text.
    fn material(&mut self, parameters: u32) -> Result<(KernelIr, Vec<String>), DeriveError> {
        let expressions = self.constants.expressions().to_vec();
        let names = expressions.iter().map(|e| crate::print::expression(e, &self.quantities)).collect();
        let cas = &mut self.cas;
        let normalize = |e: &Expr| cas.normalize(e).unwrap_or_else(|_| e.clone());
        let mut lowering = Lowering::new(&self.quantities, None, normalize);
        let values = expressions.iter().map(|e| lowering.value(e)).collect();
        let kernel =
            lowering.finish("material", vec![(Input::Parameters, parameters)], vec![(Output::Constants, values)]);
        Ok((kernel, names))
    }

    /// P = dW/dG, collected backwards: w_k = dW/dq_k; S = dW/dE over C, N = dW/deps over eps; then P.
    fn stress(&mut self) -> Result<[Expr; 9], DeriveError> {
        let invariants = self.strain.invariants();
        let mut weights = Vec::new();
        for &(invariant, q) in &invariants {
            let seeds = BTreeMap::from([(q, Expr::int(1))]);
            let stop: Vec<Symbol> = invariants.iter().map(|&(_, s)| s).collect();
            let name = format!("W_{}", self.quantities.get(q).name);
            let mut d = Differential::new(&mut self.cas, &mut self.quantities, "W_", seeds, stop);
            let w = d.of(&self.energy)?;
            let w = if invariant.is_fibre() && !self.quantities.is_constant_expr(&w) {
                // S = 2 W_q sym(a (x) b): with the 2 in the stage, the constants in S are those in q.
                Expr::ratio(1, 2) * self.quantities.stage(name, self.cas.normalize(&(Expr::int(2) * w))?).into()
            } else if self.quantities.is_multiple(&w) {
                w
            } else {
                self.quantities.stage(name, w).into()
            };
            if !w.is_zero() {
                // 3 + tr A in its differential would lose tr C far from rest.
                self.splits_tangent |=
                    invariant == Invariant::Trace(Invariant::OF_C) && !self.quantities.is_constant_expr(&w);
                weights.push((invariant, q, w));
            }
        }
        let mut p: [Vec<Expr>; 9] = std::array::from_fn(|_| vec![]);
        // Tensors of strain: the derivative by a symmetric tensor, S_ab = S_ba, off-diagonal components shared by two.
        for (base, name, scale) in [(Invariant::OF_C, "S", 2), (Invariant::OF_EPS, "N", 1)] {
            let Some(components) = self.strain.components(base) else { continue };
            for (k, &(a, b)) in SYMMETRIC.iter().enumerate() {
                let mut terms = Vec::new();
                for (invariant, q, w) in &weights {
                    if invariant.depends_on(base) {
                        let partial = self.partial(*q, components, k)?;
                        terms.push(w.clone() * partial);
                    }
                }
                let factor = if a == b { Expr::int(scale) } else { Expr::ratio(scale, 2) };
                // Multiplied out, so that no number waits outside a sum to be applied wherever S is used.
                let s = self.cas.expand(&(factor * Expr::Sum(terms)))?;
                if s.is_zero() {
                    continue;
                }
                let s = if self.quantities.is_simple(&s) {
                    s
                } else {
                    self.quantities.stage(format!("{name}{a}{b}"), s).into()
                };
                // dW = sum over the six components, of which an off-diagonal one stands for two.
                let back = if a == b { Expr::ratio(1, scale) } else { Expr::ratio(2, scale) };
                for (ij, partial) in self.strain.by_gradient(&self.quantities, components[k]) {
                    p[ij].push(back.clone() * s.clone() * partial);
                }
            }
        }
        if let Some((_, q, w)) = weights.iter().find(|(i, _, _)| *i == Invariant::J) {
            for (ij, partial) in self.strain.by_gradient(&self.quantities, *q) {
                p[ij].push(w.clone() * partial);
            }
        }
        let mut stress: [Expr; 9] = std::array::from_fn(|_| Expr::int(0));
        for (ij, terms) in p.into_iter().enumerate() {
            let e = self.cas.normalize(&Expr::Sum(terms))?;
            stress[ij] = if self.quantities.is_simple(&e) {
                e
            } else {
                self.quantities.stage(format!("P{}{}", ij / 3, ij % 3), e).into()
            };
        }
        Ok(stress)
    }

    /// The partial derivative of an invariant by component k of a strain, through the stages between the two: the given
    /// one, where there is one.
    fn partial(&mut self, q: Symbol, components: [Symbol; 6], k: usize) -> Result<Expr, DeriveError> {
        let e = match self.quantities.get(q).kind.clone() {
            Kind::Stage { partials: Some(partials), .. } => {
                let given = partials.into_iter().filter(|(by, _)| *by == components[k]).map(|(_, e)| e);
                return Ok(Expr::Sum(given.collect()));
            }
            Kind::Stage { value: Value::Expr(e), .. } => e,
            _ => return Ok(Expr::int(0)),
        };
        let seeds = BTreeMap::from([(components[k], Expr::int(1))]);
        let mut others: Vec<Symbol> = self.strain.gradient().to_vec();
        for base in [Invariant::OF_C, Invariant::OF_EPS] {
            others.extend(self.strain.components(base).into_iter().flatten());
        }
        Ok(Differential::new(&mut self.cas, &mut self.quantities, "", seeds, others).of(&e)?)
    }

    /// The differential of a stress where the nine quantities `by` change as given.
    fn stress_increment(
        &mut self,
        stress: &[Expr; 9],
        by: &[Symbol; 9],
        dgradient: &[Symbol],
    ) -> Result<Vec<Expr>, DeriveError> {
        let seeds = by.iter().copied().zip(dgradient.iter().map(|&s| s.into())).collect();
        let mut d = Differential::new(&mut self.cas, &mut self.quantities, "d", seeds, vec![]);
        stress.iter().map(|p| Ok(d.of(p)?)).collect()
    }

    /// For each displacement component i: g . dP_i. where `by` changes by e_i (x) g.
    fn diagonal(&mut self, stress: &[Expr; 9], by: &[Symbol; 9], node: &[Symbol]) -> Result<Vec<Expr>, DeriveError> {
        let mut diagonal = Vec::new();
        for i in 0..3 {
            let seeds: BTreeMap<Symbol, Expr> = (0..3).map(|j| (by[3 * i + j], node[j].into())).collect();
            let prefix = format!("d{i}_");
            let mut d = Differential::new(&mut self.cas, &mut self.quantities, &prefix, seeds, vec![]);
            let mut terms = Vec::new();
            for j in 0..3 {
                terms.push(Expr::from(node[j]) * d.of(&stress[3 * i + j])?);
            }
            diagonal.push(self.cas.normalize(&Expr::Sum(terms))?);
        }
        Ok(diagonal)
    }

    /// sigma = P F' / J.
    fn cauchy(&mut self, stress: &[Expr; 9]) -> Vec<Expr> {
        let j = self.strain.jacobian(&mut self.cas, &mut self.quantities);
        let f = self.strain.deformation().map(Expr::from);
        self.cauchy_of(stress, &j.into(), &f)
    }

    fn cauchy_of(&mut self, stress: &[Expr; 9], j: &Expr, f: &[Expr]) -> Vec<Expr> {
        let mut sigma = Vec::new();
        for i in 0..3 {
            for k in 0..3 {
                let terms =
                    (0..3).map(|m| Expr::Product(vec![stress[3 * i + m].clone(), f[3 * k + m].clone()])).collect();
                let tau = self.quantities.stage(format!("tau{i}{k}"), Expr::Sum(terms));
                sigma.push(Expr::from(tau) * j.clone().pow(Rational::from_integer(-1)));
            }
        }
        sigma
    }
}

fn vector(quantities: &mut Quantities, name: &str, role: Input, len: u32) -> Vec<Symbol> {
    let component = |k: u32| if len == 9 { format!("{name}{}{}", k / 3, k % 3) } else { format!("{name}{k}") };
    (0..len).map(|k| quantities.add(component(k), Kind::Input(role, k))).collect()
}

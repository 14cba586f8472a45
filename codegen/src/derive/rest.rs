//! What kernels compute near rest: the energy split over the Green strain, the stress split over G.

use std::collections::BTreeMap;

use crate::expr::{Expr, Symbol};
use crate::quantity::{Kind, Value};
use crate::split::{Leaves, Split, Splitter};

use super::differential::Differential;
use super::strain::{Base, Invariant};
use super::{DeriveError, Session};

/// Splitting serves up to E:E = 4, that is A:A = 16.
const GREATEST_STRAIN: (i128, i128) = (16, 1);
/// With principal stretches, whose squares are 1 + a_p with errors of the greatest a_p: up to A:A = 4.
const GREATEST_STRETCH: (i128, i128) = (4, 1);

/// Over G without a bound on the strain: up to J = 4, from where on what is split off is the lesser part.
const GREATEST_VOLUME: (i128, i128) = (4, 1);
/// Tangents, whose second derivatives by J are split too: with J^-n of them little is left soon.
const GREATEST_TANGENT: (i128, i128) = (5, 4);

/// The order of a power of J from which on a tangent's roundings come near the gate.
const STEEP: u128 = 3;

/// Pairs of a quantity and what is computed for it.
pub type StandIns = Vec<(Symbol, Symbol)>;

/// The energy near rest.
pub struct NearEnergy {
    /// W - W(0).
    pub value: Expr,
    /// Positive where it holds.
    pub holds: Expr,
}

/// The stress near rest.
pub struct NearStress {
    /// P.
    pub stress: [Expr; 9],
    /// The domain's margin.
    pub margin: Option<Expr>,
    /// The Cauchy stress.
    pub cauchy: Vec<Expr>,
    /// Positive where they hold.
    pub holds: Expr,
    /// Positive where their differential does.
    pub tangent_holds: Expr,
    /// The quantities that were split: each with the symbols of its change and of its value.
    split: Vec<(Symbol, Option<Symbol>, Option<Symbol>)>,
}

impl Session {
    /// The energy split to second order, if a rule applies; and the energy at rest.
    pub(super) fn near_energy(&mut self) -> Result<(Option<NearEnergy>, Expr), DeriveError> {
        let jacobian = self.strain.used(Invariant::J);
        let leaves = self.leaves(jacobian)?;
        let energy = self.energy.clone();
        let splitter = Splitter::of_energy(&mut self.cas, &mut self.quantities, &mut self.rest, "energy", leaves);
        let (near, at_rest) = splitter.energy(&energy)?;
        let Some(value) = near else { return Ok((None, at_rest)) };
        let holds = self.near_rest(jacobian.map(Expr::from), true, None)?;
        Ok((Some(NearEnergy { value, holds }), at_rest))
    }

    /// Splits an expression as a part of the energy: for its refusal.
    pub(super) fn try_part(&mut self, e: &Expr) -> Result<(), DeriveError> {
        let jacobian = self.strain.used(Invariant::J);
        let leaves = self.leaves(jacobian)?;
        let e = self.cas.normalize(e)?;
        let mut splitter = Splitter::of_energy(&mut self.cas, &mut self.quantities, &mut self.rest, "energy", leaves);
        splitter.split(&e)?;
        Ok(())
    }

    /// The invariants of the strain at which the splitting of the energy ends.
    fn leaves(&mut self, jacobian: Option<Symbol>) -> Result<Leaves, DeriveError> {
        let mut leaves = Leaves::default();
        if let Some(j) = jacobian {
            let half = Expr::ratio(1, 2);
            let (cas, quantities) = (&mut self.cas, &mut self.quantities);
            let [trace, square, det] =
                [Invariant::Trace(Base::A), Invariant::Ddot(Base::A, Base::A), Invariant::Det(Base::A)]
                    .map(|i| self.strain.invariant(cas, quantities, i));
            let (trace, square, det) = (trace?, square?, det?);
            // I3 = J^2 = det(I + A) = 1 + p with p = tr A + II(A) + det A, II(A) = ((tr A)^2 - A:A) / 2.
            let second = half * (Expr::from(trace).pow(2.into()) - square.into()) + det.into();
            let second = self.quantities.stage("p_remainder", second);
            let p = self.quantities.stage("p", Expr::from(trace) + second.into());
            leaves.jacobian = Some((j, p, trace, second.into()));
        }
        if let Some((second, trace, remainder, change)) = self.near_second()? {
            let split = Split::given(Expr::int(3), change).with_second_order(trace, Expr::int(2), remainder);
            leaves.others.push((second, split));
        }
        let sums = self.strain.near_stretch_sums(&mut self.quantities);
        if !sums.is_empty() {
            let trace = self.strain.invariant(&mut self.cas, &mut self.quantities, Invariant::Trace(Base::A))?;
            for s in sums {
                let change = Split::given(Expr::int(3), s.change);
                leaves.others.push((s.sum, change.with_second_order(trace, s.half, s.remainder)));
            }
        }
        for (invariant, s) in self.strain.invariants() {
            match invariant {
                Invariant::Trace(_) | Invariant::Fibre(..) | Invariant::FibrePair(..) => leaves.linear.push(s),
                Invariant::Ddot(..) | Invariant::Det(_) | Invariant::FibreSquare(..) => leaves.quadratic.push(s),
                Invariant::J | Invariant::StretchSum(_) | Invariant::Second => {}
            }
        }
        Ok(leaves)
    }

    /// The stress split to first order, if a rule applies.
    pub(super) fn near_stress(&mut self, stress: &[Expr; 9]) -> Result<Option<NearStress>, DeriveError> {
        let jacobian = self.strain.jacobian(&mut self.cas, &mut self.quantities);
        let deformation = *self.strain.deformation();
        let margin = self.margin.clone();
        let sums = self.strain.near_stretch_sums(&mut self.quantities);
        let second = self.near_second()?;
        let mut splitter = Splitter::first(&mut self.cas, &mut self.quantities, &mut self.rest, "force");
        for s in sums {
            splitter.give(s.sum, Split::given(Expr::int(3), s.change));
            for (k, (moment, change)) in s.moment.into_iter().zip(s.moment_change).enumerate() {
                splitter.give(moment, Split::given(Expr::int(i128::from(k < 3)), change));
            }
        }
        if let Some((second, _, _, change)) = second {
            splitter.give(second, Split::given(Expr::int(3), change));
        }
        let mut near = Vec::new();
        let mut rewritten = false;
        for p in stress {
            let split = splitter.split(p)?;
            if !split.rest.is_zero() {
                return Err(splitter.stressed(p, std::slice::from_ref(&split.rest)).into());
            }
            rewritten |= split.rewritten.0;
            near.push(split.change);
        }
        if !rewritten {
            return Ok(None);
        }
        let margin = match margin {
            Some(m) => Some(splitter.split(&m)?.value),
            None => None,
        };
        let uses_j = splitter.has_split(jacobian);
        let j = splitter.split(&jacobian.into())?.value;
        let mut f: Vec<Expr> = Vec::new();
        for s in deformation {
            f.push(splitter.split(&s.into())?.value);
        }
        let split = splitter.split_quantities();
        let stress: [Expr; 9] = near.try_into().expect("nine components");
        let cauchy = self.cauchy_of(&stress, &j, &f);
        let bounded = !uses_j || self.strain.has_stretch_sums();
        let j = uses_j.then_some(j);
        let holds = self.near_rest(j.clone(), bounded, (!bounded).then_some(GREATEST_VOLUME))?;
        let tangent_holds = self.near_rest(j, bounded, Some(GREATEST_TANGENT))?;
        Ok(Some(NearStress { stress, margin, cauchy, holds, tangent_holds, split }))
    }

    /// Whether an energy has a power of J whose second derivative is of third order or more, or is broken: such a tangent
    /// takes the rounding of J three times and more, most of what the gate grants. Any other is as accurate as it stands,
    /// and cheaper: so are those of ln J and of J^2.
    pub(super) fn is_steep(&self, e: &Expr) -> bool {
        let each = |xs: &[Expr]| xs.iter().any(|x| self.is_steep(x));
        match e {
            Expr::Number(_) | Expr::Symbol(_) => false,
            Expr::Sum(xs) | Expr::Product(xs) => each(xs),
            Expr::Power(base, exponent) => {
                let of_volume = self.strain.used(Invariant::J).is_some_and(|j| base.symbols().contains(&j));
                // A power of a parameter's choice is broken, too.
                let is_steep = match &**exponent {
                    Expr::Number(n) if n.is_integer() => (*n.numer() - 2).unsigned_abs() >= STEEP,
                    _ => true,
                };
                (of_volume && is_steep) || self.is_steep(base) || self.is_steep(exponent)
            }
            Expr::Ln(a) | Expr::Exp(a) => self.is_steep(a),
            Expr::Log1p(a) | Expr::Expm1(a) | Expr::Log1pmx(a) | Expr::Expm1mx(a) => self.is_steep(a),
        }
    }

    /// The differential of the stress from its form near rest, and pairs of quantities and what to compute for them.
    ///
    /// What cancels in a textbook tangent are its parts that are the same in every direction, the more, the stiffer the body
    /// is against changes of volume: they are added here before they are multiplied by anything that is rounded, and the
    /// second derivatives of W in them are split at rest.
    pub(super) fn near_increment(
        &mut self,
        near: &NearStress,
        dgradient: &[Symbol],
    ) -> Result<(Vec<Expr>, StandIns), DeriveError> {
        let stress_symbols: Vec<Symbol> = near.stress.iter().flat_map(|e| e.symbols()).collect();
        let (mut same, mut instead) = (BTreeMap::new(), vec![]);
        for &(s, change, value) in &near.split {
            for part in [change, value].into_iter().flatten().filter(|x| !stress_symbols.contains(x)) {
                same.insert(part, s);
            }
            instead.extend(value.map(|value| (s, value)));
        }
        // Sums of powers of principal stretches come from one decomposition, with their differentials.
        for s in self.strain.near_stretch_sums(&mut self.quantities) {
            let mut replace = |q: Symbol, change: Symbol, rest: i128| {
                same.remove(&change);
                same.insert(q, change);
                let value = self.quantities.stage("value", Expr::int(rest) + change.into());
                instead.push((q, value));
            };
            replace(s.sum, s.change, 3);
            for (k, (moment, change)) in s.moment.into_iter().zip(s.moment_change).enumerate() {
                replace(moment, change, i128::from(k < 3));
            }
        }
        let mut expressions = vec![];
        for p in &near.stress {
            let p = match p {
                Expr::Symbol(s) => match &self.quantities.get(*s).kind {
                    Kind::Stage { value: Value::Expr(e), partials: None } => e.clone(),
                    _ => p.clone(),
                },
                _ => p.clone(),
            };
            let p = self.cas.normalize(&p)?;
            expressions.push(self.gathered(p, &same));
        }
        let seeds = self.strain.gradient().iter().copied().zip(dgradient.iter().map(|&s| s.into())).collect();
        let differential = Differential::new(&mut self.cas, &mut self.quantities, "d", seeds, vec![]);
        let mut differential = differential.with_same(same).with_slopes();
        let increment: Result<Vec<Expr>, _> = expressions.iter().map(|p| differential.of(p)).collect();
        let increment = increment?;
        let slopes = differential.into_slopes();
        instead.extend(self.split_slopes(&slopes)?);
        Ok((increment, instead))
    }

    /// Slopes that are not polynomials, each with its value at rest and the change since: at rest, where parts of a tangent
    /// cancel most, they are the exact constants.
    fn split_slopes(&mut self, slopes: &[Symbol]) -> Result<StandIns, DeriveError> {
        let second = self.near_second()?;
        let sums = self.strain.near_stretch_sums(&mut self.quantities);
        let mut splitter = Splitter::first(&mut self.cas, &mut self.quantities, &mut self.rest, "dforce");
        for s in sums {
            splitter.give(s.sum, Split::given(Expr::int(3), s.change));
        }
        if let Some((second, _, _, change)) = second {
            splitter.give(second, Split::given(Expr::int(3), change));
        }
        let mut pairs = vec![];
        for &slope in slopes {
            // What no rule splits is computed as it stands: nothing in it cancels.
            if let Ok(Split { value: Expr::Symbol(value), .. }) = splitter.split(&slope.into()) {
                pairs.push((slope, value));
            }
        }
        Ok(pairs)
    }

    /// A sum with its multiples of changes gathered into one quantity, so that nothing is factored out of them.
    fn gathered(&mut self, e: Expr, changes: &BTreeMap<Symbol, Symbol>) -> Expr {
        let Expr::Sum(terms) = &e else { return e };
        let is_change = |t: &Expr| match t {
            Expr::Symbol(s) => changes.contains_key(s),
            Expr::Product(factors) => {
                matches!(factors.as_slice(), [Expr::Number(_), Expr::Symbol(s)] if changes.contains_key(s))
            }
            _ => false,
        };
        let (changes, mut others): (Vec<Expr>, Vec<Expr>) = terms.iter().cloned().partition(is_change);
        if changes.len() < 2 {
            return e;
        }
        others.push(self.quantities.stage("pressure", Expr::Sum(changes)).into());
        Expr::Sum(others)
    }

    /// I2, if in use, and tr A, II(A), 2 tr A + II(A): I2 = 3 + 2 tr A + II(A).
    fn near_second(&mut self) -> Result<Option<(Symbol, Symbol, Symbol, Symbol)>, DeriveError> {
        let Some(second) = self.strain.used(Invariant::Second) else { return Ok(None) };
        let (cas, quantities) = (&mut self.cas, &mut self.quantities);
        let [trace, square] = [Invariant::Trace(Base::A), Invariant::Ddot(Base::A, Base::A)]
            .map(|i| self.strain.invariant(cas, quantities, i));
        let (trace, square) = (trace?, square?);
        let remainder = Expr::ratio(1, 2) * (Expr::from(trace).pow(2.into()) - square.into());
        let remainder = self.quantities.stage("I2_remainder", remainder);
        let change = self.quantities.stage("I2_change", Expr::int(2) * Expr::from(trace) + remainder.into());
        Ok(Some((second, trace, remainder, change)))
    }

    /// What tangents compute otherwise than the textbook, although nothing in them cancels, as pairs of a quantity and
    /// its stand-in: J with fewer roundings near rest (1 + j where j > -1/2), because they divide by it more than once;
    /// and selections by comparisons that are decided rightly near rest.
    pub(super) fn accurate(&mut self) -> Result<StandIns, DeriveError> {
        let jacobian = self.strain.used(Invariant::J);
        let sums = self.strain.near_stretch_sums(&mut self.quantities);
        let selections = self.quantities.selections();
        let conditions = self.conditions.clone();
        let mut splitter = Splitter::first(&mut self.cas, &mut self.quantities, &mut self.rest, "dforce");
        for s in sums {
            splitter.give(s.sum, Split::given(Expr::int(3), s.change));
        }
        let mut stand_ins = Vec::new();
        if let Some(jacobian) = jacobian {
            let split = splitter.split(&jacobian.into())?;
            let (left, right) = (split.change, Expr::ratio(-1, 2));
            stand_ins.push((jacobian, "J".to_string(), left, right, split.value, jacobian.into()));
        }
        for (left, right) in conditions {
            let Some(decided) = splitter.condition(&left, &right)? else { continue };
            for (s, name, value) in &selections {
                if let Value::Select { left: l, right: r, then, otherwise } = value
                    && (l, r) == (&left, &right)
                {
                    let (left, right) = decided.clone();
                    stand_ins.push((*s, name.clone(), left, right, then.clone(), otherwise.clone()));
                }
            }
        }
        let mut pairs = Vec::new();
        for (s, name, left, right, then, otherwise) in stand_ins {
            let value = Value::Select { left, right, then, otherwise };
            pairs.push((s, self.quantities.add(name, Kind::Stage { value, partials: None })));
        }
        Ok(pairs)
    }

    /// Positive near rest: where J is above 1/2 and below the greatest, if one is given, and, if the strain is bounded too,
    /// where E:E <= 4. Where there is no J, tr C > 2 stands for a body that is not compressed to almost nothing.
    fn near_rest(
        &mut self,
        jacobian: Option<Expr>,
        bounded: bool,
        greatest: Option<(i128, i128)>,
    ) -> Result<Expr, DeriveError> {
        let (cas, quantities) = (&mut self.cas, &mut self.quantities);
        let small = if bounded {
            let square = self.strain.invariant(cas, quantities, Invariant::Ddot(Base::A, Base::A))?;
            let (n, d) = if self.strain.has_stretch_sums() { GREATEST_STRETCH } else { GREATEST_STRAIN };
            Some(Expr::ratio(n, d) - Expr::from(square))
        } else {
            None
        };
        let Some(j) = jacobian else {
            // tr A > -1 wherever A:A >= 16: no eigenvalue is below -1.
            let trace = self.strain.invariant(cas, quantities, Invariant::Trace(Base::A))?;
            let above = Expr::int(1) + trace.into();
            return Ok(small.map_or(above.clone(), |small| small * above));
        };
        // A product serves where both factors cannot be negative.
        let above = j.clone() - Expr::ratio(1, 2);
        let volume = match greatest {
            Some((n, d)) => above * (Expr::ratio(n, d) - j),
            None => above,
        };
        let Some(small) = small else { return Ok(volume) };
        let (left, right) = (small.clone(), volume.clone());
        let value = Value::Select { left, right, then: volume, otherwise: small };
        Ok(quantities.add("near_rest", Kind::Stage { value, partials: None }).into())
    }
}

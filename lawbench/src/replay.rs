//! One state of a material point again: what each precision computes there, by which form, and how far it is off.

use serde::Serialize;
use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Input, Output};

use crate::evaluate::constants;
use crate::extremes::computed;
use crate::gate::{Machine, QUANTITIES, Quantity, Reference};
use crate::material::Material;
use crate::number::Exact;
use crate::roundings::{expected, roundings};
use crate::states::{Precision, State};
use crate::subject::Subject;

/// One quantity in one precision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What computes.
    pub machine: Machine,
    /// What is computed.
    pub quantity: Quantity,
    /// `near` and `far` rest are the two forms of a split kernel; `only` is that of one that is not split.
    pub form: &'static str,
    /// What is computed.
    pub computed: Vec<f64>,
    /// The exact value for the rounded state.
    pub exact: Vec<f64>,
    /// The error as a part of its bound; none where nothing is promised.
    pub gate: Option<f64>,
    /// The error as a part of the value.
    pub relative: Option<f64>,
    /// The roundings that move the value most: of what, and as a part of the bound for one unit round-off.
    pub roundings: Vec<(String, f64)>,
    /// What all roundings come to where they are independent and uniform: a root mean square, as a part of the bound.
    pub expected: f64,
}

/// Roundings that are told.
const TOLD: usize = 12;

/// Replays a state in f32 and f64; nothing where it is outside the law's domain.
pub fn replay(subject: &Subject, material: &Material, state: &State) -> Option<Vec<Row>> {
    let mut rows = one::<f32>(&subject.derivation, material, state, Machine::F32)?;
    rows.extend(one::<f64>(&subject.derivation, material, state, Machine::F64)?);
    Some(rows)
}

fn one<T: Precision>(
    derivation: &Derivation,
    material: &Material,
    state: &State,
    machine: Machine,
) -> Option<Vec<Row>> {
    let (g, d) = (state.gradient.map(T::nearest), state.direction.map(T::nearest));
    let rounded: Vec<T> = constants(derivation, &material.parameters).into_iter().map(T::nearest).collect();
    let exact = material.exact_constants(derivation);
    let zero = [0.0; 9].map(Exact::from);
    let inputs = [(Input::Constants, exact.as_slice()), (Input::DisplacementGradient, &zero[..])];
    let rest = crate::evaluate::textbook(derivation, "energy", &inputs).value.remove(0);
    let reference = Reference::new(derivation, &exact, &rest, &g.map(T::exactly), &d.map(T::exactly))?;
    let values = computed(derivation, &rounded, &g, &d);
    let inputs = [
        (Input::Constants, rounded.as_slice()),
        (Input::DisplacementGradient, &g[..]),
        (Input::GradientIncrement, &d[..]),
    ];
    let arrays = inputs.map(|(role, array)| (role, array.iter().map(|x| x.exactly()).collect::<Vec<f64>>()));
    let doubles: Vec<(Input, &[f64])> = arrays.iter().map(|(role, array)| (*role, array.as_slice())).collect();
    let row = |(quantity, computed): (Quantity, Vec<f64>)| {
        let kernel = match quantity {
            Quantity::P => "force",
            Quantity::W => "energy",
            Quantity::DP => "dforce",
        };
        let measure = reference.measure(machine, quantity, &computed);
        let point = derivation.point(kernel);
        let near = point.near;
        let margin = near.ir().outputs.iter().position(|(role, _)| *role == Output::NearRest);
        let (form, counts) = match margin {
            None => ("only", near),
            Some(at) => {
                let margin = &near.interpret(&inputs).expect("the inputs of a point kernel")[at][0];
                if margin.greater(&T::nearest(0.0)) { ("near", near) } else { ("far", point.textbook()) }
            }
        };
        let unit = machine.round_off() / reference.bound(machine, quantity).to_f64();
        let roundings = roundings(counts, &doubles).expect("the inputs of a point kernel");
        let expected = unit * expected(&roundings);
        let roundings = roundings.into_iter().take(TOLD).map(|r| (r.what, unit * r.weight)).collect();
        let exact = reference.value(quantity).iter().map(Exact::to_f64).collect();
        let (gate, relative) = (measure.map(|m| m.gate), measure.map(|m| m.relative));
        Row { machine, quantity, form, computed, exact, gate, relative, roundings, expected }
    };
    Some(QUANTITIES.into_iter().zip(values).map(row).collect())
}

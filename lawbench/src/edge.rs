//! The edge of a law's domain: where its margin changes sign, in every precision, and what kernels give just inside.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::Input;

use crate::evaluate::{constants, printed};
use crate::exact::{ExactLaw, exact};
use crate::gate::{Machine, QUANTITIES, Quantity, Reference};
use crate::material::Material;
use crate::number::Exact;
use crate::states::{Precision, Random};

/// What was found along rays from rest.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Edge {
    /// Rays along which the margin changes sign.
    pub reached: usize,
    /// What is wrong there.
    pub faults: Vec<String>,
}

/// Rays that are followed: uniform compression and extension, and random ones.
const RAYS: usize = 8;

/// How far rays are followed, in units of |G|.
const FARTHEST: f64 = 16.0;

/// The distance from the edge, as a part of the ray and in units of the precision, within which a precision's margin may have either sign: margins are
/// polynomials of degree 3 and less in G of |F| up to 17, so that 2^8 round-offs are a generous 20 operations.
const BLUR: f64 = 256.0;

/// Follows rays from rest to the edge.
pub fn edge(derivation: &Derivation, material: &Material, random: &mut Random) -> Edge {
    let law = ExactLaw::new(derivation, material);
    let mut found = Edge::default();
    for ray in 0..RAYS {
        let identity = |s: f64| std::array::from_fn(|k| if k % 4 == 0 { s } else { 0.0 });
        let direction: [f64; 9] = match ray {
            0 => identity(-1.0),
            1 => identity(1.0),
            _ => random.direction(),
        };
        let Some(at) = crossing(&law, &direction) else { continue };
        found.reached += 1;
        let name = format!("ray {ray}, edge at |G| = {:.6}", at * direction.iter().map(|x| x * x).sum::<f64>().sqrt());
        signs::<f32>(derivation, material, &direction, at, f64::from(f32::EPSILON), &name, &mut found);
        signs::<f64>(derivation, material, &direction, at, f64::EPSILON, &name, &mut found);
        values(derivation, material, &law, &direction, at, &name, &mut found);
    }
    found
}

/// The factor of the direction at which the exact margin first changes sign.
fn crossing(law: &ExactLaw, direction: &[f64; 9]) -> Option<f64> {
    let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    let inside = |t: f64| law.inside(&exact(&direction.map(|x| t * x)));
    let steps = 256;
    let step = FARTHEST / length / f64::from(steps);
    let first = (1..=steps).find(|k| !inside(step * f64::from(*k)))?;
    let (mut low, mut high) = (step * f64::from(first - 1), step * f64::from(first));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if inside(middle) { low = middle } else { high = middle }
    }
    Some(low)
}

/// The margin of a precision inside and outside of the blur around the edge.
fn signs<T: Precision>(
    derivation: &Derivation,
    material: &Material,
    direction: &[f64; 9],
    at: f64,
    epsilon: f64,
    name: &str,
    found: &mut Edge,
) {
    let constants: Vec<T> = constants(derivation, &material.parameters).into_iter().map(T::nearest).collect();
    for (part, inside) in [(1.0 - BLUR * epsilon, true), (1.0 + BLUR * epsilon, false)] {
        let g = direction.map(|x| T::nearest(part * at * x));
        let inputs = [(Input::Constants, constants.as_slice()), (Input::DisplacementGradient, &g[..])];
        for kernel in ["energy", "force"] {
            let margin = printed(derivation, kernel, &inputs).margin.map_or(1.0, T::exactly);
            if (margin > 0.0) != inside {
                let place = if inside { "inside" } else { "outside" };
                let type_name = std::any::type_name::<T>();
                found.faults.push(format!("{name}: the margin of {kernel} in {type_name} is {margin:e} just {place}"));
            }
        }
    }
}

/// Values just inside: finite wherever the exact ones are normal numbers.
fn values(
    derivation: &Derivation,
    material: &Material,
    law: &ExactLaw,
    direction: &[f64; 9],
    at: f64,
    name: &str,
    found: &mut Edge,
) {
    let exact_constants = material.exact_constants(derivation);
    let constants: Vec<f64> = material.constants(derivation);
    let rest = law.energy(&exact(&[0.0; 9]));
    for near in [1e-2, 1e-4, 1e-6] {
        let g = direction.map(|x| (1.0 - near) * at * x);
        let Some(reference) = Reference::new(derivation, &exact_constants, &rest, &g, direction) else { continue };
        let inputs = [
            (Input::Constants, constants.as_slice()),
            (Input::DisplacementGradient, &g[..]),
            (Input::GradientIncrement, &direction[..]),
        ];
        for quantity in QUANTITIES {
            let (kernel, count) = match quantity {
                Quantity::P => ("force", 2),
                Quantity::W => ("energy", 2),
                Quantity::DP => ("dforce", 3),
            };
            let value = printed(derivation, kernel, &inputs[..count]).value;
            if reference.measure(Machine::F64, quantity, &value).is_some_and(|m| m.gate.is_infinite()) {
                let exact = Exact::norm(reference.value(quantity)).to_f64();
                let symbol = quantity.name();
                found.faults.push(format!("{name}: {symbol} is not finite {near:e} before it, and is {exact:e}"));
            }
        }
    }
}

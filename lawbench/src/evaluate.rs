//! The values of a law's kernels in any number type: as the printed code computes them, and of the textbook form.
//!
//! This is the one place that knows which kernel's values count.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Input, Number, Output};

/// What a point kernel gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Values<T> {
    /// Its first output array: W, P, dP, a diagonal, or the Cauchy stress.
    pub value: Vec<T>,
    /// Positive inside the law's domain; none where the kernel has no margin.
    pub margin: Option<T>,
}

/// The constants of a material, from the components of all parameters in order.
///
/// # Panics
/// `parameters` has not one value a component.
pub fn constants<T: Number>(derivation: &Derivation, parameters: &[T]) -> Vec<T> {
    let kernel = derivation.kernel("material");
    kernel.interpret(&[(Input::Parameters, parameters)]).expect("one value a component").remove(0)
}

/// What the printed kernel of this name computes, operation by operation.
///
/// # Panics
/// An input is missing or has another length than the kernel's.
pub fn printed<T: Number>(derivation: &Derivation, kernel: &str, inputs: &[(Input, &[T])]) -> Values<T> {
    let point = derivation.point(kernel);
    let roles = point.outputs().map(|(role, _)| *role).collect();
    values(roles, point.interpret(inputs).expect("the inputs of a point kernel"))
}

/// The value of the law as its file writes it: of the kernel's unsplit form where it has one, and of its only form
/// otherwise. In a number type of many digits this is the exact value.
///
/// # Panics
/// See [`printed`].
pub fn textbook<T: Number>(derivation: &Derivation, kernel: &str, inputs: &[(Input, &[T])]) -> Values<T> {
    let point = derivation.point(kernel);
    let textbook = point.textbook();
    let roles = textbook.ir().outputs.iter().map(|(role, _)| *role).collect();
    values(roles, textbook.interpret(inputs).expect("the inputs of a point kernel"))
}

fn values<T: Clone>(roles: Vec<Output>, mut arrays: Vec<Vec<T>>) -> Values<T> {
    let margin = roles.iter().position(|role| *role == Output::DomainMargin);
    let margin = margin.map(|at| arrays[at][0].clone());
    Values { value: arrays.swap_remove(0), margin }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tensormass_codegen::ir::{Builder, Rational};

    /// A derivation whose force is 1 near rest, where G00 < 1/2, and 2 elsewhere.
    fn split() -> Derivation {
        let entry = tensormass_kernels::laws().first().expect("a law");
        let mut derivation = Derivation::from_text(entry.source.derivation).expect("a derivation");
        derivation.kernels.retain(|k| !k.ir().name.ends_with("_far"));
        let at = derivation.kernels.iter().position(|k| k.ir().name == "force").expect("every law has a force");
        let inputs = derivation.kernels[at].ir().inputs.clone();
        let form = |name: &str, value: i128, holds: bool| {
            let mut b = Builder::new();
            let stress = b.number(value.into());
            let mut outputs = vec![(Output::Stress, vec![stress; 9])];
            if holds {
                let (half, g) = (b.number(Rational::new(1, 2)), b.input(Input::DisplacementGradient, 0));
                outputs.push((Output::NearRest, vec![b.sub(half, g)]));
            }
            b.finish(name, inputs.clone(), outputs).validate().expect("a valid kernel")
        };
        derivation.kernels[at] = form("force", 1, true);
        derivation.kernels.insert(at + 1, form("force_far", 2, false));
        derivation
    }

    #[test]
    fn near_rest_the_split_form_counts_and_the_textbook_is_the_other() {
        let derivation = split();
        let count = derivation.kernel("force").ir().inputs.iter().find(|(r, _)| *r == Input::Constants);
        let constants = vec![1.0; count.expect("a force has constants").1 as usize];
        for (g, expected) in [(0.0, 1.0), (0.75, 2.0)] {
            let g = [g; 9];
            let inputs = [(Input::Constants, constants.as_slice()), (Input::DisplacementGradient, &g[..])];
            assert_eq!(printed(&derivation, "force", &inputs), Values { value: vec![expected; 9], margin: None });
            assert_eq!(textbook(&derivation, "force", &inputs).value, [2.0; 9]);
        }
    }

    /// Forms that are split at rest serve there, and neither where a body is compressed to almost nothing nor where it is
    /// blown up to eight times its volume.
    #[test]
    fn split_forms_end_where_they_would_lose_digits() {
        let mut split = 0;
        for entry in tensormass_kernels::laws() {
            let derivation = Derivation::from_text(entry.source.derivation).expect("a derivation");
            let subject = crate::subject::Subject::of_build(entry);
            let constants = crate::material::Material::usual(&subject).expect("a material").constants(&derivation);
            for kernel in &derivation.kernels {
                let Some(at) = kernel.ir().outputs.iter().position(|(role, _)| *role == Output::NearRest) else {
                    continue;
                };
                split += 1;
                // Tangents end sooner.
                let tangent = kernel.ir().name == "dforce";
                let states = [(1.0, true), (1.05, true), (1.2, !tangent), (0.7, false), (0.1, false), (2.0, false)];
                for (stretch, holds) in states {
                    let g: [f64; 9] = std::array::from_fn(|k| if k % 4 == 0 { stretch - 1.0 } else { 0.0 });
                    let inputs = [
                        (Input::Constants, constants.as_slice()),
                        (Input::DisplacementGradient, &g[..]),
                        (Input::GradientIncrement, &g[..]),
                    ];
                    let margin = kernel.interpret(&inputs).expect("the inputs of a point kernel")[at][0];
                    assert_eq!(margin > 0.0, holds, "{} {} at {stretch}", entry.info.name, kernel.ir().name);
                }
            }
        }
        assert!(split > 0, "no kernel is split at rest");
    }
}

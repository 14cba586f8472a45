//! The values of a law's kernels in any number type: as the printed code computes them, and of the textbook form.
//!
//! This is the one place that knows which kernel's values count.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Input, Number, Output, ValidKernel};

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
    interpret(derivation.kernel(kernel), inputs)
}

/// The value of the law as its file writes it: of the kernel's unsplit form, `NAME_far`, where it has one, and of its
/// only form otherwise. In a number type of many digits this is the exact value.
///
/// # Panics
/// See [`printed`].
pub fn textbook<T: Number>(derivation: &Derivation, kernel: &str, inputs: &[(Input, &[T])]) -> Values<T> {
    let far = format!("{kernel}_far");
    let unsplit = derivation.kernels.iter().find(|k| k.ir().name == far);
    interpret(unsplit.unwrap_or_else(|| derivation.kernel(kernel)), inputs)
}

fn interpret<T: Number>(kernel: &ValidKernel, inputs: &[(Input, &[T])]) -> Values<T> {
    let mut arrays = kernel.interpret(inputs).expect("the inputs of a point kernel");
    let margin = kernel.ir().outputs.iter().position(|(role, _)| *role == Output::DomainMargin);
    let margin = margin.map(|at| arrays[at][0].clone());
    Values { value: arrays.swap_remove(0), margin }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tensormass_codegen::ir::{KernelIr, Op};

    /// The derivation of a law of this build whose margin is J, with a form `force_far` that has a stress of its own.
    fn split() -> Derivation {
        let entry = tensormass_kernels::laws().iter().find(|l| l.info.domain.is_some()).expect("a law with a domain");
        let mut derivation = Derivation::from_text(entry.source.derivation).expect("a derivation");
        derivation.kernels.retain(|k| !k.ir().name.ends_with("_far"));
        let plain = derivation.kernel("force").ir();
        // The margin in the place of every stress component.
        let margin = plain.outputs[1].1[0];
        let outputs = vec![(Output::Stress, vec![margin; 9]), plain.outputs[1].clone()];
        let values = plain.values[..=margin.index()].to_vec();
        let far = KernelIr { name: "force_far".into(), outputs, values, inputs: plain.inputs.clone() };
        derivation.kernels.push(far.validate().expect("a part of a valid kernel"));
        derivation
    }

    #[test]
    fn the_unsplit_form_is_the_textbook_s() {
        let derivation = split();
        let count = derivation.kernel("force").ir().inputs.iter().find(|(r, _)| *r == Input::Constants);
        let constants = vec![1.0; count.expect("a force has constants").1 as usize];
        let rest = [0.0; 9];
        let inputs = [(Input::Constants, constants.as_slice()), (Input::DisplacementGradient, &rest[..])];
        let textbook = textbook(&derivation, "force", &inputs);
        assert_eq!(textbook, Values { value: vec![1.0; 9], margin: Some(1.0) });
        assert_ne!(printed(&derivation, "force", &inputs).value, textbook.value);
        assert!(derivation.kernel("force").ir().values.iter().any(|d| matches!(d.op, Op::Add(..))));
    }
}

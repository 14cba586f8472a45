//! The gate between a kernel that was built or read and one that may be printed.

use num_traits::Zero;

use super::{Input, KernelIr, Op, Output, ValueId};

/// A kernel that keeps every rule of the language. Only [`KernelIr::validate`] makes one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValidKernel(KernelIr);

impl ValidKernel {
    /// The kernel itself.
    pub fn ir(&self) -> &KernelIr {
        &self.0
    }
}

/// Why a kernel is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("kernel `{kernel}`: {reason}")]
pub struct InvalidKernel {
    /// The kernel's name.
    pub kernel: String,
    /// Which rule is broken, and by which value.
    pub reason: String,
}

fn input_length(role: Input) -> Option<u32> {
    match role {
        Input::Parameters | Input::Constants | Input::State | Input::NodalDisplacement => None,
        Input::ShapeGradients | Input::ReferenceGradients => None,
        Input::DisplacementGradient | Input::GradientRate | Input::GradientIncrement => Some(9),
        Input::StressIn | Input::InverseJacobian => Some(9),
        Input::NodeGradient => Some(3),
        Input::Weight => Some(1),
    }
}

fn output_length(role: Output) -> Option<usize> {
    match role {
        Output::Constants | Output::State | Output::NodalForce | Output::NodeGradients => None,
        Output::EnergyDensity | Output::DissipationDensity | Output::DomainMargin | Output::NearRest => Some(1),
        Output::Stress | Output::StressIncrement | Output::Cauchy | Output::DisplacementGradient => Some(9),
        Output::Diagonal => Some(3),
    }
}

impl KernelIr {
    /// Checks every rule: names, lengths of roles, order of definitions, no duplicate, no dead value, no division by a
    /// constant zero.
    ///
    /// # Errors
    /// The first broken rule, with the value that breaks it.
    pub fn validate(self) -> Result<ValidKernel, InvalidKernel> {
        match self.broken_rule() {
            Some(reason) => Err(InvalidKernel { kernel: self.name, reason }),
            None => Ok(ValidKernel(self)),
        }
    }

    fn broken_rule(&self) -> Option<String> {
        if self.name.is_empty() || !self.name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        {
            return Some(format!("its name `{}` is not a snake_case identifier", self.name));
        }
        for (i, &(role, len)) in self.inputs.iter().enumerate() {
            if self.inputs[..i].iter().any(|&(r, _)| r == role) {
                return Some(format!("input {role:?} is declared twice"));
            }
            if input_length(role).is_some_and(|n| n != len) {
                return Some(format!("input {role:?} has length {len}"));
            }
        }
        let mut used = vec![false; self.values.len()];
        let mut seen = std::collections::HashSet::new();
        for (i, definition) in self.values.iter().enumerate() {
            if !seen.insert(definition.op) {
                return Some(format!("value {i} repeats an earlier one: {:?}", definition.op));
            }
            for operand in definition.op.operands() {
                if operand.index() >= i {
                    return Some(format!("value {i} reads value {} before it is defined", operand.0));
                }
                used[operand.index()] = true;
            }
            match definition.op {
                Op::Input(role, k) => match self.inputs.iter().find(|&&(r, _)| r == role) {
                    None => return Some(format!("value {i} reads the undeclared input {role:?}")),
                    Some(&(_, len)) if k >= len => {
                        return Some(format!("value {i} reads component {k} of {role:?}, which has {len}"));
                    }
                    Some(_) => {}
                },
                Op::Div(_, d) if matches!(self.values[d.index()].op, Op::Const(q) if q.is_zero()) => {
                    return Some(format!("value {i} divides by zero"));
                }
                _ => {}
            }
        }
        if self.outputs.is_empty() {
            return Some("it has no output".to_string());
        }
        for (i, (role, ids)) in self.outputs.iter().enumerate() {
            if self.outputs[..i].iter().any(|(r, _)| r == role) {
                return Some(format!("output {role:?} is declared twice"));
            }
            if output_length(*role).is_some_and(|n| n != ids.len()) {
                return Some(format!("output {role:?} has length {}", ids.len()));
            }
            for id in ids {
                match used.get_mut(id.index()) {
                    Some(flag) => *flag = true,
                    None => return Some(format!("output {role:?} reads the undefined value {}", id.0)),
                }
            }
        }
        let dead = used.iter().position(|u| !u)?;
        Some(format!("value {} is never used", ValueId(dead as u32).0))
    }
}

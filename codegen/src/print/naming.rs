//! Names and descriptions that every printed language shares.

use std::collections::HashSet;

use crate::derivation::{Derivation, FAR, PointKernel};
use crate::ir::{Input, Op, Output, ValidKernel};

/// How a value is written where it is used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ValueName {
    /// In place: a component of an input.
    Input(Input, u32),
    /// The identifier of its own definition.
    Local(String),
}

/// A name for each value: the derivation's where it is unique and `allowed`, `v12` elsewhere; inputs in place.
pub fn value_names(kernel: &ValidKernel, allowed: impl Fn(&str) -> bool) -> Vec<ValueName> {
    let mut taken: HashSet<String> = kernel.ir().inputs.iter().map(|&(r, _)| letter(r).to_string()).collect();
    let values = kernel.ir().values.iter().enumerate();
    values
        .map(|(i, d)| {
            if let Op::Input(role, k) = d.op {
                return ValueName::Input(role, k);
            }
            let wanted = d.name.as_deref().map(snake_case).filter(|n| is_free(n) && allowed(n));
            let unique = wanted.filter(|n| taken.insert(n.clone()));
            ValueName::Local(unique.unwrap_or_else(|| format!("v{i}")))
        })
        .collect()
}

/// Begins with a letter, and is none of the names that values without one get.
fn is_free(name: &str) -> bool {
    let numbered =
        name.strip_prefix('v').is_some_and(|rest| !rest.is_empty() && rest.chars().all(|c| c.is_ascii_digit()));
    !numbered && name.starts_with(|c: char| c.is_ascii_lowercase())
}

/// A valid snake_case identifier: `dF01` and `W_J` become `d_f01` and `w_j`.
fn snake_case(name: &str) -> String {
    let mut out = String::new();
    let mut previous_lower = false;
    for c in name.chars() {
        if c.is_ascii_uppercase() {
            if previous_lower {
                out.push('_');
            }
            out.push(c.to_ascii_lowercase());
            previous_lower = false;
        } else {
            previous_lower = c.is_ascii_lowercase();
            out.push(if c.is_ascii_alphanumeric() { c } else { '_' });
        }
    }
    out
}

/// The short name of an input in the text: the field's letter.
pub fn letter(role: Input) -> &'static str {
    match role {
        Input::Parameters => "parameters",
        Input::Constants => "c",
        Input::DisplacementGradient => "g",
        Input::GradientRate => "gt",
        Input::GradientIncrement => "dg",
        Input::State => "state",
        Input::NodeGradient => "n",
        Input::NodalDisplacement => "u",
        Input::ShapeGradients => "b",
        Input::ReferenceGradients => "s",
        Input::InverseJacobian => "j",
        Input::Weight => "w",
        Input::StressIn => "p",
    }
}

/// What a kernel with two forms computes.
pub fn point_docs(kernel: &PointKernel) -> String {
    format!("{}\nNear rest by the form that is split there, by the textbook form elsewhere.", quantity(kernel.name()))
}

/// What a kernel computes and what that takes.
pub fn kernel_docs(kernel: &ValidKernel) -> String {
    let c = kernel.count();
    let name = kernel.ir().name.as_str();
    let splits = kernel.ir().outputs.iter().any(|(role, _)| *role == Output::NearRest);
    let form = match name.strip_suffix(FAR) {
        Some(_) => " Textbook form, for far from rest.",
        None if splits => " Split at rest; holds where the last value is positive.",
        None => "",
    };
    let what = quantity(name.strip_suffix(FAR).unwrap_or(name));
    format!(
        "{what}{form}\n{} additions, {} multiplications, {} divisions, {} functions.",
        c.additions, c.multiplications, c.divisions, c.functions
    )
}

fn quantity(name: &str) -> &'static str {
    match name {
        "energy" => "W, the strain energy density, at G.",
        "force" => "P = dW/dG, the first Piola-Kirchhoff stress, at G.",
        "dforce" => "dP = d2W/dG2 : dG at G.",
        "linearize" => "What of the tangent does not depend on dG, as far as it is stored.",
        "apply" => "dP = d2W/dG2 : dG, from what was stored.",
        "diagonal" => "n . d2W/dG_i.dG_i. . n at G for i = 0, 1, 2.",
        "cauchy" => "sigma = P F' / J at G.",
        "dissipation" => "D, the dissipation density, at G and its rate.",
        "damping" => "P_v = dD/d(dG/dt), the stress of damping, at G and its rate.",
        "ddamping" => "dP_v = d2D/d(dG/dt)2 : dG at G and its rate; dG is that of the rate.",
        "damping_diagonal" => "n . d2D/d(dG/dt)_i.d(dG/dt)_i. . n at G and its rate for i = 0, 1, 2.",
        "gradient" => "G = sum_j u_j (x) grad Lambda_j; gradients are those of nodes 1, 2, ...",
        "contract" => "f_j = -w P grad Lambda_j.",
        "node_gradients" => "grad Lambda_j of every node.",
        _ => "",
    }
}

/// The constants for the reader: `c[0] = mu`, ...
pub fn constants(derivation: &Derivation) -> String {
    let each = derivation.constants.iter().enumerate().map(|(k, c)| format!("`c[{k}] = {c}`"));
    each.collect::<Vec<_>>().join(", ")
}

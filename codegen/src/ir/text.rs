//! Kernels as readable text, and back: the form in which derivations are committed and reviewed.
//!
//! ```text
//! kernel force
//! in constants 2
//! in displacement_gradient 9
//! v0 = input displacement_gradient 0
//! v1 = const 1/2
//! v2 = mul v0 v1                     # name
//! out stress v2 v2 ...
//! end
//! ```

use std::fmt::Write as _;

use super::{Definition, Input, KernelIr, Op, Output, Rational, ValueId};

/// A line of kernel text that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct IrTextError {
    /// 1-based line in the text.
    pub line: usize,
    /// What is wrong with it.
    pub reason: String,
}

const INPUTS: &[(Input, &str)] = &[
    (Input::Parameters, "parameters"),
    (Input::Constants, "constants"),
    (Input::DisplacementGradient, "displacement_gradient"),
    (Input::GradientRate, "gradient_rate"),
    (Input::GradientIncrement, "gradient_increment"),
    (Input::State, "state"),
    (Input::NodeGradient, "node_gradient"),
    (Input::NodalDisplacement, "nodal_displacement"),
    (Input::ShapeGradients, "shape_gradients"),
    (Input::ReferenceGradients, "reference_gradients"),
    (Input::InverseJacobian, "inverse_jacobian"),
    (Input::Weight, "weight"),
    (Input::StressIn, "stress"),
];

const OUTPUTS: &[(Output, &str)] = &[
    (Output::Constants, "constants"),
    (Output::EnergyDensity, "energy_density"),
    (Output::Stress, "stress"),
    (Output::StressIncrement, "stress_increment"),
    (Output::State, "state"),
    (Output::Diagonal, "diagonal"),
    (Output::Cauchy, "cauchy"),
    (Output::DissipationDensity, "dissipation_density"),
    (Output::DomainMargin, "domain_margin"),
    (Output::NearRest, "near_rest"),
    (Output::DisplacementGradient, "displacement_gradient"),
    (Output::NodalForce, "nodal_force"),
    (Output::NodeGradients, "node_gradients"),
];

impl Input {
    /// The role's name in kernel text and in generated code.
    pub fn name(self) -> &'static str {
        INPUTS.iter().find(|(r, _)| *r == self).expect("every input role has a name").1
    }
}

impl Output {
    /// The role's name in kernel text and in generated code.
    pub fn name(self) -> &'static str {
        OUTPUTS.iter().find(|(r, _)| *r == self).expect("every output role has a name").1
    }
}

fn op_text(op: &Op) -> String {
    let head = match op {
        Op::Input(role, k) => return format!("input {} {k}", role.name()),
        Op::Const(q) => return format!("const {q}"),
        Op::Add(..) => "add",
        Op::Sub(..) => "sub",
        Op::Mul(..) => "mul",
        Op::Div(..) => "div",
        Op::Neg(..) => "neg",
        Op::Fma(..) => "fma",
        Op::Sqrt(..) => "sqrt",
        Op::Ln(..) => "ln",
        Op::Exp(..) => "exp",
        Op::Log1p(..) => "log1p",
        Op::Expm1(..) => "expm1",
        Op::Log1pmx(..) => "log1pmx",
        Op::Expm1mx(..) => "expm1mx",
        Op::Powf(..) => "powf",
        Op::Select(..) => "select",
    };
    op.operands().iter().fold(head.to_string(), |text, v| format!("{text} v{}", v.0))
}

impl KernelIr {
    /// The kernel as text.
    pub fn to_text(&self) -> String {
        let mut out = format!("kernel {}\n", self.name);
        for (role, len) in &self.inputs {
            let _ = writeln!(out, "in {} {len}", role.name());
        }
        for (i, definition) in self.values.iter().enumerate() {
            let line = format!("v{i} = {}", op_text(&definition.op));
            let _ = match &definition.name {
                Some(name) => writeln!(out, "{line:<40} # {name}"),
                None => writeln!(out, "{line}"),
            };
        }
        for (role, ids) in &self.outputs {
            let _ = write!(out, "out {}", role.name());
            for id in ids {
                let _ = write!(out, " v{}", id.0);
            }
            out.push('\n');
        }
        out.push_str("end\n");
        out
    }

    /// Reads one kernel from lines numbered from 1, starting at its `kernel` line; the lines after `end` are left.
    ///
    /// # Errors
    /// The first line that is not of the form.
    pub fn from_lines<'a>(
        lines: &mut std::iter::Peekable<impl Iterator<Item = (usize, &'a str)>>,
    ) -> Result<KernelIr, IrTextError> {
        let error = |line: usize, reason: String| IrTextError { line, reason };
        let Some((first, head)) = lines.next() else {
            return Err(error(0, "the text ends where a kernel was expected".into()));
        };
        let Some(name) = head.strip_prefix("kernel ") else {
            return Err(error(first, format!("expected `kernel NAME`, found `{head}`")));
        };
        let mut ir = KernelIr { name: name.trim().to_string(), inputs: vec![], values: vec![], outputs: vec![] };
        for (line, text) in lines.by_ref() {
            let (code, comment) = match text.split_once('#') {
                Some((code, comment)) => (code, Some(comment.trim().to_string())),
                None => (text, None),
            };
            let words: Vec<&str> = code.split_whitespace().collect();
            match words.as_slice() {
                [] => {}
                ["end"] => return Ok(ir),
                ["in", role, len] => {
                    let role = find(INPUTS, role).ok_or_else(|| error(line, format!("unknown input `{role}`")))?;
                    let len = len.parse().map_err(|_| error(line, format!("`{len}` is not a length")))?;
                    ir.inputs.push((role, len));
                }
                ["out", role, ids @ ..] => {
                    let role = find(OUTPUTS, role).ok_or_else(|| error(line, format!("unknown output `{role}`")))?;
                    let ids = ids.iter().map(|w| value_id(w, line)).collect::<Result<_, _>>()?;
                    ir.outputs.push((role, ids));
                }
                [id, "=", rest @ ..] => {
                    if value_id(id, line)?.index() != ir.values.len() {
                        return Err(error(line, format!("expected v{} here, found {id}", ir.values.len())));
                    }
                    ir.values.push(Definition { op: parse_op(rest, line)?, name: comment });
                }
                _ => return Err(error(line, format!("cannot read `{code}`"))),
            }
        }
        Err(error(first, format!("kernel `{}` has no `end`", ir.name)))
    }
}

fn find<R: Copy>(table: &[(R, &str)], name: &str) -> Option<R> {
    table.iter().find(|(_, n)| *n == name).map(|(r, _)| *r)
}

fn value_id(word: &str, line: usize) -> Result<ValueId, IrTextError> {
    word.strip_prefix('v')
        .and_then(|digits| digits.parse().ok())
        .map(ValueId)
        .ok_or_else(|| IrTextError { line, reason: format!("`{word}` is not a value") })
}

fn parse_op(words: &[&str], line: usize) -> Result<Op, IrTextError> {
    let error = |reason: String| IrTextError { line, reason };
    let Some((&head, rest)) = words.split_first() else {
        return Err(error("an operation is missing".into()));
    };
    match (head, rest) {
        ("input", [role, k]) => {
            let role = find(INPUTS, role).ok_or_else(|| error(format!("unknown input `{role}`")))?;
            return Ok(Op::Input(role, k.parse().map_err(|_| error(format!("`{k}` is not a component")))?));
        }
        ("const", [q]) => {
            let (n, d) = q.split_once('/').unwrap_or((q, "1"));
            let part = |t: &str| t.parse::<i128>().map_err(|_| error(format!("`{q}` is not a rational number")));
            let (n, d) = (part(n)?, part(d)?);
            if d == 0 || n == i128::MIN || d == i128::MIN {
                return Err(error(format!("`{q}` is not a rational number")));
            }
            return Ok(Op::Const(Rational::new(n, d)));
        }
        _ => {}
    }
    let v: Vec<ValueId> = rest.iter().map(|w| value_id(w, line)).collect::<Result<_, _>>()?;
    Ok(match (head, v.as_slice()) {
        ("add", &[a, b]) => Op::Add(a, b),
        ("sub", &[a, b]) => Op::Sub(a, b),
        ("mul", &[a, b]) => Op::Mul(a, b),
        ("div", &[a, b]) => Op::Div(a, b),
        ("neg", &[a]) => Op::Neg(a),
        ("fma", &[a, b, c]) => Op::Fma(a, b, c),
        ("sqrt", &[a]) => Op::Sqrt(a),
        ("ln", &[a]) => Op::Ln(a),
        ("exp", &[a]) => Op::Exp(a),
        ("log1p", &[a]) => Op::Log1p(a),
        ("expm1", &[a]) => Op::Expm1(a),
        ("log1pmx", &[a]) => Op::Log1pmx(a),
        ("expm1mx", &[a]) => Op::Expm1mx(a),
        ("powf", &[a, b]) => Op::Powf(a, b),
        ("select", &[a, b, c, d]) => Op::Select(a, b, c, d),
        _ => return Err(error(format!("unknown operation `{head}` with {} operands", v.len()))),
    })
}

//! A validated kernel as a WGSL function: arrays in by value, an array, a number or a structure out.

use super::helpers::Helper;
use super::words;
use crate::derivation::PointKernel;
use crate::ir::{Input, Number, Op, Output, Rational, ValidKernel, ValueId};
use crate::print::naming::{self, ValueName, letter};

/// The function of a kernel at a point: of two forms, the one that counts.
pub fn point_function(kernel: &PointKernel) -> String {
    let Some(far) = kernel.far else { return function(kernel.near, kernel.name()) };
    let (name, near_name) = (kernel.name(), format!("{}_near", kernel.name()));
    let forms = format!("{}{}", function(kernel.near, &near_name), function(far, &far.ir().name));
    let (mut arguments, mut values, mut far_values) = (vec![], vec![], vec![]);
    for (role, len) in point_inputs(kernel) {
        let letter = letter(role);
        arguments.push(format!("{letter}: array<f32, {len}>"));
        if kernel.near.reads(role) {
            values.push(letter);
        }
        if far.reads(role) {
            far_values.push(letter);
        }
    }
    let outputs: Vec<_> = kernel.outputs().map(|(role, ids)| (*role, ids.len())).collect();
    let (structure, result) = result_type(name, &outputs);
    let fields = |value: &str| outputs.iter().map(|(role, _)| format!("{value}.{}", field(*role))).collect::<Vec<_>>();
    let (near, other) = match outputs.len() {
        1 => (fields("near").concat(), "far".to_string()),
        _ => (format!("{result}({})", fields("near").join(", ")), format!("{result}({})", fields("far").join(", "))),
    };
    let docs = super::comment(&naming::point_docs(kernel));
    format!(
        "{forms}\n{structure}{docs}fn {name}({}) -> {result} {{\n    let near = {near_name}({});\n    if near.near > 0.0f {{\n        \
         return {near};\n    }}\n    let far = {}({});\n    return {other};\n}}\n",
        arguments.join(", "),
        values.join(", "),
        far.ir().name,
        far_values.join(", ")
    )
}

/// The type of a function's result, and the structure that it is where it has several parts.
fn result_type(name: &str, outputs: &[(Output, usize)]) -> (String, String) {
    match outputs {
        [(role, len)] => (String::new(), kind(*role, *len)),
        several => {
            let name = format!("{name}_result");
            let fields = several.iter().map(|(role, len)| format!("    {}: {},\n", field(*role), kind(*role, *len)));
            (format!("struct {name} {{\n{}}}\n\n", fields.collect::<String>()), name)
        }
    }
}

/// The function of a kernel under a name, with the structure that it returns if it has several outputs. Only inputs that the kernel
/// reads are arguments, in the kernel's order.
pub fn function(kernel: &ValidKernel, name: &str) -> String {
    let ir = kernel.ir();
    let arguments: Vec<String> = read_inputs(kernel)
        .map(|(role, len)| match role {
            Input::Weight => format!("{}: f32", letter(role)),
            _ => format!("{}: array<f32, {len}>", letter(role)),
        })
        .collect();
    let names = names(kernel);
    let mut body = String::new();
    for (i, d) in ir.values.iter().enumerate() {
        if let Some(value) = expression(d.op, &names) {
            body += &format!("    let {} = {value};\n", names[i]);
        }
    }
    let outputs: Vec<(Output, Vec<&str>)> =
        ir.outputs.iter().map(|(role, ids)| (*role, ids.iter().map(|v| names[v.index()].as_str()).collect())).collect();
    let lengths: Vec<_> = outputs.iter().map(|(role, values)| (*role, values.len())).collect();
    let (structure, result) = result_type(name, &lengths);
    let value = match outputs.as_slice() {
        [(role, values)] => value(*role, values, "    "),
        several => {
            let values = several.iter().map(|(role, v)| format!("        {},\n", value(*role, v, "        ")));
            format!("{result}(\n{}    )", values.collect::<String>())
        }
    };
    let docs = super::comment(&naming::kernel_docs(kernel));
    format!("\n{structure}{docs}fn {name}({}) -> {result} {{\n{body}    return {value};\n}}\n", arguments.join(", "))
}

/// The field of a kernel's result that holds an output, where it has several.
pub fn field(role: Output) -> &'static str {
    match role {
        Output::Constants => "c",
        Output::EnergyDensity => "w",
        Output::Stress => "p",
        Output::StressIncrement => "dp",
        Output::State => "state",
        Output::Diagonal => "d",
        Output::Cauchy => "sigma",
        Output::DissipationDensity => "d",
        Output::DomainMargin => "margin",
        Output::NearRest => "near",
        Output::DisplacementGradient => "g",
        Output::NodalForce => "f",
        Output::NodeGradients => "n",
    }
}

/// The inputs that a kernel reads, with their lengths.
pub fn read_inputs(kernel: &ValidKernel) -> impl Iterator<Item = (Input, u32)> {
    kernel.ir().inputs.iter().copied().filter(|&(role, _)| kernel.reads(role))
}

/// The inputs that a kernel's forms read, with their lengths.
pub fn point_inputs<'a>(kernel: &PointKernel<'a>) -> impl Iterator<Item = (Input, u32)> + use<'a> {
    let kernel = *kernel;
    kernel.near.ir().inputs.iter().copied().filter(move |&(role, _)| kernel.reads(role))
}

/// The helpers that a kernel's forms call.
pub fn point_helpers(kernel: &PointKernel) -> Vec<Helper> {
    helpers(kernel.near).chain(kernel.far.into_iter().flat_map(helpers)).collect()
}

/// An array's constructor, three values a line if it is long.
pub fn array(values: &[impl AsRef<str>], indent: &str) -> String {
    let n = values.len();
    let line = |values: &[_]| values.iter().map(AsRef::as_ref).collect::<Vec<&str>>().join(", ");
    if n <= 3 {
        return format!("array<f32, {n}>({})", line(values));
    }
    let lines: String = values.chunks(3).map(|row| format!("{indent}    {},\n", line(row))).collect();
    format!("array<f32, {n}>(\n{lines}{indent})")
}

/// The helpers that a kernel calls.
pub fn helpers(kernel: &ValidKernel) -> impl Iterator<Item = Helper> {
    kernel.ir().values.iter().filter_map(|d| match d.op {
        Op::Ln(_) => Some(Helper::Ln),
        Op::Exp(_) => Some(Helper::Exp),
        Op::Log1p(_) => Some(Helper::Log1p),
        Op::Expm1(_) => Some(Helper::Expm1),
        Op::Log1pmx(_) => Some(Helper::Log1pmx),
        Op::Expm1mx(_) => Some(Helper::Expm1mx),
        Op::Powf(..) => Some(Helper::Powf),
        Op::Input(..) | Op::Const(_) | Op::Add(..) | Op::Sub(..) | Op::Mul(..) | Op::Div(..) => None,
        Op::Neg(_) | Op::Fma(..) | Op::Sqrt(_) | Op::Select(..) => None,
    })
}

fn is_number(role: Output) -> bool {
    match role {
        Output::EnergyDensity | Output::DissipationDensity | Output::DomainMargin | Output::NearRest => true,
        Output::Constants | Output::Stress | Output::StressIncrement | Output::Diagonal | Output::Cauchy => false,
        Output::State | Output::DisplacementGradient | Output::NodalForce | Output::NodeGradients => false,
    }
}

fn kind(role: Output, len: usize) -> String {
    if is_number(role) { "f32".to_string() } else { format!("array<f32, {len}>") }
}

fn value(role: Output, values: &[&str], indent: &str) -> String {
    if is_number(role) { values.join(", ") } else { array(values, indent) }
}

/// What each value is written as where it is used: its name, a component of an input, or a constant in place.
fn names(kernel: &ValidKernel) -> Vec<String> {
    let names = naming::value_names(kernel, words::is_free);
    let text = |(name, op): (ValueName, Op)| match (name, op) {
        (_, Op::Const(q)) => number(q),
        (ValueName::Input(Input::Weight, _), _) => letter(Input::Weight).to_string(),
        (ValueName::Input(role, k), _) => format!("{}[{k}]", letter(role)),
        (ValueName::Local(name), _) => name,
    };
    names.into_iter().zip(kernel.ir().values.iter().map(|d| d.op)).map(text).collect()
}

/// The f32 that the CPU kernels use for a constant. Beyond the largest f32, that one: WGSL cannot write infinity.
fn number(q: Rational) -> String {
    let x = (<f64 as Number>::from_rational(q) as f32).clamp(f32::MIN, f32::MAX);
    if x < 0.0 { format!("({x:?}f)") } else { format!("{x:?}f") }
}

/// The right side of a definition; none where the value is written in place.
fn expression(op: Op, names: &[String]) -> Option<String> {
    let at = |v: ValueId| names[v.index()].as_str();
    Some(match op {
        Op::Input(..) | Op::Const(_) => return None,
        Op::Add(a, b) => format!("{} + {}", at(a), at(b)),
        Op::Sub(a, b) => format!("{} - {}", at(a), at(b)),
        Op::Mul(a, b) => format!("{} * {}", at(a), at(b)),
        Op::Div(a, b) => format!("{} / {}", at(a), at(b)),
        Op::Neg(a) => format!("-{}", at(a)),
        Op::Fma(a, b, c) => format!("fma({}, {}, {})", at(a), at(b), at(c)),
        Op::Sqrt(a) => format!("sqrt({})", at(a)),
        Op::Ln(a) => format!("ln_({})", at(a)),
        Op::Exp(a) => format!("exp_({})", at(a)),
        Op::Log1p(a) => format!("log1p_({})", at(a)),
        Op::Expm1(a) => format!("expm1_({})", at(a)),
        Op::Log1pmx(a) => format!("log1pmx_({})", at(a)),
        Op::Expm1mx(a) => format!("expm1mx_({})", at(a)),
        Op::Powf(a, b) => format!("powf_({}, {})", at(a), at(b)),
        Op::Select(l, r, a, b) => format!("select({}, {}, {} > {})", at(b), at(a), at(l), at(r)),
    })
}

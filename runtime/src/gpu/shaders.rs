//! The arithmetic of vectors as WGSL: one module an operation, put together from a body and a frame.
//!
//! Vectors are `array<vec4<f32>>`: three components, and in the fourth the node's constraint mask (bits 1, 2, 4 for x,
//! y, z), which every operation keeps. Nothing here depends on a law or an element; those texts are generated.

use crate::backend::{ALPHA, BETA, RUNNING};

const PRELUDE: &str = include_str!("wgsl/prelude.wgsl");
const EACH: &str = include_str!("wgsl/each.wgsl");
const REDUCE: &str = include_str!("wgsl/reduce.wgsl");
const FINISH: &str = include_str!("wgsl/finish.wgsl");

/// An operation on vectors or partial sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Operation {
    /// y = x: x, y.
    Copy,
    /// y += a x: x, y.
    Axpy,
    /// y = x + a y: x, y.
    Xpby,
    /// y = a y: y.
    Scale,
    /// y += a d x: d, x, y.
    MultiplyAdd,
    /// y += a M x, or y = a M x where k is not 0, unless a solver has stopped: offsets, columns, values, x, y, gate.
    Product,
    /// y = x / d: x, d, y.
    Divide,
    /// Constrained components = 0: y.
    Project,
    /// What is held of nodes = 0: held, y.
    ProjectHeld,
    /// The components of held nodes become the greatest of them: held, y.
    EvenOut,
    /// Components that are not positive become their magnitude, 0 becomes 1: y.
    MakePositive,
    /// Constrained components = values: constrained, values, y.
    Impose,
    /// Constrained components of y = values - x: constrained, values, x, y.
    ImposeChange,
    /// Partial sums of x . y: x, y, partials.
    Dot,
    /// Partial maxima of |x|, the largest f32 for what is not finite: x, partials.
    MaxAbs,
    /// Numbers of elements whose margin is not positive: margins, partials.
    Outside,
    /// registers\[k\] = the sum of partial sums: partials, registers.
    Sum,
    /// A descent of a conjugate gradient: registers, d, q, preconditioner, x, r, z, partials.
    Descend,
    /// d = z + beta d: registers, z, d.
    Turn,
    /// v = keep v + a f / m, u += drift v: force, masses, v, u. The numbers k and base are the bits of keep and drift.
    Advance,
}

/// All operations.
pub(super) const OPERATIONS: [Operation; 20] = [
    Operation::Copy,
    Operation::Axpy,
    Operation::Xpby,
    Operation::Scale,
    Operation::MultiplyAdd,
    Operation::Product,
    Operation::Divide,
    Operation::Project,
    Operation::ProjectHeld,
    Operation::EvenOut,
    Operation::MakePositive,
    Operation::Impose,
    Operation::ImposeChange,
    Operation::Dot,
    Operation::MaxAbs,
    Operation::Outside,
    Operation::Sum,
    Operation::Descend,
    Operation::Turn,
    Operation::Advance,
];

/// How a kernel binds a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Access {
    /// A uniform with an offset given at each dispatch.
    Uniform,
    /// Storage that is read.
    Read,
    /// Storage that is written, and perhaps read.
    Write,
}

use Access::{Read, Write};

/// A storage buffer of an operation: name, element type, access.
pub(super) type Argument = (&'static str, &'static str, Access);

pub(super) const fn vector(name: &'static str, access: Access) -> Argument {
    (name, "vec4<f32>", access)
}

const PARTIALS: Argument = ("partials", "f32", Write);
const VALUES: Argument = ("values", "f32", Read);
/// A matrix in compressed rows.
const OFFSETS: Argument = ("offsets", "u32", Read);
const COLUMNS: Argument = ("columns", "u32", Read);
const ENTRIES: Argument = ("entries", "f32", Read);
/// A constrained node, and the motions that its three components follow.
const CONSTRAINED: Argument = ("constrained", "vec4<u32>", Read);

/// A held node: the bits of its normal, which is 0 where it sticks, and its place.
const HELD: Argument = ("held", "vec4<u32>", Read);

/// The terms of sums and maxima that nothing stops.
const ALWAYS: &str = "fn stopped() -> bool {\n    return false;\n}\n";
const SUM_JOINS: &str = "fn joined(a: f32, b: f32) -> f32 {\n    return a + b;\n}\n";
const MAX_JOINS: &str = "fn joined(a: f32, b: f32) -> f32 {\n    return max(a, b);\n}\n";
/// The value of a component that follows a motion, the old one for others.
const FOLLOWS: &str = "
fn follows(motion: u32, old: f32, base: f32) -> f32 {
    if motion == 0xffffffffu {
        return old;
    }
    return values[numbers.k + motion] - base;
}
";

impl Operation {
    /// What it binds after the uniform.
    pub(super) fn arguments(self) -> Vec<Argument> {
        let (x, y) = (vector("x", Read), vector("y", Write));
        let (d, registers) = (vector("d", Read), ("registers", "f32", Read));
        match self {
            Self::Copy | Self::Axpy | Self::Xpby => vec![x, y],
            Self::Scale | Self::Project | Self::MakePositive => vec![y],
            Self::ProjectHeld | Self::EvenOut => vec![HELD, y],
            Self::MultiplyAdd => vec![d, x, y],
            Self::Product => vec![OFFSETS, COLUMNS, ENTRIES, x, y, ("gate", "f32", Read)],
            Self::Divide => vec![x, d, y],
            Self::Impose => vec![CONSTRAINED, VALUES, y],
            Self::ImposeChange => vec![CONSTRAINED, VALUES, x, y],
            Self::Dot => vec![x, vector("y", Read), PARTIALS],
            Self::MaxAbs => vec![x, PARTIALS],
            Self::Outside => vec![("margins", "f32", Read), PARTIALS],
            Self::Sum => vec![("partials", "f32", Read), ("registers", "f32", Write)],
            Self::Descend => {
                let (q, preconditioner) = (vector("q", Read), vector("preconditioner", Read));
                let (x, r, z) = (vector("x", Write), vector("r", Write), vector("z", Write));
                vec![registers, d, q, preconditioner, x, r, z, PARTIALS]
            }
            Self::Turn => vec![registers, vector("z", Read), vector("d", Write)],
            Self::Advance => {
                vec![vector("force", Read), vector("masses", Read), vector("v", Write), vector("u", Write)]
            }
        }
    }

    /// The module.
    pub(super) fn text(self) -> String {
        let mut text = format!("// {self:?}.\n{PRELUDE}{}\n", declarations(1, &self.arguments()));
        // y = an expression in the old y.
        let update = |value: &str| {
            format!("fn each(i: u32) {{\n    let old = y[i];\n    y[i] = vec4<f32>({value}, old.w);\n}}\n{EACH}")
        };
        text += &match self {
            Self::Copy => format!("fn each(i: u32) {{\n    y[i] = x[i];\n}}\n{EACH}"),
            Self::Axpy => update("old.xyz + numbers.a * x[i].xyz"),
            Self::Xpby => update("x[i].xyz + numbers.a * old.xyz"),
            Self::Scale => update("numbers.a * old.xyz"),
            Self::MultiplyAdd => update("old.xyz + numbers.a * (d[i].xyz * x[i].xyz)"),
            Self::Product => format!(
                "fn each(i: u32) {{
    if gate[{RUNNING}] == 0.0f {{
        return;
    }}
    var sum = vec3<f32>(0.0f);
    let end = offsets[i + 1u];
    for (var k = offsets[i]; k < end; k++) {{
        sum += entries[k] * x[columns[k]].xyz;
    }}
    let old = y[i];
    let start = select(old.xyz, vec3<f32>(0.0f), numbers.k != 0u);
    y[i] = vec4<f32>(start + numbers.a * sum, old.w);
}}
{EACH}"
            ),
            Self::Divide => update("x[i].xyz / d[i].xyz"),
            Self::Project => update(
                "select(old.xyz, vec3<f32>(0.0f), (vec3<u32>(u32(old.w)) & vec3<u32>(1u, 2u, 4u)) != vec3<u32>(0u))",
            ),
            Self::ProjectHeld => format!(
                "fn each(i: u32) {{
    let normal = bitcast<vec3<f32>>(held[i].xyz);
    let old = y[held[i].w];
    let kept = select(vec3<f32>(0.0f), old.xyz - dot(normal, old.xyz) * normal, any(normal != vec3<f32>(0.0f)));
    y[held[i].w] = vec4<f32>(kept, old.w);
}}
{EACH}"
            ),
            Self::EvenOut => format!(
                "fn each(i: u32) {{
    let old = y[held[i].w];
    y[held[i].w] = vec4<f32>(vec3<f32>(max(max(old.x, old.y), old.z)), old.w);
}}
{EACH}"
            ),
            Self::MakePositive => update("select(vec3<f32>(1.0f), abs(old.xyz), abs(old.xyz) > vec3<f32>(0.0f))"),
            Self::Impose => format!(
                "{FOLLOWS}
fn each(i: u32) {{
    let c = constrained[i];
    let old = y[c.x];
    y[c.x] = vec4<f32>(follows(c.y, old.x, 0.0f), follows(c.z, old.y, 0.0f), follows(c.w, old.z, 0.0f), old.w);
}}
{EACH}"
            ),
            Self::ImposeChange => format!(
                "{FOLLOWS}
fn each(i: u32) {{
    let c = constrained[i];
    let old = y[c.x];
    let u = x[c.x];
    y[c.x] = vec4<f32>(follows(c.y, old.x, u.x), follows(c.z, old.y, u.y), follows(c.w, old.z, u.z), old.w);
}}
{EACH}"
            ),
            Self::Dot => {
                format!(
                    "fn term(i: u32) -> f32 {{\n    return dot(x[i].xyz, y[i].xyz);\n}}\n{ALWAYS}{SUM_JOINS}{REDUCE}"
                )
            }
            // Integers order the magnitudes of floats as they are, and what is not finite above: no test for NaN.
            Self::MaxAbs => format!(
                "fn term(i: u32) -> f32 {{
    let bits = bitcast<vec3<u32>>(x[i].xyz) & vec3<u32>(0x7fffffffu);
    return bitcast<f32>(min(max(max(bits.x, bits.y), bits.z), 0x7f7fffffu));
}}
{ALWAYS}{MAX_JOINS}{REDUCE}"
            ),
            Self::Outside => format!(
                "fn term(i: u32) -> f32 {{
    return select(1.0f, 0.0f, margins[i] > 0.0f);
}}
{ALWAYS}{SUM_JOINS}{REDUCE}"
            ),
            Self::Sum => format!("fn finish(sum: f32) {{\n    registers[numbers.k] = sum;\n}}\n{FINISH}"),
            Self::Descend => format!(
                "fn stopped() -> bool {{
    return registers[{RUNNING}] == 0.0f;
}}
fn term(i: u32) -> f32 {{
    let alpha = registers[{ALPHA}];
    let old = x[i];
    x[i] = vec4<f32>(old.xyz + alpha * d[i].xyz, old.w);
    let residual = r[i].xyz - alpha * q[i].xyz;
    r[i] = vec4<f32>(residual, old.w);
    let scaled = residual / preconditioner[i].xyz;
    z[i] = vec4<f32>(scaled, old.w);
    return dot(residual, scaled);
}}
{SUM_JOINS}{REDUCE}"
            ),
            Self::Advance => format!(
                "fn each(i: u32) {{
    let old = v[i];
    let velocity = bitcast<f32>(numbers.k) * old.xyz + numbers.a * (force[i].xyz / masses[i].xyz);
    v[i] = vec4<f32>(velocity, old.w);
    let place = u[i];
    u[i] = vec4<f32>(place.xyz + bitcast<f32>(numbers.base) * velocity, place.w);
}}
{EACH}"
            ),
            Self::Turn => format!(
                "fn each(i: u32) {{
    if registers[{RUNNING}] == 0.0f {{
        return;
    }}
    let old = d[i];
    d[i] = vec4<f32>(z[i].xyz + registers[{BETA}] * old.xyz, old.w);
}}
{EACH}"
            ),
        };
        text
    }
}

/// What a module does with its functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Frame {
    /// `each(i)`, for each thing.
    Each,
    /// Partial maxima of `term(i)`, at least 0.
    Greatest,
}

/// A module of these functions.
pub(super) fn module(title: &str, arguments: &[Argument], functions: &str, frame: Frame) -> String {
    let declarations = declarations(1, arguments);
    let frame = match frame {
        Frame::Each => EACH.to_string(),
        Frame::Greatest => format!("{ALWAYS}{MAX_JOINS}{REDUCE}"),
    };
    format!("// {title}\n{PRELUDE}{declarations}\n{functions}{frame}")
}

/// The declarations of storage buffers from this binding on.
pub(super) fn declarations(first: usize, arguments: &[Argument]) -> String {
    let line = |(k, (name, of, access)): (usize, &Argument)| {
        let access = if *access == Write { "read_write" } else { "read" };
        format!("@group(0) @binding({}) var<storage, {access}> {name}: array<{of}>;\n", first + k)
    };
    arguments.iter().enumerate().map(line).collect()
}

/// A module that reduces partial sums, if the update wants a sum, and then changes the registers.
pub(super) fn update_text(sums: bool, statements: &str) -> String {
    let arguments = update_arguments(sums);
    let body = format!("fn change(sum: f32) {{\n{statements}}}\n");
    let frame = if sums {
        format!("fn finish(sum: f32) {{\n    change(sum);\n}}\n{FINISH}")
    } else {
        "\n@compute @workgroup_size(1)\nfn main() {\n    change(0.0f);\n}\n".to_string()
    };
    format!("// Recurrences of a solver.\n{PRELUDE}{}\n{body}{frame}", declarations(1, &arguments))
}

/// What an update binds after the uniform.
pub(super) fn update_arguments(sums: bool) -> Vec<Argument> {
    let registers = ("registers", "f32", Write);
    if sums { vec![("partials", "f32", Read), registers] } else { vec![registers] }
}

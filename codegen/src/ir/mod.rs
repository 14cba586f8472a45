//! `KernelIr`: the language between derivation and printed text. This page is its specification.
//!
//! A kernel is a straight-line program in static single assignment form over real numbers. Value `i` is defined by
//! operation `i`; an operation refers to earlier values only. There is no control flow, no memory, no array and no
//! string but names and comments; the only conditional is [`Op::Select`], which evaluates both branches.
//!
//! | operation | meaning |
//! |---|---|
//! | `Input(role, k)` | component k of the input array with that role |
//! | `Const(q)` | the exact rational q, rounded to the working type when printed or interpreted |
//! | `Add Sub Mul Div Neg` | IEEE arithmetic of the working type |
//! | `Fma(a, b, c)` | a b + c rounded once: explicit, because Rust never contracts `a * b + c` |
//! | `Sqrt Ln Exp Log1p Expm1` | the function of that name in the working type |
//! | `Log1pmx(a)` | a - ln(1 + a), the remainder of the logarithm, accurate for small a |
//! | `Expm1mx(a)` | exp(a) - 1 - a, the remainder of the exponential, accurate for small a |
//! | `Powf(a, b)` | a to the power b, for a > 0 |
//! | `Select(l, r, a, b)` | a where l > r, b elsewhere (also where a comparison with NaN is false) |
//!
//! Inputs and outputs are typed by role ([`Input`], [`Output`]); a role fixes the length of its array, except for the
//! material's constants, whose number the law decides. Tensors are stored row by row: component 3 i + j is row i,
//! column j.
//!
//! **Determinism.** Equal values are one value (hash-consing by [`Builder`]), in the order of first use from the
//! outputs; the same derivation gives the same text on every machine.
//!
//! **Not supported:** loops, calls, integers, reductions across elements, side effects, and any type but the one real
//! type of a kernel. Printers accept only [`ValidKernel`], which [`KernelIr::validate`] alone makes.
//!
//! **Two forms.** A kernel with the output [`Output::NearRest`] holds where that is positive; elsewhere the kernel
//! `NAME_far` of the same derivation counts (see [`crate::derivation::PointKernel`]).

mod build;
mod count;
mod cut;
mod interpret;
mod text;
mod validate;

pub use crate::remainder::Remainder;
pub use crate::twofold::Twofold;
pub use build::Builder;
pub use count::OperationCount;
pub use cut::Cut;
pub use interpret::{InterpretError, Number};
pub use text::IrTextError;
pub use validate::{InvalidKernel, ValidKernel};

pub use crate::law::ast::Rational;

/// Index of a value in its kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ValueId(pub u32);

impl ValueId {
    /// The index as a `usize`.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What an input array is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Input {
    /// The law's parameters as the scene gives them (SI units of the law file).
    Parameters,
    /// The material's constants: expressions in the parameters alone, computed once a material.
    Constants,
    /// G = grad u, 9 components.
    DisplacementGradient,
    /// dG/dt, the rate of the displacement gradient, 9 components.
    GradientRate,
    /// dG, the direction of a differential (by G, or by its rate), 9 components.
    GradientIncrement,
    /// What a linearisation has stored of the state; see [`Cut`].
    State,
    /// g, the gradient of one node's interpolation function, 3 components (1/m).
    NodeGradient,
    /// The nodal displacements of an element, 3 a node.
    NodalDisplacement,
    /// The gradients of the interpolation functions at rest, 3 a node but the first, whose gradient is minus their sum.
    ShapeGradients,
    /// The derivatives of the interpolation functions by the reference coordinates at a point, for each node but the first,
    /// whose are minus their sum.
    ReferenceGradients,
    /// J^-1 = dxi/dX at a point, row by row: component 3 a + k is dxi_a/dX_k (1/m), 9 components.
    InverseJacobian,
    /// The integration weight: rest volume times quadrature weight (m^3).
    Weight,
    /// P or dP, 9 components, to be contracted with the gradients.
    StressIn,
}

/// What an output array is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Output {
    /// The material's constants.
    Constants,
    /// W, the strain energy density.
    EnergyDensity,
    /// P = dW/dG, the first Piola-Kirchhoff stress, or that of damping, dD/d(dG/dt); 9 components.
    Stress,
    /// dP, the differential of P in the direction dG, 9 components.
    StressIncrement,
    /// What [`Input::State`] reads.
    State,
    /// g . (d2W/dG_i.dG_i.) . g for the displacement components i: one node's diagonal of the tangent, 3 components.
    Diagonal,
    /// The Cauchy stress P F' / J, 9 components.
    Cauchy,
    /// D, the dissipation density (W/m^3 for parameters in Pa and s).
    DissipationDensity,
    /// Positive inside the law's domain: left side minus right side of the domain's inequality.
    DomainMargin,
    /// Positive where the kernel's form, split at the state of rest, serves.
    NearRest,
    /// G, 9 components.
    DisplacementGradient,
    /// The element's nodal forces, 3 a node.
    NodalForce,
    /// The gradients of all the interpolation functions, 3 a node.
    NodeGradients,
}

/// An operation; see the table of the module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)] // the table of the module documents every variant
pub enum Op {
    Input(Input, u32),
    Const(Rational),
    Add(ValueId, ValueId),
    Sub(ValueId, ValueId),
    Mul(ValueId, ValueId),
    Div(ValueId, ValueId),
    Neg(ValueId),
    Fma(ValueId, ValueId, ValueId),
    Sqrt(ValueId),
    Ln(ValueId),
    Exp(ValueId),
    Log1p(ValueId),
    Expm1(ValueId),
    Log1pmx(ValueId),
    Expm1mx(ValueId),
    Powf(ValueId, ValueId),
    Select(ValueId, ValueId, ValueId, ValueId),
}

impl Op {
    /// The values that the operation reads, in order.
    pub fn operands(&self) -> Vec<ValueId> {
        match *self {
            Op::Input(..) | Op::Const(_) => vec![],
            Op::Neg(a) | Op::Sqrt(a) | Op::Ln(a) | Op::Exp(a) | Op::Log1p(a) | Op::Expm1(a) => vec![a],
            Op::Log1pmx(a) | Op::Expm1mx(a) => vec![a],
            Op::Add(a, b) | Op::Sub(a, b) | Op::Mul(a, b) | Op::Div(a, b) | Op::Powf(a, b) => vec![a, b],
            Op::Fma(a, b, c) => vec![a, b, c],
            Op::Select(a, b, c, d) => vec![a, b, c, d],
        }
    }

    /// The same operation with every operand replaced.
    pub fn map(&self, f: impl Fn(ValueId) -> ValueId) -> Op {
        match *self {
            Op::Input(..) | Op::Const(_) => *self,
            Op::Add(a, b) => Op::Add(f(a), f(b)),
            Op::Sub(a, b) => Op::Sub(f(a), f(b)),
            Op::Mul(a, b) => Op::Mul(f(a), f(b)),
            Op::Div(a, b) => Op::Div(f(a), f(b)),
            Op::Neg(a) => Op::Neg(f(a)),
            Op::Fma(a, b, c) => Op::Fma(f(a), f(b), f(c)),
            Op::Sqrt(a) => Op::Sqrt(f(a)),
            Op::Ln(a) => Op::Ln(f(a)),
            Op::Exp(a) => Op::Exp(f(a)),
            Op::Log1p(a) => Op::Log1p(f(a)),
            Op::Expm1(a) => Op::Expm1(f(a)),
            Op::Log1pmx(a) => Op::Log1pmx(f(a)),
            Op::Expm1mx(a) => Op::Expm1mx(f(a)),
            Op::Powf(a, b) => Op::Powf(f(a), f(b)),
            Op::Select(a, b, c, d) => Op::Select(f(a), f(b), f(c), f(d)),
        }
    }
}

/// A value with the name that the derivation gave it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// What computes the value.
    pub op: Op,
    /// A name for the reader (`J`, `S01`, `dw_J`); not necessarily unique.
    pub name: Option<String>,
}

/// A kernel that may still be wrong: only [`KernelIr::validate`] makes it printable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KernelIr {
    /// The kernel's name, a snake_case identifier: `force`, `dforce`, ...
    pub name: String,
    /// The length of each input array, by role.
    pub inputs: Vec<(Input, u32)>,
    /// The definitions, in order.
    pub values: Vec<Definition>,
    /// The output arrays, by role.
    pub outputs: Vec<(Output, Vec<ValueId>)>,
}

//! What is written once for CPUs and GPUs as WGSL: it runs once on numbers that write down what is done to them.

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Sub};

use crate::backend::{REGISTERS, SUM, Scalar, Update};

thread_local! {
    /// The statements of the update that is being traced on this thread, and how many values they define.
    static TRACE: RefCell<(String, usize)> = const { RefCell::new((String::new(), 0)) };
}

/// A value of the traced text.
#[derive(Clone, Copy)]
pub(super) struct Traced(usize);

/// Writes a statement down; the value that it defines.
pub(super) fn define(expression: &str) -> Traced {
    TRACE.with_borrow_mut(|(text, count)| {
        let value = Traced(*count);
        *text += &format!("    let v{count} = {expression};\n");
        *count += 1;
        value
    })
}

macro_rules! operator {
    ($trait:ident, $method:ident, $sign:literal) => {
        impl $trait for Traced {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                define(&format!(concat!("v{} ", $sign, " v{}"), self.0, other.0))
            }
        }
    };
}

operator!(Add, add, "+");
operator!(Sub, sub, "-");
operator!(Mul, mul, "*");
operator!(Div, div, "/");

impl Scalar for Traced {
    fn number(x: f64) -> Self {
        define(&format!("f32({:?}f)", x as f32))
    }

    fn select_greater(left: Self, right: Self, then: Self, otherwise: Self) -> Self {
        define(&format!("select(v{}, v{}, v{} > v{})", otherwise.0, then.0, left.0, right.0))
    }

    fn sqrt(self) -> Self {
        define(&format!("sqrt(v{})", self.0))
    }
}

impl std::fmt::Display for Traced {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "v{}", self.0)
    }
}

/// The components of a vector that a text names.
pub(super) fn components<const N: usize>(vector: &str) -> [Traced; N] {
    std::array::from_fn(|i| define(&format!("{vector}.{}", ["x", "y", "z", "w"][i])))
}

/// A vector of values.
pub(super) fn vector<const N: usize>(values: [Traced; N]) -> String {
    let values: Vec<String> = values.iter().map(Traced::to_string).collect();
    format!("vec{N}<f32>({})", values.join(", "))
}

/// A function: its head, the statements that `body` traces, and the expression that it gives.
pub(super) fn function(head: &str, body: impl FnOnce() -> String) -> String {
    TRACE.set((String::new(), 0));
    let result = body();
    let (statements, _) = TRACE.take();
    format!("{head} {{\n{statements}    return {result};\n}}\n")
}

/// The statements of an update on the storage array `registers`; the sum that it reads is in `sum`.
pub(super) fn statements<U: Update>() -> String {
    TRACE.set((String::new(), 0));
    let read = |k| define(&if U::SUMS && k == SUM { "sum".to_string() } else { format!("registers[{k}]") });
    let mut registers: [Traced; REGISTERS] = std::array::from_fn(read);
    let before = registers.map(|v| v.0);
    U::apply(&mut registers);
    let (mut text, _) = TRACE.take();
    for (k, (after, before)) in registers.iter().zip(before).enumerate() {
        if after.0 != before {
            text += &format!("    registers[{k}] = v{};\n", after.0);
        }
    }
    text
}

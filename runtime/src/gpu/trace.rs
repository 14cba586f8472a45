//! A solver's recurrences as WGSL: an update runs once on numbers that write down what is done to them.

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Sub};

use crate::backend::{REGISTERS, SUM, Scalar, Update};

thread_local! {
    /// The statements of the update that is being traced on this thread, and how many values they define.
    static TRACE: RefCell<(String, usize)> = const { RefCell::new((String::new(), 0)) };
}

/// A value of the traced text.
#[derive(Clone, Copy)]
struct Traced(usize);

/// Writes a statement down; the value that it defines.
fn define(expression: &str) -> Traced {
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

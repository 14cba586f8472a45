//! The reference meaning of a kernel: evaluates it value by value in any number type.

use super::{Input, Op, Rational, ValidKernel};
use crate::remainder;
use crate::twofold::Twofold;

/// A number type in which a kernel can be interpreted.
pub trait Number: Clone {
    /// The nearest number to an exact rational.
    fn from_rational(q: Rational) -> Self;
    /// a + b.
    fn add(&self, b: &Self) -> Self;
    /// a - b.
    fn sub(&self, b: &Self) -> Self;
    /// a b.
    fn mul(&self, b: &Self) -> Self;
    /// a / b.
    fn div(&self, b: &Self) -> Self;
    /// -a.
    fn neg(&self) -> Self;
    /// a b + c, rounded once where the type can.
    fn fma(&self, b: &Self, c: &Self) -> Self;
    /// Square root.
    fn sqrt(&self) -> Self;
    /// Natural logarithm.
    fn ln(&self) -> Self;
    /// Exponential.
    fn exp(&self) -> Self;
    /// ln(1 + a).
    fn log1p(&self) -> Self;
    /// exp(a) - 1.
    fn expm1(&self) -> Self;
    /// a - ln(1 + a).
    fn log1pmx(&self) -> Self;
    /// exp(a) - 1 - a.
    fn expm1mx(&self) -> Self;
    /// a to the power b.
    fn powf(&self, b: &Self) -> Self;
    /// Whether a > b.
    fn greater(&self, b: &Self) -> bool;
}

macro_rules! float_number {
    ($t:ty) => {
        impl Number for $t {
            fn from_rational(q: Rational) -> Self {
                // Numerator and denominator of a law's constants are far below 2^53 in practice; beyond, the quotient
                // of the two rounded integers is within one and a half units in the last place.
                (*q.numer() as f64 / *q.denom() as f64) as $t
            }
            fn add(&self, b: &Self) -> Self {
                self + b
            }
            fn sub(&self, b: &Self) -> Self {
                self - b
            }
            fn mul(&self, b: &Self) -> Self {
                self * b
            }
            fn div(&self, b: &Self) -> Self {
                self / b
            }
            fn neg(&self) -> Self {
                -self
            }
            fn fma(&self, b: &Self, c: &Self) -> Self {
                <$t>::mul_add(*self, *b, *c)
            }
            fn sqrt(&self) -> Self {
                <$t>::sqrt(*self)
            }
            fn ln(&self) -> Self {
                <$t>::ln(*self)
            }
            fn exp(&self) -> Self {
                <$t>::exp(*self)
            }
            fn log1p(&self) -> Self {
                <$t>::ln_1p(*self)
            }
            fn expm1(&self) -> Self {
                <$t>::exp_m1(*self)
            }
            fn log1pmx(&self) -> Self {
                <$t as remainder::Remainder>::log1pmx(*self)
            }
            fn expm1mx(&self) -> Self {
                <$t as remainder::Remainder>::expm1mx(*self)
            }
            fn powf(&self, b: &Self) -> Self {
                <$t>::powf(*self, *b)
            }
            fn greater(&self, b: &Self) -> bool {
                self > b
            }
        }
    };
}
float_number!(f32);
float_number!(f64);

/// The type of the kernel `material`, as printed code computes it.
impl Number for Twofold {
    fn from_rational(q: Rational) -> Self {
        let (numerator, denominator) = (*q.numer() as f64, *q.denom() as f64);
        if q.is_integer() { numerator.into() } else { Self::from(numerator) / Self::from(denominator) }
    }
    fn add(&self, b: &Self) -> Self {
        *self + *b
    }
    fn sub(&self, b: &Self) -> Self {
        *self - *b
    }
    fn mul(&self, b: &Self) -> Self {
        *self * *b
    }
    fn div(&self, b: &Self) -> Self {
        *self / *b
    }
    fn neg(&self) -> Self {
        -*self
    }
    fn fma(&self, b: &Self, c: &Self) -> Self {
        *self * *b + *c
    }
    fn sqrt(&self) -> Self {
        Twofold::sqrt(*self)
    }
    fn ln(&self) -> Self {
        Twofold::ln(*self)
    }
    fn exp(&self) -> Self {
        Twofold::exp(*self)
    }
    fn log1p(&self) -> Self {
        Twofold::ln(Self::from(1.0) + *self)
    }
    fn expm1(&self) -> Self {
        Twofold::exp(*self) - Self::from(1.0)
    }
    fn log1pmx(&self) -> Self {
        *self - self.log1p()
    }
    fn expm1mx(&self) -> Self {
        self.expm1() - *self
    }
    fn powf(&self, b: &Self) -> Self {
        Twofold::powf(*self, *b)
    }
    fn greater(&self, b: &Self) -> bool {
        self > b
    }
}

/// The caller's inputs do not fit the kernel.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("kernel `{kernel}` needs {needed} components of {role:?}, and was given {given}")]
pub struct InterpretError {
    /// The kernel's name.
    pub kernel: String,
    /// The input.
    pub role: Input,
    /// Components that the kernel declares.
    pub needed: u32,
    /// Components given.
    pub given: usize,
}

impl ValidKernel {
    /// Evaluates the kernel: the outputs, array by array in the order of `ir().outputs`.
    ///
    /// # Errors
    /// An input array is missing or has the wrong length.
    pub fn interpret<T: Number>(&self, inputs: &[(Input, &[T])]) -> Result<Vec<Vec<T>>, InterpretError> {
        let v = self.values(inputs)?;
        let outputs = self.ir().outputs.iter();
        Ok(outputs.map(|(_, ids)| ids.iter().map(|id| v[id.index()].clone()).collect()).collect())
    }

    /// Evaluates every value of the kernel, in order.
    ///
    /// # Errors
    /// See [`ValidKernel::interpret`].
    pub fn values<T: Number>(&self, inputs: &[(Input, &[T])]) -> Result<Vec<T>, InterpretError> {
        let ir = self.ir();
        for &(role, needed) in &ir.inputs {
            let given = inputs.iter().find(|(r, _)| *r == role).map_or(0, |(_, a)| a.len());
            if given != needed as usize {
                return Err(InterpretError { kernel: ir.name.clone(), role, needed, given });
            }
        }
        let read = |role: Input, k: u32| {
            let array = inputs.iter().find(|(r, _)| *r == role).expect("checked above").1;
            array[k as usize].clone()
        };
        let mut v: Vec<T> = Vec::with_capacity(ir.values.len());
        for definition in &ir.values {
            let x = |id: super::ValueId| &v[id.index()];
            let value = match definition.op {
                Op::Input(role, k) => read(role, k),
                Op::Const(q) => T::from_rational(q),
                Op::Add(a, b) => x(a).add(x(b)),
                Op::Sub(a, b) => x(a).sub(x(b)),
                Op::Mul(a, b) => x(a).mul(x(b)),
                Op::Div(a, b) => x(a).div(x(b)),
                Op::Neg(a) => x(a).neg(),
                Op::Fma(a, b, c) => x(a).fma(x(b), x(c)),
                Op::Sqrt(a) => x(a).sqrt(),
                Op::Ln(a) => x(a).ln(),
                Op::Exp(a) => x(a).exp(),
                Op::Log1p(a) => x(a).log1p(),
                Op::Expm1(a) => x(a).expm1(),
                Op::Log1pmx(a) => x(a).log1pmx(),
                Op::Expm1mx(a) => x(a).expm1mx(),
                Op::Powf(a, b) => x(a).powf(x(b)),
                Op::Select(l, r, a, b) => if x(l).greater(x(r)) { x(a) } else { x(b) }.clone(),
            };
            v.push(value);
        }
        Ok(v)
    }
}

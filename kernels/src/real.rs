//! The number types that kernels run on.

use remainder::Remainder;
use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use twofold::Twofold;

/// A real number, or several side by side, as generated kernels use it.
///
/// Generated code calls nothing else, so that a type of lanes or of dual numbers can stand in for `f32` and `f64`.
pub trait Real:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The nearest value to a constant.
    fn from_f64(x: f64) -> Self;
    /// The value as `f64`; the first lane of several.
    fn to_f64(self) -> f64;
    /// a b + c, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// a b + c, rounded once where the machine does that as fast, and else twice.
    fn multiply_add(self, b: Self, c: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Exponential.
    fn exp(self) -> Self;
    /// ln(1 + x), accurate for small x.
    fn ln_1p(self) -> Self;
    /// exp(x) - 1, accurate for small x.
    fn exp_m1(self) -> Self;
    /// x - ln(1 + x), accurate for small x.
    fn log1pmx(self) -> Self;
    /// exp(x) - 1 - x, accurate for small x.
    fn expm1mx(self) -> Self;
    /// x to the power y, for x > 0.
    fn powf(self, y: Self) -> Self;
    /// `then` where left > right, `otherwise` elsewhere, lane by lane.
    fn select_greater(left: Self, right: Self, then: Self, otherwise: Self) -> Self;
    /// Whether every lane is > 0. NaN is not.
    fn is_positive(self) -> bool;
}

/// The text that the interpreter of kernels uses too: the same operations, bit for bit.
mod remainder {
    include!(concat!(env!("OUT_DIR"), "/remainder.rs"));
}

/// Likewise, for the constants of materials.
#[doc(hidden)]
pub mod twofold {
    include!(concat!(env!("OUT_DIR"), "/twofold.rs"));
}

macro_rules! float {
    ($t:ty) => {
        impl Real for $t {
            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                <$t>::mul_add(self, b, c)
            }
            #[inline(always)]
            fn multiply_add(self, b: Self, c: Self) -> Self {
                self * b + c
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn ln(self) -> Self {
                <$t>::ln(self)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                <$t>::exp(self)
            }
            #[inline(always)]
            fn ln_1p(self) -> Self {
                <$t>::ln_1p(self)
            }
            #[inline(always)]
            fn exp_m1(self) -> Self {
                <$t>::exp_m1(self)
            }
            #[inline(always)]
            fn log1pmx(self) -> Self {
                Remainder::log1pmx(self)
            }
            #[inline(always)]
            fn expm1mx(self) -> Self {
                Remainder::expm1mx(self)
            }
            #[inline(always)]
            fn powf(self, y: Self) -> Self {
                <$t>::powf(self, y)
            }
            #[inline(always)]
            fn select_greater(left: Self, right: Self, then: Self, otherwise: Self) -> Self {
                if left > right { then } else { otherwise }
            }
            #[inline(always)]
            fn is_positive(self) -> bool {
                self > 0.0
            }
        }
    };
}
float!(f32);
float!(f64);

/// Constants of materials are computed in it.
impl Real for Twofold {
    fn from_f64(x: f64) -> Self {
        x.into()
    }
    fn to_f64(self) -> f64 {
        Twofold::to_f64(self)
    }
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    fn multiply_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    fn sqrt(self) -> Self {
        Twofold::sqrt(self)
    }
    fn ln(self) -> Self {
        Twofold::ln(self)
    }
    fn exp(self) -> Self {
        Twofold::exp(self)
    }
    fn ln_1p(self) -> Self {
        (Self::from(1.0) + self).ln()
    }
    fn exp_m1(self) -> Self {
        self.exp() - Self::from(1.0)
    }
    fn log1pmx(self) -> Self {
        self - self.ln_1p()
    }
    fn expm1mx(self) -> Self {
        self.exp_m1() - self
    }
    fn powf(self, y: Self) -> Self {
        Twofold::powf(self, y)
    }
    fn select_greater(left: Self, right: Self, then: Self, otherwise: Self) -> Self {
        if left > right { then } else { otherwise }
    }
    fn is_positive(self) -> bool {
        Twofold::to_f64(self) > 0.0
    }
}

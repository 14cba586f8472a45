//! Powers of scalars: integer exponents, and real ones that do not depend on the strain.

use proc_macro2::Span;
use syn::Expr;
use syn::spanned::Spanned;

use super::expr::{Lowering, Scope};
use super::value::{IntegerType, ScalarValue, Value};

impl Lowering<'_> {
    /// `powi(base, power)`.
    pub(super) fn powi(&mut self, base: &Expr, power: &Expr, scope: &Scope) -> Value {
        let (value, n) = (self.scalar(base, scope), self.integer(power, IntegerType::I32, scope));
        self.integer_power(value, n, base.span(), power.span())
    }

    /// An integer power; `place` is that of the base, `span` that of the power.
    pub(super) fn integer_power(
        &mut self,
        base: Option<ScalarValue>,
        power: Option<i64>,
        place: Span,
        span: Span,
    ) -> Value {
        let Some((base, power)) = base.zip(power) else { return Value::Broken };
        match i32::try_from(power) {
            Ok(power) if power < 0 && base.is_zero() => self.broken(
                span,
                "division by zero: a negative power of zero",
                "change the base or the power: the energy would be infinite everywhere",
            ),
            Ok(power) => {
                if power < 0 {
                    self.divides(&base, place);
                }
                Value::Scalar(base.powi(power))
            }
            Err(_) => self.broken(span, format!("the power {power} is too large"), "a power is a 32-bit integer"),
        }
    }

    /// `powf(base, power)`.
    pub(super) fn powf(&mut self, base: &Expr, power: &Expr, scope: &Scope) -> Value {
        let (value, exponent) = (self.scalar(base, scope), self.scalar(power, scope));
        self.real_power(value, exponent, base.span(), power.span())
    }

    /// A real power.
    pub(super) fn real_power(
        &mut self,
        base: Option<ScalarValue>,
        power: Option<ScalarValue>,
        base_span: Span,
        power_span: Span,
    ) -> Value {
        let Some((base, power)) = base.zip(power) else { return Value::Broken };
        if power.facts.strain {
            let remedy = "write `exp(a * ln(x))` if that is meant";
            return self.broken(power_span, "the exponent of `powf` depends on the strain", remedy);
        }
        if base.is_non_positive() {
            return self.broken(base_span, "`powf` of a constant that is not positive", "give it a positive number");
        }
        self.pure("the exponent of `powf` is", power.facts.dimension, power_span);
        if power.constant.is_none() {
            self.pure("`powf` with a parameter as its exponent takes", base.facts.dimension, base_span);
        }
        self.positive("powf", &base, base_span);
        Value::Scalar(base.powf(&power))
    }
}

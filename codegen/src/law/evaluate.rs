//! The value of an expression in the parameters alone.

use crate::ir::Number;

use super::ast::{Rational, Scalar, ScalarNode};

/// The value at `parameters`, one list of components a parameter; `None` where the expression depends on the strain.
pub fn value<T: Number>(scalar: &Scalar, parameters: &[Vec<T>]) -> Option<T> {
    let of = |x: &Scalar| value(x, parameters);
    Some(match &**scalar {
        ScalarNode::Number(q) => T::from_rational(*q),
        ScalarNode::Parameter { parameter, component } => parameters.get(*parameter)?.get(*component)?.clone(),
        ScalarNode::Add(a, b) => of(a)?.add(&of(b)?),
        ScalarNode::Sub(a, b) => of(a)?.sub(&of(b)?),
        ScalarNode::Mul(a, b) => of(a)?.mul(&of(b)?),
        ScalarNode::Div(a, b) => of(a)?.div(&of(b)?),
        ScalarNode::Neg(a) => of(a)?.neg(),
        ScalarNode::Powi(a, n) => {
            let a = of(a)?;
            let one = T::from_rational(Rational::from_integer(1));
            let power = (0..n.unsigned_abs()).fold(one.clone(), |product, _| product.mul(&a));
            if *n < 0 { one.div(&power) } else { power }
        }
        ScalarNode::Powf(a, b) => of(a)?.powf(&of(b)?),
        ScalarNode::Ln(a) => of(a)?.ln(),
        ScalarNode::Exp(a) => of(a)?.exp(),
        ScalarNode::Sqrt(a) => of(a)?.sqrt(),
        ScalarNode::Select { left, right, then, otherwise } => {
            if of(left)?.greater(&of(right)?) {
                of(then)?
            } else {
                of(otherwise)?
            }
        }
        ScalarNode::Named(_, a) => of(a)?,
        ScalarNode::Invariant(_)
        | ScalarNode::Trace(_)
        | ScalarNode::Ddot(..)
        | ScalarNode::Det(_)
        | ScalarNode::StretchSum(_)
        | ScalarNode::Rate(_) => return None,
    })
}

//! What an expression of a law is while the parser works on it: a node of the tree, with the facts that checks need.

use std::rc::Rc;

use num_rational::Ratio;

use super::ast::{Rational, Scalar, ScalarNode, Tensor, TensorNode};

/// Facts of a tree that the checks ask for often, kept beside it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Facts {
    /// Whether the strain occurs in it.
    pub(super) strain: bool,
    /// Levels of nodes.
    pub(super) depth: usize,
}

impl Facts {
    fn over(parts: &[Facts]) -> Facts {
        Facts {
            strain: parts.iter().any(|part| part.strain),
            depth: 1 + parts.iter().map(|part| part.depth).max().unwrap_or(0),
        }
    }
}

/// A scalar expression.
#[derive(Debug, Clone)]
pub(super) struct ScalarValue {
    pub(super) node: Scalar,
    pub(super) facts: Facts,
    /// Made of literals alone and without a declared type: rustc calls no method on it.
    pub(super) untyped: bool,
    /// The value, where it is a small constant.
    pub(super) constant: Option<Rational>,
}

/// A symmetric tensor expression.
#[derive(Debug, Clone)]
pub(super) struct TensorValue {
    pub(super) node: Tensor,
    pub(super) facts: Facts,
}

/// The type of an integer: literals take the type that their use asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum IntegerType {
    Literal,
    Usize,
    I32,
}

/// An integer: an index, a bound of a sum, or a power.
#[derive(Debug, Clone, Copy)]
pub(super) struct Integer {
    pub(super) value: i64,
    pub(super) kind: IntegerType,
}

/// What an expression is.
#[derive(Debug, Clone)]
pub(super) enum Value {
    Scalar(ScalarValue),
    Tensor(TensorValue),
    Strain,
    Parameters,
    /// An array parameter, by its index.
    Array(usize),
    /// A direction, by its parameter's index.
    Direction(usize),
    Integer(Integer),
    /// Already reported as an error: what uses it is not reported again.
    Broken,
}

impl Value {
    /// The kind, with its article, for messages.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Value::Scalar(_) => "a scalar",
            Value::Tensor(_) => "a tensor",
            Value::Strain => "the strain",
            Value::Parameters => "the parameters",
            Value::Array(_) => "an array",
            Value::Direction(_) => "a direction",
            Value::Integer(_) => "an integer",
            Value::Broken => "an error",
        }
    }
}

/// Constants are tracked below this size, where no sum or product of two of them leaves 128 bits.
const TRACKED: i128 = 1 << 62;

fn tracked(value: Rational) -> Option<Rational> {
    (value.numer().abs() < TRACKED && *value.denom() < TRACKED).then_some(value)
}

impl ScalarValue {
    /// A leaf: a parameter or an invariant.
    pub(super) fn leaf(node: ScalarNode, strain: bool) -> ScalarValue {
        ScalarValue { node: Rc::new(node), facts: Facts { strain, depth: 1 }, untyped: false, constant: None }
    }

    /// A number; `untyped` if it is a literal.
    pub(super) fn number(value: Rational, untyped: bool) -> ScalarValue {
        let node = ScalarValue::leaf(ScalarNode::Number(value), false);
        ScalarValue { untyped, constant: tracked(value), ..node }
    }

    /// A small whole number of a built-in formula.
    pub(super) fn whole(value: i128) -> ScalarValue {
        ScalarValue::number(Ratio::from_integer(value), false)
    }

    /// A node over other values.
    pub(super) fn over(node: ScalarNode, parts: &[Facts]) -> ScalarValue {
        ScalarValue { node: Rc::new(node), facts: Facts::over(parts), untyped: false, constant: None }
    }

    fn arithmetic(
        &self,
        other: &ScalarValue,
        node: fn(Scalar, Scalar) -> ScalarNode,
        fold: fn(Rational, Rational) -> Rational,
    ) -> ScalarValue {
        let constant = self.constant.zip(other.constant).and_then(|(a, b)| tracked(fold(a, b)));
        let value = ScalarValue::over(node(Rc::clone(&self.node), Rc::clone(&other.node)), &[self.facts, other.facts]);
        ScalarValue { untyped: self.untyped && other.untyped, constant, ..value }
    }

    /// a + b.
    pub(super) fn add(&self, other: &ScalarValue) -> ScalarValue {
        self.arithmetic(other, ScalarNode::Add, |a, b| a + b)
    }

    /// a - b.
    pub(super) fn sub(&self, other: &ScalarValue) -> ScalarValue {
        self.arithmetic(other, ScalarNode::Sub, |a, b| a - b)
    }

    /// a b.
    pub(super) fn mul(&self, other: &ScalarValue) -> ScalarValue {
        self.arithmetic(other, ScalarNode::Mul, |a, b| a * b)
    }

    /// a / b; the caller has refused a constant zero b.
    pub(super) fn div(&self, other: &ScalarValue) -> ScalarValue {
        let fold: fn(Rational, Rational) -> Rational =
            |a, b| if *b.numer() == 0 { Ratio::from_integer(0) } else { a / b };
        self.arithmetic(other, ScalarNode::Div, fold)
    }

    /// -a.
    pub(super) fn neg(&self) -> ScalarValue {
        let value = ScalarValue::over(ScalarNode::Neg(Rc::clone(&self.node)), &[self.facts]);
        ScalarValue { untyped: self.untyped, constant: self.constant.map(|a| -a), ..value }
    }

    /// A function of this value alone.
    pub(super) fn apply(&self, node: fn(Scalar) -> ScalarNode) -> ScalarValue {
        ScalarValue::over(node(Rc::clone(&self.node)), &[self.facts])
    }

    /// The value under the name that a `let` gives it.
    pub(super) fn named(&self, name: &str, untyped: bool) -> ScalarValue {
        let value = ScalarValue::over(ScalarNode::Named(name.to_owned(), Rc::clone(&self.node)), &[self.facts]);
        ScalarValue { untyped: self.untyped && untyped, constant: self.constant, ..value }
    }

    /// Where `left > right`, `then`; elsewhere, `otherwise`.
    pub(super) fn select(left: &Self, right: &Self, then: &Self, otherwise: &Self) -> ScalarValue {
        let node = ScalarNode::Select {
            left: Rc::clone(&left.node),
            right: Rc::clone(&right.node),
            then: Rc::clone(&then.node),
            otherwise: Rc::clone(&otherwise.node),
        };
        ScalarValue::over(node, &[left.facts, right.facts, then.facts, otherwise.facts])
    }

    /// Whether this is a constant that is zero.
    pub(super) fn is_zero(&self) -> bool {
        self.constant.is_some_and(|value| *value.numer() == 0)
    }

    /// Whether this is a constant that is zero or negative.
    pub(super) fn is_non_positive(&self) -> bool {
        self.constant.is_some_and(|value| *value.numer() <= 0)
    }
}

impl TensorValue {
    /// A leaf: a strain measure or the identity.
    pub(super) fn leaf(node: TensorNode) -> TensorValue {
        let strain = !matches!(node, TensorNode::Identity);
        TensorValue { node: Rc::new(node), facts: Facts { strain, depth: 1 } }
    }

    /// A + B or A - B.
    pub(super) fn combine(&self, other: &TensorValue, node: fn(Tensor, Tensor) -> TensorNode) -> TensorValue {
        let node = node(Rc::clone(&self.node), Rc::clone(&other.node));
        TensorValue { node: Rc::new(node), facts: Facts::over(&[self.facts, other.facts]) }
    }

    /// s A.
    pub(super) fn scale(&self, factor: &ScalarValue) -> TensorValue {
        let node = TensorNode::Scale(Rc::clone(&factor.node), Rc::clone(&self.node));
        TensorValue { node: Rc::new(node), facts: Facts::over(&[self.facts, factor.facts]) }
    }
}

//! What an expression of a law is while the parser works on it: a node of the tree, with the facts that checks need.

use std::rc::Rc;

use num_rational::Ratio;

use super::ast::{Invariant, Rational, Scalar, ScalarNode, Tensor, TensorNode};
use super::dimension::Dimension;
use super::interval::{Interval, Values};

/// Facts of a tree that the checks ask for often, kept beside it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Facts {
    /// Whether the strain or its rate occurs in it.
    pub(super) strain: bool,
    /// Whether the strain's rate occurs in it.
    pub(super) rate: bool,
    /// Levels of nodes.
    pub(super) depth: usize,
    /// The dimension; `None` fits anything.
    pub(super) dimension: Option<Dimension>,
}

impl Facts {
    fn leaf(strain: bool, dimension: Option<Dimension>) -> Facts {
        Facts { strain, rate: false, depth: 1, dimension }
    }

    fn over(parts: &[Facts], dimension: Option<Dimension>) -> Facts {
        Facts {
            strain: parts.iter().any(|part| part.strain),
            rate: parts.iter().any(|part| part.rate),
            depth: 1 + parts.iter().map(|part| part.depth).max().unwrap_or(0),
            dimension,
        }
    }

    /// The dimension of a product.
    pub(super) fn times(self, other: Facts) -> Option<Dimension> {
        self.dimension.zip(other.dimension).and_then(|(a, b)| a.times(b))
    }

    /// The dimension of a quotient.
    pub(super) fn divided_by(self, other: Facts) -> Option<Dimension> {
        self.dimension.zip(other.dimension).and_then(|(a, b)| a.over(b))
    }

    /// The dimension of a power.
    pub(super) fn power(self, n: Ratio<i64>) -> Option<Dimension> {
        self.dimension.and_then(|dimension| dimension.power(n))
    }

    /// The dimension of a sum; the caller has refused unequal ones.
    fn sum(self, other: Facts) -> Option<Dimension> {
        self.dimension.or(other.dimension)
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
    /// The values that it can take.
    pub(super) values: Values,
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
    /// The rate of the strain.
    StrainRate,
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
            Value::StrainRate => "the strain rate",
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
    pub(super) fn leaf(node: ScalarNode, strain: bool, dimension: Option<Dimension>, values: Values) -> ScalarValue {
        let facts = Facts::leaf(strain, dimension);
        ScalarValue { node: Rc::new(node), facts, untyped: false, constant: None, values }
    }

    /// A number; `untyped` if it is a literal.
    pub(super) fn number(value: Rational, untyped: bool) -> ScalarValue {
        let zero = *value.numer() == 0;
        let (numerator, denominator) = (*value.numer() as f64, *value.denom() as f64);
        // Both were rounded: the quotient is within two of its roundings.
        let near = numerator / denominator;
        let exact = zero || (*value.denom() == 1 && value.numer().abs() < 1 << 53);
        let interval = if exact {
            Interval::new(near, near)
        } else {
            Interval::new(near.next_down().next_down(), near.next_up().next_up())
        };
        // 0 fits anything.
        let dimension = (!zero).then_some(Dimension::ONE);
        let leaf = ScalarValue::leaf(ScalarNode::Number(value), false, dimension, Values::of(interval));
        ScalarValue { untyped, constant: tracked(value), ..leaf }
    }

    /// A small whole number of a built-in formula.
    pub(super) fn whole(value: i128) -> ScalarValue {
        ScalarValue::number(Ratio::from_integer(value), false)
    }

    /// A node over other values.
    pub(super) fn over(node: ScalarNode, parts: &[Facts], dimension: Option<Dimension>, values: Values) -> ScalarValue {
        let facts = Facts::over(parts, dimension);
        ScalarValue { node: Rc::new(node), facts, untyped: false, constant: None, values }
    }

    fn arithmetic(
        &self,
        other: &ScalarValue,
        node: fn(Scalar, Scalar) -> ScalarNode,
        fold: fn(Rational, Rational) -> Rational,
        dimension: Option<Dimension>,
        values: Values,
    ) -> ScalarValue {
        let constant = self.constant.zip(other.constant).and_then(|(a, b)| tracked(fold(a, b)));
        let node = node(Rc::clone(&self.node), Rc::clone(&other.node));
        // What is zero by its numbers fits anything.
        let dimension = if constant.is_some_and(|value| *value.numer() == 0) { None } else { dimension };
        let value = ScalarValue::over(node, &[self.facts, other.facts], dimension, values);
        ScalarValue { untyped: self.untyped && other.untyped, constant, ..value }
    }

    /// a + b; the caller has refused unequal dimensions.
    pub(super) fn add(&self, other: &ScalarValue) -> ScalarValue {
        let values = self.values.zip(other.values, Interval::add);
        self.arithmetic(other, ScalarNode::Add, |a, b| a + b, self.facts.sum(other.facts), values)
    }

    /// a - b; the caller has refused unequal dimensions.
    pub(super) fn sub(&self, other: &ScalarValue) -> ScalarValue {
        let values = self.values.zip(other.values, Interval::sub);
        self.arithmetic(other, ScalarNode::Sub, |a, b| a - b, self.facts.sum(other.facts), values)
    }

    /// a b.
    pub(super) fn mul(&self, other: &ScalarValue) -> ScalarValue {
        let values = if Rc::ptr_eq(&self.node, &other.node) {
            self.values.map(|a| a.powi(2))
        } else {
            self.values.zip(other.values, Interval::mul)
        };
        self.arithmetic(other, ScalarNode::Mul, |a, b| a * b, self.facts.times(other.facts), values)
    }

    /// a / b; the caller has refused a constant zero b.
    pub(super) fn div(&self, other: &ScalarValue) -> ScalarValue {
        let fold: fn(Rational, Rational) -> Rational =
            |a, b| if *b.numer() == 0 { Ratio::from_integer(0) } else { a / b };
        // Where a parameter may be 0, a material with 0 is infinitely stiff whatever its strain: that is not told here.
        let divisor = if other.facts.strain { other.values } else { other.values.map(Interval::without_end) };
        let values = self.values.zip(divisor, |a, b| a.mul(b.reciprocal()));
        self.arithmetic(other, ScalarNode::Div, fold, self.facts.divided_by(other.facts), values)
    }

    /// -a.
    pub(super) fn neg(&self) -> ScalarValue {
        let node = ScalarNode::Neg(Rc::clone(&self.node));
        let value = ScalarValue::over(node, &[self.facts], self.facts.dimension, self.values.map(Interval::neg));
        ScalarValue { untyped: self.untyped, constant: self.constant.map(|a| -a), ..value }
    }

    /// a to an integer power.
    pub(super) fn powi(&self, n: i32) -> ScalarValue {
        let node = ScalarNode::Powi(Rc::clone(&self.node), n);
        let dimension = self.facts.power(Ratio::from_integer(i64::from(n)));
        ScalarValue::over(node, &[self.facts], dimension, self.values.map(|a| a.powi(n)))
    }

    /// a to a real power; the caller has refused a dimension of the exponent, and one of a where that is no number.
    pub(super) fn powf(&self, exponent: &ScalarValue) -> ScalarValue {
        let node = ScalarNode::Powf(Rc::clone(&self.node), Rc::clone(&exponent.node));
        let small = |n: i128| i64::try_from(n).ok();
        let ratio = exponent.constant.and_then(|n| Some(Ratio::new(small(*n.numer())?, small(*n.denom())?)));
        let dimension = ratio.map_or(Some(Dimension::ONE), |n| self.facts.power(n));
        ScalarValue::over(node, &[self.facts, exponent.facts], dimension, self.values.map(Interval::power))
    }

    /// ln(a), exp(a): pure numbers.
    pub(super) fn transcendental(&self, node: fn(Scalar) -> ScalarNode, f: fn(Interval) -> Interval) -> ScalarValue {
        ScalarValue::over(node(Rc::clone(&self.node)), &[self.facts], Some(Dimension::ONE), self.values.map(f))
    }

    /// sqrt(a).
    pub(super) fn sqrt(&self) -> ScalarValue {
        let (node, dimension) = (ScalarNode::Sqrt(Rc::clone(&self.node)), self.facts.power(Ratio::new(1, 2)));
        ScalarValue::over(node, &[self.facts], dimension, self.values.map(Interval::power))
    }

    /// The value under the name that a `let` gives it.
    pub(super) fn named(&self, name: &str, untyped: bool) -> ScalarValue {
        let node = ScalarNode::Named(name.to_owned(), Rc::clone(&self.node));
        let value = ScalarValue::over(node, &[self.facts], self.facts.dimension, self.values);
        ScalarValue { untyped: self.untyped && untyped, constant: self.constant, ..value }
    }

    /// Where `left > right`, `then`; elsewhere, `otherwise`. The caller has refused unequal dimensions.
    pub(super) fn select(left: &Self, right: &Self, then: &Self, otherwise: &Self) -> ScalarValue {
        let node = ScalarNode::Select {
            left: Rc::clone(&left.node),
            right: Rc::clone(&right.node),
            then: Rc::clone(&then.node),
            otherwise: Rc::clone(&otherwise.node),
        };
        let parts = [left.facts, right.facts, then.facts, otherwise.facts];
        let values = then.values.zip(otherwise.values, Interval::hull);
        ScalarValue::over(node, &parts, then.facts.sum(otherwise.facts), values)
    }

    /// The greater of a and 0: `select(a > 0, a, 0)`.
    pub(super) fn pos(&self) -> ScalarValue {
        let zero = ScalarValue::whole(0);
        ScalarValue { values: self.values.map(Interval::pos), ..ScalarValue::select(self, &zero, self, &zero) }
    }

    /// The same value after its dimension was refused: it is not refused again.
    pub(super) fn of_any_dimension(self) -> ScalarValue {
        ScalarValue { facts: Facts { dimension: None, ..self.facts }, ..self }
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
        TensorValue { node: Rc::new(node), facts: Facts::leaf(strain, Some(Dimension::ONE)) }
    }

    /// A + B or A - B; the caller has refused unequal dimensions.
    pub(super) fn combine(&self, other: &TensorValue, node: fn(Tensor, Tensor) -> TensorNode) -> TensorValue {
        let node = node(Rc::clone(&self.node), Rc::clone(&other.node));
        let facts = Facts::over(&[self.facts, other.facts], self.facts.sum(other.facts));
        TensorValue { node: Rc::new(node), facts }
    }

    /// s A.
    pub(super) fn scale(&self, factor: &ScalarValue) -> TensorValue {
        let node = TensorNode::Scale(Rc::clone(&factor.node), Rc::clone(&self.node));
        let facts = Facts::over(&[self.facts, factor.facts], self.facts.times(factor.facts));
        TensorValue { node: Rc::new(node), facts }
    }

    /// tr A.
    pub(super) fn trace(&self) -> ScalarValue {
        let values = match &*self.node {
            TensorNode::C => Values::of_invariant(Invariant::I1),
            TensorNode::E => Values::of(Interval::new(-1.5, f64::INFINITY)),
            TensorNode::Identity => Values::of(Interval::new(3.0, 3.0)),
            _ => Values::ALL,
        };
        ScalarValue::over(ScalarNode::Trace(Rc::clone(&self.node)), &[self.facts], self.facts.dimension, values)
    }

    /// det A.
    pub(super) fn det(&self) -> ScalarValue {
        let values = match &*self.node {
            TensorNode::C => Values::of_invariant(Invariant::I3),
            TensorNode::Identity => Values::of(Interval::new(1.0, 1.0)),
            _ => Values::ALL,
        };
        let dimension = self.facts.power(Ratio::from_integer(3));
        ScalarValue::over(ScalarNode::Det(Rc::clone(&self.node)), &[self.facts], dimension, values)
    }

    /// A : B.
    pub(super) fn ddot(&self, other: &TensorValue) -> ScalarValue {
        let values = match (&*self.node, &*other.node) {
            (TensorNode::C, TensorNode::C) => Values::of_invariant(Invariant::I1),
            (TensorNode::E, TensorNode::E) | (TensorNode::Eps, TensorNode::Eps) => Values::of(Interval::NON_NEGATIVE),
            // Rates of one strain.
            (TensorNode::Rate(a), TensorNode::Rate(b))
                if std::mem::discriminant(&**a) == std::mem::discriminant(&**b) =>
            {
                Values::of(Interval::NON_NEGATIVE)
            }
            _ if Rc::ptr_eq(&self.node, &other.node) => Values::of(Interval::NON_NEGATIVE),
            _ => Values::ALL,
        };
        let node = ScalarNode::Ddot(Rc::clone(&self.node), Rc::clone(&other.node));
        ScalarValue::over(node, &[self.facts, other.facts], self.facts.times(other.facts), values)
    }
}

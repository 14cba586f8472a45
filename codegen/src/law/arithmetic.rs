//! Operators of a law: which operands they take, and what they make of them.

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::{BinOp, Expr, ExprBinary, ExprUnary, UnOp};

use super::ast::TensorNode;
use super::expr::{Lowering, Scope};
use super::value::{Integer, IntegerType, ScalarValue, Value};

impl Lowering<'_> {
    /// `-a`.
    pub(super) fn unary(&mut self, unary: &ExprUnary, scope: &Scope) -> Value {
        if !matches!(unary.op, UnOp::Neg(_)) {
            return self.broken(
                unary.op.span(),
                "the only sign before a value is `-`",
                "remove it: there are no references, pointers or negations",
            );
        }
        match self.expr(&unary.expr, scope) {
            Value::Scalar(scalar) => Value::Scalar(scalar.neg()),
            Value::Tensor(tensor) => Value::Tensor(tensor.scale(&ScalarValue::whole(1).neg())),
            // A negated usize is refused where it is used, by its range.
            Value::Integer(Integer { value, kind }) => match value.checked_neg() {
                Some(value) if kind != IntegerType::Usize => Value::Integer(Integer { value, kind }),
                _ => self.broken(unary.span(), "an index cannot be negated", "write `-(i as f64)`"),
            },
            Value::Broken => Value::Broken,
            other => {
                let reason = format!("`-` needs a scalar or a tensor, and this is {}", other.kind());
                self.broken(unary.expr.span(), reason, "take a field of it")
            }
        }
    }

    /// A chain `a + b - c ..`, without recursion along its left side.
    pub(super) fn chain(&mut self, binary: &ExprBinary, scope: &Scope) -> Value {
        let mut links = vec![binary];
        while let Expr::Binary(left) = &*links[links.len() - 1].left {
            links.push(left);
        }
        let first = links[links.len() - 1];
        let mut value = self.expr(&first.left, scope);
        for link in links.into_iter().rev() {
            let right = self.expr(&link.right, scope);
            value = self.operation(link, value, right);
        }
        value
    }

    fn operation(&mut self, binary: &ExprBinary, left: Value, right: Value) -> Value {
        let span = binary.op.span();
        match (&binary.op, left, right) {
            (BinOp::Add(_) | BinOp::Sub(_) | BinOp::Mul(_) | BinOp::Div(_), Value::Broken, _)
            | (BinOp::Add(_) | BinOp::Sub(_) | BinOp::Mul(_) | BinOp::Div(_), _, Value::Broken) => Value::Broken,
            (BinOp::Add(_) | BinOp::Sub(_), Value::Scalar(a), Value::Scalar(b)) => {
                let (added, first) = sum_of(&binary.op);
                let fits = self.same(first, a.facts.dimension, b.facts.dimension, binary.right.span());
                let sum = if added { a.add(&b) } else { a.sub(&b) };
                Value::Scalar(if fits { sum } else { sum.of_any_dimension() })
            }
            (BinOp::Mul(_), Value::Scalar(a), Value::Scalar(b)) => Value::Scalar(a.mul(&b)),
            (BinOp::Add(_) | BinOp::Sub(_), Value::Tensor(a), Value::Tensor(b)) => {
                let (added, first) = sum_of(&binary.op);
                let fits = self.same(first, a.facts.dimension, b.facts.dimension, binary.right.span());
                let mut sum = a.combine(&b, if added { TensorNode::Add } else { TensorNode::Sub });
                sum.facts.dimension = sum.facts.dimension.filter(|_| fits);
                Value::Tensor(sum)
            }
            (BinOp::Mul(_), Value::Scalar(s), Value::Tensor(a))
            | (BinOp::Mul(_), Value::Tensor(a), Value::Scalar(s)) => Value::Tensor(a.scale(&s)),
            (BinOp::Mul(_), Value::Tensor(_), Value::Tensor(_)) => {
                self.broken(span, "two tensors have no product here", "for A:B write `ddot(A, B)`")
            }
            (BinOp::Div(_), a @ (Value::Scalar(_) | Value::Tensor(_)), Value::Scalar(b)) => self.quotient(binary, a, b),
            (BinOp::Add(_) | BinOp::Sub(_) | BinOp::Mul(_) | BinOp::Div(_), Value::Integer(a), Value::Integer(b)) => {
                self.integers(binary, a, b)
            }
            (BinOp::Add(_) | BinOp::Sub(_), Value::Scalar(_), Value::Tensor(_))
            | (BinOp::Add(_) | BinOp::Sub(_), Value::Tensor(_), Value::Scalar(_)) => {
                let reason = "a scalar and a tensor have no sum or difference";
                self.broken(span, reason, "multiply the scalar by `identity()`, or take `tr(A)` of the tensor")
            }
            (BinOp::Add(_) | BinOp::Sub(_) | BinOp::Mul(_) | BinOp::Div(_), left, right) => {
                // One side is no operand of arithmetic: the side that is not says so.
                if !matches!(left, Value::Tensor(_)) {
                    self.as_scalar(left, &binary.left);
                }
                if !matches!(right, Value::Tensor(_)) || matches!(binary.op, BinOp::Div(_)) {
                    self.as_scalar(right, &binary.right);
                }
                Value::Broken
            }
            (BinOp::Lt(_) | BinOp::Gt(_) | BinOp::Le(_) | BinOp::Ge(_), ..) => {
                let remedy = "write `select(a > b, x, y)`: x where a > b, y elsewhere";
                self.broken(span, "a comparison has a place only as the first argument of `select`", remedy)
            }
            (BinOp::Eq(_) | BinOp::Ne(_), ..) => {
                let remedy = "compare by `<`, `>`, `<=` or `>=` in `select`";
                self.broken(span, "real numbers are not compared for equality", remedy)
            }
            (BinOp::And(_) | BinOp::Or(_), ..) => {
                let remedy = "write one `select` inside another";
                self.broken(span, "conditions cannot be combined", remedy)
            }
            (
                BinOp::Rem(_) | BinOp::BitXor(_) | BinOp::BitAnd(_) | BinOp::BitOr(_) | BinOp::Shl(_) | BinOp::Shr(_),
                ..,
            ) => self.broken(span, "there is no arithmetic on bits", "the operators are `+`, `-`, `*` and `/`"),
            // What is left of `syn::BinOp` is `+=` and its like.
            _ => self.mutation(span),
        }
    }

    /// Refuses an assignment.
    pub(super) fn mutation(&mut self, span: Span) -> Value {
        self.broken(span, "a value cannot be changed", "give the new value a name of its own: `let y = ..;`")
    }

    fn quotient(&mut self, binary: &ExprBinary, left: Value, right: ScalarValue) -> Value {
        if right.is_zero() {
            return self.broken(
                binary.right.span(),
                "division by zero",
                "change the divisor: the energy would be infinite everywhere",
            );
        }
        self.divides(&right, binary.right.span());
        match left {
            Value::Scalar(a) => Value::Scalar(a.div(&right)),
            Value::Tensor(a) => Value::Tensor(a.scale(&ScalarValue::whole(1).div(&right))),
            _ => Value::Broken,
        }
    }

    fn integers(&mut self, binary: &ExprBinary, a: Integer, b: Integer) -> Value {
        let kind = match (a.kind, b.kind) {
            (IntegerType::Literal, kind) | (kind, IntegerType::Literal) => kind,
            (a, b) if a == b => a,
            _ => {
                let remedy = "convert one of them, as in `i as i32`";
                return self.broken(binary.op.span(), "integers of two types are mixed", remedy);
            }
        };
        let value = match binary.op {
            BinOp::Add(_) => a.value.checked_add(b.value),
            BinOp::Sub(_) => a.value.checked_sub(b.value),
            BinOp::Mul(_) => a.value.checked_mul(b.value),
            _ => {
                let remedy = "for a real quotient write `1.0 / 2.0`";
                return self.broken(binary.op.span(), "integers are not divided", remedy);
            }
        };
        match value {
            Some(value) if kind != IntegerType::Usize || value >= 0 => Value::Integer(Integer { value, kind }),
            _ => self.broken(binary.op.span(), "this integer is out of range", "an index is at least 0"),
        }
    }
}

/// Whether the operator of a sum adds, and what the first operand is to the second one.
fn sum_of(op: &BinOp) -> (bool, &'static str) {
    match op {
        BinOp::Add(_) => (true, "what it is added to"),
        _ => (false, "what it is subtracted from"),
    }
}

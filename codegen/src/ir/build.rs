//! Builds a kernel value by value: equal operations become one value, constants fold, dead values go.

use std::collections::HashMap;

use num_traits::{One, Zero};

use super::{Definition, Input, KernelIr, Op, Output, Rational, ValueId};

/// Collects definitions; [`Builder::finish`] keeps those that an output needs.
#[derive(Debug, Default)]
pub struct Builder {
    values: Vec<Definition>,
    index: HashMap<Op, ValueId>,
}

impl Builder {
    /// An empty kernel.
    pub fn new() -> Self {
        Self::default()
    }

    /// The operation that defines a value.
    pub fn op(&self, value: ValueId) -> Op {
        self.values[value.index()].op
    }

    /// The exact value, where it is a constant.
    pub fn constant(&self, value: ValueId) -> Option<Rational> {
        match self.op(value) {
            Op::Const(q) => Some(q),
            _ => None,
        }
    }

    /// Names a value for the reader; the first name stays.
    pub fn name(&mut self, value: ValueId, name: &str) {
        let definition = &mut self.values[value.index()];
        if definition.name.is_none() && !matches!(definition.op, Op::Input(..) | Op::Const(_)) {
            definition.name = Some(name.to_string());
        }
    }

    /// Component `k` of an input.
    pub fn input(&mut self, role: Input, k: u32) -> ValueId {
        self.push(Op::Input(role, k))
    }

    /// An exact constant.
    pub fn number(&mut self, q: Rational) -> ValueId {
        self.push(Op::Const(q))
    }

    /// a + b.
    pub fn add(&mut self, a: ValueId, b: ValueId) -> ValueId {
        match (self.constant(a), self.constant(b)) {
            (Some(x), Some(y)) => self.number(x + y),
            (Some(x), None) if x.is_zero() => b,
            (None, Some(y)) if y.is_zero() => a,
            // Addition commutes exactly: one order, so that equal sums are one value.
            _ => self.push(Op::Add(a.min(b), a.max(b))),
        }
    }

    /// a - b.
    pub fn sub(&mut self, a: ValueId, b: ValueId) -> ValueId {
        match (self.constant(a), self.constant(b)) {
            (Some(x), Some(y)) => self.number(x - y),
            (Some(x), None) if x.is_zero() => self.neg(b),
            (None, Some(y)) if y.is_zero() => a,
            _ => self.push(Op::Sub(a, b)),
        }
    }

    /// a b.
    pub fn mul(&mut self, a: ValueId, b: ValueId) -> ValueId {
        match (self.constant(a), self.constant(b)) {
            (Some(x), Some(y)) => self.number(x * y),
            (Some(x), None) if x.is_one() => b,
            (None, Some(y)) if y.is_one() => a,
            (Some(x), None) if (-x).is_one() => self.neg(b),
            (None, Some(y)) if (-y).is_one() => self.neg(a),
            _ => self.push(Op::Mul(a.min(b), a.max(b))),
        }
    }

    /// a / b.
    pub fn div(&mut self, a: ValueId, b: ValueId) -> ValueId {
        match (self.constant(a), self.constant(b)) {
            (Some(x), Some(y)) if !y.is_zero() => self.number(x / y),
            (None, Some(y)) if y.is_one() => a,
            _ => self.push(Op::Div(a, b)),
        }
    }

    /// 1 / a.
    pub fn recip(&mut self, a: ValueId) -> ValueId {
        let one = self.number(Rational::one());
        self.div(one, a)
    }

    /// -a.
    pub fn neg(&mut self, a: ValueId) -> ValueId {
        match self.op(a) {
            Op::Const(q) => self.number(-q),
            Op::Neg(b) => b,
            _ => self.push(Op::Neg(a)),
        }
    }

    /// Any operation without a rule of its own.
    pub fn push(&mut self, op: Op) -> ValueId {
        if let Some(&value) = self.index.get(&op) {
            return value;
        }
        let value = ValueId(u32::try_from(self.values.len()).expect("a kernel has fewer than 2^32 values"));
        self.values.push(Definition { op, name: None });
        self.index.insert(op, value);
        value
    }

    /// The kernel of these outputs: dead values dropped, single-use reciprocals fused into divisions.
    pub fn finish(self, name: &str, inputs: Vec<(Input, u32)>, outputs: Vec<(Output, Vec<ValueId>)>) -> KernelIr {
        let mut values = self.values;
        fuse_divisions(&mut values, &outputs);
        KernelIr { name: name.to_string(), inputs, values, outputs }.without_dead_values()
    }
}

impl KernelIr {
    /// The kernel without values that no output needs.
    pub(super) fn without_dead_values(self) -> Self {
        let live = live_values(&self.values, &self.outputs);
        let mut renumbered = vec![None; self.values.len()];
        let mut values = Vec::new();
        for (i, definition) in self.values.into_iter().enumerate() {
            if live[i] {
                let op = definition.op.map(|v| renumbered[v.index()].expect("operands of live values are live"));
                renumbered[i] = Some(ValueId(values.len() as u32));
                values.push(Definition { op, name: definition.name });
            }
        }
        let outputs = self
            .outputs
            .into_iter()
            .map(|(role, ids)| {
                (role, ids.into_iter().map(|v| renumbered[v.index()].expect("outputs are live")).collect())
            })
            .collect();
        Self { values, outputs, ..self }
    }
}

fn live_values(values: &[Definition], outputs: &[(Output, Vec<ValueId>)]) -> Vec<bool> {
    let mut live = vec![false; values.len()];
    for value in outputs.iter().flat_map(|(_, ids)| ids) {
        live[value.index()] = true;
    }
    for i in (0..values.len()).rev() {
        if live[i] {
            for operand in values[i].op.operands() {
                live[operand.index()] = true;
            }
        }
    }
    live
}

/// `a * (1 / b)` is `a / b` where nothing else needs 1 / b: one operation and one rounding less.
fn fuse_divisions(values: &mut [Definition], outputs: &[(Output, Vec<ValueId>)]) {
    let live = live_values(values, outputs);
    let mut uses = vec![0usize; values.len()];
    for (i, definition) in values.iter().enumerate() {
        if live[i] {
            for operand in definition.op.operands() {
                uses[operand.index()] += 1;
            }
        }
    }
    for value in outputs.iter().flat_map(|(_, ids)| ids) {
        uses[value.index()] += 1;
    }
    let is_one = |values: &[Definition], v: ValueId| matches!(values[v.index()].op, Op::Const(q) if q.is_one());
    for i in 0..values.len() {
        if let (true, Op::Mul(a, b)) = (live[i], values[i].op) {
            for (x, y) in [(a, b), (b, a)] {
                if let Op::Div(one, d) = values[y.index()].op
                    && uses[y.index()] == 1
                    && is_one(values, one)
                {
                    values[i].op = Op::Div(x, d);
                    break;
                }
            }
        }
    }
}

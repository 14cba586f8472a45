//! Runs functions of WGSL modules on the host, operation by operation in f32: what a device computes that neither
//! reorders nor fuses.

use std::collections::HashMap;

use naga::{BinaryOperator, Expression, Function, Handle, Literal, LocalVariable, MathFunction, Module, ScalarKind};
use naga::{Statement, UnaryOperator};

/// A value of the few types that generated functions use.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// `f32`.
    F32(f32),
    /// `u32`.
    U32(u32),
    /// `i32`.
    I32(i32),
    /// `bool`.
    Bool(bool),
    /// A vector, an array or a structure.
    List(Vec<Value>),
}

impl Value {
    /// An `array<f32, N>`.
    pub fn array(values: &[f32]) -> Self {
        Self::List(values.iter().copied().map(Self::F32).collect())
    }

    /// Every number in it, in order.
    ///
    /// # Panics
    /// It holds something else than f32.
    pub fn numbers(&self) -> Vec<f32> {
        match self {
            Self::F32(x) => vec![*x],
            Self::List(values) => values.iter().flat_map(Self::numbers).collect(),
            Self::U32(_) | Self::I32(_) | Self::Bool(_) => panic!("{self:?} is no f32"),
        }
    }

    fn bits(&self) -> u32 {
        match self {
            Self::F32(x) => x.to_bits(),
            Self::U32(x) => *x,
            Self::I32(x) => *x as u32,
            Self::Bool(_) | Self::List(_) => panic!("{self:?} has no 32 bits"),
        }
    }
}

/// The functions of a module.
#[derive(Debug)]
pub struct Functions(Module);

impl Functions {
    /// Reads a module.
    ///
    /// # Panics
    /// It is no WGSL.
    pub fn parse(text: &str) -> Self {
        Self(naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text))))
    }

    /// Whether there is a function of this name.
    pub fn has(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    fn find(&self, name: &str) -> Option<&Function> {
        self.0.functions.iter().map(|(_, f)| f).find(|f| f.name.as_deref() == Some(name))
    }

    /// Calls a function.
    ///
    /// # Panics
    /// There is none of this name, or it does what generated functions of values do not: loops, memory.
    pub fn call(&self, name: &str, arguments: &[Value]) -> Value {
        let function = self.find(name).unwrap_or_else(|| panic!("no function {name}"));
        assert_eq!(function.arguments.len(), arguments.len(), "{name}");
        self.run(function, arguments)
    }

    fn run(&self, function: &Function, arguments: &[Value]) -> Value {
        let mut frame = Frame { all: self, function, arguments, values: HashMap::new(), locals: HashMap::new() };
        frame.block(&function.body).expect("a function of values returns one")
    }
}

/// One call.
struct Frame<'a> {
    all: &'a Functions,
    function: &'a Function,
    arguments: &'a [Value],
    values: HashMap<Handle<Expression>, Value>,
    locals: HashMap<Handle<LocalVariable>, Value>,
}

impl Frame<'_> {
    /// Runs statements; the value that they return, if they do.
    fn block(&mut self, block: &naga::Block) -> Option<Value> {
        for statement in block.iter() {
            match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        let value = self.expression(handle);
                        self.values.insert(handle, value);
                    }
                }
                Statement::Block(inner) => {
                    if let Some(value) = self.block(inner) {
                        return Some(value);
                    }
                }
                Statement::If { condition, accept, reject } => {
                    let chosen = if self.at(*condition) == Value::Bool(true) { accept } else { reject };
                    if let Some(value) = self.block(chosen) {
                        return Some(value);
                    }
                }
                Statement::Return { value } => return value.map(|v| self.at(v)),
                Statement::Store { pointer, value } => {
                    let value = self.at(*value);
                    self.locals.insert(self.local(*pointer), value);
                }
                Statement::Call { function, arguments, result } => {
                    let arguments: Vec<Value> = arguments.iter().map(|a| self.at(*a)).collect();
                    let value = self.all.run(&self.all.0.functions[*function], &arguments);
                    self.values.insert(result.expect("functions of values are called for their value"), value);
                }
                other => panic!("unsupported statement {other:?}"),
            }
        }
        None
    }

    fn local(&self, pointer: Handle<Expression>) -> Handle<LocalVariable> {
        match self.function.expressions[pointer] {
            Expression::LocalVariable(local) => local,
            ref other => panic!("unsupported pointer {other:?}"),
        }
    }

    /// The value of an expression: as it was emitted, or of one that needs no emission.
    fn at(&self, handle: Handle<Expression>) -> Value {
        self.values.get(&handle).cloned().unwrap_or_else(|| self.expression(handle))
    }

    fn expression(&self, handle: Handle<Expression>) -> Value {
        match &self.function.expressions[handle] {
            Expression::Literal(literal) => match literal {
                Literal::F32(x) => Value::F32(*x),
                Literal::U32(x) => Value::U32(*x),
                Literal::I32(x) => Value::I32(*x),
                Literal::Bool(x) => Value::Bool(*x),
                other => panic!("unsupported literal {other:?}"),
            },
            Expression::FunctionArgument(k) => self.arguments[*k as usize].clone(),
            Expression::Compose { components, .. } => Value::List(components.iter().map(|c| self.at(*c)).collect()),
            Expression::AccessIndex { base, index } => match self.at(*base) {
                Value::List(values) => values[*index as usize].clone(),
                other => panic!("component {index} of {other:?}"),
            },
            Expression::Load { pointer } => {
                let local = self.local(*pointer);
                let initial =
                    || self.at(self.function.local_variables[local].init.expect("generated variables have a value"));
                self.locals.get(&local).cloned().unwrap_or_else(initial)
            }
            Expression::Unary { op, expr } => match (op, self.at(*expr)) {
                (UnaryOperator::Negate, Value::F32(x)) => Value::F32(-x),
                (op, other) => panic!("unsupported {op:?} of {other:?}"),
            },
            Expression::Binary { op, left, right } => binary(*op, self.at(*left), self.at(*right)),
            Expression::Select { condition, accept, reject } => {
                self.at(if self.at(*condition) == Value::Bool(true) { *accept } else { *reject })
            }
            Expression::Math { fun, arg, arg1, arg2, .. } => {
                let x: Vec<f32> = [Some(arg), arg1.as_ref(), arg2.as_ref()]
                    .into_iter()
                    .flatten()
                    .flat_map(|a| self.at(*a).numbers())
                    .collect();
                Value::F32(math(*fun, &x))
            }
            Expression::As { expr, kind, convert } => convert_to(*kind, convert.is_some(), &self.at(*expr)),
            other => panic!("unsupported expression {other:?}"),
        }
    }
}

fn math(fun: MathFunction, x: &[f32]) -> f32 {
    match (fun, x) {
        (MathFunction::Fma, &[a, b, c]) => a.mul_add(b, c),
        (MathFunction::Sqrt, &[a]) => a.sqrt(),
        (MathFunction::Abs, &[a]) => a.abs(),
        (MathFunction::Round, &[a]) => a.round_ties_even(),
        (MathFunction::Max, &[a, b]) => a.max(b),
        (MathFunction::Clamp, &[a, low, high]) => a.clamp(low, high),
        (fun, x) => panic!("unsupported {fun:?} of {x:?}"),
    }
}

fn convert_to(kind: ScalarKind, by_value: bool, x: &Value) -> Value {
    match (kind, by_value, x) {
        (ScalarKind::Float, false, x) => Value::F32(f32::from_bits(x.bits())),
        (ScalarKind::Uint, false, x) => Value::U32(x.bits()),
        (ScalarKind::Sint, false, x) => Value::I32(x.bits() as i32),
        (ScalarKind::Float, true, Value::I32(x)) => Value::F32(*x as f32),
        (ScalarKind::Sint, true, Value::F32(x)) => Value::I32(*x as i32),
        (kind, ..) => panic!("unsupported conversion of {x:?} to {kind:?}"),
    }
}

fn binary(op: BinaryOperator, a: Value, b: Value) -> Value {
    use BinaryOperator as B;
    use Value::{Bool, F32, I32, U32};
    match (op, a, b) {
        (B::Add, F32(a), F32(b)) => F32(a + b),
        (B::Subtract, F32(a), F32(b)) => F32(a - b),
        (B::Multiply, F32(a), F32(b)) => F32(a * b),
        (B::Divide, F32(a), F32(b)) => F32(a / b),
        (B::Less, F32(a), F32(b)) => Bool(a < b),
        (B::Greater, F32(a), F32(b)) => Bool(a > b),
        (B::Equal, F32(a), F32(b)) => Bool(a == b),
        (B::LogicalAnd, Bool(a), Bool(b)) => Bool(a && b),
        (B::Add, I32(a), I32(b)) => I32(a.wrapping_add(b)),
        (B::Subtract, I32(a), I32(b)) => I32(a.wrapping_sub(b)),
        (B::Multiply, I32(a), I32(b)) => I32(a.wrapping_mul(b)),
        (B::Divide, I32(a), I32(b)) => I32(a / b),
        (B::ShiftRight, I32(a), U32(b)) => I32(a >> b),
        (B::Subtract, U32(a), U32(b)) => U32(a.wrapping_sub(b)),
        (B::ShiftLeft, U32(a), U32(b)) => U32(a << b),
        (op, a, b) => panic!("unsupported {op:?} of {a:?} and {b:?}"),
    }
}

//! Conditions on a position, such as `near(x, xmin) && y < 0.5`: Rust expression syntax, checked once, then total.
//!
//! Variables: `x y z`, the position at rest in m, and `xmin xmax ymin ymax zmin zmax`, the body's bounding box.
//! Operators: `+ - * /`, `< <= > >=`, `&& || !`. Functions: `abs(a)`, `sqrt(a)`, `min(a, b)`, `max(a, b)`, and
//! `near(a, b)`, which holds if |a - b| is at most 1e-6 of the bounding box's diagonal. Evaluation follows IEEE 754:
//! a comparison with the result of 0/0 or of sqrt(-1) does not hold.

use super::selection::BoundingBox;
use super::suggest::nearest;
use std::fmt;
use std::ops::Range;
use syn::spanned::Spanned;
use syn::{BinOp, Expr, Lit, UnOp};

/// Two values are `near` each other within this fraction of the bounding box's diagonal.
const NEAR: f64 = 1e-6;
/// Longest condition, in bytes: bounds the work and the depth of the parser.
const LONGEST: usize = 1000;
/// Most parentheses inside each other.
const DEEPEST: usize = 32;
/// Most operators in a row; `a < - - b` has three.
const MOST_OPERATORS: usize = 4;

const VARIABLES: [&str; 9] = ["x", "y", "z", "xmin", "xmax", "ymin", "ymax", "zmin", "zmax"];
const FUNCTIONS: [&str; 5] = ["abs", "sqrt", "min", "max", "near"];

/// Why a text is no condition, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExpressionError {
    /// The wrong part, in bytes of the text.
    pub span: Range<usize>,
    /// What is wrong.
    pub reason: String,
    /// What to write instead.
    pub remedy: String,
}

impl ExpressionError {
    pub(super) fn new(span: Range<usize>, reason: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { span, reason: reason.into(), remedy: remedy.into() }
    }
}

impl fmt::Display for ExpressionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.reason, self.remedy)
    }
}

impl std::error::Error for ExpressionError {}

/// A condition on a position.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicate {
    text: String,
    condition: Condition,
}

#[derive(Debug, Clone, PartialEq)]
enum Condition {
    Compare(Comparison, Number, Number),
    Near(Number, Number),
    And(Box<Condition>, Box<Condition>),
    Or(Box<Condition>, Box<Condition>),
    Not(Box<Condition>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Comparison {
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

#[derive(Debug, Clone, PartialEq)]
enum Number {
    Constant(f64),
    /// Index into `VARIABLES`.
    Variable(usize),
    Unary(Unary, Box<Number>),
    Binary(Binary, Box<Number>, Box<Number>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Unary {
    Negate,
    Abs,
    Sqrt,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Min,
    Max,
}

/// A part of a condition, before it is known to stand in the right place.
enum Term {
    Number(Number),
    Condition(Condition),
}

impl Predicate {
    /// Reads a condition.
    ///
    /// # Errors
    /// Where and why the text is not a condition.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        scan(text)?;
        let expression = syn::parse_str::<Expr>(text).map_err(|error| {
            let reason = format!("not a condition: {error}");
            ExpressionError::new(bytes(text, error.span()), reason, "write for example \"near(x, xmin) && y < 0.5\"")
        })?;
        match (Compiler { text }).term(&expression)? {
            Term::Condition(condition) => Ok(Self { text: text.to_owned(), condition }),
            Term::Number(_) => Err(ExpressionError::new(
                bytes(text, expression.span()),
                "this is a number, not a condition",
                "compare it with another number, for example \"x < 0.5\"",
            )),
        }
    }

    /// The condition as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether it holds at a position (m) in a body with this bounding box.
    pub fn holds(&self, point: [f64; 3], bbox: &BoundingBox) -> bool {
        let [x, y, z] = point;
        let ([xmin, ymin, zmin], [xmax, ymax, zmax]) = (bbox.min, bbox.max);
        self.condition.holds(&[x, y, z, xmin, xmax, ymin, ymax, zmin, zmax], NEAR * bbox.diagonal())
    }
}

impl Condition {
    fn holds(&self, variables: &[f64; 9], near: f64) -> bool {
        match self {
            Self::Compare(comparison, a, b) => {
                let (a, b) = (a.value(variables), b.value(variables));
                match comparison {
                    Comparison::Less => a < b,
                    Comparison::LessOrEqual => a <= b,
                    Comparison::Greater => a > b,
                    Comparison::GreaterOrEqual => a >= b,
                }
            }
            Self::Near(a, b) => (a.value(variables) - b.value(variables)).abs() <= near,
            Self::And(a, b) => a.holds(variables, near) && b.holds(variables, near),
            Self::Or(a, b) => a.holds(variables, near) || b.holds(variables, near),
            Self::Not(a) => !a.holds(variables, near),
        }
    }
}

impl Number {
    fn value(&self, variables: &[f64; 9]) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Variable(index) => variables[*index],
            Self::Unary(operator, a) => {
                let a = a.value(variables);
                match operator {
                    Unary::Negate => -a,
                    Unary::Abs => a.abs(),
                    Unary::Sqrt => a.sqrt(),
                }
            }
            Self::Binary(operator, a, b) => {
                let (a, b) = (a.value(variables), b.value(variables));
                match operator {
                    Binary::Add => a + b,
                    Binary::Subtract => a - b,
                    Binary::Multiply => a * b,
                    Binary::Divide => a / b,
                    Binary::Min => a.min(b),
                    Binary::Max => a.max(b),
                }
            }
        }
    }
}

/// Refuses what is no part of a condition before the parser sees it: other names (so no keyword reaches it), other
/// characters, and nesting that would exhaust the stack.
fn scan(text: &str) -> Result<(), ExpressionError> {
    if text.len() > LONGEST {
        let reason = format!("the condition is {} bytes long, longer than {LONGEST}", text.len());
        return Err(ExpressionError::new(0..text.len(), reason, "name a group of the mesh file instead"));
    }
    if text.trim().is_empty() {
        return Err(ExpressionError::new(0..text.len(), "the selection is empty", "write \"all\" or a condition"));
    }
    let (mut open, mut operators) = (Vec::new(), 0_usize);
    let mut rest = text.char_indices().peekable();
    while let Some((start, first)) = rest.next() {
        let mut end = start + first.len_utf8();
        match first {
            'a'..='z' | 'A'..='Z' | '_' | '0'..='9' => {
                // A number may hold letters (1e-6); Rust's parser sees to it.
                let inside = |c: char| c.is_ascii_alphanumeric() || c == '_' || (first.is_ascii_digit() && c == '.');
                while let Some((i, c)) = rest.next_if(|&(_, c)| inside(c)) {
                    end = i + c.len_utf8();
                }
                let word = &text[start..end];
                if !first.is_ascii_digit() && !VARIABLES.contains(&word) && !FUNCTIONS.contains(&word) {
                    let known = VARIABLES.iter().chain(&FUNCTIONS).copied();
                    let hint =
                        nearest(word, known.clone()).map_or(String::new(), |name| format!("did you mean `{name}`? "));
                    let known = known.collect::<Vec<_>>().join(", ");
                    return Err(ExpressionError::new(
                        start..end,
                        format!("unknown name `{word}` in a condition"),
                        format!("{hint}known are {known}"),
                    ));
                }
                operators = 0;
            }
            '(' => {
                operators = 0;
                open.push(start..end);
                if open.len() > DEEPEST {
                    let reason = format!("more than {DEEPEST} parentheses inside each other");
                    return Err(ExpressionError::new(start..end, reason, "simplify the condition"));
                }
            }
            ')' => {
                operators = 0;
                if open.pop().is_none() {
                    return Err(ExpressionError::new(start..end, "this parenthesis was never opened", "leave it out"));
                }
            }
            ',' => operators = 0,
            '+' | '-' | '*' | '/' | '<' | '>' | '=' | '!' | '&' | '|' => {
                let two = rest.next_if(|&(_, second)| match first {
                    '&' | '|' => second == first,
                    '<' | '>' | '!' | '=' => second == '=',
                    _ => false,
                });
                let single = matches!(first, '&' | '|' | '=') && two.is_none();
                let comment = first == '/' && rest.peek().is_some_and(|&(_, c)| c == '/' || c == '*');
                if single || comment {
                    return Err(ExpressionError::new(
                        start..end,
                        format!("`{first}` does not belong in a condition here"),
                        "the operators are + - * / < <= > >= && || !",
                    ));
                }
                end += two.map_or(0, |(_, c)| c.len_utf8());
                if matches!(&text[start..end], "==" | "!=") {
                    let near = if first == '=' { "near(a, b)" } else { "!near(a, b)" };
                    return Err(ExpressionError::new(
                        start..end,
                        format!("`{}` compares rounded coordinates exactly", &text[start..end]),
                        format!("write {near}: within 1e-6 of the bounding box's diagonal"),
                    ));
                }
                operators += 1;
                if operators > MOST_OPERATORS {
                    return Err(ExpressionError::new(start..end, "too many operators in a row", "leave some out"));
                }
            }
            _ if first.is_whitespace() => {}
            // `.5` is refused by Rust's parser with less help.
            _ => {
                let remedy =
                    if first == '.' { "write 0.5, not .5" } else { "the operators are + - * / < <= > >= && || !" };
                let reason = format!("`{}` does not belong in a condition", first.escape_debug());
                return Err(ExpressionError::new(start..end, reason, remedy));
            }
        }
    }
    match open.pop() {
        Some(span) => Err(ExpressionError::new(span, "this parenthesis is never closed", "close it with `)`")),
        None => Ok(()),
    }
}

/// From syntax to typed terms.
struct Compiler<'t> {
    text: &'t str,
}

impl Compiler<'_> {
    fn term(&self, expression: &Expr) -> Result<Term, ExpressionError> {
        match expression {
            Expr::Paren(inner) => self.term(&inner.expr),
            Expr::Lit(literal) => self.constant(&literal.lit).map(Term::Number),
            Expr::Path(path) => {
                let name = path.path.get_ident().map(ToString::to_string).unwrap_or_default();
                match VARIABLES.iter().position(|&variable| variable == name) {
                    Some(index) => Ok(Term::Number(Number::Variable(index))),
                    None => Err(self.error(
                        expression,
                        format!("`{name}` is a function"),
                        format!("write it with arguments: {}", usage(&name)),
                    )),
                }
            }
            Expr::Unary(unary) => match unary.op {
                UnOp::Neg(_) => Ok(Term::Number(Number::Unary(Unary::Negate, self.number(&unary.expr)?.into()))),
                UnOp::Not(_) => Ok(Term::Condition(Condition::Not(self.condition(&unary.expr)?.into()))),
                _ => Err(self.unsupported(expression)),
            },
            Expr::Binary(binary) => self.binary(expression, &binary.op, &binary.left, &binary.right),
            Expr::Call(call) => {
                let Expr::Path(function) = &*call.func else { return Err(self.unsupported(expression)) };
                let name = function.path.get_ident().map(ToString::to_string).unwrap_or_default();
                let arguments: Vec<&Expr> = call.args.iter().collect();
                match (name.as_str(), arguments.as_slice()) {
                    ("abs", [a]) => Ok(Term::Number(Number::Unary(Unary::Abs, self.number(a)?.into()))),
                    ("sqrt", [a]) => Ok(Term::Number(Number::Unary(Unary::Sqrt, self.number(a)?.into()))),
                    ("min", [a, b]) => self.arithmetic(Binary::Min, a, b),
                    ("max", [a, b]) => self.arithmetic(Binary::Max, a, b),
                    ("near", [a, b]) => Ok(Term::Condition(Condition::Near(self.number(a)?, self.number(b)?))),
                    (name, _) if FUNCTIONS.contains(&name) => Err(self.error(
                        expression,
                        format!("wrong number of arguments: {}", arguments.len()),
                        format!("write {}", usage(name)),
                    )),
                    (name, _) => Err(self.error(
                        &call.func,
                        format!("`{name}` is not a function"),
                        format!("functions are {}", FUNCTIONS.join(", ")),
                    )),
                }
            }
            _ => Err(self.unsupported(expression)),
        }
    }

    fn binary(&self, whole: &Expr, operator: &BinOp, a: &Expr, b: &Expr) -> Result<Term, ExpressionError> {
        let compare =
            |comparison| Ok(Term::Condition(Condition::Compare(comparison, self.number(a)?, self.number(b)?)));
        match operator {
            BinOp::Add(_) => self.arithmetic(Binary::Add, a, b),
            BinOp::Sub(_) => self.arithmetic(Binary::Subtract, a, b),
            BinOp::Mul(_) => self.arithmetic(Binary::Multiply, a, b),
            BinOp::Div(_) => self.arithmetic(Binary::Divide, a, b),
            BinOp::Lt(_) => compare(Comparison::Less),
            BinOp::Le(_) => compare(Comparison::LessOrEqual),
            BinOp::Gt(_) => compare(Comparison::Greater),
            BinOp::Ge(_) => compare(Comparison::GreaterOrEqual),
            BinOp::And(_) => Ok(Term::Condition(Condition::And(self.condition(a)?.into(), self.condition(b)?.into()))),
            BinOp::Or(_) => Ok(Term::Condition(Condition::Or(self.condition(a)?.into(), self.condition(b)?.into()))),
            _ => Err(self.unsupported(whole)),
        }
    }

    fn arithmetic(&self, operator: Binary, a: &Expr, b: &Expr) -> Result<Term, ExpressionError> {
        Ok(Term::Number(Number::Binary(operator, self.number(a)?.into(), self.number(b)?.into())))
    }

    fn number(&self, expression: &Expr) -> Result<Number, ExpressionError> {
        match self.term(expression)? {
            Term::Number(number) => Ok(number),
            Term::Condition(_) => Err(self.error(
                expression,
                "this is a condition, but a number is needed here",
                "join conditions with && or ||",
            )),
        }
    }

    fn condition(&self, expression: &Expr) -> Result<Condition, ExpressionError> {
        match self.term(expression)? {
            Term::Condition(condition) => Ok(condition),
            Term::Number(_) => Err(self.error(
                expression,
                "this is a number, but a condition is needed here",
                "compare it with another number",
            )),
        }
    }

    fn constant(&self, literal: &Lit) -> Result<Number, ExpressionError> {
        let (digits, suffix) = match literal {
            Lit::Int(literal) => (literal.base10_digits(), literal.suffix()),
            Lit::Float(literal) => (literal.base10_digits(), literal.suffix()),
            _ => ("", ""),
        };
        match digits.parse::<f64>() {
            Ok(value) if value.is_finite() && suffix.is_empty() => Ok(Number::Constant(value)),
            _ => Err(ExpressionError::new(
                bytes(self.text, literal.span()),
                "this is no number that can be used",
                "write it like 0.5, 3 or 1e-6",
            )),
        }
    }

    fn unsupported(&self, expression: &Expr) -> ExpressionError {
        self.error(
            expression,
            "this does not belong in a condition",
            "conditions hold numbers, coordinates, + - * / < <= > >= && || ! and functions",
        )
    }

    fn error(&self, expression: &Expr, reason: impl Into<String>, remedy: impl Into<String>) -> ExpressionError {
        ExpressionError::new(bytes(self.text, expression.span()), reason, remedy)
    }
}

fn usage(function: &str) -> &'static str {
    match function {
        "abs" => "abs(a)",
        "sqrt" => "sqrt(a)",
        "min" => "min(a, b)",
        "max" => "max(a, b)",
        _ => "near(a, b)",
    }
}

/// A parser's span as bytes of the text. At the end of the text the parser reports no place: the last byte then.
fn bytes(text: &str, span: proc_macro2::Span) -> Range<usize> {
    let offset = |place: proc_macro2::LineColumn| {
        let line: usize = text.split_inclusive('\n').take(place.line.saturating_sub(1)).map(str::len).sum();
        line + text[line..].chars().take(place.column).map(char::len_utf8).sum::<usize>()
    };
    let (start, end) = (offset(span.start()), offset(span.end()));
    if end > start { start..end } else { text.len()..text.len() }
}

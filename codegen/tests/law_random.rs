//! Random laws: their text is read as the tree that was printed, and no damage to a text makes the parser panic.
//!
//! The sequences are fixed: a failure repeats itself, and prints its smallest case.

use std::path::Path;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use tensormass_codegen::law::ast::{Invariant, Scalar, ScalarNode, Tensor, TensorNode};
use tensormass_codegen::law::parse;

/// A scalar as the law language has it.
#[derive(Debug, Clone)]
enum Tree {
    /// Eighths, written as decimals.
    Eighths(u16),
    Parameter(usize),
    Invariant(usize),
    /// One of the values that the `let`s before it name, if there are any.
    Named(Index),
    Trace(Box<Sym>),
    Det(Box<Sym>),
    Ddot(Box<Sym>, Box<Sym>),
    Binary(char, Box<Tree>, Box<Tree>),
    Neg(Box<Tree>),
    /// A function of one argument, and whether it is written as a method.
    Function(&'static str, bool, Box<Tree>),
    Powi(bool, Box<Tree>, i32),
    Powf(bool, Box<Tree>, u16),
    /// Comparison, its two sides, and the two values.
    Select(&'static str, Box<[Tree; 4]>),
}

/// A symmetric tensor.
#[derive(Debug, Clone)]
enum Sym {
    Leaf(usize),
    Sum(char, Box<Sym>, Box<Sym>),
    /// Scalar times tensor, or tensor times scalar.
    Scaled(bool, Tree, Box<Sym>),
    Over(Box<Sym>, Tree),
    Neg(Box<Sym>),
}

const INVARIANTS: [(&str, Invariant); 6] = [
    ("I1", Invariant::I1),
    ("I2", Invariant::I2),
    ("I3", Invariant::I3),
    ("J", Invariant::J),
    ("I1bar", Invariant::I1bar),
    ("I2bar", Invariant::I2bar),
];
const PARAMETERS: [&str; 3] = ["p.a", "p.b[0]", "p.b[1]"];
const LEAVES: [&str; 3] = ["s.E", "s.C", "identity()"];

/// How strongly text binds: a sum, a product, a sign, what needs no brackets.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Sign,
    Whole,
}

/// In brackets, unless it binds at least as strongly as its place asks.
fn within(place: Binding, (text, binding): (String, Binding)) -> String {
    if binding >= place { text } else { format!("({text})") }
}

fn decimal(eighths: u16) -> String {
    format!("{:?}", f64::from(eighths) / 8.0)
}

fn called(name: &str, method: bool, x: (String, Binding), argument: &str) -> (String, Binding) {
    let text = match (method, argument) {
        (true, argument) => format!("{}.{name}({argument})", within(Binding::Whole, x)),
        (false, "") => format!("{name}({})", x.0),
        (false, argument) => format!("{name}({}, {argument})", x.0),
    };
    (text, Binding::Whole)
}

impl Tree {
    /// The text with as few brackets as Rust allows; `names` is the number of `let`s before it.
    fn text(&self, names: usize) -> (String, Binding) {
        let whole = |text: String| (text, Binding::Whole);
        match self {
            Tree::Eighths(n) => whole(decimal(*n)),
            Tree::Parameter(k) => whole(PARAMETERS[*k].to_owned()),
            Tree::Invariant(k) => whole(format!("s.{}", INVARIANTS[*k].0)),
            Tree::Named(_) if names == 0 => whole("s.J".to_owned()),
            Tree::Named(index) => whole(format!("x{}", index.index(names))),
            Tree::Trace(a) => whole(format!("tr({})", a.text(names).0)),
            Tree::Det(a) => whole(format!("det({})", a.text(names).0)),
            Tree::Ddot(a, b) => whole(format!("ddot({}, {})", a.text(names).0, b.text(names).0)),
            Tree::Binary(operator, a, b) => binary(*operator, a.text(names), b.text(names)),
            Tree::Neg(a) => (format!("-{}", within(Binding::Sign, a.text(names))), Binding::Sign),
            Tree::Function(name, method, a) => called(name, *method, a.text(names), ""),
            Tree::Powi(method, a, n) => called("powi", *method, a.text(names), &n.to_string()),
            Tree::Powf(method, a, n) => called("powf", *method, a.text(names), &decimal(*n)),
            Tree::Select(comparison, parts) => {
                let [a, b, x, y] = parts.each_ref().map(|part| part.text(names).0);
                whole(format!("select({a} {comparison} {b}, {x}, {y})"))
            }
        }
    }

    /// Whether `node` is this tree; `values` are those of the `let`s before it.
    fn is(&self, node: &Scalar, values: &[Tree]) -> bool {
        let all = |pairs: &[(&Tree, &Scalar)]| pairs.iter().all(|(tree, node)| tree.is(node, values));
        match (self, &**node) {
            (Tree::Eighths(n), ScalarNode::Number(q)) => *q == num_rational::Ratio::new(i128::from(*n), 8),
            (Tree::Parameter(k), ScalarNode::Parameter { parameter, component }) => {
                [(0, 0), (1, 0), (1, 1)][*k] == (*parameter, *component)
            }
            (Tree::Invariant(k), ScalarNode::Invariant(i)) => INVARIANTS[*k].1 == *i,
            (Tree::Named(_), ScalarNode::Invariant(i)) => values.is_empty() && *i == Invariant::J,
            (Tree::Named(index), ScalarNode::Named(name, value)) => {
                let k = index.index(values.len().max(1));
                values.get(k).is_some_and(|tree| *name == format!("x{k}") && tree.is(value, &values[..k]))
            }
            (Tree::Trace(a), ScalarNode::Trace(x)) | (Tree::Det(a), ScalarNode::Det(x)) => a.is(x, values),
            (Tree::Ddot(a, b), ScalarNode::Ddot(x, y)) => a.is(x, values) && b.is(y, values),
            (Tree::Binary('+', a, b), ScalarNode::Add(x, y))
            | (Tree::Binary('-', a, b), ScalarNode::Sub(x, y))
            | (Tree::Binary('*', a, b), ScalarNode::Mul(x, y))
            | (Tree::Binary('/', a, b), ScalarNode::Div(x, y)) => all(&[(a, x), (b, y)]),
            (Tree::Neg(a), ScalarNode::Neg(x))
            | (Tree::Function("ln", _, a), ScalarNode::Ln(x))
            | (Tree::Function("exp", _, a), ScalarNode::Exp(x))
            | (Tree::Function("sqrt", _, a), ScalarNode::Sqrt(x)) => a.is(x, values),
            (Tree::Function("pos", _, a), ScalarNode::Select { left, right, then, otherwise }) => {
                all(&[(a, left), (&Tree::Eighths(0), right), (a, then), (&Tree::Eighths(0), otherwise)])
            }
            (Tree::Powi(_, a, n), ScalarNode::Powi(x, m)) => n == m && a.is(x, values),
            (Tree::Powf(_, a, n), ScalarNode::Powf(x, y)) => all(&[(a, x), (&Tree::Eighths(*n), y)]),
            (Tree::Select(comparison, parts), ScalarNode::Select { left, right, then, otherwise }) => {
                let [a, b, x, y] = &**parts;
                match *comparison {
                    ">" => all(&[(a, left), (b, right), (x, then), (y, otherwise)]),
                    "<" => all(&[(b, left), (a, right), (x, then), (y, otherwise)]),
                    "<=" => all(&[(a, left), (b, right), (y, then), (x, otherwise)]),
                    _ => all(&[(b, left), (a, right), (y, then), (x, otherwise)]),
                }
            }
            _ => false,
        }
    }
}

fn binary(operator: char, a: (String, Binding), b: (String, Binding)) -> (String, Binding) {
    // Chains lean to the left: a right operand needs to bind more strongly.
    let (own, right) = match operator {
        '+' | '-' => (Binding::Sum, Binding::Product),
        _ => (Binding::Product, Binding::Sign),
    };
    (format!("{} {operator} {}", within(own, a), within(right, b)), own)
}

impl Sym {
    fn text(&self, names: usize) -> (String, Binding) {
        match self {
            Sym::Leaf(k) => (LEAVES[*k].to_owned(), Binding::Whole),
            Sym::Sum(operator, a, b) => binary(*operator, a.text(names), b.text(names)),
            Sym::Scaled(true, s, a) => binary('*', s.text(names), a.text(names)),
            Sym::Scaled(false, s, a) => binary('*', a.text(names), s.text(names)),
            Sym::Over(a, s) => binary('/', a.text(names), s.text(names)),
            Sym::Neg(a) => (format!("-{}", within(Binding::Sign, a.text(names))), Binding::Sign),
        }
    }

    fn is(&self, node: &Tensor, values: &[Tree]) -> bool {
        let one = || Box::new(Tree::Eighths(8));
        match (self, &**node) {
            (Sym::Leaf(0), TensorNode::E) | (Sym::Leaf(1), TensorNode::C) | (Sym::Leaf(2), TensorNode::Identity) => {
                true
            }
            (Sym::Sum('+', a, b), TensorNode::Add(x, y)) | (Sym::Sum(_, a, b), TensorNode::Sub(x, y)) => {
                a.is(x, values) && b.is(y, values)
            }
            (Sym::Scaled(_, s, a), TensorNode::Scale(t, x)) => s.is(t, values) && a.is(x, values),
            (Sym::Over(a, s), TensorNode::Scale(t, x)) => {
                Tree::Binary('/', one(), Box::new(s.clone())).is(t, values) && a.is(x, values)
            }
            (Sym::Neg(a), TensorNode::Scale(t, x)) => Tree::Neg(one()).is(t, values) && a.is(x, values),
            _ => false,
        }
    }
}

/// A tree with a field of the strain as its first term: no constant, which could be refused as a divisor, and no bare
/// number, which has no methods.
fn varying(tree: impl Strategy<Value = Tree> + Clone) -> impl Strategy<Value = Tree> + Clone {
    (0..INVARIANTS.len(), select(&['+', '-', '*'][..]), tree)
        .prop_map(|(k, operator, tree)| Tree::Binary(operator, Box::new(Tree::Invariant(k)), Box::new(tree)))
}

/// Symmetric tensors with factors and divisors of this kind.
fn symmetric(scalar: BoxedStrategy<Tree>) -> impl Strategy<Value = Sym> + Clone {
    (0..LEAVES.len()).prop_map(Sym::Leaf).prop_recursive(3, 8, 2, move |inner| {
        let boxed = inner.clone().prop_map(Box::new);
        prop_oneof![
            (select(&['+', '-'][..]), boxed.clone(), boxed.clone()).prop_map(|(o, a, b)| Sym::Sum(o, a, b)),
            (any::<bool>(), scalar.clone(), boxed.clone()).prop_map(|(first, s, a)| Sym::Scaled(first, s, a)),
            (boxed.clone(), varying(scalar.clone())).prop_map(|(a, s)| Sym::Over(a, s)),
            boxed.prop_map(Sym::Neg),
        ]
    })
}

fn tree() -> impl Strategy<Value = Tree> {
    let leaf = prop_oneof![
        (0..2000u16).prop_map(Tree::Eighths),
        (0..PARAMETERS.len()).prop_map(Tree::Parameter),
        (0..INVARIANTS.len()).prop_map(Tree::Invariant),
        any::<Index>().prop_map(Tree::Named),
    ];
    leaf.prop_recursive(5, 40, 4, |inner| {
        let boxed = inner.clone().prop_map(Box::new);
        let divisor = varying(inner.clone()).prop_map(Box::new);
        let tensor = symmetric(inner.clone().boxed()).prop_map(Box::new);
        let four = [inner.clone(), inner.clone(), inner.clone(), inner];
        prop_oneof![
            (select(&['+', '-', '*'][..]), boxed.clone(), boxed.clone()).prop_map(|(o, a, b)| Tree::Binary(o, a, b)),
            (boxed.clone(), divisor.clone()).prop_map(|(a, b)| Tree::Binary('/', a, b)),
            boxed.clone().prop_map(Tree::Neg),
            (select(&["ln", "exp", "sqrt"][..]), any::<bool>(), divisor.clone())
                .prop_map(|(name, method, a)| Tree::Function(name, method, a)),
            boxed.prop_map(|a| Tree::Function("pos", false, a)),
            (any::<bool>(), divisor.clone(), -9..9i32).prop_map(|(method, a, n)| Tree::Powi(method, a, n)),
            (any::<bool>(), divisor, 1..99u16).prop_map(|(method, a, n)| Tree::Powf(method, a, n)),
            (select(&["<", ">", "<=", ">="][..]), four).prop_map(|(c, parts)| Tree::Select(c, Box::new(parts))),
            tensor.clone().prop_map(Tree::Trace),
            tensor.clone().prop_map(Tree::Det),
            (tensor.clone(), tensor).prop_map(|(a, b)| Tree::Ddot(a, b)),
        ]
    })
}

/// A law file of `let`s, each of which may use those before it, and of the last value times a modulus.
fn file(values: &[Tree]) -> String {
    let mut text = String::from(
        "//! Random.\n#[domain(J > 0.0)]\nstruct Parameters {\n/// One.\n#[unit(\"1\")] #[range(0.5, 2.0)] a: f64,\n\
         /// Two.\n#[unit(\"1\")] #[range(0.5, 2.0)] b: [f64; 2],\n/// Modulus.\n#[unit(\"Pa\")] #[range(0.0, 1e9)] c: f64,\n}\n\
         fn energy_density(s: Strain, p: Parameters) -> f64 {\n",
    );
    for (k, value) in values.iter().enumerate() {
        text += &format!("    let x{k} = {};\n", value.text(k).0);
    }
    // All parameters are used, whatever was drawn.
    text + format!("    p.c * s.I1 * x{} + p.a * p.b[0] * p.b[1] * p.c\n}}\n", values.len() - 1).as_str()
}

fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

/// The file of these values is read as they are.
fn check(values: &[Tree]) -> Result<(), TestCaseError> {
    let text = file(values);
    let law = parse("laws/random.rs", &text).map_err(|errors| {
        let errors: Vec<String> = errors.iter().map(ToString::to_string).collect();
        TestCaseError::fail(format!("{}\n\nin\n{text}", errors.join("\n")))
    })?;
    let (last, before) = values.split_last().expect("at least one value");
    let factor = match &*law.energy {
        ScalarNode::Add(product, _) => match &**product {
            ScalarNode::Mul(_, factor) => Some(factor),
            _ => None,
        },
        _ => None,
    };
    match factor.map(|factor| &**factor) {
        Some(ScalarNode::Named(_, value)) => prop_assert!(last.is(value, before), "read as another tree:\n{text}"),
        // A value that is a `let` of another name, or a field, has its own name only.
        _ => prop_assert!(false, "the energy is no product with a named value:\n{text}"),
    }
    Ok(())
}

#[test]
fn a_printed_law_is_read_as_its_tree() {
    runner(256).run(&vec(tree(), 1..4), |values| check(&values)).unwrap_or_else(|error| panic!("{error}"));
}

/// Texts of the repository's laws, to be damaged.
fn laws() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../laws");
    let paths = std::fs::read_dir(folder).expect("laws/").map(|entry| entry.expect("an entry").path());
    let mut paths: Vec<_> = paths.filter(|path| path.extension().is_some_and(|e| e == "rs")).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read_to_string(path).expect("a law file")).collect()
}

/// A change of a text: from one place to another, characters are replaced.
type Damage = (Index, Index, String);

fn damaged(text: &str, damages: &[Damage]) -> String {
    let mut text: Vec<char> = text.chars().collect();
    for (from, length, insertion) in damages {
        let from = from.index(text.len() + 1);
        let to = (from + length.index(12)).min(text.len());
        text.splice(from..to, insertion.chars());
    }
    text.into_iter().collect()
}

#[test]
fn damaged_laws_never_panic() {
    let strategy = (select(laws()), vec((any::<Index>(), any::<Index>(), "[ -~\u{80}-\u{3ff}\n]{0,6}"), 1..6));
    let test = |(text, damages): (String, Vec<Damage>)| {
        let text = damaged(&text, &damages);
        if let Err(errors) = parse("laws/damaged.rs", &text) {
            prop_assert!(!errors.is_empty(), "refused without a reason:\n{text}");
        }
        Ok(())
    };
    runner(4000).run(&strategy, test).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn cut_laws_never_panic() {
    let strategy = (select(laws()), any::<Index>(), any::<Index>());
    let test = |(text, from, to): (String, Index, Index)| {
        let characters: Vec<char> = text.chars().collect();
        let (a, b) = (from.index(characters.len()), to.index(characters.len()));
        let part: String = characters[a.min(b)..a.max(b)].iter().collect();
        prop_assert!(parse("laws/cut.rs", &part).is_err(), "a part of a law is no law:\n{part}");
        Ok(())
    };
    runner(1000).run(&strategy, test).unwrap_or_else(|error| panic!("{error}"));
}

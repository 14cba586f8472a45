//! A derivation for the reader: the material's constants, what was rewritten for the sake of accuracy at rest, and the
//! named stages of each kernel as formulas.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Input, Op, ValidKernel, ValueId};
use tensormass_codegen::law::ast::{Acceptance, Law};

/// Formulas longer than this are cut.
const LONGEST: usize = 160;

/// The derivation of a law as a page of text.
pub fn page(law: &Law, derivation: &Derivation) -> String {
    let mut page = format!("{}\n\nconstants, computed once a material\n", derivation.law);
    for (k, constant) in derivation.constants.iter().enumerate() {
        page += &format!("  c{k} = {constant}\n");
    }
    page += &format!("\nW at rest, which is subtracted\n  {}\n", derivation.energy_at_rest);
    for line in accepted(law) {
        page += &format!("\naccepted without proof: {line}\n");
    }
    page += &rewrites(derivation);
    for kernel in derivation.kernels.iter().filter(|k| k.ir().name != "material") {
        page += &format!("\n{}: {} operations\n", kernel.ir().name, kernel.count().arithmetic());
        for (name, formula) in stages(kernel) {
            page += &format!("  {name} = {formula}\n");
        }
    }
    page
}

/// What the law's author vouches for, one line each.
pub fn accepted(law: &Law) -> Vec<String> {
    let line = |a: &Acceptance| format!("the {} of `{}`, because: {}", a.kind.name(), a.constant, a.reason);
    law.acceptances.iter().map(line).collect()
}

/// Each rewrite: the term as the law file has it, its exact constant at rest, and what is computed instead.
fn rewrites(derivation: &Derivation) -> String {
    let mut page = String::new();
    let mut kernel = "";
    for r in &derivation.rewrites {
        if r.kernel != kernel {
            kernel = &r.kernel;
            let what = if kernel == "energy" { "constant and linear part" } else { "constant" };
            page += &format!("\n{kernel}, split at rest: term -> {what} at rest, and what is computed of it\n");
        }
        page += &format!("  {}\n    -> {}\n     + {}\n", r.term, r.rest, r.form);
    }
    if page.is_empty() { "\nnothing cancels at rest: no term is rewritten\n".into() } else { page }
}

/// The named values of a kernel, in order, in terms of inputs and of names before them.
pub fn stages(kernel: &ValidKernel) -> Vec<(String, String)> {
    let values = &kernel.ir().values;
    let mut texts: Vec<(String, u8)> = Vec::with_capacity(values.len());
    let mut stages = vec![];
    for (i, definition) in values.iter().enumerate() {
        let formula = formula(&definition.op, &texts);
        match &definition.name {
            // A letter and two digits may be an input's name too: inputs are never named.
            Some(name) => {
                stages.push((name.clone(), cut(&formula.0)));
                texts.push((name.clone(), ATOM));
            }
            None => texts.push(formula),
        }
        debug_assert_eq!(texts.len(), i + 1);
    }
    for (role, outputs) in &kernel.ir().outputs {
        // An output that is a named value says nothing new.
        let unnamed: Vec<&ValueId> = outputs.iter().filter(|v| values[v.index()].name.is_none()).collect();
        for v in unnamed {
            let at = outputs.iter().position(|o| o == v).unwrap_or(0);
            let index = if outputs.len() == 1 { String::new() } else { format!("[{at}]") };
            stages.push((format!("{}{index}", role.name()), cut(&texts[v.index()].0)));
        }
    }
    stages
}

/// How tightly a formula holds together: a sum, a product, an atom.
const SUM: u8 = 0;
const PRODUCT: u8 = 1;
const ATOM: u8 = 2;

fn formula(op: &Op, texts: &[(String, u8)]) -> (String, u8) {
    let at = |v: ValueId, least: u8| {
        let (text, hold) = &texts[v.index()];
        // Cut inside too: values that share parts would grow without bound.
        let text = cut(text);
        if *hold < least { format!("({text})") } else { text }
    };
    let call = |name: &str, arguments: &[ValueId]| {
        let arguments: Vec<String> = arguments.iter().map(|v| at(*v, SUM)).collect();
        (format!("{name}({})", arguments.join(", ")), ATOM)
    };
    match *op {
        Op::Input(role, k) => (input(role, k), ATOM),
        Op::Const(q) => (q.to_string(), if q.is_integer() && *q.numer() >= 0 { ATOM } else { SUM }),
        Op::Add(a, b) => (format!("{} + {}", at(a, SUM), at(b, SUM)), SUM),
        Op::Sub(a, b) => (format!("{} - {}", at(a, SUM), at(b, PRODUCT)), SUM),
        Op::Mul(a, b) => (format!("{} {}", at(a, PRODUCT), at(b, PRODUCT)), PRODUCT),
        Op::Div(a, b) => (format!("{} / {}", at(a, PRODUCT), at(b, ATOM)), PRODUCT),
        Op::Neg(a) => (format!("-{}", at(a, PRODUCT)), SUM),
        Op::Fma(a, b, c) => (format!("{} {} + {}", at(a, PRODUCT), at(b, PRODUCT), at(c, SUM)), SUM),
        Op::Powf(a, b) => (format!("{}^{}", at(a, ATOM), at(b, ATOM)), ATOM),
        Op::Sqrt(a) => call("sqrt", &[a]),
        Op::Ln(a) => call("ln", &[a]),
        Op::Exp(a) => call("exp", &[a]),
        Op::Log1p(a) => call("log1p", &[a]),
        Op::Expm1(a) => call("expm1", &[a]),
        Op::Log1pmx(a) => call("log1pmx", &[a]),
        Op::Expm1mx(a) => call("expm1mx", &[a]),
        Op::Select(l, r, a, b) => {
            let [l, r, a, b] = [l, r, a, b].map(|v| at(v, SUM));
            (format!("({a} where {l} > {r}, else {b})"), ATOM)
        }
    }
}

fn input(role: Input, k: u32) -> String {
    let matrix = |letter: &str| format!("{letter}{}{}", k / 3, k % 3);
    match role {
        Input::Constants => format!("c{k}"),
        Input::DisplacementGradient => matrix("G"),
        Input::GradientIncrement => matrix("dG"),
        Input::NodeGradient => format!("g{k}"),
        _ => format!("{}[{k}]", role.name()),
    }
}

fn cut(text: &str) -> String {
    if text.len() <= LONGEST { text.to_string() } else { text.chars().take(LONGEST).collect::<String>() + " ..." }
}

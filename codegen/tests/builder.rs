//! What the builder folds, shares, fuses and drops while a kernel is built.

use tensormass_codegen::ir::{Builder, Input, KernelIr, Op, Output, Rational, ValueId};

/// Builds a kernel of three constants a, b, c and compares what defines its result.
fn check(case: usize, expected: &str, f: impl FnOnce(&mut Builder, [ValueId; 3]) -> ValueId) {
    let mut b = Builder::new();
    let inputs = [0, 1, 2].map(|k| b.input(Input::Constants, k));
    let result = f(&mut b, inputs);
    let ir = b.finish("k", vec![(Input::Constants, 3)], vec![(Output::EnergyDensity, vec![result])]);
    assert_eq!(expression(&ir, ir.outputs[0].1[0]), expected, "case {case}");
}

fn expression(ir: &KernelIr, v: ValueId) -> String {
    let x = |v: ValueId| expression(ir, v);
    match ir.values[v.index()].op {
        Op::Input(_, k) => ["a", "b", "c"][k as usize].to_string(),
        Op::Const(q) => q.to_string(),
        Op::Add(a, b) => format!("({} + {})", x(a), x(b)),
        Op::Sub(a, b) => format!("({} - {})", x(a), x(b)),
        Op::Mul(a, b) => format!("({} * {})", x(a), x(b)),
        Op::Div(a, b) => format!("({} / {})", x(a), x(b)),
        Op::Neg(a) => format!("-{}", x(a)),
        other => format!("{other:?}"),
    }
}

#[test]
fn the_builder_folds() {
    type Build = fn(&mut Builder, [ValueId; 3]) -> ValueId;
    fn n(b: &mut Builder, numerator: i128, denominator: i128) -> ValueId {
        b.number(Rational::new(numerator, denominator))
    }
    let cases: &[(Build, &str)] = &[
        (
            |b, [x, ..]| {
                let zero = n(b, 0, 1);
                b.add(x, zero)
            },
            "a",
        ),
        (
            |b, [x, ..]| {
                let zero = n(b, 0, 1);
                b.add(zero, x)
            },
            "a",
        ),
        (
            |b, _| {
                let (x, y) = (n(b, 1, 2), n(b, 1, 3));
                b.add(x, y)
            },
            "5/6",
        ),
        (|b, [x, y, _]| b.add(y, x), "(a + b)"),
        (
            |b, [x, ..]| {
                let zero = n(b, 0, 1);
                b.sub(x, zero)
            },
            "a",
        ),
        (
            |b, [x, ..]| {
                let zero = n(b, 0, 1);
                b.sub(zero, x)
            },
            "-a",
        ),
        (
            |b, _| {
                let (x, y) = (n(b, 1, 2), n(b, 1, 3));
                b.sub(x, y)
            },
            "1/6",
        ),
        (|b, [x, y, _]| b.sub(y, x), "(b - a)"),
        (
            |b, [x, ..]| {
                let one = n(b, 1, 1);
                b.mul(x, one)
            },
            "a",
        ),
        (
            |b, [x, ..]| {
                let minus = n(b, -1, 1);
                b.mul(minus, x)
            },
            "-a",
        ),
        (
            |b, _| {
                let (x, y) = (n(b, 1, 2), n(b, 1, 3));
                b.mul(x, y)
            },
            "1/6",
        ),
        (|b, [x, y, _]| b.mul(y, x), "(a * b)"),
        (
            |b, [x, ..]| {
                let one = n(b, 1, 1);
                b.div(x, one)
            },
            "a",
        ),
        (
            |b, _| {
                let (x, y) = (n(b, 1, 2), n(b, 1, 3));
                b.div(x, y)
            },
            "3/2",
        ),
        (|b, [x, y, _]| b.div(x, y), "(a / b)"),
        (
            |b, [x, ..]| {
                let minus = b.neg(x);
                b.neg(minus)
            },
            "a",
        ),
        (
            |b, _| {
                let x = n(b, 1, 2);
                b.neg(x)
            },
            "-1/2",
        ),
        // A reciprocal that one product uses is a division; one that two use stays.
        (
            |b, [x, y, _]| {
                let r = b.recip(y);
                b.mul(x, r)
            },
            "(a / b)",
        ),
        (
            |b, [x, y, _]| {
                let r = b.recip(x);
                b.mul(r, y)
            },
            "(b / a)",
        ),
        (
            |b, [x, y, z]| {
                let r = b.recip(z);
                let (p, q) = (b.mul(x, r), b.mul(y, r));
                b.sub(p, q)
            },
            "((a * (1 / c)) - (b * (1 / c)))",
        ),
        (
            |b, [x, y, _]| {
                let half = n(b, 1, 2);
                let d = b.div(half, y);
                b.mul(x, d)
            },
            "(a * (1/2 / b))",
        ),
    ];
    for (k, (build, expected)) in cases.iter().enumerate() {
        check(k, expected, *build);
    }
}

#[test]
fn equal_values_are_one_and_dead_ones_go() {
    let mut b = Builder::new();
    let [x, y] = [0, 1].map(|k| b.input(Input::Constants, k));
    assert_eq!(b.add(x, y), b.add(y, x));
    assert_ne!(b.sub(x, y), b.sub(y, x));
    let product = b.mul(x, y);
    b.name(product, "first");
    b.name(product, "second");
    b.name(x, "an input keeps its own name");
    let ir = b.finish("k", vec![(Input::Constants, 2)], vec![(Output::EnergyDensity, vec![product])]);
    let text = "kernel k\nin constants 2\nv0 = input constants 0\nv1 = input constants 1\n\
                v2 = mul v0 v1                           # first\nout energy_density v2\nend\n";
    assert_eq!(ir.to_text(), text);
    assert_eq!(ir.validate().expect("valid").count().arithmetic(), 1);
}

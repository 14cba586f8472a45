//! The kernel language: what the validator refuses, what its text is, what its operations mean.

use tensormass_codegen::ir::{Definition, Input, KernelIr, Op, Output, Rational, ValidKernel, ValueId};

const CONSTANTS: Input = Input::Constants;

/// Two constants in, their sum and product's quotient out: valid, and every case below breaks one rule of it.
const TEXT: &str = "\
kernel k
in constants 2
v0 = input constants 0
v1 = input constants 1
v2 = add v0 v1                           # sum
v3 = const -2/3
v4 = mul v2 v3
out energy_density v4
end
";

fn read(text: &str) -> Result<KernelIr, String> {
    let mut lines = text.lines().enumerate().map(|(i, l)| (i + 1, l)).peekable();
    KernelIr::from_lines(&mut lines).map_err(|e| e.to_string())
}

/// Replaces a part of [`TEXT`], reads and validates it, and compares the message.
fn check(part: &str, replacement: &str, expected: &str) {
    assert!(TEXT.contains(part), "{part}");
    let message = read(&TEXT.replacen(part, replacement, 1)).and_then(|ir| ir.validate().map_err(|e| e.to_string()));
    assert_eq!(message.expect_err("the change breaks a rule"), expected, "`{part}` replaced by `{replacement}`");
}

#[test]
fn the_text_is_the_kernel() {
    let ir = read(TEXT).expect("well-formed");
    assert_eq!(ir.to_text(), TEXT);
    assert_eq!(ir.values[2], Definition { op: Op::Add(ValueId(0), ValueId(1)), name: Some("sum".into()) });
    assert_eq!(ir.values[3].op, Op::Const(Rational::new(-2, 3)));
    assert_eq!(ir.outputs, [(Output::EnergyDensity, vec![ValueId(4)])]);
    ir.validate().expect("valid");
    // The lines after `end` belong to whoever reads next.
    let mut lines = format!("{TEXT}rest").leak().lines().enumerate().peekable();
    KernelIr::from_lines(&mut lines).expect("well-formed");
    assert_eq!(lines.next(), Some((9, "rest")));
}

#[test]
fn every_operation_and_role_has_a_text() {
    let text = "\
kernel k
in parameters 1
in constants 1
in displacement_gradient 9
in gradient_increment 9
in node_gradient 3
in nodal_displacement 12
in shape_gradients 9
in weight 1
in stress 9
v0 = input weight 0
v1 = const 7
v2 = add v0 v1
v3 = sub v0 v1
v4 = mul v0 v1
v5 = div v0 v1
v6 = neg v0
v7 = fma v0 v1 v2
v8 = sqrt v0
v9 = ln v0
v10 = exp v0
v11 = log1p v0
v12 = expm1 v0
v13 = powf v0 v1
v14 = select v0 v1 v2 v3
v15 = log1pmx v0
v16 = expm1mx v0
out constants v2
out energy_density v2
out stress v2
out stress_increment v2
out diagonal v2
out cauchy v2
out domain_margin v2
out near_rest v2
out displacement_gradient v2
out nodal_force v2
out node_gradients v2
end
";
    assert_eq!(read(text).expect("well-formed").to_text(), text);
}

#[test]
fn the_validator_refuses() {
    check("kernel k", "kernel K-1", "kernel `K-1`: its name `K-1` is not a snake_case identifier");
    check("in constants 2", "in constants 2\nin constants 2", "kernel `k`: input Constants is declared twice");
    check("in constants 2", "in constants 2\nin weight 3", "kernel `k`: input Weight has length 3");
    check(
        "v4 = mul v2 v3",
        "v4 = add v0 v1",
        "kernel `k`: value 4 repeats an earlier one: Add(ValueId(0), ValueId(1))",
    );
    check("add v0 v1", "add v0 v4", "kernel `k`: value 2 reads value 4 before it is defined");
    check("add v0 v1", "add v0 v2", "kernel `k`: value 2 reads value 2 before it is defined");
    check("input constants 1", "input weight 0", "kernel `k`: value 1 reads the undeclared input Weight");
    check("input constants 1", "input constants 2", "kernel `k`: value 1 reads component 2 of Constants, which has 2");
    check("-2/3\nv4 = mul", "0\nv4 = div", "kernel `k`: value 4 divides by zero");
    check("out energy_density v4\n", "", "kernel `k`: it has no output");
    let twice = "out energy_density v4\nout energy_density v4";
    check("out energy_density v4", twice, "kernel `k`: output EnergyDensity is declared twice");
    check("energy_density v4", "energy_density v4 v2", "kernel `k`: output EnergyDensity has length 2");
    check("energy_density v4", "energy_density v5", "kernel `k`: output EnergyDensity reads the undefined value 5");
    check("energy_density v4", "energy_density v2", "kernel `k`: value 4 is never used");
}

#[test]
fn the_reader_refuses() {
    check("kernel k", "kernels", "line 1: expected `kernel NAME`, found `kernels`");
    check("constants 2", "constant 2", "line 2: unknown input `constant`");
    check("constants 2", "constants two", "line 2: `two` is not a length");
    check("out energy_density", "out energy", "line 8: unknown output `energy`");
    check("density v4", "density 4", "line 8: `4` is not a value");
    check("v1 =", "v2 =", "line 4: expected v1 here, found v2");
    check("v1 =", "w1 =", "line 4: `w1` is not a value");
    check("= add v0 v1 ", "=", "line 5: an operation is missing");
    check("add v0 v1", "add v0", "line 5: unknown operation `add` with 1 operands");
    check("add v0 v1", "plus v0 v1", "line 5: unknown operation `plus` with 2 operands");
    check("add v0 v1", "add v0 x1", "line 5: `x1` is not a value");
    check("input constants 1", "input constant 1", "line 4: unknown input `constant`");
    check("input constants 1", "input constants one", "line 4: `one` is not a component");
    for bad in ["1/0", "0.5", "", "1/", "-170141183460469231731687303715884105728"] {
        let message = match bad {
            "" => "line 6: unknown operation `const` with 0 operands".to_string(),
            _ => format!("line 6: `{bad}` is not a rational number"),
        };
        check("-2/3", bad, &message);
    }
    check("out energy_density v4", "give v4", "line 8: cannot read `give v4`");
    check("\nend", "", "line 1: kernel `k` has no `end`");
    assert_eq!(read("").expect_err("nothing there"), "line 0: the text ends where a kernel was expected");
}

/// A kernel of one operation on three constants.
fn single(op: Op) -> ValidKernel {
    let used = op.operands().iter().map(|v| v.0).max().expect("an operand") + 1;
    let mut values: Vec<_> = (0..used).map(|k| Definition { op: Op::Input(CONSTANTS, k), name: None }).collect();
    values.push(Definition { op, name: None });
    let outputs = vec![(Output::EnergyDensity, vec![ValueId(used)])];
    KernelIr { name: "k".into(), inputs: vec![(CONSTANTS, 4)], values, outputs }.validate().expect("valid")
}

#[test]
fn operations_mean_what_the_table_says() {
    let [a, b, c, d] = [0, 1, 2, 3].map(ValueId);
    let run = |op: Op, x: [f64; 4]| single(op).interpret(&[(CONSTANTS, x.as_slice())]).expect("four constants")[0][0];
    // 1 + 2^-53 rounds to 1: the product's last half digit survives a fused operation alone.
    let (x, product) = (1.0 + f64::EPSILON, 1.0 + 2.0 * f64::EPSILON);
    assert_eq!(run(Op::Fma(a, a, b), [x, -product, 0.0, 0.0]), f64::EPSILON * f64::EPSILON);
    assert_eq!(x * x - product, 0.0);
    // ln(1 + 1e-20) and exp(1e-20) - 1 are 1e-20, not 0.
    assert_eq!(run(Op::Log1p(a), [1e-20, 0.0, 0.0, 0.0]), 1e-20);
    assert_eq!(run(Op::Expm1(a), [1e-20, 0.0, 0.0, 0.0]), 1e-20);
    // Their remainders begin with x^2 / 2.
    let half_square = 0.5 * 1e-20 * 1e-20;
    assert_eq!(run(Op::Log1pmx(a), [1e-20, 0.0, 0.0, 0.0]), half_square);
    assert_eq!(run(Op::Expm1mx(a), [1e-20, 0.0, 0.0, 0.0]), half_square);
    let select = Op::Select(a, b, c, d);
    assert_eq!(run(select, [2.0, 1.0, 3.0, 4.0]), 3.0);
    assert_eq!(run(select, [1.0, 1.0, 3.0, 4.0]), 4.0, "equal is not greater");
    assert_eq!(run(select, [f64::NAN, 1.0, 3.0, 4.0]), 4.0, "a comparison with NaN is false");
    assert!(run(select, [2.0, 1.0, f64::NAN, 4.0]).is_nan() && run(select, [0.0, 1.0, f64::NAN, 4.0]) == 4.0);
    let cases = [
        (Op::Add(a, b), 5.0),
        (Op::Sub(a, b), -1.0),
        (Op::Mul(a, b), 6.0),
        (Op::Div(b, a), 1.5),
        (Op::Powf(a, b), 8.0),
        (Op::Neg(a), -2.0),
        (Op::Sqrt(a), std::f64::consts::SQRT_2),
        (Op::Ln(a), std::f64::consts::LN_2),
        (Op::Exp(a), 2.0f64.exp()),
    ];
    for (op, expected) in cases {
        assert_eq!(run(op, [2.0, 3.0, 0.0, 0.0]), expected, "{op:?}");
    }
}

#[test]
fn the_interpreter_refuses_other_inputs() {
    let kernel = read(TEXT).expect("well-formed").validate().expect("valid");
    let message = |inputs: &[(Input, &[f64])]| kernel.interpret(inputs).expect_err("wrong inputs").to_string();
    assert_eq!(message(&[]), "kernel `k` needs 2 components of Constants, and was given 0");
    assert_eq!(message(&[(CONSTANTS, &[1.0])]), "kernel `k` needs 2 components of Constants, and was given 1");
    // A constant is rounded to the working type, once.
    assert_eq!(kernel.interpret(&[(CONSTANTS, [1.0f32, 0.5].as_slice())]).expect("two"), [[-2.0f32 / 3.0 * 1.5]]);
}

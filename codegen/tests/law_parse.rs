//! Good law files: what the parser makes of them. The tree is compared as a formula, so that a failure can be read.

use std::path::Path;

use tensormass_codegen::law::ast::{Law, Scalar, ScalarNode, Tensor, TensorNode};

/// The tree as a formula; `name := (value)` where a `let` named it.
fn scalar(law: &Law, node: &Scalar) -> String {
    let s = |node: &Scalar| scalar(law, node);
    let t = |node: &Tensor| tensor(law, node);
    match &**node {
        ScalarNode::Number(value) => value.to_string(),
        ScalarNode::Parameter { parameter, component } => {
            let parameter = &law.parameters[*parameter];
            if parameter.len > 1 { format!("{}[{component}]", parameter.name) } else { parameter.name.clone() }
        }
        ScalarNode::StretchSum(a) => format!("stretches^{}", s(a)),
        ScalarNode::Invariant(invariant) => {
            let text = format!("{invariant:?}");
            let names: Vec<&str> = invariant.directions().iter().map(|a| law.parameters[*a].name.as_str()).collect();
            let name = text.split('(').next().unwrap_or_default();
            if names.is_empty() { text } else { format!("{name}({})", names.join(", ")) }
        }
        ScalarNode::Trace(a) => format!("tr({})", t(a)),
        ScalarNode::Det(a) => format!("det({})", t(a)),
        ScalarNode::Ddot(a, b) => format!("ddot({}, {})", t(a), t(b)),
        ScalarNode::Add(a, b) => format!("({} + {})", s(a), s(b)),
        ScalarNode::Sub(a, b) => format!("({} - {})", s(a), s(b)),
        ScalarNode::Mul(a, b) => format!("({} * {})", s(a), s(b)),
        ScalarNode::Div(a, b) => format!("({} / {})", s(a), s(b)),
        ScalarNode::Neg(a) => format!("-{}", s(a)),
        ScalarNode::Powi(a, n) => format!("{}^{n}", s(a)),
        ScalarNode::Powf(a, b) => format!("{}^{}", s(a), s(b)),
        ScalarNode::Ln(a) => format!("ln({})", s(a)),
        ScalarNode::Exp(a) => format!("exp({})", s(a)),
        ScalarNode::Sqrt(a) => format!("sqrt({})", s(a)),
        ScalarNode::Select { left, right, then, otherwise } => {
            format!("[{} > {} ? {} : {}]", s(left), s(right), s(then), s(otherwise))
        }
        ScalarNode::Named(name, value) => format!("{name}:={}", s(value)),
        ScalarNode::Rate(a) => format!("{}'", s(a)),
    }
}

fn tensor(law: &Law, node: &Tensor) -> String {
    let t = |node: &Tensor| tensor(law, node);
    match &**node {
        TensorNode::Eps => String::from("eps"),
        TensorNode::E => String::from("E"),
        TensorNode::C => String::from("C"),
        TensorNode::Identity => String::from("1"),
        TensorNode::Add(a, b) => format!("({} + {})", t(a), t(b)),
        TensorNode::Sub(a, b) => format!("({} - {})", t(a), t(b)),
        TensorNode::Scale(s, a) => format!("{}{}", scalar(law, s), t(a)),
        TensorNode::Rate(a) => format!("{}'", t(a)),
    }
}

fn parse(path: &str, text: &str) -> Law {
    tensormass_codegen::law::parse(path, text).unwrap_or_else(|errors| {
        let errors: Vec<String> = errors.iter().map(ToString::to_string).collect();
        panic!("{}\n\nin\n{text}", errors.join("\n"))
    })
}

/// A file with parameters mu and K, a pure number nu, an array c, and the given functions; W has to be `expected`.
fn check(functions: &str, expected: &str) {
    let mut fields = String::new();
    let parameters = [
        ("mu", "Pa", "f64"),
        ("K", "Pa", "f64"),
        ("nu", "1", "f64"),
        ("c", "Pa", "[f64; 3]"),
        ("a", "1", "Direction"),
        ("b", "1", "Direction"),
    ];
    for (name, unit, ty) in parameters {
        if functions.contains(&format!("p.{name}")) || functions.contains(&format!("q.{name}")) {
            let range = if ty == "Direction" { "" } else { "#[range(0.0, 1e9)]" };
            fields.push_str(&format!("/// A constant.\n#[unit(\"{unit}\")] {range} {name}: {ty},\n"));
        }
    }
    let small_strain = if functions.contains("s.eps") { "#[small_strain]\n" } else { "" };
    let head = format!("//! Test.\n#[domain(J > 0.0)]\n{small_strain}struct Parameters {{\n{fields}}}\n");
    let law = parse("laws/test.rs", &format!("{head}{functions}"));
    assert_eq!(law.small_strain, !small_strain.is_empty());
    assert_eq!(scalar(&law, &law.energy), expected, "{functions}");
}

/// The same, for one expression.
fn check_expression(expression: &str, expected: &str) {
    check(&format!("fn energy_density(s: Strain, p: Parameters) -> f64 {{ {expression} }}"), expected);
}

#[test]
fn arithmetic_is_kept_as_written() {
    check_expression("p.mu * s.I1 - 3.0 * p.mu", "((mu * I1) - (3 * mu))");
    check_expression("p.mu * s.J - p.mu - 2.0 * p.mu", "(((mu * J) - mu) - (2 * mu))");
    check_expression("-p.mu * -s.J", "(-mu * -J)");
    check_expression("p.mu / 2.0 * (s.I1bar - 3.0)", "((mu / 2) * (I1bar - 3))");
    check_expression(
        "0.3 * p.mu * s.I2bar * 1e-3 * s.I3 * s.I2 * 2.5e1",
        "((((((3/10 * mu) * I2bar) * 1/1000) * I3) * I2) * 25)",
    );
    check_expression("let a = p.mu / 2.0; let b: f64 = a * s.J; b + a", "(b:=(a:=(mu / 2) * J) + a:=(mu / 2))");
}

#[test]
fn tensors_and_their_functions() {
    check_expression("p.mu * s.stretch_sum(-1.5)", "(mu * stretches^-3/2)");
    check_expression("p.mu * s.stretch_sum(p.nu)", "(mu * stretches^nu)");
    check_expression("p.mu * tr(s.E).powi(2)", "(mu * tr(E)^2)");
    check_expression("p.mu * ddot(s.eps, s.C) + p.mu * det(s.C)", "((mu * ddot(eps, C)) + (mu * det(C)))");
    check_expression(
        "let dev = s.E - tr(s.E) / 3.0 * identity(); p.mu * ddot(dev, dev)",
        "(mu * ddot((E - (tr(E) / 3)1), (E - (tr(E) / 3)1)))",
    );
    check_expression("p.mu * tr(s.C * s.J + s.E / 2.0 - -s.C)", "(mu * tr(((JC + (1 / 2)E) - -1C)))");
}

/// A file with an energy of mu and a, and the dissipation of eta, a rate w and a.
fn check_dissipation(dissipation: &str, expected: &str) {
    let mut fields = String::new();
    for (name, unit) in [("mu", "Pa"), ("eta", "Pa s"), ("w", "1/s")] {
        if name == "mu" || dissipation.contains(&format!("p.{name}")) {
            fields += &format!("/// A constant.\n#[unit(\"{unit}\")] #[range(0.0, 1e9)] {name}: f64,\n");
        }
    }
    let text = format!(
        "//! Test.\n#[domain(J > 0.0)]\nstruct Parameters {{\n{fields}/// Fibres.\na: Direction,\n}}\n\
         fn energy_density(s: Strain, p: Parameters) -> f64 {{ p.mu * s.I4(p.a) }}\n\
         fn square(r: StrainRate) -> f64 {{ ddot(r.E, r.C) }}\n\
         fn dissipation_density(s: Strain, r: StrainRate, p: Parameters) -> f64 {{ {dissipation} }}\n"
    );
    let law = parse("laws/test.rs", &text);
    assert_eq!(scalar(&law, law.dissipation.as_ref().expect("a dissipation")), expected, "{dissipation}");
}

#[test]
fn dissipations_take_rates() {
    check_dissipation("p.eta * square(r) / s.J", "((eta * ddot(E', C')) / J)");
    check_dissipation("p.eta * (square(r) + r.J.powi(2))", "(eta * (ddot(E', C') + J'^2))");
    check_dissipation(
        "p.eta * square(r) + p.eta * r.I4(p.a) * r.stretch_sum(2.0) * tr(s.E)",
        "((eta * ddot(E', C')) + (((eta * I4(a)') * stretches^2') * tr(E)))",
    );
    // Positive at every rate, and so also where a body is at rest.
    check_dissipation(
        "p.eta * p.w.powi(2) * sqrt(1.0 + square(r).powi(2) / p.w.powi(4))",
        "((eta * w^2) * sqrt((1 + (ddot(E', C')^2 / w^4))))",
    );
}

#[test]
fn functions_and_methods() {
    check_expression("p.mu * ln(s.J) + p.mu * s.J.ln()", "((mu * ln(J)) + (mu * ln(J)))");
    check_expression("p.mu * exp(s.J).sqrt() * sqrt(s.J).exp()", "((mu * sqrt(exp(J))) * exp(sqrt(J)))");
    check_expression("p.mu * powi(s.J, -2) * powf(s.I3, p.nu)", "((mu * J^-2) * I3^nu)");
    check_expression("s.J.powf(-2.0 / 3.0) * p.mu", "(J^(-2 / 3) * mu)");
    check_expression("p.mu * pos(s.J - 1.0)", "(mu * [(J - 1) > 0 ? (J - 1) : 0])");
    check_expression("select(s.J > 1.0, p.mu, p.K)", "[J > 1 ? mu : K]");
    check_expression("select(s.J < 1.0, p.mu, p.K)", "[1 > J ? mu : K]");
    check_expression("select(s.J >= 1.0, p.mu, p.K)", "[1 > J ? K : mu]");
    check_expression("select((s.J <= 1.0), p.mu, p.K)", "[J > 1 ? K : mu]");
    check_expression("s.J * shear_modulus(p.K, p.nu)", "(J * (K / (2 * (1 + nu))))");
    check_expression("s.J * lame_lambda(p.K, p.nu)", "(J * ((K * nu) / ((1 + nu) * (1 - (2 * nu)))))");
    check_expression("s.J * bulk_modulus(p.K, p.nu)", "(J * (K / (3 * (1 - (2 * nu)))))");
}

#[test]
fn invariants_with_fibres() {
    check_expression("p.mu * (s.I4(p.a) - 1.0)", "(mu * (I4(a) - 1))");
    check_expression("p.mu * (s.I5(p.a) + s.I4bar(p.b) + s.I5bar(p.a))", "(mu * ((I5(a) + I4bar(b)) + I5bar(a)))");
    // One invariant, however it is written.
    check_expression(
        "p.mu * (s.I8(p.a, p.b) - s.I8(p.b, p.a) * s.I8(p.a, p.a))",
        "(mu * (I8(a, b) - (I8(a, b) * I4(a))))",
    );
    // A helper function takes the strain and the parameters, and with them the directions.
    check(
        "fn fibre(q: Parameters, t: Strain) -> f64 { t.I4(q.a) }\n\
         fn energy_density(s: Strain, p: Parameters) -> f64 { p.mu * fibre(p, s) }",
        "(mu * I4(a))",
    );
}

#[test]
fn directions_are_unit_vectors() {
    for (attributes, default, per_element) in [
        ("", None, false),
        ("#[unit(\"1\")] #[per_element]", None, true),
        ("#[default(0.0, -2.0, 0.0)]", Some(vec![0.0, -1.0, 0.0]), false),
        ("#[default(3e300, 4e300, 0.0)] #[per_element]", Some(vec![0.6, 0.8, 0.0]), true),
    ] {
        let text = format!(
            "//! A law.\nstruct Parameters {{\n/// Fibres.\n{attributes} a: Direction,\n/// Stiffness.\n\
             #[unit(\"Pa\")] #[range(1.0, 2.0)] k: f64,\n}}\n\
             fn energy_density(s: Strain, p: Parameters) -> f64 {{ p.k * s.I4(p.a) }}"
        );
        let a = &parse("law.rs", &text).parameters[0];
        assert!(a.direction, "{attributes}");
        assert_eq!((a.len, a.range, a.unit.text.as_str()), (3, (-1.0, 1.0), "1"), "{attributes}");
        assert_eq!((a.per_element, &a.default), (per_element, &default), "{attributes}");
    }
}

#[test]
fn sums_are_written_out() {
    check_expression("s.J * sum(0..3, |i| p.c[i])", "(J * ((c[0] + c[1]) + c[2]))");
    check_expression(
        "s.J * sum(1..3, |i| p.c[i - 1] * i as f64 + p.c[2])",
        "(J * (((c[0] * 1) + c[2]) + ((c[1] * 2) + c[2])))",
    );
    check_expression(
        "sum(0..2, |i| sum(0..2, |j| p.c[i + j] * s.J))",
        "(((c[0] * J) + (c[1] * J)) + ((c[1] * J) + (c[2] * J)))",
    );
    // Yeoh's law.
    check(
        "/// Terms.\nconst N: usize = 3;\nfn energy_density(s: Strain, p: Parameters) -> f64 {\n\
         sum(0..N, |i| p.c[i] * (s.I1bar - 3.0).powi(i as i32 + 1)) + p.K / 2.0 * (s.J - 1.0).powi(2)\n}",
        "((((c[0] * (I1bar - 3)^1) + (c[1] * (I1bar - 3)^2)) + (c[2] * (I1bar - 3)^3)) + ((K / 2) * (J - 1)^2))",
    );
}

#[test]
fn helpers_and_constants() {
    check(
        "const THIRD: f64 = 1.0 / 3.0;\nconst TWO: f64 = 6.0 * THIRD;\n\
         fn half(x: f64) -> f64 { let y = x / TWO; y }\n\
         fn volumetric(q: Parameters, t: Strain) -> f64 { half(q.K) * (t.J - 1.0).powi(2) }\n\
         fn energy_density(s: Strain, p: Parameters) -> f64 { half(p.mu) * (s.I1 - 3.0) + volumetric(p, s) }",
        "((y:=(mu / (6 * (1 / 3))) * (I1 - 3)) + (y:=(K / (6 * (1 / 3))) * (J - 1)^2))",
    );
}

#[test]
fn parts_are_summed_in_the_order_of_the_file() {
    let functions = "fn energy_density_volumetric(s: Strain, p: Parameters) -> f64 { p.K * ln(s.J).powi(2) }\n\
                     fn energy_density_isochoric(s: Strain, p: Parameters) -> f64 { p.mu * (s.I1bar - 3.0) }";
    check(functions, "((K * ln(J)^2) + (mu * (I1bar - 3)))");
}

#[test]
fn well_known_laws() {
    // Stable neo-Hookean, Smith et al. 2018, eq. 14.
    check(
        "fn energy_density(s: Strain, p: Parameters) -> f64 {\n\
         let alpha = 1.0 + p.mu / p.K - p.mu / (4.0 * p.K);\n\
         p.mu / 2.0 * (s.I1 - 3.0) + p.K / 2.0 * (s.J - alpha).powi(2) - p.mu / 2.0 * ln(s.I1 + 1.0)\n}",
        "((((mu / 2) * (I1 - 3)) + ((K / 2) * (J - alpha:=((1 + (mu / K)) - (mu / (4 * K))))^2)) - ((mu / 2) * ln((I1 + 1))))",
    );
    // Mooney-Rivlin.
    check_expression(
        "p.c[0] * (s.I1bar - 3.0) + p.c[1] * (s.I2bar - 3.0) + p.c[2] / 2.0 * (s.J - 1.0).powi(2)",
        "(((c[0] * (I1bar - 3)) + (c[1] * (I2bar - 3))) + ((c[2] / 2) * (J - 1)^2))",
    );
}

#[test]
fn metadata_is_kept() {
    let text = "//! A law.\n//!\n//! Somewhere, eq. 1.\n#[domain(ln(J) * bound > -bound / 2.0)]\n#[valid_stretches(0.25, 1e1)]\nstruct Parameters {\n\
                /// A bound\n/// in two lines.\n#[unit(\"1\")] #[range(-0.5, 1e0)] #[default(0.25)] bound: f64,\n\
                /// Stiffness.\n#[unit(\"N/m^2\")]\n#[range(1.0, 1e9)]\n#[default(1.0, 2.0)]\n#[per_element]\nc: [f64; 2],\n}\n\
                fn energy_density(s: Strain, p: Parameters) -> f64 { p.c[0] * s.J + p.c[1] }";
    let law = parse("some/where/a_law.rs", text);
    assert_eq!((law.name.as_str(), law.path.as_str()), ("a_law", "some/where/a_law.rs"));
    assert_eq!(law.text, text);
    assert_eq!(law.docs, "A law.\n\nSomewhere, eq. 1.");
    let [bound, c] = &law.parameters[..] else { panic!("two parameters") };
    assert_eq!((bound.name.as_str(), bound.docs.as_str()), ("bound", "A bound\nin two lines."));
    assert_eq!((bound.range, bound.len, bound.per_element), ((-0.5, 1.0), 1, false));
    assert_eq!(bound.default, Some(vec![0.25]));
    assert_eq!((c.range, c.len, c.per_element), ((1.0, 1e9), 2, true));
    assert_eq!(c.default, Some(vec![1.0, 2.0]));
    assert_eq!((c.unit.text.as_str(), c.unit.length, c.unit.stress, c.unit.time), ("N/m^2", 0, 1, 0));
    let domain = law.domain.as_ref().expect("the file gives one");
    assert_eq!(law.valid_stretches, Some((0.25, 10.0)));
    assert_eq!(domain.text, "ln(J) * bound > -bound / 2.0");
    assert_eq!(scalar(&law, &domain.left), "(ln(J) * bound)");
    assert_eq!(scalar(&law, &domain.right), "(-bound / 2)");
    assert!(law.parts.is_empty());
}

#[test]
fn a_let_is_shared() {
    let text = "//! A law.\nstruct Parameters {\n/// Stiffness.\n#[unit(\"Pa\")] #[range(1.0, 1e9)] mu: f64,\n}\n\
                fn energy_density(s: Strain, p: Parameters) -> f64 { let x = s.J * sqrt(p.mu); x * x }";
    let law = parse("law.rs", text);
    assert_eq!(law.valid_stretches, None);
    let ScalarNode::Mul(a, b) = &*law.energy else { panic!("a product") };
    assert!(std::rc::Rc::ptr_eq(a, b));
}

#[test]
fn the_shipped_laws() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../laws");
    let mut found = Vec::new();
    for entry in std::fs::read_dir(&folder).expect("laws/ is in the repository") {
        let path = entry.expect("a readable entry").path();
        if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).expect("a readable law");
            let law = parse(&path.display().to_string(), &text);
            // Asked of a law once it has been reviewed, which writes its derivation.
            let reviewed = folder.join("derived").join(format!("{}.ir", law.name)).exists();
            // A year or an equation.
            let source = ["19", "20", "eq."].iter().any(|word| law.docs.contains(word));
            assert!(!reviewed || source, "{} names no source", law.name);
            let parts: Vec<&str> = law.parts.iter().map(|(name, _)| name.as_str()).collect();
            found.push(format!(
                "{} {} {}",
                law.name,
                law.domain.as_ref().map_or("everywhere", |d| &d.text),
                parts.join(" ")
            ));
        }
    }
    found.sort();
    for expected in [
        "hooke everywhere ",
        "neo_hookean J > 0.0 ",
        "neo_hookean_isochoric J > 0.0 energy_density_isochoric energy_density_volumetric",
        "st_venant_kirchhoff everywhere ",
    ] {
        assert!(found.iter().any(|law| law == expected), "{expected:?} is not in {found:#?}");
    }
}

#[test]
fn the_reference_shows_a_shipped_law() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../laws");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("laws/ is in the repository");
    let reference = read("README.md");
    let example = reference.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next());
    assert_eq!(example, Some(read("neo_hookean.rs").as_str()));
}

/// The energy of a law with parameters mu and kappa in Pa and n, a pure number above 1, is accepted.
fn check_accepted(domain: &str, energy: &str) {
    let field = |(name, unit): (&str, &str)| format!("/// One.\n#[unit(\"{unit}\")] #[range(1.0, 1e9)] {name}: f64,\n");
    let fields: String = [("mu", "Pa"), ("kappa", "Pa"), ("n", "1")].map(field).concat();
    // All of them are used, whatever the energy is.
    parse(
        "laws/test.rs",
        &format!(
            "//! Test.\n{domain}struct Parameters {{\n{fields}}}\nfn half(x: f64) -> f64 {{ x / 2.0 }}\n\
             fn energy_density(s: Strain, p: Parameters) -> f64 {{ {energy} + p.mu * half(p.n) * s.I1 + half(p.kappa) }}"
        ),
    );
}

#[test]
fn dimensions_that_fit() {
    for energy in [
        "p.mu * s.J + 0.0",
        "0.0 - p.mu * s.J",
        "(1.0 - 1.0) + p.mu * s.J",
        "select(s.I1 > 3.0, p.mu * s.I1, 0.0)",
        "select(p.mu > 0.0, p.mu, p.kappa) * s.J",
        "pos(p.mu * s.J - p.kappa)",
        "sqrt(p.mu) * p.kappa.sqrt() * s.I1",
        "sqrt(p.mu * p.kappa) * s.I1",
        "powf(p.mu, 1.0 / 3.0) * p.kappa.powf(2.0 / 3.0) * s.I1",
        "p.mu.powi(2) / p.kappa * s.I1",
        "p.mu.powi(-1) * p.kappa * p.kappa * s.I1",
        "p.mu * powf(s.I1, p.n)",
        "p.mu * powf(p.mu / p.kappa, p.n) * s.I1",
        "p.mu * exp(p.mu / p.kappa * s.I1) + ln(p.kappa / p.mu) * p.mu * s.J",
        "ddot(p.mu * s.E, s.C) + tr(s.E * p.kappa)",
        "det(s.C * powf(p.mu, 1.0 / 3.0))",
        "shear_modulus(p.mu, p.n / p.n / 3.0) * s.J",
        "sum(1..4, |i| p.mu / i as f64 * s.J.powi(i as i32))",
    ] {
        check_accepted("", energy);
    }
}

#[test]
fn functions_that_need_no_domain() {
    for energy in [
        "ln(s.I1 + 1.0)",
        "ln(s.I1)",
        "sqrt(s.I1)",
        "1.0 / s.I1",
        "s.I1.powf(-0.5) + s.I1.powi(-2)",
        "ln(1.0 + s.J.powi(2))",
        "sqrt(1.0 + ddot(s.E, s.E))",
        "ln(2.0 * tr(s.E) + 3.5)",
        "1.0 / (1.0 + s.I2 + s.I3 / p.n)",
        "powf(exp(s.J), p.n) + exp(-s.J)",
        "ln(1.0 + pos(s.J)) / (p.n + pos(s.J))",
        "ln(select(s.J > 0.0, 1.0 + s.I1, p.n))",
        "sqrt(p.n - 2.0) / (p.n - 3.0) * s.J",
    ] {
        check_accepted("", &format!("p.mu * ({energy})"));
    }
    let square = "let x = s.J - 1.0; p.mu * ln(x * x + 0.5)";
    check_accepted("", square);
    // A domain is the author's word for what the form does not tell.
    check_accepted("#[domain(n - (I1 - 3.0) > 0.0)]\n", "p.mu * ln(1.0 - (s.I1 - 3.0) / p.n)");
    check_accepted("#[domain(J > 0.0)]\n", "p.mu * (s.I1bar - 3.0) + p.kappa / 2.0 * ln(s.J).powi(2)");
}

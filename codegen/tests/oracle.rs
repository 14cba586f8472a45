//! Law texts as plain Rust for another number type: what is rewritten, and that nothing else is.

use tensormass_codegen::oracle::{module, table};

fn check(law: &str, expected: &str) {
    assert_eq!(module(law).expect("Rust"), expected);
}

#[test]
fn literals_constants_and_casts_are_rewritten() {
    check(
        "//! A law.\n\
         const N: usize = 3;\n\
         const A: f64 = 2.0;\n\
         const B: f64 = A / 4.0;\n\
         #[domain(J > 0.0)] struct Parameters {\n\
         /// One.\n #[unit(\"Pa\")] #[range(0.0, 1.0)] c: [f64; 3],\n\
         /// Fibres.\n #[per_element] f: Direction,\n\
         /// Two.\n #[unit(\"1\")] #[range(0.0, 1.0)] a: f64 }\n\
         fn one() -> f64 { 1.0 }\n\
         fn energy_density_x(s: Strain, p: Parameters) -> f64 {\n\
         let y: f64 = 2.0;\n\
         sum(0..N, |i| p.c[i] / (i as f64 + B) * (s.I1 - 3.0).powi(i as i32 + 1)) + y * one() * p.a }\n\
         fn energy_density_y(s: Strain, p: Parameters) -> f64 { powi(s.J, 2) * ((2 + 1) as f64 + 2 as i32 as f64) }\n",
        "\
const N: usize = 3;
fn A() -> f64 {
    lit(2.0)
}
fn B() -> f64 {
    A() / lit(4.0)
}
#[derive(Clone, Copy)]
struct Parameters {
    c: [f64; 3],
    f: Direction,
    a: f64,
}
fn one() -> f64 {
    lit(1.0)
}
fn energy_density_x(s: Strain, p: Parameters) -> f64 {
    let y: f64 = lit(2.0);
    sum(0..N, |i| p.c[i] / (from_index(i) + B()) * (s.I1 - lit(3.0)).powi(i as i32 + 1))
        + y * one() * p.a
}
fn energy_density_y(s: Strain, p: Parameters) -> f64 {
    powi(s.J, 2) * (from_index((2 + 1)) + from_index(2 as i32))
}
/// The energy density: the sum of the file's parts.
pub fn oracle(strain: Strain, parameters: &[f64]) -> f64 {
    let parameters = Parameters {
        c: ::std::array::from_fn(|i| parameters[0usize + i]),
        f: Direction([parameters[3usize], parameters[4usize], parameters[5usize]]),
        a: parameters[6usize],
    };
    energy_density_x(strain, parameters) + energy_density_y(strain, parameters)
}
",
    );
}

#[test]
fn a_table_names_every_law() {
    let text = table(&["a", "b"], &["b"]).expect("Rust");
    assert!(text.contains("&[(\"b\", b::dissipation_oracle)]"), "{text}");
    assert!(text.contains("&[(\"a\", a::oracle), (\"b\", b::oracle)]"), "{text}");
    assert!(text.contains("\"/oracle/a.rs\""), "{text}");
}

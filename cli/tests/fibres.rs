//! Every invariant with fibres, in a law file that this workspace does not build in: derived by the program, and compared
//! with its energy written out here.

use std::path::Path;
use std::process::Command;

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::Input;
use tensormass_codegen::{law, structure};

/// The term whose place is TERM, on a ground that uses neither J nor fibres.
const LAW: &str = "//! A law of fibres, eq. 1.
struct Parameters {
    /// Stiffness.
    #[unit(\"Pa\")] #[range(1.0, 1e9)] mu: f64,
    /// First family.
    a: Direction,
    /// Second family.
    b: Direction,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.mu * ddot(s.E, s.E) + p.mu * (s.I4(p.a) - s.I4(p.b)).powi(2) + p.mu * TERM
}
";
const MU: f64 = 2.0;
const A: [f64; 3] = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];
const B: [f64; 3] = [0.0, 0.6, -0.8];
/// A step of differences: a power of two near the cube root of the unit round-off.
const H: f64 = 1.0 / 131_072.0;

type Matrix = [[f64; 3]; 3];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// The state that the invariants of the tests are taken at.
struct State {
    c: Matrix,
    j: f64,
}

impl State {
    fn at(g: &[f64; 9]) -> Self {
        let f: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| g[3 * i + j] + f64::from(u8::from(i == j))));
        let transposed = std::array::from_fn(|i| std::array::from_fn(|j| f[j][i]));
        let minor = |i: usize, j: usize| f[1][i] * f[2][j] - f[1][j] * f[2][i];
        let j = f[0][0] * minor(1, 2) - f[0][1] * minor(0, 2) + f[0][2] * minor(0, 1);
        Self { c: product(&transposed, &f), j }
    }

    /// a . C^n . b
    fn between(&self, a: [f64; 3], n: usize, b: [f64; 3]) -> f64 {
        let c = if n == 1 { self.c } else { product(&self.c, &self.c) };
        (0..9).map(|k| a[k / 3] * c[k / 3][k % 3] * b[k % 3]).sum()
    }

    /// W, with the value of the term.
    fn energy(&self, term: f64) -> f64 {
        let e = |k: usize| 0.5 * (self.c[k / 3][k % 3] - f64::from(u8::from(k.is_multiple_of(4))));
        let families = self.between(A, 1, A) - self.between(B, 1, B);
        MU * (0..9).map(|k| e(k) * e(k)).sum::<f64>() + MU * families.powi(2) + MU * term
    }
}

fn derive(term: &str) -> (law::ast::Law, Derivation) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("fibres.rs");
    let text = LAW.replace("TERM", term);
    std::fs::write(&path, &text).expect("written");
    let mut command = Command::new(env!("CARGO_BIN_EXE_tensormass"));
    command.args(["law", "derive"]).arg(&path).arg("--out").arg(folder.path());
    let output = command.output().expect("the binary starts");
    assert!(output.status.success(), "{term}: {}", String::from_utf8_lossy(&output.stderr));
    let read = |path: &Path| std::fs::read_to_string(path).expect("written by the program");
    let derivation = Derivation::from_text(&read(&folder.path().join("fibres.ir"))).expect("a derivation");
    (law::parse("fibres.rs", &text).expect("the program accepted it"), derivation)
}

/// Three times the difference of a central difference to that of twice the step bounds its truncation, where the fifth
/// derivative is of the third's size; the values themselves are rounded.
fn difference(f: impl Fn(f64) -> f64) -> (f64, f64) {
    let [near, far] = [H, 2.0 * H].map(|h| (f(h) - f(-h)) / (2.0 * h));
    (near, (near - far).abs() + 100.0 * f64::EPSILON * f(0.0).abs().max(MU) / H)
}

/// Derives the law with a term, and compares its kernels with `value`, the same term written out.
fn check(term: &str, uses_j: bool, value: impl Fn(&State) -> f64) {
    let (law, derivation) = derive(term);
    let structure = structure::detect(&law, &derivation);
    assert!(structure.uses_fibres && !structure.isotropic && !structure.linear, "{term}: {structure:?}");
    assert_eq!((structure.uses_j, structure.polynomial), (uses_j, !uses_j), "{term}");
    let parameters = [&[MU][..], &A, &B].concat();
    let constants = derivation.material(&parameters).expect("parameters");
    let run = |kernel: &str, g: &[f64; 9], more: &[(Input, &[f64])]| {
        let mut inputs = vec![(Input::Constants, constants.as_slice()), (Input::DisplacementGradient, g)];
        inputs.extend_from_slice(more);
        derivation.point(kernel).interpret(&inputs).expect("the inputs of a point kernel").swap_remove(0)
    };
    let energy = |g: &[f64; 9]| {
        let state = State::at(g);
        state.energy(value(&state))
    };
    let moved = |g: &[f64; 9], h: f64, d: &[f64; 9]| std::array::from_fn(|k| g[k] + h * d[k]);
    let states =
        [[0.0; 9], [0.2, -0.1, 0.3, 0.1, -0.3, 0.2, -0.2, 0.4, 0.1], [-0.3, 0.5, 0.1, 0.2, 0.6, -0.4, 0.3, 0.1, -0.2]];
    let d = [0.5, -1.0, 0.25, 0.75, 0.5, -0.5, 1.0, 0.25, -0.75];
    for g in states {
        let (w, wanted) =
            (run("energy", &g, &[])[0] - run("energy", &[0.0; 9], &[])[0], energy(&g) - energy(&[0.0; 9]));
        assert!((w - wanted).abs() <= 100.0 * f64::EPSILON * (wanted.abs() + MU), "{term}: W {w}, not {wanted}");
        let p = run("force", &g, &[]);
        let (work, bound) = difference(|h| energy(&moved(&g, h, &d)));
        let along: f64 = p.iter().zip(&d).map(|(p, d)| p * d).sum();
        assert!((along - work).abs() <= bound, "{term}, G {g:?}: P : D {along}, not {work} within {bound:e}");
        let dp = run("dforce", &g, &[(Input::GradientIncrement, &d)]);
        for k in 0..9 {
            let (wanted, bound) = difference(|h| run("force", &moved(&g, h, &d), &[])[k]);
            assert!((dp[k] - wanted).abs() <= bound, "{term}, G {g:?}: dP{k} {}, not {wanted} within {bound:e}", dp[k]);
            assert!(bound <= 1e-6 * MU * 1e3, "{term}: {bound:e} proves nothing");
        }
    }
}

#[test]
fn invariants_over_c() {
    check("(s.I4(p.a) - 1.0).powi(3)", false, |s| (s.between(A, 1, A) - 1.0).powi(3));
    check("(s.I5(p.a) - 1.0).powi(2)", false, |s| (s.between(A, 2, A) - 1.0).powi(2));
    // I8 is not 0 at rest: what has no stress there is multiplied by a square that vanishes.
    let square = |s: &State| (s.c[0][0] + s.c[1][1] + s.c[2][2] - 3.0).powi(2);
    check("s.I8(p.a, p.b).powi(3) * (s.I1 - 3.0).powi(2)", false, |s| s.between(A, 1, B).powi(3) * square(s));
    check("s.I8(p.b, p.a) * s.I5(p.b) * (s.I1 - 3.0).powi(2)", false, |s| {
        s.between(B, 1, A) * s.between(B, 2, B) * square(s)
    });
}

#[test]
fn isochoric_invariants() {
    check("(s.I4bar(p.b) - 1.0).powi(2)", true, |s| (s.between(B, 1, B) * s.j.powf(-2.0 / 3.0) - 1.0).powi(2));
    check("(s.I5bar(p.b) - 1.0).powi(2)", true, |s| (s.between(B, 2, B) * s.j.powf(-4.0 / 3.0) - 1.0).powi(2));
}

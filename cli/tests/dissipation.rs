//! Dissipations that no law of the build has: derived by the program, and compared with their densities written out here;
//! and those that are refused, with the term.

use std::path::PathBuf;
use std::process::{Command, Output};

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::Input;
use tensormass_codegen::law;
use tensormass_codegen::print::wgsl::LawFunctions;

/// An energy that a dissipation, in place of TERM, stands beside.
const LAW: &str = "//! A viscous law, eq. 1.
#[domain(J > 0.0)]
struct Parameters {
    /// Stiffness.
    #[unit(\"Pa\")] #[range(1.0, 1e9)] mu: f64,
    /// Viscosity.
    #[unit(\"Pa s\")] #[range(1.0, 1e9)] eta: f64,
    /// A rate.
    #[unit(\"1/s\")] #[range(0.1, 1e9)] w: f64,
    /// Fibres.
    a: Direction,
}
fn energy_density(s: Strain, p: Parameters) -> f64 {
    p.mu * ddot(s.E, s.E) + p.mu * (s.I4(p.a) - 1.0).powi(2)
}
fn dissipation_density(s: Strain, r: StrainRate, p: Parameters) -> f64 {
    p.eta * ddot(r.E, r.E) + 0.0 * p.eta * p.w * r.J + p.eta * (TERM)
}
";
const MU: f64 = 3.0;
const ETA: f64 = 2.0;
const W: f64 = 1.5;

type Matrix = [f64; 9];

/// A step of differences: a power of two near the cube root of the unit round-off.
const H: f64 = 1.0 / 131_072.0;
const A: [f64; 3] = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];

fn derive(term: &str) -> (Output, String, PathBuf, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (path, text) = (folder.path().join("viscous.rs"), LAW.replace("TERM", term));
    std::fs::write(&path, &text).expect("written");
    let mut command = Command::new(env!("CARGO_BIN_EXE_tensormass"));
    command.args(["law", "derive"]).arg(&path).arg("--out").arg(folder.path());
    let output = command.output().expect("the binary starts");
    (output, text, folder.path().join("viscous.ir"), folder)
}

/// C = F'F.
fn cauchy_green(g: &Matrix) -> Matrix {
    let f: Matrix = std::array::from_fn(|k| g[k] + f64::from(u8::from(k % 4 == 0)));
    std::array::from_fn(|k| (0..3).map(|m| f[3 * m + k / 3] * f[3 * m + k % 3]).sum())
}

fn trace(c: &Matrix) -> f64 {
    c[0] + c[4] + c[8]
}

fn ddot(a: &Matrix, b: &Matrix) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn jacobian(g: &Matrix) -> f64 {
    let f: Matrix = std::array::from_fn(|k| g[k] + f64::from(u8::from(k % 4 == 0)));
    f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6]) + f[2] * (f[3] * f[7] - f[4] * f[6])
}

/// The square of the stretch along A.
fn fibre(g: &Matrix) -> f64 {
    let c = cauchy_green(g);
    (0..9).map(|k| A[k / 3] * c[k] * A[k % 3]).sum()
}

fn moved(g: &Matrix, h: f64, d: &Matrix) -> Matrix {
    std::array::from_fn(|k| g[k] + h * d[k])
}

/// The derivative at 0, by differences of fourth order.
fn slope(f: impl Fn(f64) -> f64) -> f64 {
    let h = 1.0 / 1024.0;
    (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h)
}

/// A state and its rate, and the rates of its invariants.
struct Moving {
    g: Matrix,
    rate: Matrix,
}

impl Moving {
    fn of(&self, q: impl Fn(&Matrix) -> f64) -> f64 {
        slope(|t| q(&moved(&self.g, t, &self.rate)))
    }

    /// dE/dt.
    fn strain(&self) -> Matrix {
        std::array::from_fn(|k| 0.5 * self.of(|g| cauchy_green(g)[k]))
    }
}

/// Derives the law with a term, and compares its damping kernels with `value`, the same term written out.
fn check(term: &str, linear: bool, value: impl Fn(&Moving) -> f64) {
    let (output, text, ir, _folder) = derive(term);
    assert!(output.status.success(), "{term}: {}", String::from_utf8_lossy(&output.stderr));
    let ir = std::fs::read_to_string(ir).expect("written by the program");
    let derivation = Derivation::from_text(&ir).expect("a derivation");
    assert_eq!(derivation.to_text(), ir, "{term}");
    assert_eq!(!derivation.kernel("ddamping").reads(Input::GradientRate), linear, "{term}");
    let parameters = [&[MU, ETA, W][..], &A].concat();
    let constants = derivation.kernel("material").interpret(&[(Input::Parameters, &parameters)]).expect("parameters");
    let run = |kernel: &str, g: &Matrix, rate: &Matrix, more: &[(Input, &[f64])]| {
        let mut inputs = vec![
            (Input::Constants, constants[0].as_slice()),
            (Input::DisplacementGradient, g.as_slice()),
            (Input::GradientRate, rate.as_slice()),
        ];
        inputs.extend_from_slice(more);
        derivation.point(kernel).interpret(&inputs).expect("the inputs of a point kernel").swap_remove(0)
    };
    let density = |g: &Matrix, rate: &Matrix| {
        let moving = Moving { g: *g, rate: *rate };
        let e = moving.strain();
        ETA * ddot(&e, &e) + ETA * value(&moving)
    };
    let states =
        [[0.0; 9], [0.2, -0.1, 0.3, 0.1, -0.3, 0.2, -0.2, 0.4, 0.1], [-0.3, 0.5, 0.1, 0.2, 0.6, -0.4, 0.3, 0.1, -0.2]];
    let rate = [0.7, -0.5, 1.0, 0.25, 0.5, -0.75, 0.5, 1.25, -0.25];
    let d = [0.5, -1.0, 0.25, 0.75, 0.5, -0.5, 1.0, 0.25, -0.75];
    for g in states {
        let found = run("dissipation", &g, &rate, &[])[0];
        let wanted = density(&g, &rate) - density(&g, &[0.0; 9]);
        // The written-out rates are differences of h^4 = 1e-12, and of eps / h = 2e-13.
        assert!((found - wanted).abs() <= 1e-9 * (1.0 + wanted.abs()), "{term}, G {g:?}: D {found}, not {wanted}");
        let p = run("damping", &g, &rate, &[]);
        assert!(run("damping", &g, &[0.0; 9], &[]).iter().all(|p| *p == 0.0), "{term}: damped at rest");
        // Central differences: h^2 = 6e-11 and eps / h = 3e-11 of values of ten or so.
        let near = |found: f64, f: &dyn Fn(f64) -> f64, what: &str| {
            let wanted = (f(H) - f(-H)) / (2.0 * H);
            assert!(
                (found - wanted).abs() <= 1e-7 * (1.0 + wanted.abs()),
                "{term}, G {g:?}, {what}: {found}, not {wanted}"
            );
        };
        near(
            ddot(&p.clone().try_into().expect("nine"), &d),
            &|h| run("dissipation", &g, &moved(&rate, h, &d), &[])[0],
            "P_v",
        );
        let dp = run("ddamping", &g, &rate, &[(Input::GradientIncrement, &d)]);
        for k in 0..9 {
            near(dp[k], &|h| run("damping", &g, &moved(&rate, h, &d), &[])[k], "dP_v");
        }
        let node = [0.5, -1.0, 0.75];
        let diagonal = run("damping_diagonal", &g, &rate, &[(Input::NodeGradient, &node)]);
        for (i, found) in diagonal.iter().enumerate() {
            let direction: Matrix = std::array::from_fn(|k| if k / 3 == i { node[k % 3] } else { 0.0 });
            let dp = run("ddamping", &g, &rate, &[(Input::GradientIncrement, &direction)]);
            let wanted = ddot(&dp.try_into().expect("nine"), &direction);
            assert!((found - wanted).abs() <= 1e-13 * (1.0 + wanted.abs()), "{term}: diagonal {found}, not {wanted}");
        }
    }
    // A differential that does not depend on the rate does not read it: its pass has a buffer to spare.
    let law = law::parse("viscous.rs", &text).expect("the program accepted it");
    let [_, ddamping, _] = LawFunctions::new(&law, &derivation).damping.expect("the law has a dissipation");
    assert_eq!(!ddamping.arguments.contains(&Input::GradientRate), linear, "{term}: what the differential reads");
}

#[test]
fn rates_of_invariants() {
    check("r.J.powi(2) / s.J", true, |m| m.of(jacobian).powi(2) / jacobian(&m.g));
    check("r.I4(p.a).powi(2) * s.I4(p.a)", true, |m| m.of(fibre).powi(2) * fibre(&m.g));
    let bar = |g: &Matrix| trace(&cauchy_green(g)) * jacobian(g).powf(-2.0 / 3.0);
    check("r.I1bar.powi(2) + r.I3 * tr(r.C)", true, |m| {
        let trace_rate = m.of(|g| trace(&cauchy_green(g)));
        m.of(bar).powi(2) + m.of(|g| jacobian(g).powi(2)) * trace_rate
    });
    let second = |g: &Matrix| {
        let c = cauchy_green(g);
        0.5 * (trace(&c).powi(2) - ddot(&c, &c))
    };
    check("r.I2.powi(2) + ddot(r.E, s.C) * tr(r.E)", true, |m| {
        m.of(second).powi(2) + ddot(&m.strain(), &cauchy_green(&m.g)) * trace(&m.strain())
    });
    // The sum of fourth powers is C:C.
    check("r.stretch_sum(4.0).powi(2)", true, |m| m.of(|g| ddot(&cauchy_green(g), &cauchy_green(g))).powi(2));
}

#[test]
fn nonlinear_densities() {
    let square = |m: &Moving| ddot(&m.strain(), &m.strain());
    check("p.w.powi(2) * (1.0 + ddot(r.E, r.E) / p.w.powi(2)).powf(0.75)", false, |m| {
        W * W * (1.0 + square(m) / (W * W)).powf(0.75)
    });
    check("r.J.powi(4) / p.w.powi(2) + pos(tr(r.E)).powi(2)", false, |m| {
        m.of(jacobian).powi(4) / (W * W) + trace(&m.strain()).max(0.0).powi(2)
    });
}

#[test]
fn stresses_at_rest_are_refused_with_their_term() {
    for (term, named) in [
        ("p.w * r.J", "`eta * w * Jt`"),
        ("r.J.powi(2) + p.w * tr(r.E) * s.J", "`eta * w * J * trAt / 2`"),
        ("r.J.powi(2) + p.w * s.J * (s.J - 2.0) * r.J + p.w * r.J", "eta * w"),
    ] {
        let (output, _, ir, _folder) = derive(term);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{term}: {message}");
        assert!(message.contains("viscous.rs: the dissipation begins with a term of first order"), "{term}: {message}");
        assert!(message.contains(named) && !ir.exists(), "{term}: {message}");
    }
}

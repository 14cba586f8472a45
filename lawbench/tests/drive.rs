//! Curves of every law: free faces are free, energies are the work done, slopes at rest are the moduli.

use tensormass_kernels::laws;
use tensormass_lawbench::drive::{DriveError, MODES, Mode, Path, Point, drive};
use tensormass_lawbench::material::Material;
use tensormass_lawbench::subject::Subject;

fn curve(subject: &Subject, mode: Mode, from: f64, to: f64, points: usize) -> Vec<Point> {
    let material = Material::with(subject, &[]).expect("a material");
    let path = Path { mode, from, to, points };
    drive(subject, &material, path).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn energies_are_the_work_done() {
    for entry in laws() {
        let subject = Subject::of_build(entry);
        for (name, mode) in MODES {
            let rest = if mode == Mode::Shear { 0.0 } else { 1.0 };
            let worst = |points: usize| {
                let curve = curve(&subject, mode, rest - 0.1, rest + 0.2, points);
                // Each side is counted from its own start: the curve begins at rest, outwards on both sides.
                let most = curve.iter().map(|p| p.energy).fold(0.0, f64::max);
                assert!(most > 0.0, "{} {name}", entry.info.name);
                curve.iter().map(|p| (p.work - p.energy).abs() / most).fold(0.0, f64::max)
            };
            let (coarse, fine) = (worst(31), worst(301));
            // The trapezoidal rule: a tenth of the step, a hundredth of the error, down to what equilibria are solved to.
            assert!(fine <= coarse / 50.0 + 1e-9, "{} {name}: {coarse:e} {fine:e}", entry.info.name);
            assert!(coarse < 0.02, "{} {name}: {coarse:e}", entry.info.name);
        }
    }
}

#[test]
fn slopes_at_rest_are_the_moduli() {
    for entry in laws() {
        let subject = Subject::of_build(entry);
        let moduli = Material::with(&subject, &[]).expect("a material").moduli;
        let (mu, bulk) = (moduli.shear, moduli.bulk);
        let (young, poisson) = (9.0 * bulk * mu / (3.0 * bulk + mu), moduli.poisson());
        // With fibres the slopes are others in each direction.
        if subject.law.parameters.iter().any(|p| p.direction) {
            continue;
        }
        let cases = [
            (Mode::Uniaxial, young),
            (Mode::Cyclic, young),
            (Mode::Biaxial, young / (1.0 - poisson)),
            (Mode::Volumetric, 3.0 * bulk),
            (Mode::Shear, mu),
        ];
        for (mode, wanted) in cases {
            let (h, rest) = (1e-4, if mode == Mode::Shear { 0.0 } else { 1.0 });
            let curve = curve(&subject, mode, rest - h, rest + h, 3);
            let at = |x: f64| {
                let near = |p: &&Point| (p.imposed - x).abs() < 1e-9;
                curve.iter().find(near).expect("a point there").nominal
            };
            let slope = (at(rest + h) - at(rest - h)) / (2.0 * h);
            // Central differences are off by h^2 times a ratio of derivatives (150 for J^-9), and by the stress's rounding
            // over h.
            assert!((slope / wanted - 1.0).abs() < 1e-5, "{} {mode:?}: {slope} {wanted}", entry.info.name);
        }
    }
}

#[test]
fn ranges_that_are_none_are_refused() {
    let subject = Subject::of_build(&laws()[0]);
    let material = Material::with(&subject, &[]).expect("a material");
    let cases = [
        (Mode::Uniaxial, 1.5, 0.5, 5, "--from below --to"),
        (Mode::Uniaxial, -0.5, 1.5, 5, "--from above 0"),
        (Mode::Uniaxial, f64::NAN, 1.5, 5, "--from below --to"),
        (Mode::Biaxial, 0.5, 1.5, 1, "--points"),
        (Mode::Volumetric, 1.1, 1.5, 5, "around it"),
    ];
    for (mode, from, to, points, word) in cases {
        match drive(&subject, &material, Path { mode, from, to, points }) {
            Err(DriveError::Range(message)) => assert!(message.contains(word), "{message}"),
            other => panic!("{mode:?} {from} {to} {points}: {other:?}"),
        }
    }
}

#[test]
fn what_leaves_the_domain_is_said() {
    for entry in laws().iter().filter(|l| l.info.domain == Some("J > 0.0")) {
        let subject = Subject::of_build(entry);
        let material = Material::with(&subject, &[]).expect("a material");
        // A stretch of 1e-200 of every axis: J is 0 in f64.
        let path = Path { mode: Mode::Volumetric, from: 1e-200, to: 1.5, points: 5 };
        match drive(&subject, &material, path) {
            Err(error @ DriveError::NoEquilibrium { .. }) => assert!(error.to_string().contains("--from"), "{error}"),
            other => panic!("{}: {other:?}", entry.info.name),
        }
    }
}

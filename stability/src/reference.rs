//! What a specimen is compared with: a law's exact curve where it is stretched the same everywhere, else its twin in other units, solved
//! tightly in f64, whose last step has to satisfy the integrator's equations.

use std::path::Path;
use std::time::Duration;

use tensormass_codegen::ir::{Input, Number};
use tensormass_lawbench::drive::{Mode, Path as Curve, drive};
use tensormass_lawbench::evaluate::textbook;
use tensormass_lawbench::number::Exact;
use tensormass_lawbench::subject::Subject;
use tensormass_runtime::model::build;
use tensormass_runtime::scene::{Integrator, Precision};
use tensormass_runtime::target::Target;

use crate::equations::residual;
use crate::extreme::Extreme;
use crate::run::{End, Look, Ran, run};
use crate::specimen::{Drive, Specimen, Tolerances, Units};

/// The last step of a twin satisfies the equations to this part of their terms.
const SOLVED: f64 = 1e-5;

/// What a specimen is compared with.
#[derive(Debug, Clone)]
pub enum Reference {
    /// The same everywhere: displacements are stretches of the axes less one, times coordinates; with the reaction.
    Exact {
        /// Stretches of the three axes, less one.
        stretches: [f64; 3],
        /// The force on the pulled face, in units of stress and length.
        reaction: f64,
        /// The energy stored, likewise.
        energy: f64,
    },
    /// A twin's states.
    Twin(Vec<Look>),
    /// Its energy, which is kept or never grows.
    Energy,
    /// There is none, and why.
    None(String),
    /// The twin came to its end with what does not satisfy the equations: by this part of their terms.
    Unsolved(f64),
}

impl Reference {
    /// That of a specimen.
    pub fn of(extreme: Extreme, specimen: &Specimen<'_>, subject: &Subject, place: (&Path, Duration)) -> Self {
        match specimen.drive {
            Drive::Stretch(stretch) if specimen.integrator == Integrator::Static => exact(specimen, subject, stretch),
            _ if extreme == Extreme::Drift => Self::Energy,
            _ => twin(specimen, subject, place),
        }
    }
}

fn exact(specimen: &Specimen<'_>, subject: &Subject, stretch: f64) -> Reference {
    let [from, to] = [stretch.min(1.0), stretch.max(1.0)];
    let path = Curve { mode: Mode::Uniaxial, from, to, points: 2 };
    match drive(subject, specimen.material, path) {
        Err(e) => Reference::None(e.to_string()),
        Ok(points) => {
            let point = if stretch < 1.0 { &points[0] } else { &points[points.len() - 1] };
            let (g, young) = (point.gradient, specimen.material.moduli.young());
            let energy = energy(specimen, subject, &g) / young;
            Reference::Exact { stretches: [g[0], g[4], g[8]], reaction: point.nominal / young, energy }
        }
    }
}

/// W - W(0) by the textbook form in exact arithmetic, in the unit of the law's parameters.
fn energy(specimen: &Specimen<'_>, subject: &Subject, g: &[f64; 9]) -> f64 {
    let constants = specimen.material.exact_constants(&subject.derivation);
    let at = |g: &[f64; 9]| {
        let g = g.map(Exact::from);
        let inputs = [(Input::Constants, &constants[..]), (Input::DisplacementGradient, &g[..])];
        textbook(&subject.derivation, "energy", &inputs).value.remove(0)
    };
    at(g).sub(&at(&[0.0; 9])).to_f64()
}

fn twin(specimen: &Specimen<'_>, subject: &Subject, place: (&Path, Duration)) -> Reference {
    let units = specimen.units.of_twin();
    let Ran { end, looks, .. } = run(specimen, units, &Target::Cpu, Precision::F64, Tolerances::TIGHT, place);
    match end {
        End::Done => {}
        End::Stopped(why) | End::Refused(why) => return Reference::None(why),
        End::Unfinished => return Reference::None("its reference takes too long".into()),
    }
    match unsolved(specimen, subject, units, &looks, place.0) {
        Some(off) if off.is_nan() || off > SOLVED => Reference::Unsolved(off),
        _ => Reference::Twin(looks),
    }
}

/// By how much of their terms the last states of a run in some units miss the equations; none where that cannot be said.
pub fn unsolved(
    specimen: &Specimen<'_>,
    subject: &Subject,
    units: Units,
    looks: &[Look],
    folder: &Path,
) -> Option<f64> {
    let scene = specimen.scene(units, Precision::F64, Tolerances::TIGHT, folder).ok()?;
    let model = build(&scene).ok()?;
    let last: Vec<Vec<[f64; 3]>> = [3, 2, 1]
        .iter()
        .filter_map(|k| looks.get(looks.len().checked_sub(*k)?))
        .map(|look| look.displacement.iter().map(|u| u.map(|x| x * units.length)).collect())
        .collect();
    // Of equilibrium only the last one counts, and there may be no other.
    let states = match &last[..] {
        [a, b, c] => [&a[..], &b[..], &c[..]],
        [.., c] if specimen.integrator == Integrator::Static => [&c[..], &c[..], &c[..]],
        _ => return None,
    };
    residual(&scene, &model, subject, states)
}

//! Stress-stretch curves of a material point: what is imposed is imposed, free faces are in equilibrium.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::Input;

use crate::evaluate::printed;
use crate::material::Material;
use crate::subject::Subject;

/// How a material point is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// One stretch imposed, the other faces free.
    Uniaxial,
    /// Two equal stretches imposed, the third face free.
    Biaxial,
    /// Simple shear, F = 1 + gamma e1 e2'.
    Shear,
    /// Three equal stretches.
    Volumetric,
    /// One stretch imposed from rest to both ends and back, the other faces free.
    Cyclic,
}

/// The modes by name.
pub const MODES: [(&str, Mode); 5] = [
    ("uniaxial", Mode::Uniaxial),
    ("biaxial", Mode::Biaxial),
    ("shear", Mode::Shear),
    ("volumetric", Mode::Volumetric),
    ("cyclic", Mode::Cyclic),
];

/// Symmetric directions in which G is free, as pairs of components.
const DIRECTIONS: [(usize, usize); 5] = [(8, 8), (4, 4), (5, 7), (2, 6), (1, 3)];

impl Mode {
    /// G without what is free, at a stretch (or a shear).
    fn imposed(self, x: f64) -> [f64; 9] {
        let mut g = [0.0; 9];
        match self {
            Self::Uniaxial | Self::Cyclic => g[0] = x - 1.0,
            Self::Biaxial => (g[0], g[4]) = (x - 1.0, x - 1.0),
            Self::Volumetric => (g[0], g[4], g[8]) = (x - 1.0, x - 1.0, x - 1.0),
            Self::Shear => g[1] = x,
        }
        g
    }

    fn free(self) -> &'static [(usize, usize)] {
        match self {
            Self::Uniaxial | Self::Cyclic => &DIRECTIONS,
            Self::Biaxial => &[(8, 8), (5, 7), (2, 6), (1, 3)],
            Self::Volumetric | Self::Shear => &[],
        }
    }

    /// The value at rest.
    fn rest(self) -> f64 {
        if self == Self::Shear { 0.0 } else { 1.0 }
    }

    /// The component of P and of the Cauchy stress that the curve shows.
    fn component(self) -> usize {
        if self == Self::Shear { 1 } else { 0 }
    }

    /// What is imposed: `stretch`, or `shear`.
    pub fn axis(self) -> &'static str {
        if self == Self::Shear { "shear" } else { "stretch" }
    }

    /// A range that shows a soft solid's nonlinearity.
    pub fn usual(self) -> (f64, f64) {
        match self {
            Self::Uniaxial => (0.6, 2.0),
            Self::Biaxial => (0.7, 1.6),
            Self::Shear => (-1.0, 1.0),
            Self::Volumetric => (0.8, 1.2),
            Self::Cyclic => (0.8, 1.5),
        }
    }
}

/// What to drive through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// How.
    pub mode: Mode,
    /// The least stretch, or shear.
    pub from: f64,
    /// The greatest.
    pub to: f64,
    /// Points of the curve, both ends included; of a cycle, those of each of its four parts.
    pub points: usize,
}

/// One point of the curve. Stresses and energies are in the unit of the law's parameters, Pa.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Point {
    /// The stretch, or the shear, that is imposed.
    pub imposed: f64,
    /// G.
    pub gradient: [f64; 9],
    /// The nominal stress on the driven face: P11, of shear P12.
    pub nominal: f64,
    /// The Cauchy stress's component of the same place.
    pub cauchy: f64,
    /// det F.
    pub volume: f64,
    /// W - W(0).
    pub energy: f64,
    /// The work done until here (trapezoidal rule), for each unit of volume.
    pub work: f64,
}

/// Why there is no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DriveError {
    /// The range cannot be driven through.
    #[error("{0}")]
    Range(String),
    /// A point has no values.
    #[error(
        "law `{law}` has no equilibrium at {axis} {at}: {reason}; drive it through a smaller range with --from and --to, \
         or set other parameters"
    )]
    NoEquilibrium {
        /// The law.
        law: String,
        /// What is imposed.
        axis: &'static str,
        /// Its value.
        at: f64,
        /// What went wrong.
        reason: &'static str,
    },
}

/// Drives a material through a path; points in the order of the path.
///
/// # Errors
/// See [`DriveError`].
pub fn drive(subject: &Subject, material: &Material, path: Path) -> Result<Vec<Point>, DriveError> {
    let Path { mode, from, to, points } = path;
    if !(from.is_finite() && to.is_finite() && from < to) {
        return Err(DriveError::Range(format!("from {from} to {to} is no range: give --from below --to")));
    }
    if mode != Mode::Shear && from <= 0.0 {
        return Err(DriveError::Range(format!("a stretch of {from} is none: give --from above 0")));
    }
    if points < 2 {
        return Err(DriveError::Range("a curve has 2 points and more: give --points 2".into()));
    }
    let rest = mode.rest();
    if !(from..=to).contains(&rest) {
        return Err(DriveError::Range(format!(
            "the curve begins at rest, at {} {rest}: give --from and --to around it",
            mode.axis()
        )));
    }
    let solver = Solver { derivation: &subject.derivation, constants: material.constants(&subject.derivation), mode };
    let part = |from: f64, to: f64| -> Vec<f64> {
        (0..points).map(|k| from + (to - from) * k as f64 / (points - 1) as f64).collect()
    };
    let fail = |(at, reason)| DriveError::NoEquilibrium { law: subject.name().into(), axis: mode.axis(), at, reason };
    if mode == Mode::Cyclic {
        let cycle = [part(rest, to), part(to, rest), part(rest, from), part(from, rest)].concat();
        return solver.curve(&cycle).map_err(fail);
    }
    // From rest outwards, each point begins at its neighbour.
    let all = part(from, to);
    let (mut below, above): (Vec<f64>, Vec<f64>) = all.into_iter().partition(|x| *x < rest);
    below.reverse();
    let mut curve = solver.curve(&below).map_err(fail)?;
    curve.reverse();
    curve.extend(solver.curve(&above).map_err(fail)?);
    Ok(curve)
}

struct Solver<'a> {
    derivation: &'a Derivation,
    constants: Vec<f64>,
    mode: Mode,
}

/// Where there is no equilibrium, and why.
type Failed = (f64, &'static str);

/// Newton's iterations at a point.
const ITERATIONS: usize = 100;

/// How often the way to a point is halved.
const HALVINGS: usize = 10;

impl Solver<'_> {
    /// The points at these values, each begun at the one before, the first at rest.
    fn curve(&self, values: &[f64]) -> Result<Vec<Point>, Failed> {
        let energy_at_rest = self.energy(&[0.0; 9]).unwrap_or(0.0);
        let (mut last, mut g) = (self.mode.rest(), [0.0; 9]);
        let mut curve: Vec<Point> = vec![];
        let (mut stress, mut work) = (0.0, 0.0);
        for &x in values {
            g = self.follow(last, &g, x, 0)?;
            let nominal = self.power(&self.stress(&g));
            work += 0.5 * (nominal + stress) * (x - last);
            (stress, last) = (nominal, x);
            let f: [f64; 9] = std::array::from_fn(|k| g[k] + if k % 4 == 0 { 1.0 } else { 0.0 });
            let minor = |p: usize, q: usize, r: usize, s: usize| f[p] * f[s] - f[q] * f[r];
            let component = self.mode.component();
            curve.push(Point {
                imposed: x,
                gradient: g,
                nominal: self.stress(&g)[component],
                cauchy: self.kernel("cauchy", &g, None)[component],
                volume: f[0] * minor(4, 5, 7, 8) - f[1] * minor(3, 5, 6, 8) + f[2] * minor(3, 4, 6, 7),
                energy: self.energy(&g).unwrap_or(f64::NAN) - energy_at_rest,
                work,
            });
        }
        Ok(curve)
    }

    /// The equilibrium at `to`, from that at `from`: at once, or in halves.
    fn follow(&self, from: f64, g: &[f64; 9], to: f64, depth: usize) -> Result<[f64; 9], Failed> {
        let shift = |a: &[f64; 9], b: &[f64; 9]| std::array::from_fn(|k| g[k] + b[k] - a[k]);
        let start = shift(&self.mode.imposed(from), &self.mode.imposed(to));
        match self.equilibrium(start) {
            Ok(g) => Ok(g),
            Err(_) if depth < HALVINGS && !self.mode.free().is_empty() => {
                let middle = 0.5 * (from + to);
                let g = self.follow(from, g, middle, depth + 1)?;
                self.follow(middle, &g, to, depth + 1)
            }
            Err(reason) => Err((to, reason)),
        }
    }

    /// Newton's method for the least energy over the free directions, shifted where the tangent is not positive, and
    /// shortened until the energy or the force falls.
    fn equilibrium(&self, mut g: [f64; 9]) -> Result<[f64; 9], &'static str> {
        let Some(mut energy) = self.energy(&g) else { return Err("it is outside the law's domain, or not finite") };
        let free = self.mode.free();
        if free.is_empty() {
            return Ok(g);
        }
        for _ in 0..ITERATIONS {
            let force = self.force(&g);
            let stiffness = self.stiffness(&g);
            let size = stiffness.amax();
            if !size.is_finite() || !force.amax().is_finite() {
                return Err("the tangent is not finite");
            }
            // The stress that rounding G and P can cause.
            if force.amax() <= 64.0 * f64::EPSILON * size {
                return Ok(g);
            }
            let step = descent(&stiffness, &force);
            let mut length = 1.0;
            let next = loop {
                let moved = displaced(&g, free, &step, length);
                if let Some(new) = self.energy(&moved) {
                    let falls = new <= energy - 1e-4 * length * force.dot(&step).abs();
                    if falls || self.force(&moved).amax() <= (1.0 - 1e-4 * length) * force.amax() {
                        break Some((moved, new));
                    }
                }
                length *= 0.5;
                if length < 1e-12 {
                    break None;
                }
            };
            match next {
                Some((moved, new)) => (g, energy) = (moved, new),
                // Rounding is all that is left.
                None if force.amax() <= 1e-9 * size => return Ok(g),
                None => return Err("Newton's method stands still"),
            }
        }
        Err("Newton's method does not converge")
    }

    fn kernel(&self, name: &str, g: &[f64; 9], d: Option<&[f64; 9]>) -> Vec<f64> {
        let mut inputs = vec![(Input::Constants, self.constants.as_slice()), (Input::DisplacementGradient, &g[..])];
        inputs.extend(d.map(|d| (Input::GradientIncrement, &d[..])));
        printed(self.derivation, name, &inputs).value
    }

    fn stress(&self, g: &[f64; 9]) -> Vec<f64> {
        self.kernel("force", g, None)
    }

    /// W; none outside the domain and where it is not finite.
    fn energy(&self, g: &[f64; 9]) -> Option<f64> {
        let inputs = [(Input::Constants, self.constants.as_slice()), (Input::DisplacementGradient, &g[..])];
        let values = printed(self.derivation, "energy", &inputs);
        (values.margin.is_none_or(|m| m > 0.0) && values.value[0].is_finite()).then_some(values.value[0])
    }

    /// The stress that does work as the imposed value changes.
    fn power(&self, p: &[f64]) -> f64 {
        match self.mode {
            Mode::Uniaxial | Mode::Cyclic => p[0],
            Mode::Biaxial => p[0] + p[4],
            Mode::Volumetric => p[0] + p[4] + p[8],
            Mode::Shear => p[1],
        }
    }

    fn force(&self, g: &[f64; 9]) -> DVector<f64> {
        let p = self.stress(g);
        let free = self.mode.free();
        DVector::from_fn(free.len(), |a, _| along(&p, free[a]))
    }

    fn stiffness(&self, g: &[f64; 9]) -> DMatrix<f64> {
        let free = self.mode.free();
        let columns: Vec<Vec<f64>> = free
            .iter()
            .map(|&(i, j)| {
                let d = std::array::from_fn(|k| if k == i || k == j { 1.0 } else { 0.0 });
                self.kernel("dforce", g, Some(&d))
            })
            .collect();
        DMatrix::from_fn(free.len(), free.len(), |a, b| along(&columns[b], free[a]))
    }
}

/// A : B for the symmetric direction B of two components.
fn along(a: &[f64], (i, j): (usize, usize)) -> f64 {
    if i == j { a[i] } else { a[i] + a[j] }
}

fn displaced(g: &[f64; 9], free: &[(usize, usize)], step: &DVector<f64>, length: f64) -> [f64; 9] {
    let mut moved = *g;
    for (&(i, j), s) in free.iter().zip(step.iter()) {
        moved[i] += length * s;
        if i != j {
            moved[j] += length * s;
        }
    }
    moved
}

/// - H^-1 f, with H made positive where it is not.
fn descent(stiffness: &DMatrix<f64>, force: &DVector<f64>) -> DVector<f64> {
    let mut shift = 0.0;
    loop {
        let shifted = stiffness + DMatrix::identity(force.len(), force.len()) * shift;
        if let Some(factor) = shifted.cholesky() {
            return -factor.solve(force);
        }
        // Finite matrices become positive before the shift overflows.
        shift = (10.0 * shift).max(1e-3 * stiffness.amax()).max(f64::MIN_POSITIVE);
    }
}

//! What is compared of a run: displacements at points of the body, probes and energy, at some times.

use serde::{Deserialize, Serialize};
use tensormass_runtime::mesh::{Locator, Mesh};
use tensormass_runtime::simulate::Sample;

/// Points of the body at rest (m), each with what it weighs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Points {
    /// Where they are.
    pub positions: Vec<[f64; 3]>,
    /// What they weigh; any unit.
    pub weights: Vec<f64>,
}

/// A run at the points, at some times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// Displacements in m, of one time after the other.
    pub displacements: Vec<Vec<[f64; 3]>>,
    /// Values of the scene's probes; none where there is no finite one.
    pub probes: Vec<Vec<Option<f64>>>,
    /// Total energy in J.
    pub energies: Vec<f64>,
    /// The largest energy of a kind in J: what differences of energy are compared with.
    pub energy_scale: f64,
}

/// Relative errors of a run, each a part of the greatest value of the reference.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Of the displacement, in the mean square over body and time.
    pub displacement: f64,
    /// Of the displacement, the greatest at any point and time.
    pub greatest: f64,
    /// Of the probe that is worst, the greatest over time; 0 without probes.
    pub probes: f64,
    /// Of the total energy, the greatest over time.
    pub energy: f64,
}

/// One of the errors.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// See [`Errors::displacement`].
    #[default]
    Displacement,
    /// See [`Errors::greatest`].
    Greatest,
    /// See [`Errors::probes`].
    Probes,
    /// See [`Errors::energy`].
    Energy,
}

impl Metric {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Displacement, Self::Greatest, Self::Probes, Self::Energy];

    /// Its name in options and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Greatest => "greatest",
            Self::Probes => "probes",
            Self::Energy => "energy",
        }
    }
}

impl Errors {
    /// One of them.
    pub fn of(&self, metric: Metric) -> f64 {
        match metric {
            Metric::Displacement => self.displacement,
            Metric::Greatest => self.greatest,
            Metric::Probes => self.probes,
            Metric::Energy => self.energy,
        }
    }

    /// A function of each of them and the same of others.
    pub fn both(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            displacement: of(self.displacement, other.displacement),
            greatest: of(self.greatest, other.greatest),
            probes: of(self.probes, other.probes),
            energy: of(self.energy, other.energy),
        }
    }
}

impl Trajectory {
    /// What some samples of a run on a mesh are at the points; none where a point is in no element.
    pub fn of(mesh: &Mesh, points: &Points, samples: &[Sample]) -> Option<Self> {
        let locator = Locator::new(mesh);
        let places: Vec<_> = points.positions.iter().map(|x| locator.find(*x)).collect::<Option<_>>()?;
        let at = |u: &[[f64; 3]]| places.iter().map(|place| place.displacement(mesh, u)).collect();
        let parts = samples.iter().flat_map(|s| [s.energies.kinetic, s.energies.elastic, s.energies.external]);
        Some(Self {
            displacements: samples.iter().map(|s| at(&s.displacement)).collect(),
            probes: samples
                .iter()
                .map(|s| s.probes.iter().map(|x| Some(*x).filter(|x| x.is_finite())).collect())
                .collect(),
            energies: samples.iter().map(|s| s.energies.total()).collect(),
            energy_scale: parts.fold(0.0, |scale: f64, x| scale.max(x.abs())),
        })
    }

    /// How far this is from a reference at the same points and times.
    pub fn errors(&self, reference: &Self, points: &Points) -> Errors {
        let (mut square, mut whole, mut greatest, mut longest) = (0.0, 0.0, 0.0_f64, 0.0_f64);
        for (u, wanted) in self.displacements.iter().zip(&reference.displacements) {
            for ((u, wanted), weight) in u.iter().zip(wanted).zip(&points.weights) {
                let off: f64 = u.iter().zip(wanted).map(|(a, b)| (a - b) * (a - b)).sum();
                let size: f64 = wanted.iter().map(|x| x * x).sum();
                square += weight * off;
                whole += weight * size;
                greatest = greatest.max(off);
                longest = longest.max(size);
            }
        }
        // A part of nothing is as much as a file can hold.
        let part = |x: f64, of: f64| if x == 0.0 { 0.0 } else { (x / of).min(f64::MAX) };
        let mut probes: f64 = 0.0;
        let count = reference.probes.first().map_or(0, Vec::len);
        for k in 0..count {
            let (mut off, mut size) = (0.0_f64, 0.0_f64);
            for (values, wanted) in self.probes.iter().zip(&reference.probes) {
                // Before anything has moved some probes have no value.
                if let (Some(Some(value)), Some(Some(wanted))) = (values.get(k), wanted.get(k)) {
                    off = off.max((value - wanted).abs());
                    size = size.max(wanted.abs());
                }
            }
            probes = probes.max(part(off, size));
        }
        let energies = self.energies.iter().zip(&reference.energies);
        let energy = energies.fold(0.0_f64, |off, (a, b)| off.max((a - b).abs()));
        Errors {
            displacement: part(square, whole).sqrt(),
            greatest: part(greatest, longest).sqrt(),
            probes,
            energy: part(energy, reference.energy_scale),
        }
    }
}

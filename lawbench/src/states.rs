//! The states at which laws are measured: strains from 1e-8 to 10 and rotations, rounded to the working precision.

use tensormass_codegen::ir::Number;

/// Strains s: principal stretches are 1 + s a for a >= 0 and 1 / (1 + s |a|) for a < 0, with a in [-1, 1].
pub const STRAINS: [f64; 12] = [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.3, 0.5, 1.0, 10.0];

/// Angles in rad by which states are turned, about random axes.
pub const ROTATIONS: [f64; 5] = [0.0, 1e-3, 0.1, 0.5, 2.0];

/// A displacement gradient and the direction of its increment, row by row.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct State {
    /// G.
    pub gradient: [f64; 9],
    /// D.
    pub direction: [f64; 9],
}

/// A number type in which kernels compute.
pub trait Precision: Number + Copy {
    /// The nearest number of this type.
    fn nearest(x: f64) -> Self;
    /// The number as f64, exactly.
    fn exactly(self) -> f64;
}

impl Precision for f32 {
    fn nearest(x: f64) -> Self {
        x as Self
    }
    fn exactly(self) -> f64 {
        self.into()
    }
}

impl Precision for f64 {
    fn nearest(x: f64) -> Self {
        x
    }
    fn exactly(self) -> f64 {
        self
    }
}

/// Random numbers (splitmix64, Steele, Lea & Flood 2014): equal seeds give equal states.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A sequence of its own for each path of numbers, such as a seed and the indices of a cell.
    pub fn new(path: &[u64]) -> Self {
        let mut random = Self(0x6c61_7762_656e_6368);
        for &step in path {
            random.0 = random.next() ^ step;
        }
        random
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A matrix of uniform components in [-1, 1).
    pub fn direction(&mut self) -> [f64; 9] {
        std::array::from_fn(|_| self.signed())
    }

    /// A unit vector; all directions alike.
    fn axis(&mut self) -> [f64; 3] {
        loop {
            let v: [f64; 3] = std::array::from_fn(|_| self.signed());
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            if (0.1..=1.0).contains(&length) {
                return v.map(|x| x / length);
            }
        }
    }

    /// G = F - 1 of F = R U: principal strains of magnitude up to `strain` along random axes, turned by `rotation`.
    /// `sample` runs through three distinct stretches, two equal ones and three equal ones.
    pub fn gradient(&mut self, strain: f64, rotation: f64, sample: usize) -> [f64; 9] {
        let a: [f64; 3] = std::array::from_fn(|_| self.signed());
        let a = match sample % 3 {
            0 => a,
            1 => [a[0], a[1], a[1]],
            _ => [a[0]; 3],
        };
        let stretch = a.map(|a| {
            let x = strain * a.abs();
            if a >= 0.0 { x } else { -x / (1.0 + x) }
        });
        let angle = std::f64::consts::PI * self.signed();
        let axes = turned(&self.axis(), angle, &identity());
        // U - 1 = Q diag(stretch) Q', without a difference of numbers near 1.
        let u: [f64; 9] =
            std::array::from_fn(|k| (0..3).map(|m| axes[k / 3 * 3 + m] * stretch[m] * axes[k % 3 * 3 + m]).sum());
        if rotation == 0.0 {
            return u;
        }
        // G = (R - 1) + R (U - 1).
        let axis = self.axis();
        let (turn, moved) = (less_identity(&axis, rotation), turned(&axis, rotation, &u));
        std::array::from_fn(|k| turn[k] + moved[k])
    }
}

fn identity() -> [f64; 9] {
    std::array::from_fn(|k| if k % 4 == 0 { 1.0 } else { 0.0 })
}

/// R - 1 = sin(angle) K + (1 - cos(angle)) K K, where K x = axis x x (Rodrigues).
pub fn less_identity(axis: &[f64; 3], angle: f64) -> [f64; 9] {
    let [x, y, z] = *axis;
    let k = [0.0, -z, y, z, 0.0, -x, -y, x, 0.0];
    let (s, c) = (angle.sin(), 2.0 * (0.5 * angle).sin().powi(2));
    std::array::from_fn(|i| s * k[i] + c * (0..3).map(|m| k[i / 3 * 3 + m] * k[3 * m + i % 3]).sum::<f64>())
}

/// R A.
pub fn turned(axis: &[f64; 3], angle: f64, a: &[f64; 9]) -> [f64; 9] {
    let r = less_identity(axis, angle);
    std::array::from_fn(|k| a[k] + (0..3).map(|m| r[k / 3 * 3 + m] * a[3 * m + k % 3]).sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// F'F - 1 = G + G' + G'G.
    fn strain(g: &[f64; 9]) -> [f64; 9] {
        std::array::from_fn(|k| {
            let (i, j) = (k / 3, k % 3);
            g[3 * i + j] + g[3 * j + i] + (0..3).map(|m| g[3 * m + i] * g[3 * m + j]).sum::<f64>()
        })
    }

    #[test]
    fn states_have_their_strain_whatever_the_rotation() {
        for (s, strain_of) in STRAINS.iter().enumerate() {
            for (r, rotation) in ROTATIONS.iter().enumerate() {
                for sample in 0..30 {
                    let g =
                        Random::new(&[1, s as u64, r as u64, sample]).gradient(*strain_of, *rotation, sample as usize);
                    let c = strain(&g);
                    let norm = c.iter().map(|x| x * x).sum::<f64>().sqrt();
                    // Stretches up to 1 + s: eigenvalues of C - 1 up to s (2 + s), three of them, and round-off of the
                    // turned gradient, whose components are below 4 (1 + s).
                    let most = 3f64.sqrt() * strain_of * (2.0 + strain_of);
                    let noise = 64.0 * f64::EPSILON * rotation.min(1.0) * (1.0 + strain_of).powi(2);
                    assert!(norm <= most * (1.0 + 1e-12) + noise, "{strain_of} {rotation}: {norm} > {most}");
                    assert!(norm > 1e-3 * most, "{strain_of} {rotation}: {norm} of {most}");
                    if sample % 3 == 2 {
                        let shear = [c[1], c[2], c[5], c[0] - c[4], c[4] - c[8]];
                        assert!(shear.iter().all(|x| x.abs() <= 1e-13 * norm + noise), "equal stretches: {shear:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn paths_are_sequences_of_their_own() {
        let first = |path: &[u64]| Random::new(path).signed();
        assert_eq!(first(&[1, 2]), first(&[1, 2]));
        let all = [first(&[1, 2]), first(&[2, 1]), first(&[1, 2, 0]), first(&[1]), first(&[])];
        for i in 0..all.len() {
            assert!(all[i + 1..].iter().all(|x| *x != all[i]));
        }
    }
}

//! Deterministic random states: the seed of a failure is enough to repeat it.

use tensormass_kernels::LawInfo;

use crate::tensor;

/// splitmix64 (Steele, Lea & Flood 2014).
#[derive(Debug, Clone)]
pub struct Rng(u64);

impl Rng {
    /// A generator; equal seeds give equal sequences.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x7465_6e73_6f72)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform between two numbers.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A quaternion whose direction is uniform: all rotations alike.
    pub fn quaternion(&mut self) -> [f64; 4] {
        loop {
            let q = std::array::from_fn(|_| self.uniform(-1.0, 1.0));
            let square: f64 = q.iter().map(|x| x * x).sum();
            if (0.1..=1.0).contains(&square) {
                return q;
            }
        }
    }

    /// A matrix of multiples of 1/64 in [-1, 1]: exact in every precision, also after small multiples are added.
    pub fn direction(&mut self) -> [f64; 9] {
        std::array::from_fn(|_| (self.uniform(-1.0, 1.0) * 64.0).round() / 64.0)
    }

    /// G of F = R U, with principal stretches in [low, high] along random axes and a random rotation; the components
    /// are rounded to f32, so that f32 and f64 kernels take the same state.
    pub fn gradient(&mut self, low: f64, high: f64) -> [f64; 9] {
        let (turn, axes) = (tensor::rotation(self.quaternion()), tensor::rotation(self.quaternion()));
        let mut stretch = [0.0; 9];
        for k in [0, 4, 8] {
            stretch[k] = self.uniform(low, high);
        }
        let u = tensor::product(&axes, &tensor::product(&tensor::exact(&stretch), &tensor::transpose(&axes)));
        let g = tensor::shifted(&tensor::product(&turn, &u), -1.0);
        tensor::values(&g).map(|x| f64::from(x as f32))
    }

    /// A unit vector with rational components, each rounded once to f64: the rotated x axis of a quaternion of integers.
    pub fn unit_vector(&mut self) -> [f64; 3] {
        loop {
            let [w, x, y, z] = std::array::from_fn(|_| self.uniform(-16.0, 16.0).round());
            let square = w * w + x * x + y * y + z * z;
            if square > 0.0 {
                return [w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)]
                    .map(|n| n / square);
            }
        }
    }

    /// Parameters within the declared ranges, of ordinary size where the range allows: stresses between 1e5 and 1e7 Pa,
    /// pure numbers between -0.4 and 0.45, mirrored where only negative ones are allowed; directions are unit vectors.
    pub fn parameters(&mut self, info: &LawInfo) -> Vec<f64> {
        let mut all = vec![];
        for p in info.parameters {
            if p.direction {
                all.extend(self.unit_vector());
                continue;
            }
            let usual: (f64, f64) = match p.unit {
                "Pa" => (1e5, 1e7),
                "1" => (-0.4, 0.45),
                _ => (1.0, 2.0),
            };
            let usual = if p.range.1 <= 0.0 { (-usual.1, -usual.0) } else { usual };
            let (mut low, mut high) = (usual.0.max(p.range.0), usual.1.min(p.range.1));
            if low >= high {
                // Nothing usual is allowed: the part of the range that is nearest to it.
                (low, high) = if p.range.0 >= usual.1 {
                    (p.range.0, p.range.1.min(p.range.0 + p.range.0.abs().max(1.0)))
                } else {
                    (p.range.0.max(p.range.1 - p.range.1.abs().max(1.0)), p.range.1)
                };
            }
            all.extend((0..p.len).map(|_| self.uniform(low, high)));
        }
        all
    }
}

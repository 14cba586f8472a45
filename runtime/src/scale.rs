//! Units in which a body is computed: powers of two of the SI units, chosen so that its numbers are near one.
//!
//! Unscaled, the fourth powers and products of a millimetre mesh leave the range of f32. Because every factor is a power
//! of two, scaling rounds nothing: results are bitwise equal under a power-of-two change of units.

/// Factors from scaled to SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Metres a unit of length.
    pub length: f64,
    /// Pascals a unit of stress.
    pub stress: f64,
    /// Seconds a unit of time.
    pub time: f64,
}

/// The power of two nearest to x on a logarithmic scale; 1 where x is not a positive finite number.
fn power_of_two(x: f64) -> f64 {
    if x.is_finite() && x > 0.0 { x.log2().round().clamp(-300.0, 300.0).exp2() } else { 1.0 }
}

impl Scale {
    /// Units for a body of this size (m), stiffness (Pa) and density (kg/m^3).
    pub fn new(size: f64, stiffness: f64, density: f64) -> Self {
        let (length, stress) = (power_of_two(size), power_of_two(stiffness));
        // The time in which a wave crosses one unit of length.
        let time = power_of_two(length * (density / stress).sqrt());
        Self { length, stress, time }
    }

    /// SI value of one unit with these exponents of length, stress and time.
    pub fn unit(&self, [length, stress, time]: [i32; 3]) -> f64 {
        self.length.powi(length) * self.stress.powi(stress) * self.time.powi(time)
    }

    /// Newtons a unit of force.
    pub fn force(&self) -> f64 {
        self.unit([2, 1, 0])
    }

    /// Joules a unit of energy.
    pub fn energy(&self) -> f64 {
        self.unit([3, 1, 0])
    }

    /// Kilograms a unit of mass: force over acceleration.
    pub fn mass(&self) -> f64 {
        self.unit([1, 1, 2])
    }

    /// kg/m^3 a unit of density.
    pub fn density(&self) -> f64 {
        self.unit([-2, 1, 2])
    }

    /// m/s a unit of velocity.
    pub fn velocity(&self) -> f64 {
        self.unit([1, 0, -1])
    }

    /// m/s^2 a unit of acceleration.
    pub fn acceleration(&self) -> f64 {
        self.unit([1, 0, -2])
    }
}

//! A bar as a chain in f32 that stores positions, to ask what rounding x + h v does to a traction test. No solver of ours
//! stores positions; this is a model of one that does, one-dimensional and undamped.

use super::paper::{DENSITY, ELONGATION, LENGTH, YOUNG};
use super::series::Series;

/// How a sum in 64 bits becomes one in 32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rounding {
    /// To nearest, as IEEE 754 asks for.
    Nearest,
    /// Towards zero, as some devices did.
    TowardsZero,
}

impl Rounding {
    /// The f32 for a sum.
    fn round(self, sum: f64) -> f32 {
        let nearest = sum as f32;
        match self {
            Self::Nearest => nearest,
            Self::TowardsZero if f64::from(nearest).abs() > sum.abs() => f32::from_bits(nearest.to_bits() - 1),
            Self::TowardsZero => nearest,
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Nearest => "to nearest",
            Self::TowardsZero => "towards zero",
        }
    }
}

/// What the chain stores for a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stored {
    /// Its position; the moved end too is advanced by x + h v.
    Position,
    /// Its position; the moved end is put where it has to be at each time.
    PositionEndImposed,
    /// Its displacement; the moved end is advanced by u + h v.
    Displacement,
}

/// Relative error of the moved end's way after `ramp` s of x + h v in f32, from x = LENGTH.
pub fn way_error(step: f64, ramp: f64, rounding: Rounding) -> f64 {
    let steps = (ramp / step).round() as u64;
    let increment = f64::from((ELONGATION / ramp * step) as f32);
    let end = (0..steps).fold(LENGTH as f32, |x, _| rounding.round(f64::from(x) + increment));
    (f64::from(end) - LENGTH) / ELONGATION - 1.0
}

/// The moduli read from a chain in Pa, against time in s: from the imposed 5 %, and from the way the end really went.
pub fn traction(step: f64, ramp: f64, duration: f64, stored: Stored, rounding: Rounding) -> (Series, Series) {
    const CELLS: usize = 20;
    let cell = (LENGTH / CELLS as f64) as f32;
    let rest: Vec<f32> = (0..=CELLS).map(|i| i as f32 * cell).collect();
    // Per m2 of cross-section; the two ends are imposed and need no mass.
    let acceleration_of_force = (step / (DENSITY * LENGTH / CELLS as f64)) as f32;
    let stiffness = (YOUNG / f64::from(cell)) as f32;
    let origin = |i: usize| if stored == Stored::Displacement { 0.0 } else { rest[i] };
    let mut x: Vec<f32> = (0..=CELLS).map(origin).collect();
    let mut v = [0.0_f32; CELLS + 1];
    let (mut nominal, mut resulting) = (Series::default(), Series::default());
    let (steps, ramp_steps) = ((duration / step).round() as u64, (ramp / step).round() as u64);
    let speed = (ELONGATION / ramp) as f32;
    for k in 1..=steps {
        let force = |i: usize, x: &[f32]| stiffness * ((x[i + 1] - origin(i + 1)) - (x[i] - origin(i)));
        for i in 1..CELLS {
            v[i] += acceleration_of_force * (force(i, &x) - force(i - 1, &x));
        }
        v[CELLS] = if k <= ramp_steps { speed } else { 0.0 };
        for i in 1..=CELLS {
            x[i] = rounding.round(f64::from(x[i]) + f64::from(step as f32 * v[i]));
        }
        let reached = (k as f64 / ramp_steps as f64).min(1.0) * ELONGATION;
        if stored == Stored::PositionEndImposed {
            x[CELLS] = (LENGTH + reached) as f32;
        }
        let stress = f64::from(force(CELLS - 1, &x));
        let time = k as f64 * step;
        nominal.push(time, stress * LENGTH / reached);
        resulting.push(time, stress * LENGTH / f64::from(x[CELLS] - origin(CELLS)));
    }
    (nominal, resulting)
}

#[cfg(test)]
mod tests {
    use super::super::series::wave_period;
    use super::*;

    #[test]
    fn rounding_towards_zero_never_grows() {
        let one = 1.0_f64;
        let half_up = one + 0.75 * f64::from(f32::EPSILON);
        assert_eq!(Rounding::TowardsZero.round(half_up), 1.0);
        assert_eq!(Rounding::Nearest.round(half_up), 1.0 + f32::EPSILON);
        assert_eq!(Rounding::TowardsZero.round(-half_up), -1.0);
    }

    #[test]
    fn a_step_rounds_by_at_most_half_a_unit_of_the_position() {
        let ulp = f64::from(f32::EPSILON) * 4.0;
        for step in [0.00005, 0.0001, 0.0002, 0.04] {
            let bound = 0.48 / step * 0.5 * ulp / ELONGATION;
            assert!(way_error(step, 0.48, Rounding::Nearest).abs() <= bound + 1e-6, "{step}");
            assert!(way_error(step, 0.48, Rounding::TowardsZero) <= 1e-6, "{step}");
        }
    }

    #[test]
    fn a_chain_of_displacements_finds_the_modulus() {
        // Ends of ramp and run at 0.16 and 0.32 s: the wave has crossed the bar many times.
        let (nominal, _) = traction(0.0001, 0.16, 0.32, Stored::Displacement, Rounding::Nearest);
        let mean = nominal.hold(0.16, wave_period()).mean;
        assert!((mean / YOUNG - 1.0).abs() < 2e-3, "{mean}");
        // Stored positions lose or gain what the moved end's way does.
        let (nominal, resulting) = traction(0.00005, 0.16, 0.32, Stored::Position, Rounding::TowardsZero);
        let lost = way_error(0.00005, 0.16, Rounding::TowardsZero);
        let mean = |series: &Series| series.hold(0.16, wave_period()).mean / YOUNG - 1.0;
        assert!((mean(&nominal) - mean(&resulting) - lost).abs() < 0.1 * lost.abs(), "{lost}");
    }
}

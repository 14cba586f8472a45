//! What the paper prints in Tables 1 and 2, and what follows from it without its unprinted duration.

/// How a table's rows are stepped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Table 1.
    SemiImplicit,
    /// Table 2.
    Implicit,
}

impl Scheme {
    /// The scene's name for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::SemiImplicit => "semi-implicit-euler",
            Self::Implicit => "implicit-euler",
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::SemiImplicit => "semi-implicit Euler",
            Self::Implicit => "implicit Euler",
        }
    }
}

/// The material's Young's modulus in Pa, section 4.
pub const YOUNG: f64 = 1e8;
/// Density in kg/m3, section 4.
pub const DENSITY: f64 = 1000.0;
/// Length of the beam in m, section 4.
pub const LENGTH: f64 = 5.0;
/// Imposed elongation in m: 5 % of the length, section 4.1.
pub const ELONGATION: f64 = 0.25;
/// Seconds for addForce and for addDForce on the beam of Hooke's law, Table 4.
pub const ADD_FORCE: (f64, f64) = (0.0150, 0.1367);
/// Total of Table 4 in s.
pub const TABLE_4_TOTAL: f64 = 0.1576;

/// One printed row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Its table's scheme.
    pub scheme: Scheme,
    /// Time step in s.
    pub step: f64,
    /// Computed Young's modulus in Pa.
    pub young: f64,
    /// Total run time in s, as rounded as printed.
    pub seconds: f64,
}

impl Row {
    const fn new(scheme: Scheme, step: f64, young: f64, seconds: f64) -> Self {
        Self { scheme, step, young, seconds }
    }

    /// Relative error of the modulus.
    pub fn error(&self) -> f64 {
        self.young / YOUNG - 1.0
    }

    /// Run time of a step in ms, times the unprinted duration in s: seconds / (duration / step).
    pub fn step_cost(&self) -> f64 {
        self.seconds * self.step * 1e3
    }
}

/// The rows of Table 1, then those of Table 2.
pub const ROWS: [Row; 9] = [
    Row::new(Scheme::SemiImplicit, 0.00005, 98_775_400.0, 220.0),
    Row::new(Scheme::SemiImplicit, 0.0001, 99_360_500.0, 108.0),
    Row::new(Scheme::SemiImplicit, 0.0002, 100_041_000.0, 52.0),
    Row::new(Scheme::Implicit, 0.00005, 96_177_200.0, 841.0),
    Row::new(Scheme::Implicit, 0.0001, 97_839_800.0, 418.0),
    Row::new(Scheme::Implicit, 0.0002, 98_910_300.0, 205.0),
    Row::new(Scheme::Implicit, 0.04, 99_993_400.0, 5.0),
    Row::new(Scheme::Implicit, 0.08, 99_998_200.0, 2.0),
    Row::new(Scheme::Implicit, 0.16, 99_998_500.0, 1.0),
];

/// The printed averages, in the order of their blocks of three rows.
pub const AVERAGES: [f64; 3] = [99_392_300.0, 97_642_430.0, 99_996_700.0];

/// The mean of the errors of three rows and the mean of their magnitudes: equal only if no two errors differ in sign.
pub fn averages(errors: &[f64]) -> (f64, f64) {
    let n = errors.len() as f64;
    (errors.iter().sum::<f64>() / n, errors.iter().map(|e| e.abs()).sum::<f64>() / n)
}

/// Largest over smallest magnitude.
pub fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let magnitudes = values.map(f64::abs);
    magnitudes.clone().fold(0.0, f64::max) / magnitudes.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_averages_follow_from_printed_rows() {
        for (block, average) in ROWS.chunks(3).zip(AVERAGES) {
            let mean = block.iter().map(|row| row.young).sum::<f64>() / 3.0;
            // The largest rounding in the tables is to 100 Pa.
            assert!((mean - average).abs() <= 100.0, "{mean} {average}");
        }
    }

    #[test]
    fn an_average_over_both_signs_is_smaller_than_the_errors() {
        assert_eq!(averages(&[-0.25, 0.25, 0.5]), (0.5 / 3.0, 1.0 / 3.0));
        assert_eq!(spread([-2.0, 0.5, 1.0].into_iter()), 4.0);
    }

    #[test]
    fn the_cost_of_a_step_does_not_depend_on_the_step_in_a_block() {
        // What "total time proportional to 1/h" means: the duration is the same for all rows of Table 1.
        assert!(spread(ROWS[..3].iter().map(Row::step_cost)) < 1.06);
    }
}

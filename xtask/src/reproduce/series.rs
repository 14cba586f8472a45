//! A modulus against time, and what is read from it: at the end, and as mean and amplitude over the hold.

use std::collections::BTreeMap;

use super::paper::{DENSITY, LENGTH, YOUNG};

/// Values against time in s, in the order of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    points: Vec<(f64, f64)>,
}

/// What a hold says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// The last value.
    pub end: f64,
    /// Mean over the last whole wave periods that fit into the second half of the hold.
    pub mean: f64,
    /// Half of what the values vary by over the same periods.
    pub amplitude: f64,
    /// Half of what they vary by over the last wave period; NaN with fewer than 4 values in it.
    pub left: f64,
}

/// The time in s of a wave of axial stress along the beam and back.
pub fn wave_period() -> f64 {
    2.0 * LENGTH / (YOUNG / DENSITY).sqrt()
}

impl Series {
    /// Adds a value at a time in s.
    pub fn push(&mut self, time: f64, value: f64) {
        self.points.push((time, value));
    }

    /// One column of a probe table, by the beginning of its heading; None if there is none, or no number in it.
    pub fn read(csv: &str, column: &str) -> Option<Self> {
        let mut lines = csv.lines();
        let place = lines.next()?.split(',').position(|heading| heading.starts_with(column))?;
        let mut series = Self::default();
        for line in lines {
            let cells: Vec<&str> = line.split(',').collect();
            let (time, value): (f64, f64) = (cells.first()?.parse().ok()?, cells.get(place)?.parse().ok()?);
            // At rest a modulus is 0/0.
            if value.is_finite() {
                series.push(time, value);
            }
        }
        (!series.points.is_empty()).then_some(series)
    }

    /// The values at whole multiples of an interval in s, after a time in s.
    pub fn every(&self, interval: f64, after: f64) -> BTreeMap<u64, f64> {
        let kept =
            self.points.iter().filter(|p| p.0 > after && (p.0 / interval - (p.0 / interval).round()).abs() < 1e-3);
        kept.map(|p| ((p.0 / interval).round() as u64, p.1)).collect()
    }

    /// What the values say after the ramp's end; without a hold of two wave periods, of its last value alone.
    pub fn hold(&self, ramp: f64, period: f64) -> Hold {
        let (last, end) = self.points.last().copied().unwrap_or((f64::NAN, f64::NAN));
        // The first half holds the impulse that stops the beam: with long steps, all of it is in one of few values.
        let periods = ((last - ramp) / 2.0 / period).floor();
        let after = |time: f64| self.points.iter().filter(move |p| p.0 > time).map(|p| p.1);
        let half = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (v.min(l), v.max(h)));
            (high - low) / 2.0
        };
        if periods < 1.0 {
            return Hold { end, mean: f64::NAN, amplitude: f64::NAN, left: f64::NAN };
        }
        let window = last - periods * period;
        let (sum, count) = after(window).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        let enough = after(last - period).count() >= 4;
        let left = if enough { half(&mut after(last - period)) } else { f64::NAN };
        Hold { end, mean: sum / count, amplitude: half(&mut after(window)), left }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hold_is_read_over_whole_periods_after_the_ramp() {
        let mut series = Series::default();
        for k in 1..=450 {
            let time = f64::from(k) * 0.01;
            // A ramp and a beginning that would spoil the mean; then 2 + sin, whose amplitude is 1.
            let value = if time <= 2.0 { 100.0 } else { 2.0 + (std::f64::consts::TAU * time).sin() };
            series.push(time, value);
        }
        let hold = series.hold(0.0, 1.0);
        assert!((hold.mean - 2.0).abs() < 1e-9 && (hold.amplitude - 1.0).abs() < 1e-9, "{hold:?}");
        assert!((hold.left - 1.0).abs() < 1e-9 && (hold.end - 2.0).abs() < 1e-9, "{hold:?}");
        assert!(series.hold(3.0, 1.0).mean.is_nan(), "one and a half periods are no hold");
    }

    #[test]
    fn instants_are_whole_multiples() {
        let mut series = Series::default();
        for k in 1..=9 {
            series.push(f64::from(k) * 0.00005, f64::from(k));
        }
        assert_eq!(series.every(0.0001, 0.0002), BTreeMap::from([(3, 6.0), (4, 8.0)]));
    }

    #[test]
    fn a_column_is_found_by_its_heading() {
        let csv = "time_s,support [N],young [Pa]\n0,1,NaN\n0.5,2,3\n";
        let mut wanted = Series::default();
        wanted.push(0.5, 3.0);
        assert_eq!(Series::read(csv, "young"), Some(wanted));
        assert_eq!(Series::read(csv, "elastic"), None);
    }
}

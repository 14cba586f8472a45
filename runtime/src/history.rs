//! Values over time: piecewise linear tables, constant before the first and after the last entry.

/// A piecewise linear function of time.
#[derive(Debug, Clone, PartialEq)]
pub struct History(Vec<(f64, f64)>);

impl History {
    /// A constant.
    pub fn constant(value: f64) -> Self {
        Self(vec![(0.0, value)])
    }

    /// A table of (time, value), strictly increasing in time; `None` if it is empty or not increasing or not finite.
    pub fn table(entries: Vec<(f64, f64)>) -> Option<Self> {
        let finite = entries.iter().all(|(t, v)| t.is_finite() && v.is_finite());
        let increasing = entries.windows(2).all(|w| w[0].0 < w[1].0);
        (finite && increasing && !entries.is_empty()).then_some(Self(entries))
    }

    /// The value at a time.
    pub fn at(&self, time: f64) -> f64 {
        let next = self.0.partition_point(|&(t, _)| t <= time);
        match (next.checked_sub(1).map(|i| self.0[i]), self.0.get(next)) {
            (Some((t0, v0)), Some(&(t1, v1))) => v0 + (v1 - v0) * ((time - t0) / (t1 - t0)),
            (Some((_, v)), None) => v,
            (None, Some(&(_, v))) => v,
            (None, None) => unreachable!("a table has an entry"),
        }
    }

    /// The same function with times and values multiplied.
    pub fn scaled(&self, time: f64, value: f64) -> Self {
        Self(self.0.iter().map(|&(t, v)| (t * time, v * value)).collect())
    }

    /// Whether the value changes with time.
    pub fn is_constant(&self) -> bool {
        self.0.iter().all(|&(_, v)| v == self.0[0].1)
    }
}

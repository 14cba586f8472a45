//! Values over time: piecewise linear tables, constant before the first and after the last entry, and what a turn by such an
//! angle makes of a coordinate.

use std::sync::Arc;

/// A function of time.
#[derive(Debug, Clone, PartialEq)]
pub enum History {
    /// Piecewise linear: (time, value), strictly increasing in time, at least one.
    Table(Table),
    /// sine sin a + versine (1 - cos a) of an angle a over time.
    Turn {
        /// The angle in rad.
        angle: Arc<Table>,
        /// The factor of its sine.
        sine: f64,
        /// The factor of 1 minus its cosine.
        versine: f64,
    },
}

/// Entries (time, value).
#[derive(Debug, Clone, PartialEq)]
pub struct Table(Vec<(f64, f64)>);

impl Table {
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

    fn scaled(&self, time: f64, value: f64) -> Self {
        Self(self.0.iter().map(|&(t, v)| (t * time, v * value)).collect())
    }

    fn is_constant(&self) -> bool {
        self.0.iter().all(|&(_, v)| v == self.0[0].1)
    }
}

impl History {
    /// A constant.
    pub fn constant(value: f64) -> Self {
        Self::Table(Table(vec![(0.0, value)]))
    }

    /// A table of (time, value), strictly increasing in time; `None` if it is empty or not increasing or not finite.
    pub fn table(entries: Vec<(f64, f64)>) -> Option<Self> {
        let finite = entries.iter().all(|(t, v)| t.is_finite() && v.is_finite());
        let increasing = entries.windows(2).all(|w| w[0].0 < w[1].0);
        (finite && increasing && !entries.is_empty()).then_some(Self::Table(Table(entries)))
    }

    /// The displacement along each axis of a point that turns by an angle (rad) about a unit vector through the origin
    /// (Rodrigues).
    pub fn turn(angle: &Arc<Table>, axis: [f64; 3], [x, y, z]: [f64; 3]) -> [Self; 3] {
        let [a, b, c] = axis;
        let across = [b * z - c * y, c * x - a * z, a * y - b * x];
        let [p, q, r] = across;
        let towards = [b * r - c * q, c * p - a * r, a * q - b * p];
        std::array::from_fn(|i| match [across[i], towards[i]] {
            [0.0, 0.0] => Self::constant(0.0),
            [sine, versine] => Self::Turn { angle: Arc::clone(angle), sine, versine },
        })
    }

    /// The value at a time.
    pub fn at(&self, time: f64) -> f64 {
        match self {
            Self::Table(table) => table.at(time),
            Self::Turn { angle, sine, versine } => {
                let angle = angle.at(time);
                // 1 - cos loses its digits at small angles.
                sine * angle.sin() + versine * 2.0 * (0.5 * angle).sin().powi(2)
            }
        }
    }

    /// The same function with times and values multiplied.
    pub fn scaled(&self, time: f64, value: f64) -> Self {
        match self {
            Self::Table(table) => Self::Table(table.scaled(time, value)),
            Self::Turn { angle, sine, versine } => {
                Self::Turn { angle: Arc::new(angle.scaled(time, 1.0)), sine: sine * value, versine: versine * value }
            }
        }
    }

    /// Whether the value changes with time.
    pub fn is_constant(&self) -> bool {
        match self {
            Self::Table(table) => table.is_constant(),
            Self::Turn { angle, .. } => angle.is_constant(),
        }
    }
}

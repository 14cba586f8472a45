//! Where an obstacle is over time: its place at rest, and a prescribed rigid motion.

use nalgebra::{Point3, Rotation3, Unit, Vector3};

use crate::history::History;

/// A frame: points x of it are at rotation x + origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The directions of its axes.
    pub rotation: Rotation3<f64>,
    /// Where its origin is.
    pub origin: Point3<f64>,
}

/// A rigid motion: a turn about an axis, then a translation.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidMotion {
    /// Translation along x, y, z.
    pub translation: [History; 3],
    /// The turn, if there is one.
    pub turn: Option<Turn>,
}

/// A turn about an axis that does not move.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    /// A point of the axis.
    pub centre: Point3<f64>,
    /// The axis's direction.
    pub axis: Unit<Vector3<f64>>,
    /// The angle in rad over time, by the right hand.
    pub angle: History,
}

impl RigidMotion {
    /// Where it has brought at a time what was here at rest.
    pub fn of(&self, rest: &Pose, time: f64) -> Pose {
        let mut pose = *rest;
        if let Some(Turn { centre, axis, angle }) = &self.turn {
            let turned = Rotation3::from_axis_angle(axis, angle.at(time));
            pose = Pose { rotation: turned * rest.rotation, origin: centre + turned * (rest.origin - centre) };
        }
        let translation = self.translation.each_ref().map(|history| history.at(time));
        Pose { origin: pose.origin + Vector3::from(translation), ..pose }
    }

    /// Whether it moves nothing.
    pub fn is_still(&self) -> bool {
        self.translation.iter().all(History::is_constant) && self.turn.as_ref().is_none_or(|t| t.angle.is_constant())
    }
}

/// A rotation that brings the z axis to a direction: exactly, where that is an axis of coordinates.
pub fn facing(direction: Unit<Vector3<f64>>) -> Rotation3<f64> {
    // The coordinate axis that is farthest from it.
    let aside = Vector3::ith(direction.iamin(), 1.0);
    let x = Unit::new_normalize(aside.cross(&direction));
    let y = direction.cross(&x);
    Rotation3::from_basis_unchecked(&[x.into_inner(), y, direction.into_inner()])
}

//! Shapes of obstacles, each in a frame of its own: the distance of a point, and the direction in which it grows.
//!
//! Distances are Euclidean and signed, negative inside. Those of convex shapes are convex functions of the point, written once
//! over [`Scalar`]: a CPU runs them, a GPU gets their trace.

use std::sync::Arc;

use super::grid::Grid;
use super::solid::Solid;
use crate::backend::Scalar;

/// A shape; lengths in m, or in whatever unit points have.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A convex one in closed form.
    Convex(Convex),
    /// What a surface of triangles encloses.
    Solid(Arc<Solid>),
    /// The same by its distances on a grid.
    Grid(Arc<Grid>),
}

/// A convex shape around the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Convex {
    /// The half-space z <= 0.
    Plane,
    /// What is no farther than `radius` from the points of the z axis with |z| <= `half`; a sphere where `half` is 0.
    Capsule {
        /// Half of the axis's length.
        half: f64,
        /// The radius.
        radius: f64,
    },
    /// |x|, |y|, |z| at most these.
    Box {
        /// Half of the edges' lengths.
        half: [f64; 3],
    },
    /// |z| <= `half`, and no farther than `radius` from the z axis.
    Cylinder {
        /// Half of the axis's length.
        half: f64,
        /// The radius.
        radius: f64,
    },
}

/// How a path is followed to a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Approach {
    /// From tangent plane to tangent plane: what is convex lies behind each of them.
    Tangents,
    /// By the distance at a time: nothing is nearer.
    Distances,
}

/// Where a shape's surface is, seen from a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest<S> {
    /// The direction in which the distance grows, a unit vector.
    pub normal: [S; 3],
    /// The signed distance.
    pub distance: S,
}

impl Shape {
    /// The shape's surface seen from a point. Where several directions are equally right it is one of them.
    pub fn nearest(&self, point: [f64; 3]) -> Nearest<f64> {
        match self {
            Self::Convex(shape) => shape.nearest(point),
            Self::Solid(solid) => solid.nearest(point),
            Self::Grid(grid) => grid.nearest(point),
        }
    }

    /// How its surface is approached.
    pub fn approach(&self) -> Approach {
        match self {
            Self::Convex(_) => Approach::Tangents,
            Self::Solid(_) | Self::Grid(_) => Approach::Distances,
        }
    }

    /// How far from its origin a point of its surface may be.
    pub fn reach(&self) -> f64 {
        match self {
            Self::Convex(shape) => shape.reach(),
            Self::Solid(solid) => solid.reach(),
            Self::Grid(grid) => grid.reach(),
        }
    }

    /// What a surface of triangles encloses.
    pub fn solid(&self) -> Option<&Solid> {
        match self {
            Self::Solid(solid) => Some(solid),
            Self::Convex(_) | Self::Grid(_) => None,
        }
    }

    /// Bytes of what it looks up.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Convex(_) => 0,
            Self::Solid(solid) => solid.bytes(),
            Self::Grid(grid) => size_of_val(grid.values()),
        }
    }

    /// The same with distances on a grid in place of triangles.
    pub fn baked(&self) -> Self {
        match self {
            Self::Solid(solid) => Self::Grid(Arc::new(Grid::bake(solid))),
            Self::Convex(_) | Self::Grid(_) => self.clone(),
        }
    }
}

impl Convex {
    /// The shape's surface seen from a point. Where several directions are equally right it is one of them.
    pub fn nearest<S: Scalar>(self, [x, y, z]: [S; 3]) -> Nearest<S> {
        let [zero, one] = [0.0, 1.0].map(S::number);
        match self {
            Self::Plane => Nearest { normal: [zero, zero, one], distance: z },
            Self::Capsule { half, radius } => {
                let beyond = z - z.max(S::number(-half)).min(S::number(half));
                let (normal, length) = direction([x, y, beyond], [zero, zero, one]);
                Nearest { normal, distance: length - S::number(radius) }
            }
            Self::Box { half } => {
                let point = [x, y, z];
                let over: [S; 3] = std::array::from_fn(|i| point[i].abs() - S::number(half[i]));
                let (outward, distance) = corner(over);
                let normal = std::array::from_fn(|i| outward[i] * point[i].sign());
                Nearest { normal, distance }
            }
            Self::Cylinder { half, radius } => {
                let (radial, length) = direction([x, y], [one, zero]);
                let ([aside, along], distance) = corner([length - S::number(radius), z.abs() - S::number(half)]);
                Nearest { normal: [aside * radial[0], aside * radial[1], along * z.sign()], distance }
            }
        }
    }

    /// The same shape with all lengths multiplied.
    pub fn scaled(self, factor: f64) -> Self {
        match self {
            Self::Plane => Self::Plane,
            Self::Capsule { half, radius } => Self::Capsule { half: half * factor, radius: radius * factor },
            Self::Box { half } => Self::Box { half: half.map(|x| x * factor) },
            Self::Cylinder { half, radius } => Self::Cylinder { half: half * factor, radius: radius * factor },
        }
    }

    fn reach(self) -> f64 {
        match self {
            Self::Plane => 0.0,
            Self::Capsule { half, radius } => half + radius,
            Self::Box { half } => half.iter().map(|x| x * x).sum::<f64>().sqrt(),
            Self::Cylinder { half, radius } => half.hypot(radius),
        }
    }
}

/// The unit vector along x and the length of x; what is given instead where x is 0.
fn direction<S: Scalar, const N: usize>(x: [S; N], instead: [S; N]) -> ([S; N], S) {
    let [zero, one] = [0.0, 1.0].map(S::number);
    let length = x.iter().fold(zero, |sum, x| sum + *x * *x).sqrt();
    let divisor = S::select_greater(length, zero, length, one);
    (std::array::from_fn(|i| S::select_greater(length, zero, x[i] / divisor, instead[i])), length)
}

/// The distance from the corner of the quadrant where all coordinates are negative, and the direction in which it grows.
fn corner<S: Scalar, const N: usize>(x: [S; N]) -> ([S; N], S) {
    let [zero, one] = [0.0, 1.0].map(S::number);
    // Inside: towards the nearest side, the first of equal ones.
    let greatest = x.iter().skip(1).fold(x[0], |greatest, x| greatest.max(*x));
    let mut left = one;
    let inward = x.map(|x| {
        let is_it = left * S::select_greater(greatest, x, zero, one);
        left = left - is_it;
        is_it
    });
    let (outward, length) = direction(x.map(|x| x.max(zero)), inward);
    (outward, S::select_greater(length, zero, length, greatest))
}

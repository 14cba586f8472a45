//! What contact does to a node in a step: projection onto the surface that it meets, with Coulomb's friction.
//!
//! After Li et al. 2014, section III-C, with Coulomb's cone in place of their box. A node moves from x by d, without contact.
//! Where that path enters the obstacle, at c, the rest of it, r, is cut by the tangent plane there: its normal part, N inwards,
//! is undone (their in-projection), and of the tangential part up to mu N (all of it: their out-projection, the node stays
//! where it hit). The velocity changes by as much a step: what remains of a central difference is consistent, the impulse is
//! mass times this change, and a convex obstacle at rest never gives energy: the node ends within the ball around x through
//! x + d. An impact takes the normal velocity of the node, a part of it in this step, the rest in the next; a body that
//! bounces does so by its elasticity.

use super::pose::Pose;
use super::shape::{Approach, Nearest};
use crate::backend::Scalar;

impl Approach {
    /// Steps along a path to where it enters an obstacle, at most. What is still left after the last counts as gap.
    pub fn steps(self) -> usize {
        match self {
            // Newton's. The distance along a path is convex: they come from outside, one is enough for a plane, and on curved
            // surfaces each doubles the digits.
            Self::Tangents => 8,
            // By the distance (sphere tracing, Hart 1996): they pass through nothing, and come the faster the straighter the path
            // meets the surface.
            Self::Distances => 64,
        }
    }
}

/// A node's move, in the obstacle's frame.
#[derive(Debug, Clone, Copy)]
pub struct Move<S> {
    /// Where it begins.
    pub from: [S; 3],
    /// How it goes on without contact.
    pub by: [S; 3],
}

/// What contact is like.
#[derive(Debug, Clone, Copy)]
pub struct Surface<S> {
    /// The coefficient of friction of a node that sticks: more than it takes to slide, at least the other.
    pub sticking: S,
    /// The coefficient of friction of a node that slides.
    pub sliding: S,
    /// Distances up to this are rounding.
    pub tolerance: S,
}

/// What contact changes.
#[derive(Debug, Clone, Copy)]
pub struct Response<S> {
    /// Of the displacement, and divided by the step of the velocity.
    pub change: [S; 3],
    /// Of the displacement alone: out of an obstacle in which the node was already.
    pub push: [S; 3],
}

/// How an obstacle's frame moves in a step. What it turns by and moves by are differences of their own: those of two frames
/// would have the roundings of these.
#[derive(Debug, Clone, Copy)]
pub struct Passage<S> {
    /// The rows of its rotation before the step.
    pub rotation: [[S; 3]; 3],
    /// What the step adds to it.
    pub turned: [[S; 3]; 3],
    /// Where its origin was before.
    pub origin: [S; 3],
    /// What the step adds to that.
    pub moved: [S; 3],
}

/// Numbers of a passage.
pub const NUMBERS: usize = 24;

impl<S: Copy> Passage<S> {
    /// All numbers.
    pub fn numbers(&self) -> [S; NUMBERS] {
        let Self { rotation, turned, origin, moved } = self;
        let rows = rotation.iter().chain(turned).chain([origin, moved]);
        let mut numbers = rows.flatten().copied();
        std::array::from_fn(|_| numbers.next().expect("eight rows of three"))
    }

    /// A passage of these numbers.
    pub fn of(numbers: [S; NUMBERS]) -> Self {
        let row = |k: usize| [numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]];
        Self { rotation: [0, 1, 2].map(row), turned: [3, 4, 5].map(row), origin: row(6), moved: row(7) }
    }
}

impl Passage<f64> {
    /// From one pose to another.
    pub fn between(before: &Pose, after: &Pose) -> Self {
        let rows = |m: &nalgebra::Matrix3<f64>| [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[(i, j)]));
        Self {
            rotation: rows(before.rotation.matrix()),
            turned: rows(&(after.rotation.matrix() - before.rotation.matrix())),
            origin: before.origin.coords.into(),
            moved: (after.origin - before.origin).into(),
        }
    }
}

impl<S: Scalar> Passage<S> {
    /// A point of space before the step, in the obstacle's frame.
    pub fn local(&self, point: [S; 3]) -> [S; 3] {
        transposed(&self.rotation, std::array::from_fn(|i| point[i] - self.origin[i]))
    }

    /// A move in space, as the obstacle sees it.
    pub fn seen(&self, node: Move<S>) -> Move<S> {
        let arm: [S; 3] = std::array::from_fn(|i| node.from[i] - self.origin[i]);
        let relative = transposed(&self.after(), std::array::from_fn(|i| node.by[i] - self.moved[i]));
        let swept = transposed(&self.turned, arm);
        Move { from: self.local(node.from), by: std::array::from_fn(|i| relative[i] + swept[i]) }
    }

    /// The displacement of a point of space that the obstacle sees moved so.
    pub fn way(&self, from: [S; 3], seen: [S; 3]) -> [S; 3] {
        let arm: [S; 3] = std::array::from_fn(|i| from[i] - self.origin[i]);
        let swept = transposed(&self.turned, arm);
        let way = self.outside(std::array::from_fn(|i| seen[i] - swept[i]));
        std::array::from_fn(|i| way[i] + self.moved[i])
    }

    /// A direction of the obstacle's frame after the step, in space.
    pub fn outside(&self, direction: [S; 3]) -> [S; 3] {
        self.after().map(|row| dot(row, direction))
    }

    /// The rotation after the step.
    fn after(&self) -> [[S; 3]; 3] {
        std::array::from_fn(|i| std::array::from_fn(|j| self.rotation[i][j] + self.turned[i][j]))
    }
}

fn transposed<S: Scalar>(m: &[[S; 3]; 3], x: [S; 3]) -> [S; 3] {
    std::array::from_fn(|j| m[0][j] * x[0] + m[1][j] * x[1] + m[2][j] * x[2])
}

/// The part of a move after which it meets an obstacle, and the surface seen from there: of what is met, its tangent plane; the
/// end's, where nothing is met. `nearest` sees the obstacle from a point.
pub fn meets(
    nearest: impl Fn([f64; 3]) -> Nearest<f64>,
    approach: Approach,
    Move { from, by }: Move<f64>,
    tolerance: f64,
) -> (f64, Nearest<f64>) {
    let at = |t: f64| nearest(std::array::from_fn(|i| from[i] + t * by[i]));
    let (mut t, mut seen) = (0.0, nearest(from));
    for _ in 0..approach.steps() {
        if seen.distance <= tolerance || t >= 1.0 {
            break;
        }
        t = further(approach, seen, by, t);
        seen = at(t);
    }
    // What slides along one side of a hollow may run into the next.
    if approach == Approach::Distances && at_end(seen, by, t).distance >= 0.0 {
        let end = at(1.0);
        if end.distance < -tolerance {
            seen = seen_before(end, by, t);
        }
    }
    (t, seen)
}

/// How far to go on a path that has come as far as t, where it sees this.
pub fn further<S: Scalar>(approach: Approach, seen: Nearest<S>, by: [S; 3], t: S) -> S {
    let [zero, one] = [0.0, 1.0].map(S::number);
    let closing = match approach {
        // To where the tangent plane is met; never where the node moves away from it.
        Approach::Tangents => zero - dot(seen.normal, by),
        Approach::Distances => dot(by, by).sqrt(),
    };
    let further = seen.distance / S::select_greater(closing, zero, closing, one);
    S::select_greater(closing, zero, (t + further).min(one), one)
}

/// The plane that is seen at a part of a path, as it is seen from its end.
pub fn at_end<S: Scalar>(seen: Nearest<S>, by: [S; 3], t: S) -> Nearest<S> {
    let rest = (S::number(1.0) - t) * dot(seen.normal, by);
    Nearest { distance: seen.distance + rest, ..seen }
}

/// The plane that is seen at the end of a path, as it is seen from a part of it.
pub fn seen_before<S: Scalar>(end: Nearest<S>, by: [S; 3], t: S) -> Nearest<S> {
    let rest = (S::number(1.0) - t) * dot(end.normal, by);
    Nearest { distance: end.distance - rest, ..end }
}

/// The response to a move that meets a surface after a part of it: see [`meets`].
pub fn respond<S: Scalar>((t, seen): (S, Nearest<S>), node: Move<S>, surface: Surface<S>) -> Response<S> {
    let [zero, one] = [0.0, 1.0].map(S::number);
    let by = node.by;
    let gap = S::select_greater(seen.distance, surface.tolerance, seen.distance, zero);
    let rest = by.map(|d| (one - t) * d);
    let inward = zero - dot(seen.normal, rest);
    let undone = (inward - gap).max(zero);
    // What was inside already comes out, as far as it does not by itself.
    let inside = (inward - undone - seen.distance).max(zero);
    let push = S::select_greater(zero - surface.tolerance, seen.distance, inside, zero);
    let tangential: [S; 3] = std::array::from_fn(|i| rest[i] + inward * seen.normal[i]);
    let length = dot(tangential, tangential).sqrt();
    let slides = surface.sliding * undone / S::select_greater(length, zero, length, one);
    let held = S::select_greater(length, surface.sticking * undone, slides.min(one), one);
    Response {
        change: std::array::from_fn(|i| undone * seen.normal[i] - held * tangential[i]),
        push: seen.normal.map(|n| push * n),
    }
}

fn dot<S: Scalar>(a: [S; 3], b: [S; 3]) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

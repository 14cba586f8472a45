//! What looks as if it was given in other units than SI.

use nalgebra::{Point3, Vector3};

use crate::mesh::Mesh;
use crate::scene::{Load, Scene, Shape};

/// An obstacle so many times larger or farther away than the body is large is worth a warning.
const APART: f64 = 1e3;

/// Warnings of a scene whose body has this stiffness (Pa) and density (kg/m3).
pub fn warnings(scene: &Scene, mesh: &Mesh, stiffness: f64, density: f64) -> Vec<String> {
    let mut warnings = vec![];
    let [low, high] = mesh.bounding_box().map(Point3::from);
    let (middle, diagonal) = (nalgebra::center(&low, &high), (high - low).norm());
    let gravity: f64 = scene
        .load
        .iter()
        .filter_map(|load| match load {
            Load::Gravity { acceleration, .. } => Some(Vector3::from(*acceleration)),
            Load::Traction { .. } | Load::Pressure { .. } | Load::Force { .. } => None,
        })
        .sum::<Vector3<f64>>()
        .norm();
    let compressed = density * gravity * diagonal / stiffness;
    if compressed > 1.0 {
        warnings.push(format!(
            "the body's weight is {compressed:.1e} times what presses it flat (density {density} kg/m3, {gravity} m/s2, \
             {diagonal:.3e} m, stiffness {stiffness:.3e} Pa): are these SI units?"
        ));
    }
    for (i, obstacle) in scene.obstacle.iter().enumerate() {
        let (size, far) = match &obstacle.shape {
            // A half-space is large, and its point may be anywhere. The size of a surface is its file's.
            Shape::Plane { .. } | Shape::Mesh(_) => continue,
            Shape::Box { centre, size, .. } => (Vector3::from(*size).norm(), *centre),
            Shape::Sphere { centre, radius } => (2.0 * radius, *centre),
            Shape::Capsule(rod) | Shape::Cylinder(rod) => {
                ((Vector3::from(rod.to) - Vector3::from(rod.from)).norm() + 2.0 * rod.radius, rod.from)
            }
        };
        let times = size.max((Point3::from(far) - middle).norm() - size) / diagonal;
        if times > APART {
            warnings.push(format!(
                "obstacle.{i} is {times:.1e} times as large, or as far away, as the body is large: are all lengths in m? Distances \
                 are rounded to a part of the largest"
            ));
        }
    }
    warnings
}

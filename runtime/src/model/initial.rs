//! The state at time 0: displacement by a gradient that is the same everywhere, velocity of a rigid body.

use nalgebra::{Matrix3, Vector3};

use crate::body::Start;
use crate::mesh::Mesh;
use crate::scale::Scale;
use crate::scene::{Scene, SceneError};

/// What a scene gives; `masses` are those of the nodes, in any unit.
///
/// # Errors
/// A displaced body beside obstacles: they are met from the state at rest.
pub(super) fn start(scene: &Scene, mesh: &Mesh, masses: &[f64], scale: &Scale) -> Result<Start, SceneError> {
    let given = &scene.initial;
    let velocity = given.velocity.map(|v| v / scale.velocity());
    let (is_displaced, spins) = (given.gradient != [[0.0; 3]; 3], given.angular_velocity != [0.0; 3]);
    if is_displaced && !scene.obstacle.is_empty() {
        return Err(SceneError::at(
            scene.locate("initial.gradient"),
            "a body is at rest where obstacles are placed: a displaced one might begin inside them",
            "leave out initial.gradient, or the [[obstacle]]",
        ));
    }
    if !is_displaced && !spins {
        return Ok(Start::moving(velocity));
    }
    let middle = |at: &dyn Fn(usize) -> Vector3<f64>| {
        let sum: Vector3<f64> = masses.iter().enumerate().map(|(k, mass)| at(k) * *mass).sum();
        sum / masses.iter().sum::<f64>()
    };
    let rest = |k: usize| Vector3::from(mesh.nodes()[k]);
    let about = given.about.map_or_else(|| middle(&rest), Vector3::from);
    let gradient = Matrix3::from_fn(|i, j| given.gradient[i][j]);
    let moved = |k: usize| gradient * (rest(k) - about);
    let (spin, turns_about) = (Vector3::from(given.angular_velocity), middle(&|k| rest(k) + moved(k)));
    let turning = |k: usize| Vector3::from(given.velocity) + spin.cross(&(rest(k) + moved(k) - turns_about));
    let each =
        |of: &dyn Fn(usize) -> Vector3<f64>, unit: f64| (0..masses.len()).map(|k| (of(k) / unit).into()).collect();
    Ok(Start {
        displacement: is_displaced.then(|| each(&moved, scale.length)),
        velocities: spins.then(|| each(&turning, scale.velocity())),
        velocity,
    })
}

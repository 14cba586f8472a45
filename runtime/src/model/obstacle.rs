//! Obstacles of a scene, in scaled units around the middle of the body, and the nodes that may touch them.

use std::sync::Arc;

use nalgebra::{Point3, Rotation3, Unit, Vector3};
use rayon::prelude::*;

use crate::body::Constraint;
use crate::contact::{Contact, Convex, Obstacle, Pose, RigidMotion, Shape, Solid, Turn, facing};
use crate::history::History;
use crate::mesh::{Mesh, surface};
use crate::scale::Scale;
use crate::scene::{self, Scene, SceneError};

/// A node may begin so deep in an obstacle, as a part of the scene's size: coordinates are rounded.
const ROUNDED: f64 = 1e-9;

/// Contact of the body's surface, if there are obstacles.
pub fn contact(
    scene: &Scene,
    mesh: &Mesh,
    constraints: &[Constraint],
    scale: &Scale,
) -> Result<Option<Contact>, SceneError> {
    if scene.obstacle.is_empty() {
        return Ok(None);
    }
    if scene.solver.integrator == scene::Integrator::Static {
        let reason = "contact needs an integrator that steps through time";
        let remedy =
            "choose \"implicit-euler\" with damping and enough time to come to rest, or leave out the [[obstacle]]";
        return Err(SceneError::at(scene.locate("solver.integrator"), reason, remedy));
    }
    let [low, high] = mesh.bounding_box();
    let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
    let place = Placing { scene, scale, middle: Point3::from(middle) };
    let obstacles = (0..scene.obstacle.len()).map(|i| place.obstacle(i)).collect::<Result<Vec<_>, _>>()?;
    let nodes = mesh.surface_nodes();
    let each = nodes.iter().map(|n| (n.0, place.scaled(Point3::from(mesh.nodes()[n.index()])).into()));
    let contact = Contact::new(each, constraints, obstacles);
    for (i, obstacle) in contact.obstacles.iter().enumerate() {
        starts_outside(&contact, obstacle, mesh, &place, i)?;
    }
    Ok(Some(contact))
}

/// Where lengths of a scene are in scaled units.
struct Placing<'a> {
    scene: &'a Scene,
    scale: &'a Scale,
    middle: Point3<f64>,
}

impl Placing<'_> {
    fn scaled(&self, point: Point3<f64>) -> Point3<f64> {
        ((point - self.middle) / self.scale.length).into()
    }

    fn in_metres(&self, point: Point3<f64>) -> Point3<f64> {
        self.middle + point.coords * self.scale.length
    }

    fn obstacle(&self, i: usize) -> Result<Obstacle, SceneError> {
        let given = &self.scene.obstacle[i];
        let (shape, rotation, origin) = self.shape(&given.shape, i)?;
        let rest = Pose { rotation, origin: self.scaled(origin) };
        let [sticking, sliding] = given.friction.coefficients();
        Ok(Obstacle { shape, rest, motion: self.motion(given, i)?, sticking, sliding })
    }

    /// What a surface encloses, in scaled units around the middle of its extent, and where that is.
    fn solid(&self, given: &scene::Surface, i: usize) -> Result<(Shape, Rotation3<f64>, Point3<f64>), SceneError> {
        let at = || self.scene.locate(&format!("obstacle.{i}.shape.mesh.file"));
        let read =
            surface::read(&self.scene.resolve(&given.file)).map_err(|e| SceneError::at(at(), e.reason, e.remedy))?;
        let (low, high) = read.vertices.iter().fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |(low, high), x| {
            (std::array::from_fn(|c| low[c].min(x[c])), std::array::from_fn(|c| high[c].max(x[c])))
        });
        let middle: [f64; 3] = std::array::from_fn(|c| 0.5 * (low[c] + high[c]));
        let factor = given.scale / self.scale.length;
        let vertices = read.vertices.iter().map(|x| std::array::from_fn(|c| (x[c] - middle[c]) * factor));
        let solid = Solid::new(vertices, read.triangles, given.cells)
            .map_err(|e| SceneError::at(at(), e.to_string(), "repair the surface, or use a shape such as a box"))?;
        let rotation = Rotation3::from_scaled_axis(Vector3::from(given.rotation));
        let origin = Point3::from(given.translation) + rotation * (Vector3::from(middle) * given.scale);
        Ok((Shape::Solid(Arc::new(solid)), rotation, origin))
    }

    /// The shape in scaled units, and where it is in m.
    fn shape(&self, shape: &scene::Shape, i: usize) -> Result<(Shape, Rotation3<f64>, Point3<f64>), SceneError> {
        let rod = |rod: &scene::Rod, name: &str| {
            let (from, to) = (Point3::from(rod.from), Point3::from(rod.to));
            let axis =
                self.direction(to - from, &format!("obstacle.{i}.shape.{name}.to"), "is where the axis begins")?;
            Ok((0.5 * (to - from).norm(), facing(axis), nalgebra::center(&from, &to)))
        };
        let convex = |shape: Convex| Shape::Convex(shape.scaled(1.0 / self.scale.length));
        match shape {
            scene::Shape::Plane { point, normal } => {
                let path = format!("obstacle.{i}.shape.plane.normal");
                let normal = self.direction(Vector3::from(*normal), &path, "has no direction")?;
                Ok((convex(Convex::Plane), facing(normal), Point3::from(*point)))
            }
            scene::Shape::Box { centre, size, rotation } => {
                let turned = Rotation3::from_scaled_axis(Vector3::from(*rotation));
                Ok((convex(Convex::Box { half: size.map(|x| 0.5 * x) }), turned, Point3::from(*centre)))
            }
            scene::Shape::Sphere { centre, radius } => Ok((
                convex(Convex::Capsule { half: 0.0, radius: *radius }),
                Rotation3::identity(),
                Point3::from(*centre),
            )),
            scene::Shape::Capsule(given) => {
                let (half, rotation, middle) = rod(given, "capsule")?;
                Ok((convex(Convex::Capsule { half, radius: given.radius }), rotation, middle))
            }
            scene::Shape::Cylinder(given) => {
                let (half, rotation, middle) = rod(given, "cylinder")?;
                Ok((convex(Convex::Cylinder { half, radius: given.radius }), rotation, middle))
            }
            scene::Shape::Mesh(given) => self.solid(given, i),
        }
    }

    fn direction(&self, vector: Vector3<f64>, path: &str, fault: &str) -> Result<Unit<Vector3<f64>>, SceneError> {
        Unit::try_new(vector, 0.0).ok_or_else(|| {
            let reason = format!("`{path}` {fault}");
            SceneError::at(self.scene.locate(path), reason, "give a vector whose length is not 0")
        })
    }

    fn motion(&self, given: &scene::Obstacle, i: usize) -> Result<RigidMotion, SceneError> {
        let time = 1.0 / self.scale.time;
        let still = || History::constant(0.0);
        let translation = match &given.translation {
            None => std::array::from_fn(|_| still()),
            Some(scene::Motion { x, y, z }) => [x, y, z].map(|history| {
                history.as_ref().map_or_else(still, |h| h.table().scaled(time, 1.0 / self.scale.length))
            }),
        };
        let turn = match &given.rotate {
            None => None,
            Some(scene::Rotate { centre, axis, angle }) => {
                let path = format!("obstacle.{i}.rotate.axis");
                let axis = self.direction(Vector3::from(*axis), &path, "has no direction")?;
                Some(Turn { centre: self.scaled(Point3::from(*centre)), axis, angle: angle.table().scaled(time, 1.0) })
            }
        };
        Ok(RigidMotion { translation, turn })
    }
}

/// Refuses an obstacle that the body is in, or that is in the body, at time 0.
fn starts_outside(
    contact: &Contact,
    obstacle: &Obstacle,
    mesh: &Mesh,
    place: &Placing,
    i: usize,
) -> Result<(), SceneError> {
    let pose = obstacle.motion.of(&obstacle.rest, 0.0);
    let refused = |reason: String| {
        let remedy = "move the obstacle or the body apart: contact keeps apart what is apart, from time 0 on";
        Err(SceneError::at(place.scene.locate(&format!("obstacle.{i}.shape")), reason, remedy))
    };
    let distance = |position: &[f64; 3]| {
        let local = pose.rotation.inverse() * (Point3::from(*position) - pose.origin);
        obstacle.shape.nearest(local.into()).distance
    };
    let deepest = contact.positions.iter().map(distance).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((k, depth)) = deepest.filter(|(_, distance)| *distance < -ROUNDED * contact.size) {
        let node = contact.nodes[k];
        let [x, y, z] = mesh.nodes()[node as usize];
        return refused(format!(
            "`obstacle.{i}` has the body in it at the start: node {node} at ({x}, {y}, {z}) is {:.3e} m deep",
            -depth * place.scale.length
        ));
    }
    for face in mesh.boundary() {
        let corners = mesh.positions(&mesh.face_nodes(face));
        let middle: [f64; 3] =
            std::array::from_fn(|i| corners.iter().map(|x| x[i]).sum::<f64>() / corners.len() as f64);
        if distance(&place.scaled(Point3::from(middle)).into()) < -ROUNDED * contact.size {
            let [x, y, z] = middle;
            return refused(format!(
                "`obstacle.{i}` enters the body at the start, between its nodes: a face whose middle is at ({x}, {y}, {z})"
            ));
        }
    }
    let [low, high] = mesh.bounding_box();
    let is_inside =
        |point: &Point3<f64>| (0..3).all(|c| low[c] < point[c] && point[c] < high[c]) && mesh.encloses((*point).into());
    let of = |local: [f64; 3]| place.in_metres(pose.rotation * Point3::from(local) + pose.origin.coords);
    let (what, inside) = match &obstacle.shape {
        Shape::Convex(Convex::Plane) => return Ok(()),
        Shape::Convex(_) | Shape::Grid(_) => ("its middle", Some(place.in_metres(pose.origin)).filter(is_inside)),
        Shape::Solid(solid) => {
            let vertices: Vec<Point3<f64>> = solid.vertices().map(of).collect();
            ("a vertex of it", vertices.into_par_iter().find_first(is_inside))
        }
    };
    if let Some(point) = inside {
        let [x, y, z] = point.coords.into();
        return refused(format!("`obstacle.{i}` is inside the body at the start: {what} is at ({x}, {y}, {z})"));
    }
    Ok(())
}

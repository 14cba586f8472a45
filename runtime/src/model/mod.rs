//! From a checked scene to a body: mesh, materials by law, supports, loads and probes, in scaled units.
//!
//! Everything that only a mesh or a law can tell is checked here: groups that do not exist, selections that select
//! nothing, parameters that a law does not have or refuses. Errors point into the scene file.

mod boundary;
mod initial;
pub(crate) mod loads;
mod material;
mod obstacle;
mod parameters;
pub(crate) mod place;
mod units;

use std::sync::Arc;

use tensormass_kernels::{ElementEntry, RestPoint};

use crate::body::{Body, Rows, Start};
use crate::mass::{self, MassMatrix};
use crate::mesh::gmsh::{self, MeshFileError};
use crate::mesh::{self, ElementId, Mesh, MeshError, Orientation, Quality, Ring};
use crate::probe::Recorder;
use crate::scale::Scale;
use crate::scene::{self, Scene, SceneError};

pub use material::MaterialReport;
use place::Places;

/// Why a scene cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The scene file says something wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The mesh file is refused.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
}

/// A scene, ready to be computed.
#[derive(Debug)]
pub struct Model {
    /// The mesh (m).
    pub mesh: Mesh,
    /// How small and how distorted its elements are.
    pub quality: Quality,
    /// The body, in scaled units.
    pub body: Body,
    /// The units.
    pub scale: Scale,
    /// The probes.
    pub recorder: Recorder,
    /// What each material is.
    pub materials: Vec<MaterialReport>,
    /// Which of them each element has.
    pub(crate) assignment: material::Assignment,
    /// The state at time 0.
    pub start: Start,
    /// What is allowed but looks wrong.
    pub warnings: Vec<String>,
}

impl Model {
    /// The components of all parameters of an element's law, in their order and in the scene's units.
    pub fn parameters(&self, element: ElementId) -> &[f64] {
        self.assignment.parameters(element.0)
    }
}

/// Elements of a lower radius ratio are worth a warning; mesh generators keep to .1 and better.
const SLIVER: f64 = 0.01;

/// Builds the body of a scene.
///
/// # Errors
/// See [`BuildError`].
pub fn build(scene: &Scene) -> Result<Model, BuildError> {
    let mut warnings = scene.warnings();
    let mesh = load_mesh(scene, &mut warnings)?;
    let quality = Quality::of(&mesh);
    if quality.worst_radius_ratio < SLIVER {
        warnings.push(format!(
            "element {} is a sliver (radius ratio {:.1e}, 1 is best): it limits explicit steps and slows solvers; improve \
             the mesh there",
            quality.worst_element.0, quality.worst_radius_ratio
        ));
    }
    let parts = mesh.parts();
    if parts > 1 {
        warnings.push(format!(
            "the mesh has {parts} parts that share no node: contact is modelled with obstacles only, so that parts pass through each \
             other where they meet; join them, or make all but one of them obstacles"
        ));
    }
    let places = Places::new(&mesh);
    let assignment = material::assign(scene, &places, (mesh.len(), parts_of_each(scene, &mesh)))?;
    let [low, high] = mesh.bounding_box();
    let diagonal = (0..3).map(|i| (high[i] - low[i]).powi(2)).sum::<f64>().sqrt();
    let scale = Scale::new(diagonal, assignment.stiffness(), assignment.density());
    let elements: Rows<u32> = mesh.elements().map(|e| mesh.element_nodes(e).iter().map(|n| n.0)).collect();
    let rest = scaled_rest(&mesh, scale.length);
    let densities: Vec<f64> = assignment.densities().map(|density| density / scale.density()).collect();
    let element_masses: Vec<f64> =
        rest.iter().zip(&densities).map(|(points, d)| points.iter().map(|p| p.weight).sum::<f64>() * d).collect();
    let batches = assignment.batches(&mesh, &scale);
    let (constraints, motions) = boundary::constraints(scene, &mesh, &places, &scale)?;
    // Plane bodies are held along z whatever a scene says.
    let supported = !scene.boundary.is_empty() && !constraints.is_empty();
    if !supported && scene.solver.integrator == scene::Integrator::Static {
        return Err(SceneError::at(
            scene.locate("solver.integrator"),
            "static equilibrium needs supports, but no displacement is imposed",
            "add a [[boundary]] that prevents rigid motion, or choose a dynamic integrator",
        )
        .into());
    }
    let each = mesh.elements().zip(elements.iter()).zip(&element_masses);
    let masses = mass::lump(mesh.nodes().len(), each.map(|((e, nodes), mass)| (mesh.kind(e), nodes, *mass)));
    let mass_matrix = match (scene.solver.mass, scene.solver.integrator) {
        (scene::Mass::Lumped, _) | (_, scene::Integrator::Static) => None,
        (scene::Mass::Consistent, _) => {
            let matrix = MassMatrix::assemble(&mesh, &densities, scale.length);
            Some(matrix.ok_or_else(|| {
                let reason = "the consistent mass has more entries than this program can count";
                SceneError::at(scene.locate("solver.mass"), reason, "choose \"lumped\", or a coarser mesh")
            })?)
        }
    };
    // In motion a body falls as a whole only where weight and inertia are the same masses; in equilibrium the integrals of
    // the functions are more accurate.
    let weights = match scene.solver.integrator {
        scene::Integrator::Static => loads::weights(&mesh, &elements, &rest, &element_masses),
        _ => mass_matrix.as_ref().map_or_else(|| masses.clone(), MassMatrix::row_sums),
    };
    let loads = loads::loads(scene, &mesh, &places, &scale, &weights)?;
    let pressures = loads::pressures(scene, &mesh, &places, &scale)?;
    warnings.extend(units::warnings(scene, &mesh, assignment.stiffness(), assignment.density()));
    let contact = obstacle::contact(scene, &mesh, &constraints, &scale)?;
    let recorder = Recorder::new(scene, &mesh, &places, &constraints, &batches, &scale)?;
    let start = initial::start(scene, &mesh, &masses, &scale)?;
    let body = Body {
        elements,
        rest,
        batches,
        masses,
        mass_matrix,
        element_masses,
        constraints,
        motions,
        loads,
        pressures,
        contact: contact.map(Arc::new),
        moves: scene.solver.integrator != scene::Integrator::Static,
        mass_damping: scene.solver.mass_damping * scale.time,
        stiffness_damping: scene.solver.stiffness_damping / scale.time,
        diameter: diagonal / scale.length,
        volume: mesh.total_volume() / scale.length.powi(3),
    };
    Ok(Model { materials: assignment.reports(), assignment, quality, mesh, body, scale, recorder, start, warnings })
}

/// The quadrature points of all elements, in scaled lengths.
fn scaled_rest(mesh: &Mesh, length: f64) -> Rows<RestPoint<f64>> {
    let of = |e| {
        // Powers of two: scaling rounds nothing. Plane bodies are one metre thick: theirs are volumes too.
        let scale = move |p: RestPoint<f64>| RestPoint {
            inverse_jacobian: p.inverse_jacobian.map(|x| x * length),
            weight: p.weight / length.powi(3),
        };
        mesh.rest(e).into_iter().map(scale)
    };
    mesh.elements().map(of).collect()
}

fn load_mesh(scene: &Scene, warnings: &mut Vec<String>) -> Result<Mesh, BuildError> {
    match &scene.mesh {
        scene::Mesh::Beam { beam } => {
            let cells = beam.cells.map(|c| c as usize);
            let element = find_element(scene, "mesh.beam.element", &beam.element)?;
            let made = mesh::beam_of(element, beam.size, cells, beam.origin);
            made.map_err(|e| not_made(scene, "mesh.beam", &e).into())
        }
        scene::Mesh::Torus { torus } => {
            let element = find_element(scene, "mesh.torus.element", &torus.element)?;
            let scene::Torus { major_radius: major, minor_radius: minor, centre, axis, .. } = *torus;
            let ring = Ring { major, minor, centre, axis: axis.index() };
            let made = mesh::torus_of(element, ring, [torus.across, torus.around].map(|n| n as usize));
            made.map_err(|e| not_made(scene, "mesh.torus", &e).into())
        }
        scene::Mesh::File { file, orient, scale, refine } => {
            let orientation = if *orient { Orientation::Repair } else { Orientation::Refuse };
            let loaded = gmsh::read(&scene.resolve(file), orientation)?;
            warnings.extend(loaded.warnings);
            let mut mesh = loaded.mesh;
            if *scale != 1.0 {
                let nodes = mesh.nodes().iter().map(|p| p.map(|x| x * scale)).collect();
                mesh = mesh
                    .moved(nodes)
                    .map_err(|e| SceneError::at(scene.locate("mesh.scale"), e.to_string(), "choose another scale"))?;
            }
            if *refine == 1 {
                return Ok(mesh);
            }
            mesh.refined(*refine as usize).map_err(|e| not_made(scene, "mesh.refine", &e).into())
        }
    }
}

/// How many elements of the mesh are parts of each element that the scene gives.
fn parts_of_each(scene: &Scene, mesh: &Mesh) -> usize {
    match &scene.mesh {
        scene::Mesh::File { refine, .. } => (*refine as usize).pow(mesh.blocks()[0].info().dimension as u32),
        scene::Mesh::Beam { .. } | scene::Mesh::Torus { .. } => 1,
    }
}

/// Why a mesh cannot be made.
fn not_made(scene: &Scene, path: &str, error: &MeshError) -> SceneError {
    let text = error.to_string();
    let (reason, remedy) = text.split_once("; ").unwrap_or((&text, "change its size or cells"));
    SceneError::at(scene.locate(path), reason, remedy)
}

/// The element of a generated mesh.
fn find_element(scene: &Scene, path: &str, name: &str) -> Result<&'static ElementEntry, SceneError> {
    tensormass_kernels::element(name).ok_or_else(|| {
        let bodies = tensormass_kernels::elements().iter().filter(|e| e.info.dimension > 1);
        let names: Vec<&str> = bodies.map(|e| e.info.name).collect();
        SceneError::at(
            scene.locate(path),
            format!("there is no element \"{name}\""),
            format!("elements of this build: {}", names.join(", ")),
        )
    })
}

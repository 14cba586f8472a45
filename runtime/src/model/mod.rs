//! From a checked scene to a body: mesh, materials by law, supports, loads and probes, in scaled units.
//!
//! Everything that only a mesh or a law can tell is checked here: groups that do not exist, selections that select
//! nothing, parameters that a law does not have or refuses. Errors point into the scene file.

mod boundary;
pub(crate) mod loads;
mod material;
mod parameters;
pub(crate) mod place;

use tensormass_kernels::batch::RestElement;

use crate::body::{self, Body};
use crate::mesh::gmsh::{self, MeshFileError};
use crate::mesh::{self, Orientation, Quality, TetMesh};
use crate::probe::Recorder;
use crate::scale::Scale;
use crate::scene::{Mesh, Scene, SceneError};

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
    pub mesh: TetMesh,
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
    /// Initial velocity, scaled.
    pub velocity: [f64; 3],
    /// What is allowed but looks wrong.
    pub warnings: Vec<String>,
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
    let places = Places::new(&mesh);
    let assignment = material::assign(scene, &mesh, &places)?;
    let [low, high] = mesh.bounding_box();
    let diagonal = (0..3).map(|i| (high[i] - low[i]).powi(2)).sum::<f64>().sqrt();
    let scale = Scale::new(diagonal, assignment.stiffness(), assignment.density());
    let elements: Vec<[u32; 4]> = mesh.tets().iter().map(|t| t.map(|n| n.0)).collect();
    let mut rest = Vec::with_capacity(elements.len());
    let mut element_masses = Vec::with_capacity(elements.len());
    for (e, density) in mesh.elements().zip(assignment.densities()) {
        let g = mesh.shape_gradients(e);
        let rows = g.gradients.as_flattened();
        let volume = g.volume / scale.length.powi(3);
        rest.push(RestElement { shape_gradients: std::array::from_fn(|k| rows[k] * scale.length), volume });
        element_masses.push(volume * density / scale.density());
    }
    let batches = assignment.batches(&scale);
    let (constraints, motions) = boundary::constraints(scene, &mesh, &places, &scale)?;
    if constraints.is_empty() && scene.solver.integrator == crate::scene::Integrator::Static {
        return Err(SceneError::at(
            scene.locate("solver.integrator"),
            "static equilibrium needs supports, but no displacement is imposed",
            "add a [[boundary]] that prevents rigid motion, or choose a dynamic integrator",
        )
        .into());
    }
    let masses = body::lump(mesh.nodes().len(), &elements, &element_masses);
    let loads = loads::loads(scene, &mesh, &places, &scale, &masses)?;
    let recorder = Recorder::new(scene, &mesh, &places, &constraints)?;
    let velocity = scene.initial.velocity.map(|v| v / scale.velocity());
    let body = Body {
        elements,
        rest,
        batches,
        masses,
        element_masses,
        constraints,
        motions,
        loads,
        mass_damping: scene.solver.mass_damping * scale.time,
        stiffness_damping: scene.solver.stiffness_damping / scale.time,
        diameter: diagonal / scale.length,
        volume: mesh.total_volume() / scale.length.powi(3),
    };
    Ok(Model { materials: assignment.reports(), assignment, quality, mesh, body, scale, recorder, velocity, warnings })
}

fn load_mesh(scene: &Scene, warnings: &mut Vec<String>) -> Result<TetMesh, BuildError> {
    match &scene.mesh {
        Mesh::Beam { beam } => {
            let cells = beam.cells.map(|c| c as usize);
            mesh::beam(beam.size, cells, beam.origin).map_err(|e| {
                let text = e.to_string();
                let (reason, remedy) = text.split_once("; ").unwrap_or((&text, "change the beam's size or cells"));
                SceneError::at(scene.locate("mesh.beam"), reason, remedy).into()
            })
        }
        Mesh::File { file, orient, scale } => {
            let orientation = if *orient { Orientation::Repair } else { Orientation::Refuse };
            let loaded = gmsh::read(&scene.resolve(file), orientation)?;
            warnings.extend(loaded.warnings);
            if *scale == 1.0 {
                return Ok(loaded.mesh);
            }
            let nodes = loaded.mesh.nodes().iter().map(|p| p.map(|x| x * scale)).collect();
            let (tets, groups) = (loaded.mesh.tets().to_vec(), loaded.mesh.groups().clone());
            TetMesh::new(nodes, tets, groups)
                .map_err(|e| SceneError::at(scene.locate("mesh.scale"), e.to_string(), "choose another scale").into())
        }
    }
}

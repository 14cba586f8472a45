//! Frames: fields of a state as VTU files and their PVD index.

use std::path::{Path, PathBuf};

use crate::mesh::Mesh;
use crate::output::{
    Cells, Field as Array, FieldValues, OutputError, PvdWriter, create_folder, remove_file, write_vtu,
};
use crate::probe::{Needs, current_volume, of_stress};
use crate::scene::{Field, StressComponent};

/// What a frame shows of a state, in SI units.
#[derive(Debug, Default)]
pub struct FrameData {
    /// Displacement of each node in m.
    pub displacement: Vec<[f64; 3]>,
    /// Velocity of each node in m/s.
    pub velocity: Vec<[f64; 3]>,
    /// Cauchy stress of each element in Pa.
    pub stresses: Vec<[f64; 9]>,
    /// Strain energy of each element in J.
    pub energies: Vec<f64>,
    /// Force of contact on each node in N.
    pub contact: Vec<[f64; 3]>,
}

/// Writes the frames of a run.
pub struct Frames {
    folder: PathBuf,
    index: PvdWriter,
    fields: Vec<Field>,
    cells: Cells,
    count: u32,
}

impl Frames {
    /// Frames below this folder: `frames.pvd` and `frames/frame_NNNNNN.vtu`.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn create(out: &Path, mesh: &Mesh, fields: &[Field]) -> Result<Self, OutputError> {
        let index = PvdWriter::create(&out.join("frames.pvd"))?;
        Self::with(out, mesh, fields, index, 0)
    }

    /// As [`Frames::create`], after the frames that are there until a time.
    ///
    /// # Errors
    /// The folder cannot be read or written.
    pub fn resume(out: &Path, mesh: &Mesh, fields: &[Field], until: f64) -> Result<Self, OutputError> {
        let (index, count) = PvdWriter::resume(&out.join("frames.pvd"), until)?;
        Self::with(out, mesh, fields, index, count)
    }

    fn with(out: &Path, mesh: &Mesh, fields: &[Field], index: PvdWriter, count: u32) -> Result<Self, OutputError> {
        let folder = out.join("frames");
        create_folder(&folder)?;
        // A longer earlier run would leave its last frames beside the new ones.
        for k in count.. {
            let stale = folder.join(frame_name(k));
            if !stale.exists() {
                break;
            }
            remove_file(&stale)?;
        }
        Ok(Self { folder: out.to_path_buf(), index, fields: fields.to_vec(), cells: cells_of(mesh), count })
    }

    /// What the fields read of a state.
    pub fn needs(&self) -> Needs {
        needs(&self.fields)
    }

    /// Writes one frame.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&mut self, mesh: &Mesh, time: f64, data: &FrameData) -> Result<(), OutputError> {
        let mut points: Vec<(&str, usize, Vec<f64>)> = Vec::new();
        let mut cells: Vec<(&str, usize, Vec<f64>)> = Vec::new();
        let volume = |e: usize| current_volume(mesh, e, &data.displacement);
        for field in &self.fields {
            match field {
                Field::Displacement => points.push(("displacement", 3, data.displacement.as_flattened().to_vec())),
                Field::Velocity => points.push(("velocity", 3, data.velocity.as_flattened().to_vec())),
                Field::Contact => points.push(("contact", 3, data.contact.as_flattened().to_vec())),
                Field::Cauchy => cells.push(("cauchy", 9, data.stresses.as_flattened().to_vec())),
                Field::VonMises => {
                    let von_mises = data.stresses.iter().map(|s| of_stress(s, StressComponent::VonMises)).collect();
                    cells.push(("von_mises", 1, von_mises));
                }
                Field::J => {
                    let ratio = mesh.elements().map(|e| volume(e.index()) / mesh.volume(e)).collect();
                    cells.push(("J", 1, ratio));
                }
                Field::EnergyDensity => {
                    let density = mesh.elements().zip(&data.energies).map(|(e, w)| w / mesh.volume(e)).collect();
                    cells.push(("energy_density", 1, density));
                }
            }
        }
        let name = format!("frames/{}", frame_name(self.count));
        write_vtu(&self.folder.join(&name), mesh.nodes(), &self.cells, &arrays(&points), &arrays(&cells))?;
        self.index.push(time, &name)?;
        self.count += 1;
        Ok(())
    }
}

/// What some fields read of a state.
pub fn needs(fields: &[Field]) -> Needs {
    let stresses = fields.iter().any(|f| matches!(f, Field::Cauchy | Field::VonMises));
    let energies = fields.contains(&Field::EnergyDensity);
    let contact = fields.contains(&Field::Contact);
    let velocity = fields.contains(&Field::Velocity);
    Needs { displacement: true, velocity, reactions: false, energies, stresses, contact }
}

fn frame_name(k: u32) -> String {
    format!("frame_{k:06}.vtu")
}

fn arrays<'a>(fields: &'a [(&'a str, usize, Vec<f64>)]) -> Vec<Array<'a>> {
    fields
        .iter()
        .map(|(name, components, values)| Array { name, components: *components, values: FieldValues::F64(values) })
        .collect()
}

/// The elements as VTK has them.
fn cells_of(mesh: &Mesh) -> Cells {
    let mut cells = Cells::default();
    for element in mesh.elements() {
        let (vtk, nodes) = (&mesh.kind(element).info.vtk, mesh.element_nodes(element));
        // VTK's cell types are below 256.
        cells.push(vtk.kind as u8, vtk.order.iter().map(|j| nodes[*j].0));
    }
    cells
}

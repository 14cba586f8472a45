//! Checkpoints: all that a run needs to go on as if it had never stopped, in one file.
//!
//! The file is a line that says what it is, the length of a JSON header, the header, vectors as little-endian f64, and a
//! CRC-32 of everything before it. Vectors are in scaled units: a number in f32 is one in f64, so that nothing is rounded.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::model::Model;
use crate::output::{OutputError, write_atomic};
use crate::scene::Scene;
use crate::tangent::Tangent;

/// The first line. Its number changes with the meaning of what follows.
const MAGIC: &[u8] = b"tensormass checkpoint 1\n";
/// The version of the program; another one may compute other last digits.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Why a checkpoint is refused.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// It cannot be read.
    #[error("{}: the checkpoint cannot be read: {source}; check the path and the permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is none, or not whole.
    #[error("{}: {reason}; resume from another checkpoint, or run the scene from the beginning", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// It is of another run.
    #[error("{}: {reason}; {remedy}", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What differs.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
}

/// What is in the header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    pub version: String,
    /// Of the scene's text and its files, but for what may change between two parts of a run.
    pub scene: u32,
    /// Of the mesh and the materials.
    pub body: u32,
    pub device: String,
    pub step: u64,
    /// The step in s.
    pub step_s: f64,
    pub nodes: usize,
    /// What the integrator remembers.
    pub integrator: Value,
    pub tangents: Vec<Tangent>,
    /// When contact forces were last recorded for probes and for frames, in scaled units; none where nothing records them.
    pub recorded: Option<[f64; 2]>,
}

/// A run at the end of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    path: PathBuf,
    pub(super) header: Header,
    /// Displacement, velocity; impulses of contact on the device, and those not recorded yet for probes and for frames.
    pub(super) vectors: Vec<Vec<[f64; 3]>>,
}

impl Checkpoint {
    pub(super) fn new(header: Header, vectors: Vec<Vec<[f64; 3]>>) -> Self {
        Self { path: PathBuf::new(), header, vectors }
    }

    /// Steps taken.
    pub fn step(&self) -> u64 {
        self.header.step
    }

    /// Where the run was computed.
    pub fn device(&self) -> &str {
        &self.header.device
    }

    /// How products with the tangent were computed, for each law of the body.
    pub(super) fn tangents(&self) -> &[Tangent] {
        &self.header.tangents
    }

    pub(super) fn write(&self, path: &Path) -> Result<(), OutputError> {
        let header = serde_json::to_vec(&self.header).expect("a header of plain values");
        let mut bytes = MAGIC.to_vec();
        bytes.extend((header.len() as u64).to_le_bytes());
        bytes.extend(header);
        for number in self.vectors.iter().flatten().flatten() {
            bytes.extend(number.to_le_bytes());
        }
        let sum = checksum(&bytes);
        write_atomic(path, |file| {
            file.write_all(&bytes)?;
            file.write_all(&sum.to_le_bytes())
        })
    }

    /// Reads a checkpoint.
    ///
    /// # Errors
    /// It cannot be read, or is none, or not whole.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        let bytes = std::fs::read(path).map_err(|source| CheckpointError::Read { path: path.to_owned(), source })?;
        let damaged = |reason: &str| CheckpointError::Damaged { path: path.to_owned(), reason: reason.to_owned() };
        if !bytes.starts_with(MAGIC) {
            return Err(damaged("this is no checkpoint that this version can read"));
        }
        let torn = || damaged("the checkpoint is torn: its checksum is not that of its content");
        let (content, sum) = bytes.split_last_chunk::<4>().ok_or_else(torn)?;
        if checksum(content) != u32::from_le_bytes(*sum) {
            return Err(torn());
        }
        let (length, rest) = content[MAGIC.len()..].split_first_chunk::<8>().ok_or_else(torn)?;
        let (header, numbers) = usize::try_from(u64::from_le_bytes(*length))
            .ok()
            .and_then(|length| rest.split_at_checked(length))
            .ok_or_else(torn)?;
        let header: Header = serde_json::from_slice(header).map_err(|_| damaged("its header is of another version"))?;
        let each = header.nodes.checked_mul(24).filter(|each| *each > 0 && numbers.len() % each == 0);
        let each = each.ok_or_else(|| damaged("its vectors do not fit its header"))?;
        let number = |b: &[u8]| f64::from_le_bytes(b.try_into().expect("eight bytes"));
        let node = |b: &[u8]| std::array::from_fn(|i| number(&b[8 * i..8 * i + 8]));
        let vectors = numbers.chunks(each).map(|vector| vector.chunks(24).map(node).collect()).collect();
        Ok(Self { path: path.to_owned(), header, vectors })
    }

    /// Refuses a checkpoint of another scene or version.
    pub(super) fn check(&self, scene: &Scene, model: &Model, step_s: f64, steps: u64) -> Result<(), CheckpointError> {
        let other = |reason: String, remedy| Err(CheckpointError::Other { path: self.path.clone(), reason, remedy });
        let h = &self.header;
        let again = "run the scene from the beginning";
        if h.version != VERSION {
            return other(format!("the checkpoint is of version {}, this is {VERSION}", h.version), again);
        }
        if h.scene != scene_sum(scene) {
            let reason = "the checkpoint is of another scene".to_owned();
            return other(
                reason,
                "give the scene with which it was written; only solver.duration, solver.threads, [output] and [scene] may differ",
            );
        }
        if h.body != body_sum(model) || h.step_s != step_s {
            let reason = "the checkpoint is of another mesh, or of other files of values".to_owned();
            return other(reason, "give the files with which it was written");
        }
        if h.step >= steps {
            let reason = format!("the checkpoint is at step {}, and the run ends with step {steps}", h.step);
            return other(reason, "there is nothing left to do; lengthen solver.duration to go on");
        }
        let wanted = 2 + 3 * usize::from(h.recorded.is_some());
        if h.nodes != model.mesh.nodes().len() || self.vectors.len() != wanted {
            return other("its vectors are those of another body".to_owned(), again);
        }
        Ok(())
    }
}

/// A header for a run at a step.
pub(super) fn header(scene: &Scene, model: &Model, device: String, [step, nodes]: [u64; 2], step_s: f64) -> Header {
    Header {
        version: VERSION.to_owned(),
        scene: scene_sum(scene),
        body: body_sum(model),
        device,
        step,
        step_s,
        nodes: nodes as usize,
        integrator: Value::Null,
        tangents: vec![],
        recorded: None,
    }
}

fn checksum(bytes: &[u8]) -> u32 {
    let mut sum = flate2::Crc::new();
    // In parts: its counter of bytes is 32 bits wide.
    bytes.chunks(1 << 20).for_each(|part| sum.update(part));
    sum.sum()
}

/// Of what a scene says, but for what may change between two parts of a run.
fn scene_sum(scene: &Scene) -> u32 {
    let mut data = serde_json::to_value(&**scene).unwrap_or_default();
    if let Some(data) = data.as_object_mut() {
        for free in ["output", "scene"] {
            data.remove(free);
        }
        if let Some(solver) = data.get_mut("solver").and_then(Value::as_object_mut) {
            solver.remove("duration");
            solver.remove("threads");
        }
    }
    checksum(data.to_string().as_bytes())
}

/// Of the mesh, the constants of its materials, and obstacles from files.
fn body_sum(model: &Model) -> u32 {
    let mut bytes: Vec<u8> = vec![];
    bytes.extend(model.mesh.nodes().iter().flatten().flat_map(|x| x.to_bits().to_le_bytes()));
    bytes.extend(model.body.elements.values().iter().flat_map(|n| n.to_le_bytes()));
    for batch in &model.body.batches {
        bytes.extend(batch.constants.iter().flat_map(|x| x.to_bits().to_le_bytes()));
        bytes.extend(batch.elements.iter().flat_map(|e| e.to_le_bytes()));
    }
    for obstacle in model.body.contact.iter().flat_map(|contact| &contact.obstacles) {
        if let Some(solid) = obstacle.shape.solid() {
            bytes.extend(solid.vertices().flatten().flat_map(|x| x.to_bits().to_le_bytes()));
        }
    }
    checksum(&bytes)
}

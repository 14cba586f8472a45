//! Reader of Gmsh meshes: .msh 2.2 and 4.1, ASCII, with physical groups.
//!
//! Physical volumes become element groups, physical surfaces become face groups and the groups of their nodes, and
//! physical curves and points become node groups (curves keep their edges). Nodes are numbered in the order of their Gmsh
//! tags, elements in the order of the file.

mod assemble;
mod element_type;
mod lines;
mod v2;
mod v4;

use super::error::MeshError;
use super::topology::{Mesh, Orientation};
use lines::{Lines, Problem};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use tensormass_kernels::ElementEntry;

/// A mesh as read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile {
    /// The mesh.
    pub mesh: Mesh,
    /// What was left out or named by the reader; nothing that changes the simulated body.
    pub warnings: Vec<String>,
}

/// Why a mesh file was refused.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// The file could not be read.
    #[error("cannot read the mesh {}: {source}; check its name and that you may read it", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file's text is not what the format asks for, or asks for something that is not supported.
    #[error("{}:{line}: {reason}; {remedy}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
        /// What to do.
        remedy: String,
    },
    /// The file holds a mesh that is not valid. Its nodes and elements are numbered from 0, in the reader's order.
    #[error("{}:{line}: {error}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// Line of the first culprit, from 1; of `$Elements` if there is none.
        line: usize,
        /// What is wrong.
        error: MeshError,
    },
}

/// Reads a Gmsh file, positions in m.
///
/// # Errors
/// [`MeshFileError`], with a line number: the file cannot be read, is binary, is of another version, is truncated or
/// garbled, has elements that the build has not (and the faces, lines and points that bound them), or its mesh is not
/// valid.
pub fn read(path: &Path, orientation: Orientation) -> Result<MeshFile, MeshFileError> {
    let bytes = std::fs::read(path).map_err(|source| MeshFileError::Read { path: path.to_owned(), source })?;
    parse(path, &bytes, orientation)
}

/// As [`read`], from the file's content; `path` only serves messages.
///
/// # Errors
/// As [`read`].
pub fn parse(path: &Path, bytes: &[u8], orientation: Orientation) -> Result<MeshFile, MeshFileError> {
    let refuse = |problem: Problem| MeshFileError::Format {
        path: path.to_owned(),
        line: problem.line,
        reason: problem.reason,
        remedy: problem.remedy,
    };
    let assembled = assemble::assemble(sections(bytes).map_err(refuse)?).map_err(refuse)?;
    let (nodes, blocks, groups) = (assembled.nodes, assembled.blocks, assembled.groups);
    match Mesh::with_orientation(nodes, blocks, groups, orientation) {
        Ok(mesh) => Ok(MeshFile { mesh, warnings: assembled.warnings }),
        Err(error) => {
            let line = assembled.source.line_of(&error);
            Err(MeshFileError::Mesh { path: path.to_owned(), line, error })
        }
    }
}

/// How to get a file that this reader takes.
const SAVE: &str = "save it again as ASCII version 4.1: \
                    gmsh OLD.msh -save -format msh41 -setnumber Mesh.Binary 0 -o NEW.msh";

/// A node as the file has it.
struct RawNode {
    tag: u64,
    position: [f64; 3],
    line: u32,
    /// Whether the file (4.1 only) says that it lies on a geometry point.
    on_point: bool,
}

/// An element of any dimension as the file has it.
#[derive(Clone)]
struct RawElement {
    /// What it is; `None` is a point.
    kind: Option<&'static ElementEntry>,
    /// Node tags, in Gmsh's order.
    nodes: Vec<u64>,
    /// Its physical groups, by their place in [`Sets::list`].
    set: u32,
    line: u32,
}

/// Sets of physical tags, each stored once: elements by the million share a few of them.
#[derive(Default)]
struct Sets {
    list: Vec<Vec<u32>>,
    index: BTreeMap<Vec<u32>, u32>,
}

impl Sets {
    /// The place of a set of physical tags. 0 means no group, and a sign only an orientation.
    fn intern(&mut self, tags: impl IntoIterator<Item = i32>) -> u32 {
        let mut set: Vec<u32> = tags.into_iter().map(i32::unsigned_abs).filter(|tag| *tag != 0).collect();
        set.sort_unstable();
        set.dedup();
        if let Some(place) = self.index.get(&set) {
            return *place;
        }
        // There is at most one set a line, and lines are counted in u32 too.
        let place = self.list.len() as u32;
        self.index.insert(set.clone(), place);
        self.list.push(set);
        place
    }
}

/// A file's content, before it becomes a mesh.
#[derive(Default)]
struct Raw {
    nodes: Vec<RawNode>,
    /// By dimension: points, lines, faces, solids.
    elements: [Vec<RawElement>; 4],
    sets: Sets,
    /// Names of physical groups, by dimension and tag.
    names: BTreeMap<(usize, u32), (String, u32)>,
    elements_line: usize,
}

/// The versions of the format.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Version {
    V2,
    V4,
}

/// Reads all sections of a file.
fn sections(bytes: &[u8]) -> Result<Raw, Problem> {
    let mut lines = Lines::new(bytes);
    let mut raw = Raw::default();
    let version = mesh_format(&mut lines)?;
    let mut entities = v4::Entities::default();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    while let Some(line) = lines.next()? {
        let Some(section) = line.text.strip_prefix('$') else {
            return Err(line.problem(
                format!("expected the start of a section, such as $Nodes, found `{}`", line.excerpt()),
                "check the counts of the section before it",
            ));
        };
        if let Some(earlier) = seen.insert(section.to_owned(), line.number)
            && ["PhysicalNames", "Entities", "Nodes", "Elements"].contains(&section)
        {
            return Err(line.problem(format!("a second ${section} section (the first is at line {earlier})"), SAVE));
        }
        match (section, version) {
            ("PhysicalNames", _) => physical_names(&mut lines, &mut raw)?,
            ("Entities", Version::V4) if seen.contains_key("Elements") => {
                return Err(line.problem("$Entities comes after $Elements".to_owned(), SAVE));
            }
            ("Entities", Version::V4) => entities = v4::entities(&mut lines, &mut raw.sets)?,
            ("PartitionedEntities", Version::V4) => {
                return Err(line.problem(
                    "the mesh is partitioned".to_owned(),
                    "mesh it again without -part, or save it as 2.2: gmsh OLD.msh -save -format msh22 -o NEW.msh",
                ));
            }
            ("Nodes", Version::V2) => v2::nodes(&mut lines, &mut raw)?,
            ("Nodes", Version::V4) => v4::nodes(&mut lines, &mut raw)?,
            ("Elements", Version::V2) => {
                raw.elements_line = line.number;
                v2::elements(&mut lines, &mut raw)?;
            }
            ("Elements", Version::V4) => {
                raw.elements_line = line.number;
                v4::elements(&mut lines, &entities, &mut raw)?;
            }
            _ => {
                lines.skip_section(&line, section)?;
                continue;
            }
        }
        lines.end_section(section)?;
    }
    for needed in ["Nodes", "Elements"] {
        if !seen.contains_key(needed) {
            return Err(lines.problem_here(
                format!("the file ends without a ${needed} section"),
                "it is truncated or holds no mesh: save it again",
            ));
        }
    }
    Ok(raw)
}

/// Reads `$MeshFormat`, which only comments may precede.
fn mesh_format(lines: &mut Lines<'_>) -> Result<Version, Problem> {
    loop {
        let line = lines.expect("$MeshFormat")?;
        match line.text {
            "$MeshFormat" => break,
            "$Comments" => lines.skip_section(&line, "Comments")?,
            _ => {
                return Err(line.problem(
                    format!("a Gmsh file starts with $MeshFormat, this one with `{}`", line.excerpt()),
                    format!("check that it is a Gmsh mesh; if it is an old one, {SAVE}"),
                ));
            }
        }
    }
    let line = lines.expect("a version")?;
    let mut words = line.words();
    let version = words.word("a version, such as 4.1")?;
    let file_type: i32 = words.read("a file type (0 is ASCII)")?;
    if file_type != 0 {
        return Err(line.problem("the file is binary".to_owned(), SAVE));
    }
    let version = match version {
        "2.2" | "2.1" | "2" | "2.0" => Version::V2,
        "4.1" => Version::V4,
        _ => {
            return Err(
                line.problem(format!("the version of the format is `{version}`; 2.2 and 4.1 can be read"), SAVE)
            );
        }
    };
    lines.end_section("MeshFormat")?;
    Ok(version)
}

/// Reads `$PhysicalNames`: dimension, tag and quoted name.
fn physical_names(lines: &mut Lines<'_>, raw: &mut Raw) -> Result<(), Problem> {
    let count: u64 = lines.count("the number of physical names")?;
    for _ in 0..count {
        let line = lines.expect("a physical name")?;
        let mut words = line.words();
        let dimension: usize = words.read("a dimension")?;
        if dimension > 3 {
            return Err(line.problem(format!("dimension {dimension} of a physical group"), "it must be 0, 1, 2 or 3"));
        }
        let tag: i32 = words.read("a physical tag")?;
        let name = match (line.text.find('"'), line.text.rfind('"')) {
            (Some(open), Some(close)) if open < close => &line.text[open + 1..close],
            _ => {
                return Err(line.problem(
                    format!("expected a name in double quotes, found `{}`", line.excerpt()),
                    "write: dimension tag \"name\"",
                ));
            }
        };
        raw.names.insert((dimension, tag.unsigned_abs()), (name.to_owned(), line.number_u32()));
    }
    Ok(())
}

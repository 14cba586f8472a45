//! Closed surfaces of triangles from STL and OBJ files.

use std::collections::HashMap;
use std::io::{BufReader, Cursor};
use std::path::Path;

use nalgebra::{Matrix3, Vector3};

/// A closed surface whose triangles turn counterclockwise seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Vertices, in the file's unit.
    pub vertices: Vec<[f64; 3]>,
    /// The vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// Why a surface is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{reason}; {remedy}")]
pub struct SurfaceError {
    /// What is wrong.
    pub reason: String,
    /// What to do about it.
    pub remedy: &'static str,
}

impl SurfaceError {
    fn new(reason: String, remedy: &'static str) -> Self {
        Self { reason, remedy }
    }
}

/// Reads a closed surface: an STL file, ASCII or binary, or the faces of an OBJ file. Vertices at one place become one.
///
/// # Errors
/// The file cannot be read, or what it holds is not closed, not oriented outwards, or not finite.
pub fn read(path: &Path) -> Result<Surface, SurfaceError> {
    let shown = path.display();
    let bytes = std::fs::read(path).map_err(|e| {
        SurfaceError::new(format!("{shown} cannot be read: {e}"), "check the path; it is relative to the scene file")
    })?;
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let corners = match extension.as_str() {
        "stl" => of_stl(&bytes),
        "obj" => of_obj(&bytes),
        _ => {
            let reason = format!("{shown} is neither an STL nor an OBJ file by its name");
            return Err(SurfaceError::new(reason, "save the surface as .stl or .obj"));
        }
    };
    let corners = corners.map_err(|reason| {
        let remedy = "write the file again with the program that made it";
        SurfaceError::new(format!("{shown} is not a whole {} file: {reason}", extension.to_uppercase()), remedy)
    })?;
    closed(&corners).map_err(|e| SurfaceError::new(format!("{shown}: {}", e.reason), e.remedy))
}

/// The corners of each triangle.
fn of_stl(bytes: &[u8]) -> Result<Vec<[[f64; 3]; 3]>, String> {
    let mut cursor = Cursor::new(bytes);
    let triangles = stl_io::create_stl_reader(&mut cursor).map_err(|e| e.to_string())?;
    triangles
        .map(|triangle| {
            let triangle = triangle.map_err(|e| e.to_string())?;
            Ok(triangle.vertices.map(|corner| corner.0.map(f64::from)))
        })
        .collect()
}

/// As [`of_stl`]; faces of more corners are cut into triangles from their first one.
fn of_obj(bytes: &[u8]) -> Result<Vec<[[f64; 3]; 3]>, String> {
    let options =
        tobj::LoadOptions { triangulate: true, ignore_lines: true, ignore_points: true, ..Default::default() };
    // Materials do not matter: a file of them that is missing is no error.
    let (models, _) =
        tobj::load_obj_buf(&mut BufReader::new(bytes), &options, |_| Err(tobj::LoadError::OpenFileFailed))
            .map_err(|e| e.to_string())?;
    let mut corners = vec![];
    for mesh in models.iter().map(|model| &model.mesh) {
        let at = |k: u32| [0, 1, 2].map(|c| mesh.positions[3 * k as usize + c]);
        corners.extend(mesh.indices.chunks_exact(3).map(|t| [at(t[0]), at(t[1]), at(t[2])]));
    }
    Ok(corners)
}

/// The surface of these triangles, if they are one.
fn closed(corners: &[[[f64; 3]; 3]]) -> Result<Surface, SurfaceError> {
    let (mut vertices, mut triangles, mut known) = (vec![], vec![], HashMap::new());
    for (k, triangle) in corners.iter().enumerate() {
        if let Some(corner) = triangle.iter().find(|corner| corner.iter().any(|x| !x.is_finite())) {
            let reason = format!("triangle {k} has a corner at {}, which is not finite", shown(*corner));
            return Err(SurfaceError::new(reason, "correct its coordinates"));
        }
        let triangle = triangle.map(|corner| {
            // 0 and -0 are one place.
            *known.entry(corner.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                vertices.push(corner);
                vertices.len() as u32 - 1
            })
        });
        let [a, b, c] = triangle;
        // Programs leave triangles of no width behind, where they move vertices to one place: they cover nothing.
        if a != b && b != c && c != a {
            triangles.push(triangle);
        }
    }
    if triangles.is_empty() {
        return Err(SurfaceError::new("it has no triangles".into(), "give a closed surface"));
    }
    let corners_of = |t: &[u32; 3]| t.map(|k| Vector3::from(vertices[k as usize]));
    if let Some(flat) = triangles.iter().find(|t| {
        let [a, b, c] = corners_of(t);
        (b - a).cross(&(c - a)).norm() == 0.0
    }) {
        let [a, b, c] = flat.map(|k| shown(vertices[k as usize]));
        let reason = format!("the triangle with corners at {a}, {b} and {c} has no area");
        return Err(SurfaceError::new(reason, "repair the surface: remove its degenerate triangles"));
    }
    let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let mut passed: HashMap<[u32; 2], u32> = HashMap::new();
    triangles.iter().flat_map(sides).for_each(|side| *passed.entry(side).or_default() += 1);
    let is_closed = |[a, b]: &[u32; 2]| passed.get(&[*a, *b]) == Some(&1) && passed.get(&[*b, *a]) == Some(&1);
    let open: Vec<[u32; 2]> = triangles.iter().flat_map(sides).filter(|side| !is_closed(side)).collect();
    if let Some([a, b]) = open.first().map(|side| side.map(|k| shown(vertices[k as usize]))) {
        let reason = format!(
            "it is not closed: {} sides of triangles do not have exactly one neighbour that turns the same way; the first is \
             from {a} to {b}",
            open.len()
        );
        return Err(SurfaceError::new(
            reason,
            "fill its holes and orient its triangles alike, or use a shape such as a box",
        ));
    }
    let volume: f64 = triangles.iter().map(|t| Matrix3::from_columns(&corners_of(t)).determinant()).sum();
    if volume < 0.0 {
        let reason = "its triangles turn clockwise seen from outside, so that outside would be inside".into();
        return Err(SurfaceError::new(reason, "reverse its triangles (\"flip normals\")"));
    }
    Ok(Surface { vertices, triangles })
}

fn shown([x, y, z]: [f64; 3]) -> String {
    format!("({x}, {y}, {z})")
}

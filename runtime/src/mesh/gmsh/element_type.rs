//! Gmsh's element type numbers: those of the build's elements, and the names of those refused.

use super::lines::{Line, Problem};
use tensormass_kernels::ElementEntry;

/// A type of element that a file may have.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    /// Which it is; `None` is a point.
    pub(super) element: Option<&'static ElementEntry>,
}

/// Gmsh's number of a point.
const POINT: u32 = 15;

/// The element of a type number; types that the build has no element for are refused by name.
pub(super) fn kind(line: &Line<'_>, code: u32) -> Result<Kind, Problem> {
    let element = tensormass_kernels::elements().iter().find(|element| element.info.gmsh.kind == code);
    if element.is_some() || code == POINT {
        return Ok(Kind { element });
    }
    const SHAPE: &str = "mesh it otherwise, for instance into tetrahedra";
    const ORDER: &str = "mesh to first or second order (gmsh MODEL.geo -3 -order 2)";
    const FULL: &str = "mesh with `Mesh.SecondOrderIncomplete = 1`, whose elements have no nodes inside their faces";
    let (name, remedy) = match code {
        7 => ("pyramid", SHAPE),
        10 => ("quadrangle of nine nodes", FULL),
        12 => ("hexahedron of 27 nodes", FULL),
        13 => ("prism of 18 nodes", SHAPE),
        18 => ("prism of 15 nodes", SHAPE),
        14 | 19 => ("second-order pyramid", SHAPE),
        20..=25 => ("triangle of higher order", ORDER),
        26..=28 => ("line of higher order", ORDER),
        29..=31 => ("tetrahedron of higher order", ORDER),
        92 | 93 => ("hexahedron of higher order", ORDER),
        _ => ("element of unknown shape", SHAPE),
    };
    let known = tensormass_kernels::elements().iter().filter(|e| e.info.dimension > 1).map(|e| e.info.name);
    let known = known.collect::<Vec<_>>().join(", ");
    Err(line.problem(
        format!("a {name} (Gmsh element type {code})").replace("a element", "an element"),
        format!("{remedy}; elements of this build: {known}"),
    ))
}

impl Kind {
    pub(super) fn dimension(&self) -> usize {
        self.element.map_or(0, |element| element.info.dimension)
    }

    pub(super) fn nodes(&self) -> usize {
        self.element.map_or(1, |element| element.info.nodes)
    }
}

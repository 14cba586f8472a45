//! Gmsh's element type numbers: the few that a mesh of linear tetrahedra has, and the names of those refused.

use super::lines::{Line, Problem};

/// The dimension of an element type; the type has one node more. Types that linear tetrahedra cannot use are refused by
/// name.
pub(super) fn dimension(line: &Line<'_>, code: u32) -> Result<usize, Problem> {
    const SHAPE: &str = "only 4-node tetrahedra can be simulated: mesh without `Recombine` and without layers";
    const ORDER: &str = "only 4-node tetrahedra can be simulated: mesh to first order (gmsh MODEL.geo -3 -order 1)";
    let (name, remedy) = match code {
        15 => return Ok(0),
        1 => return Ok(1),
        2 => return Ok(2),
        4 => return Ok(3),
        3 => ("quadrangle", SHAPE),
        5 => ("hexahedron", SHAPE),
        6 => ("prism", SHAPE),
        7 => ("pyramid", SHAPE),
        8 => ("second-order line", ORDER),
        9 => ("second-order triangle", ORDER),
        10 | 16 => ("second-order quadrangle", SHAPE),
        11 => ("second-order tetrahedron", ORDER),
        12 | 17 => ("second-order hexahedron", SHAPE),
        13 | 18 => ("second-order prism", SHAPE),
        14 | 19 => ("second-order pyramid", SHAPE),
        20..=25 => ("triangle of higher order", ORDER),
        26..=28 => ("line of higher order", ORDER),
        29..=31 => ("tetrahedron of higher order", ORDER),
        92 | 93 => ("hexahedron of higher order", SHAPE),
        _ => ("element of unknown shape", SHAPE),
    };
    Err(line.problem(format!("a {name} (Gmsh element type {code})").replace("a element", "an element"), remedy))
}

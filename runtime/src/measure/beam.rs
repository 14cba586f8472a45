//! The beam that is measured: its scene, its size, and how it is displaced.

use tensormass_kernels::{ElementEntry, ParameterInfo};

use super::Subject;
use crate::mesh::beam_of;
use crate::plan::precision_name;

/// A parameter in the middle of its range where it has no default, of a material so many times stiffer than that.
fn parameter(p: &ParameterInfo, stiffer: f64) -> String {
    let (low, high) = p.range;
    let middle = if low > 0.0 { (low * high).sqrt() } else { 0.5 * (low + high) };
    // The middle of a direction's components would be none.
    let value = p.default.map_or(if p.direction { 1.0 } else { middle }, |d| d[0]);
    let [_, of_stress, _] = p.dimensions;
    let value = value * stiffer.powi(of_stress);
    let text = if p.len == 1 { format!("{value:?}") } else { format!("{:?}", vec![value; p.len]) };
    format!("{} = {text}", p.name)
}

/// A scene of a beam of 5 x 1 x 1 m, or of 5 x 1 m, of one law.
pub fn scene_text(subject: &Subject) -> String {
    let Subject { law, element, cells, precision, stiffness_ratio, .. } = subject;
    let material = |elements: &str, stiffer: f64| {
        let parameters: Vec<String> = law.info.parameters.iter().map(|p| parameter(p, stiffer)).collect();
        format!(
            "[[material]]\nlaw = \"{}\"\ndensity = 1000.0\n{elements}parameters = {{ {} }}\n",
            law.info.name,
            parameters.join(", ")
        )
    };
    let materials = if *stiffness_ratio == 1.0 {
        material("", 1.0)
    } else {
        let [soft, stiff] = ["<", ">="].map(|side| format!("elements = \"x {side} 2.5\"\n"));
        material(&soft, 1.0) + &material(&stiff, *stiffness_ratio)
    };
    format!(
        "[mesh]\nbeam = {{ size = [5, 1, 1], cells = {cells:?}, element = \"{}\" }}\n{materials}[solver]\n\
         integrator = \"implicit-euler\"\nprecision = \"{}\"\nstep = 1e-5\nduration = 1e-5\n",
        element.info.name,
        precision_name(*precision)
    )
}

/// A small smooth displacement at a place.
pub fn wave(p: &[f64; 3]) -> [f64; 3] {
    [1e-3 * (p[0] + p[1]).sin(), 1e-3 * (2.0 * p[2]).cos(), 1e-3 * (p[0] * p[1]).sin()]
}

/// Cells of a beam of about so many elements.
pub fn cells(element: &'static ElementEntry, elements: usize) -> [usize; 3] {
    let a_cell = beam_of(element, [1.0; 3], [1; 3], [0.0; 3]).map_or(1, |mesh| mesh.len());
    let wanted = elements as f64 / (5 * a_cell) as f64;
    if element.info.dimension == 2 {
        let across = wanted.sqrt().round().max(1.0) as usize;
        return [5 * across, across, 1];
    }
    let across = wanted.cbrt().round().max(1.0) as usize;
    [5 * across, across, across]
}

//! The body that is measured: its scene, its size, and how it is displaced.

use tensormass_kernels::{ElementEntry, ParameterInfo};

use super::{Body, Subject};
use crate::mesh::beam_of;
use crate::model::Model;
use crate::plan::precision_name;

/// A parameter in the middle of its range where it has no default, of a material so many times stiffer than that.
pub(super) fn parameter(p: &ParameterInfo, stiffer: f64) -> String {
    let (low, high) = p.range;
    let middle = if low > 0.0 { (low * high).sqrt() } else { 0.5 * (low + high) };
    // The middle of a direction's components would be none.
    let value = p.default.map_or(if p.direction { 1.0 } else { middle }, |d| d[0]);
    let [_, of_stress, _] = p.dimensions;
    let value = value * stiffer.powi(of_stress);
    let text = if p.len == 1 { format!("{value:?}") } else { format!("{:?}", vec![value; p.len]) };
    format!("{} = {text}", p.name)
}

/// A scene of a body of one law.
pub fn scene_text(subject: &Subject) -> String {
    let Subject { law, element, body, precision, stiffness_ratio, tangent, .. } = subject;
    let mesh = match body {
        Body::Beam(cells) => {
            format!("beam = {{ size = [5, 1, 1], cells = {cells:?}, element = \"{}\" }}", element.info.name)
        }
        Body::File(file) => format!("file = {:?}", file.display().to_string()),
    };
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
        "[mesh]\n{mesh}\n{materials}[solver]\nintegrator = \"implicit-euler\"\nprecision = \"{}\"\nstep = 1e-5\n\
         duration = 1e-5\n[solver.cg]\ntangent = \"{}\"\n",
        precision_name(*precision),
        tangent.name()
    )
}

/// The displacement of each node of a subject's body, in scaled units, and one that is turned and not small.
pub(super) fn displacements(subject: &Subject, model: &Model) -> [Vec<[f64; 3]>; 2] {
    let plane = subject.element.info.dimension == 2;
    // Bodies of files have any size.
    let size = match subject.body {
        Body::Beam(_) => 1.0,
        Body::File(_) => model.body.diameter * model.scale.length / 27_f64.sqrt(),
    };
    let at = |p: [f64; 3]| {
        let u = wave(&p.map(|x| x / size)).map(|u| size * u);
        if plane { [u[0], u[1], 0.0] } else { u }
    };
    let nodes = model.mesh.nodes().iter();
    let turned = nodes.clone().map(|p| at([p[1], p[2], p[0]])).collect();
    [nodes.map(|p| at(*p).map(|u| u / model.scale.length)).collect(), turned]
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

//! What the benchmarks share; they are in `benches/`.

use tensormass_runtime::{LawInfo, ParameterInfo};

/// A scene of a beam of 6 tetrahedra a cell, of one law, parameters in the middle of their ranges where no default is
/// given.
pub fn beam(info: &LawInfo, cells: [u32; 3]) -> String {
    let parameter = |p: &ParameterInfo| {
        // The middle of a direction's components would be none.
        let middle = if p.direction { 1.0 } else { middle(p.range) };
        let value = p.default.map_or(middle, |d| d[0]);
        let text = if p.len == 1 { format!("{value:?}") } else { format!("{:?}", vec![value; p.len]) };
        format!("{} = {text}", p.name)
    };
    let parameters: Vec<String> = info.parameters.iter().map(parameter).collect();
    format!(
        "[mesh]\nbeam = {{ size = [5, 1, 1], cells = {cells:?} }}\n[[material]]\nlaw = \"{}\"\ndensity = 1000.0\n\
         parameters = {{ {} }}\n[solver]\nintegrator = \"semi-implicit-euler\"\nstep = 1e-5\nduration = 1e-5\n",
        info.name,
        parameters.join(", ")
    )
}

/// The geometric mean of a positive range, the arithmetic one of any other.
fn middle((low, high): (f64, f64)) -> f64 {
    if low > 0.0 { (low * high).sqrt() } else { 0.5 * (low + high) }
}

/// A small smooth displacement at a place.
pub fn wave(p: &[f64; 3]) -> [f64; 3] {
    [1e-3 * (p[0] + p[1]).sin(), 1e-3 * (2.0 * p[2]).cos(), 1e-3 * (p[0] * p[1]).sin()]
}

//! What the benchmarks share; they are in `benches/`.

use tensormass_runtime::measure::{Body, Subject, scene_text};
use tensormass_runtime::model::{Model, build};
use tensormass_runtime::scene::{Precision, parse};
use tensormass_runtime::{LawEntry, linear_tetrahedron};

pub use tensormass_runtime::measure::wave;

/// A beam of 6 tetrahedra a cell, of one law.
///
/// # Panics
/// Never: the scene is right.
pub fn beam(law: &'static LawEntry, cells: [usize; 3]) -> Model {
    let (element, precision) = (linear_tetrahedron(), Precision::F64);
    let text =
        scene_text(&Subject { law, element, body: Body::Beam(cells), precision, repeats: 1, stiffness_ratio: 1.0 });
    let scene = parse(&text, "bench.toml", &[]).expect("the scene is right");
    build(&scene).expect("the scene can be built")
}

//! What the benchmarks share; they are in `benches/`.

use tensormass_runtime::measure::scene_text;
use tensormass_runtime::model::{Model, build};
use tensormass_runtime::scene::{Precision, parse};
use tensormass_runtime::{LawEntry, linear_tetrahedron};

pub use tensormass_runtime::measure::wave;

/// A beam of 6 tetrahedra a cell, of one law.
///
/// # Panics
/// Never: the scene is right.
pub fn beam(law: &LawEntry, cells: [usize; 3]) -> Model {
    let text = scene_text(law, linear_tetrahedron().info, cells, Precision::F64);
    let scene = parse(&text, "bench.toml", &[]).expect("the scene is right");
    build(&scene).expect("the scene can be built")
}

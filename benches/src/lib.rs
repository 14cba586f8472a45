//! What the benchmarks share; they are in `benches/`.

pub mod hand;

use tensormass_runtime::measure::{Body, Subject, scene_text};
use tensormass_runtime::model::{Model, build};
use tensormass_runtime::scene::{Precision, TangentChoice, parse};
use tensormass_runtime::{LawEntry, linear_tetrahedron};

pub use tensormass_runtime::measure::wave;

/// A beam of 6 tetrahedra a cell, of one law.
///
/// # Panics
/// Never: the scene is right.
pub fn beam(law: &'static LawEntry, cells: [usize; 3]) -> Model {
    let subject = Subject {
        law,
        element: linear_tetrahedron(),
        body: Body::Beam(cells),
        precision: Precision::F64,
        repeats: 1,
        stiffness_ratio: 1.0,
        tangent: TangentChoice::Auto,
    };
    let text = scene_text(&subject);
    let scene = parse(&text, "bench.toml", &[]).expect("the scene is right");
    build(&scene).expect("the scene can be built")
}

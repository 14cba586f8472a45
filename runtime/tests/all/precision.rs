//! Single precision against double: whole runs in which a body comes to rest under its load.

use crate::support::{done, probe, relative, repository, scene};
use tensormass_runtime::laws;

/// A beam sags under its growing weight and is then held. In f32 a strain is off by a rounding unit of the displacement
/// over an element's edge, 6e-8 x 1.6 m / .25 m = 4e-7 at the tip, and strains are 1e-2 where the beam bends most: 4e-5
/// of them. A solver that takes the last of the imbalance for noise loses ten times that on the finer mesh.
fn check(law: &str, cells: &str, duration: &str) {
    let text = std::fs::read_to_string(repository("scenes/gravity-hooke.toml")).expect("a scene of the repository");
    let run = |precision: &str| {
        let precision = format!("solver.precision={precision}");
        let law = format!("material.0.law={law}");
        let set = [cells, duration, &precision, &law];
        done(&scene(&text, &set))
    };
    let (single, double) = (run("f32"), run("f64"));
    for name in ["tip", "volume", "energy"] {
        let error = relative(probe(&single, name), probe(&double, name));
        eprintln!("{law}, {name}: {error:.1e}");
        assert!(error <= 1e-4, "{law}: {name} is off by {error:e} in f32");
    }
}

#[test]
fn a_sagging_beam_in_f32_is_the_one_in_f64() {
    // Laws whose parameters are the scene's.
    let fits =
        |law: &&tensormass_runtime::LawEntry| law.info.parameters.iter().map(|p| p.name).eq(["young", "poisson"]);
    for law in laws().iter().filter(fits) {
        // Newton's method on the finer mesh would take a minute for each law that is not linear.
        match law.info.structure.linear {
            true => check(law.info.name, "mesh.beam.cells=[16, 8, 8]", "solver.duration=2.0"),
            false => check(law.info.name, "mesh.beam.cells=[10, 4, 4]", "solver.duration=3.0"),
        }
    }
}

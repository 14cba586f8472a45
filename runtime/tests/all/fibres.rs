//! Fibre directions in scenes: every way of giving them, their length, values for each element, and what they cost.

use std::fmt::Write as _;
use std::fs;

use crate::support::{done, outcome, parameters, probe, relative};
use tensormass_runtime::model::build;
use tensormass_runtime::scene::{Scene, parse};
use tensormass_runtime::simulate::Ending;
use tensormass_runtime::{LawEntry, laws};

/// A beam that is pulled at one end and may contract sideways; MATERIALS and PULL stand for what a test puts there.
const PULLED: &str = r#"
[mesh]
beam = { size = [2, 1, 1], cells = [4, 2, 2] }
MATERIALS
[[boundary]]
nodes = "near(x, xmin)"
fix = ["x"]
[[boundary]]
nodes = "near(x, xmin) && near(y, ymin) && near(z, zmin)"
fix = ["y", "z"]
[[boundary]]
nodes = "near(x, xmin) && near(y, ymax) && near(z, zmin)"
fix = ["z"]
[[boundary]]
nodes = "near(x, xmax)"
move = { x = { ramp = [[0.0, 0.0], [1.0, PULL]] } }
[solver]
integrator = "static"
cg = { tolerance = 1e-10 }
[[probe]]
name = "modulus"
kind = "apparent_young_modulus"
axis = "x"
fixed = "near(x, xmin)"
moved = "near(x, xmax)"
[[probe]]
name = "elastic"
kind = "energy"
part = "elastic"
[[probe]]
name = "sag"
kind = "displacement"
nodes = "near(x, xmax)"
component = "y"
[[probe]]
name = "stress"
kind = "stress"
component = "von_mises"
"#;
/// The tetrahedra of that beam.
const ELEMENTS: usize = 4 * 2 * 2 * 6;

/// A material of a law, with its directions written as `direction(k)` says for the k-th of them.
fn material(law: &LawEntry, elements: &str, direction: impl Fn(usize) -> String) -> String {
    let values = parameters(law);
    let (mut items, mut first, mut directions) = (vec![], 0, 0);
    for p in law.info.parameters {
        let value = &values[first..first + p.len];
        first += p.len;
        items.push(if p.direction {
            directions += 1;
            format!("{} = {}", p.name, direction(directions - 1))
        } else if p.len == 1 {
            format!("{} = {:?}", p.name, value[0])
        } else {
            format!("{} = {value:?}", p.name)
        });
    }
    let items = items.join(", ");
    format!(
        "[[material]]\nlaw = \"{}\"\ndensity = 1000.0\nelements = \"{elements}\"\nparameters = {{ {items} }}\n",
        law.info.name
    )
}

fn scene(materials: &str, pull: f64, folder: &std::path::Path) -> Scene {
    let text = PULLED.replace("MATERIALS", materials).replace("PULL", &format!("{pull:?}"));
    parse(&text, folder.join("scene.toml"), &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// The probes of a scene, as bits.
fn bits(scene: &Scene) -> Vec<(String, u64)> {
    let outcome = outcome(scene);
    assert_eq!(outcome.ending, Ending::Done, "{}", outcome.summary["error"]);
    outcome.probes.iter().map(|(name, _, value)| (name.clone(), value.to_bits())).collect()
}

/// A vector for each of two directions of a law, two others, and multiples of them.
fn vector(k: usize, factor: f64) -> [f64; 3] {
    [[3.0, -1.0, 2.0], [1.0, 4.0, 0.5], [0.0, -2.0, 3.0], [5.0, 1.0, -1.0]][k % 4].map(|x| factor * x)
}

/// The same material in other words, and with it the same results to the last bit.
fn check(law: &LawEntry) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let run = |materials: &str| bits(&scene(materials, 0.1, at));
    let constant = run(&material(law, "all", |k| format!("{:?}", vector(k, 1.0))));
    let name = law.info.name;
    for factor in [2.0, 1e-3, 2f64.powi(-60), 1e20] {
        let longer = run(&material(law, "all", |k| format!("{:?}", vector(k, factor))));
        if factor.log2().fract() == 0.0 {
            assert_eq!(longer, constant, "{name}: {factor} times as long");
        } else {
            // The components themselves are rounded.
            for ((probe, a), (_, b)) in longer.iter().zip(&constant) {
                let (a, b) = (f64::from_bits(*a), f64::from_bits(*b));
                assert!((a - b).abs() <= 1e-9 * b.abs(), "{name}, {probe}: {a} and {b}");
            }
        }
    }
    if !law.info.parameters.iter().all(|p| !p.direction || p.per_element) {
        return;
    }
    let each = run(&material(law, "all", |k| format!("{{ per_element = {:?} }}", [vector(k, 1.0); ELEMENTS])));
    assert_eq!(each, constant, "{name}: one vector an element");
    // Directions that vary, in a table and by two materials.
    let halves = |k: usize, left: bool| vector(k + 2 * usize::from(left), 1.0);
    let model = build(&scene(&material(law, "all", |k| format!("{:?}", vector(k, 1.0))), 0.1, at));
    let model = model.unwrap_or_else(|e| panic!("{e}"));
    let left = |e: tensormass_runtime::mesh::ElementId| {
        model.mesh.positions(model.mesh.element_nodes(e)).iter().map(|corner| corner[0]).sum::<f64>() / 4.0 < 1.0
    };
    for k in 0..2 {
        let mut rows = String::from("# x, y, z\n");
        for e in model.mesh.elements() {
            let [x, y, z] = halves(k, left(e));
            let _ = writeln!(rows, "{x:?}, {y:?}, {z:?}");
        }
        fs::write(at.join(format!("direction{k}.csv")), rows).expect("a table");
    }
    let table = run(&material(law, "all", |k| format!("{{ per_element = \"direction{}.csv\" }}", k % 2)));
    let two = [("x < 1", true), ("x > 1", false)];
    let two = two.map(|(elements, left)| material(law, elements, |k| format!("{:?}", halves(k, left)))).concat();
    assert_eq!(table, run(&two), "{name}: a table and two materials");
    assert_ne!(table, constant, "{name}: directions that vary are no constant direction");
}

/// The laws of the build that have directions.
fn fibrous() -> impl Iterator<Item = &'static LawEntry> {
    laws().iter().filter(|law| law.info.structure.uses_fibres)
}

#[test]
fn however_a_direction_is_given() {
    assert!(fibrous().count() > 0, "no law of this build has directions");
    fibrous().for_each(check);
}

/// Constants for each element are made where a scene gives values for each, and nowhere else.
#[test]
fn values_for_each_element_cost_only_who_gives_them() {
    for law in fibrous() {
        let count = law.info.constants.len();
        for (each, wanted) in [(false, count), (true, count * ELEMENTS)] {
            let written = |k: usize| match each {
                false => format!("{:?}", vector(k, 1.0)),
                true => format!("{{ per_element = {:?} }}", [vector(k, 1.0); ELEMENTS]),
            };
            let folder = std::path::Path::new("");
            let model = build(&scene(&material(law, "all", written), 0.1, folder)).unwrap_or_else(|e| panic!("{e}"));
            let batch = &model.body.batches[0];
            assert_eq!((batch.per_element, batch.constants.len()), (each, wanted), "{}", law.info.name);
            assert_eq!(model.materials[0].per_element, each, "{}", law.info.name);
        }
    }
}

/// The engineering constants of the transversely isotropic law: a pull along the fibres meets their modulus, one across
/// the other. At a strain of 1e-6 the energy's third derivatives, at most 100 times the modulus, change it by 1e-4 of it.
#[test]
fn pulled_along_and_across() {
    let axial = 3e6;
    for (direction, modulus) in [("[1, 0, 0]", axial), ("[0, 2, 0]", 1e6), ("[0, -3, 3]", 1e6), ("[-5, 0, 0]", axial)] {
        let material = format!(
            "[[material]]\nlaw = \"transversely_isotropic\"\ndensity = 1000.0\nparameters = {{ young = 1e6, \
             axial_young = {axial:?}, axial_shear = 5e5, poisson = 0.3, fibre = {direction} }}\n"
        );
        let outcome = done(&scene(&material, 2e-6, std::path::Path::new("")));
        let found = probe(&outcome, "modulus");
        println!("{direction}: {found:e}, off by {:.1e}", relative(found, modulus));
        assert!(relative(found, modulus) <= 1e-4, "{direction}: {found:e}, not {modulus:e}");
    }
}

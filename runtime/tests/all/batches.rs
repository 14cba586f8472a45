//! Several laws and materials in one body, and what must not change a bit: threads, units, place, a second run.

use crate::support::{Random, body, outcome, parameters, scene, system, table};
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::mesh::beam;
use tensormass_runtime::model::{Model, build};
use tensormass_runtime::scene::Scene;
use tensormass_runtime::simulate::Ending;
use tensormass_runtime::{LawEntry, laws};

/// A material of the law whose moduli, whatever their names and defaults are, are `stiffness` for 1 MPa, and whose times are
/// `time` for 1 s.
fn stiffened(law: &LawEntry, stiffness: f64, time: f64) -> Vec<f64> {
    let mut values = parameters(law);
    let powers = law.info.parameters.iter().flat_map(|p| std::iter::repeat_n(p.dimensions, p.len));
    let factor = |[_, of_stress, of_time]: [i32; 3]| (stiffness / 1e6).powi(of_stress) * time.powi(of_time);
    values.iter_mut().zip(powers).for_each(|(x, powers)| *x *= factor(powers));
    values
}

/// Materials for slabs along x, by law and Young's modulus; other parameters are those of any law.
fn materials(slabs: &[(&str, f64)], length: f64, density: f64, time: f64) -> String {
    let count = slabs.len() as f64;
    let one = |(i, (law, stiffness)): (usize, &(&str, f64))| {
        let entry = tensormass_runtime::law(law).expect("a law of this build");
        let text = table(entry, &stiffened(entry, *stiffness, time));
        let (from, to) = (length * i as f64 / count, length * (i + 1) as f64 / count);
        format!(
            "[[material]]\nlaw = \"{law}\"\ndensity = {density:?}\nelements = \"x > {from:?} && x < {to:?}\"\n\
             parameters = {text}\n"
        )
    };
    slabs.iter().enumerate().map(one).collect()
}

/// A beam of all laws, clamped, that swings under a sudden traction.
struct Swing {
    /// Factors of two of length and of stress.
    length: f64,
    stress: f64,
    origin: [f64; 3],
    cells: [u32; 3],
    integrator: &'static str,
    precision: &'static str,
    threads: u32,
    steps: u32,
    tangent: &'static str,
}

const SWING: Swing = Swing {
    length: 1.0,
    stress: 1.0,
    origin: [0.0; 3],
    cells: [16, 2, 2],
    integrator: "implicit-euler",
    precision: "f64",
    threads: 1,
    steps: 5,
    tangent: "auto",
};

impl Swing {
    fn scene(&self) -> Scene {
        let Swing { length, stress, origin, cells, integrator, precision, threads, steps, tangent } = self;
        let slabs: Vec<(&str, f64)> = laws().iter().map(|l| (l.info.name, 1e6 * stress)).collect();
        // Selections by x count from the end.
        let time = length / stress.sqrt();
        let materials =
            materials(&slabs, 4.0 * length, 1000.0, time).replace("x >", "x - xmin >").replace("x <", "x - xmin <");
        let (size, origin) = ([4.0 * length, *length, *length], origin.map(|x| x * length));
        let step = time * if *integrator == "implicit-euler" { 0.01 } else { 1e-3 };
        let text = format!(
            r#"
[mesh]
beam = {{ size = {size:?}, cells = {cells:?}, origin = {origin:?} }}
{materials}
[[boundary]]
nodes = "near(x, xmin)"
fix = ["x", "y", "z"]
[[load]]
kind = "traction"
faces = "near(x, xmax)"
value = [{:?}, {:?}, {:?}]
[solver]
integrator = "{integrator}"
precision = "{precision}"
threads = {threads}
cg = {{ tangent = "{tangent}" }}
step = {step:?}
duration = {:?}
[[probe]]
name = "tip"
kind = "displacement"
nodes = "near(x, xmax)"
component = "y"
[[probe]]
name = "largest"
kind = "displacement"
nodes = "all"
component = "magnitude"
statistic = "max"
[[probe]]
name = "elastic"
kind = "energy"
part = "elastic"
[[probe]]
name = "kinetic"
kind = "energy"
part = "kinetic"
[[probe]]
name = "stress"
kind = "stress"
component = "von_mises"
"#,
            1e3 * stress,
            2e3 * stress,
            -3e3 * stress,
            f64::from(*steps) * step,
        );
        scene::<&str>(&text, &[])
    }

    /// The probes in the units of factor 1, as bits.
    fn bits(&self) -> Vec<(String, u64)> {
        let outcome = outcome(&self.scene());
        assert_eq!(outcome.ending, Ending::Done);
        let energy = self.length.powi(3) * self.stress;
        let unit = |unit: &str| match unit {
            "m" => self.length,
            "J" => energy,
            _ => self.stress,
        };
        assert!(outcome.probes.iter().all(|(_, _, value)| value.is_finite() && *value != 0.0), "{:?}", outcome.probes);
        outcome.probes.iter().map(|(name, u, value)| (name.clone(), (value / unit(u)).to_bits())).collect()
    }
}

/// Two runs that must agree in every bit.
fn check(what: &str, one: &Swing, other: &Swing) {
    for integrator in ["implicit-euler", "central-difference", "semi-implicit-euler"] {
        for precision in ["f64", "f32"] {
            let (a, b) =
                (Swing { integrator, precision, ..*one }.bits(), Swing { integrator, precision, ..*other }.bits());
            assert_eq!(a, b, "{what}: {integrator}, {precision}");
        }
    }
}

/// More elements than two tasks take, and more nodes than one block of a sum.
#[test]
fn threads_change_nothing() {
    let swing = Swing { cells: [16; 3], steps: 2, ..SWING };
    for threads in [2, 3] {
        check("threads", &swing, &Swing { threads, ..swing });
    }
    for tangent in ["stored", "recomputed", "assembled"] {
        let swing = Swing { tangent, ..swing };
        assert_eq!(swing.bits(), Swing { threads: 3, ..swing }.bits(), "{tangent}");
    }
}

/// What is stored of tangents is what is computed anew, whichever is measured to be faster, but for rounding: of some hundred
/// operations of a product, which a solution of a beam of this condition makes a hundred times larger at most.
#[test]
fn tangents_change_nothing_but_rounding() {
    for (precision, unit) in [("f64", f64::EPSILON / 2.0), ("f32", f64::from(f32::EPSILON) / 2.0)] {
        let values = |tangent| {
            let bits = Swing { precision, tangent, ..SWING }.bits();
            bits.into_iter().map(|(name, bits)| (name, f64::from_bits(bits))).collect::<Vec<_>>()
        };
        let stored = values("stored");
        for tangent in ["recomputed", "assembled", "measured"] {
            for ((name, value), (_, wanted)) in values(tangent).iter().zip(&stored) {
                let error = (value / wanted - 1.0).abs();
                assert!(error <= 1e4 * unit, "{name}, {precision}: {tangent} is off by {error:e}");
            }
        }
    }
}

#[test]
fn reruns_change_nothing() {
    check("a rerun", &SWING, &SWING);
}

#[test]
fn units_change_nothing() {
    // Stress by even powers, so that time changes by powers of two as well. The last two are the ends of what a scene
    // may ask for: there energies in f32 would underflow or overflow in SI units.
    for (length, stress) in [(-10, 0), (10, 0), (0, 8), (0, -8), (-3, 4), (-28, -18), (17, 18)] {
        let (length, stress) = (2.0_f64.powi(length), 2.0_f64.powi(stress));
        check("units", &SWING, &Swing { length, stress, ..SWING });
    }
}

/// Nodes at quarters and halves of the beam are representable at these places.
#[test]
fn place_changes_nothing() {
    for origin in [[8.0, -16.0, 4.0], [-1024.0, 0.5, 65536.0]] {
        check("place", &SWING, &Swing { origin, ..SWING });
    }
}

fn forces(model: &Model, u: &[[f64; 3]]) -> (Vec<[f64; 3]>, Vec<f64>, Vec<[f64; 9]>) {
    let scaled: Vec<[f64; 3]> = u.iter().map(|u| u.map(|x| x / model.scale.length)).collect();
    let mut system = system::<f64>(model.body.clone());
    let (scaled, mut f) = (system.backend.upload(&scaled), system.backend.zeros());
    system.field.add_force(&system.backend, &scaled, &mut f).unwrap_or_else(|e| panic!("{e}"));
    let (force, energy, stress) = (model.scale.force(), model.scale.energy(), model.scale.stress);
    let energies = system.field.element_energies(&system.backend, &scaled).unwrap_or_else(|e| panic!("{e}"));
    (
        system.backend.download(&f).iter().map(|f| f.map(|x| x * force)).collect(),
        energies.iter().map(|w| w * energy).collect(),
        system.field.cauchy(&system.backend, &scaled).iter().map(|s| s.map(|x| x * stress)).collect(),
    )
}

/// Roundings in a kernel's longest chain of operations, magnified by what cancels at these strains: elements that are in
/// other strips take differences to other nodes.
const ROUNDINGS: f64 = 200.0;

/// Slabs of different laws, or of one law with different stiffness: each element has what it has in a body that is made of
/// its material alone (units change by powers of two only), and each node the sum of that.
fn check_slabs(slabs: &[(&str, f64)]) {
    let text = |slabs: &[(&str, f64)]| {
        let (materials, solver) =
            (materials(slabs, 4.0, 1000.0, 1.0), "integrator = \"implicit-euler\"\nstep = 1\nduration = 1");
        format!("{materials}\n[mesh]\nbeam = {{ size = [4, 1, 1], cells = [8, 2, 2] }}\n[solver]\n{solver}\n")
    };
    let of = |slabs: &[(&str, f64)]| build(&scene::<&str>(&text(slabs), &[])).unwrap_or_else(|e| panic!("{e}"));
    let all = of(slabs);
    let seed = 5;
    let mut random = Random(seed);
    let u: Vec<[f64; 3]> = all.mesh.nodes().iter().map(|_| random.vector(0.04)).collect();
    let (f, energies, stresses) = forces(&all, &u);
    let mut sum = vec![[0.0; 3]; f.len()];
    let mut largest = 0.0_f64;
    for (i, slab) in slabs.iter().enumerate() {
        let alone = of(&[*slab]);
        let (_, own_energies, own_stresses) = forces(&alone, &u);
        for e in all.mesh.elements() {
            let corners = all.mesh.positions(all.mesh.element_nodes(e));
            let x = corners.iter().map(|p| p[0]).sum::<f64>() / 4.0;
            if (x / 4.0 * slabs.len() as f64) as usize == i {
                let name = format!("{slabs:?}, seed {seed}, element {e:?} of slab {i}");
                let near = |found: &[f64], wanted: &[f64]| {
                    let size = wanted.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
                    let off = found.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(off <= ROUNDINGS * f64::EPSILON * size, "{name}: {found:?} against {wanted:?}");
                };
                near(&energies[e.index()..=e.index()], &own_energies[e.index()..=e.index()]);
                near(&stresses[e.index()], &own_stresses[e.index()]);
            }
        }
        // The forces of this slab: a body of its elements' batch only.
        let entry = tensormass_runtime::law(slab.0).expect("a law");
        let mesh = beam([4.0, 1.0, 1.0], [8, 2, 2], [0.0; 3]).expect("a beam");
        let own = stiffened(entry, slab.1, 1.0);
        let mut body = body(&mesh, entry, &own, &[]);
        let place = |e: &u32| {
            let corners = mesh.positions(mesh.element_nodes(tensormass_runtime::mesh::ElementId(*e)));
            (corners.iter().map(|p| p[0]).sum::<f64>() / 16.0 * slabs.len() as f64) as usize
        };
        body.batches[0].elements.retain(|e| place(e) == i);
        let mut system = system::<f64>(body);
        let (u, mut f) = (system.backend.upload(&u), system.backend.upload(&sum));
        system.field.add_force(&system.backend, &u, &mut f).unwrap_or_else(|e| panic!("{e}"));
        largest = largest.max(system.backend.max_abs(&f));
        sum = system.backend.download(&f);
    }
    for (n, (f, s)) in f.iter().zip(&sum).enumerate() {
        // The order of at most 24 sums differs.
        let off = (0..3).map(|c| (f[c] - s[c]).abs()).fold(0.0, f64::max);
        assert!(off <= 24.0 * 4.0 * f64::EPSILON * largest, "{slabs:?}, seed {seed}, node {n}: {f:?} against {s:?}");
    }
}

#[test]
fn slabs_of_different_laws() {
    let slabs: Vec<(&str, f64)> = laws().iter().map(|l| (l.info.name, 1e6)).collect();
    assert!(slabs.len() > 1, "one law makes no mixture");
    check_slabs(&slabs);
}

#[test]
fn slabs_of_one_law() {
    for law in laws() {
        check_slabs(&[(law.info.name, 1e6), (law.info.name, 7e6)]);
    }
}

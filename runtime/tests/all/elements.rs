//! Every element: what its stiffness and its forces must be, for every law.

use crate::support::elements::{boxes_beside_wedges, distorted, of_dimension, unit};
use crate::support::{self, CANTILEVER, Random, body, case, done, number, parameters, probe, relative, scene, system};
use nalgebra::DMatrix;
use tensormass_kernels::{ElementEntry, elements, laws};
use tensormass_runtime::LawEntry;
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::cg::CgLimits;
use tensormass_runtime::cpu::One;
use tensormass_runtime::integrate::{NewtonLimits, SolverSettings, Statics};
use tensormass_runtime::mesh::{Mesh, integrals};
use tensormass_runtime::scene::Preconditioner;
use tensormass_runtime::system::Integrator;

/// One distorted element with its kernels; displacements are given at its nodes.
struct Single {
    element: &'static ElementEntry,
    kernels: One,
}

type Nodal = Vec<[f64; 3]>;

impl Single {
    fn new(element: &'static ElementEntry, law: &'static LawEntry) -> Self {
        // Corners at random places near those of a regular element, edges straight.
        let mesh = distorted(&unit(element, 2), 0.3, 5);
        let e = mesh.elements().next().expect("an element");
        Self { element, kernels: One::new(element, law, &mesh.rest(e), &law.constants(&parameters(law))) }
    }

    fn zeros(&self) -> Nodal {
        vec![[0.0; 3]; self.element.info.nodes]
    }

    fn random(&self, size: f64, seed: u64) -> Nodal {
        let mut random = Random(seed);
        let plane = self.element.info.dimension == 2;
        let mut all: Nodal = (0..self.element.info.nodes).map(|_| random.vector(size)).collect();
        if plane {
            all.iter_mut().for_each(|v| v[2] = 0.0);
        }
        all
    }

    fn energy(&self, u: &Nodal) -> f64 {
        self.kernels.energy(u).expect("the element is in the domain")
    }

    fn force(&self, u: &Nodal) -> Nodal {
        let mut f = self.zeros();
        assert!(self.kernels.force(u, &mut f), "outside the domain");
        f
    }

    fn dforce(&self, u: &Nodal, du: &Nodal) -> Nodal {
        let mut f = self.zeros();
        self.kernels.dforce(u, du, &mut f);
        f
    }
}

fn dot(a: &Nodal, b: &Nodal) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
}

fn moved(u: &Nodal, h: f64, du: &Nodal) -> Nodal {
    u.iter().zip(du).map(|(u, d)| std::array::from_fn(|i| u[i] + h * d[i])).collect()
}

/// Central differences with steps h, h/2, h/4, h/8, extrapolated (Romberg): the error is O(h^8).
fn derivative(f: impl Fn(f64) -> f64) -> f64 {
    let mut column: Vec<f64> = (0..4).map(|k| 1.0 / f64::from(128 << k)).map(|h| (f(h) - f(-h)) / (2.0 * h)).collect();
    for order in 1..4 {
        let weight = f64::from(1 << (2 * order));
        column = column.windows(2).map(|w| (weight * w[1] - w[0]) / (weight - 1.0)).collect();
    }
    column[0]
}

fn each_pair(check: impl Fn(&Single, &str)) {
    for element in of_dimension(3).chain(of_dimension(2)) {
        for law in laws() {
            check(&Single::new(element, law), &format!("{} of {}", element.info.name, law.info.name));
        }
    }
}

/// Differences of steps down to 1e-3 lose 3 digits of 16, their truncation 1e-3^8; a kink of a law (fibres that buckle)
/// is met at one state of a hundred, and not at these.
const DIFFERENCE: f64 = 1e-9;

#[test]
fn forces_are_derivatives_of_energies_and_differentials_those_of_forces() {
    each_pair(|single, name| {
        // Nodes of a quadratic element are half as far apart.
        let (u, du, v) = (single.random(0.02, 1), single.random(0.05, 2), single.random(1.0, 3));
        let f = single.force(&u);
        let size = f.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        let slope = derivative(|h| single.energy(&moved(&u, h, &du)));
        let work = dot(&f, &du);
        assert!((slope + work).abs() <= DIFFERENCE * size, "{name}: dW = {slope}, -f du = {}", -work);
        let df = single.dforce(&u, &du);
        let slope = derivative(|h| dot(&single.force(&moved(&u, h, &du)), &v));
        let (wanted, size) = (dot(&df, &v), df.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs())));
        assert!((slope - wanted).abs() <= 100.0 * DIFFERENCE * size, "{name}: df v = {wanted}, by differences {slope}");
    });
}

#[test]
fn tangents_are_symmetric_and_diagonals_theirs() {
    each_pair(|single, name| {
        let (u, a, b) = (single.random(0.03, 4), single.random(1.0, 5), single.random(1.0, 6));
        let (ab, ba) = (dot(&single.dforce(&u, &a), &b), dot(&single.dforce(&u, &b), &a));
        // A hundred or so terms a side.
        assert!(
            (ab - ba).abs() <= 1e-12 * (ab.abs() + ba.abs() + dot(&single.dforce(&u, &a), &a).abs()),
            "{name}: {ab} {ba}"
        );
        let mut diagonal = single.zeros();
        single.kernels.diagonal(&u, &mut diagonal);
        let size = diagonal.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        for n in 0..u.len() {
            for i in 0..single.element.info.dimension {
                let mut unit = single.zeros();
                unit[n][i] = 1.0;
                let wanted = -single.dforce(&u, &unit)[n][i];
                assert!(
                    (diagonal[n][i] - wanted).abs() <= 1e-12 * size,
                    "{name}: node {n}, {i}: {diagonal:?} {wanted}"
                );
            }
        }
    });
}

#[test]
fn nothing_but_rigid_motions_costs_nothing() {
    each_pair(|single, name| {
        // Forces sum to zero, and a translation, however far, is no strain.
        let (u, still) = (single.random(0.03, 7), single.zeros());
        let f = single.force(&u);
        let size = f.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        for i in 0..3 {
            let sum: f64 = f.iter().map(|f| f[i]).sum();
            assert!(sum.abs() <= 1e-14 * f.len() as f64 * size, "{name}: forces sum to {sum}");
        }
        let far = vec![if single.element.info.dimension == 2 { [1e3, -2e3, 0.0] } else { [1e3, -2e3, 5e2] }; f.len()];
        let moved = single.force(&far);
        assert!(moved.iter().flatten().all(|x| *x == 0.0), "{name}: a translation costs {moved:?}");
        // At rest, exactly the rigid motions have no stiffness.
        let d = single.element.info.dimension;
        let n = d * f.len();
        let mut k = DMatrix::<f64>::zeros(n, n);
        for column in 0..n {
            let mut unit = single.zeros();
            unit[column / d][column % d] = 1.0;
            let df = single.dforce(&still, &unit);
            (0..n).for_each(|line| k[(line, column)] = -df[line / d][line % d]);
        }
        let mut values: Vec<f64> = ((&k + k.transpose()) * 0.5).symmetric_eigenvalues().iter().copied().collect();
        values.sort_by(f64::total_cmp);
        let (rigid, greatest) = (if d == 3 { 6 } else { 3 }, values[n - 1]);
        assert!(values[rigid - 1].abs() <= 1e-12 * greatest, "{name}: {:?}", &values[..rigid + 1]);
        assert!(values[rigid] > 1e-6 * greatest, "{name}: a mode without stiffness: {:?}", &values[..rigid + 1]);
    });
}

/// Static equilibrium where all nodes of the boundary are at G X: all others have to be there, too.
fn patch(mesh: &Mesh, law: &'static LawEntry) {
    let kinds: Vec<&str> = mesh.blocks().iter().map(|b| b.info().name).collect();
    let name = format!("{} of {}", kinds.join(" and "), law.info.name);
    let plane = mesh.blocks()[0].info().dimension == 2;
    let gradient = [[0.08, 0.05, -0.03], [-0.02, -0.06, 0.04], [0.03, -0.01, 0.07]];
    let at = |x: &[f64; 3]| -> [f64; 3] {
        std::array::from_fn(|i| if plane && i == 2 { 0.0 } else { (0..3).map(|k| gradient[i][k] * x[k]).sum() })
    };
    let surface = mesh.surface_nodes();
    let inside = |n: u32| surface.binary_search(&tensormass_runtime::mesh::NodeId(n)).is_err();
    let nodes = mesh.nodes();
    let imposed: Vec<(u32, u8, f64)> = (0..nodes.len() as u32)
        .flat_map(|n| (0..3).map(move |c| (n, c)))
        .filter(|(n, c)| !inside(*n) || (plane && *c == 2))
        .map(|(n, c)| (n, c, at(&nodes[n as usize])[c as usize]))
        .collect();
    assert!((0..nodes.len() as u32).filter(|n| inside(*n)).count() > 3, "{name}: nothing to find");
    let mut body = body(mesh, law, &parameters(law), &imposed);
    for (motion, (_, _, value)) in body.motions.iter_mut().zip(&imposed) {
        *motion = tensormass_runtime::history::History::table(vec![(0.0, 0.0), (1.0, *value)]).expect("a ramp");
    }
    let mut system = system::<f64>(body);
    let settings = SolverSettings {
        cg: CgLimits { tolerance: 1e-13, max_iterations: 2000 },
        preconditioner: Preconditioner::Jacobi,
        newton: NewtonLimits { tolerance: 1e-13, max_iterations: 20 },
    };
    let mut state = system.initial_state([0.0; 3]);
    // Not where the first linear solution ends.
    let mut random = Random(3);
    let start: Vec<[f64; 3]> = nodes.iter().map(|_| random.vector(0.01)).collect();
    state.u = system.backend.upload(&start);
    system.backend.impose(&system.body.motions_at(0.0), &mut state.u);
    let mut statics = Statics::new(&system.backend, settings);
    statics.step(&mut system, &mut state, 1.0).unwrap_or_else(|e| panic!("{name}: {e}"));
    let u = system.backend.download(&state.u);
    let off = u.iter().zip(nodes).flat_map(|(u, x)| (0..3).map(move |c| (u[c] - at(x)[c]).abs())).fold(0.0, f64::max);
    // Newton's tolerance times the condition of a mesh of three cells, about 1e2.
    assert!(off <= 1e-10, "{name}: a node is {off:.2e} away from G X");
    // Every element has the one stress.
    let stresses = system.field.cauchy(&system.backend, &state.u);
    let size = stresses[0].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let worst = stresses.iter().flat_map(|s| (0..9).map(|k| (s[k] - stresses[0][k]).abs())).fold(0.0, f64::max);
    assert!(worst <= 1e-8 * size, "{name}: stresses differ by {:.2e}", worst / size);
}

#[test]
fn patch_tests() {
    for element in of_dimension(3).chain(of_dimension(2)) {
        let mesh = distorted(&unit(element, 3), 0.4, 11);
        for law in laws() {
            patch(&mesh, law);
        }
    }
}

/// Boxes and wedges that share faces.
#[test]
fn patch_tests_of_mixed_meshes() {
    let mesh = boxes_beside_wedges(3);
    let boxes = unit(tensormass_kernels::element("hexahedron_q1").expect("shipped"), 3);
    assert_eq!(mesh.surface_nodes(), boxes.surface_nodes(), "faces between boxes and wedges are inside");
    for law in laws() {
        patch(&distorted(&mesh, 0.3, 17), law);
    }
}

const PLANE: &str = r#"
[mesh]
file = "plane.msh"

[[material]]
law = "hooke"
density = 1000.0
parameters = { young = 1e6, poisson = 0.3 }

[[boundary]]
nodes = "near(x, xmin)"
fix = ["x"]

[[boundary]]
nodes = "near(y, ymin)"
fix = ["y"]

[[load]]
kind = "traction"
faces = "near(x, xmax)"
value = [1000.0, 0.0, 0.0]

[[load]]
kind = "gravity"
acceleration = [0.0, 0.0, -9.81]

[solver]
integrator = "static"
precision = "f64"
cg = { tolerance = 1e-12, max_iterations = 5000 }

[[probe]]
name = "x"
kind = "displacement"
nodes = "near(x, xmax)"
component = "x"

[[probe]]
name = "z"
kind = "displacement"
nodes = "all"
component = "z"
statistic = "max"

[[probe]]
name = "szz"
kind = "stress"
component = "zz"

[[probe]]
name = "volume"
kind = "volume"
elements = "all"
"#;

/// A plane body of quadratic triangles beside quadrangles, pulled: strain is plane, whatever pushes it along z.
#[test]
fn strain_is_plane_in_two_dimensions() {
    let file = support::repository("runtime/tests/data/plane_4.msh");
    let set = [format!("mesh.file={:?}", file.to_str().expect("UTF-8"))];
    // What holds a plane body along z is no support.
    let (head, tail) = PLANE.split_once("[[boundary]]").expect("supports");
    let (_, tail) = tail.split_once("[[load]]").expect("loads");
    let unsupported = tensormass_runtime::model::build(&scene(&format!("{head}[[load]]{tail}"), &set));
    let error = unsupported.err().map(|e| e.to_string()).unwrap_or_default();
    assert!(error.contains("static equilibrium needs supports"), "{error}");
    let outcome = done(&scene(PLANE, &set));
    let (young, poisson, pull, length) = (1e6, 0.3, 1000.0, 2.0);
    let wanted = length * pull * (1.0 - poisson * poisson) / young;
    assert!(relative(probe(&outcome, "x"), wanted) <= 1e-10, "{} {wanted}", probe(&outcome, "x"));
    assert_eq!(probe(&outcome, "z"), 0.0);
    // Cauchy's stress P F' / J; the z component of F is 1.
    let volume = (1.0 + wanted / length) * (1.0 - pull * poisson * (1.0 + poisson) / young);
    assert!(relative(probe(&outcome, "szz"), poisson * pull / volume) <= 1e-10, "{}", probe(&outcome, "szz"));
    assert!(relative(probe(&outcome, "volume"), 2.0 * volume) <= 1e-10, "{}", probe(&outcome, "volume"));
}

/// Volumes, areas and normals of distorted meshes: the integrals that loads are made of.
#[test]
fn meshes_keep_their_volume_and_their_surface() {
    for element in elements().iter().filter(|e| e.info.dimension > 1) {
        let name = element.info.name;
        let mesh = distorted(&unit(element, 3), 0.3, 13);
        assert!((mesh.total_volume() - 1.0).abs() < 1e-13, "{name}: {}", mesh.total_volume());
        let surface = |mesh: &Mesh| -> f64 {
            let faces = mesh.boundary().into_iter();
            faces.map(|f| integrals(mesh.face_kind(f), &mesh.positions(&mesh.face_nodes(f))).iter().sum::<f64>()).sum()
        };
        let wanted = if element.info.dimension == 3 { 6.0 } else { 4.0 };
        assert!((surface(&mesh) - wanted).abs() < 1e-12, "{name}: {}", surface(&mesh));
        let lumped: f64 = element.info.lumping.iter().sum();
        assert!((lumped - 1.0).abs() < 1e-15 && element.info.lumping.iter().all(|m| *m > 0.0), "{name}");
    }
}

/// A plane cantilever is stiffer than one of a square section by 1 / (1 - nu^2), but for shear.
#[test]
fn plane_beams_bend_as_plates() {
    for element in ["triangle_p2", "quadrangle_s2"] {
        let text = CANTILEVER.replace("value = [0.0, 0.0, 1.0]", "value = [0.0, 1.0, 0.0]");
        let set = [r"mesh.beam.cells=[30, 3, 1]".to_string(), format!("mesh.beam.element=\"{element}\"")];
        let tip = -probe(&done(&scene(&text, &set)), "work");
        // 4 L^3 (1 - nu^2) / E + shear with the plate's factor 5/6; clamping costs half a percent.
        let (young, poisson, length) = (1e6_f64, 0.3_f64, 10.0_f64);
        let bending = 4.0 * length.powi(3) * (1.0 - poisson * poisson) / young;
        let shear = 2.0 * (1.0 + poisson) * length / (5.0 / 6.0 * young);
        assert!(relative(tip, bending + shear) <= 0.01, "{element}: {tip}, {}", bending + shear);
    }
}

/// The tip's mean deflection of CANTI_SMALL, which is the work of a unit traction.
fn deflection(element: &str, cells: [u32; 3]) -> f64 {
    let set = [format!("mesh.beam.cells={cells:?}"), format!("mesh.beam.element=\"{element}\"")];
    let outcome = done(&scene(CANTILEVER, &set));
    let (work, elastic) = (-probe(&outcome, "work"), probe(&outcome, "elastic"));
    assert!(relative(2.0 * elastic, work) <= 1e-8, "{element}: Clapeyron: {elastic} {work}");
    // A linear law: the volume changes by less than the strain, 6e-3 at the most.
    assert!(relative(probe(&outcome, "volume"), 10.0) <= 1e-4, "{element}: {}", probe(&outcome, "volume"));
    println!("{element} {cells:?}: {work:e}");
    work
}

#[test]
fn quadratic_elements_meet_the_cantilever() {
    let expected = &case("CANTI_SMALL")["expected"];
    for cells in [[20, 2, 2], [30, 3, 3]] {
        let [nx, ny, nz] = cells;
        let wanted = number(&expected["fem"][format!("P2_{nx}x{ny}x{nz}")]["tip_avg"]);
        let found = deflection("tetrahedron_p2", cells);
        assert!(relative(found, wanted) <= 1e-6, "{cells:?}: {found}, wanted {wanted}");
    }
    let timoshenko = number(&expected["timoshenko"]["timo"]);
    for element in ["tetrahedron_p2", "hexahedron_s2"] {
        let found = deflection(element, [30, 3, 3]);
        assert!(relative(found, timoshenko) <= 0.01, "{element}: {found}, Timoshenko {timoshenko}");
    }
}

/// What a scene asks for that the build has not, or of which no beam is made.
#[test]
fn wrong_elements_are_refused() {
    let check = |element: &str, message: &str| {
        let scene = scene(CANTILEVER, &[format!("mesh.beam.element=\"{element}\"")]);
        let error = tensormass_runtime::model::build(&scene).err().map(|e| e.to_string());
        let error = error.unwrap_or_else(|| panic!("{element} is accepted"));
        assert!(error.contains(message), "{element}: {error}");
    };
    check("tetrahedron_p9", "there is no element \"tetrahedron_p9\"");
    for element in elements().iter().filter(|e| e.info.dimension > 1) {
        check("tetrahedron_p9", element.info.name);
    }
    check("segment_p2", "a beam cannot be made of `segment_p2`");
    check("segment_p2", "take a solid element, or a plane one for a rectangle");
    check("triangle_p2", "a rectangle of plane elements is one metre thick, not 1 m in 2 cells");
    check("triangle_p2", "give size 1 and 1 cell along z");
}

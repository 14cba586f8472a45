//! A study of a small scene: its reference converges, its settings are compared with it, what it recommends holds when it is run
//! again, and it can be gone on with.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use tensormass_runtime::mesh::beam;
use tensormass_runtime::probe::Energies;
use tensormass_runtime::simulate::Sample;
use tensormass_tradeoff::report::Report;
use tensormass_tradeoff::{
    Axis, Budget, Errors, Follow, Measured, Metric, Points, Space, Status, Study, Trajectory, front,
};

const BEAM: &str = r#"
[mesh]
beam = { size = [3, 1, 1], cells = [4, 2, 2] }

[[material]]
law = "neo_hookean"
density = 1000.0
parameters = { young = 1e6, poisson = 0.3 }

[[boundary]]
nodes = "near(x, xmin)"
fix = ["x", "y", "z"]

[[load]]
kind = "gravity"
acceleration = [0.0, 0.0, -9.81]
ramp = [[0.0, 0.0], [0.2, 1.0]]

[solver]
integrator = "implicit-euler"
step = 0.02
duration = 0.4
precision = "f64"
newton = { tolerance = 1e-6, max_iterations = 30 }

[[probe]]
name = "tip"
kind = "displacement"
nodes = "near(x, xmax)"
component = "z"
"#;

#[derive(Default)]
struct Quiet(Vec<String>);

impl Follow for Quiet {
    fn does(&mut self, text: &str, _: f64) {
        self.0.push(text.to_string());
    }
    fn stop(&self) -> Arc<AtomicBool> {
        Arc::default()
    }
}

fn budget(seconds: f64) -> Budget {
    Budget { total: Duration::from_secs_f64(seconds), metric: Metric::Displacement, target: Some(0.05) }
}

fn conduct(space: &Space, out: &Path, seconds: f64) -> (Study, Vec<String>) {
    let mut follow = Quiet::default();
    let study = Study::conduct(space, out, budget(seconds), &mut follow).unwrap_or_else(|e| panic!("{e}"));
    (study, follow.0)
}

fn error(m: &Measured) -> f64 {
    m.errors.map_or(f64::NAN, |e| e.displacement)
}

/// Errors are those of displacements in the mean square and the greatest, of probes and of energy, relative to the reference.
#[test]
fn errors_are_relative() {
    let mesh = beam([1.0; 3], [1; 3], [0.0; 3]).unwrap_or_else(|e| panic!("{e}"));
    let points = Points { positions: vec![[0.5; 3], [0.25, 0.5, 0.75]], weights: vec![1.0, 3.0] };
    let of = |shift: f64| {
        let displacement = mesh.nodes().iter().map(|x| [x[0] + shift, 0.0, 0.0]).collect();
        let energies = Energies { kinetic: 0.0, elastic: 2.0 + shift, external: 0.0 };
        let sample = Sample { step: 1, time: 1.0, displacement, energies, probes: vec![4.0 * (1.0 + shift), f64::NAN] };
        Trajectory::of(&mesh, &points, &[sample]).expect("both are in the mesh")
    };
    let found = of(0.1).errors(&of(0.0), &points);
    let square = (0.5_f64 * 0.5 + 3.0 * 0.25 * 0.25).sqrt();
    let wanted = Errors { displacement: 0.1 * 2.0 / square, greatest: 0.1 / 0.5, probes: 0.1, energy: 0.05 };
    for metric in Metric::ALL {
        let (found, wanted) = (found.of(metric), wanted.of(metric));
        assert!((found - wanted).abs() < 1e-12, "{}: {found} for {wanted}", metric.name());
    }
    assert_eq!(of(0.0).errors(&of(0.0), &points), Errors::default());
    let outside = Points { positions: vec![[5.0; 3]], weights: vec![1.0] };
    assert!(Trajectory::of(&mesh, &outside, &[]).is_none());
}

/// The measured setting that differs from the scene's in one choice, if it was run.
fn alone<'a>(space: &Space, study: &'a Study, axis: Axis, name: &str) -> Option<&'a Measured> {
    let k = space.choices(axis).iter().position(|c| c.name == name).unwrap_or_else(|| panic!("{name}"));
    let setting = space.base().with(axis, k);
    study.measured.iter().find(|m| m.setting == setting && m.status == Status::Done)
}

/// What is finer of a mesh file has its elements in parts; nothing is coarser, but of a scene that has parts itself.
#[test]
fn a_mesh_file_is_cut_into_parts() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("file.toml");
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/../runtime/tests/data/extruded_4.msh");
    let rest = BEAM.split_once("[[material]]").expect("a material").1;
    std::fs::write(&scene, format!("[mesh]\nfile = {mesh:?}\n[[material]]{rest}")).expect("written");
    let changes = ["solver.integrator=static".to_string(), "solver.step=0.1".to_string()];
    let space = Space::of(&scene, &changes, &[]).unwrap_or_else(|e| panic!("{e}"));
    let names = |space: &Space| space.choices(Axis::Mesh).iter().map(|c| c.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&space), ["x1", "x2", "x4"]);
    let (study, _) = conduct(&space, &folder.path().join("out"), 20.0);
    assert!(study.reference.checks.iter().any(|check| check.mesh.is_some()), "{:?}", study.reference.unrefined);
    let own = study.measured.iter().find(|m| m.setting == space.base()).expect("the scene's own");
    let finer = alone(&space, &study, Axis::Mesh, "x2").expect("it is measured");
    assert!(error(own) > 1.3 * error(finer), "{} and {}", error(own), error(finer));

    for (refine, wanted) in
        [(4, &["x0.25", "x0.5", "x1", "x2", "x4"][..]), (6, &["x0.5", "x1", "x2"]), (16, &["x0.25", "x0.5", "x1"])]
    {
        let changes = [&changes[..], &[format!("mesh.refine={refine}")]].concat();
        let space = Space::of(&scene, &changes, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(names(&space), wanted, "{refine}");
        assert_eq!(space.choices(Axis::Mesh)[space.base().on(Axis::Mesh)].name, "x1");
    }
}

#[test]
fn a_study_finds_what_holds() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("beam.toml");
    std::fs::write(&scene, BEAM).expect("written");
    let space = Space::of(&scene, &[], &[]).unwrap_or_else(|e| panic!("{e}"));
    let out = folder.path().join("out");
    let mut seconds = 15.0;
    let (mut study, did) = conduct(&space, &out, seconds);
    assert!(did[0].starts_with("reference"), "{did:?}");
    // What a budget is enough for depends on the machine and on what else it does.
    while alone(&space, &study, Axis::Mesh, "x2").is_none() && seconds < 200.0 {
        seconds *= 2.0;
        study = conduct(&space, &out, seconds).0;
    }

    // The scene's own setting comes first, then one axis at a time, each setting once.
    assert_eq!(study.measured[0].setting, space.base());
    for axis in [Axis::Law, Axis::Element, Axis::Mesh, Axis::Integrator, Axis::Step, Axis::Tolerance, Axis::Precision] {
        let only = |m: &&Measured| m.setting.differs(&space.base()) == [axis] && m.errors.is_some();
        assert!(study.measured.iter().any(|m| only(&m)), "nothing else on axis {}", axis.name());
    }
    let mut settings: Vec<_> = study.measured.iter().map(|m| m.setting).collect();
    settings.sort();
    settings.dedup();
    assert_eq!(settings.len(), study.measured.len());
    assert!(study.measured.iter().all(|m| space.allows(&m.setting)));

    // A finer mesh is more accurate and dearer, and the reference is more certain than any of them.
    let [coarse, fine] = ["x0.5", "x2"].map(|name| {
        alone(&space, &study, Axis::Mesh, name).unwrap_or_else(|| panic!("{name} was not run in {seconds} s"))
    });
    assert!(error(coarse) > 1.5 * error(fine), "{} and {}", error(coarse), error(fine));
    assert!(coarse.kernels < fine.kernels && coarse.bytes < fine.bytes);
    let uncertainty = study.reference.uncertainty().displacement;
    assert!(uncertainty > 0.0 && uncertainty < 0.5 * error(fine), "{uncertainty}, {}", error(fine));

    // The front is ordered, and what is recommended holds when it is run again, from the arguments that are printed.
    let best = front(&study.measured, Metric::Displacement);
    assert!(best.windows(2).all(|pair| pair[0].wall() <= pair[1].wall() && error(pair[0]) > error(pair[1])));
    let report = Report::new(&space, &study, budget(seconds));
    let (target, found) = report.recommended()[1];
    assert_eq!(target, 0.05);
    let found = found.expect("5 % is reached");
    let again = error(&study.run_afresh(&space, found.setting));
    assert!(
        again + uncertainty <= target && (again - error(found)).abs() <= 1e-3 * again,
        "{again} again, {} before",
        error(found)
    );
    let printed = report.arguments(found);
    let changes: Vec<&String> = printed.chunks(2).filter(|pair| pair[0] == "--set").map(|pair| &pair[1]).collect();
    let wanted = space.changes(&found.setting).unwrap_or_else(|e| panic!("{e}"));
    assert!(changes.iter().copied().eq(&wanted) && !printed.join("").contains(' '), "{printed:?}");
    space.changed(&wanted).unwrap_or_else(|e| panic!("{e}"));

    // Its files, and that it goes on where it was.
    report.write(&out).unwrap_or_else(|e| panic!("{e}"));
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(read("runs.csv").lines().count(), 1 + study.measured.len());
    let json: serde_json::Value = serde_json::from_str(&read("report.json")).expect("JSON");
    assert_eq!(json["settings"].as_array().map(Vec::len), Some(study.measured.len()));
    assert!(read("report.html").matches("<svg").count() >= 7, "diagrams");
    assert!(read("time-by-mesh.svg").starts_with("<svg"));
    let (same, did) = conduct(&space, &out, seconds);
    // Medians that have changed may want a run more, but no other setting is tried.
    assert!(did.iter().all(|text| text.starts_with("again: ")), "the same call has nothing else to do: {did:?}");
    let settings = |study: &Study| study.measured.iter().map(|m| m.setting).collect::<Vec<_>>();
    assert!(settings(&same) == settings(&study) && same.reference == study.reference && same.taken >= study.taken);
    let (more, did) = conduct(&space, &out, 1.6 * seconds);
    assert!(!did.iter().any(|text| text.starts_with("reference")), "{did:?}");
    assert!(more.measured.len() > study.measured.len() && more.reference == study.reference);
    assert!(more.taken < 1.6 * seconds, "{} s", more.taken);

    // Not the study of another scene.
    let other = Space::of(&scene, &["solver.duration=0.2".to_string()], &[]).unwrap_or_else(|e| panic!("{e}"));
    let refused = Study::conduct(&other, &out, budget(2.0), &mut Quiet::default()).expect_err("it is another");
    assert!(refused.to_string().contains("is of another scene"), "{refused}");
}

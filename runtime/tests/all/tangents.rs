//! How products with the tangent are computed: what the rule takes, what plans and summaries say of it. That results
//! depend on it in their last digits only is a test of `batches.rs`.

use crate::support::elements::unit;
use crate::support::{body, done, parameters, repository, scene};
use serde_json::Value;
use tensormass_runtime::backend::{Backend, ForceField};
use tensormass_runtime::cpu::{CpuBackend, CpuField};
use tensormass_runtime::mesh::beam_of;
use tensormass_runtime::model::build;
use tensormass_runtime::plan::{Layout, Plan};
use tensormass_runtime::tangent::{Tangent, by_rule};
use tensormass_runtime::{ElementEntry, LawEntry, elements, laws};

fn tetrahedron() -> &'static ElementEntry {
    elements().iter().find(|e| e.info.name == "tetrahedron_p1").expect("an element of every build")
}

/// The rule's choice for so many linear tetrahedra of a law, in numbers of so many bytes.
fn rule(law: &'static LawEntry, count: usize, real: usize) -> Tangent {
    let mesh = beam_of(tetrahedron(), [1.0; 3], [1; 3], [0.0; 3]).expect("a cube");
    let mut body = body(&mesh, law, &parameters(law), &[]);
    // The rule counts elements, and looks at none.
    body.batches[0].elements = vec![0; count];
    by_rule(&body, real)[0]
}

#[test]
fn laws_store_in_caches_and_where_it_saves_more_than_reading_costs() {
    for law in laws() {
        assert_eq!(rule(law, 60_000, 4), Tangent::Stored, "{}: all is in a cache", law.info.name);
        let operations = |kernel: &str| {
            let all = &law.info.operations;
            all.iter().find(|o| o.kernel == kernel).map(|o| o.arithmetic())
        };
        let dforce = operations("dforce").expect("every law has a tangent");
        let saved = tetrahedron().info.gradient_operations + dforce - operations("apply").unwrap_or(dforce);
        let wanted = if saved >= 9 * law.info.stored as u32 { Tangent::Stored } else { Tangent::Recomputed };
        assert_eq!(rule(law, 1_000_000, 4), wanted, "{}: {saved} saved by {}", law.info.name, law.info.stored);
        assert!(!law.info.structure.linear || wanted == Tangent::Stored, "{}: linear laws read nothing", law.info.name);
    }
    let chosen: Vec<Tangent> = laws().iter().map(|law| rule(law, 1_000_000, 4)).collect();
    assert!(chosen.contains(&Tangent::Stored) && chosen.contains(&Tangent::Recomputed), "{chosen:?}");
}

/// In f64 a matrix serves what has few nodes for its quadrature points: all elements but the quadratic tetrahedron.
#[test]
fn matrices_are_assembled_where_they_save() {
    for element in elements().iter().filter(|e| e.info.dimension == 3) {
        let mesh = unit(element, 8);
        let assembled = |real| {
            let choice = |law| by_rule(&body(&mesh, law, &parameters(law), &[]), real)[0];
            laws().iter().filter(|law| choice(law) == Tangent::Assembled).count()
        };
        let name = element.info.name;
        assert_eq!(assembled(4), 0, "{name}: in f32 a matrix has to be asked for");
        let (found, all) = (assembled(8), laws().len());
        assert!(if name == "tetrahedron_p2" { found < all } else { found == all }, "{name}: {found} of {all} laws");
    }
}

/// A matrix of differences: a body that is moved as a whole has no force, and none of rounding.
#[test]
fn a_matrix_knows_that_moving_costs_nothing() {
    for element in elements().iter().filter(|e| e.info.dimension == 3) {
        for law in laws() {
            let body = body(&unit(element, 2), law, &parameters(law), &[]);
            let backend = CpuBackend::<f32>::new(&body);
            let mut field = CpuField::<f32>::new(&backend, &body).with_tangents(&[Tangent::Assembled]);
            let everywhere = |x: [f64; 3]| backend.upload(&vec![x; body.masses.len()]);
            let (moved, mut force) = (everywhere([0.3, -1.7, 2.9]), backend.zeros());
            field.prepare(&backend, &backend.zeros());
            field.add_dforce(&backend, &moved, 1.0, &mut force);
            assert_eq!(backend.max_abs(&force), 0.0, "{} of {}", element.info.name, law.info.name);
        }
    }
}

/// A law's tangent, its kernels and who chose it, as a run's summary has them.
fn summary(tangent: &str, precision: &str) -> (Value, Vec<String>, Value) {
    let text = std::fs::read_to_string(repository("scenes/gravity-svk.toml")).expect("a scene of the repository");
    let set = [
        "mesh.beam.cells=[8, 4, 4]",
        &format!("solver.precision={precision}"),
        "solver.integrator=\"implicit-euler\"",
        "solver.step=0.01",
        "solver.duration=0.02",
        &format!("solver.cg.tangent={tangent}"),
    ];
    let scene = scene(&text, &set);
    let model = build(&scene).expect("the scene can be built");
    let plan = Plan::new(&scene, &model, Layout::Cpu);
    let has = |buffer: &str| plan.buffers.iter().any(|(name, _)| *name == buffer);
    let summary = done(&scene).summary;
    let law = &summary["model"]["laws"][0];
    let kernels = law["operations_per_element"].as_object().expect("kernels").keys().cloned().collect();
    if tangent != "measured" {
        for choice in ["stored", "assembled"] {
            assert_eq!(has(&format!("{choice} tangent")), law["tangent"] == choice, "{tangent}: {:?}", plan.buffers);
        }
    }
    (law["tangent"].clone(), kernels, summary["solver"]["tangents_chosen_by"].clone())
}

#[test]
fn plans_and_summaries_say_what_is_chosen() {
    let stored = ["apply", "diagonal", "force", "linearize"];
    let assembled = ["assemble", "diagonal", "force"];
    let recomputed = ["dforce", "diagonal", "force"];
    for (asked, wanted, kernels, by) in [
        (["auto", "f32"], "stored", stored.as_slice(), "rule"),
        (["auto", "f64"], "assembled", &assembled, "rule"),
        (["stored", "f64"], "stored", &stored, "scene"),
        (["assembled", "f32"], "assembled", &assembled, "scene"),
        (["recomputed", "f64"], "recomputed", &recomputed, "scene"),
    ] {
        let mut kernels: Vec<&str> = kernels.to_vec();
        kernels.sort_unstable();
        let (tangent, mut found, chosen_by) = summary(asked[0], asked[1]);
        found.sort_unstable();
        assert_eq!((tangent, chosen_by), (wanted.into(), by.into()), "{asked:?}");
        assert_eq!(found, kernels, "{asked:?}");
    }
    let (tangent, _, chosen_by) = summary("measured", "f64");
    assert!(["stored", "recomputed", "assembled"].contains(&tangent.as_str().expect("a name")), "{tangent}");
    assert_eq!(chosen_by, "measurement");
}

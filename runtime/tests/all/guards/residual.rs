//! What the last step left: true residuals against those that solvers report, and estimated errors of equilibria.

use tensormass_runtime::simulate::Outcome;

use super::{BLOCK, SAGGING, guard, warnings};
use crate::support::{done, number, scene};

/// In f64 the error of an equilibrium is estimated where the tolerance and what differs in stiffness make it doubtful: of a block of one
/// material, where it is flattened.
#[test]
fn equilibria_in_f64_are_doubted_where_stiffnesses_differ() {
    let at = |stretch: f64, tolerance: &str| {
        let set = [
            "material.0.law=neo_hookean".to_owned(),
            format!("boundary.3.move.x.ramp=[[0.0, 0.0], [1.0, {:?}]]", stretch - 1.0),
            format!("solver.newton.tolerance={tolerance}"),
            "solver.newton.max_iterations=30".to_owned(),
            "solver.step=0.1".to_owned(),
            "solver.duration=1.0".to_owned(),
            "solver.precision=f64".to_owned(),
        ];
        let outcome = done(&scene(BLOCK, &set));
        guard(&outcome, "residual").clone()
    };
    // (lambda + 2 mu) / mu is 3.5 at rest, and entries of the diagonal differ by some tens with the elements that nodes have; flattened to
    // .05, those along x are larger by 1 / .05^2.
    for (stretch, tolerance, is_doubted) in [(0.05, "1e-6", true), (0.05, "1e-10", false), (0.99, "1e-6", false)] {
        let found = at(stretch, tolerance);
        assert!(number(&found["true"]) < 10.0 * tolerance.parse::<f64>().expect("a number"), "{stretch}: {found}");
        assert_eq!(!found["estimated_error"].is_null(), is_doubted, "{stretch}, {tolerance}: {found}");
    }
}

/// Settings of [`SAGGING`] in f32 with a tolerance of the linear solver, of the beam or of one of 40:1.
fn single(tolerance: &str, long: bool, precision: &str) -> Outcome {
    let set = [
        format!("solver.cg={{ tolerance = {tolerance}, max_iterations = 100000 }}"),
        format!("mesh.beam.size=[{}, 1, 1]", if long { 40 } else { 4 }),
        format!("mesh.beam.cells=[{}, 2, 2]", if long { 80 } else { 8 }),
        format!("material.0.parameters.young={}", if long { 1e9 } else { 1e7 }),
        format!("solver.precision={precision}"),
    ];
    done(&scene(SAGGING, &set))
}

/// Conjugate gradients in f32 say that they have converged, whatever is true. On a stout beam it is; on a slender one the residual
/// in f64 is a hundred times as large, and is told. A looser tolerance is kept, f64 has no such guard.
#[test]
fn recursive_residuals_are_held_against_true_ones() {
    let words = "the last step's true residual is ";
    for (tolerance, long, warned) in [("1e-6", false, 0), ("1e-2", false, 0), ("1e-6", true, 1), ("3e-5", true, 0)] {
        let outcome = single(tolerance, long, "f32");
        let found = guard(&outcome, "residual");
        let [truth, reported, wanted] = ["true", "reported", "tolerance"].map(|key| number(&found[key]));
        assert!(reported <= wanted, "the solver believes in itself: {found}");
        assert_eq!(warnings(&outcome, words).len(), warned, "{tolerance}, {long}: {found}");
        assert_eq!(truth > 10.0 * wanted, warned > 0, "{tolerance}, {long}: {found}");
        if !long {
            // Rounding is out of sight: what is true is what is reported, but for what they are parts of.
            assert!((0.002..2.0).contains(&(truth / reported)), "{tolerance}: {found}");
        }
    }
    assert!(guard(&single("1e-6", true, "f64"), "residual").is_null());
}

/// Newton's method and equilibrium: what has converged is in balance in f64 too.
#[test]
fn converged_steps_have_small_true_residuals() {
    for (integrator, law) in
        [("implicit-euler", "hooke"), ("implicit-euler", "neo_hookean"), ("static", "hooke"), ("static", "neo_hookean")]
    {
        for damping in ["solver.stiffness_damping=0.0", "solver.stiffness_damping=0.01", "material.0.law=kelvin_voigt"]
        {
            let mut set = vec![
                "solver.precision=f32".to_owned(),
                "solver.newton.max_iterations=30".to_owned(),
                "solver.mass_damping=0.5".to_owned(),
                format!("solver.integrator={integrator}"),
                format!("material.0.law={law}"),
                damping.to_owned(),
            ];
            if damping.contains("kelvin_voigt") {
                set.push("material.0.parameters={ young = 1e7, poisson = 0.3, shear_viscosity = 1e4 }".to_owned());
            }
            for iterations in ["30", "1"] {
                set.push(format!("solver.newton.max_iterations={iterations}"));
                let outcome = done(&scene(SAGGING, &set));
                let found = guard(&outcome, "residual");
                if integrator == "static" && iterations == "1" && (law != "hooke" || damping.contains("kelvin_voigt")) {
                    // The equations of a linearised equilibrium were those of a state that is gone.
                    assert!(found.is_null(), "{set:?}: {found}");
                    continue;
                }
                assert!(number(&found["true"]) < 1e-5, "{set:?}: {found}");
                assert_eq!(warnings(&outcome, "true residual"), [""; 0], "{set:?}: {found}");
            }
        }
    }
}

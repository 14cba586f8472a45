//! The end-loaded cantilever CANTI_SMALL: deflection of the tip on the reference's own meshes.
//!
//! The reference (an independent finite-element code, linear tetrahedra, Kuhn's division) gives the deflection to ten
//! digits on the same mesh: two codes that solve one linear system agree to cond(K) eps_m = 1e6 x 1e-16 besides the
//! solver's tolerance, hence 1e-8. `tip_avg` is the mean over the tip's area, which is the work of the unit shear force;
//! the plain mean over the tip's nodes differs by 6e-8 and is not it.

use crate::support::{CANTILEVER, case, done, number, probe, relative, scene};

fn check(cells: [u32; 3]) {
    let case = case("CANTI_SMALL");
    let [nx, ny, nz] = cells;
    let wanted = number(&case["expected"]["fem"][format!("P1_Kuhn_lumped_{nx}x{ny}x{nz}")]["tip_avg"]);
    let outcome = done(&scene(CANTILEVER, &[format!("mesh.beam.cells={cells:?}")]));
    let (nodes, area) = (probe(&outcome, "nodes"), -probe(&outcome, "work"));
    let products = &outcome.summary["solver"]["tangent_products"];
    println!(
        "{cells:?}: nodes {:.2e}, area {:.2e}, {products} products",
        relative(nodes, wanted),
        relative(area, wanted)
    );
    assert!(relative(area, wanted) <= 1e-8, "{cells:?}: the tip moves {area}, wanted {wanted}");
    // The tip stays plane but for the bending of a cross-section: strain 6e-5 at the tip, over a height of 1 in 10.
    assert!(relative(nodes, wanted) <= 1e-5, "{cells:?}: the tip's nodes move {nodes}, wanted {wanted}");
    // Clapeyron: the elastic energy is half the loads' work.
    assert!(relative(2.0 * probe(&outcome, "elastic"), area) <= 1e-8, "{cells:?}");
}

#[test]
fn meshes_of_the_reference() {
    for cells in [[20, 2, 2], [40, 4, 4], [60, 6, 6]] {
        check(cells);
    }
}

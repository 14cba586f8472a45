//! Errors of every element against the size of its mesh, as CSV: what docs/convergence.md is made of.
//!
//! Manufactured solutions for a linear and a finite law, the deflection of the cantilever CANTI_SMALL, and frequencies of a
//! bar with consistent and with lumped masses, in the places of displacement and energy.

#[path = "../tests/all/support/mod.rs"]
#[allow(dead_code)] // a part of what tests share
mod support;

use support::elements::of_dimension;
use support::manufactured::solve;
use support::vibration::{Frequency, frequency};
use support::{CANTILEVER, done, probe, scene};
use tensormass_runtime::laws;

fn main() {
    let linear = laws().iter().find(|l| l.info.structure.linear).expect("a linear law");
    let finite = laws().iter().find(|l| l.info.domain.is_some() && l.info.structure.isotropic).expect("a finite law");
    println!("what,element,order,law,cells,unknowns,displacement,energy");
    for law in [linear, finite] {
        for element in of_dimension(3).chain(of_dimension(2)) {
            let cells: &[usize] = match (element.info.order, element.info.dimension) {
                (1, 3) => &[4, 8, 16],
                (1, _) => &[8, 16, 32, 64],
                (_, 3) => &[2, 4, 8],
                _ => &[4, 8, 16, 32],
            };
            for n in cells {
                let e = solve(element, law, *n);
                println!(
                    "manufactured,{},{},{},{},{},{:e},{:e}",
                    element.info.name, element.info.order, law.info.name, e.cells, e.unknowns, e.displacement, e.energy
                );
            }
        }
    }
    for element in of_dimension(3) {
        for across in [1, 2, 4, 6] {
            // The unknowns of a quadratic mesh are those of a linear one of twice the cells.
            if element.info.order > 1 && across > 4 {
                continue;
            }
            let set = [
                format!("mesh.beam.cells=[{}, {across}, {across}]", 10 * across),
                format!("mesh.beam.element=\"{}\"", element.info.name),
            ];
            let outcome = done(&scene(CANTILEVER, &set));
            let unknowns = outcome.summary["nodes"].as_u64().expect("a count") * 3;
            let tip = -probe(&outcome, "work");
            println!("cantilever,{},{},hooke,{across},{unknowns},{tip:e},0", element.info.name, element.info.order);
        }
    }
    for element in of_dimension(3).chain(of_dimension(2)) {
        for cells in [2, 4, 8] {
            let Frequency { unknowns, consistent, lumped } = frequency(element, cells);
            let (name, order) = (element.info.name, element.info.order);
            println!("frequency,{name},{order},hooke,{cells},{unknowns},{:e},{:e}", consistent - 1.0, lumped - 1.0);
        }
    }
}

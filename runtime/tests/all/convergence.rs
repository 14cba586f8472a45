//! Orders of convergence by manufactured solutions: displacement p + 1, energy 2 p, for a linear and for finite laws.

use crate::support::elements::of_dimension;
use crate::support::manufactured::{orders, solve};
use tensormass_runtime::laws;

/// How far an order measured on meshes this coarse may be below that of the limit.
const SHORT: f64 = 0.1;

#[test]
fn orders_of_every_element() {
    // The linear law, and the first that is not and has a domain.
    let linear = laws().iter().find(|l| l.info.structure.linear).expect("a linear law");
    let finite = laws().iter().find(|l| l.info.domain.is_some() && l.info.structure.isotropic).expect("a finite law");
    for element in of_dimension(3).chain(of_dimension(2)) {
        let p = f64::from(element.info.order);
        let cells = match (element.info.order, element.info.dimension) {
            (1, 3) => [6, 12],
            (1, _) => [8, 16],
            (_, 3) => [3, 6],
            _ => [5, 10],
        };
        for law in [linear, finite] {
            let [coarse, fine] = cells.map(|n| solve(element, law, n));
            let [displacement, energy] = orders(&coarse, &fine);
            let name = format!("{} of {}", element.info.name, law.info.name);
            println!("{name}: displacement {displacement:.2}, energy {energy:.2}: {fine:?}");
            assert!(displacement > p + 1.0 - SHORT, "{name}: order {displacement:.2} of the displacement");
            assert!(energy > 2.0 * p - SHORT, "{name}: order {energy:.2} of the energy");
        }
    }
}

//! Laws with fibre directions: what directions must and must not change, and that every switch is tested on both sides.

use tensormass_kernels::{LawEntry, laws};
use tensormass_testing::point::Point;
use tensormass_testing::random::Rng;
use tensormass_testing::tensor::exact;

const GENERATED: &str = env!("TENSORMASS_GENERATED");
const STATES: u64 = 40;
const STRETCHES: (f64, f64) = (0.5, 2.0);

/// W, P and dP of a law at random states of random materials, and of the same materials with each direction changed: at
/// how many states any of them differs.
fn check(law: &'static LawEntry, change: impl Fn([f64; 3]) -> [f64; 3]) -> usize {
    let differ = |seed: &u64| {
        let mut rng = Rng::new(*seed);
        let parameters = rng.parameters(law.info);
        let (mut changed, mut first) = (parameters.clone(), 0);
        for p in law.info.parameters {
            if p.direction {
                let a = change([0, 1, 2].map(|k| parameters[first + k]));
                changed[first..first + 3].copy_from_slice(&a);
            }
            first += p.len;
        }
        let points = [parameters, changed].map(|parameters| Point::new(GENERATED, law, parameters));
        let (g, d) = (points[0].state(&mut rng, STRETCHES), rng.direction());
        let [own, other] = points.map(|p| (p.double.energy(&g).0, p.double.force(&g).0, p.double.dforce(&g, &d)));
        own != other
    };
    (0..STATES).filter(differ).count()
}

#[test]
fn laws_with_directions_use_fibres() {
    let mut with = 0;
    for law in laws() {
        let (structure, name) = (law.info.structure, law.info.name);
        let directions = law.info.parameters.iter().filter(|p| p.direction);
        assert_eq!(directions.clone().count() > 0, structure.uses_fibres, "{name}");
        assert_eq!(structure.isotropic, !structure.uses_fibres, "{name}");
        for p in directions {
            assert_eq!((p.len, p.dimensions, p.range), (3, [0; 3], (-1.0, 1.0)), "{name}, {}", p.name);
        }
        with += usize::from(structure.uses_fibres);
    }
    assert!(with > 0, "no law of this build has fibres");
}

/// A fibre has no head and no tail: every product of two components stays as it is, to the last bit.
#[test]
fn directions_have_no_sense() {
    for law in laws() {
        assert_eq!(check(law, |a| a.map(|x| -x)), 0, "{}", law.info.name);
    }
}

/// Other directions are another material. Where no fibre is in tension they may make no difference.
#[test]
fn directions_matter() {
    for law in laws() {
        let differ = check(law, |[x, y, z]| [y, z, x]);
        assert_eq!(differ > 0, law.info.structure.uses_fibres, "{}: {differ} states differ", law.info.name);
    }
}

/// `tests/oracle.rs` and `tests/derivatives.rs` take such states: on both sides of each law's selections, such as that of
/// fibres in tension from those in compression.
#[test]
fn states_lie_on_both_sides_of_selections() {
    let mut laws_with_selections = 0;
    for law in laws() {
        let name = law.info.name;
        let mut above: Vec<u64> = Vec::new();
        for seed in 0..STATES {
            let mut rng = Rng::new(seed);
            let point = Point::new(GENERATED, law, rng.parameters(law.info));
            let branches = point.branches(&exact(&point.state(&mut rng, STRETCHES)));
            above.resize(branches.len(), 0);
            above.iter_mut().zip(branches).for_each(|(count, branch)| *count += u64::from(branch));
        }
        // Those that the law's author wrote, not those of principal axes.
        if !["pos(", "select("].iter().any(|call| law.source.law.contains(call)) || above.is_empty() {
            continue;
        }
        laws_with_selections += 1;
        let tenth = STATES / 10;
        assert!(above.iter().all(|n| (tenth..=STATES - tenth).contains(n)), "{name}: {above:?} of {STATES}");
    }
    assert!(laws_with_selections > 0, "no law of this build has selections");
}

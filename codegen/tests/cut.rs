//! Kernels in two parts: they are the whole bit for bit, and no other choice of what is stored costs less.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Builder, Input, Op, Output, ValidKernel, ValueId};

/// A repeatable sequence (Knuth's linear congruential generator).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % n
    }

    fn number(&mut self) -> f64 {
        self.below(1 << 20) as f64 / f64::from(1 << 20) - 0.5
    }
}

const PRICES: [u64; 6] = [1, 2, 3, 5, 9, 1000];

/// The outputs of the parts, one after the other, for a state and an increment.
fn in_parts(kernel: &ValidKernel, price: u64, inputs: &[(Input, Vec<f64>)]) -> Vec<Vec<f64>> {
    let cut = kernel.cut(Input::GradientIncrement, price);
    let all: Vec<(Input, &[f64])> = inputs.iter().map(|(role, values)| (*role, values.as_slice())).collect();
    let of = |k: &ValidKernel, given: &[(Input, &[f64])]| k.interpret(given).unwrap_or_else(|e| panic!("{e}"));
    let state = cut.linearize.as_ref().map(|k| of(k, &all).remove(0));
    assert_eq!(state.as_ref().map_or(0, Vec::len), cut.stored());
    assert!(!cut.apply.reads(Input::DisplacementGradient), "the second part reads the state itself");
    let stored = state.as_ref().map(|s| (Input::State, s.as_slice()));
    of(&cut.apply, &all.iter().copied().chain(stored).collect::<Vec<_>>())
}

#[test]
fn the_parts_of_every_law_are_the_whole() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../laws/derived");
    let mut laws = 0;
    for entry in std::fs::read_dir(folder).expect("the committed derivations") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|e| e != "ir") {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("a derivation");
        let derivation = Derivation::from_text(&text).expect("a derivation");
        let whole = derivation.point("dforce").near;
        let mut random = Random(laws);
        let mut inputs: Vec<(Input, Vec<f64>)> = vec![];
        for &(role, len) in &whole.ir().inputs {
            inputs
                .push((role, (0..len).map(|_| 0.2 * random.number() + f64::from(role == Input::Constants)).collect()));
        }
        let given: Vec<(Input, &[f64])> = inputs.iter().map(|(role, values)| (*role, values.as_slice())).collect();
        let wanted = whole.interpret(&given).expect("all inputs");
        let mut before = (usize::MAX, 0);
        for price in PRICES {
            let found = in_parts(whole, price, &inputs);
            let same = wanted.iter().flatten().zip(found.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(same, "{} at {price}: {wanted:?} {found:?}", derivation.law);
            // The dearer storage, the less of it, and the more is computed again.
            let cut = whole.cut(Input::GradientIncrement, price);
            let here = (cut.stored(), cut.apply.count().arithmetic() as usize);
            assert!(here.0 <= before.0 && here.1 >= before.1, "{} at {price}: {before:?} {here:?}", derivation.law);
            before = here;
        }
        // Storing G, nine numbers, is always a choice.
        assert!(before.0 <= 9, "{}: {} numbers at any price", derivation.law, before.0);
        laws += 1;
    }
    assert!(laws > 5, "only {laws} derivations");
}

/// A random kernel of sums and products: of two state inputs, of values of theirs, and of some of these with an increment.
fn random_kernel(random: &mut Random) -> ValidKernel {
    let mut b = Builder::new();
    let mut state: Vec<ValueId> = (0..3).map(|k| b.input(Input::DisplacementGradient, k)).collect();
    for _ in 0..7 {
        let [x, y] = [(); 2].map(|()| state[random.below(state.len())]);
        state.push(if random.below(2) == 0 { b.add(x, y) } else { b.mul(x, y) });
    }
    let mut result = b.input(Input::GradientIncrement, 0);
    for _ in 0..3 {
        let x = state[random.below(state.len())];
        result = if random.below(2) == 0 { b.add(result, x) } else { b.mul(result, x) };
    }
    let inputs = vec![(Input::DisplacementGradient, 9), (Input::GradientIncrement, 9)];
    b.finish("k", inputs, vec![(Output::EnergyDensity, vec![result])]).validate().expect("a kernel")
}

/// The least cost of any choice of what is computed again.
fn least_cost(kernel: &ValidKernel, price: u64) -> u64 {
    let values = &kernel.ir().values;
    let mut varies = vec![false; values.len()];
    for (i, d) in values.iter().enumerate() {
        varies[i] =
            matches!(d.op, Op::Input(Input::GradientIncrement, _)) || d.op.operands().iter().any(|v| varies[v.index()]);
    }
    let computed: Vec<usize> =
        (0..values.len()).filter(|i| !varies[*i] && !values[*i].op.operands().is_empty()).collect();
    let cost = |choice: usize| {
        let again = |i: usize| computed.iter().position(|c| *c == i).is_some_and(|k| choice >> k & 1 == 1);
        let readers = (0..values.len()).filter(|i| varies[*i] || again(*i));
        let mut needed: Vec<usize> = readers.flat_map(|i| values[i].op.operands()).map(ValueId::index).collect();
        needed.retain(|v| !varies[*v] && !again(*v));
        needed.sort_unstable();
        needed.dedup();
        u64::from(choice.count_ones()) + price * needed.len() as u64
    };
    (0..1 << computed.len()).map(cost).min().expect("a choice")
}

#[test]
fn no_other_choice_costs_less() {
    let mut random = Random(7);
    let mut stored = std::collections::BTreeSet::new();
    for case in 0..300 {
        let kernel = random_kernel(&mut random);
        for price in PRICES {
            let cut = kernel.cut(Input::GradientIncrement, price);
            let of_increment = kernel.cut(Input::GradientIncrement, 0).apply.count().arithmetic();
            let again = u64::from(cut.apply.count().arithmetic() - of_increment);
            let cost = again + price * cut.stored() as u64;
            assert_eq!(cost, least_cost(&kernel, price), "case {case} at {price}: {:?}", kernel.ir());
            stored.insert(cut.stored());
        }
    }
    assert!(stored.len() > 2, "the cases are all alike: {stored:?}");
}

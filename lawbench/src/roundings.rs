//! Where digits go: how much the rounding of each operation of a kernel moves its result, to first order.
//!
//! With v the value of an operation and R the result, an operation that rounds v by a part u of it moves R by at most
//! u |v| |dR/dv|. The derivatives dR/dv are collected backwards through the kernel, in f64.

use tensormass_codegen::ir::{Input, InterpretError, Op, ValidKernel, ValueId};

/// The rounding of one operation.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounding {
    /// Its value in the kernel.
    pub value: ValueId,
    /// What is computed, as the derivation names it, or the operation.
    pub what: String,
    /// |v| |dR/dv|: what the result moves by for one unit round-off, divided by it.
    pub weight: f64,
}

/// What all roundings of one unit round-off each come to where they are independent and uniform in [-1, 1]: a root mean
/// square, in units of the round-off.
pub fn expected(roundings: &[Rounding]) -> f64 {
    (roundings.iter().map(|r| r.weight.powi(2)).sum::<f64>() / 3.0).sqrt()
}

/// The roundings of a kernel at these inputs into its first output array, the weightiest first.
///
/// # Errors
/// An input array is missing or has the wrong length.
pub fn roundings(kernel: &ValidKernel, inputs: &[(Input, &[f64])]) -> Result<Vec<Rounding>, InterpretError> {
    let ir = kernel.ir();
    let values = kernel.values(inputs)?;
    let outputs = &ir.outputs[0].1;
    // By value, then by component of the result.
    let mut slopes = vec![vec![0.0; outputs.len()]; values.len()];
    for (k, id) in outputs.iter().enumerate() {
        slopes[id.index()][k] += 1.0;
    }
    for (i, definition) in ir.values.iter().enumerate().rev() {
        let slope = slopes[i].clone();
        for (operand, partial) in partials(&definition.op, &values, values[i]) {
            slopes[operand.index()].iter_mut().zip(&slope).for_each(|(to, s)| *to += partial * s);
        }
    }
    let weight = |i: usize| values[i].abs() * slopes[i].iter().map(|s| s * s).sum::<f64>().sqrt();
    let mut all: Vec<Rounding> = (0..values.len())
        .filter(|&i| rounds(&ir.values[i].op))
        .map(|i| {
            let what = ir.values[i].name.clone().unwrap_or_else(|| format!("{:?}", ir.values[i].op));
            Rounding { value: ValueId(i as u32), what, weight: weight(i) }
        })
        .collect();
    all.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    Ok(all)
}

/// Whether a value is rounded: constants of the material are, once; G and whole numbers are exact.
fn rounds(op: &Op) -> bool {
    match op {
        Op::Input(role, _) => *role == Input::Constants,
        Op::Const(q) => !q.is_integer() && !q.denom().unsigned_abs().is_power_of_two(),
        Op::Neg(_) | Op::Select(..) => false,
        _ => true,
    }
}

/// The partial derivatives of an operation with value `v` by its operands.
fn partials(op: &Op, values: &[f64], v: f64) -> Vec<(ValueId, f64)> {
    let x = |id: ValueId| values[id.index()];
    match *op {
        Op::Input(..) | Op::Const(_) => vec![],
        Op::Add(a, b) => vec![(a, 1.0), (b, 1.0)],
        Op::Sub(a, b) => vec![(a, 1.0), (b, -1.0)],
        Op::Mul(a, b) => vec![(a, x(b)), (b, x(a))],
        Op::Div(a, b) => vec![(a, 1.0 / x(b)), (b, -v / x(b))],
        Op::Neg(a) => vec![(a, -1.0)],
        Op::Fma(a, b, c) => vec![(a, x(b)), (b, x(a)), (c, 1.0)],
        Op::Sqrt(a) => vec![(a, 0.5 / v)],
        Op::Ln(a) => vec![(a, 1.0 / x(a))],
        Op::Exp(a) => vec![(a, v)],
        Op::Log1p(a) => vec![(a, 1.0 / (1.0 + x(a)))],
        Op::Expm1(a) => vec![(a, 1.0 + v)],
        Op::Log1pmx(a) => vec![(a, x(a) / (1.0 + x(a)))],
        Op::Expm1mx(a) => vec![(a, x(a).exp_m1())],
        Op::Powf(a, b) => vec![(a, x(b) * v / x(a)), (b, v * x(a).ln())],
        Op::Select(l, r, a, b) => vec![(if x(l) > x(r) { a } else { b }, 1.0)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::textbook;
    use crate::gate::{Machine, Quantity, Reference};
    use crate::material::Material;
    use crate::number::Exact;
    use crate::states::Random;
    use crate::subject::Subject;
    use tensormass_codegen::ir::{Builder, Number, Output};

    /// (a + b) c with c = 1/3 a constant of the law: weights by hand.
    #[test]
    fn weights_of_a_small_kernel() {
        let mut b = Builder::new();
        let [x, y] = [0, 1].map(|k| b.input(Input::DisplacementGradient, k));
        let sum = b.add(x, y);
        let third = b.number(tensormass_codegen::ir::Rational::new(1, 3));
        let product = b.mul(third, sum);
        let kernel =
            b.finish("energy", vec![(Input::DisplacementGradient, 9)], vec![(Output::EnergyDensity, vec![product])]);
        let kernel = kernel.validate().expect("a kernel");
        let mut g = [0.0; 9];
        (g[0], g[1]) = (4.0, -1.0);
        let found = roundings(&kernel, &[(Input::DisplacementGradient, &g)]).expect("its input");
        // 3 by 1/3: the sum, the constant and the product each move the result by 1.
        assert_eq!(found.iter().map(|r| r.weight).collect::<Vec<_>>(), [1.0; 3]);
        assert_eq!(expected(&found), 1.0);
    }

    /// The stress in f32 is off by no more than all its roundings together, and on average by about what is expected.
    #[test]
    fn errors_are_what_roundings_add_up_to() {
        let u = f64::from(f32::EPSILON) / 2.0;
        for entry in tensormass_kernels::laws() {
            let subject = Subject::of_build(entry);
            let derivation = &subject.derivation;
            // Principal axes are found by rotations whose own derivatives are left out of no bound but mean nothing.
            let force = derivation.kernel("force");
            if force.ir().values.len() > 1000 {
                continue;
            }
            let material = Material::usual(&subject).expect("a material");
            let double = material.constants(derivation);
            let single: Vec<f32> = double.iter().map(|c| *c as f32).collect();
            // Constants that cancel at rest do so exactly: their roundings are among those that count.
            let exact = material.exact_constants(derivation);
            let mut squares = vec![];
            for k in 0..24 {
                let g = Random::new(&[5, k]).gradient(0.1, 0.1, 0).map(|x| x as f32);
                let g64 = g.map(f64::from);
                let inputs = [(Input::Constants, &double[..]), (Input::DisplacementGradient, &g64[..])];
                let all = roundings(force, &inputs).expect("its inputs");
                let inputs = [(Input::Constants, &single[..]), (Input::DisplacementGradient, &g[..])];
                let computed = force.interpret(&inputs).expect("its inputs").remove(0);
                let g = g64.map(Exact::from);
                let inputs = [(Input::Constants, &exact[..]), (Input::DisplacementGradient, &g[..])];
                let wanted = textbook(derivation, "force", &inputs).value;
                let off: Vec<Exact> =
                    computed.iter().zip(&wanted).map(|(c, w)| Exact::from(f64::from(*c)).sub(w)).collect();
                let off = Exact::norm(&off).to_f64() / u;
                // To first order; functions of the host may be off by two units.
                let most = 2.0 * all.iter().map(|r| r.weight).sum::<f64>();
                assert!(off <= most, "{}: {off} of {most}", entry.info.name);
                squares.push((off / expected(&all)).powi(2));
            }
            // Roundings are less than a unit, by 1/sqrt(2) on average over the digits; functions may be off by two.
            let mean = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
            assert!((0.4..1.2).contains(&mean), "{}: {mean} of what is expected", entry.info.name);
        }
    }

    /// Near rest a tangent's parts cancel most: the more, the steeper the energy is in J. Tangents that are steep are split
    /// there, to what the others spend at the most, which is two thirds of the gate.
    #[test]
    fn tangents_near_rest_spend_little_of_the_gate() {
        for entry in tensormass_kernels::laws() {
            let subject = Subject::of_build(entry);
            let derivation = &subject.derivation;
            let point = derivation.point("dforce");
            let dforce = point.near;
            let (mut spent, mut unsplit) = (0.0_f64, 0.0_f64);
            // Principal axes are found by rotations whose own derivatives mean nothing.
            if dforce.ir().values.len() > 1000 {
                continue;
            }
            for material in Material::all(&subject).expect("materials") {
                let (exact, constants) = (material.exact_constants(derivation), material.constants(derivation));
                let zero = [0.0; 9].map(Exact::from);
                let rest = [(Input::Constants, &exact[..]), (Input::DisplacementGradient, &zero[..])];
                let rest = textbook(derivation, "energy", &rest).value.remove(0);
                for k in 0..6 {
                    let mut random = Random::new(&[7, k as u64]);
                    let (g, d) = (random.gradient(1e-3, 0.0, k), random.direction());
                    let Some(reference) = Reference::new(derivation, &exact, &rest, &g, &d) else { continue };
                    let bound = reference.bound(Machine::F64, Quantity::DP).to_f64() / Machine::F64.round_off();
                    let inputs = [
                        (Input::Constants, &constants[..]),
                        (Input::DisplacementGradient, &g[..]),
                        (Input::GradientIncrement, &d[..]),
                    ];
                    let part = |kernel| expected(&roundings(kernel, &inputs).expect("its inputs")) / bound;
                    spent = spent.max(part(dforce));
                    unsplit = unsplit.max(point.far.map_or(0.0, part));
                }
            }
            let name = entry.info.name;
            println!("{name}: {spent:.2} of the gate, {unsplit:.2} unsplit");
            assert!(spent <= 2.0 / 3.0, "{name}: {spent:.2} of the gate");
            assert!(
                point.far.is_none() || spent < 0.8 * unsplit,
                "{name}: {spent:.2} of the gate, {unsplit:.2} unsplit"
            );
        }
    }
}

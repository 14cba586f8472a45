//! States at which a selection of the law is not decided by the input: there the tangent has no one value.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Input, Number, Op, Output, ValidKernel};

use crate::lanes::tangent;
use crate::number::Exact;

/// The relative distance, in units of the rounding of G's components, within which a comparison is not decided: what
/// the evaluation of a comparison may add to the rounding of its input.
const ROUNDINGS: f64 = 16.0;

/// The selections of a law.
#[derive(Debug)]
pub struct Selections<'a> {
    derivation: &'a Derivation,
    /// From G to the left and right sides of the comparisons; none where the law has no selection.
    comparisons: Option<ValidKernel>,
}

impl<'a> Selections<'a> {
    /// Of the law with this derivation.
    ///
    /// # Panics
    /// Never: its kernels are valid.
    pub fn new(derivation: &'a Derivation) -> Self {
        let mut kernel = derivation.point("force").textbook().ir().clone();
        let sides = kernel.values.iter().filter_map(|d| match d.op {
            Op::Select(left, right, _, _) => Some((left, right)),
            _ => None,
        });
        let (left, right): (Vec<_>, Vec<_>) = sides.unzip();
        let some = !left.is_empty();
        // Roles of any length.
        kernel.outputs.extend([(Output::NodalForce, left), (Output::NodeGradients, right)]);
        let comparisons = some.then(|| kernel.validate().expect("the values of a valid kernel"));
        Self { derivation, comparisons }
    }

    /// Whether there are any.
    pub fn exist(&self) -> bool {
        self.comparisons.is_some()
    }

    /// For each precision, whether G with components rounded to it does not tell on which side of a comparison's change it lies,
    /// and the tangents of the two sides are not the same. `here` is the tangent at G.
    ///
    /// # Panics
    /// The constants are not those of the law.
    pub fn are_undecided<const N: usize>(
        &self,
        constants: &[Exact],
        gradient: &[Exact; 9],
        here: &[[Exact; 9]; 9],
        epsilons: [f64; N],
    ) -> [bool; N] {
        let Some(comparisons) = &self.comparisons else { return [false; N] };
        let differences = |g: &[Exact; 9]| -> Vec<Exact> {
            let inputs = [(Input::Constants, constants), (Input::DisplacementGradient, &g[..])];
            let all = comparisons.interpret(&inputs).expect("the inputs of a force");
            let [.., left, right] = all.as_slice() else { unreachable!("two outputs were added") };
            left.iter().zip(right).map(|(l, r)| l.sub(r)).collect()
        };
        let at = differences(gradient);
        // One-sided differences, with an error of a part in 1e40 of the next derivative.
        let step = Exact::power_of_ten(-40);
        let moved: [Vec<Exact>; 9] = std::array::from_fn(|k| {
            let mut g = gradient.clone();
            g[k] = g[k].add(&step);
            differences(&g)
        });
        let slope = |s: usize| -> [Exact; 9] { std::array::from_fn(|k| moved[k][s].sub(&at[s]).div(&step)) };
        let size = Exact::norm(&gradient[..]);
        epsilons.map(|epsilon| {
            let reach = size.mul(&Exact::from(ROUNDINGS * epsilon));
            (0..at.len()).any(|s| {
                let slope = slope(s);
                let steepness = Exact::norm(&slope[..]);
                // Beyond the change on either side: one of the two is the other side.
                reach.mul(&steepness).greater(&at[s].abs())
                    && self.jumps(constants, gradient, here, &slope.map(|x| x.mul(&reach).div(&steepness)))
            })
        })
    }

    /// Whether the tangents at G plus and minus twice a distance are not alike.
    fn jumps(&self, constants: &[Exact], gradient: &[Exact; 9], here: &[[Exact; 9]; 9], distance: &[Exact; 9]) -> bool {
        let change = |sign: f64| {
            let g = std::array::from_fn(|k| distance[k].fma(&Exact::from(2.0 * sign), &gradient[k]));
            let there = tangent(self.derivation, constants, &g);
            let change = there.as_flattened().iter().zip(here.as_flattened()).map(|(a, b)| a.sub(b));
            Exact::norm(&change.collect::<Vec<_>>())
        };
        // A smooth tangent changes as much on the one side as on the other, to first order; a jump is on one side.
        let (up, down) = (change(1.0), change(-1.0));
        let most = if up.greater(&down) { &up } else { &down };
        up.sub(&down).abs().greater(&most.mul(&Exact::from(0.25)))
    }
}

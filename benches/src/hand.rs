//! Two laws as a person writes them from the textbook, with tensors and loops: generated kernels of the same laws stand
//! beside them, on the same elements and registers.
//!
//! Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed., eqs. 6.16 and 6.27 f. Near rest they
//! lose the digits that textbook forms lose.

use std::marker::PhantomData;

use tensormass_kernels::point::Material;
use tensormass_kernels::{Law, LawEntry, LawInfo, Real};

type Tensor<R> = [R; 9];

/// A law by its stress, the stress's differential, and what a person stores of a state between products.
pub trait Hand: Send + Sync + 'static {
    /// Its name among generated laws.
    const NAME: &'static str;
    /// Numbers of [`Hand::State`].
    const STORED: usize;
    /// What is stored.
    type State<R: Real>: AsRef<[R]> + AsMut<[R]> + Copy;
    /// Room for it.
    fn zeros<R: Real>() -> Self::State<R>;
    /// P(F).
    fn stress<R: Real>(lame: [R; 2], f: &Tensor<R>) -> Tensor<R>;
    /// What is stored of F.
    fn state<R: Real>(lame: [R; 2], f: &Tensor<R>) -> Self::State<R>;
    /// dP.
    fn differential<R: Real>(lame: [R; 2], state: &Self::State<R>, df: &Tensor<R>) -> Tensor<R>;
}

/// P = F S, S = lambda tr(E) I + 2 mu E, E = (F'F - I) / 2.
pub struct StVenantKirchhoff;

impl Hand for StVenantKirchhoff {
    const NAME: &'static str = "st_venant_kirchhoff";
    const STORED: usize = 18;
    type State<R: Real> = [R; 18];

    fn zeros<R: Real>() -> [R; 18] {
        [R::from_f64(0.0); 18]
    }

    #[inline(always)]
    fn stress<R: Real>(lame: [R; 2], f: &Tensor<R>) -> Tensor<R> {
        product(f, &second_stress(lame, f))
    }

    #[inline(always)]
    fn state<R: Real>(lame: [R; 2], f: &Tensor<R>) -> [R; 18] {
        let (mut state, stress) = (Self::zeros(), second_stress(lame, f));
        state[..9].copy_from_slice(f);
        state[9..].copy_from_slice(&stress);
        state
    }

    #[inline(always)]
    fn differential<R: Real>(lame: [R; 2], state: &[R; 18], df: &Tensor<R>) -> Tensor<R> {
        let (mut f, mut stress) = (zero(), zero());
        f.copy_from_slice(&state[..9]);
        stress.copy_from_slice(&state[9..]);
        // 2 dE = F' dF + its transpose.
        let half = product(&transposed(&f), df);
        let strain = scaled(R::from_f64(0.5), &sum(&half, &transposed(&half)));
        sum(&product(df, &stress), &product(&f, &isotropic(lame, &strain)))
    }
}

#[inline(always)]
fn second_stress<R: Real>([lambda, mu]: [R; 2], f: &Tensor<R>) -> Tensor<R> {
    let twice = sum(&product(&transposed(f), f), &scaled(R::from_f64(-1.0), &identity()));
    isotropic([lambda, mu], &scaled(R::from_f64(0.5), &twice))
}

/// lambda tr(E) I + 2 mu E.
#[inline(always)]
fn isotropic<R: Real>([lambda, mu]: [R; 2], strain: &Tensor<R>) -> Tensor<R> {
    sum(&scaled(lambda * trace(strain), &identity()), &scaled(mu + mu, strain))
}

/// P = mu (F - F^-T) + lambda ln(J) F^-T.
pub struct NeoHookean;

impl Hand for NeoHookean {
    const NAME: &'static str = "neo_hookean";
    const STORED: usize = 10;
    type State<R: Real> = [R; 10];

    fn zeros<R: Real>() -> [R; 10] {
        [R::from_f64(0.0); 10]
    }

    #[inline(always)]
    fn stress<R: Real>([lambda, mu]: [R; 2], f: &Tensor<R>) -> Tensor<R> {
        let (inverse, j) = inverse_transposed(f);
        sum(&scaled(mu, f), &scaled(lambda * j.ln() - mu, &inverse))
    }

    #[inline(always)]
    fn state<R: Real>([lambda, mu]: [R; 2], f: &Tensor<R>) -> [R; 10] {
        let (inverse, j) = inverse_transposed(f);
        let mut state = Self::zeros();
        state[..9].copy_from_slice(&inverse);
        state[9] = mu - lambda * j.ln();
        state
    }

    #[inline(always)]
    fn differential<R: Real>([lambda, mu]: [R; 2], state: &[R; 10], df: &Tensor<R>) -> Tensor<R> {
        let mut inverse = zero();
        inverse.copy_from_slice(&state[..9]);
        // d(F^-T) = -F^-T dF' F^-T.
        let turned = product(&product(&inverse, &transposed(df)), &inverse);
        let volume = scaled(lambda * contracted(&inverse, df), &inverse);
        sum(&scaled(mu, df), &sum(&scaled(state[9], &turned), &volume))
    }
}

fn zero<R: Real>() -> Tensor<R> {
    [R::from_f64(0.0); 9]
}

#[inline(always)]
fn identity<R: Real>() -> Tensor<R> {
    let mut identity = zero();
    for i in 0..3 {
        identity[4 * i] = R::from_f64(1.0);
    }
    identity
}

#[inline(always)]
fn sum<R: Real>(a: &Tensor<R>, b: &Tensor<R>) -> Tensor<R> {
    let mut sum = *a;
    for k in 0..9 {
        sum[k] = a[k] + b[k];
    }
    sum
}

#[inline(always)]
fn scaled<R: Real>(factor: R, a: &Tensor<R>) -> Tensor<R> {
    let mut scaled = *a;
    for k in 0..9 {
        scaled[k] = factor * a[k];
    }
    scaled
}

#[inline(always)]
fn transposed<R: Real>(a: &Tensor<R>) -> Tensor<R> {
    let mut transposed = *a;
    for i in 0..3 {
        for j in 0..3 {
            transposed[3 * i + j] = a[3 * j + i];
        }
    }
    transposed
}

#[inline(always)]
fn product<R: Real>(a: &Tensor<R>, b: &Tensor<R>) -> Tensor<R> {
    let mut product = *a;
    for i in 0..3 {
        for j in 0..3 {
            let first = a[3 * i + 1].multiply_add(b[3 + j], a[3 * i] * b[j]);
            product[3 * i + j] = a[3 * i + 2].multiply_add(b[6 + j], first);
        }
    }
    product
}

#[inline(always)]
fn trace<R: Real>(a: &Tensor<R>) -> R {
    a[0] + a[4] + a[8]
}

/// A : B.
#[inline(always)]
fn contracted<R: Real>(a: &Tensor<R>, b: &Tensor<R>) -> R {
    let mut sum = a[0] * b[0];
    for k in 1..9 {
        sum = a[k].multiply_add(b[k], sum);
    }
    sum
}

/// F^-T and J.
#[inline(always)]
fn inverse_transposed<R: Real>(f: &Tensor<R>) -> (Tensor<R>, R) {
    let mut cofactors = *f;
    for i in 0..3 {
        for j in 0..3 {
            let [a, b] = [(i + 1) % 3, (i + 2) % 3];
            let [c, d] = [(j + 1) % 3, (j + 2) % 3];
            cofactors[3 * i + j] = f[3 * a + c] * f[3 * b + d] - f[3 * a + d] * f[3 * b + c];
        }
    }
    let j = f[0] * cofactors[0] + f[1] * cofactors[1] + f[2] * cofactors[2];
    (scaled(R::from_f64(1.0) / j, &cofactors), j)
}

/// A law by hand as the kernels meet laws. Its constants are lambda and mu.
struct ByHand<H>(PhantomData<fn() -> H>);

fn lame<R: Real>(constants: &[R]) -> [R; 2] {
    [constants[0], constants[1]]
}

#[inline(always)]
fn deformation<R: Real>(g: &Tensor<R>) -> Tensor<R> {
    sum(g, &identity())
}

impl<H: Hand> Law for ByHand<H> {
    type State<R: Real> = H::State<R>;

    fn info() -> &'static LawInfo {
        generated(H::NAME).info
    }

    fn material(_: &[f64], _: &mut [f64]) {
        unreachable!("bodies by hand are given lambda and mu");
    }

    fn energy<R: Real>(_: &[R], _: &Tensor<R>) -> (R, R) {
        unreachable!("it is not measured");
    }

    #[inline(always)]
    fn force<R: Real>(constants: &[R], g: &Tensor<R>) -> (Tensor<R>, R) {
        (H::stress(lame(constants), &deformation(g)), R::from_f64(1.0))
    }

    #[inline(always)]
    fn dforce<R: Real>(constants: &[R], g: &Tensor<R>, dg: &Tensor<R>) -> Tensor<R> {
        H::differential(lame(constants), &H::state(lame(constants), &deformation(g)), dg)
    }

    #[inline(always)]
    fn state<R: Real>() -> H::State<R> {
        H::zeros()
    }

    #[inline(always)]
    fn linearize<R: Real>(constants: &[R], g: &Tensor<R>) -> H::State<R> {
        H::state(lame(constants), &deformation(g))
    }

    #[inline(always)]
    fn apply<R: Real>(constants: &[R], state: &H::State<R>, dg: &Tensor<R>) -> Tensor<R> {
        H::differential(lame(constants), state, dg)
    }

    fn diagonal<R: Real>(_: &[R], _: &Tensor<R>, _: &[R; 3]) -> [R; 3] {
        unreachable!("it is not measured");
    }

    fn cauchy<R: Real>(_: &[R], _: &Tensor<R>) -> Tensor<R> {
        unreachable!("it is not measured");
    }
}

/// The generated law of a name.
fn generated(name: &str) -> &'static LawEntry {
    tensormass_kernels::law(name).expect("a law of this build")
}

/// A law by hand, with the generated one that it stands beside.
pub fn by_hand<H: Hand>() -> (&'static LawEntry, &'static LawEntry) {
    let generated = generated(H::NAME);
    let info = LawInfo { stored: H::STORED, constants: &["lambda", "mu"], ..generated.info.clone() };
    let info = Box::leak(Box::new(info));
    (Box::leak(Box::new(LawEntry::new::<ByHand<H>>(info, generated.source, generated.functions))), generated)
}

/// lambda and mu of an isotropic law with these constants: what its stress changes by at rest, stretched along x.
pub fn moduli(law: &LawEntry, constants: &[f64]) -> [f64; 2] {
    let material = Material { constants, stride: 0, count: constants.len(), points: 1 };
    let (mut stretch, mut stress) = ([0.0; 9], [[0.0; 9]]);
    stretch[0] = 1.0;
    (law.points::<f64>().dforce)(&material, &[[0.0; 9]], &[stretch], &mut stress);
    let [lambda, sum] = [stress[0][4], stress[0][0]];
    [lambda, (sum - lambda) / 2.0]
}

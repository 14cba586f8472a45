//! A law at a material point: its compiled kernels, with the rounding bound of its derivation.

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::ir::{Input, Op, Output, ValidKernel};
use tensormass_kernels::point::{DampingPointKernels, Material, PointKernels};
use tensormass_kernels::{LawEntry, Precision};

use crate::random::Rng;
use crate::rounding::Rounded;
use crate::tensor::{self, Matrix};

/// Gradients of nodes' interpolation functions for diagonals: those of the reference tetrahedron.
pub const NODE_GRADIENTS: [[f64; 3]; 4] = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Compiled kernels of one material at one point.
#[derive(Debug)]
pub struct Compiled<R: Precision> {
    kernels: PointKernels<R>,
    damping: Option<DampingPointKernels<R>>,
    constants: Vec<R>,
}

impl<R: Precision> Compiled<R> {
    /// Kernels of a law with these constants, rounded to the working precision.
    pub fn new(law: &LawEntry, constants: &[f64]) -> Self {
        let constants = constants.iter().map(|&c| R::from_f64(c)).collect();
        Self { kernels: law.points(), damping: law.damping_points(), constants }
    }

    fn material(&self) -> Material<'_, R> {
        Material { constants: &self.constants, stride: 0, count: self.constants.len(), points: 1 }
    }

    fn zero() -> R {
        R::from_f64(0.0)
    }

    fn node_gradients() -> [[R; 3]; 4] {
        NODE_GRADIENTS.map(|g| g.map(R::from_f64))
    }

    /// W, and whether G is outside the domain.
    pub fn energy(&self, g: &[R; 9]) -> (R, bool) {
        let mut w = [Self::zero()];
        let outside = (self.kernels.energy)(&self.material(), &[*g], &mut w);
        (w[0], outside.is_some())
    }

    /// P, and whether G is outside the domain.
    pub fn force(&self, g: &[R; 9]) -> ([R; 9], bool) {
        let mut p = [[Self::zero(); 9]];
        let outside = (self.kernels.force)(&self.material(), &[*g], &mut p);
        (p[0], outside.is_some())
    }

    /// dP in the direction dG.
    pub fn dforce(&self, g: &[R; 9], dg: &[R; 9]) -> [R; 9] {
        let mut p = [[Self::zero(); 9]];
        (self.kernels.dforce)(&self.material(), &[*g], &[*dg], &mut p);
        p[0]
    }

    /// The tangent's diagonal for each of [`NODE_GRADIENTS`].
    pub fn diagonal(&self, g: &[R; 9]) -> [[R; 3]; 4] {
        let mut d = Self::node_gradients();
        (self.kernels.diagonal)(&self.material(), &[*g], &mut d);
        d
    }

    /// The Cauchy stress.
    pub fn cauchy(&self, g: &[R; 9]) -> [R; 9] {
        let mut s = [[Self::zero(); 9]];
        (self.kernels.cauchy)(&self.material(), &[*g], &mut s);
        s[0]
    }

    /// Whether the law has a dissipation.
    pub fn is_dissipative(&self) -> bool {
        self.damping.is_some()
    }

    fn damping_kernels(&self) -> &DampingPointKernels<R> {
        self.damping.as_ref().expect("the law has a dissipation")
    }

    /// D at G and its rate, of a law with a dissipation.
    pub fn dissipation(&self, g: &[R; 9], rate: &[R; 9]) -> R {
        let mut d = [Self::zero()];
        (self.damping_kernels().dissipation)(&self.material(), &[*g], &[*rate], &mut d);
        d[0]
    }

    /// P_v at G and its rate.
    pub fn damping(&self, g: &[R; 9], rate: &[R; 9]) -> [R; 9] {
        let mut p = [[Self::zero(); 9]];
        (self.damping_kernels().damping)(&self.material(), &[*g], &[*rate], &mut p);
        p[0]
    }

    /// dP_v at G and its rate, where the rate changes by dG.
    pub fn ddamping(&self, g: &[R; 9], rate: &[R; 9], dg: &[R; 9]) -> [R; 9] {
        let mut p = [[Self::zero(); 9]];
        (self.damping_kernels().ddamping)(&self.material(), &[*g], &[*rate], &[*dg], &mut p);
        p[0]
    }

    /// The diagonal of dP_v for each of [`NODE_GRADIENTS`].
    pub fn damping_diagonal(&self, g: &[R; 9], rate: &[R; 9]) -> [[R; 3]; 4] {
        let mut d = Self::node_gradients();
        (self.damping_kernels().diagonal)(&self.material(), &[*g], &[*rate], &mut d);
        d
    }
}

/// A material point: values by the compiled f64 kernels, errors by interpreting the derivation.
#[derive(Debug)]
pub struct Point {
    /// The law.
    pub entry: &'static LawEntry,
    /// Its derivation.
    pub derivation: Derivation,
    /// The material's parameters.
    pub parameters: Vec<f64>,
    /// The same, with what they were rounded by: the components of a direction are those of a unit vector, rounded.
    pub rounded: Vec<Rounded>,
    /// Kernels in double precision.
    pub double: Compiled<f64>,
    /// Kernels in single precision.
    pub single: Compiled<f32>,
    constants: Vec<Rounded>,
    comparisons: ValidKernel,
}

/// The force kernel with the left and the right sides of its selections' comparisons as its last two results.
fn comparisons(derivation: &Derivation) -> ValidKernel {
    let mut kernel = derivation.kernel("force").ir().clone();
    let sides = kernel.values.iter().filter_map(|d| match d.op {
        Op::Select(left, right, _, _) => Some((left, right)),
        _ => None,
    });
    let (left, right) = sides.unzip();
    // Roles of any length.
    kernel.outputs.extend([(Output::NodalForce, left), (Output::NodeGradients, right)]);
    kernel.validate().expect("the values of a valid kernel")
}

impl Point {
    /// A material of a law; `generated` is the folder of the generated code, `env!("TENSORMASS_GENERATED")`.
    ///
    /// # Panics
    /// The law has no derivation.
    pub fn new(generated: &str, entry: &'static LawEntry, parameters: Vec<f64>) -> Self {
        let flags = entry.info.parameters.iter().flat_map(|p| vec![p.direction; p.len]);
        let exact = |x: f64| x.abs() == 1.0 || x == 0.0;
        let round = |(p, direction): (f64, bool)| {
            if direction && !exact(p) { Rounded::nearest(p) } else { Rounded::exact(p) }
        };
        let rounded = parameters.into_iter().zip(flags).map(round).collect();
        Self::of(crate::derivation(generated, entry.info.name), entry, rounded)
    }

    /// A material of a law, of parameters that carry what they were rounded by.
    ///
    /// # Panics
    /// The parameters are not the law's.
    pub fn of(derivation: Derivation, entry: &'static LawEntry, rounded: Vec<Rounded>) -> Self {
        let parameters: Vec<f64> = rounded.iter().map(|p| p.value).collect();
        let values = entry.constants(&parameters);
        let material = derivation.kernel("material").interpret(&[(Input::Parameters, rounded.as_slice())]);
        // In f32 the constants are rounded once more.
        let bounds = material.expect("one value a parameter component").remove(0).into_iter();
        let constants = bounds.zip(&values).map(|(b, &v)| Rounded::new(v, b.error + v.abs())).collect::<Vec<_>>();
        let (double, single) = (Compiled::new(entry, &values), Compiled::new(entry, &values));
        let comparisons = comparisons(&derivation);
        Self { entry, derivation, parameters, rounded, double, single, constants, comparisons }
    }

    /// G at a random state (see [`Rng::gradient`]) well inside the law's domain, with an energy that f32 holds: where
    /// states of this stretch may be outside, half as far from rest as those that are not.
    ///
    /// # Panics
    /// The law reports every state as outside.
    pub fn state(&self, rng: &mut Rng, (low, high): (f64, f64)) -> [f64; 9] {
        let mut draw = |s: f64| rng.gradient(low.powf(s), high.powf(s));
        let held = |g: &[f64; 9]| !self.double.force(g).1 && self.single.energy(&g.map(|x| x as f32)).0.is_finite();
        let mut inside = |s: &f64| (0..16).all(|_| held(&draw(*s)));
        let share = (0..32).map(|k| 0.8f64.powi(k)).find(&mut inside);
        let share = share.unwrap_or_else(|| panic!("{}: no state is inside the domain", self.entry.info.name));
        draw(if share < 1.0 { share / 2.0 } else { share })
    }

    fn bounds(&self, kernel: &str, inputs: &[(Input, &[Rounded])]) -> Vec<Vec<Rounded>> {
        let mut all = vec![(Input::Constants, self.constants.as_slice())];
        all.extend_from_slice(inputs);
        self.derivation.point(kernel).interpret(&all).expect("the inputs of a point kernel")
    }

    fn bounded<const N: usize>(&self, values: [f64; N], bounds: &[Rounded]) -> [Rounded; N] {
        std::array::from_fn(|k| Rounded::new(values[k], bounds[k].error))
    }

    /// W.
    pub fn energy(&self, g: &Matrix) -> Rounded {
        let bounds = self.bounds("energy", &[(Input::DisplacementGradient, g)]);
        self.bounded([self.double.energy(&tensor::values(g)).0], &bounds[0])[0]
    }

    /// P.
    pub fn force(&self, g: &Matrix) -> Matrix {
        let bounds = self.bounds("force", &[(Input::DisplacementGradient, g)]);
        self.bounded(self.double.force(&tensor::values(g)).0, &bounds[0])
    }

    /// dP.
    pub fn dforce(&self, g: &Matrix, dg: &Matrix) -> Matrix {
        let bounds = self.bounds("dforce", &[(Input::DisplacementGradient, g), (Input::GradientIncrement, dg)]);
        self.bounded(self.double.dforce(&tensor::values(g), &tensor::values(dg)), &bounds[0])
    }

    /// The diagonal for each of [`NODE_GRADIENTS`].
    pub fn diagonal(&self, g: &Matrix) -> [[Rounded; 3]; 4] {
        let values = self.double.diagonal(&tensor::values(g));
        std::array::from_fn(|n| {
            let node = NODE_GRADIENTS[n].map(Rounded::exact);
            let bounds = self.bounds("diagonal", &[(Input::DisplacementGradient, g), (Input::NodeGradient, &node)]);
            self.bounded(values[n], &bounds[0])
        })
    }

    /// The Cauchy stress.
    pub fn cauchy(&self, g: &Matrix) -> Matrix {
        let bounds = self.bounds("cauchy", &[(Input::DisplacementGradient, g)]);
        self.bounded(self.double.cauchy(&tensor::values(g)), &bounds[0])
    }

    /// D at G and its rate, of a law with a dissipation.
    pub fn dissipation(&self, g: &Matrix, rate: &Matrix) -> Rounded {
        let bounds = self.bounds("dissipation", &[(Input::DisplacementGradient, g), (Input::GradientRate, rate)]);
        self.bounded([self.double.dissipation(&tensor::values(g), &tensor::values(rate))], &bounds[0])[0]
    }

    /// P_v.
    pub fn damping(&self, g: &Matrix, rate: &Matrix) -> Matrix {
        let bounds = self.bounds("damping", &[(Input::DisplacementGradient, g), (Input::GradientRate, rate)]);
        self.bounded(self.double.damping(&tensor::values(g), &tensor::values(rate)), &bounds[0])
    }

    /// dP_v where the rate changes by dG.
    pub fn ddamping(&self, g: &Matrix, rate: &Matrix, dg: &Matrix) -> Matrix {
        let inputs: [(Input, &[Rounded]); 3] =
            [(Input::DisplacementGradient, g), (Input::GradientRate, rate), (Input::GradientIncrement, dg)];
        let bounds = self.bounds("ddamping", &inputs);
        let [g, rate, dg] = [g, rate, dg].map(tensor::values);
        self.bounded(self.double.ddamping(&g, &rate, &dg), &bounds[0])
    }

    /// The diagonal of dP_v for each of [`NODE_GRADIENTS`].
    pub fn damping_diagonal(&self, g: &Matrix, rate: &Matrix) -> [[Rounded; 3]; 4] {
        let values = self.double.damping_diagonal(&tensor::values(g), &tensor::values(rate));
        std::array::from_fn(|n| {
            let node = NODE_GRADIENTS[n].map(Rounded::exact);
            let inputs: [(Input, &[Rounded]); 3] =
                [(Input::DisplacementGradient, g), (Input::GradientRate, rate), (Input::NodeGradient, &node)];
            self.bounded(values[n], &self.bounds("damping_diagonal", &inputs)[0])
        })
    }

    /// Which branch each selection of the force kernel takes.
    pub fn branches(&self, g: &Matrix) -> Vec<bool> {
        let constants: Vec<f64> = self.constants.iter().map(|c| c.value).collect();
        let g = tensor::values(g);
        let inputs = [(Input::Constants, constants.as_slice()), (Input::DisplacementGradient, g.as_slice())];
        let mut results = self.comparisons.interpret(&inputs).expect("the inputs of a point kernel");
        let (right, left) = (results.pop().unwrap_or_default(), results.pop().unwrap_or_default());
        left.iter().zip(&right).map(|(left, right)| left > right).collect()
    }

    /// Left minus right side of the domain's inequality, where the law has one.
    pub fn margin(&self, g: &Matrix) -> Option<Rounded> {
        self.bounds("energy", &[(Input::DisplacementGradient, g)]).get(1).map(|margin| margin[0])
    }
}

//! A checked law: its metadata, and its energy density as a typed tree over the strain.
//!
//! This is the value that the parser ([`super::parse`]) hands to the derivation. Helper functions, `let`s and `sum`s
//! are resolved; what is left is closed and typed: scalars and symmetric tensors, nothing else.

use std::rc::Rc;

use num_rational::Ratio;

use super::error::{LawError, Place, Source};

/// An exact constant of a law, as written: `0.3` is 3/10.
pub type Rational = Ratio<i128>;

/// A constitutive law, parsed and checked.
#[derive(Debug, Clone)]
pub struct Law {
    /// The file's stem, a snake_case identifier: the name under which scenes use the law.
    pub name: String,
    /// The path as it was given to the parser, for messages.
    pub path: String,
    /// The whole text of the law file.
    pub text: String,
    /// The inner doc comment: what the law is, and its source.
    pub docs: String,
    /// The parameters, in the order of the struct's fields.
    pub parameters: Vec<Parameter>,
    /// Where the energy is defined; `None` is everywhere.
    pub domain: Option<Domain>,
    /// Whether the energy uses the small strain, and so changes under rotation: `#[small_strain]`.
    pub small_strain: bool,
    /// The strain energy density W, in Pa.
    pub energy: Scalar,
    /// The parts of the energy by name where the file gives several (`energy_density_isochoric`, ...); empty otherwise.
    pub parts: Vec<(String, Scalar)>,
    /// The dissipation potential D of strain and strain rate, in W/m^3, if the law has one.
    pub dissipation: Option<Scalar>,
    /// What the author vouches for because the generator cannot decide it: `#[accept(..)]`.
    pub acceptances: Vec<Acceptance>,
    /// The moduli that the author declares: `#[small_strain_moduli(..)]`.
    pub moduli: Option<DeclaredModuli>,
    /// The least and the greatest principal stretch for which the author trusts the law: `#[valid_stretches(..)]`.
    pub valid_stretches: Option<(f64, f64)>,
    /// Where the energy's expressions stand in the text, each after those that it is made of.
    pub places: Vec<(Scalar, Place)>,
}

impl Law {
    /// A refusal at a place of the law's text.
    pub fn error(&self, place: Place, reason: impl Into<String>, remedy: impl Into<String>) -> LawError {
        Source { path: &self.path, text: &self.text }.error(place, reason, remedy)
    }
}

/// A constant at rest of which the author says what the generator cannot show.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Acceptance {
    /// What is said of it.
    pub kind: Accepted,
    /// The constant, in the generator's words: as the refusal printed it.
    pub constant: String,
    /// Why it is right.
    pub reason: String,
    /// Where the attribute stands.
    pub place: Place,
}

/// What can be said of a constant at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accepted {
    /// It is 0 for no material, and positive where a logarithm, a root or a real power is taken of it.
    Sign,
    /// It is 0 for every material.
    Cancellation,
}

impl Accepted {
    /// Its name in the attribute.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sign => "sign",
            Self::Cancellation => "cancellation",
        }
    }
}

/// The moduli at rest that an author declares, in Pa; functions of the parameters.
#[derive(Debug, Clone)]
pub struct DeclaredModuli {
    /// As written: `shear = mu, bulk = kappa`.
    pub text: String,
    /// Shear modulus mu.
    pub shear: Scalar,
    /// Bulk modulus K.
    pub bulk: Scalar,
}

/// A material parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// The field's name.
    pub name: String,
    /// The field's doc comment.
    pub docs: String,
    /// The unit, as a product of powers of SI units.
    pub unit: Unit,
    /// The least and greatest value allowed.
    pub range: (f64, f64),
    /// The value where a scene gives none.
    pub default: Option<Vec<f64>>,
    /// Whether a scene may give one value an element.
    pub per_element: bool,
    /// 1 for `f64`, N for `[f64; N]`, 3 for `Direction`.
    pub len: usize,
    /// A `Direction`: the components of a unit vector.
    pub direction: bool,
}

/// A unit: text as written, and its dimensions in the base (length, stress, time).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unit {
    /// As written in the law file: `"Pa"`, `"1"`, `"Pa s"`, `"1/m"`.
    pub text: String,
    /// Exponent of length (m).
    pub length: i32,
    /// Exponent of stress (Pa).
    pub stress: i32,
    /// Exponent of time (s).
    pub time: i32,
}

/// The law holds where `left > right`; on the other side an element has left the law's domain.
#[derive(Debug, Clone)]
pub struct Domain {
    /// As written, for messages: `J > 0.0`.
    pub text: String,
    /// Left side.
    pub left: Scalar,
    /// Right side.
    pub right: Scalar,
}

/// A scalar expression, shared where the author shared it by `let`.
pub type Scalar = Rc<ScalarNode>;

/// What a scalar is.
#[derive(Debug, Clone)]
pub enum ScalarNode {
    /// An exact number.
    Number(Rational),
    /// Component `component` (0 unless an array) of parameter `parameter`.
    Parameter {
        /// Index in [`Law::parameters`].
        parameter: usize,
        /// Index in the array, 0 for a scalar.
        component: usize,
    },
    /// An invariant of the strain.
    Invariant(Invariant),
    /// tr A.
    Trace(Tensor),
    /// A : B, the sum over i and j of A_ij B_ij.
    Ddot(Tensor, Tensor),
    /// det A.
    Det(Tensor),
    /// lambda_1^a + lambda_2^a + lambda_3^a = tr C^(a/2): the sum of powers of the principal stretches (a is a number
    /// or a function of the parameters).
    StretchSum(Scalar),
    /// a + b.
    Add(Scalar, Scalar),
    /// a - b.
    Sub(Scalar, Scalar),
    /// a b.
    Mul(Scalar, Scalar),
    /// a / b.
    Div(Scalar, Scalar),
    /// -a.
    Neg(Scalar),
    /// a to an integer power.
    Powi(Scalar, i32),
    /// a to a real power (a number or a function of the parameters).
    Powf(Scalar, Scalar),
    /// Natural logarithm.
    Ln(Scalar),
    /// Exponential.
    Exp(Scalar),
    /// Square root.
    Sqrt(Scalar),
    /// `then` where `left > right`, `otherwise` elsewhere. `pos(x)` is `select(x > 0, x, 0)`;
    /// the other comparisons are reduced to this one by swapping sides and branches.
    Select {
        /// Left side of the comparison.
        left: Scalar,
        /// Right side of the comparison.
        right: Scalar,
        /// Value where `left > right`.
        then: Scalar,
        /// Value elsewhere.
        otherwise: Scalar,
    },
    /// A value that the author named by `let`: the name is kept for the generated text.
    Named(String, Scalar),
    /// The rate of an invariant of the strain.
    Rate(Scalar),
}

/// Invariants that the `Strain` argument offers. C = F'F.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Invariant {
    /// tr C.
    I1,
    /// ((tr C)^2 - C:C) / 2.
    I2,
    /// det C = J^2.
    I3,
    /// det F.
    J,
    /// J^(-2/3) I1.
    I1bar,
    /// J^(-4/3) I2.
    I2bar,
    /// a . C . a of a fibre direction a, an index in [`Law::parameters`].
    I4(usize),
    /// a . C^2 . a.
    I5(usize),
    /// a . C . b of two directions.
    I8(usize, usize),
    /// J^(-2/3) I4.
    I4bar(usize),
    /// J^(-4/3) I5.
    I5bar(usize),
}

impl Invariant {
    /// The directions that it takes, as indices in [`Law::parameters`].
    pub fn directions(self) -> Vec<usize> {
        match self {
            Invariant::I4(a) | Invariant::I5(a) | Invariant::I4bar(a) | Invariant::I5bar(a) => vec![a],
            Invariant::I8(a, b) => vec![a, b],
            Invariant::I1 | Invariant::I2 | Invariant::I3 | Invariant::J | Invariant::I1bar | Invariant::I2bar => {
                vec![]
            }
        }
    }
}

/// A symmetric tensor expression.
pub type Tensor = Rc<TensorNode>;

/// What a symmetric tensor is.
#[derive(Debug, Clone)]
pub enum TensorNode {
    /// The small strain eps = (G + G') / 2.
    Eps,
    /// The Green strain E = (G + G' + G'G) / 2.
    E,
    /// The right Cauchy-Green tensor C = F'F.
    C,
    /// The identity, `identity()`.
    Identity,
    /// A + B.
    Add(Tensor, Tensor),
    /// A - B.
    Sub(Tensor, Tensor),
    /// s A.
    Scale(Scalar, Tensor),
    /// The rate of a strain.
    Rate(Tensor),
}

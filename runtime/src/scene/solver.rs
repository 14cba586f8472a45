//! What a scene says of its solver: integrator, step, precision, masses, damping, linear and nonlinear solvers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a step is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Implicit Euler: unconditionally stable for a convex energy, dissipative, first order.
    ImplicitEuler,
    /// Semi-implicit (symplectic) Euler: explicit, stable below the critical step, first order.
    SemiImplicitEuler,
    /// Central differences with mass damping: explicit, stable below the critical step, second order.
    CentralDifference,
    /// Equilibrium without inertia.
    Static,
}

impl Integrator {
    /// Whether steps take forces as they are, and solve for nothing.
    pub fn is_explicit(self) -> bool {
        match self {
            Self::SemiImplicitEuler | Self::CentralDifference => true,
            Self::ImplicitEuler | Self::Static => false,
        }
    }
}

/// The number type of state and kernels.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// 32 bits, about 7 digits; every GPU has it.
    F32,
    /// 64 bits, about 16 digits.
    #[default]
    F64,
}

impl Precision {
    /// Bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// How inertia is spread over the nodes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mass {
    /// A mass at each node.
    #[default]
    Lumped,
    /// The integrals of products of the interpolation functions, a sparse matrix: motion as accurate as the element.
    Consistent,
}

/// How the equations of motion or of equilibrium are solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Solver {
    /// How a step is taken.
    pub integrator: Integrator,
    /// Time step in s, above 0, at most 1e6. Needed unless the integrator is `static`, where it divides `duration`
    /// into increments.
    #[serde(default)]
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub step: Option<f64>,
    /// Simulated time in s, above 0, at most 1e9. Needed unless the integrator is `static`, where it is the time of
    /// the ramps at which equilibrium is sought (without it: when all ramps have ended).
    #[serde(default)]
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0))]
    pub duration: Option<f64>,
    /// The number type of state and kernels.
    #[serde(default)]
    pub precision: Precision,
    /// How inertia is spread over the nodes; explicit integrators need `lumped`, `static` has no inertia.
    #[serde(default)]
    pub mass: Mass,
    /// Mass-proportional damping alpha in 1/s, from 0 to 1e9; `static` has none. With `stiffness_damping`, Rayleigh's
    /// C = alpha M + beta K.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e9))]
    pub mass_damping: f64,
    /// Stiffness-proportional damping beta in s, from 0 to 1e6; `static` has none.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub stiffness_damping: f64,
    /// The linear solver of `implicit-euler` and `static`.
    #[serde(default)]
    pub cg: ConjugateGradient,
    /// The nonlinear solver of `implicit-euler` and `static`.
    #[serde(default)]
    pub newton: Newton,
    /// CPU threads, from 0 to 1024; 0 takes all cores. Results do not depend on it.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1024))]
    pub threads: u32,
}

impl Solver {
    /// Number of steps (of increments if `static`): `duration / step`, rounded up but for rounding errors. 1 for
    /// `static` without a step. The simulated time is this times the step.
    pub fn steps(&self) -> u64 {
        match (self.duration, self.step) {
            (Some(duration), Some(step)) => ((duration / step) * (1.0 - 1e-9)).ceil().max(1.0) as u64,
            _ => 1,
        }
    }
}

/// The linear solver: conjugate gradients.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConjugateGradient {
    /// Stop when the residual's norm has fallen by this factor; above 0, below 1. Newton's method on a nonlinear law asks
    /// for less where less is enough.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub tolerance: f64,
    /// Most iterations in one solution, from 1 to 1000000.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub max_iterations: u32,
    /// What the residual is multiplied by before each search direction.
    pub preconditioner: Preconditioner,
    /// How products with the tangent are computed on a CPU; results depend on it in their last digits only.
    pub tangent: TangentChoice,
}

impl Default for ConjugateGradient {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            max_iterations: 2000,
            preconditioner: Preconditioner::Jacobi,
            tangent: TangentChoice::Auto,
        }
    }
}

/// A preconditioner of conjugate gradients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preconditioner {
    /// The inverse of the matrix's diagonal.
    Jacobi,
    /// None.
    None,
}

/// How products with the tangent are computed on a CPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TangentChoice {
    /// As a fixed rule has it, for each law by its operations and the size of the body.
    Auto,
    /// What does not depend on the increment is stored once an iteration of Newton's method.
    Stored,
    /// Everything is computed in each product.
    Recomputed,
    /// A matrix is assembled once an iteration of Newton's method. In f32 that loses digits where stiffnesses differ.
    Assembled,
    /// As is faster: measured before the first step. Two runs may then differ in their last digits.
    Measured,
}

impl TangentChoice {
    /// All choices.
    pub const ALL: [Self; 5] = [Self::Auto, Self::Stored, Self::Recomputed, Self::Assembled, Self::Measured];

    /// Its name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Stored => "stored",
            Self::Recomputed => "recomputed",
            Self::Assembled => "assembled",
            Self::Measured => "measured",
        }
    }
}

/// The nonlinear solver: Newton's method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Newton {
    /// Stop when the residual's norm has fallen by this factor within the step, in statics from the norm of what holds the body if that is
    /// less; above 0, below 1.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub tolerance: f64,
    /// Most iterations in one step, from 1 to 10000; 1 takes one linearised step and asks for no convergence.
    #[schemars(range(min = 1, max = 10_000))]
    pub max_iterations: u32,
}

impl Default for Newton {
    fn default() -> Self {
        Self { tolerance: 1e-9, max_iterations: 30 }
    }
}

//! What generated laws implement, and how a runtime meets them without knowing their types.

use crate::damping::{DampingEntry, Dissipative};
use crate::point::{DampingPointKernels, PointKernels};
use crate::real::Real;
use crate::shader::{DampingFunctions, LawFunctions};
use crate::table::{LawTable, Precision};

/// A constitutive law: point kernels generated from its strain energy density W.
///
/// G = grad u (9 components, row by row: component 3 i + j is du_i/dX_j), F = I + G. `constants` are the law's
/// [`Law::material`] constants. Stresses and energies have the unit of the stress parameters.
pub trait Law: Send + Sync + 'static {
    /// What the law is.
    fn info() -> &'static LawInfo;
    /// The constants of a material from its parameters (all components in order), on the host, each rounded once.
    ///
    /// # Panics
    /// If the slices have not the lengths that [`LawInfo`] gives.
    fn material(parameters: &[f64], constants: &mut [f64]);
    /// W, and the domain's margin (positive inside).
    fn energy<R: Real>(constants: &[R], displacement_gradient: &[R; 9]) -> (R, R);
    /// P = dW/dG, the first Piola-Kirchhoff stress, and the domain's margin.
    fn force<R: Real>(constants: &[R], displacement_gradient: &[R; 9]) -> ([R; 9], R);
    /// dP, the differential of P at G in the direction dG.
    fn dforce<R: Real>(constants: &[R], displacement_gradient: &[R; 9], gradient_increment: &[R; 9]) -> [R; 9];
    /// What is stored of a state for [`Law::apply`].
    type State<R: Real>: AsRef<[R]> + AsMut<[R]> + Copy;
    /// Zeros of it.
    fn state<R: Real>() -> Self::State<R>;
    /// What of dP does not depend on the increment, as far as it is worth storing.
    fn linearize<R: Real>(constants: &[R], displacement_gradient: &[R; 9]) -> Self::State<R>;
    /// dP in the direction dG, from what was stored.
    fn apply<R: Real>(constants: &[R], state: &Self::State<R>, gradient_increment: &[R; 9]) -> [R; 9];
    /// g . (d2W / dG_i. dG_i.) . g for i = 0, 1, 2, where g is the gradient of one node's interpolation function.
    fn diagonal<R: Real>(constants: &[R], displacement_gradient: &[R; 9], node_gradient: &[R; 3]) -> [R; 3];
    /// The Cauchy stress P F' / J.
    fn cauchy<R: Real>(constants: &[R], displacement_gradient: &[R; 9]) -> [R; 9];
}

/// A parameter of a law.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterInfo {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub docs: &'static str,
    /// Its unit, as the law file gives it.
    pub unit: &'static str,
    /// The unit's exponents of length, stress and time.
    pub dimensions: [i32; 3],
    /// The least and greatest value allowed.
    pub range: (f64, f64),
    /// The value where a scene gives none, one entry a component.
    pub default: Option<&'static [f64]>,
    /// Whether a scene may give one value an element.
    pub per_element: bool,
    /// Components: 1, the array's length, or 3 of a direction.
    pub len: usize,
    /// A fibre direction: the components of a unit vector of the body at rest.
    pub direction: bool,
}

/// What the generator found out about a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Structure {
    /// dP does not depend on G.
    pub linear: bool,
    /// No direction of the body at rest is preferred.
    pub isotropic: bool,
    /// The stress needs J or the cofactors of F.
    pub uses_j: bool,
    /// The law's response depends on fibre directions.
    pub uses_fibres: bool,
    /// Force and force differential are polynomials in G.
    pub polynomial: bool,
}

/// Operations of one evaluation of a point kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Operations {
    /// The kernel's name.
    pub kernel: &'static str,
    /// Additions and subtractions.
    pub additions: u32,
    /// Multiplications.
    pub multiplications: u32,
    /// Divisions.
    pub divisions: u32,
    /// Square roots, logarithms, exponentials, powers.
    pub functions: u32,
    /// Selections.
    pub selects: u32,
}

impl Operations {
    /// Additions, multiplications and divisions.
    pub fn arithmetic(&self) -> u32 {
        self.additions + self.multiplications + self.divisions
    }
}

/// What a law's author says of a constant at rest that the generator cannot decide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Acceptance {
    /// `sign`: it is decided for every material in use; `cancellation`: the constant is 0.
    pub kind: &'static str,
    /// The constant, an expression in the parameters.
    pub constant: &'static str,
    /// Why it is right.
    pub reason: &'static str,
}

/// A law's metadata.
#[derive(Debug, Clone, PartialEq)]
pub struct LawInfo {
    /// Name in scenes.
    pub name: &'static str,
    /// What it is, and its source.
    pub docs: &'static str,
    /// Its parameters, in order.
    pub parameters: &'static [ParameterInfo],
    /// The inequality that holds inside the law's domain; `None` is everywhere.
    pub domain: Option<&'static str>,
    /// Whether the law is one of small strains, which changes under rotation.
    pub small_strain: bool,
    /// The moduli of small strains as the law file declares them.
    pub moduli: Option<&'static str>,
    /// The least and the greatest principal stretch for which the law's author trusts it, where the law file says so.
    pub valid_stretches: Option<(f64, f64)>,
    /// What the law's author vouches for.
    pub accepted: &'static [Acceptance],
    /// The material's constants as expressions in the parameters, for the reader.
    pub constants: &'static [&'static str],
    /// Detected structure.
    pub structure: Structure,
    /// Numbers that are stored of a point's state for products with the tangent.
    pub stored: usize,
    /// Operations of each point kernel.
    pub operations: &'static [Operations],
    /// Identifies the law file's text.
    pub hash: u64,
    /// Whether the committed derivation exists and is the one for this text.
    pub reviewed: bool,
}

impl LawInfo {
    /// Components of all parameters together.
    pub fn parameter_components(&self) -> usize {
        self.parameters.iter().map(|p| p.len).sum()
    }
}

/// The texts that a law was printed from, for programs that examine laws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawSource {
    /// The law file.
    pub law: &'static str,
    /// Its derivation, as `laws/derived/` holds derivations.
    pub derivation: &'static str,
}

/// A law of this build: metadata and entry points. Laws are data: nothing else names them.
#[derive(Debug, Clone, Copy)]
pub struct LawEntry {
    /// What the law is.
    pub info: &'static LawInfo,
    /// What it was printed from.
    pub source: &'static LawSource,
    /// [`Law::material`].
    pub material: fn(&[f64], &mut [f64]),
    /// Its kernels on all lanes.
    pub(crate) kernels: LawTable,
    /// Point kernels as WGSL, in single precision.
    pub functions: &'static LawFunctions,
    /// Its damping, if it has a dissipation.
    pub damping: Option<DampingEntry>,
}

impl LawEntry {
    /// The entry of a law.
    pub const fn new<L: Law>(
        info: &'static LawInfo,
        source: &'static LawSource,
        functions: &'static LawFunctions,
    ) -> Self {
        Self { info, source, material: L::material, kernels: LawTable::of::<L>(), functions, damping: None }
    }

    /// The entry with the law's damping; `linear` says whether its differential does not depend on the rate.
    pub const fn with_damping<L: Dissipative>(mut self, linear: bool, functions: &'static DampingFunctions) -> Self {
        self.damping = Some(DampingEntry::new::<L>(linear, functions));
        self
    }

    /// The constants of a material, checked for length only.
    ///
    /// # Panics
    /// If `parameters` has not one value a component.
    pub fn constants(&self, parameters: &[f64]) -> Vec<f64> {
        let mut constants = vec![0.0; self.info.constants.len()];
        (self.material)(parameters, &mut constants);
        constants
    }

    /// Its kernels at quadrature points, one number at a time.
    pub fn points<R: Precision>(&self) -> PointKernels<R> {
        R::law(&self.kernels)
    }

    /// Those of its damping, if it has a dissipation.
    pub fn damping_points<R: Precision>(&self) -> Option<DampingPointKernels<R>> {
        self.damping.as_ref().map(|damping| R::damping(&damping.kernels))
    }
}

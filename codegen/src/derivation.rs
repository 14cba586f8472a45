//! The derivation of one law: its kernels, validated, and the text form that `laws/derived/` commits.

use crate::ir::{
    Cut, Input, InterpretError, InvalidKernel, IrTextError, KernelIr, Number, Output, ValidKernel, ValueId,
};
use crate::twofold::Twofold;

/// The version of the derivation's text form.
const FORMAT: &str = "tensormass derivation 2";

/// A term that was rewritten so that it does not cancel at rest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rewrite {
    /// The kernel for which it was rewritten.
    pub kernel: String,
    /// The term as the law file has it.
    pub term: String,
    /// Its exact constant at rest.
    pub rest: String,
    /// What is computed instead, without the constant (and, in energies, without the part that is linear in the strain).
    pub form: String,
}

/// The kernels of one law, in the order of [`KERNELS`], each followed by its sibling for far from rest if it has one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Derivation {
    /// The law's name.
    pub law: String,
    /// [`hash`] of the law file's text from which this was derived.
    pub hash: u64,
    /// The material's constants, as expressions in the parameters for the reader.
    pub constants: Vec<String>,
    /// W at rest, as an expression in the parameters: energies count from there.
    pub energy_at_rest: String,
    /// What was rewritten for the sake of accuracy at rest.
    pub rewrites: Vec<Rewrite>,
    /// The kernels.
    pub kernels: Vec<ValidKernel>,
}

/// A kernel at a material point: one form, or one near rest and one for elsewhere.
#[derive(Debug, Clone, Copy)]
pub struct PointKernel<'a> {
    /// The form that counts where its output [`Output::NearRest`] is positive, or everywhere if it has none.
    pub near: &'a ValidKernel,
    /// The textbook form for elsewhere.
    pub far: Option<&'a ValidKernel>,
}

impl PointKernel<'_> {
    /// The kernel's name.
    pub fn name(&self) -> &str {
        &self.near.ir().name
    }

    /// The outputs that count, in order: those of [`PointKernel::near`] but [`Output::NearRest`].
    pub fn outputs(&self) -> impl Iterator<Item = &(Output, Vec<ValueId>)> {
        self.near.ir().outputs.iter().filter(|(role, _)| *role != Output::NearRest)
    }

    /// Whether a form reads the input with this role.
    pub fn reads(&self, role: Input) -> bool {
        self.near.reads(role) || self.far.is_some_and(|k| k.reads(role))
    }

    /// Evaluates the form that counts: the arrays of [`PointKernel::outputs`].
    ///
    /// # Errors
    /// An input array is missing or has the wrong length.
    pub fn interpret<T: Number>(&self, inputs: &[(Input, &[T])]) -> Result<Vec<Vec<T>>, InterpretError> {
        let mut near = self.near.interpret(inputs)?;
        match (self.far, self.near.ir().outputs.iter().position(|(role, _)| *role == Output::NearRest)) {
            (Some(far), Some(k)) => {
                let margin = near.remove(k).remove(0);
                let zero = T::from_rational(0.into());
                if margin.greater(&zero) { Ok(near) } else { far.interpret(inputs) }
            }
            _ => Ok(near),
        }
    }

    /// The form without any rewriting: what the law file says, whatever cancels.
    pub fn textbook(&self) -> &ValidKernel {
        self.far.unwrap_or(self.near)
    }
}

/// What a number stored of a tangent costs, in additions: it is read from the outer caches or from memory for every
/// increment (measured: docs/performance.md).
const PRICE: u64 = 8;

/// A law's tangent in two parts: what is computed once a state, and for every increment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Tangent {
    /// The minimum cut through the force differential.
    Cut(Cut),
    /// G is stored: the force differential has two forms, which choose by G.
    Gradient,
}

impl Tangent {
    /// Numbers stored at a point.
    pub fn stored(&self) -> usize {
        match self {
            Tangent::Cut(cut) => cut.stored(),
            Tangent::Gradient => 9,
        }
    }
}

/// Why a derivation's text is refused.
#[derive(Debug, thiserror::Error)]
pub enum DerivationError {
    /// The text is not of the form.
    #[error(transparent)]
    Text(#[from] IrTextError),
    /// A kernel breaks a rule.
    #[error(transparent)]
    Invalid(#[from] InvalidKernel),
    /// A kernel is missing or unknown.
    #[error("expected the kernels {expected}, found {found}")]
    Kernels {
        /// The kernels that every law has.
        expected: String,
        /// The kernels in the text.
        found: String,
    },
}

/// The ending of the name of a kernel's form for far from rest.
pub const FAR: &str = "_far";

/// The kernels of every law, in order.
pub const KERNELS: [&str; 6] = ["material", "energy", "force", "dforce", "diagonal", "cauchy"];
/// The kernels that follow them where a law has a dissipation.
pub const DAMPING_KERNELS: [&str; 4] = ["dissipation", "damping", "ddamping", "damping_diagonal"];

impl Derivation {
    /// The tangent in two parts.
    pub fn tangent(&self) -> Tangent {
        let dforce = self.point("dforce");
        match dforce.far {
            None => Tangent::Cut(dforce.near.cut(Input::GradientIncrement, PRICE)),
            Some(_) => Tangent::Gradient,
        }
    }

    /// The kernel of this name.
    pub fn kernel(&self, name: &str) -> &ValidKernel {
        self.kernels
            .iter()
            .find(|k| k.ir().name == name)
            .expect("one of KERNELS, or of DAMPING_KERNELS where the law is dissipative")
    }

    /// Whether the law has a dissipation, and so the kernels of [`DAMPING_KERNELS`].
    pub fn is_dissipative(&self) -> bool {
        self.kernels.iter().any(|k| k.ir().name == DAMPING_KERNELS[0])
    }

    /// The constants of a material as printed code computes them: in twofold precision, each rounded once to f64.
    ///
    /// # Errors
    /// There is not one value for each component of each parameter.
    pub fn material(&self, parameters: &[f64]) -> Result<Vec<f64>, InterpretError> {
        let parameters: Vec<Twofold> = parameters.iter().map(|&x| x.into()).collect();
        let constants = self.kernel("material").interpret(&[(Input::Parameters, parameters.as_slice())])?;
        Ok(constants[0].iter().map(|c| c.to_f64()).collect())
    }

    /// A kernel at a material point, with its form for far from rest.
    pub fn point(&self, name: &str) -> PointKernel<'_> {
        let far = self.kernels.iter().find(|k| k.ir().name.strip_suffix(FAR) == Some(name));
        PointKernel { near: self.kernel(name), far }
    }

    /// The derivation as text: deterministic, line by line reviewable.
    pub fn to_text(&self) -> String {
        let mut out = format!(
            "# {FORMAT}\n# Derived from laws/{}.rs by tensormass-codegen {}; do not edit: `cargo xtask law accept {}`.\n",
            self.law,
            env!("CARGO_PKG_VERSION"),
            self.law
        );
        out += &format!("law {}\nhash {:016x}\n", self.law, self.hash);
        for (k, c) in self.constants.iter().enumerate() {
            out += &format!("constant {k} = {c}\n");
        }
        out += &format!("energy_at_rest = {}\n", self.energy_at_rest);
        for r in &self.rewrites {
            out += &format!("rewrite {} | {} | {} | {}\n", r.kernel, r.term, r.rest, r.form);
        }
        for kernel in &self.kernels {
            out.push('\n');
            out += &kernel.ir().to_text();
        }
        out
    }

    /// Reads a derivation and validates its kernels.
    ///
    /// # Errors
    /// The first line that is not of the form, or the first rule broken.
    pub fn from_text(text: &str) -> Result<Self, DerivationError> {
        let error = |line: usize, reason: &str| IrTextError { line, reason: reason.to_string() };
        if !text.starts_with(&format!("# {FORMAT}")) {
            return Err(error(1, &format!("expected `# {FORMAT}`")).into());
        }
        let mut lines = text
            .lines()
            .enumerate()
            .map(|(i, l)| (i + 1, l.trim_end()))
            .filter(|(_, l)| !l.is_empty() && !l.starts_with('#'))
            .peekable();
        let mut header = |key: &str| match lines.next() {
            Some((_, l)) if l.starts_with(key) => Ok(l[key.len()..].trim().to_string()),
            Some((line, _)) => Err(error(line, &format!("expected `{key}...`"))),
            None => Err(error(1, &format!("`{key}` is missing"))),
        };
        let law = header("law ")?;
        let hash = header("hash ")?;
        let hash = u64::from_str_radix(&hash, 16).map_err(|_| error(1, "the hash is not hexadecimal"))?;
        let mut constants = Vec::new();
        while let Some((_, l)) = lines.next_if(|(_, l)| l.starts_with("constant ")) {
            constants.push(l.split_once('=').map_or("", |(_, c)| c).trim().to_string());
        }
        let energy_at_rest = match lines.next_if(|(_, l)| l.starts_with("energy_at_rest")) {
            Some((_, l)) => l.split_once('=').map_or("", |(_, e)| e).trim().to_string(),
            None => return Err(error(1, "`energy_at_rest = ...` is missing").into()),
        };
        let mut rewrites = Vec::new();
        while let Some((line, l)) = lines.next_if(|(_, l)| l.starts_with("rewrite ")) {
            let parts: Vec<String> = l["rewrite ".len()..].split(" | ").map(|p| p.trim().to_string()).collect();
            let [kernel, term, rest, form]: [String; 4] =
                parts.try_into().map_err(|_| error(line, "expected `rewrite KERNEL | TERM | REST | FORM`"))?;
            rewrites.push(Rewrite { kernel, term, rest, form });
        }
        let mut kernels = Vec::new();
        while lines.peek().is_some() {
            kernels.push(KernelIr::from_lines(&mut lines)?.validate()?);
        }
        let found: Vec<&str> = kernels.iter().map(|k: &ValidKernel| k.ir().name.as_str()).collect();
        // A sibling follows its kernel.
        let is_sibling = |k: usize| k > 0 && found[k].strip_suffix(FAR) == Some(found[k - 1]);
        let base: Vec<&str> = (0..found.len()).filter(|&k| !is_sibling(k)).map(|k| found[k]).collect();
        if base != KERNELS && base != [&KERNELS[..], &DAMPING_KERNELS].concat() {
            return Err(DerivationError::Kernels { expected: KERNELS.join(", "), found: found.join(", ") });
        }
        Ok(Self { law, hash, constants, energy_at_rest, rewrites, kernels })
    }
}

/// Identifies a law file's text, whatever its line ends: FNV-1a, 64 bits. For freshness, not against forgery.
pub fn hash(text: &str) -> u64 {
    let mut h = 0xcbf2_9ce4_8422_2325_u64;
    for byte in text.bytes().filter(|b| *b != b'\r') {
        h = (h ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    }
    h
}

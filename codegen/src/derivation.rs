//! The derivation of one law: its kernels, validated, and the text form that `laws/derived/` commits.

use crate::ir::{InvalidKernel, IrTextError, KernelIr, ValidKernel};

/// The version of the derivation's text form.
const FORMAT: &str = "tensormass derivation 1";

/// The kernels of one law, in the order material, energy, force, dforce, diagonal, cauchy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Derivation {
    /// The law's name.
    pub law: String,
    /// [`hash`] of the law file's text from which this was derived.
    pub hash: u64,
    /// The material's constants, as expressions in the parameters for the reader.
    pub constants: Vec<String>,
    /// The kernels.
    pub kernels: Vec<ValidKernel>,
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

/// The kernels of every law, in order.
pub const KERNELS: [&str; 6] = ["material", "energy", "force", "dforce", "diagonal", "cauchy"];

impl Derivation {
    /// The kernel of this name.
    pub fn kernel(&self, name: &str) -> &ValidKernel {
        let i = KERNELS.iter().position(|k| *k == name).expect("one of KERNELS");
        &self.kernels[i]
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
        let mut kernels = Vec::new();
        while lines.peek().is_some() {
            kernels.push(KernelIr::from_lines(&mut lines)?.validate()?);
        }
        let found: Vec<&str> = kernels.iter().map(|k| k.ir().name.as_str()).collect();
        if found != KERNELS {
            return Err(DerivationError::Kernels { expected: KERNELS.join(", "), found: found.join(", ") });
        }
        Ok(Self { law, hash, constants, kernels })
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

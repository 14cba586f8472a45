//! Why a law cannot be split at rest: the term or the constant, the reason and the remedy.

use crate::cas::UnexpectedTerm;

/// Why a law cannot be split at rest.
#[derive(Debug, thiserror::Error)]
pub enum SplitError {
    /// The computer algebra system answered in unknown terms.
    #[error(transparent)]
    Cas(#[from] UnexpectedTerm),
    /// A term has no expansion at rest, or none that is decided for every material.
    #[error("the term `{term}` {reason}; {remedy}")]
    Term {
        /// The term, as text.
        term: String,
        /// What is wrong with it.
        reason: String,
        /// What the author can do.
        remedy: String,
    },
    /// The stress at rest is not zero.
    #[error(
        "the stress at rest is not zero: the energy density begins with `{0}`, of first order in the strain; add the term \
         that cancels it"
    )]
    StressAtRest(String),
    /// The stress at rest is zero as far as numbers show, and the constant that says so does not cancel.
    #[error("the stress at rest seems to be zero, but that `{0}` cancels cannot be shown; {remedy}", remedy = cancel(.0))]
    Cancellation(String),
}

impl SplitError {
    /// What is wrong, and what the author can do; `None` for what is no fault of the law.
    pub fn parts(&self) -> Option<(String, String)> {
        match self {
            Self::Cas(_) => None,
            Self::Term { term, reason, remedy } => Some((format!("the term `{term}` {reason}"), remedy.clone())),
            Self::StressAtRest(_) | Self::Cancellation(_) => {
                let text = self.to_string();
                let (reason, remedy) = text.split_once("; ").unwrap_or((&text, ""));
                Some((reason.to_owned(), remedy.to_owned()))
            }
        }
    }
}

/// The remedy for a constant of which numbers say that it is 0.
fn cancel(constant: &str) -> String {
    format!(
        "write the constant so that it cancels term by term, or say why it is 0: `#[accept(cancellation = \"{constant}\", \
         reason = \"..\")]`"
    )
}

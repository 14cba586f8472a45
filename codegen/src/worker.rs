//! Differentiates in a child process: the same executable, called again with a job in its environment.
//!
//! The computer algebra system aborts its process when a second one runs on the machine. A child turns that into an
//! error with a remedy, and ends as soon as its job is done. The parent holds the machine-wide lock from before the
//! child starts until it is gone: a child that let go of the lock itself would still be running for a moment, in which
//! the next one would abort.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::derivation::{Derivation, DerivationError};
use crate::law::ast::Law;
use crate::lock;

/// Holds the output folder and the law files of a child's job, one a line.
const JOB: &str = "TENSORMASS_DERIVE_JOB";

/// Why the child's work failed.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// This build has no computer algebra system.
    #[error(
        "this build cannot differentiate: it was compiled without the feature `derive`; build with `--features derive`"
    )]
    NotAvailable,
    /// The process could not be started, or its files not be read.
    #[error("cannot run the differentiation of laws: {0}")]
    Io(#[from] std::io::Error),
    /// The machine-wide lock could not be taken.
    #[error("cannot take the lock of differentiations, {}: {source}", .path.display())]
    Lock {
        /// The lock file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The computer algebra system aborted.
    #[error(
        "Symbolica aborted while it differentiated (signal 6). Its free licence allows one process a machine: another \
         program that uses Symbolica is probably running. Wait until it ends and try again, or build without the \
         feature `derive`; see docs/licensing.md"
    )]
    Aborted,
    /// The child refused a law; what it said.
    #[error("{0}")]
    Refused(String),
    /// The child's result is not a derivation: a defect of the generator.
    #[error("the derivation of `{0}` cannot be read back: {1}")]
    Unreadable(String, #[source] DerivationError),
}

/// Whether this build can differentiate.
pub const fn available() -> bool {
    cfg!(feature = "derive")
}

/// Does the job in the environment and exits, if there is one. Call this first in `main`.
pub fn run_if_requested() {
    if let Some(job) = std::env::var_os(JOB) {
        let job = job.to_string_lossy().into_owned();
        std::process::exit(match work(&job) {
            Ok(()) => 0,
            Err(message) => {
                eprintln!("{message}");
                2
            }
        });
    }
}

#[cfg(feature = "derive")]
fn work(job: &str) -> Result<(), String> {
    let mut lines = job.lines();
    let out = PathBuf::from(lines.next().unwrap_or_default());
    // Every law is tried, so that one run names the faults of all.
    let refused: Vec<String> = lines.filter_map(|path| work_on(path, &out).err()).collect();
    if refused.is_empty() { Ok(()) } else { Err(refused.join("\n")) }
}

#[cfg(feature = "derive")]
fn work_on(path: &str, out: &Path) -> Result<(), String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{path}: {e}"))?;
    let law = crate::law::parse(path, &text)
        .map_err(|errors| errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))?;
    let derivation = crate::derive::derive(&law).map_err(|e| match e {
        // It says where.
        crate::derive::DeriveError::Law(e) => e.to_string(),
        e => format!("{path}: {e}"),
    })?;
    let target = out.join(format!("{}.ir", law.name));
    std::fs::write(&target, derivation.to_text()).map_err(|e| format!("{}: {e}", target.display()))
}

#[cfg(not(feature = "derive"))]
fn work(_job: &str) -> Result<(), String> {
    Err(WorkerError::NotAvailable.to_string())
}

/// Differentiates laws in a child process, which leaves one `NAME.ir` a law in `out`.
///
/// The caller's `main` must begin with [`run_if_requested`].
///
/// # Errors
/// See [`WorkerError`].
pub fn derive(laws: &[(PathBuf, Law)], out: &Path) -> Result<Vec<Derivation>, WorkerError> {
    if !available() {
        return Err(WorkerError::NotAvailable);
    }
    if laws.is_empty() {
        return Ok(vec![]);
    }
    std::fs::create_dir_all(out)?;
    let mut job = out.to_string_lossy().into_owned();
    for (path, _) in laws {
        job.push('\n');
        job.push_str(&path.to_string_lossy());
    }
    let lock = lock::MachineLock::acquire().map_err(|source| WorkerError::Lock { path: lock::path(), source })?;
    let output = Command::new(std::env::current_exe()?).env(JOB, job).env("SYMBOLICA_HIDE_BANNER", "1").output()?;
    drop(lock);
    if !output.status.success() {
        if aborted(output.status) {
            return Err(WorkerError::Aborted);
        }
        return Err(WorkerError::Refused(String::from_utf8_lossy(&output.stderr).trim().to_string()));
    }
    laws.iter()
        .map(|(_, law)| {
            let text = std::fs::read_to_string(out.join(format!("{}.ir", law.name)))?;
            Derivation::from_text(&text).map_err(|e| WorkerError::Unreadable(law.name.clone(), e))
        })
        .collect()
}

#[cfg(unix)]
fn aborted(status: std::process::ExitStatus) -> bool {
    use std::os::unix::process::ExitStatusExt;
    status.signal() == Some(6)
}

#[cfg(not(unix))]
fn aborted(status: std::process::ExitStatus) -> bool {
    status.code() == Some(3) || status.code().is_none()
}

//! `tensormass law derive`: law files in, their derivations out.

use std::path::{Path, PathBuf};

use tensormass_codegen::derivation::Derivation;
use tensormass_codegen::law::{self, ast::Law};
use tensormass_codegen::worker::{self, WorkerError};

use super::names;
use crate::failure::Failure;
use crate::text;

/// Arguments of `law derive`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Law files, or names that stand for laws/NAME.rs in the current folder.
    #[arg(value_name = "NAME_OR_FILE", required = true)]
    laws: Vec<String>,
    /// The folder into which each NAME.ir is written; it is made if need be.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Differentiates laws, in one process, and writes DIR/NAME.ir of each; nothing half-written ever has that name.
///
/// # Errors
/// A law file is missing or wrong (then none is written), the folder cannot be written, or this build cannot differentiate.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    if !worker::available() {
        return Err(failure(WorkerError::NotAvailable));
    }
    let mut laws: Vec<(PathBuf, Law)> = vec![];
    for argument in &arguments.laws {
        let path = law_path(argument)?;
        let law = read(&path)?;
        if let Some((other, _)) = laws.iter().find(|(_, other)| other.name == law.name) {
            let (name, other, path) = (&law.name, other.display(), path.display());
            return Err(Failure::bad_input(format!("{path}: {other} is a law `{name}`, too; rename one of the files")));
        }
        laws.push((path, law));
    }
    let unwritable = |error: std::io::Error| {
        Failure::bad_input(format!(
            "{}: {error}; --out takes a folder that can be made and written",
            arguments.out.display()
        ))
    };
    std::fs::create_dir_all(&arguments.out).map_err(unwritable)?;
    let out = line(&arguments.out)?;
    // Beside the target, so that the rename stays within one file system.
    let scratch = Scratch(Path::new(out).join(format!(".derive.{}", std::process::id())));
    std::fs::create_dir(&scratch.0).map_err(unwritable)?;
    let derivations = worker::derive(&laws, &scratch.0).map_err(failure)?;
    for Derivation { law: name, kernels, .. } in &derivations {
        let target = arguments.out.join(format!("{name}.ir"));
        std::fs::rename(scratch.0.join(format!("{name}.ir")), &target).map_err(unwritable)?;
        text::print(&format!("wrote {} ({} kernels)\n", target.display(), kernels.len()))?;
    }
    Ok(())
}

/// A folder that is removed with the value, whatever happened in between.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // A folder left behind is ugly, not wrong: the outcome is already known.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The file that an argument means: itself if it looks like a path, else that of a law in laws/.
fn law_path(argument: &str) -> Result<PathBuf, Failure> {
    let is_path = Path::new(argument).extension().is_some() || argument.contains(std::path::is_separator);
    let path = if is_path { PathBuf::from(argument) } else { Path::new("laws").join(format!("{argument}.rs")) };
    if !is_path && !path.is_file() {
        let remedy = text::suggest(argument, &names(), "the laws of this build are");
        return Err(Failure::bad_input(format!("there is no law file {}; {remedy}", path.display())));
    }
    line(&path)?;
    Ok(path)
}

/// A path as the one line of text by which a child process is told of it.
fn line(path: &Path) -> Result<&str, Failure> {
    path.to_str().filter(|text| !text.contains('\n')).ok_or_else(|| {
        let reason = "the path is not one line of UTF-8 text; move or rename it";
        Failure::bad_input(format!("{}: {reason}", path.display()))
    })
}

fn read(path: &Path) -> Result<Law, Failure> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::bad_input(format!("{}: {error}; a law is a text file", path.display())))?;
    law::parse(&path.to_string_lossy(), &text)
        .map_err(|errors| Failure::BadInput(errors.iter().map(ToString::to_string).collect()))
}

/// A law that cannot be differentiated is bad input; a computer algebra system that is not there is not.
fn failure(error: WorkerError) -> Failure {
    match error {
        WorkerError::Refused(message) => Failure::BadInput(vec![message]),
        WorkerError::NotAvailable
        | WorkerError::Io(_)
        | WorkerError::Lock { .. }
        | WorkerError::Aborted
        | WorkerError::Unreadable(..) => Failure::Other(error.to_string()),
    }
}

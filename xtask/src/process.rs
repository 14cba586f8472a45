//! Calls other programs from the workspace's root, and says what happened.

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Why a task did not succeed.
#[derive(Debug)]
pub enum Failure {
    /// The arguments are wrong.
    Usage(String),
    /// A step failed, or is left to do.
    Step(String),
}

impl Failure {
    /// 2 for wrong arguments, 1 for a failed step.
    pub fn status(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Usage(_) => 2,
            Self::Step(_) => 1,
        })
    }

    /// Writes the failure to the error output.
    pub fn report(&self, usage: &str) {
        let mut out = std::io::stderr().lock();
        // Nobody is left to be told that the error output is closed.
        let _ = match self {
            Self::Usage(message) => writeln!(out, "error: {message}\n\n{usage}"),
            Self::Step(message) => writeln!(out, "error: {message}"),
        };
    }
}

/// Writes a line to the standard output; a reader that is gone is no failure.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

/// The workspace's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

/// A call of the cargo that called us, from the root.
pub fn cargo(arguments: &[&str]) -> Command {
    program(std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo")), arguments)
}

/// Options of cargo where what is built reads laws and computes nothing: optimising kernels would take minutes.
pub const UNOPTIMISED: [&str; 4] = [
    "--config",
    "profile.dev.package.tensormass-kernels.opt-level=0",
    "--config",
    "profile.dev.package.tensormass-runtime.opt-level=0",
];

/// A call of a program, from the root.
pub fn program(name: impl Into<OsString>, arguments: &[&str]) -> Command {
    let mut command = Command::new(name.into());
    command.args(arguments).current_dir(root());
    command
}

/// Runs a step whose output the user sees.
///
/// # Errors
/// It cannot be started, or fails.
pub fn run(step: &str, mut command: Command) -> Result<(), Failure> {
    say(&format!("== {step}"));
    let status = command.status().map_err(|error| cannot_start(step, &command, &error))?;
    if status.success() { Ok(()) } else { Err(Failure::Step(format!("{step}: {status}; see above"))) }
}

/// Runs a step and returns its standard output; its error output the user sees.
///
/// # Errors
/// It cannot be started, fails, or does not print text.
pub fn read(step: &str, mut command: Command) -> Result<String, Failure> {
    command.stderr(std::process::Stdio::inherit());
    let output = command.output().map_err(|error| cannot_start(step, &command, &error))?;
    if !output.status.success() {
        return Err(Failure::Step(format!("{step}: {}; see above", output.status)));
    }
    String::from_utf8(output.stdout).map_err(|error| Failure::Step(format!("{step}: {error}")))
}

fn cannot_start(step: &str, command: &Command, error: &std::io::Error) -> Failure {
    Failure::Step(format!("{step}: cannot run `{}`: {error}", command.get_program().to_string_lossy()))
}

/// The names (without their extension) of the files in a folder of the root that have this extension, sorted.
pub fn stems(folder: &str, extension: &str) -> Vec<String> {
    let mut stems: Vec<String> = files(&root().join(folder))
        .into_iter()
        .filter(|path| path.parent() == Some(&root().join(folder)) && path.extension().is_some_and(|e| e == extension))
        .filter_map(|path| Some(path.file_stem()?.to_str()?.to_string()))
        .collect();
    stems.sort();
    stems
}

/// All files below a folder; none if it cannot be read.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut found = Vec::new();
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found
}

//! Why a command did not succeed, and the exit status that says so.

use std::io::Write;
use std::process::ExitCode;

/// The outcomes other than success, by exit status. Scripts rely on the statuses.
#[derive(Debug)]
#[allow(dead_code, reason = "a closed contract: not every subcommand can end in every way")]
pub enum Failure {
    /// 2: the input is wrong; a message for each fault, with its place, reason and remedy.
    BadInput(Vec<String>),
    /// 3: the simulation failed; what was written until then is kept.
    Simulation(String),
    /// 130: the user interrupted; checkpoint and results are written.
    Interrupted(String),
    /// 1: anything else.
    Other(String),
    /// 0: the reader of our output has read enough (`| head -1`).
    OutputClosed,
}

impl Failure {
    /// Bad input with one fault.
    pub fn bad_input(message: impl Into<String>) -> Self {
        Self::BadInput(vec![message.into()])
    }

    /// The process's exit status.
    pub fn status(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::BadInput(_) => 2,
            Self::Simulation(_) => 3,
            Self::Interrupted(_) => 130,
            Self::Other(_) => 1,
            Self::OutputClosed => 0,
        })
    }

    /// Writes `error: ...` to the error output, for each message.
    pub fn report(&self) {
        let messages: &[String] = match self {
            Self::BadInput(messages) => messages,
            Self::Simulation(message) | Self::Interrupted(message) | Self::Other(message) => {
                std::slice::from_ref(message)
            }
            Self::OutputClosed => &[],
        };
        let mut out = std::io::stderr().lock();
        for message in messages {
            // Nobody is left to be told that the error output is closed.
            let _ = writeln!(out, "error: {message}");
        }
    }
}

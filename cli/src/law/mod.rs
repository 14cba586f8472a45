//! `tensormass law`: the laws of this build, and derivations of law files.

mod bench;
mod check;
mod derive;
mod drive;
mod explain;
mod extremes;
mod list;
mod replay;
mod show;

use clap::Subcommand;

use crate::failure::Failure;

/// The subcommands of `tensormass law`.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// List the laws of this build.
    List(list::Arguments),
    /// Show one law: source, parameters, domain, structure and the operations of its kernels.
    Show(show::Arguments),
    /// Check a law: derivatives, symmetry, objectivity, stability at rest, its domain's edge, its accuracy.
    Check(check::Arguments),
    /// Show the formulas of a law's derivation, stage by stage.
    Explain(explain::Arguments),
    /// Drive a material point through a test and print its stress-stretch curve.
    Drive(drive::Arguments),
    /// Measure how accurate a law's kernels are, from strains of 1e-8 to 10, turned and nearly incompressible.
    Extremes(extremes::Arguments),
    /// Compute one state of a material point again, and show how far each precision is off.
    Replay(replay::Arguments),
    /// Differentiate a law and write its derivation. `cargo xtask law accept` calls this.
    #[command(hide = true)]
    Derive(derive::Arguments),
}

/// Runs a subcommand.
///
/// # Errors
/// See the subcommands.
pub fn call(command: Command) -> Result<(), Failure> {
    match command {
        Command::List(arguments) => list::call(&arguments),
        Command::Show(arguments) => show::call(&arguments),
        Command::Check(arguments) => check::call(&arguments),
        Command::Explain(arguments) => explain::call(&arguments),
        Command::Drive(arguments) => drive::call(&arguments),
        Command::Extremes(arguments) => extremes::call(&arguments),
        Command::Replay(arguments) => replay::call(&arguments),
        Command::Derive(arguments) => derive::call(&arguments),
    }
}

/// How the commands name a law whose committed derivation exists and fits, and one for which it does not.
fn review(reviewed: bool) -> &'static str {
    if reviewed { "reviewed" } else { "unreviewed" }
}

/// The names of this build's laws.
fn names() -> Vec<&'static str> {
    tensormass_runtime::laws().iter().map(|law| law.info.name).collect()
}

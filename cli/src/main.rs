//! The `tensormass` command: reads the arguments, calls one subcommand, turns its outcome into an exit status.

mod bench;
mod devices;
mod failure;
mod law;
mod plan;
mod run;
mod text;
mod tradeoff;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use failure::Failure;

/// Soft-body simulation from strain energy densities.
#[derive(Debug, Parser)]
#[command(name = "tensormass", version, arg_required_else_help = true, after_help = EXIT_STATUS)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const EXIT_STATUS: &str = "Exit status: 0 done, 2 bad input, 3 the simulation failed (results until then are kept), \
                           130 interrupted, 1 anything else.";

/// One variant a subcommand, one module a variant: `run`, `plan` and those after them are added here and in
/// [`Command::call`].
#[derive(Debug, Subcommand)]
enum Command {
    /// Runs a scene.
    Run(run::Arguments),
    /// Shows what a scene will compute, and what it leaves out.
    Plan(plan::Arguments),
    /// Shows the GPUs of this machine, and which one `run --device auto` takes.
    Devices(devices::Arguments),
    /// Measures how many elements a second this machine computes.
    Bench(bench::Arguments),
    /// Measures what accuracy of a scene costs: settings against a converged reference.
    Tradeoff(tradeoff::Arguments),
    /// Constitutive laws: what this build has, and derivations of new ones.
    #[command(subcommand)]
    Law(law::Command),
}

impl Command {
    fn call(self) -> Result<(), Failure> {
        match self {
            Command::Run(arguments) => run::call(&arguments),
            Command::Plan(arguments) => plan::call(&arguments),
            Command::Devices(arguments) => devices::call(&arguments),
            Command::Bench(arguments) => bench::call(&arguments),
            Command::Tradeoff(arguments) => tradeoff::call(&arguments),
            Command::Law(command) => law::call(command),
        }
    }
}

fn main() -> ExitCode {
    // Differentiations run in a child process that is this executable again.
    tensormass_codegen::worker::run_if_requested();
    match Arguments::parse().command.call() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.report();
            failure.status()
        }
    }
}

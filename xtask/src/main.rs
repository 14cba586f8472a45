//! Development tasks, called as `cargo xtask TASK`. Links no crate of the project, so that none can break it.

mod extremes;
mod law;
mod process;
mod reproduce;

use std::process::ExitCode;

use process::{Failure, say};

const USAGE: &str = "\
Usage: cargo xtask TASK

Tasks:
  law accept NAME    write the derivation, snapshots and SymPy values of laws/NAME.rs, for review and commit
  law unreviewed     fail if a committed law has no committed derivation that fits its text
  extremes [--planted] [--gpu]
                     drive whole scenes to extremes, write docs/stability.md; with planted faults, which the suite has to find;
                     on a GPU besides
  reproduce tables-1-2 [--device cpu|cpu,gpu]
                     run the paper's traction test and its experiments, write docs/reproduction.md (some minutes)
  reproduce extremes measure the accuracy of every law, write docs/extremes.md
  reproduce convergence
                     measure the accuracy of every element, write docs/convergence.md
  reproduce choices  measure what accuracy of four scenes costs, write docs/accuracy.md (18 minutes)

Exit status: 0 done, 2 wrong arguments, 1 a step failed or is left to do (said on the error output).";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned()).collect();
    match call(&arguments.iter().map(String::as_str).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.report(USAGE);
            failure.status()
        }
    }
}

fn call(arguments: &[&str]) -> Result<(), Failure> {
    match arguments {
        ["law", "accept", name] => law::accept::call(name),
        ["law", "unreviewed"] => law::unreviewed::call(),
        ["extremes", options @ ..] => extremes::call(options),
        ["reproduce", "tables-1-2", options @ ..] => reproduce::call(options),
        ["reproduce", "extremes"] => reproduce::extremes::call(),
        ["reproduce", "convergence"] => reproduce::convergence::call(),
        ["reproduce", "choices"] => reproduce::choices::call(),
        ["help" | "-h" | "--help"] => {
            say(USAGE);
            Ok(())
        }
        [] => Err(Failure::Usage("which task?".to_string())),
        ["law", "accept", ..] => Err(Failure::Usage("`law accept` takes the name of one law".to_string())),
        ["law", "unreviewed", ..] => Err(Failure::Usage("`law unreviewed` takes no arguments".to_string())),
        ["reproduce", ..] => Err(Failure::Usage(
            "`reproduce` takes tables-1-2, and --device after it, extremes, convergence, or choices".to_string(),
        )),
        other => Err(Failure::Usage(format!("there is no task `{}`", other.join(" ")))),
    }
}

//! `tensormass law explain`: what the generator made of a law, as formulas.

use tensormass_lawbench::explain;
use tensormass_lawbench::subject::Subject;

use super::bench;
use crate::failure::Failure;
use crate::text;

/// Arguments of `law explain`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A law of this build, or the path of a law file.
    #[arg(value_name = "NAME_OR_FILE")]
    law: String,
}

/// Prints the derivation.
///
/// # Errors
/// There is no such law, or it cannot be differentiated; the output cannot be written.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let subject = Subject::open(&arguments.law).map_err(bench::subject)?;
    text::print(&explain::page(&subject.law, &subject.derivation))
}

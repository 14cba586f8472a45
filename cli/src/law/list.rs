//! `tensormass law list`: one line a law.

use super::{review, show};
use crate::failure::Failure;
use crate::text;

/// Arguments of `law list`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Print an array of the objects that `law show --json` prints.
    #[arg(long)]
    json: bool,
}

/// Prints the laws of this build.
///
/// # Errors
/// The output cannot be written.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let laws = tensormass_runtime::laws().iter();
    if arguments.json {
        return text::print_json(&laws.map(show::json).collect());
    }
    let rows: Vec<Vec<String>> = laws
        .map(|law| law.info)
        .map(|law| {
            let title = law.docs.lines().next().unwrap_or_default();
            vec![law.name.to_string(), review(law.reviewed).to_string(), title.to_string()]
        })
        .collect();
    text::print(&text::columns("", &rows))
}

//! Text for the reader: standard output that may close early, aligned columns, "did you mean".

use std::io::{ErrorKind, Write};

use crate::failure::Failure;

/// Writes to the standard output.
///
/// # Errors
/// [`Failure::OutputClosed`] if its reader is gone; [`Failure::Other`] if it cannot be written, on a full disk say.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => Failure::OutputClosed,
        _ => Failure::Other(format!("cannot write to the standard output: {error}")),
    })
}

/// Writes data as indented JSON to the standard output.
///
/// # Errors
/// See [`print()`].
pub fn print_json(value: &serde_json::Value) -> Result<(), Failure> {
    print(&format!("{value:#}\n"))
}

/// Rows of cells as lines, each column as wide as its widest cell; the last column is not padded.
pub fn columns(indent: &str, rows: &[Vec<String>]) -> String {
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|r| r.get(column)).map(|c| c.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..count).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}")).collect();
        text += indent;
        text += cells.join("  ").trim_end();
        text.push('\n');
    }
    text
}

/// "did you mean `x`? " if one of the known names is near; then the list of all.
pub fn suggest(wrong: &str, known: &[&str], what: &str) -> String {
    let near = known
        .iter()
        .map(|name| (strsim::osa_distance(&wrong.to_lowercase(), name), name))
        .filter(|(distance, name)| *distance <= name.chars().count() / 3)
        .min();
    let meant = near.map(|(_, name)| format!("did you mean `{name}`? ")).unwrap_or_default();
    format!("{meant}{what}: {}", known.join(", "))
}

#[cfg(test)]
mod tests {
    use super::{columns, suggest};

    #[test]
    fn columns_align_and_end_without_blanks() {
        let rows = [vec!["a".into(), "b".into()], vec!["long".into(), String::new()]];
        assert_eq!(columns("  ", &rows), "  a     b\n  long\n");
    }

    #[test]
    fn only_a_near_name_is_suggested() {
        let known = ["hooke", "neo_hookean"];
        assert!(suggest("Hook", &known, "the laws are").starts_with("did you mean `hooke`? "));
        assert_eq!(suggest("gent", &known, "the laws are"), "the laws are: hooke, neo_hookean");
    }
}

//! Probe tables: CSV that grows a row at a time.

use super::atomic::OutputError;
use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// A CSV file of numbers with a header line.
///
/// A row reaches the system in one piece before [`ProbeTable::append`] returns, so that a killed run keeps all its
/// rows. Numbers are the shortest text that reads back to the same bits; `NaN`, `inf` and `-inf` occur as such.
#[derive(Debug)]
pub struct ProbeTable {
    path: PathBuf,
    file: File,
    columns: usize,
    line: String,
}

impl ProbeTable {
    /// Creates (or replaces) the file, with a header of the columns' names, quoted where they need it.
    ///
    /// # Errors
    /// [`OutputError::Io`] if it cannot be written.
    pub fn create<S: AsRef<str>>(path: &Path, columns: &[S]) -> Result<ProbeTable, OutputError> {
        let mut file = File::create(path).map_err(OutputError::io(path))?;
        let names: Vec<String> = columns.iter().map(|name| quoted(name.as_ref())).collect();
        file.write_all(format!("{}\n", names.join(",")).as_bytes()).map_err(OutputError::io(path))?;
        Ok(ProbeTable { path: path.to_owned(), file, columns: columns.len(), line: String::new() })
    }

    /// Appends a row, one value a column.
    ///
    /// # Errors
    /// [`OutputError::Shape`] if the number of values is not that of the columns, [`OutputError::Io`] if the row cannot
    /// be written.
    pub fn append(&mut self, row: &[f64]) -> Result<(), OutputError> {
        if row.len() != self.columns {
            let reason = format!("a row has {} values, the table has {} columns", row.len(), self.columns);
            return Err(OutputError::shape(&self.path, reason));
        }
        self.line.clear();
        for (column, value) in row.iter().enumerate() {
            let comma = if column == 0 { "" } else { "," };
            // Debug, not Display: it takes an exponent where that is shorter.
            write!(self.line, "{comma}{value:?}").expect("writing to a String cannot fail");
        }
        self.line.push('\n');
        self.file.write_all(self.line.as_bytes()).map_err(OutputError::io(&self.path))
    }
}

/// A CSV cell (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

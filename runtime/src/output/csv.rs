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

    /// Goes on with a file of the same columns, of which rows after a time, the first column, are dropped; creates it where
    /// there is none.
    ///
    /// # Errors
    /// As [`ProbeTable::create`]; or the file cannot be read.
    pub fn resume<S: AsRef<str>>(path: &Path, columns: &[S], until: f64) -> Result<ProbeTable, OutputError> {
        let before = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(e) => return Err(OutputError::io(path)(e)),
        };
        let names: Vec<String> = columns.iter().map(|name| quoted(name.as_ref())).collect();
        let header = names.join(",");
        // A row that a killed run has not finished has no end of line.
        let whole = before.rfind('\n').map_or("", |end| &before[..end]);
        let is_before =
            |line: &&str| line.split(',').next().and_then(|t| t.parse().ok()).is_some_and(|t: f64| t <= until);
        let rows: Vec<&str> = match whole.lines().next() {
            Some(first) if first == header => whole.lines().skip(1).filter(is_before).collect(),
            _ => vec![],
        };
        let kept: String = std::iter::once(header.as_str()).chain(rows).map(|line| format!("{line}\n")).collect();
        super::atomic::write_text(path, &kept)?;
        let file = File::options().append(true).open(path).map_err(OutputError::io(path))?;
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

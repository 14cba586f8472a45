//! JSON results, such as summary.json.

use super::atomic::{OutputError, write_text};
use std::path::Path;

/// Writes a value as indented JSON with a final newline, never half-written.
///
/// # Errors
/// [`OutputError::Io`] if it cannot be written.
pub fn write_json_atomic(path: &Path, value: &serde_json::Value) -> Result<(), OutputError> {
    write_text(path, &format!("{value:#}\n"))
}

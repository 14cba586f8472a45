//! What is wrong with a law file, where, and what to do about it.

use proc_macro2::Span;

/// A refusal of a law file. Its text is
///
/// ```text
/// FILE:LINE:COLUMN: reason
///   remedy
///     the line of the law file
///         ^
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}:{column}: {reason}\n  {remedy}{}", excerpt(.source_line, *.column))]
pub struct LawError {
    /// The path as it was given to the parser.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub reason: String,
    /// What to do about it.
    pub remedy: String,
    /// The whole line of the law file.
    pub source_line: String,
}

/// Characters of a source line that a message shows; a longer line is cut around the place.
const SHOWN: usize = 120;

/// The source line and a caret under the place.
fn excerpt(line: &str, column: usize) -> String {
    if line.trim().is_empty() {
        return String::new();
    }
    let first = column.saturating_sub(SHOWN - 20);
    let shown: String = line.chars().skip(first).take(SHOWN).collect();
    // Tabs are kept, so that the caret stands under its character whatever their width.
    let before = line.chars().skip(first).take(column.saturating_sub(1).saturating_sub(first));
    let padding: String = before.map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
    format!("\n    {}\n    {padding}^", shown.trim_end())
}

/// A place in a law file: line and column, both from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl From<Span> for Place {
    fn from(span: Span) -> Place {
        let start = span.start();
        Place { line: start.line, column: start.column + 1 }
    }
}

/// A law file's path and text: what it takes to report an error in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) path: &'a str,
    pub(super) text: &'a str,
}

impl Source<'_> {
    /// An error at `place`, moved into the file where it lies outside (the end of the input, say).
    pub(super) fn error(
        &self,
        place: impl Into<Place>,
        reason: impl Into<String>,
        remedy: impl Into<String>,
    ) -> LawError {
        let place = place.into();
        let last = self.text.lines().count().max(1);
        let line = place.line.clamp(1, last);
        let source_line = self.text.lines().nth(line - 1).unwrap_or_default();
        let column = place.column.clamp(1, source_line.chars().count() + 1);
        LawError {
            file: self.path.to_owned(),
            line,
            column,
            reason: reason.into(),
            remedy: remedy.into(),
            source_line: source_line.to_owned(),
        }
    }
}

//! What is wrong with a scene: the place, the source line, the reason, and what to do.

use std::fmt;

/// A place in a scene file, or in a `--set` argument.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// The scene file as it was named; `--set` for an override.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Number of characters to underline, at least 1.
    pub width: usize,
    /// The line of the file; the whole argument for an override.
    pub source_line: String,
}

/// The `file` of places in overrides.
pub(super) const SET: &str = "--set";

impl Location {
    /// The place of a range of bytes in a text.
    pub(super) fn in_text(file: &str, text: &str, span: std::ops::Range<usize>) -> Self {
        // A parser may point inside a character or behind the end.
        let floor = |mut at: usize| {
            at = at.min(text.len());
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            at
        };
        let mut start = floor(span.start);
        // The end of the last line, not the start of a line that does not exist.
        if start == text.len() && text.ends_with('\n') {
            start -= 1;
        }
        let end = floor(span.end).max(start);
        // An argument is one line, whatever is in it.
        let (line_start, line_end) = match file {
            SET => (0, text.len()),
            _ => (
                text[..start].rfind('\n').map_or(0, |i| i + 1),
                text[start..].find('\n').map_or(text.len(), |i| start + i),
            ),
        };
        Self {
            file: file.to_owned(),
            line: text[..line_start].matches('\n').count() + 1,
            column: text[line_start..start].chars().count() + 1,
            width: text[start..end.min(line_end).max(start)].trim_end().chars().count().max(1),
            source_line: if file == SET { text } else { text[line_start..line_end].trim_end() }.to_owned(),
        }
    }

    /// Whether it is in a `--set` argument.
    pub fn is_override(&self) -> bool {
        self.file == SET
    }
}

/// Why a scene was refused.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("{path}: the scene cannot be read: {source}\n  = help: check the path and the permissions")]
    Read {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The text, or an override, is wrong.
    #[error("{0}")]
    At(Box<Fault>),
}

/// Something wrong at a place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Where.
    pub location: Location,
    /// What is wrong.
    pub reason: String,
    /// What to do.
    pub remedy: String,
}

impl SceneError {
    /// An error at a place, such as [`super::Scene::locate`] gives.
    pub fn at(location: Location, reason: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::At(Box::new(Fault { location, reason: reason.into(), remedy: remedy.into() }))
    }

    /// The place, if the error has one.
    pub fn location(&self) -> Option<&Location> {
        match self {
            Self::Read { .. } => None,
            Self::At(fault) => Some(&fault.location),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { location: at, reason, remedy } = self;
        if at.is_override() {
            return write!(f, "{SET} {}: {reason}\n  = help: {remedy}", at.source_line);
        }
        let number = at.line.to_string();
        let margin = " ".repeat(number.len());
        // Tabs stay tabs, so that the caret stands below its character.
        let before: String =
            at.source_line.chars().take(at.column - 1).map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        writeln!(f, "{}:{}:{}: {reason}", at.file, at.line, at.column)?;
        writeln!(f, "{margin} |")?;
        writeln!(f, "{number} | {}", at.source_line)?;
        writeln!(f, "{margin} | {before}{}", "^".repeat(at.width))?;
        write!(f, "{margin} = help: {remedy}")
    }
}

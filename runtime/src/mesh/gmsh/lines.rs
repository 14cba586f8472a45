//! Lines and words of a text file, with their numbers in every message.

use std::str::{FromStr, SplitAsciiWhitespace};

/// What is wrong with the text, where, and what to do.
#[derive(Debug)]
pub(super) struct Problem {
    pub(super) line: usize,
    pub(super) reason: String,
    pub(super) remedy: String,
}

/// A line that is not blank, without the blanks around it.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    pub(super) number: usize,
    pub(super) text: &'a str,
}

impl<'a> Line<'a> {
    pub(super) fn problem(&self, reason: String, remedy: impl Into<String>) -> Problem {
        Problem { line: self.number, reason, remedy: remedy.into() }
    }

    /// The start of the line: a message need not carry a megabyte.
    pub(super) fn excerpt(&self) -> String {
        shortened(self.text)
    }

    pub(super) fn words(&self) -> Words<'a> {
        Words { line: *self, words: self.text.split_ascii_whitespace() }
    }

    /// The number in the width that elements and nodes keep it in; it only serves messages.
    pub(super) fn number_u32(&self) -> u32 {
        u32::try_from(self.number).unwrap_or(u32::MAX)
    }
}

fn shortened(text: &str) -> String {
    match text.char_indices().nth(40) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// The rest of the words of a line.
pub(super) struct Words<'a> {
    line: Line<'a>,
    words: SplitAsciiWhitespace<'a>,
}

impl<'a> Words<'a> {
    /// The next word.
    pub(super) fn word(&mut self, what: &str) -> Result<&'a str, Problem> {
        let line = self.line;
        self.words.next().ok_or_else(|| {
            line.problem(format!("the line ends where {what} was expected"), "complete the line or save the mesh again")
        })
    }

    /// The next word as a number.
    pub(super) fn read<T: FromStr>(&mut self, what: &str) -> Result<T, Problem> {
        let line = self.line;
        let word = self.word(what)?;
        word.parse().map_err(|_| {
            let remedy = if word.starts_with('$') {
                "the section's count is larger than its content: correct it, or save the mesh again"
            } else {
                "correct the line or save the mesh again"
            };
            line.problem(format!("expected {what}, found `{}`", shortened(word)), remedy)
        })
    }

    /// Refuses further words.
    pub(super) fn end(mut self) -> Result<(), Problem> {
        match self.words.next() {
            None => Ok(()),
            Some(word) => Err(self.line.problem(
                format!("the line goes on with `{}` where it should end", shortened(word)),
                "correct the line or save the mesh again",
            )),
        }
    }
}

/// A file's lines.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Lines { rest: bytes, number: 0 }
    }

    /// The next line's bytes, blank or not.
    fn next_raw(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|byte| *byte == b'\n').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        self.number += 1;
        Some(line.trim_ascii())
    }

    /// The next line that is not blank; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Line<'a>>, Problem> {
        while let Some(bytes) = self.next_raw() {
            if bytes.is_empty() {
                continue;
            }
            let text = std::str::from_utf8(bytes).map_err(|_| {
                self.problem_here(
                    "the line is not UTF-8 text".to_owned(),
                    "if the file is binary, save it as ASCII; if a name has accents, write it in UTF-8",
                )
            })?;
            return Ok(Some(Line { number: self.number, text }));
        }
        Ok(None)
    }

    /// The next line that is not blank.
    pub(super) fn expect(&mut self, what: &str) -> Result<Line<'a>, Problem> {
        self.next()?.ok_or_else(|| {
            self.problem_here(
                format!("the file ends where {what} was expected"),
                "it is truncated, or a count is too large: save it again",
            )
        })
    }

    /// A line that holds one count.
    pub(super) fn count(&mut self, what: &str) -> Result<u64, Problem> {
        let mut words = self.expect(what)?.words();
        let count = words.read(what)?;
        words.end()?;
        Ok(count)
    }

    /// How much to reserve for `count` lines of at least `bytes` bytes: never more than the rest of the file can hold,
    /// whatever its header claims.
    pub(super) fn capacity(&self, count: u64, bytes: usize) -> usize {
        usize::try_from(count).unwrap_or(usize::MAX).min(self.rest.len() / bytes)
    }

    /// Reads the end of a section.
    pub(super) fn end_section(&mut self, section: &str) -> Result<(), Problem> {
        let line = self.expect(&format!("$End{section}"))?;
        if line.text.strip_prefix("$End") == Some(section) {
            return Ok(());
        }
        Err(line.problem(
            format!("expected $End{section}, found `{}`", line.excerpt()),
            format!("check the counts of ${section}, or save the mesh again"),
        ))
    }

    /// Skips a section that the mesh does not need, such as `$NodeData`.
    pub(super) fn skip_section(&mut self, start: &Line<'_>, section: &str) -> Result<(), Problem> {
        while let Some(line) = self.next_raw() {
            if line.strip_prefix(b"$End") == Some(section.as_bytes()) {
                return Ok(());
            }
        }
        let starts = start.number;
        Err(self.problem_here(
            format!("the file ends within ${section}, which starts at line {starts}"),
            "it is truncated: save it again",
        ))
    }

    /// A problem at the line that was read last.
    pub(super) fn problem_here(&self, reason: String, remedy: &str) -> Problem {
        Problem { line: self.number.max(1), reason, remedy: remedy.to_owned() }
    }
}

//! Finds unbalanced brackets, and unclosed comments and strings, before syn does: its message names no opening bracket.

use super::error::{LawError, Place, Source};

/// Brackets may be nested this deep: syn and the passes recurse, and a law needs a tenth of it.
pub(super) const MAX_DEPTH: usize = 64;

/// Characters of a text, with their places.
struct Cursor<'a> {
    rest: std::iter::Peekable<std::str::Chars<'a>>,
    place: Place,
}

impl Cursor<'_> {
    fn next(&mut self) -> Option<char> {
        let c = self.rest.next()?;
        if c == '\n' {
            self.place = Place { line: self.place.line + 1, column: 1 };
        } else {
            self.place.column += 1;
        }
        Some(c)
    }

    fn peek(&mut self) -> Option<char> {
        self.rest.peek().copied()
    }

    fn skip_line(&mut self) {
        while self.peek().is_some_and(|c| c != '\n') {
            self.next();
        }
    }

    /// Skips a block comment, whose `/*` was read; false if it has no end.
    fn skip_block(&mut self) -> bool {
        let mut depth = 1;
        while let Some(c) = self.next() {
            if c == '*' && self.peek() == Some('/') {
                self.next();
                depth -= 1;
            } else if c == '/' && self.peek() == Some('*') {
                self.next();
                depth += 1;
            }
            if depth == 0 {
                return true;
            }
        }
        false
    }

    /// Skips a string, whose opening quote was read; false if it has no end.
    fn skip_string(&mut self) -> bool {
        while let Some(c) = self.next() {
            match c {
                '"' => return true,
                '\\' => {
                    self.next();
                }
                _ => {}
            }
        }
        false
    }

    /// Skips a raw string from its first `#` or quote; false if it has no end. `r#name` is no string, and is left.
    fn skip_raw_string(&mut self) -> bool {
        let mut hashes = 0;
        while self.peek() == Some('#') {
            self.next();
            hashes += 1;
        }
        if self.peek() != Some('"') {
            return true;
        }
        self.next();
        while let Some(c) = self.next() {
            let mut found = 0;
            while c == '"' && found < hashes && self.peek() == Some('#') {
                self.next();
                found += 1;
            }
            if c == '"' && found == hashes {
                return true;
            }
        }
        false
    }

    /// Skips a character literal, whose quote was read. A lifetime has no closing quote: its name follows.
    fn skip_char(&mut self) {
        if self.peek() == Some('\\') {
            self.next();
            self.next();
            while self.peek().is_some_and(|c| c != '\'' && c != '\n') {
                self.next();
            }
            self.next();
            return;
        }
        let mut ahead = self.rest.clone();
        ahead.next();
        if ahead.next() == Some('\'') {
            self.next();
            self.next();
        }
    }
}

fn closing(open: char) -> char {
    match open {
        '(' => ')',
        '[' => ']',
        _ => '}',
    }
}

/// Refuses text whose brackets do not match, or nest deeper than [`MAX_DEPTH`].
pub(super) fn check(source: &Source) -> Result<(), LawError> {
    let mut cursor = Cursor { rest: source.text.chars().peekable(), place: Place { line: 1, column: 1 } };
    let mut open: Vec<(char, Place)> = Vec::new();
    loop {
        let place = cursor.place;
        let Some(c) = cursor.next() else { break };
        match c {
            '/' if cursor.peek() == Some('/') => cursor.skip_line(),
            '/' if cursor.peek() == Some('*') => {
                cursor.next();
                if !cursor.skip_block() {
                    return Err(source.error(place, "this comment has no end", "end it with `*/`"));
                }
            }
            '"' if !cursor.skip_string() => return Err(unclosed_string(source, place)),
            '\'' => cursor.skip_char(),
            c if c.is_alphabetic() || c == '_' => {
                let mut word = String::from(c);
                while let Some(c) = cursor.peek().filter(|c| c.is_alphanumeric() || *c == '_') {
                    word.push(c);
                    cursor.next();
                }
                if matches!(word.as_str(), "r" | "br" | "cr") && !cursor.skip_raw_string() {
                    return Err(unclosed_string(source, place));
                }
            }
            '(' | '[' | '{' => {
                open.push((c, place));
                if open.len() > MAX_DEPTH {
                    return Err(source.error(
                        place,
                        format!("brackets are nested more than {MAX_DEPTH} deep"),
                        "name inner values by `let`",
                    ));
                }
            }
            ')' | ']' | '}' => match open.pop() {
                None => {
                    let remedy = "remove it, or add the bracket that it should close";
                    return Err(source.error(place, format!("`{c}` closes nothing"), remedy));
                }
                Some((o, at)) if closing(o) != c => {
                    let reason = format!("`{c}` cannot close the `{o}` at {}:{}", at.line, at.column);
                    let remedy = format!("close that `{o}` with `{}` before this place", closing(o));
                    return Err(source.error(place, reason, remedy));
                }
                Some(_) => {}
            },
            _ => {}
        }
    }
    match open.pop() {
        None => Ok(()),
        Some((o, at)) => {
            Err(source.error(at, format!("this `{o}` is never closed"), format!("add the missing `{}`", closing(o))))
        }
    }
}

fn unclosed_string(source: &Source, place: Place) -> LawError {
    source.error(place, "this text has no closing quote", "end it with `\"`")
}

//! Overrides from the command line: `--set path.to.key=VALUE`.

use super::document::{Data, Node, Origin, node};
use super::error::{Location, SET, SceneError};
use std::ops::Range;
use std::str::FromStr;
use toml::de::DeValue;

/// Steps of a path, at most: more than any key of a scene has.
const LONGEST_PATH: usize = 16;

/// One change to a scene, such as `solver.step=1e-4`, `material.0.density=900` or `solver.integrator=static`.
///
/// The value is a TOML value; text that starts with a letter and is no TOML value is taken as a string.
#[derive(Debug, Clone)]
pub struct Override {
    text: String,
    path: Vec<(String, Range<usize>)>,
    value: Node,
}

impl Override {
    /// Reads `path.to.key=VALUE`.
    ///
    /// # Errors
    /// The part of the argument that is not of that form.
    pub fn parse(text: &str) -> Result<Self, SceneError> {
        let refuse = |span: Range<usize>, reason: &str, remedy: &str| {
            Err(SceneError::at(Location::in_text(SET, text, span), reason, remedy))
        };
        let Some(equals) = text.find('=') else {
            return refuse(
                0..text.len(),
                "there is no `=`",
                "write --set path.to.key=VALUE, for example --set solver.step=1e-4",
            );
        };
        let mut path = Vec::new();
        let mut start = 0;
        for step in text[..equals].split('.') {
            let span = start..start + step.len();
            start = span.end + 1;
            let step = step.trim();
            if step.is_empty() || !step.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-') {
                return refuse(
                    span,
                    "the path is not made of keys and indices",
                    "write keys joined by dots, as in material.0.density=900",
                );
            }
            path.push((step.to_owned(), span));
        }
        if path.len() > LONGEST_PATH {
            return refuse(0..equals, "the path is longer than any key of a scene", "see the keys in docs/scenes.md");
        }
        let from = equals + 1 + (text[equals + 1..].len() - text[equals + 1..].trim_start().len());
        let raw = text[from..].trim_end();
        let span = from..from + raw.len();
        let value = match DeValue::parse(raw) {
            Ok(value) => match node(&value, 0..0, Origin::File) {
                Ok(mut value) => {
                    shift(&mut value, from);
                    value
                }
                Err((wrong, reason, remedy)) => return refuse(from + wrong.start..from + wrong.end, &reason, remedy),
            },
            Err(_) if raw.starts_with(|c: char| c.is_alphabetic() || c == '_') => {
                Node { origin: Origin::File, key: span.clone(), span, data: Data::String(raw.to_owned()) }
            }
            Err(_) if raw.is_empty() => {
                return refuse(
                    0..text.len(),
                    "there is no value",
                    "write a value after the `=`; an empty string is \"\"",
                );
            }
            Err(error) => {
                let reason = format!("the value is not TOML: {}", error.message());
                return refuse(span, &reason, "write a number, \"text\", true, false, [..] or { key = value }");
            }
        };
        Ok(Self { text: text.to_owned(), path, value })
    }

    /// The argument as it was given.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Keys and indices with their places in the argument.
    pub(super) fn path(&self) -> &[(String, Range<usize>)] {
        &self.path
    }

    /// The value, said to be from `origin`.
    pub(super) fn node(&self, origin: Origin) -> Node {
        let mut value = self.value.clone();
        mark(&mut value, origin);
        if let Some((_, span)) = self.path.last() {
            value.key = span.clone();
        }
        value
    }
}

impl FromStr for Override {
    type Err = SceneError;

    fn from_str(text: &str) -> Result<Self, SceneError> {
        Self::parse(text)
    }
}

/// From places in the value's text to places in the argument.
fn shift(node: &mut Node, by: usize) {
    each(node, &mut |node| {
        node.key = node.key.start + by..node.key.end + by;
        node.span = node.span.start + by..node.span.end + by;
    });
}

fn mark(node: &mut Node, origin: Origin) {
    each(node, &mut |node| node.origin = origin);
}

fn each(node: &mut Node, change: &mut impl FnMut(&mut Node)) {
    change(node);
    match &mut node.data {
        Data::Array(items) => items.iter_mut().for_each(|item| each(item, change)),
        Data::Table(entries) => entries.iter_mut().for_each(|(_, entry)| each(entry, change)),
        Data::String(_) | Data::Integer(_) | Data::Float(_) | Data::Boolean(_) | Data::Datetime => {}
    }
}

//! The TOML document as a tree in which every key and value knows where it was written: in the file or in an override.

use super::error::{Location, SET, SceneError};
use super::overrides::Override;
use super::predicate::ExpressionError;
use super::suggest::nearest;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Tables and arrays inside each other, at most.
const DEEPEST: usize = 32;

/// A value with its place.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub origin: Origin,
    /// The key in front of the value, in bytes of the origin's text; for a table with a header, its name there.
    pub key: Range<usize>,
    /// The value, in bytes of the origin's text; for a table with a header, the header.
    pub span: Range<usize>,
    pub data: Data,
}

/// The text that a span belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    File,
    /// The index of an override.
    Override(usize),
}

/// TOML's values.
#[derive(Debug, Clone)]
pub(super) enum Data {
    String(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Datetime,
    Array(Vec<Node>),
    /// In the order of the text.
    Table(Vec<(String, Node)>),
}

impl Data {
    /// The kind of value, with its article.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::String(_) => "a string",
            Self::Integer(_) => "an integer",
            Self::Float(_) => "a number",
            Self::Boolean(_) => "true or false",
            Self::Datetime => "a date or time",
            Self::Array(_) => "an array",
            Self::Table(_) => "a table",
        }
    }
}

impl Node {
    /// The entry of a table by its key, or of an array by its index.
    pub fn child(&self, step: &str) -> Option<&Self> {
        match &self.data {
            Data::Table(entries) => entries.iter().find(|(key, _)| key == step).map(|(_, node)| node),
            Data::Array(items) => items.get(step.parse::<usize>().ok()?),
            Data::String(_) | Data::Integer(_) | Data::Float(_) | Data::Boolean(_) | Data::Datetime => None,
        }
    }

    /// The value for serde. Dates, which no scene has, and numbers that are not finite become null.
    pub fn to_json(&self) -> serde_json::Value {
        match &self.data {
            Data::String(value) => value.clone().into(),
            Data::Integer(value) => (*value).into(),
            Data::Float(value) => (*value).into(),
            Data::Boolean(value) => (*value).into(),
            Data::Datetime => serde_json::Value::Null,
            Data::Array(items) => items.iter().map(Self::to_json).collect(),
            Data::Table(entries) => entries.iter().map(|(key, node)| (key.clone(), node.to_json())).collect(),
        }
    }
}

/// What a parsed value cannot be: the place, the reason and the remedy.
pub(super) type Refusal = (Range<usize>, String, &'static str);

/// A parsed value as a tree.
pub(super) fn node(value: &Spanned<DeValue<'_>>, key: Range<usize>, origin: Origin) -> Result<Node, Refusal> {
    convert(value.get_ref(), value.span(), key, origin, 0)
}

fn convert(
    value: &DeValue<'_>,
    span: Range<usize>,
    key: Range<usize>,
    origin: Origin,
    depth: usize,
) -> Result<Node, Refusal> {
    if depth > DEEPEST {
        return Err((
            span,
            format!("more than {DEEPEST} tables or arrays inside each other"),
            "no scene needs that; take it apart",
        ));
    }
    let data = match value {
        DeValue::String(text) => Data::String(text.to_string()),
        DeValue::Integer(digits) => match i64::from_str_radix(digits.as_str(), digits.radix()) {
            Ok(value) => Data::Integer(value),
            Err(_) => {
                return Err((span, "the integer has too many digits".to_owned(), "write it as a number like 1e20"));
            }
        },
        // Too large a number becomes infinite and is refused as such with its key's name.
        DeValue::Float(digits) => Data::Float(digits.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(value) => Data::Boolean(*value),
        DeValue::Datetime(_) => Data::Datetime,
        DeValue::Array(items) => Data::Array(
            items
                .iter()
                .map(|item| convert(item.get_ref(), item.span(), item.span(), origin, depth + 1))
                .collect::<Result<_, _>>()?,
        ),
        DeValue::Table(entries) => {
            let mut entries = entries
                .iter()
                .map(|(key, value)| {
                    let node = convert(value.get_ref(), value.span(), key.span(), origin, depth + 1)?;
                    Ok((key.get_ref().to_string(), node))
                })
                .collect::<Result<Vec<_>, Refusal>>()?;
            entries.sort_by_key(|(_, node)| node.key.start);
            Data::Table(entries)
        }
    };
    Ok(Node { origin, key, span, data })
}

/// A parsed scene file with its overrides.
#[derive(Debug, Clone)]
pub(super) struct Document {
    file: String,
    text: String,
    overrides: Vec<String>,
    pub root: Node,
}

impl Document {
    /// Reads the text of a file.
    pub fn parse(text: &str, file: &str) -> Result<Self, SceneError> {
        let refuse = |span, reason: String, remedy: &str| {
            Err(SceneError::at(Location::in_text(file, text, span), reason, remedy))
        };
        let table = match DeTable::parse(text) {
            Ok(table) => table,
            Err(error) => {
                let reason = format!("not TOML: {}", error.message());
                return refuse(error.span().unwrap_or(0..0), reason, "see https://toml.io for the syntax");
            }
        };
        let root = DeValue::Table(table.into_inner());
        match convert(&root, 0..0, 0..0, Origin::File, 0) {
            Ok(root) => Ok(Self { file: file.to_owned(), text: text.to_owned(), overrides: Vec::new(), root }),
            Err((span, reason, remedy)) => refuse(span, reason, remedy),
        }
    }

    /// Puts the value of an override into the tree.
    pub fn apply(&mut self, change: &Override) -> Result<(), SceneError> {
        let origin = Origin::Override(self.overrides.len());
        self.overrides.push(change.text().to_owned());
        let refuse = |span: &Range<usize>, reason: String, remedy: String| {
            Err(SceneError::at(Location::in_text(SET, change.text(), span.clone()), reason, remedy))
        };
        let mut at = &mut self.root;
        let mut passed = String::new();
        for (i, (step, span)) in change.path().iter().enumerate() {
            let last = i + 1 == change.path().len();
            at = match &mut at.data {
                Data::Table(entries) => {
                    let index = entries.iter().position(|(key, _)| key == step).unwrap_or_else(|| {
                        let data = Data::Table(Vec::new());
                        entries.push((step.clone(), Node { origin, key: span.clone(), span: span.clone(), data }));
                        entries.len() - 1
                    });
                    &mut entries[index].1
                }
                Data::Array(items) => {
                    let count = items.len();
                    match step.parse::<usize>().ok().and_then(|index| items.get_mut(index)) {
                        Some(item) => item,
                        None => {
                            let known = match count {
                                0 => "it is empty".to_owned(),
                                1 => "its only index is 0".to_owned(),
                                _ => format!("its indices are 0 to {}", count - 1),
                            };
                            return refuse(
                                span,
                                format!("`{step}` is not an index of the array `{passed}`"),
                                format!("write {passed}.INDEX; {known}"),
                            );
                        }
                    }
                }
                data => {
                    let kind = data.kind();
                    return refuse(
                        span,
                        format!("`{passed}` is {kind}: it has no `{step}`"),
                        format!("set {passed} itself"),
                    );
                }
            };
            passed = join(&passed, step);
            if last {
                *at = change.node(origin);
            }
        }
        Ok(())
    }

    /// The place of a span.
    pub fn place(&self, origin: Origin, span: Range<usize>) -> Location {
        match origin {
            Origin::File => Location::in_text(&self.file, &self.text, span),
            Origin::Override(index) => Location::in_text(SET, &self.overrides[index], span),
        }
    }

    /// The place of a value.
    pub fn at(&self, node: &Node) -> Location {
        self.place(node.origin, node.span.clone())
    }

    /// The place of the key in front of a value.
    pub fn at_key(&self, node: &Node) -> Location {
        self.place(node.origin, node.key.clone())
    }

    /// The node at a path of keys and indices joined by dots, or its nearest ancestor.
    pub fn find(&self, path: &str) -> &Node {
        let mut node = &self.root;
        for step in path.split('.').filter(|step| !step.is_empty()) {
            match node.child(step) {
                Some(child) => node = child,
                None => break,
            }
        }
        node
    }

    /// An error inside a string: at the wrong characters where the text has them as they are, else at the string.
    pub fn expression(&self, node: &Node, path: &str, error: &ExpressionError) -> SceneError {
        let source = match node.origin {
            Origin::File => &self.text,
            Origin::Override(index) => &self.overrides[index],
        };
        let mut span = node.span.clone();
        if let (Data::String(value), Some(raw)) = (&node.data, source.get(span.clone())) {
            // The value follows one or three quotes, after which a first line break is left out; escapes shift it.
            if let Some(start) = ["\"", "'", "\"\"\"", "'''", "\"\"\"\n", "'''\n", ""]
                .iter()
                .find(|quotes| raw.strip_prefix(**quotes).is_some_and(|rest| rest.starts_with(value.as_str())))
            {
                let start = span.start + start.len();
                span = start + error.span.start..start + error.span.end;
            }
        }
        SceneError::at(self.place(node.origin, span), format!("`{path}`: {}", error.reason), error.remedy.clone())
    }
}

/// A path with one more step.
pub(super) fn join(path: &str, step: &str) -> String {
    if path.is_empty() { step.to_owned() } else { format!("{path}.{step}") }
}

/// "did you mean `b`? known are `a`, `b`".
pub(super) fn known_names(wrong: &str, known: &[&str], what: &str) -> String {
    let hint = nearest(wrong, known.iter().copied()).map_or(String::new(), |name| format!("did you mean `{name}`? "));
    let list = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    format!("{hint}{what} {list}")
}

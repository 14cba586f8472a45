//! Checks a document against the JSON schema: keys, types, names, ranges, lengths, conditions.
//!
//! Of JSON schema it knows what schemars makes of the scene's types: `$ref`, `anyOf`/`oneOf` as alternatives, `type`,
//! `const`, `enum`, `properties`, `required`, `additionalProperties`, `items`, `prefixItems`, `minItems`, `maxItems`,
//! `minLength`, the four bounds of numbers, and the formats of `selection`. A test refuses schemas with anything else.
//! It stops at the first error, in the order of the text.

use super::document::{Data, Document, Node, join, known_names};
use super::error::{Location, SceneError};
use super::predicate::Predicate;
use super::schema::json_schema;
use super::selection::{BOX_FORMAT, CONDITION_FORMAT, Selection, TEXT_FORMAT};
use serde_json::Value;
use std::sync::OnceLock;

/// Checks the whole document.
pub(super) fn check(document: &Document) -> Result<(), SceneError> {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    let root = SCHEMA.get_or_init(json_schema);
    Shape { root, document }.value(root, &document.root, "", "")
}

struct Shape<'s> {
    root: &'s Value,
    document: &'s Document,
}

impl<'s> Shape<'s> {
    /// Checks a value; `about` describes the key that holds it.
    fn value(&self, schema: &'s Value, node: &Node, path: &str, about: &str) -> Result<(), SceneError> {
        let about = Some(self.about(schema)).filter(|text| !text.is_empty()).unwrap_or(about);
        let mut leaves = Vec::new();
        self.leaves(schema, &mut leaves);
        let fitting: Vec<&Value> = leaves.iter().copied().filter(|leaf| fits(leaf, &node.data)).collect();
        let Some(&first) = fitting.first() else {
            let mut kinds: Vec<&str> = leaves.iter().map(|leaf| kind(leaf)).collect();
            kinds.dedup();
            let kinds = alternatives(&kinds);
            return Err(self.wrong(node, format!("`{path}` must be {kinds}, not {}", node.data.kind()), about));
        };
        let about = described(first).filter(|_| fitting.len() == 1).unwrap_or(about);
        match &node.data {
            Data::String(text) => self.string(&fitting, text, node, path, about),
            Data::Integer(value) => self.number(first, *value as f64, &value.to_string(), node, path, about),
            Data::Float(value) => self.number(first, *value, &written(*value), node, path, about),
            Data::Boolean(_) | Data::Datetime => Ok(()),
            Data::Array(items) => self.array(first, items, node, path, about),
            Data::Table(entries) => self.table(&fitting, entries, node, path),
        }
    }

    /// The schemas without alternatives that a schema stands for.
    fn leaves(&self, schema: &'s Value, found: &mut Vec<&'s Value>) {
        if let Some(name) = schema["$ref"].as_str().and_then(|name| name.strip_prefix("#/$defs/")) {
            return self.leaves(&self.root["$defs"][name], found);
        }
        match schema["oneOf"].as_array().or(schema["anyOf"].as_array()) {
            Some(branches) => branches.iter().for_each(|branch| self.leaves(branch, found)),
            None => found.push(schema),
        }
    }

    fn string(&self, leaves: &[&Value], text: &str, node: &Node, path: &str, about: &str) -> Result<(), SceneError> {
        let Some(&free) = leaves.iter().find(|leaf| names(leaf).is_empty()) else {
            let known: Vec<&str> = leaves.iter().flat_map(|leaf| names(leaf)).collect();
            if known.contains(&text) {
                return Ok(());
            }
            let reason = format!("`{path}` cannot be \"{text}\"");
            return Err(SceneError::at(self.document.at(node), reason, known_names(text, &known, "known are")));
        };
        if text.chars().count() < free["minLength"].as_u64().unwrap_or(0) as usize {
            return Err(self.wrong(node, format!("`{path}` is empty"), about));
        }
        let parsed = match free["format"].as_str() {
            Some(TEXT_FORMAT) => Selection::parse(text).map(drop),
            Some(CONDITION_FORMAT) => Predicate::parse(text).map(drop),
            _ => Ok(()),
        };
        parsed.map_err(|error| self.document.expression(node, path, &error))
    }

    fn number(
        &self,
        leaf: &Value,
        value: f64,
        written: &str,
        node: &Node,
        path: &str,
        about: &str,
    ) -> Result<(), SceneError> {
        if !value.is_finite() {
            return Err(self.wrong(node, format!("`{path}` must be a finite number"), about));
        }
        let bound = |name: &str| leaf[name].as_f64();
        let bounds = [
            (bound("exclusiveMinimum"), "above", value > bound("exclusiveMinimum").unwrap_or(f64::NEG_INFINITY)),
            (bound("minimum"), "at least", value >= bound("minimum").unwrap_or(f64::NEG_INFINITY)),
            (bound("exclusiveMaximum"), "below", value < bound("exclusiveMaximum").unwrap_or(f64::INFINITY)),
            (bound("maximum"), "at most", value <= bound("maximum").unwrap_or(f64::INFINITY)),
        ];
        if bounds.iter().all(|&(_, _, holds)| holds) {
            return Ok(());
        }
        let wanted: Vec<String> =
            bounds.iter().filter_map(|&(bound, word, _)| Some(format!("{word} {}", self::written(bound?)))).collect();
        Err(self.wrong(node, format!("`{path}` is {written}, but must be {}", wanted.join(" and ")), about))
    }

    fn array(&self, leaf: &'s Value, items: &[Node], node: &Node, path: &str, about: &str) -> Result<(), SceneError> {
        let (least, most) = (leaf["minItems"].as_u64(), leaf["maxItems"].as_u64());
        let count = items.len() as u64;
        if least.is_some_and(|least| count < least) || most.is_some_and(|most| count > most) {
            let reason = match (least, most) {
                (Some(least), Some(most)) if least == most => format!("`{path}` must hold {least} values, not {count}"),
                (_, Some(most)) if count > most => format!("`{path}` must hold at most {most} values, not {count}"),
                _ => format!("`{path}` is empty"),
            };
            return Err(self.wrong(node, reason, about));
        }
        for (i, item) in items.iter().enumerate() {
            let schema = leaf["prefixItems"].get(i).unwrap_or(&leaf["items"]);
            self.value(schema, item, &join(path, &i.to_string()), about)?;
        }
        Ok(())
    }

    fn table(
        &self,
        leaves: &[&'s Value],
        entries: &[(String, Node)],
        node: &Node,
        path: &str,
    ) -> Result<(), SceneError> {
        let here = if path.is_empty() { "the scene".to_owned() } else { format!("`{path}`") };
        let leaf = self.table_leaf(leaves, entries, node, path, &here)?;
        for (key, entry) in entries {
            let inside = join(path, key);
            let schema = match (leaf["properties"].get(key), &leaf["additionalProperties"]) {
                (Some(schema), _) => schema,
                (None, free @ Value::Object(_)) => free,
                (None, _) => return Err(self.unknown(entry, key, &here, &properties(leaf))),
            };
            self.value(schema, entry, &inside, "")?;
        }
        for key in required(leaf) {
            if !entries.iter().any(|(name, _)| name == key) {
                let about = self.about(&leaf["properties"][key]);
                return Err(SceneError::at(
                    self.whole(node),
                    format!("{here} has no key `{key}`"),
                    format!("write {key} = ..: {about}"),
                ));
            }
        }
        if leaf["format"] == BOX_FORMAT {
            self.ordered(node, path)?;
        }
        Ok(())
    }

    /// Which of several kinds of table it is: by the value of the key that names the kind, or else by the key that
    /// only one of them has.
    fn table_leaf(
        &self,
        leaves: &[&'s Value],
        entries: &[(String, Node)],
        node: &Node,
        path: &str,
        here: &str,
    ) -> Result<&'s Value, SceneError> {
        if let [only] = leaves {
            return Ok(only);
        }
        let tag = required(leaves[0]).find(|key| leaves.iter().all(|leaf| !leaf["properties"][key]["const"].is_null()));
        if let Some(tag) = tag {
            let kinds: Vec<&str> = leaves.iter().filter_map(|leaf| leaf["properties"][tag]["const"].as_str()).collect();
            let Some((_, entry)) = entries.iter().find(|(key, _)| key == tag) else {
                let remedy = known_names("", &kinds, &format!("write {tag} = \"..\"; known are"));
                return Err(SceneError::at(self.whole(node), format!("{here} has no key `{tag}`"), remedy));
            };
            let inside = join(path, tag);
            let Data::String(text) = &entry.data else {
                let reason = format!("`{inside}` must be a string, not {}", entry.data.kind());
                return Err(SceneError::at(self.document.at(entry), reason, known_names("", &kinds, "known are")));
            };
            return leaves.iter().copied().find(|leaf| leaf["properties"][tag]["const"] == text.as_str()).ok_or_else(
                || {
                    let reason = format!("`{inside}` cannot be \"{text}\"");
                    SceneError::at(self.document.at(entry), reason, known_names(text, &kinds, "known are"))
                },
            );
        }
        let common = |key: &str| leaves.iter().all(|leaf| required(leaf).any(|other| other == key));
        let own: Vec<&str> = leaves.iter().filter_map(|leaf| required(leaf).find(|key| !common(key))).collect();
        let mut known: Vec<&str> = Vec::new();
        for key in leaves.iter().flat_map(|leaf| properties(leaf)) {
            if !known.contains(&key) {
                known.push(key);
            }
        }
        if let Some((key, entry)) = entries.iter().find(|(key, _)| !known.contains(&key.as_str())) {
            return Err(self.unknown(entry, key, here, &known));
        }
        let given: Vec<&(String, Node)> = entries.iter().filter(|(key, _)| own.contains(&key.as_str())).collect();
        match given.as_slice() {
            [] => {
                let choice: Vec<String> = own.iter().map(|key| format!("`{key}`")).collect();
                let choice = enumeration(&choice, "and");
                let own: Vec<String> = own
                    .iter()
                    .zip(leaves)
                    .map(|(key, leaf)| format!("{key} = ..: {}", self.about(&leaf["properties"][*key])))
                    .collect();
                let reason = format!("{here} has none of the keys {choice}");
                Err(SceneError::at(self.whole(node), reason, format!("write {}", own.join(" Or "))))
            }
            [(only, _)] => {
                let leaf = own.iter().position(|key| key == only).map_or(leaves[0], |i| leaves[i]);
                let foreign = entries.iter().find(|(key, _)| leaf["properties"].get(key).is_none());
                match foreign {
                    Some((key, entry)) => {
                        let reason = format!("`{key}` does not go with `{only}`");
                        Err(SceneError::at(self.document.at_key(entry), reason, "leave out one of the two"))
                    }
                    None => Ok(leaf),
                }
            }
            [(first, _), .., (second, entry)] => {
                let reason = format!("{here} has both `{first}` and `{second}`");
                Err(SceneError::at(self.document.at_key(entry), reason, "leave out one of the two"))
            }
        }
    }

    fn ordered(&self, node: &Node, path: &str) -> Result<(), SceneError> {
        let corner = |key: &str, i: usize| {
            let value = node.child(key)?.child(&i.to_string())?;
            match value.data {
                Data::Integer(number) => Some((number as f64, value)),
                Data::Float(number) => Some((number, value)),
                _ => None,
            }
        };
        for i in 0..3 {
            if let (Some((min, _)), Some((max, value))) = (corner("min", i), corner("max", i))
                && min > max
            {
                let reason = format!("`{path}.max.{i}` is {}, below its min {}", written(max), written(min));
                return Err(self.wrong(value, reason, "exchange the two"));
            }
        }
        Ok(())
    }

    fn unknown(&self, entry: &Node, key: &str, here: &str, known: &[&str]) -> SceneError {
        let reason = format!("unknown key `{key}` in {here}");
        SceneError::at(self.document.at_key(entry), reason, known_names(key, known, "known are"))
    }

    fn wrong(&self, node: &Node, reason: String, about: &str) -> SceneError {
        SceneError::at(self.document.at(node), reason, about)
    }

    /// The place of a table that lacks something; the start of the text for the scene itself.
    fn whole(&self, node: &Node) -> Location {
        self.document.at(node)
    }

    /// The description of a schema, or else of the type that it refers to.
    fn about(&self, schema: &'s Value) -> &'s str {
        let named = schema["$ref"].as_str().and_then(|name| name.strip_prefix("#/$defs/"));
        described(schema).or_else(|| described(&self.root["$defs"][named?])).unwrap_or_default()
    }
}

fn described(schema: &Value) -> Option<&str> {
    schema["description"].as_str()
}

/// The keys of a table, sorted: the order of JSON objects depends on how serde_json was built.
fn properties(leaf: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> =
        leaf["properties"].as_object().into_iter().flatten().map(|(key, _)| key.as_str()).collect();
    keys.sort_unstable();
    keys
}

fn required(leaf: &Value) -> impl Iterator<Item = &str> {
    leaf["required"].as_array().into_iter().flatten().filter_map(Value::as_str)
}

/// The only strings that a schema allows; empty if it allows all.
fn names(leaf: &Value) -> Vec<&str> {
    let many = leaf["enum"].as_array().into_iter().flatten();
    many.chain(leaf.get("const")).filter_map(Value::as_str).collect()
}

fn fits(leaf: &Value, data: &Data) -> bool {
    let wanted = leaf["type"].as_str().unwrap_or_default();
    match data {
        Data::String(_) => wanted == "string",
        Data::Integer(_) => wanted == "integer" || wanted == "number",
        Data::Float(_) => wanted == "number",
        Data::Boolean(_) => wanted == "boolean",
        Data::Datetime => false,
        Data::Array(_) => wanted == "array",
        Data::Table(_) => wanted == "object",
    }
}

fn kind(leaf: &Value) -> &'static str {
    match leaf["type"].as_str().unwrap_or_default() {
        "string" => "a string",
        "integer" => "an integer",
        "number" => "a number",
        "boolean" => "true or false",
        "array" => "an array",
        _ => "a table",
    }
}

fn alternatives(kinds: &[&str]) -> String {
    enumeration(kinds, "or")
}

/// "a, b and c".
fn enumeration(all: &[impl AsRef<str>], last_by: &str) -> String {
    let all: Vec<&str> = all.iter().map(AsRef::as_ref).collect();
    match all.as_slice() {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [most @ .., last] => format!("{} {last_by} {last}", most.join(", ")),
    }
}

/// A number as one would write it.
pub(super) fn written(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) { format!("{value:e}") } else { format!("{value}") }
}

//! The JSON schema of scene files, made from the types that read them.

use super::model::SceneData;
use serde_json::Value;

/// The JSON schema (draft 2020-12) of a scene: keys, types, names, units in the descriptions, ranges and defaults.
/// The same schema checks scenes when they are loaded.
pub fn json_schema() -> Value {
    let mut schema = schemars::schema_for!(SceneData).to_value();
    schema["title"] = "tensormass scene".into();
    tidy(&mut schema);
    schema
}

/// TOML has no null: what may be left out is optional, and is never null. Descriptions become single lines.
fn tidy(schema: &mut Value) {
    match schema {
        Value::Object(entries) => {
            if entries.get("default").is_some_and(Value::is_null) {
                entries.remove("default");
            }
            if let Some(Value::Array(types)) = entries.get_mut("type") {
                types.retain(|name| name != "null");
                if let [only] = types.as_slice() {
                    let only = only.clone();
                    entries.insert("type".to_owned(), only);
                }
            }
            if let Some(Value::Array(branches)) = entries.get_mut("anyOf") {
                branches.retain(|branch| branch["type"] != "null");
                if let [Value::Object(only)] = branches.as_slice() {
                    let only = only.clone();
                    entries.remove("anyOf");
                    for (key, value) in only {
                        entries.entry(key).or_insert(value);
                    }
                }
            }
            if let Some(Value::String(text)) = entries.get_mut("description") {
                *text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            }
            entries.values_mut().for_each(tidy);
        }
        Value::Array(items) => items.iter_mut().for_each(tidy),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

//! docs/scene.schema.json: a JSON Schema of scene files, from the declarations.

use super::declare::{KeyDeclaration, Language, TableDeclaration};
use super::language::tables;
use super::value::ValueKind;
use serde_json::{Map, Value as Json, json};

/// The schema, in the dialect of 2020-12.
pub fn schema(languages: &[&Language]) -> Json {
    let tables: Vec<&TableDeclaration> = tables(languages).collect();
    let mut root = object(&tables, &[], &[]);
    root["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    root["title"] = json!("A scene of Ortelius");
    root["required"] = json!(["surface", "view", "cameras"]);
    root
}

/// The schema of a path.
fn at(tables: &[&TableDeclaration], path: &[&str]) -> Json {
    let here: Vec<&&TableDeclaration> = tables.iter().filter(|table| table.path == path).collect();
    match &here[..] {
        [] => object(tables, path, &[]),
        [table] if table.kind.is_none() => of_table(tables, table),
        kinds => json!({ "oneOf": kinds.iter().map(|table| of_table(tables, table)).collect::<Vec<_>>() }),
    }
}

fn of_table(tables: &[&TableDeclaration], table: &TableDeclaration) -> Json {
    let mut schema = object(tables, table.path, &(table.keys)());
    schema["description"] = json!(super::one_line(table.about));
    if let Some(kind) = table.kind {
        schema["properties"]["kind"] = json!({ "const": kind });
        schema["required"].as_array_mut().expect("made an array").push(json!("kind"));
    }
    schema
}

/// A table with these keys and the tables declared below it.
fn object(tables: &[&TableDeclaration], path: &[&str], keys: &[KeyDeclaration]) -> Json {
    let mut properties: Map<String, Json> = Map::new();
    let mut additional = json!(false);
    let below = |table: &&&TableDeclaration| table.path.len() > path.len() && table.path.starts_with(path);
    let mut inner: Vec<&str> = tables.iter().filter(below).map(|table| table.path[path.len()]).collect();
    inner.dedup();
    for part in inner {
        let schema = at(tables, &[path, &[part]].concat());
        match part {
            "*" => additional = schema,
            part => drop(properties.insert(part.to_owned(), schema)),
        }
    }
    for key in keys {
        let own = match (&key.kind, properties.remove(key.name)) {
            (ValueKind::TableOrText, Some(table)) => json!({ "anyOf": [{ "type": "string" }, table] }),
            (_, Some(table)) => table,
            (_, None) => of_key(key),
        };
        properties.insert(key.name.to_owned(), described(own, key));
    }
    let required: Vec<&str> = keys.iter().filter(|key| key.required).map(|key| key.name).collect();
    json!({
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": additional,
    })
}

fn described(mut schema: Json, key: &KeyDeclaration) -> Json {
    let unit = if key.unit.is_empty() { String::new() } else { format!(" [{}]", key.unit) };
    schema["description"] = json!(format!("{}{unit}", key.about));
    if let Some(default) = &key.default {
        schema["default"] = serde_json::to_value(default).expect("TOML of settings is JSON");
    }
    schema
}

fn of_key(key: &KeyDeclaration) -> Json {
    let ranged = |kind: &str| {
        let mut schema = json!({ "type": kind });
        if let Some([min, max]) = &key.min_and_max {
            (schema["minimum"], schema["maximum"]) = (min.clone(), max.clone());
        }
        schema
    };
    let schema = match &key.kind {
        ValueKind::Whole => ranged("integer"),
        ValueKind::Number => ranged("number"),
        ValueKind::Numbers(count) => {
            json!({ "type": "array", "items": ranged("number"), "minItems": count, "maxItems": count })
        }
        ValueKind::Truth => json!({ "type": "boolean" }),
        ValueKind::Text => json!({ "type": "string" }),
        ValueKind::Names => json!({ "type": "array", "items": { "type": "string" } }),
        ValueKind::Choice(values) => {
            json!({ "enum": values.iter().map(|(name, _)| *name).collect::<Vec<_>>() })
        }
        ValueKind::Table => json!({ "type": "object" }),
        ValueKind::TableOrText => json!({ "type": ["object", "string"] }),
    };
    let optional = key.default.is_none() && !key.required;
    match optional && !matches!(key.kind, ValueKind::Text | ValueKind::Table | ValueKind::TableOrText) {
        true => json!({ "anyOf": [schema, { "const": "auto" }] }),
        false => schema,
    }
}

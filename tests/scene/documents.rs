//! The generated documents, and the scenes that they must describe.

use ortelius::renderer::sections::LANGUAGES;
use ortelius::scene::{SHIPPED, keys, markdown, schema};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

fn committed(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(name)).unwrap()
}

#[test]
fn docs_scenes_md_is_current() {
    let made = markdown::markdown(LANGUAGES);
    assert!(committed("scenes.md") == made, "run: ortelius keys --markdown > docs/scenes.md");
}

#[test]
fn the_schema_is_current() {
    let made = format!("{:#}\n", schema::schema(LANGUAGES));
    assert!(
        committed("scene.schema.json") == made,
        "run: ortelius keys --json-schema > docs/scene.schema.json"
    );
}

#[test]
fn every_key_is_declared_once_and_documented() {
    let mut seen = BTreeSet::new();
    for at in keys(LANGUAGES) {
        assert!(
            at.key.about.len() > 8 && at.key.about.ends_with(['.', ')']),
            "{}: {:?}",
            at.dotted,
            at.key.about
        );
        assert!(seen.insert((at.dotted.clone(), at.kind)), "{} is declared twice", at.dotted);
    }
    assert!(seen.len() > 90, "{}", seen.len());
}

/// Why a value does not match a schema, for the parts of JSON Schema that we use.
fn misfit(value: &Value, schema: &Value) -> Option<String> {
    let all = |key: &str| schema[key].as_array().map(|parts| parts.iter().map(|part| misfit(value, part)));
    if let Some(parts) = all("oneOf") {
        let fitting = parts.filter(Option::is_none).count();
        return (fitting != 1).then(|| format!("{value} fits {fitting} of oneOf"));
    }
    if let Some(parts) = all("anyOf") {
        let reasons: Vec<_> = parts.collect();
        return reasons.iter().all(Option::is_some).then(|| format!("{value}: {reasons:?}"));
    }
    if !schema["const"].is_null() && schema["const"] != *value {
        return Some(format!("{value} is not {}", schema["const"]));
    }
    if schema["enum"].as_array().is_some_and(|values| !values.contains(value)) {
        return Some(format!("{value} is not in {}", schema["enum"]));
    }
    let number = value.as_f64().unwrap_or(0.0);
    let (min, max) = (schema["minimum"].as_f64(), schema["maximum"].as_f64());
    if min.is_some_and(|min| number < min) || max.is_some_and(|max| number > max) {
        return Some(format!("{value} is out of range"));
    }
    match schema["type"].as_str() {
        Some("object") => misfit_of_object(value, schema),
        Some("array") => match value.as_array() {
            Some(items) => items.iter().find_map(|item| misfit(item, &schema["items"])),
            None => Some(format!("{value} is not an array")),
        },
        Some("integer") => (!value.is_i64()).then(|| format!("{value} is not an integer")),
        Some("number") => (!value.is_number()).then(|| format!("{value} is not a number")),
        Some("string") => (!value.is_string()).then(|| format!("{value} is not a string")),
        Some("boolean") => (!value.is_boolean()).then(|| format!("{value} is not a boolean")),
        _ => None,
    }
}

fn misfit_of_object(value: &Value, schema: &Value) -> Option<String> {
    let Some(object) = value.as_object() else { return Some(format!("{value} is not an object")) };
    let required = schema["required"].as_array().into_iter().flatten().map(|name| name.as_str().unwrap());
    if let Some(missing) = required.into_iter().find(|name| !object.contains_key(*name)) {
        return Some(format!("{missing} is missing"));
    }
    object.iter().find_map(|(name, inner)| {
        let why = match (&schema["properties"][name], &schema["additionalProperties"]) {
            (Value::Null, Value::Bool(false)) => Some("not known".to_owned()),
            (Value::Null, additional) => misfit(inner, additional),
            (property, _) => misfit(inner, property),
        };
        why.map(|why| format!("{name}: {why}"))
    })
}

#[test]
fn the_schema_accepts_every_shipped_scene_and_rejects_wrong_ones() {
    let schema = schema::schema(LANGUAGES);
    for (name, text) in SHIPPED {
        let scene: Value = serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap();
        assert_eq!(misfit(&scene, &schema), None, "{name}");
    }
    let (_, text) = SHIPPED.into_iter().find(|(name, _)| *name == "earth").unwrap();
    let earth: Value = serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap();
    for (pointer, wrong) in [
        ("/view", json!({ "width": 64 })),
        ("/view/width", json!(0)),
        ("/view/camera", json!(3)),
        ("/surface/land/geometry/columns", json!(2)),
        ("/surface/land/geometry/kind", json!("plane")),
        ("/surface/land/texture/source", json!("moon")),
        ("/surface/land/texture", json!(["land"])),
        ("/cameras/headline", json!({ "altitude_m": 1.0, "latitude": 3.0 })),
        ("/cache/gpu_tiles", json!("many")),
    ] {
        let mut scene = earth.clone();
        *scene.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}")) = wrong;
        assert!(misfit(&scene, &schema).is_some(), "{pointer}");
    }
    let mut shared = earth;
    shared["surface"]["land"]["texture"] = json!("other");
    shared["variant"] = json!({ "request_format": "auto", "address": "own-level" });
    assert_eq!(misfit(&shared, &schema), None);
}

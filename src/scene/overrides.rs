//! Changes beside a scene: `-D variant.block_log2=2`.

use super::error::{SceneError, list};
use super::file::{CameraFile, MeshFile, PathFile, SceneFile, TextureFile};
use super::progressive_mesh::{GovernorSettings, ProgressiveSurfaceFile};
use super::settings::{Cache, Variant, View};
use crate::math::nearest::nearest;
use crate::texture::source::disk::Disk;
use serde::Deserialize;
use serde::de::{DeserializeOwned, Deserializer, Error as _, Visitor};
use serde::forward_to_deserialize_any;
use toml::{Table, Value};

/// Sections of tables that a scene names itself.
const NAMED: [&str; 3] = ["cameras", "paths", "progressive_mesh"];

/// One `KEY=VALUE`.
pub(super) struct Change {
    /// As given, for messages.
    pub text: String,
    pub key: Vec<String>,
    pub value: Value,
}

impl Change {
    /// Reads `KEY=VALUE`. What is no TOML value and begins like none that has brackets or quotes is a
    /// string: `view.camera=oblique`.
    pub fn parse(text: &str) -> Result<Change, SceneError> {
        let wrong = |what: String| SceneError::Override { change: text.to_owned(), what };
        let Some((key, value)) = text.split_once('=') else {
            return Err(wrong("a change is KEY=VALUE, as in variant.block_log2=2".to_owned()));
        };
        let key: Vec<String> = key.trim().split('.').map(|part| part.trim().to_owned()).collect();
        let value = value.trim();
        let value = match value.parse::<Value>() {
            Ok(value) => value,
            Err(_) if !value.is_empty() && !value.starts_with(['"', '\'', '[', '{']) => {
                Value::String(value.to_owned())
            }
            Err(error) => {
                return Err(wrong(format!("{value:?} is no TOML value: {}", one_line(error.message()))));
            }
        };
        Ok(Change { text: text.to_owned(), key, value })
    }

    /// Whether the change decided the value of a key.
    pub fn sets(&self, key: &[String]) -> bool {
        key.starts_with(&self.key)
    }

    fn wrong(&self, what: impl Into<String>) -> SceneError {
        SceneError::Override { change: self.text.clone(), what: what.into() }
    }

    /// Refuses a key that no scene has, and a camera or path that this scene has not.
    fn check_key(&self, table: &Table) -> Result<(), SceneError> {
        let known = known_keys(table);
        let dotted = self.key.join(".");
        // A whole new camera, path or surface may come as one inline table.
        let new_table = matches!(&self.key[..], [section, _] if NAMED.contains(&section.as_str()))
            && self.value.is_table();
        if new_table || known.contains(&dotted) {
            return Ok(());
        }
        if let [section, name, ..] = &self.key[..]
            && NAMED.contains(&section.as_str())
            && !names(table, section).contains(name)
        {
            let existing = list(names(table, section));
            return Err(self.wrong(format!("no {section}.{name} in this scene; it has {existing}")));
        }
        let nearest = nearest(&dotted, known.iter().map(String::as_str)).unwrap_or_default();
        Err(self.wrong(format!("no scene has the key {dotted}; nearest is {nearest}")))
    }
}

fn one_line(message: &str) -> String {
    message.trim().replace('\n', "; ")
}

/// Applies the changes in order to a scene that has been parsed before.
pub(super) fn apply(mut table: Table, changes: &[Change]) -> Result<SceneFile, SceneError> {
    for change in changes {
        change.check_key(&table)?;
        let (last, sections) = change.key.split_last().expect("split gives at least one part");
        let mut inner = &mut table;
        for section in sections {
            let entry = inner.entry(section.clone()).or_insert_with(|| Value::Table(Table::new()));
            inner = match entry {
                Value::Table(table) => table,
                other => {
                    let what = format!("{section} is a {}, not a table", other.type_str());
                    return Err(change.wrong(what));
                }
            };
        }
        inner.insert(last.clone(), change.value.clone());
        if change.key == ["texture", "source"] && change.value.as_str() == Some("file") {
            // A file knows its own sizes: those stated for the texture that it replaces are not its.
            for stated in ["width_log2", "height_log2", "tile_size", "border", "resident_levels", "format"] {
                inner.remove(stated);
            }
        }
        // The scene was right before, so what is wrong now came by this change.
        SceneFile::deserialize(table.clone()).map_err(|error| change.wrong(one_line(error.message())))?;
    }
    SceneFile::deserialize(table).map_err(|error| {
        let last = changes.last().expect("without changes the file itself was right");
        last.wrong(one_line(error.message()))
    })
}

fn names(table: &Table, section: &str) -> Vec<String> {
    match table.get(section) {
        Some(Value::Table(inner)) => inner.keys().cloned().collect(),
        _ => Vec::new(),
    }
}

/// Every dotted key that this scene could have, cameras, paths and surfaces by their names.
fn known_keys(table: &Table) -> Vec<String> {
    let mut known: Vec<String> = fields::<SceneFile>().iter().map(|&section| section.to_owned()).collect();
    let mut section = |section: &str, fields: &[&str]| {
        known.extend(fields.iter().map(|field| format!("{section}.{field}")));
    };
    section("texture", fields::<TextureFile>());
    section("cache", fields::<Cache>());
    section("disk", fields::<Disk>());
    section("mesh", fields::<MeshFile>());
    section("governor", fields::<GovernorSettings>());
    section("view", fields::<View>());
    section("variant", fields::<Variant>());
    for name in names(table, "cameras") {
        section(&format!("cameras.{name}"), fields::<CameraFile>());
    }
    for name in names(table, "paths") {
        section(&format!("paths.{name}"), fields::<PathFile>());
    }
    for name in names(table, "progressive_mesh") {
        section(&format!("progressive_mesh.{name}"), fields::<ProgressiveSurfaceFile>());
    }
    for section in NAMED {
        known.extend(names(table, section).iter().map(|name| format!("{section}.{name}")));
    }
    known
}

/// The names of a struct's fields, asked of its own deserializer, so that no list is kept twice.
fn fields<T: DeserializeOwned>() -> &'static [&'static str] {
    struct Asker<'a>(&'a mut &'static [&'static str]);
    impl<'de> Deserializer<'de> for Asker<'_> {
        type Error = serde::de::value::Error;
        fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Self::Error> {
            Err(Self::Error::custom("only asks for names"))
        }
        fn deserialize_struct<V: Visitor<'de>>(
            self,
            _: &'static str,
            fields: &'static [&'static str],
            _: V,
        ) -> Result<V::Value, Self::Error> {
            *self.0 = fields;
            Err(Self::Error::custom("only asks for names"))
        }
        forward_to_deserialize_any! {
            bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit
            unit_struct newtype_struct seq tuple tuple_struct map enum identifier ignored_any
        }
    }
    let mut names: &'static [&'static str] = &[];
    // Always an error: the names were what we came for.
    let _asked = T::deserialize(Asker(&mut names)).is_err();
    names
}

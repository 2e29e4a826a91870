//! Checks a scene against all declared tables, and lists all keys.

use super::declare::{KeyDeclaration, Language, TableDeclaration};
use super::document::SceneFault;
use super::value::quoted;
use super::{Scene, SceneError};
use crate::math::nearest::nearest;
use std::path::{Path, PathBuf};
use toml::Value;

/// A key with the path of its table, as shown in documents and by `ortelius keys`.
pub struct KeyAt {
    /// `surface.NAME.geometry.columns`.
    pub dotted: String,
    /// The `kind` of the table that has this key.
    pub kind: Option<&'static str>,
    pub key: KeyDeclaration,
}

/// All keys, table by table.
pub fn keys(languages: &[&Language]) -> Vec<KeyAt> {
    let of_table = |table: &TableDeclaration| {
        let path = dotted(table.path);
        let kind = table.kind;
        (table.keys)().into_iter().map(move |key| KeyAt { dotted: format!("{path}.{}", key.name), kind, key })
    };
    tables(languages).flat_map(of_table).collect()
}

pub(super) fn tables<'a>(languages: &'a [&Language]) -> impl Iterator<Item = &'static TableDeclaration> + 'a {
    languages.iter().flat_map(|language| language.tables)
}

/// A table's dotted path, with NAME for `*`.
pub(super) fn dotted(path: &[&str]) -> String {
    path.iter().map(|part| if *part == "*" { "NAME" } else { part }).collect::<Vec<_>>().join(".")
}

impl Scene {
    /// Checks the whole scene against all declarations: unknown sections and kinds, each table's keys, types and
    /// ranges, and the techniques' own checks.
    ///
    /// # Errors
    /// [`SceneError`] at the first fault.
    pub fn check(&self, languages: &[&Language]) -> Result<(), SceneError> {
        for (section, value) in &self.document.table {
            if !tables(languages).any(|table| table.path[0] == section) {
                let key = first_leaf(section, value);
                let known = keys(languages);
                let near = nearest(&key.join("."), known.iter().map(|known| &*known.dotted));
                return Err(self.error(SceneFault::unknown(&key, near.unwrap_or_default())));
            }
        }
        for table in tables(languages) {
            for path in self.places(table.path) {
                let path: Vec<&str> = path.iter().map(String::as_str).collect();
                if table.kind.is_none() || table.kind == self.kind_of(&path, languages)? {
                    (table.read)(self, &path)?;
                }
            }
        }
        languages.iter().try_for_each(|language| (language.check)(self))
    }

    /// The scene as TOML with its overrides, and the absolute base folder of its relative paths, so that
    /// [`Scene::from_parts`] can rebuild it anywhere. Paths set by overrides, which are relative to the working
    /// directory, become absolute.
    pub fn to_parts(&self, languages: &[&Language]) -> (PathBuf, String) {
        // Without a working directory no relative path resolves; it stays unchanged.
        let absolute =
            |path: &Path| std::path::absolute(Path::new(".").join(path)).unwrap_or(path.to_owned());
        let here = absolute(Path::new(""));
        let mut document = self.document.table.clone();
        for table in tables(languages) {
            for place in self.places(table.path) {
                let place: Vec<&str> = place.iter().map(String::as_str).collect();
                if table.kind.is_some() && table.kind != self.word(&[&place[..], &["kind"]].concat()) {
                    continue;
                }
                for key in (table.keys)() {
                    let at = [&place[..], &[key.name]].concat();
                    let Some(value) = self.document.value(&at).filter(|_| self.document.changed(&at)) else {
                        continue;
                    };
                    let parent = place.iter().try_fold(&mut document, |table, part| {
                        table.get_mut(*part).and_then(Value::as_table_mut)
                    });
                    let parent = parent.expect("the key has a value");
                    parent.insert(key.name.to_owned(), (key.anchored)(value, &here));
                }
            }
        }
        (absolute(self.document.own_folder()), document.to_string())
    }

    /// The key paths of this scene's tables that match `pattern`, in which `*` is any name.
    fn places(&self, pattern: &[&str]) -> Vec<Vec<String>> {
        let mut places = vec![Vec::new()];
        for part in pattern {
            let next = |place: Vec<String>| -> Vec<Vec<String>> {
                let at: Vec<&str> = place.iter().map(String::as_str).collect();
                let names = match (*part, self.document.value(&at)) {
                    ("*", Some(Value::Table(table))) => table.keys().cloned().collect(),
                    ("*", _) => Vec::new(),
                    (part, _) => vec![part.to_owned()],
                };
                names.into_iter().map(|name| [place.clone(), vec![name]].concat()).collect()
            };
            places = places.into_iter().flat_map(next).collect();
        }
        // A texture given by the name of another surface is checked at that surface.
        let stated = |place: &Vec<String>| {
            let at: Vec<&str> = place.iter().map(String::as_str).collect();
            self.document.value(&at).is_some_and(|value| !value.is_str())
        };
        places.retain(stated);
        places
    }

    /// The `kind` of the table at `path`, on which this table's keys depend.
    fn kind_of(&self, path: &[&str], languages: &[&Language]) -> Result<Option<&'static str>, SceneError> {
        let same = |table: &&TableDeclaration| {
            table.path.len() == path.len() && table.path.iter().zip(path).all(|(a, b)| *a == "*" || a == b)
        };
        let kinds: Vec<&'static str> =
            tables(languages).filter(same).filter_map(|table| table.kind).collect();
        let key = [path, &["kind"]].concat();
        let word = self.word(&key).unwrap_or_default();
        match kinds.iter().find(|kind| **kind == word) {
            Some(kind) => Ok(Some(kind)),
            None => {
                let names = quoted(kinds.into_iter());
                Err(self.fault(
                    &key,
                    format!("{word:?} is not a kind of {}; available: {names}", path[path.len() - 1]),
                ))
            }
        }
    }
}

/// The first key inside an unknown section, which is more specific than the section alone.
fn first_leaf<'a>(section: &'a str, value: &'a Value) -> Vec<&'a str> {
    let (mut key, mut value) = (vec![section], value);
    while let Some((name, inner)) = value.as_table().and_then(|table| table.iter().next()) {
        key.push(name);
        value = inner;
    }
    key
}

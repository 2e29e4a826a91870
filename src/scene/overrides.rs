//! Changes beside a scene: `-D variant.block_log2=2`.

use super::error::{SceneError, list};
use super::moved;
use toml::{Table, Value};

/// Sections of tables that a scene names itself.
const NAMED: [&str; 3] = ["cameras", "paths", "surface"];

/// One `KEY=VALUE`.
#[derive(Clone, Debug)]
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
        let (key, value) = text.split_once('=').unwrap_or_default();
        let key: Vec<String> = key.split('.').map(|part| part.trim().to_owned()).collect();
        if key.len() < 2 && !value.trim().starts_with('{') || key.iter().any(String::is_empty) {
            return Err(wrong("a change is SECTION.KEY=VALUE, as in variant.block_log2=2".to_owned()));
        }
        let value = value.trim();
        let value = match value.parse::<Value>() {
            Ok(value) => value,
            Err(_) if !value.is_empty() && !value.starts_with(['"', '\'', '[', '{']) => {
                Value::String(value.to_owned())
            }
            Err(error) => {
                let why = error.message().trim().replace('\n', "; ");
                return Err(wrong(format!("{value:?} is no TOML value: {why}")));
            }
        };
        Ok(Change { text: text.to_owned(), key, value })
    }

    /// Whether the change decided the value of a key.
    pub fn sets(&self, key: &[&str]) -> bool {
        key.len() >= self.key.len() && self.key.iter().zip(key).all(|(own, part)| own == part)
    }

    /// Whether the change sets a key of a table.
    pub fn is_within(&self, table: &[&str]) -> bool {
        self.key.len() > table.len() && self.key.iter().zip(table).all(|(own, part)| own == part)
    }

    fn wrong(&self, what: impl Into<String>) -> SceneError {
        SceneError::Override { change: self.text.clone(), what: what.into() }
    }

    /// Puts the value into a scene; tables on the way to it are made. Whether the key is known is checked when its
    /// table is read.
    ///
    /// # Errors
    /// A camera, path or surface that the scene does not have, unless the value is a whole one; a key of the
    /// format before this one.
    pub fn apply(&self, scene: &mut Table) -> Result<(), SceneError> {
        let key: Vec<&str> = self.key.iter().map(String::as_str).collect();
        if let Some(now) = moved::now(&key) {
            return Err(self.wrong(moved::told(&key, &now, scene)));
        }
        if let [section, name, rest @ ..] = &key[..]
            && NAMED.contains(section)
            && !(rest.is_empty() && self.value.is_table())
        {
            let inner = scene.get(*section).and_then(Value::as_table);
            if !inner.is_some_and(|inner| inner.contains_key(*name)) {
                let existing = list(inner.into_iter().flat_map(Table::keys));
                let what = format!("no {section}.{name} in this scene; it has {existing}");
                return Err(self.wrong(what));
            }
        }
        let (last, sections) = key.split_last().expect("a change has a key");
        let mut table = scene;
        for (depth, section) in sections.iter().enumerate() {
            let inner = table.entry(*section).or_insert_with(|| Value::Table(Table::new()));
            let wrong = format!("{} is {inner}, not a table", key[..=depth].join("."));
            table = inner.as_table_mut().ok_or_else(|| self.wrong(wrong))?;
        }
        table.insert((*last).to_owned(), self.value.clone());
        for stated in self.dropped() {
            table.remove(*stated);
        }
        Ok(())
    }

    /// Keys beside this one that no longer hold: a file knows its own sizes, so those stated for the texture
    /// that it replaces do not count.
    pub fn dropped(&self) -> &'static [&'static str] {
        match &self.key[..] {
            [surface, _, texture, source]
                if (&**surface, &**texture, &**source) == ("surface", "texture", "source")
                    && self.value.as_str() == Some("file") =>
            {
                &["width_log2", "height_log2", "tile_size", "border", "resident_levels", "format"]
            }
            _ => &[],
        }
    }
}

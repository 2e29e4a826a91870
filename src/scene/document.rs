//! The text of a scene, the overrides applied to it, and the origin of each key's value.

use super::SHIPPED;
use super::error::{SceneError, list};
use super::overrides::Override;
use crate::file;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::DeTable;
use toml::{Table, Value};

/// Far larger than any scene.
pub(super) const MAX_BYTES: u64 = 1 << 20;

/// An invalid value or key.
#[derive(Clone, Debug)]
pub struct SceneFault {
    pub key: Vec<String>,
    pub what: String,
    /// True if the key itself is wrong, not its value.
    pub of_key: bool,
}

impl SceneFault {
    pub fn new(key: &[&str], what: impl Into<String>) -> SceneFault {
        let key = key.iter().map(|&part| part.to_owned()).collect();
        SceneFault { key, what: what.into(), of_key: false }
    }

    pub(super) fn unknown(key: &[&str], nearest: &str) -> SceneFault {
        let what = format!("no scene has the key {}; nearest is {nearest}", key.join("."));
        SceneFault { of_key: true, ..SceneFault::new(key, what) }
    }
}

/// The content of a file, with the overrides applied.
#[derive(Clone, Debug)]
pub(super) struct Document {
    /// For messages.
    path: String,
    pub name: String,
    folder: PathBuf,
    text: String,
    changes: Vec<Override>,
    pub table: Table,
}

/// The origin of a value.
enum Origin<'a> {
    Change(&'a Override),
    /// A byte range of the text.
    Text(Range<usize>),
}

impl Document {
    pub fn read(path: &Path) -> Result<Document, SceneError> {
        let shown = path.display().to_string();
        let bytes =
            file::read(path, MAX_BYTES).map_err(|source| SceneError::Read { path: shown.clone(), source })?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let start = error.utf8_error().valid_up_to();
            let text = String::from_utf8_lossy(error.as_bytes());
            // `start` is the first invalid byte. The replacement changes nothing before it.
            SceneError::at(&shown, &text, start..start, "this byte is not UTF-8, which TOML requires")
        })?;
        Document::from_text(path, text)
    }

    /// Parses `text` as the content of the file at `path`, which need not exist.
    pub fn from_text(path: &Path, text: String) -> Result<Document, SceneError> {
        let shown = path.display().to_string();
        let table = text.parse().map_err(|error: toml::de::Error| {
            SceneError::at(&shown, &text, error.span().unwrap_or(0..0), error.message())
        })?;
        Ok(Document {
            path: shown,
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            text,
            changes: Vec::new(),
            table,
        })
    }

    pub fn shipped(name: &str) -> Result<Document, SceneError> {
        let (_, text) = SHIPPED.iter().find(|(shipped, _)| *shipped == name).ok_or_else(|| {
            SceneError::Unknown { name: name.to_owned(), shipped: list(SHIPPED.map(|(name, _)| name)) }
        })?;
        let path = PathBuf::from(format!("scenes/{name}.toml"));
        Ok(Document { folder: PathBuf::new(), ..Document::from_text(&path, (*text).to_owned())? })
    }

    /// Parses a text that is not in a file; messages show `shown` as its path.
    pub fn from_parts(shown: &str, name: &str, folder: &Path, text: String) -> Result<Document, SceneError> {
        let document = Document::from_text(Path::new(shown), text)?;
        Ok(Document { name: name.to_owned(), folder: folder.to_owned(), ..document })
    }

    /// Applies more overrides, in order.
    pub fn change(&mut self, changes: &[String]) -> Result<(), SceneError> {
        let changes = changes.iter().map(|text| Override::parse(text)).collect::<Result<Vec<_>, _>>()?;
        changes.iter().try_for_each(|change| change.apply(&mut self.table, &changes))?;
        self.changes.extend(changes);
        Ok(())
    }

    pub fn value(&self, key: &[&str]) -> Option<&Value> {
        let (last, sections) = key.split_last()?;
        let mut table = &self.table;
        for section in sections {
            table = table.get(*section)?.as_table()?;
        }
        table.get(*last)
    }

    /// Base folder of a relative path: the working directory if an override set the path, otherwise the scene's
    /// folder.
    pub fn folder(&self, key: &[&str]) -> &Path {
        if self.changed(key) { Path::new("") } else { &self.folder }
    }

    /// Base folder of relative paths in the text.
    pub fn own_folder(&self) -> &Path {
        &self.folder
    }

    /// True if an override set the value of a key.
    pub fn changed(&self, key: &[&str]) -> bool {
        self.changes.iter().any(|change| change.sets(key))
    }

    /// The override that set the key or created its table, otherwise the key's range in the text. For a key
    /// that does not exist, the range of the innermost table around it.
    fn origin(&self, key: &[&str], of_key: bool) -> Origin<'_> {
        if let Some(change) = self.changes.iter().rfind(|change| change.sets(key)) {
            return Origin::Change(change);
        }
        // The text was parsed before, so this cannot fail; the file's start is a safe fallback.
        let Ok(root) = DeTable::parse(&self.text) else { return Origin::Text(0..0) };
        let (mut table, mut span) = (root.get_ref(), 0..0);
        for (depth, part) in key.iter().enumerate() {
            let Some((name, value)) = table.get_key_value(*part) else {
                // A table that exists only through an override belongs to that override.
                let made = |change: &&Override| change.is_within(&key[..=depth]) && depth + 1 < key.len();
                return self.changes.iter().rfind(made).map_or(Origin::Text(span), Origin::Change);
            };
            span = if of_key && depth + 1 == key.len() { name.span() } else { value.span() };
            let Some(inner) = value.get_ref().as_table() else { break };
            table = inner;
        }
        Origin::Text(span)
    }

    /// Converts a fault to an error that shows the origin of its value.
    pub fn error(&self, fault: SceneFault) -> SceneError {
        let key: Vec<&str> = fault.key.iter().map(String::as_str).collect();
        match self.origin(&key, fault.of_key) {
            Origin::Change(change) => {
                let own = change.sets(&key) && change.key.len() == key.len() || fault.of_key;
                let what = if own { fault.what } else { format!("{}: {}", key.join("."), fault.what) };
                SceneError::Override { change: change.text.clone(), what }
            }
            Origin::Text(span) => {
                let what = match fault.of_key {
                    true => fault.what,
                    false => format!("{}: {}", key.join("."), fault.what),
                };
                SceneError::at(&self.path, &self.text, span, &what)
            }
        }
    }

    /// Origin of a key as text: `s.toml:4:8: surface.land.texture.path`, or `-D ...`.
    pub fn place(&self, key: &[&str]) -> String {
        match self.origin(key, false) {
            Origin::Change(change) => format!("-D {}", change.text),
            Origin::Text(span) => {
                let [line, column] = SceneError::line_and_column(&self.text, span.start);
                format!("{}:{line}:{column}: {}", self.path, key.join("."))
            }
        }
    }
}

//! Overrides of a scene's settings: `-D variant.block_log2=2`.

use super::error::{SceneError, list};
use super::moved;
use toml::{Table, Value};

/// Sections whose tables have names chosen by the scene.
const NAMED: [&str; 3] = ["cameras", "paths", "surface"];

/// The keys of a surface's filter that only some kinds read, with these kinds.
const KEYS_OF_FILTERS: [(&[&str], &[&str]); 5] = [
    (&["minor_texels", "k", "scan", "determinant", "axes", "kernel", "edge"], &["ellipse"]),
    (&["weight_map", "map_entries", "map_bits", "map_linear"], &["ellipse"]),
    (&["samples"], &["stochastic", "stochastic-ellipse"]),
    (&["max_anisotropy"], &["trilinear", "bilinear", "stochastic", "ellipse", "feline", "mavridis"]),
    (&["interpolation"], &["trilinear", "bilinear", "stochastic"]),
];

/// The keys of a filter that its kind does not read, each with the kinds that read it.
pub fn unread_filter_keys(kind: &str) -> impl Iterator<Item = (&'static str, &'static [&'static str])> {
    let unread = KEYS_OF_FILTERS.into_iter().filter(move |(_, kinds)| !kinds.contains(&kind));
    unread.flat_map(|(keys, kinds)| keys.iter().map(move |key| (*key, kinds)))
}

/// One `KEY=VALUE`.
#[derive(Clone, Debug)]
pub(super) struct Override {
    /// As given, for messages.
    pub text: String,
    pub key: Vec<String>,
    pub value: Value,
}

/// True if the changes give the camera `name` a position and a height, so that it may be a new one. If they set only
/// other keys, `name` may be a misspelling of another camera's name.
fn places(name: &str, changes: &[Override]) -> bool {
    let sets = |key| changes.iter().any(|change| change.key == ["cameras", name, key]);
    let over_the_earth = sets("latitude_deg") && sets("longitude_deg");
    sets("altitude_m") && (over_the_earth || sets("east_m") && sets("north_m"))
}

impl Override {
    /// Parses `KEY=VALUE`. A value that is not valid TOML, and does not start with a quote or bracket, is a string:
    /// `view.camera=oblique`.
    pub fn parse(text: &str) -> Result<Override, SceneError> {
        let wrong = |what: String| SceneError::Override { change: text.to_owned(), what };
        let (key, value) = text.split_once('=').unwrap_or_default();
        let key: Vec<String> = key.split('.').map(|part| part.trim().to_owned()).collect();
        if key.len() < 2 && !value.trim().starts_with('{') || key.iter().any(String::is_empty) {
            return Err(wrong("expected SECTION.KEY=VALUE, for example variant.block_log2=2".to_owned()));
        }
        let value = value.trim();
        let value = match value.parse::<Value>() {
            Ok(value) => value,
            Err(_) if !value.is_empty() && !value.starts_with(['"', '\'', '[', '{']) => {
                Value::String(value.to_owned())
            }
            Err(error) => {
                let why = error.message().trim().replace('\n', "; ");
                return Err(wrong(format!("{value:?} is not a TOML value: {why}")));
            }
        };
        Ok(Override { text: text.to_owned(), key, value })
    }

    /// True if the override sets the value of a key.
    pub fn sets(&self, key: &[&str]) -> bool {
        key.len() >= self.key.len() && self.key.iter().zip(key).all(|(own, part)| own == part)
    }

    /// True if the override sets a key of a table.
    pub fn is_within(&self, table: &[&str]) -> bool {
        self.key.len() > table.len() && self.key.iter().zip(table).all(|(own, part)| own == part)
    }

    fn wrong(&self, what: impl Into<String>) -> SceneError {
        SceneError::Override { change: self.text.clone(), what: what.into() }
    }

    /// Inserts the value into a scene, creating tables as needed. Unknown keys are detected when their table is read.
    ///
    /// # Errors
    /// A key of an older version. A part of the key that is a value instead of a table. A camera, path or surface that
    /// does not exist, with two exceptions: the value is a complete table, or the changes in `all` together position a
    /// new camera.
    pub fn apply(&self, scene: &mut Table, all: &[Override]) -> Result<(), SceneError> {
        let key: Vec<&str> = self.key.iter().map(String::as_str).collect();
        if let Some(now) = moved::now(&key) {
            return Err(self.wrong(moved::message(&key, &now, scene)));
        }
        if let [section, name, rest @ ..] = &key[..]
            && NAMED.contains(section)
            && !(rest.is_empty() && self.value.is_table())
            && !(*section == "cameras" && places(name, all))
        {
            let inner = scene.get(*section).and_then(Value::as_table);
            if !inner.is_some_and(|inner| inner.contains_key(*name)) {
                let existing = list(inner.into_iter().flat_map(Table::keys));
                let what = format!("no {section}.{name} in this scene; it has {existing}");
                return Err(self.wrong(what));
            }
        }
        let (last, sections) = key.split_last().expect("an override has a key");
        let mut table = &mut *scene;
        for (depth, section) in sections.iter().enumerate() {
            let inner = table.entry(*section).or_insert_with(|| Value::Table(Table::new()));
            let wrong = format!("{} is {inner}, not a table", key[..=depth].join("."));
            table = inner.as_table_mut().ok_or_else(|| self.wrong(wrong))?;
        }
        table.insert((*last).to_owned(), self.value.clone());
        let (depth, dropped) = self.dropped();
        let table = key[..depth].iter().try_fold(scene, |table, name| table.get_mut(*name)?.as_table_mut());
        let table = table.expect("the value has just been inserted there");
        for stated in dropped {
            table.remove(stated);
        }
        Ok(())
    }

    /// The keys that this override invalidates. The number says how many leading parts of the override's key form the
    /// path of the table with these keys. A texture file states its own sizes, so the keys of a generated texture are
    /// dropped. A filter's table replaces `"auto"` and its bound. A filter's kind drops the keys that it does not read;
    /// a later override that states such a key is refused. Without a weight map, its keys are dropped. A relief has no
    /// filter except its method, so stating the method also replaces `"auto"` and its bound.
    pub fn dropped(&self) -> (usize, Vec<&'static str>) {
        let key: Vec<&str> = self.key.iter().map(String::as_str).collect();
        match key[..] {
            ["surface", _, "filter"] if self.value.is_table() => (2, vec!["max_error", "max_ms"]),
            ["surface", _, "filter", "kind"] => {
                let kind = self.value.as_str().unwrap_or_default();
                (3, unread_filter_keys(kind).map(|(key, _)| key).collect())
            }
            ["surface", _, "filter", "weight_map"] if self.value.as_str() == Some("none") => {
                (3, vec!["map_entries", "map_bits", "map_linear"])
            }
            ["surface", _, "relief", "method"] => (2, vec!["filter", "max_error", "max_ms"]),
            ["surface", _, "texture", "source"] if self.value.as_str() == Some("file") => {
                (3, vec!["width_log2", "height_log2", "tile_size", "border", "resident_levels", "format"])
            }
            _ => (0, Vec::new()),
        }
    }
}

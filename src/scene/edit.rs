//! Changes put into a scene file itself; its comments and its order stay.

use super::error::SceneError;
use super::file::Document;
use super::overrides::Change;
use crate::picture::write::write_whole;
use std::io::{Error, Write};
use std::path::Path;
use toml_edit::{DocumentMut, Item, Table, TableLike};

/// Puts `KEY=VALUE`s, as [`super::Scene::load_with`] takes them, into the scene file at `path`: it then says by itself
/// what it said with them beside. The file appears whole or stays as it is; a link stays a link.
///
/// # Errors
/// [`SceneError`]: a file that is no scene, a change that is not right, the disk.
pub fn write_changes(path: &Path, changes: &[String]) -> Result<(), SceneError> {
    let shown = path.display().to_string();
    let failed = |source: Error| SceneError::Read { path: shown.clone(), source };
    let path = path.canonicalize().map_err(failed)?;
    let wanted = Document::read(&path)?.scene(changes)?;
    let text = std::fs::read_to_string(&path).map_err(failed)?;
    let mut document: DocumentMut = text.parse().map_err(|error| failed(Error::other(error)))?;
    for change in changes {
        put(&mut document, &Change::parse(change)?);
    }
    let text = document.to_string();
    let written = Document::of_text(&path, text.clone()).scene(&[])?;
    assert_eq!(written, wanted, "the scene as it would be written, and as it was asked for");
    Ok(write_whole(&path, |file| file.write_all(text.as_bytes()))?)
}

fn put(document: &mut DocumentMut, change: &Change) {
    let (last, sections) = change.key.split_last().expect("split gives at least one part");
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for section in sections {
        let inner = table.entry(section).or_insert(Item::Table(Table::new()));
        table = inner.as_table_like_mut().expect("the scene was read with this change before");
    }
    let text = change.value.to_string();
    let mut value: toml_edit::Value = text.parse().expect("one TOML writer's value is the other's");
    match table.get_mut(last).and_then(Item::as_value_mut) {
        Some(old) => {
            // The comment behind it.
            *value.decor_mut() = old.decor().clone();
            *old = value;
        }
        None => {
            table.insert(last, Item::Value(value));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Scene;
    use super::*;

    fn plane() -> &'static str {
        super::super::SHIPPED.iter().find(|(name, _)| *name == "plane").unwrap().1
    }

    #[test]
    fn values_change_and_comments_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plane.toml");
        let text = plane().replace("width_log2 = 18", "width_log2 = 18 # a quarter of a million");
        std::fs::write(&path, &text).unwrap();
        let changes = [
            "texture.border=8",
            "texture.width_log2=17",
            "texture.height_log2=16",
            "variant.filter=bilinear",
        ];
        let changes = changes.map(String::from);
        let wanted = Scene::load_with(path.to_str().unwrap(), &changes).unwrap();
        write_changes(&path, &changes).unwrap();
        assert_eq!(Scene::load(&path).unwrap(), wanted);
        let written = std::fs::read_to_string(&path).unwrap();
        assert!(written.contains("width_log2 = 17 # a quarter of a million"), "{written}");
        for line in text.lines().filter(|line| line.starts_with('#')) {
            assert!(written.contains(line), "{line} is lost");
        }
        assert!(written.contains("[variant]\nfilter = \"bilinear\""), "{written}");
    }

    #[test]
    fn what_is_not_right_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plane.toml");
        std::fs::write(&path, plane()).unwrap();
        for wrong in ["variant.filter=none", "variant.level_bias=21", "texture.bordr=1"] {
            write_changes(&path, &[wrong.to_string()]).unwrap_err();
        }
        assert_eq!(std::fs::read_to_string(&path).unwrap(), plane());
        write_changes(&folder.path().join("none.toml"), &[]).unwrap_err();
    }
}

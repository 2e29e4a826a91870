//! Writes overrides into a scene file, keeping comments and order.

use super::Scene;
use super::document::MAX_BYTES;
use super::error::SceneError;
use super::overrides::Override;
use crate::file;
use crate::picture::write::write_bytes;
use std::io::Error;
use std::path::Path;
use toml_edit::{DocumentMut, Item, Table, TableLike};

/// Writes `KEY=VALUE`s, as accepted by [`Scene::load_with`], into the scene file at `path`, so that it equals the
/// scene with these overrides. The write is atomic; a link stays a link. `check` receives the changed scene before
/// anything is written.
///
/// # Errors
/// [`SceneError`]: not a scene file, an invalid override, or an I/O error.
pub fn write_changes(
    path: &Path,
    changes: &[String],
    check: impl Fn(&Scene) -> Result<(), SceneError>,
) -> Result<(), SceneError> {
    let shown = path.display().to_string();
    let failed = |source: Error| SceneError::Read { path: shown.clone(), source };
    let path = path.canonicalize().map_err(failed)?;
    let wanted = Scene::load(&path)?.with(changes)?;
    check(&wanted)?;
    let text = file::read_text(&path, MAX_BYTES).map_err(failed)?;
    let mut document: DocumentMut = text.parse().map_err(|error| failed(Error::other(error)))?;
    for change in changes {
        put(&mut document, &Override::parse(change)?);
    }
    let text = document.to_string();
    let written = Scene::from_text(&path, text.clone())?;
    assert_eq!(written, wanted, "the scene as written differs from the requested one");
    Ok(write_bytes(&path, &text)?)
}

fn put(document: &mut DocumentMut, change: &Override) {
    let (last, sections) = change.key.split_last().expect("split gives at least one part");
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for section in sections {
        let inner = table.entry(section).or_insert(Item::Table(Table::new()));
        table = inner.as_table_like_mut().expect("the scene was read with this change before");
    }
    let text = change.value.to_string();
    let mut value: toml_edit::Value = text.parse().expect("both TOML libraries have the same syntax");
    match table.get_mut(last).and_then(Item::as_value_mut) {
        Some(old) => {
            // Keep the comment after the value.
            *value.decor_mut() = old.decor().clone();
            *old = value;
        }
        None => {
            table.insert(last, Item::Value(value));
        }
    }
    let (depth, dropped) = change.dropped();
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for section in &change.key[..depth] {
        let inner = table.get_mut(section).and_then(Item::as_table_like_mut);
        table = inner.expect("the value has just been inserted there");
    }
    for stated in dropped {
        table.remove(stated);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane() -> &'static str {
        super::super::SHIPPED.iter().find(|(name, _)| *name == "plane").unwrap().1
    }

    #[test]
    fn values_change_and_comments_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plane.toml");
        let text = plane().replace("width_log2 = 18", "width_log2 = 18 # a quarter of a million");
        // The filter is a new table.
        let text: String = text.split_inclusive('\n').filter(|line| !line.starts_with("filter")).collect();
        std::fs::write(&path, &text).unwrap();
        let changes = [
            "surface.land.texture.border=8",
            "surface.land.texture.width_log2=17",
            "surface.land.filter.kind=bilinear",
            "variant.dedup=test-or",
        ];
        let changes = changes.map(String::from);
        let wanted = Scene::load_with(path.to_str().unwrap(), &changes).unwrap();
        write_changes(&path, &changes, |_| Ok(())).unwrap();
        assert_eq!(Scene::load(&path).unwrap(), wanted);
        let written = std::fs::read_to_string(&path).unwrap();
        assert!(written.contains("width_log2 = 17 # a quarter of a million"), "{written}");
        for line in text.lines().filter(|line| line.starts_with('#')) {
            assert!(written.contains(line), "{line} is lost");
        }
        assert!(written.contains("[surface.land.filter]\nkind = \"bilinear\""), "{written}");
    }

    #[test]
    fn replacing_a_generated_texture_by_a_file_removes_its_sizes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plane.toml");
        std::fs::write(&path, plane()).unwrap();
        let changes = ["surface.land.texture.source=file", "surface.land.texture.path=a.tiles"];
        write_changes(&path, &changes.map(String::from), |_| Ok(())).unwrap();
        let written = std::fs::read_to_string(&path).unwrap();
        assert!(!written.contains("width_log2") && written.contains("path = \"a.tiles\""), "{written}");
    }

    #[test]
    fn an_invalid_override_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plane.toml");
        std::fs::write(&path, plane()).unwrap();
        let refuse = |scene: &Scene| Err(scene.fault(&["variant", "level_bias"], "refused"));
        write_changes(&path, &["variant.level_bias=21".into()], refuse).unwrap_err();
        for wrong in ["variant.filter=none", "surface.land.textur=1", "view.camera=nowhere"] {
            write_changes(&path, &[wrong.to_string()], |_| Ok(())).unwrap_err();
        }
        assert_eq!(std::fs::read_to_string(&path).unwrap(), plane());
        write_changes(&folder.path().join("none.toml"), &[], |_| Ok(())).unwrap_err();
    }
}

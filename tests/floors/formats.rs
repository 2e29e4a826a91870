//! docs/formats.md lists every JSON format of the source with its version.

use super::{read, root, sources};

/// (name, version) of each `JsonFormat` in a text.
fn declared(text: &str) -> Vec<(String, String)> {
    let by_function = text.split("JsonFormat::new(\"").skip(1).filter_map(|rest| {
        let (name, rest) = rest.split_once("\", ")?;
        Some((name, rest.split_once(')')?.0))
    });
    let by_fields = text.split("JsonFormat {").skip(1).filter_map(|rest| {
        let rest = rest.trim_start().strip_prefix("name: \"")?;
        let (name, rest) = rest.split_once('"')?;
        let (_, rest) = rest.split_once("version: ")?;
        Some((name, rest.split_once(',')?.0))
    });
    by_function.chain(by_fields).map(|(name, version)| (name.to_owned(), version.to_owned())).collect()
}

#[test]
fn every_json_format_is_documented_with_its_version() {
    let document = std::fs::read_to_string(root().join("docs/formats.md")).unwrap();
    let files: Vec<(String, String)> = sources(&root().join("src")).iter().map(|file| read(file)).collect();
    let of_source = files.iter().filter(|(path, _)| path != "src/header.rs");
    let found: Vec<(String, String)> = of_source.flat_map(|(_, text)| declared(text)).collect();
    assert!(found.len() >= 12, "{found:?}");
    for (name, version) in found {
        let row = format!("| `{name}` | {version} ");
        assert!(document.contains(&row), "no row that begins with {row:?}");
    }
}

//! A public type's name occurs once in the crate, so that a name in a signature or a message says which type it is.

use crate::lexer::{Token, tokens};
use crate::{read, root, sources};
use std::collections::{BTreeMap, BTreeSet};

/// The public types that a file defines.
fn types(tokens: &[Token]) -> impl Iterator<Item = &str> {
    tokens.windows(3).filter_map(|three| match [0, 1, 2].map(|n| three[n].text.as_str()) {
        ["pub", "struct" | "enum" | "union" | "trait" | "type", name] if name != "$" => Some(name),
        _ => None,
    })
}

/// The names that several files define, with these files. `files`: path and text.
fn double(files: &[(String, String)]) -> Vec<String> {
    let mut places: BTreeMap<String, BTreeSet<&str>> = BTreeMap::new();
    for (path, text) in files {
        types(&tokens(text)).for_each(|name| _ = places.entry(name.to_owned()).or_default().insert(path));
    }
    places.retain(|_, files| files.len() > 1);
    places.into_iter().map(|(name, files)| format!("{name}: {files:?}")).collect()
}

#[test]
fn no_public_type_name_occurs_in_two_files() {
    let files: Vec<(String, String)> = sources(&root().join("src")).iter().map(|file| read(file)).collect();
    let double = double(&files);
    assert!(double.is_empty(), "\n{}\n", double.join("\n"));
    let found = files.iter().map(|(_, text)| types(&tokens(text)).count()).sum::<usize>();
    assert!(found > 500, "{found} types");
}

#[test]
fn a_name_in_two_files_is_found() {
    let files = [
        ("src/a.rs", "pub struct Mesh { n: u32 } pub(super) enum Part {} #[cfg(unix)] pub type Id = u32;"),
        ("src/b.rs", "pub trait Mesh {} enum Part {} // pub type Id"),
    ];
    let files = files.map(|(path, text)| (path.to_owned(), text.to_owned()));
    assert_eq!(double(&files), [r#"Mesh: {"src/a.rs", "src/b.rs"}"#]);
}

//! The floors of the crate: imports only point down, only `src/vk` has `unsafe` and `ash`, and references
//! do not use the GPU. Checked on the source text, without building the crate.

mod cases;
mod circles;
mod formats;
mod lengths;
mod lexer;
mod names;
mod outside;
mod paths;
mod rules;

use std::fs;
use std::path::{Path, PathBuf};

/// Every `.rs` file below `folder`, in order.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for entry in entries {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Path within the repository, with `/`, and the text.
fn read(path: &Path) -> (String, String) {
    let within = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
    (within, fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

#[test]
fn the_source_keeps_to_its_floors() {
    let files = sources(&root().join("src"));
    let mut objections = Vec::new();
    let mut crossings = 0;
    for file in &files {
        let (path, text) = read(file);
        objections.extend(rules::objections(&path, &text));
        crossings += rules::crossings(&path, &text);
    }
    assert!(objections.is_empty(), "\n{}\n", objections.join("\n"));
    // Guards against a checker that finds no imports.
    assert!(
        files.len() >= 20 && crossings >= 10,
        "{} files, {crossings} imports between modules",
        files.len()
    );
}

#[test]
fn tests_and_the_build_script_have_no_unsafe_code() {
    let mut files = sources(&root().join("tests"));
    // Excluded: a Vulkan layer, whose functions the loader calls, needs `unsafe`.
    files.retain(|file| !file.ends_with("tests/faults/layer.rs"));
    files.push(root().join("build.rs"));
    let objections: Vec<String> = files
        .iter()
        .map(|file| read(file))
        .flat_map(|(path, text)| rules::forbidden_words(&path, &lexer::tokens(&text)))
        .collect();
    assert!(objections.is_empty(), "\n{}\n", objections.join("\n"));
}

/// Folders with known circular imports. An entry without a circle must be removed.
const UNDER_RECONSTRUCTION: [&str; 0] = [];

#[test]
fn no_files_depend_on_each_other_in_a_circle() {
    let files: Vec<circles::Source> = sources(&root().join("src")).iter().map(|file| read(file)).collect();
    let (excused, circles): (Vec<String>, Vec<String>) = circles::circles(&files)
        .into_iter()
        .partition(|circle| UNDER_RECONSTRUCTION.iter().any(|folder| circle.contains(folder)));
    assert!(circles.is_empty(), "\n{}\n", circles.join("\n"));
    for folder in UNDER_RECONSTRUCTION {
        let needed = excused.iter().any(|circle| circle.contains(folder));
        assert!(needed, "no circle in {folder} any more: remove it from UNDER_RECONSTRUCTION");
    }
    // Guards against a checker that finds no dependencies.
    let dependencies = circles::dependencies(&files);
    assert!(dependencies > 2 * files.len(), "{dependencies} dependencies of {} files", files.len());
}

/// Functions that may be longer: (file, function, reason). An unneeded entry must be removed.
const MAY_BE_LONG: &[(&str, &str, &str)] = &[];

#[test]
fn no_function_is_longer_than_a_screen() {
    let mut long = Vec::new();
    let mut excused = Vec::new();
    for file in sources(&root().join("src")) {
        let (path, text) = read(&file);
        for function in lengths::functions(&text) {
            let lengths::Function { name, line, body_lines } = function;
            match MAY_BE_LONG.iter().find(|(file, of, _)| *file == path && *of == name) {
                _ if body_lines <= lengths::MAX_LINES => {}
                Some(entry) => excused.push(entry),
                None => long.push(format!("{path}:{line}: {name} has {body_lines} lines")),
            }
        }
    }
    assert!(long.is_empty(), "more than {} lines:\n{}\n", lengths::MAX_LINES, long.join("\n"));
    for entry in MAY_BE_LONG {
        assert!(excused.contains(&entry), "{entry:?} is not needed any more");
    }
}

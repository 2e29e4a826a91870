//! What the program and its tests use from outside: files of the user, other programs.

use crate::lexer::tokens;
use crate::{read, root, sources};

/// Files of `src` that open files without `crate::file`, and the source of the opened files.
const OPENS: [(&str, &str); 8] = [
    ("src/command/interrupt.rs", "/proc"),
    ("src/figure/machine.rs", "/proc, and the program itself"),
    ("src/model/fetch.rs", "what it fetched"),
    ("src/paper/progressive_mesh/figures/build.rs", "the report of its own child"),
    ("src/texture/bake/work.rs", "a folder, to flush it"),
    ("src/view/act.rs", "/proc"),
    ("src/view/reload.rs", "its own temporary file"),
    ("src/view/timed.rs", "/proc"),
];

/// True if `text`, without its unit tests, opens a file without a check of its kind.
fn opens(text: &str) -> bool {
    let (program, _) = text.split_once("#[cfg(test)]\nmod ").unwrap_or((text, ""));
    let words: Vec<String> = tokens(program).into_iter().map(|token| token.text).collect();
    words.windows(3).any(|three| {
        matches!(
            three.iter().map(String::as_str).collect::<Vec<_>>()[..],
            ["fs", "::", "read" | "read_to_string"] | ["File", "::", "open"]
        )
    })
}

#[test]
fn only_regular_files_of_the_user_are_opened() {
    let files: Vec<_> = sources(&root().join("src")).iter().map(|file| read(file)).collect();
    let found: Vec<&str> = files.iter().filter(|(_, text)| opens(text)).map(|(path, _)| &**path).collect();
    assert_eq!(found, OPENS.map(|(path, _)| path), "open a user's file with crate::file");
    for (text, expected) in [
        ("let text = std::fs::read_to_string(path)?;", true),
        ("path.map(std::fs::read)", true),
        ("File::open(path)", true),
        ("TileFile::open(path); fs::read_dir(path); file::read_text(path, 7)", false),
        ("fn a() {}\n#[cfg(test)]\nmod tests { fn b() { fs::read(path) } }", false),
    ] {
        assert_eq!(opens(text), expected, "{text}");
    }
}

/// Programs that tests may start by name; `./x` looks for them. Compilers are named by CXX and CARGO.
const PROGRAMS: [&str; 2] = ["sh", "Xvfb"];

fn started(text: &str) -> Vec<&str> {
    let after = text.split("Command::new(\"").skip(1);
    after.filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn tests_start_only_programs_that_x_looks_for() {
    // Not this file, which has examples.
    let files =
        sources(&root().join("tests")).into_iter().filter(|file| !file.ends_with("floors/outside.rs"));
    let files: Vec<_> = files.map(|file| read(&file)).collect();
    let all: Vec<_> = files
        .iter()
        .flat_map(|(path, text)| started(text).into_iter().map(move |name| (path, name)))
        .collect();
    assert!(all.len() >= PROGRAMS.len(), "{all:?}");
    let strange: Vec<_> = all.iter().filter(|(_, name)| !PROGRAMS.contains(name)).collect();
    assert!(strange.is_empty(), "{strange:?}");
    assert_eq!(started("Command::new(\"sh\"); process::Command::new(\"cc\").arg(\"a\")"), ["sh", "cc"]);
}

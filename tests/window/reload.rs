//! F5 recompiles the shaders while the window is open.

use crate::FAST;
use crate::display::{Display, key};
use crate::program::{Program, Seen};
use std::path::Path;

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let (path, name) = entry.map(|entry| (entry.path(), entry.file_name())).unwrap();
        match path.is_dir() {
            true => copy(&path, &to.join(name)),
            false => std::fs::copy(&path, to.join(name)).map(drop).unwrap(),
        }
    }
}

/// The rows above the status message.
fn top(seen: &Seen) -> &[u8] {
    &seen.0.rgba[..4 * 320 * 120]
}

#[test]
fn a_syntax_error_leaves_the_picture_and_the_mended_shader_changes_it() {
    let display = Display::start();
    let folder = tempfile::tempdir().unwrap();
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl"), &folder.path().join("glsl"));
    let shader = folder.path().join("glsl/virtual_texture/texturing.frag");
    let built = std::fs::read_to_string(&shader).unwrap();
    let write = |text: &str| std::fs::write(&shader, text).unwrap();
    let sources = [("ORTELIUS_SOURCES", folder.path().to_str().unwrap())];
    let mut window =
        Program::start(&display, &["globe", "--size", "320x300", "--no-panels", "-D", FAST], &sources);
    let first = window.settled_picture();

    write(&format!("{built}\nvoid broken( {{\n"));
    window.press(key::F5);
    window.said("texturing.frag");
    let message = window.until_other("the message is on the screen", &first);
    assert!(top(&message) == top(&first), "the old pipeline must stay");

    write(&built.replace("void main() {", "void unturned();\nvoid main() {\n    unturned();\n    colour.rgb = colour.gbr;\n}\nvoid unturned() {"));
    window.press(key::F5);
    window.said("shaders differ from the built ones");
    window.until("other colours", |window| top(&window.picture()) != top(&first));

    write(&built);
    window.press(key::F5);
    window.said("0 shaders differ");
    window.until("the original picture", |window| top(&window.picture()) == top(&first));
    window.press(key::ESCAPE);
    let (code, words) = window.ended();
    assert_eq!(code, Some(0), "{words}");
    assert_eq!(words.lines().filter(|line| line.contains("WARN")).count(), 1, "{words}");
}

#[test]
fn without_sources_the_window_says_so() {
    let display = Display::start();
    let nowhere = [("ORTELIUS_SOURCES", "/nowhere")];
    let mut window = Program::start(&display, &["globe", "--size", "160x90", "--no-panels"], &nowhere);
    window.settled_picture();
    window.press(key::F5);
    window.said("F5 compiles /nowhere/glsl, which does not exist");
    window.quit();
}

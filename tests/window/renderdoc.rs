//! F8 triggers a capture. A preloaded library replaces RenderDoc.

use crate::display::{Display, key};
use crate::program::Program;
use std::process::Command;

/// Entry 15 of RenderDoc's function table is TriggerCapture.
const LIBRARY: &str = r#"
#include <stdio.h>
#include <stdlib.h>
static void trigger(void) { FILE *file = fopen(getenv("CAPTURED"), "a"); fputs("captured\n", file); fclose(file); }
static void *table[22];
extern "C" int RENDERDOC_GetAPI(int version, void **api)
{
    table[15] = (void *)trigger;
    *api = table;
    return version == 10000;
}
"#;

#[test]
fn f8_asks_renderdoc_for_one_capture() {
    let display = Display::start();
    let folder = tempfile::tempdir().unwrap();
    let [source, library, captured] =
        ["renderdoc.cpp", "librenderdoc.so", "captured"].map(|name| folder.path().join(name));
    std::fs::write(&source, LIBRARY).unwrap();
    // CXX names the compiler, as for the build.
    let mut compiler = Command::new(std::env::var("CXX").unwrap_or_else(|_| "c++".into()));
    compiler.args(["-shared", "-fPIC", "-Wl,-soname,librenderdoc.so", "-o"]).arg(&library).arg(&source);
    assert!(compiler.status().unwrap().success(), "{compiler:?}");
    let loaded = [("LD_PRELOAD", library.to_str().unwrap()), ("CAPTURED", captured.to_str().unwrap())];
    let mut window = Program::start(&display, &["globe", "--size", "96x54", "--no-panels"], &loaded);
    window.settled_picture();
    window.press(key::F8);
    window.said("RenderDoc captures the next frame");
    window.quit_in_silence();
    assert_eq!(std::fs::read_to_string(&captured).unwrap(), "captured\n");
}

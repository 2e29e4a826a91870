//! A resize in which one call fails leaves a renderer that draws as before.

use super::load_layer;
use ortelius::renderer::{Options, Renderer};
use ortelius::scene::Scene;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// Calls of the resize that fail, evenly spaced.
const MAX: usize = 8;
const START: &str = "ORTELIUS_FAULT_START";

/// Resizes a renderer; the layer counts only the calls of the resize. Prints how it ended.
fn resize_with_a_fault(start: &Path) {
    let scene = Scene::embedded("earth").unwrap();
    let pose = scene.pose(0).unwrap();
    let (before, after) = ([64, 36], [48, 64]);
    let options = Options { size: Some(before), deterministic: true, ..Options::default() };
    let mut renderer = Renderer::open(&scene, &options).unwrap();
    let settled = |renderer: &mut Renderer| {
        renderer.settle(&pose).unwrap();
        renderer.picture_bytes().unwrap()
    };
    let first = settled(&mut renderer);
    std::fs::write(start, "").unwrap();
    let resized = renderer.resize(after);
    std::fs::remove_file(start).unwrap();
    match resized {
        Ok(()) => println!("resized"),
        Err(error) => {
            println!("refused: {error}");
            assert_eq!(renderer.size(), before);
            assert!(settled(&mut renderer) == first, "another picture after: {error}");
            renderer.resize(after).unwrap();
        }
    }
    assert_eq!((renderer.size(), settled(&mut renderer).len()), (after, 4 * 48 * 64));
}

/// Runs this test again with the call `number` of the resize failing, 0 for none. Returns whether the resize was
/// refused, and the calls that the layer logged.
fn run_again(number: usize) -> (bool, usize) {
    let folder: TempDir = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "--nocapture", "resize::a_resize_that_fails_changes_nothing"]);
    load_layer(&mut command);
    command.env(START, folder.path().join("start"));
    command.env("ORTELIUS_FAULT", format!("device:{number}")).env("ORTELIUS_FAULT_LOG", &log);
    let ran = command.output().unwrap();
    let words = [ran.stdout, ran.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(ran.status.success(), "call {number}: {words}");
    assert!(words.contains("resized") || words.contains("refused: "), "{words}");
    (words.contains("refused: "), std::fs::read_to_string(log).unwrap().lines().count())
}

#[test]
fn a_resize_that_fails_changes_nothing() {
    if let Some(start) = std::env::var_os(START) {
        return resize_with_a_fault(Path::new(&start));
    }
    let (refused, calls) = run_again(0);
    assert!(!refused && calls > MAX, "{calls} calls");
    let ended = (0..MAX).map(|n| run_again(1 + n * calls / MAX));
    let ended: Vec<_> = ended.collect();
    assert!(ended.iter().all(|(_, failed)| *failed == 1), "{ended:?}");
    assert!(ended.iter().filter(|(refused, _)| *refused).count() > MAX / 2, "{ended:?}");
}

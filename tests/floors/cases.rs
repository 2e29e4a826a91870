//! Sources that the checkers must reject, and similar ones that they must accept.

use crate::circles::{Source, circles};
use crate::rules::objections;

#[track_caller]
fn objects(file: &str, text: &str, reason: &str) {
    let found = objections(file, text);
    assert!(found.iter().any(|objection| objection.contains(reason)), "{file}: {text}: {found:?}");
}

#[track_caller]
fn passes(file: &str, text: &str) {
    let found = objections(file, text);
    assert!(found.is_empty(), "{file}: {text}: {found:?}");
}

#[test]
fn an_upward_import_is_found() {
    objects("src/math/a.rs", "use crate::vk::Gpu;", "math (floor 0) names vk (floor 1)");
    objects("src/scene/mod.rs", "use crate::{math::b, paper};", "scene (floor 2) names paper (floor 3)");
    objects(
        "src/figure/run.rs",
        "fn f() { crate::paper::x::draw() }",
        "figure (floor 2) names paper (floor 3)",
    );
    objects("src/vk/mod.rs", "type T = super::renderer::Renderer;", "vk (floor 1) names renderer (floor 4)");
    objects("src/stats/mod.rs", "mod tests { use super::super::scene; }", "stats (floor 0) names scene");
    objects("src/renderer.rs", "use crate::view::Window;", "renderer (floor 4) names view (floor 5)");
    passes("src/renderer.rs", "use crate::{figure, math, paper::x, picture, scene, vk};");
    passes("src/paper/x/a.rs", "use crate::{figure, scene::b, vk};");
    passes("src/figure/run.rs", "use crate::{model, picture, reference, stats, texture, vk};");
    passes("src/stats/mod.rs", "mod tests { use super::*; } fn f() { crate::math::g() }");
}

#[test]
fn an_upward_import_is_reported_with_its_line() {
    objects("src/math/a.rs", "\n// comment\nuse crate::vk::Gpu;", "src/math/a.rs:3: ");
}

#[test]
fn modules_of_one_floor_must_not_import_each_other() {
    objects("src/vk/a.rs", "use crate::model::Model;", "vk and model (floor 1) must not import each other");
    objects("src/texture/a.rs", "use crate::vk::Gpu;", "texture and vk (floor 1) must not import each other");
    objects(
        "src/frame/a.rs",
        "use crate::scene::Scene;",
        "frame and scene (floor 2) must not import each other",
    );
    objects("src/model/a.rs", "use crate::reference::raster;", "model and reference (floor 1)");
    objects("src/vk/a.rs", "use crate::reference::raster;", "vk and reference (floor 1)");
    passes("src/reference/a.rs", "use crate::model::mesh::Mesh;");
}

#[test]
fn a_reference_must_not_use_the_gpu() {
    for file in ["src/reference/raster.rs", "src/paper/x/reference.rs", "src/paper/x/reference/a.rs"] {
        objects(file, "use crate::vk::Gpu;", "a reference must not use the GPU");
        passes(file, "// crate::vk::Gpu\nuse crate::math::a;");
    }
    passes("src/paper/x/figures.rs", "use super::reference; use crate::vk::Gpu;");
}

#[test]
fn papers_must_not_import_each_other() {
    objects("src/paper/x/a.rs", "use crate::paper::y::b;", "papers must not import each other: paper::y::b");
    objects("src/paper/x/a.rs", "use super::super::y;", "papers must not import each other");
    objects("src/paper/x.rs", "use super::y;", "papers must not import each other");
    objects("src/paper/x/a.rs", "use crate::paper::*;", "papers must not import each other");
    passes("src/paper/x/a.rs", "use crate::paper::x::b; use super::{b, c};");
    passes("src/paper/mod.rs", "pub mod x; pub mod y; use x::Z; use self::y::W;");
}

#[test]
fn the_library_must_not_import_its_command_line() {
    objects("src/renderer.rs", "use crate::command::Arguments;", "must not import its command line");
    objects("src/lib.rs", "pub mod command;", "must not import its command line");
    passes("src/main.rs", "mod command; fn main() { command::run() }");
    passes("src/command/render.rs", "use crate::command::Arguments; use ortelius::{renderer, vk};");
    passes("src/vk/command.rs", "use super::command; use crate::vk::command::Buffer;");
}

#[test]
fn unsafe_code_and_ash_stay_in_vk() {
    for file in ["src/math/a.rs", "src/main.rs", "src/lib.rs", "src/paper/vk/a.rs"] {
        objects(file, "fn f() { unsafe { g() } }", "unsafe code outside src/vk");
        objects(file, "use ash::vk::Format;", "ash outside src/vk");
    }
    objects("src/scene/a.rs", "fn f(x: ash::vk::Image) {}", "ash outside src/vk");
    passes("src/vk/a.rs", "use ash::vk::Format; fn f() { unsafe { g() } }");
    passes(
        "src/math/a.rs",
        "#![deny(unsafe_code)] // unsafe ash::\nconst A: &str = \"unsafe ash::\"; fn hash() {}",
    );
}

#[test]
fn a_module_must_have_a_floor() {
    objects("src/math/a.rs", "use crate::utilities::b;", "names utilities, which has no floor");
    objects("src/utilities/a.rs", "use crate::math::b;", "utilities has no floor");
}

#[test]
fn ways_around_the_floors_are_closed() {
    objects("src/math/a.rs", "use crate::*;", "imports the whole crate");
    objects("src/renderer.rs", "use super::*;", "imports the whole crate");
    objects("src/math/a.rs", "#[path = \"../vk/mod.rs\"] mod gpu;", "#[path] hides a module");
    objects("src/math/a.rs", "use ortelius::vk::Gpu;", "math (floor 0) names vk");
    objects("src/math/a.rs", "use crate::r#vk::Gpu;", "math (floor 0) names vk");
    objects("src/math/a.rs", "use crate /* */ :: vk;", "math (floor 0) names vk");
    objects("src/math/a.rs", "use { crate::vk::Gpu, std::fmt };", "math (floor 0) names vk");
    objects("src/math/a.rs", "macro_rules! m { () => { $crate::vk::f() } }", "math (floor 0) names vk");
    passes("src/math/a.rs", "#[derive(Path)] struct A { path: B }");
}

#[track_caller]
fn circle_of(files: &[(&str, &str)]) -> Option<String> {
    let sources: Vec<Source> = files.iter().map(|&(path, text)| (path.into(), text.into())).collect();
    let found = circles(&sources);
    assert!(found.len() < 2, "{found:?}");
    found.into_iter().next()
}

#[track_caller]
fn is_circle(files: &[(&str, &str)], tie: &str) {
    let found = circle_of(files).unwrap_or_else(|| panic!("no circle: {files:?}"));
    assert!(found.contains(tie), "{found}");
}

#[track_caller]
fn is_no_circle(files: &[(&str, &str)]) {
    assert_eq!(circle_of(files), None, "{files:?}");
}

#[test]
fn two_files_that_depend_on_each_other_are_a_circle() {
    let a = ("src/x/a.rs", "use super::b::B; pub struct A;");
    is_circle(&[a, ("src/x/b.rs", "use super::a::A; pub struct B;")], "src/x/a.rs -> src/x/b.rs: B");
    is_circle(&[a, ("src/x/b.rs", "fn f() { crate::x::a::g() }")], "src/x/b.rs -> src/x/a.rs: g");
    is_circle(&[a, ("src/x/b.rs", "use super::{c, a as d}; fn f() { d::g() }")], "src/x/b.rs -> src/x/a.rs");
    is_circle(&[a, ("src/x/b.rs", "use super::a::*;")], "src/x/b.rs -> src/x/a.rs: *");
    is_no_circle(&[a, ("src/x/b.rs", "// crate::x::a\n/// [`super::a::A`]\npub struct B;")]);
    is_no_circle(&[a, ("src/x/b.rs", "use std::a::A; fn f(a: A) { a.b::<A>() }")]);
}

#[test]
fn a_circle_may_have_several_steps_across_folders() {
    is_circle(
        &[
            ("src/x/a.rs", "use super::b::B;"),
            ("src/x/b.rs", "use crate::y::c::C;"),
            ("src/y/c.rs", "use crate::x::a::A;"),
        ],
        "a circle of 3 files",
    );
}

#[test]
fn a_re_export_is_followed_to_the_file_that_defines_the_name() {
    let parent = ("src/x/mod.rs", "mod a; mod b; pub use a::A; pub use b::{B as C, D};");
    let a = ("src/x/a.rs", "use super::C; pub struct A;");
    is_circle(&[parent, a, ("src/x/b.rs", "use super::A; pub struct B;")], "src/x/a.rs -> src/x/b.rs: B");
    is_circle(&[parent, a, ("src/x/b.rs", "use crate::x; fn f(_: x::A) {}")], "src/x/b.rs -> src/x/a.rs: A");
    is_no_circle(&[parent, a, ("src/x/b.rs", "pub struct B; pub struct D;")]);
    is_no_circle(&[parent, ("src/x/a.rs", "use super::D; pub struct A;"), ("src/x/b.rs", "pub struct D;")]);
}

#[test]
fn a_child_may_use_what_its_parents_file_defines() {
    let child = ("src/x/a.rs", "use super::P; pub struct A;");
    is_no_circle(&[("src/x/mod.rs", "mod a; use a::A; pub struct P(A);"), child]);
    is_no_circle(&[("src/x.rs", "mod a; pub struct P; fn f() { a::A }"), child]);
    // The exception applies only to a file's own parents: src/y/mod.rs is not a parent of src/x/a.rs.
    is_circle(
        &[
            ("src/x/a.rs", "use crate::y::B; pub struct A;"),
            ("src/y/mod.rs", "pub struct B(crate::x::a::A);"),
        ],
        "src/y/mod.rs -> src/x/a.rs: A",
    );
}

#[test]
fn test_code_makes_no_circle() {
    let a = ("src/x/a.rs", "use super::b::B; pub struct A;");
    is_no_circle(&[a, ("src/x/b.rs", "pub struct B; #[cfg(test)] mod tests { use crate::x::a::A; }")]);
    is_circle(
        &[a, ("src/x/b.rs", "#[cfg(test)] mod tests { fn f() {} } use crate::x::a::A; pub struct B;")],
        "src/x/b.rs -> src/x/a.rs: A",
    );
}

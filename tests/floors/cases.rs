//! What the checker must object to, and the neighbours that it must let pass.

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
fn an_import_that_points_up_is_found() {
    objects("src/math/a.rs", "use crate::vk::Gpu;", "math (floor 0) names vk (floor 1)");
    objects("src/scene/mod.rs", "use crate::{math::b, paper};", "scene (floor 2) names paper (floor 3)");
    objects(
        "src/figure/run.rs",
        "fn f() { crate::paper::x::draw() }",
        "figure (floor 2) names paper (floor 3)",
    );
    objects("src/vk/mod.rs", "type T = super::renderer::Renderer;", "vk (floor 1) names renderer (floor 4)");
    objects("src/stats/mod.rs", "mod tests { use super::super::scene; }", "stats (floor 0) names scene");
    passes("src/renderer.rs", "use crate::{figure, math, paper::x, picture, scene, vk, view};");
    passes("src/paper/x/a.rs", "use crate::{figure, scene::b, vk};");
    passes("src/figure/run.rs", "use crate::{model, picture, reference, stats, texture, vk};");
    passes("src/stats/mod.rs", "mod tests { use super::*; } fn f() { crate::math::g() }");
}

#[test]
fn an_import_that_points_up_is_named_with_its_line() {
    objects("src/math/a.rs", "\n// comment\nuse crate::vk::Gpu;", "src/math/a.rs:3: ");
}

#[test]
fn worlds_of_one_floor_do_not_know_each_other() {
    objects("src/vk/a.rs", "use crate::model::Model;", "vk and model (floor 1) do not know each other");
    objects("src/texture/a.rs", "use crate::vk::Gpu;", "texture and vk (floor 1) do not know each other");
    objects("src/frame/a.rs", "use crate::scene::Scene;", "frame and scene (floor 2) do not know each other");
    objects("src/model/a.rs", "use crate::reference::raster;", "model and reference (floor 1)");
    objects("src/vk/a.rs", "use crate::reference::raster;", "vk and reference (floor 1)");
    passes("src/reference/a.rs", "use crate::model::mesh::Mesh;");
}

#[test]
fn a_reference_never_looks_at_the_gpu() {
    for file in ["src/reference/raster.rs", "src/paper/x/reference.rs", "src/paper/x/reference/a.rs"] {
        objects(file, "use crate::vk::Gpu;", "a reference never looks at the GPU");
        passes(file, "// crate::vk::Gpu\nuse crate::math::a;");
    }
    passes("src/paper/x/figures.rs", "use super::reference; use crate::vk::Gpu;");
}

#[test]
fn papers_do_not_name_each_other() {
    objects("src/paper/x/a.rs", "use crate::paper::y::b;", "papers do not name each other: paper::y::b");
    objects("src/paper/x/a.rs", "use super::super::y;", "papers do not name each other");
    objects("src/paper/x.rs", "use super::y;", "papers do not name each other");
    objects("src/paper/x/a.rs", "use crate::paper::*;", "papers do not name each other");
    passes("src/paper/x/a.rs", "use crate::paper::x::b; use super::{b, c};");
    passes("src/paper/mod.rs", "pub mod x; pub mod y; use x::Z; use self::y::W;");
}

#[test]
fn the_library_does_not_know_its_command_line() {
    objects("src/renderer.rs", "use crate::command::Arguments;", "does not know its command line");
    objects("src/lib.rs", "pub mod command;", "does not know its command line");
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
    objects("src/math/a.rs", "use crate::utilities::b;", "names utilities, which stands on no floor");
    objects("src/utilities/a.rs", "use crate::math::b;", "utilities stands on no floor");
}

#[test]
fn ways_around_the_floors_are_closed() {
    objects("src/math/a.rs", "use crate::*;", "takes in the whole crate");
    objects("src/renderer.rs", "use super::*;", "takes in the whole crate");
    objects("src/math/a.rs", "#[path = \"../vk/mod.rs\"] mod gpu;", "escapes the floors");
    objects("src/math/a.rs", "use ortelius::vk::Gpu;", "math (floor 0) names vk");
    objects("src/math/a.rs", "use crate::r#vk::Gpu;", "math (floor 0) names vk");
    objects("src/math/a.rs", "use crate /* */ :: vk;", "math (floor 0) names vk");
    objects("src/math/a.rs", "use { crate::vk::Gpu, std::fmt };", "math (floor 0) names vk");
    objects("src/math/a.rs", "macro_rules! m { () => { $crate::vk::f() } }", "math (floor 0) names vk");
    passes("src/math/a.rs", "#[derive(Path)] struct A { path: B }");
}

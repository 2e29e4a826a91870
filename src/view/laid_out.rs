//! Tests of the panels without a window: the panels must show the numbers of the renderer's report.

use super::job::JobProgress;
use super::panels::Panels;
use super::path::Player;
use super::shown::PanelInput;
use super::stage::Stage;
use egui::{Context, Event, Pos2, RawInput, Rect, Shape, Vec2};
use ortelius::frame::Records;
use ortelius::renderer::report::{FrameReport, Report};
use ortelius::scene::Scene;
use ortelius::scene::camera::Camera;
use ortelius::vk::{Feature, GpuOptions, PassResources, Watched};

/// A piece of text and its upper left corner.
type Text = (Pos2, String);

/// All texts in the panels. If `under` is given, the pointer rests on the first text that equals it.
fn texts(stage: &Stage, resources: &[PassResources], under: Option<&str>) -> Vec<Text> {
    let (camera, player) = (stage.scene.cameras.values().next().unwrap(), Player::new(&stage.scene));
    let shown = PanelInput { resources, ..PanelInput::of(stage, camera, &player) };
    let (mut panels, context) = (Panels::new(true), Context::default());
    context.all_styles_mut(|style| {
        (style.animation_time, style.interaction.tooltip_delay) = (0.0, 0.0);
        style.interaction.show_tooltips_only_when_still = false;
    });
    let mut found: Vec<Text> = Vec::new();
    // The first layouts measure sizes. The pointer can be placed only when the positions of the texts are known.
    for round in 0..6 {
        let pointer = under.and_then(|under| found.iter().find(|(_, text)| text == under));
        let events = pointer.map(|(at, _)| Event::PointerMoved(*at + Vec2::splat(4.0)));
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(900.0, 3000.0))),
            time: Some(f64::from(round)),
            events: events.into_iter().collect(),
            ..RawInput::default()
        };
        let output = context.run_ui(input, |ui| drop(panels.show(ui, &shown)));
        found.clear();
        output.shapes.iter().for_each(|clipped| collect(&clipped.shape, &mut found));
    }
    found
}

fn collect(shape: &Shape, into: &mut Vec<Text>) {
    match shape {
        Shape::Text(text) => into.push((text.pos, text.galley.text().to_owned())),
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, into)),
        _ => {}
    }
}

/// The text to the right of the label `name`.
fn value<'t>(texts: &'t [Text], name: &str) -> &'t str {
    let (label, _) =
        texts.iter().find(|(_, text)| text == name).unwrap_or_else(|| panic!("{name}: {texts:#?}"));
    let beside = texts.iter().filter(|(at, _)| (at.y - label.y).abs() < 6.0 && at.x > label.x);
    let nearest = beside.min_by(|(a, _), (b, _)| a.x.total_cmp(&b.x));
    &nearest.unwrap_or_else(|| panic!("{name} has no value: {texts:#?}")).1
}

/// The earth with a mesh, small caches and few uploads a frame, so that tiles wait.
pub fn stage(gpu: &Watched) -> Stage {
    let mesh = "surface.bunny={geometry={kind='progressive-mesh', source='sphere', size_m=9e4, latitude_deg=30.2, \
                longitude_deg=31.6}}";
    let changes = [mesh, "cache.gpu_tiles=24", "cache.host_tiles=30", "cache.upload_tiles_per_frame=2"];
    let scene = Scene::embedded("earth").unwrap().with(&changes.map(str::to_owned)).unwrap();
    Stage::new(gpu, scene, Vec::new(), [96, 54], true, &JobProgress::default()).unwrap()
}

#[test]
fn each_panel_has_the_numbers_of_the_report_of_the_same_frame() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    let mut stage = stage(&gpu);
    stage.renderer.keep(Records::all());
    let start = *stage.scene.cameras.values().next().unwrap();
    let mut seen = [0; 4];
    for step in 0..10 {
        let camera = Camera { altitude_m: 3e5 * f64::from(1 + step), ..start };
        stage.renderer.frame(&camera.pose()).unwrap();
        stage.renderer.drain().unwrap();
        let frames = Report::of(&stage.renderer, "", "", None).frames;
        let of = |frame: &FrameReport| (frame.texture.clone().unwrap(), frame.surfaces.clone().unwrap());
        let (tiles, meshes) = of(frames.last().unwrap());
        let resident = frames.iter().map(of).map(|(tiles, _)| tiles.uploads).sum::<usize>()
            - frames.iter().map(of).map(|(tiles, _)| tiles.gpu_evictions).sum::<usize>();
        let texts = texts(&stage, &[], None);
        for (name, expected) in [
            ("visible", tiles.tiles.to_string()),
            ("wanted", tiles.wanted.to_string()),
            ("resident", format!("{resident} of 24")),
            ("queued", tiles.pending.to_string()),
            ("hits, misses", format!("{}, {}", tiles.hits, tiles.misses)),
            ("loads, uploads", format!("{}, {}", tiles.loads, tiles.uploads)),
            ("uploaded", format!("{:.2} MB", tiles.upload_bytes as f64 / 1e6)),
            ("evictions, device and host", format!("{}, {}", tiles.gpu_evictions, tiles.host_evictions)),
            ("level bias", tiles.bias.to_string()),
            ("instances seen", meshes.instances_seen.to_string()),
            ("faces", meshes.faces.to_string()),
            ("vertices", meshes.vertices.to_string()),
            ("splits, collapses", format!("{}, {}", meshes.splits, meshes.collapses)),
            ("written", format!("{:.1} kB", meshes.mesh_upload_bytes as f64 / 1e3)),
            ("governor's factor", format!("{:.3}", meshes.error_factor)),
        ] {
            assert_eq!(value(&texts, name), expected, "step {step}: {name}");
        }
        let counts = [tiles.pending, tiles.hits, tiles.misses, tiles.uploads];
        seen.iter_mut().zip(counts).for_each(|(seen, count)| *seen += count);
    }
    assert!(seen.iter().all(|sum| *sum > 0), "each number must differ from 0 in a frame: {seen:?}");
}

#[test]
fn under_the_pointer_a_pass_has_the_resources_of_the_frame() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    let mut stage = stage(&gpu);
    let pose = stage.scene.pose(0).unwrap();
    stage.renderer.settle(&pose).unwrap();
    gpu.list_resources(true);
    let mut passes = Vec::new();
    let recorded = stage.renderer.frame_with(&pose, &[], &[], |frame, _, _, _| {
        passes = frame.resources().to_vec();
        Ok(())
    });
    recorded.unwrap();
    gpu.list_resources(false);
    stage.renderer.drain().unwrap();

    // The passes of the frame, each with real allocations.
    let labels: Vec<&String> = passes.iter().map(|pass| &pass.label).collect();
    let timed = stage.renderer.records.last().unwrap();
    assert_eq!(labels, timed.passes.iter().map(|pass| &pass.label).collect::<Vec<_>>());
    let allocations = gpu.allocations().unwrap();
    for used in passes.iter().flat_map(|pass| &pass.resources) {
        let is_it = |(name, bytes): &(String, u64)| *name == used.name && *bytes >= used.bytes;
        assert!(allocations.iter().any(is_it), "{used:?}");
    }
    let texts = texts(&stage, &passes, Some("texturing"));
    for (name, about) in [
        ("tile pool", vec!["read"]),
        ("page table", vec!["u32", "read"]),
        ("depth", vec!["20736 B", "96 x 54, Depth32Float", "read"]),
        ("picture", vec!["20736 B", "96 x 54, Rgba8Srgb", "read and written"]),
    ] {
        let (row, _) =
            texts.iter().rfind(|(_, text)| text == name).unwrap_or_else(|| panic!("{name}: {texts:#?}"));
        let beside: Vec<&str> = texts
            .iter()
            .filter(|(at, _)| (at.y - row.y).abs() < 6.0 && at.x > row.x)
            .map(|(_, text)| &**text)
            .collect();
        assert!(about.iter().all(|about| beside.contains(about)), "{name}: {beside:?}, not {about:?}");
    }
    let others = ["surfaces", "footprint", "dedup", "compact", "read-back"];
    let has = |pass: &str| passes.iter().any(|found| found.label == pass && !found.resources.is_empty());
    assert!(others.into_iter().all(has), "{passes:#?}");
}

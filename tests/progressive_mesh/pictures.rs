//! Frames on the device, with validation, compared with f64 pictures of the same level and with a fresh
//! session.

use glam::{DVec2, DVec3};
use ortelius::frame::{Run, Technique};
use ortelius::math::camera::Pose;
use ortelius::model::mesh::SourceMesh;
use ortelius::paper::progressive_mesh::cache::live_faces;
use ortelius::paper::progressive_mesh::mesh::{NOWHERE, ProgressiveMesh};
use ortelius::paper::progressive_mesh::place::Placement;
use ortelius::paper::progressive_mesh::run::level_for_error;
use ortelius::paper::progressive_mesh::surface::vertices;
use ortelius::paper::progressive_mesh::surface::vertices::MORPH_BAND_LOG2;
use ortelius::paper::progressive_mesh::{ProgressiveMeshSettings, ProgressiveMeshes, load};
use ortelius::picture::error::compare;
use ortelius::picture::{Picture, PixelFormat};
use ortelius::reference::distance::{Triangles, compare_surfaces};
use ortelius::reference::{ReferenceView, Sample};
use ortelius::renderer::{Options, Renderer};
use ortelius::scene::Scene;
use ortelius::vk::{Feature, Gpu, GpuOptions, Watched};

/// A device that counts shader invocations, if supported.
pub fn device() -> Watched {
    Watched::open(&GpuOptions { wishes: &[Feature::PipelineStatistics], ..GpuOptions::default() })
}

const SIZE: [u32; 2] = [320, 180];

/// Options for a small picture.
pub fn options() -> Options<'static> {
    Options {
        target: PixelFormat::Srgb8,
        size: Some([64, 36]),
        device: None,
        validate: true,
        deterministic: false,
        stop: None,
    }
}

fn scene(name: &str, changes: &[&str]) -> Scene {
    let changes: Vec<String> = changes.iter().map(|change| change.to_string()).collect();
    Scene::load_with(name, &changes).unwrap()
}

pub fn open(gpu: &Gpu, scene: &Scene) -> Run<ProgressiveMeshes> {
    let settings = ProgressiveMeshSettings {
        size: SIZE,
        ..ProgressiveMeshSettings::of_scene(scene, PixelFormat::Linear32).unwrap()
    };
    ProgressiveMeshes::run(gpu.clone(), &load(scene).unwrap(), settings).unwrap()
}

/// The expected position and normal of each vertex in f64. With `band_log2`, a vertex may still be on its way from its
/// split vertex.
fn seen_vertices(scene: &Scene, wanted: f64, band_log2: Option<f64>) -> Vec<(DVec3, DVec3)> {
    let model = &load(scene).unwrap()[0];
    let mesh = &model.mesh;
    let full = ortelius::paper::progressive_mesh::cache::live_faces(mesh, mesh.last_level());
    let normals = vertices::normals(mesh, &full);
    let dvec3 = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let mut seen: Vec<(DVec3, DVec3)> = mesh
        .vertices
        .positions
        .iter()
        .zip(&normals)
        .map(|(&position, &normal)| (dvec3(position), dvec3(normal)))
        .collect();
    let Some(band_log2) = band_log2 else { return seen };
    let first = mesh.levels[0].vertices as usize;
    // A split vertex precedes the vertices that split from it, so its position is already known.
    for level in 1..mesh.levels.len() {
        let (before, after) = (&mesh.levels[level - 1], &mesh.levels[level]);
        for vertex in before.vertices as usize..after.vertices as usize {
            let split = mesh.splits.split_vertices[vertex - first] as usize;
            let share = ((f64::from(before.error).log2() - wanted.log2()) / band_log2).clamp(0.0, 1.0);
            let (own, from) = (seen[vertex], seen[split]);
            seen[vertex] = (from.0.lerp(own.0, share), from.1.lerp(own.1, share));
        }
    }
    seen
}

/// The f64 view of the session's only instance at its level, and the normals of each triangle.
fn truth(
    session: &Run<ProgressiveMeshes>,
    pose: &Pose,
    seen: &[(DVec3, DVec3)],
) -> (ReferenceView, Vec<[DVec3; 3]>) {
    let (place, _) = session.technique.surfaces[0].instances().next().unwrap();
    let place: Placement = *place;
    let (mut mesh, mut normals) = (SourceMesh::default(), Vec::new());
    for (n, face) in session.technique.surfaces[0].faces(0).unwrap().iter().enumerate() {
        mesh.positions.extend(face.map(|vertex| place.to_world(seen[vertex as usize].0)));
        // Barycentric coordinates as texture coordinates, so that the rasteriser interpolates them.
        mesh.coordinates.extend([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(DVec2::from));
        mesh.triangles.push([0, 1, 2].map(|corner| 3 * n as u32 + corner));
        normals.push(face.map(|vertex| place.rotation * seen[vertex as usize].1));
    }
    (ReferenceView::new(&mesh, &pose.world_to_clip(SIZE[0], SIZE[1]), pose.eye, SIZE), normals)
}

fn shade(sample: &Sample, normals: &[[DVec3; 3]], sun: DVec3) -> [f32; 4] {
    let [a, b, c] = normals[sample.triangle as usize];
    let normal = a * (1.0 - sample.s - sample.t) + b * sample.s + c * sample.t;
    let grey = 0.6 * (0.25 + 0.75 * normal.normalize().dot(sun).max(0.0));
    [grey as f32, grey as f32, grey as f32, 1.0]
}

/// A pixel is certain if its centre stays inside one triangle when moved by a GPU's snapping to 1/256 pixel
/// and by f32 rounding.
const RADIUS_PX: f64 = 1.0 / 128.0;
/// The bound of a difference in linear light. In a triangle a third of a pixel wide, 1/256 of a pixel changes a
/// barycentric coordinate by 1/85. On the bunny's ears the normals of neighbours differ by up to a radian, and light
/// changes by 0.45 per radian.
const BOUND: f64 = 0.45 / 85.0;

/// The number of pixels of the session's picture that differ by more than BOUND from the f64 picture, and the
/// worst difference. Only pixels that are certainly inside one triangle or outside all triangles count.
fn beyond_f64(session: &mut Run<ProgressiveMeshes>, pose: &Pose, seen: &[(DVec3, DVec3)]) -> (usize, f64) {
    let picture = session.linear_picture().unwrap();
    let (view, normals) = truth(session, pose, seen);
    let samples = view.samples();
    let ProgressiveMeshSettings { sun, background, .. } = session.technique.settings;
    let [r, g, b] = background;
    let background = [r, g, b, 1.0];
    let shown = samples.iter().map(|s| s.as_ref().map_or(background, |s| shade(s, &normals, sun))).collect();
    let difference = compare(&picture, &Picture::new(SIZE[0], SIZE[1], shown)).unwrap();
    let sure = |x, y| {
        let candidates = view.candidates(x, y, RADIUS_PX);
        candidates.samples.len() + usize::from(candidates.background) == 1
    };
    let sure: Vec<f64> = difference.pixels().filter(|p| sure(p.x, p.y)).map(|p| p.value).collect();
    let covered = samples.iter().flatten().count();
    assert!(covered > 2000 && sure.len() > 50_000, "{covered} pixels covered, {} sure", sure.len());
    let worst = sure.iter().copied().fold(0.0, f64::max);
    let beyond = sure.iter().filter(|value| **value > BOUND).count();
    println!("worst of {} pixels {worst:.5}, {beyond} beyond {BOUND:.5}; {covered} covered", sure.len());
    (beyond, worst)
}

#[test]
fn a_level_is_drawn_as_f64_draws_it() {
    let gpu = device();
    for (source, pixels) in [("bunny", "1.0"), ("bunny", "6.0"), ("solid", "1.0"), ("torus", "2.0")] {
        let changes = [
            format!("surface.bunny.geometry.source={source}"),
            format!("surface.bunny.geometry.error_pixels={pixels}"),
        ];
        let scene = scene("bunny", &[&changes[0], &changes[1], "surface.bunny.geometry.heading_deg=30.0"]);
        let pose = scene.camera("near").unwrap().pose();
        let mut session = open(&gpu, &scene);
        session.frame(&pose).unwrap();
        let level = session.technique.surfaces[0].instances().next().unwrap().1;
        assert!(
            0 < level && level < session.technique.surfaces[0].program.last_level(),
            "{source}: level {level}"
        );
        let (beyond, worst) = beyond_f64(&mut session, &pose, &seen_vertices(&scene, 1.0, None));
        assert_eq!(beyond, 0, "{source}, {pixels} pixels: worst {worst}");
    }
}

/// A near miss that must be rejected: the f64 picture with vertices moved by a hundredth of the model.
#[test]
fn a_hundredth_of_the_models_size_is_not_the_f64_picture() {
    let gpu = device();
    let scene = scene("bunny", &[]);
    let pose = scene.camera("near").unwrap().pose();
    let mut session = open(&gpu, &scene);
    session.frame(&pose).unwrap();
    let mut seen = seen_vertices(&scene, 1.0, None);
    let size = seen.iter().map(|(position, _)| position.length()).fold(0.0, f64::max);
    seen.iter_mut().for_each(|(position, normal)| *position += *normal * (0.01 * size));
    let (beyond, _) = beyond_f64(&mut session, &pose, &seen);
    assert!(beyond > 100, "{beyond}");
}

#[test]
fn a_morphing_vertex_is_drawn_at_its_f64_position() {
    let gpu = device();
    let scene =
        scene("bunny", &["surface.bunny.geometry.geomorph=true", "surface.bunny.geometry.error_pixels=8"]);
    let pose = scene.camera("near").unwrap().pose();
    let mut session = open(&gpu, &scene);
    session.frame(&pose).unwrap();
    let wanted =
        session.technique.surfaces[0].instances().next().unwrap().0.wanted_error(&pose, SIZE[1], 8.0);
    // Vertices reach their positions at the wanted error, and start to move one band before it.
    let band = f64::from(MORPH_BAND_LOG2);
    let moved = seen_vertices(&scene, wanted * (-band).exp2(), Some(band));
    let (beyond, worst) = beyond_f64(&mut session, &pose, &moved);
    assert_eq!(beyond, 0, "worst {worst}");
    // The vertices are not at their final positions.
    let (beyond, _) = beyond_f64(&mut session, &pose, &seen_vertices(&scene, wanted, None));
    assert!(beyond > 100, "{beyond}");
}

#[test]
fn a_morphing_surface_is_within_the_wanted_error_of_the_full_mesh() {
    let scene = scene("bunny", &["surface.bunny.geometry.geomorph=true"]);
    let mesh = &load(&scene).unwrap()[0].mesh;
    let full = live_faces(mesh, mesh.last_level());
    let own: Vec<DVec3> = seen_vertices(&scene, 1.0, None).iter().map(|(position, _)| *position).collect();
    let band = f64::from(MORPH_BAND_LOG2);
    // The distance between the full mesh and the faces that an error selects, with new vertices between their split
    // vertices and their own positions.
    let distance = |chosen: f64| {
        let moved = seen_vertices(&scene, chosen, Some(band));
        let moved: Vec<DVec3> = moved.iter().map(|(position, _)| *position).collect();
        let faces = live_faces(mesh, level_for_error(&mesh.levels, chosen as f32));
        let [all, drawn] =
            [(&own, &full), (&moved, &faces)].map(|(positions, faces)| Triangles { positions, faces });
        compare_surfaces(all, drawn, 20_000, 1).unwrap().hausdorff
    };
    for part in [2, 5, 20] {
        let level = mesh.levels.partition_point(|level| level.faces < full.len() as u32 / part);
        let wanted = f64::from(mesh.levels[level].error);
        // An error that is an octave ahead, as the surface is drawn, and an error that is an octave too late.
        let [ahead, late] = [-band, 1.0].map(|octaves| distance(wanted * octaves.exp2()));
        assert!(ahead <= wanted, "1/{part}: {ahead}, wanted {wanted}");
        assert!(late > wanted, "1/{part}: {late}, wanted {wanted}");
    }
}

#[test]
fn a_herd_after_a_walk_equals_a_fresh_one() {
    let gpu = device();
    // Half a pixel, because with one pixel the small herd changes its levels by fewer than 1000 splits.
    let own = ["instances=40", "aside_m=8", "error_pixels=0.5", "pixels_per_second=1e6"];
    let changes = own.map(|change| format!("surface.herd.geometry.{change}"));
    let scene = scene("herd", &changes.each_ref().map(String::as_str));
    let path = scene.path("walk").unwrap();
    let mut walked = open(&gpu, &scene);
    for frame in (0..=120).step_by(10).chain((60..120).rev().step_by(20)) {
        walked.frame(&path.pose(frame)).unwrap();
        if frame % 60 == 0 {
            let mut fresh = open(&gpu, &scene);
            fresh.frame(&path.pose(frame)).unwrap();
            assert!(walked.picture_bytes().unwrap() == fresh.picture_bytes().unwrap(), "frame {frame}");
        }
    }
    walked.drain().unwrap();
    let sum = |of: fn(&ortelius::paper::progressive_mesh::FrameChanges) -> u64| -> u64 {
        walked.records.iter().map(|record| of(&record.change)).sum()
    };
    assert!(sum(|c| c.splits) > 1000 && sum(|c| c.collapses) > 1000, "levels went up and down");
    let culled = walked.records.iter().any(|record| record.change.instances_seen < 40);
    assert!(culled, "some were out of sight");
    // Unchanged data are not uploaded: the blocks of the last frame are far fewer than all faces.
    let last = &walked.records.last().unwrap().change;
    assert!(last.upload_bytes < 6 * last.faces, "{last:?}");
    let quiet = path.pose(0);
    for _ in 0..2 {
        walked.frame(&quiet).unwrap();
    }
    walked.drain().unwrap();
    assert_eq!(walked.records.last().unwrap().change.upload_bytes, 0, "a still camera changes nothing");
}

/// The same mesh with 65,536 unused vertices before its own vertices, so that its indices need 32 bits.
fn widened(mesh: &ProgressiveMesh) -> ProgressiveMesh {
    const MORE: usize = 1 << 16;
    let mut wide = mesh.clone();
    let before = |own: u32| own + MORE as u32;
    let vertices = &mut wide.vertices;
    vertices.positions.splice(0..0, vec![[0.0; 3]; MORE]);
    vertices.welded.iter_mut().for_each(|vertex| *vertex = before(*vertex));
    vertices.welded.splice(0..0, 0..MORE as u32);
    assert!(vertices.attributes.normals.is_empty() && vertices.attributes.coordinates.is_empty());
    wide.faces.as_flattened_mut().iter_mut().for_each(|vertex| *vertex = before(*vertex));
    wide.levels.iter_mut().for_each(|level| level.vertices = before(level.vertices));
    let splits = wide.splits.split_vertices.iter_mut().filter(|vertex| **vertex != NOWHERE);
    splits.for_each(|vertex| *vertex = before(*vertex));
    wide
}

#[test]
fn indices_of_16_and_of_32_bits_draw_the_same_picture() {
    let gpu = device();
    for (order, apply) in [
        ("in-place-23", "cpu"),
        ("in-place-23", "mapped"),
        ("tail-23", "gpu"),
        ("compacted", "cpu"),
        ("skip-lists", "cpu"),
    ] {
        let changes = [
            format!("surface.herd.geometry.order={order}"),
            format!("surface.herd.geometry.apply={apply}"),
            "surface.herd.geometry.instances=9".to_owned(),
        ];
        let scene = scene("herd", &changes.each_ref().map(String::as_str));
        let path = scene.path("walk").unwrap();
        let narrow = load(&scene).unwrap();
        let mut wide = narrow.clone();
        wide[0].mesh = widened(&narrow[0].mesh);
        let settings = ProgressiveMeshSettings {
            size: SIZE,
            ..ProgressiveMeshSettings::of_scene(&scene, PixelFormat::Linear32).unwrap()
        };
        let mut sessions =
            [narrow, wide].map(|models| ProgressiveMeshes::run(gpu.clone(), &models, settings).unwrap());
        for frame in [0, 60, 20] {
            let [narrow, wide] = sessions.each_mut().map(|session| {
                session.frame(&path.pose(frame)).unwrap();
                session.picture_bytes().unwrap()
            });
            assert!(narrow == wide, "{order}, {apply}, frame {frame}");
        }
        let bytes = sessions.each_mut().map(|session| {
            session.drain().unwrap();
            let sent = session.records.iter().map(|record| record.change.upload_bytes).sum::<u64>();
            (session.technique.surfaces[0].memory().device_indices, sent)
        });
        assert_eq!(bytes[1], (2 * bytes[0].0, 2 * bytes[0].1), "{order}, {apply}");
    }
}

#[test]
fn levels_that_the_device_applies_are_the_hosts() {
    let gpu = device();
    let herd = |apply: &str| {
        let apply = format!("surface.herd.geometry.apply={apply}");
        let own = ["instances=40", "aside_m=8", "pixels_per_second=1e6"];
        let own = own.map(|change| format!("surface.herd.geometry.{change}"));
        scene("herd", &[&own[0], &own[1], &own[2], &apply])
    };
    let path = herd("cpu").path("walk").unwrap().clone();
    let [mut host, mut device, mut mapped] = ["cpu", "gpu", "mapped"].map(|apply| open(&gpu, &herd(apply)));
    for frame in [0, 40, 80, 120, 100, 20] {
        let [host, others @ ..] = [&mut host, &mut device, &mut mapped].map(|session| {
            session.frame(&path.pose(frame)).unwrap();
            session.picture_bytes().unwrap()
        });
        others.into_iter().for_each(|other| assert!(host == other, "frame {frame}"));
    }
    // Each frame in flight has its own buffer, so every part is written twice.
    assert!(mapped.records.iter().any(|record| record.change.upload_bytes > 0));
    let changes = |session: &Run<ProgressiveMeshes>| {
        session.records.iter().map(|r| r.change.splits).collect::<Vec<_>>()
    };
    assert_eq!(changes(&host), changes(&device));
    assert!(device.records.iter().all(|record| record.change.upload_bytes == 0));
    // Instances got other slices and the buffer grew, but it stays below half of 40 full meshes.
    for session in [&host, &device] {
        let (surface, memory) = (&session.technique.surfaces[0], session.technique.surfaces[0].memory());
        let (first, full) = (40 * 6 * 64, 40 * 6 * surface.program.faces().len() as u64);
        assert!(first < memory.device_indices && 2 * memory.device_indices < full, "{memory:?}");
        assert!(6 * memory.live_faces <= memory.device_indices, "{memory:?}");
    }
}

#[test]
fn the_device_counts_every_index_and_no_more_vertices_than_those() {
    let gpu = device();
    let scene = scene("herd", &["surface.herd.geometry.instances=20"]);
    let settings = ProgressiveMeshSettings {
        size: SIZE,
        ..ProgressiveMeshSettings::of_scene(&scene, PixelFormat::Srgb8).unwrap()
    };
    let mut session = ProgressiveMeshes::run(gpu.clone(), &load(&scene).unwrap(), settings).unwrap();
    gpu.count_work(true);
    session.frame(&scene.camera("start").unwrap().pose()).unwrap();
    session.drain().unwrap();
    let record = &session.records[0];
    let drawn = record.passes.iter().find(|pass| pass.label == "surfaces").unwrap();
    let work = drawn.work.unwrap();
    assert_eq!(work.draws, record.change.instances_seen as u64);
    assert_eq!(work.input_vertices, 3 * record.change.faces);
    assert!(work.vertex_invocations >= record.change.vertices, "{work:?}, {:?}", record.change);
    assert!(work.vertex_invocations <= work.input_vertices, "{work:?}");
    assert!(work.fragment_invocations > 0);
    gpu.count_work(false);
    session.frame(&scene.camera("start").unwrap().pose()).unwrap();
    session.drain().unwrap();
    assert!(session.records[1].passes.iter().all(|pass| pass.work.is_none()));
}

#[test]
fn a_scene_requires_only_the_features_that_it_uses() {
    let opened = |name: &str, changes: &[&str]| {
        let scene = scene(name, changes);
        let renderer = Renderer::open(&scene, &options()).unwrap();
        let names = |list: Vec<(String, u64)>| list.into_iter().map(|(name, _)| name).collect::<Vec<_>>();
        (renderer.technique.needs().len(), renderer.technique.passes(), names(renderer.memory()))
    };
    let (features, passes, memory) = opened("bunny", &[]);
    assert_eq!((features, passes), (0, vec!["levels", "surfaces"]));
    assert_eq!(memory, ["bunny: vertices", "bunny: indices", "levels: staging", "depth", "picture"]);
    let (_, passes, memory) =
        opened("plane", &["surface.land.texture.width_log2=12", "surface.land.texture.height_log2=11"]);
    assert!(!passes.iter().any(|pass| ["levels", "surfaces"].contains(pass)), "{passes:?}");
    assert!(
        !memory.iter().any(|name| name.starts_with("levels") || name.ends_with("vertices")),
        "{memory:?}"
    );
}

//! Baselines on the device: at each level they draw the same faces as our orders, in their own order and by
//! their own method.

use crate::pictures::{device, open, options};
use ortelius::frame::Run;
use ortelius::frame::Technique;
use ortelius::paper::progressive_mesh::choices::{ErrorMetric, FaceOrder};
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use ortelius::paper::progressive_mesh::{ProgressiveMeshSettings, ProgressiveMeshes, load};
use ortelius::picture::PixelFormat;
use ortelius::renderer::Renderer;
use ortelius::scene::Scene;

fn scene(name: &str, changes: &[String]) -> Scene {
    Scene::load_with(name, changes).unwrap()
}

fn bunny(source: &str, order: FaceOrder, more: &[&str]) -> Scene {
    let of = |change: &str| format!("surface.bunny.geometry.{change}");
    let order = format!("order={}", order.name());
    let mut changes = [&format!("source={source}"), &order, "pixels_per_second=1e6"].map(of).to_vec();
    changes.extend(more.iter().map(|change| of(change)));
    scene("bunny", &changes)
}

/// A face by the positions of its corners, because orders number vertices differently.
type ByPosition = [[u32; 3]; 3];

/// The faces with an area, each rotated so that its smallest corner comes first, sorted.
fn as_a_set(faces: &[[u32; 3]], positions: &[[f32; 3]]) -> Vec<ByPosition> {
    let with_area = |face: &ByPosition| face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
    let turned = |face: &[u32; 3]| {
        let mut face = face.map(|vertex| positions[vertex as usize].map(f32::to_bits));
        let min = (0..3).min_by_key(|&corner| face[corner]).unwrap();
        face.rotate_left(min);
        face
    };
    let mut set: Vec<_> = faces.iter().map(turned).filter(with_area).collect();
    set.sort_unstable();
    set
}

fn different_pixels(a: &[u8], b: &[u8]) -> usize {
    assert_eq!(a.len(), b.len());
    a.chunks_exact(16).zip(b.chunks_exact(16)).filter(|(a, b)| a != b).count()
}

/// Pixels that may show another face: if two faces have the same f32 depth, the face drawn first stays. This happens at
/// silhouettes, where a back face meets a front face.
const TIES: usize = 4;

#[test]
fn every_order_draws_the_faces_and_the_picture_of_the_same_level() {
    let gpu = device();
    // The solid has seams: some positions have several wedges.
    for source in ["bunny", "solid"] {
        let opened = |order| {
            let scene = bunny(source, order, &[]);
            let models = load(&scene).unwrap();
            let own = ProgressiveMeshSettings::of_scene(&scene, PixelFormat::Linear32).unwrap();
            let session = ProgressiveMeshes::run(
                gpu.clone(),
                &models,
                ProgressiveMeshSettings { size: [320, 180], ..own },
            )
            .unwrap();
            (session, models[0].mesh.vertices.positions.clone(), scene.camera("near").unwrap().pose())
        };
        let (mut classical, positions, pose) = opened(FaceOrder::Classical);
        // The level rises and falls twice. Pictures of different levels must differ.
        let errors = [8.0, 1.0, 3.0, 0.0, 3.0];
        let expected: Vec<_> = errors.iter().map(|&pixels| shown(&mut classical, &pose, pixels)).collect();
        let set = |shown: &Shown, positions: &[[f32; 3]]| as_a_set(shown.faces.as_ref().unwrap(), positions);
        assert!(different_pixels(&expected[0].picture, &expected[1].picture) > 100 * TIES);
        for &order in FaceOrder::ALL {
            if order == FaceOrder::Discrete {
                continue; // A discrete chain has its own levels.
            }
            let (mut session, own_positions, _) = opened(order);
            for (pixels, expected) in errors.iter().zip(&expected) {
                let found = shown(&mut session, &pose, *pixels);
                let place = format!("{source}, {}, {pixels} pixels", order.name());
                assert_eq!(found.level, expected.level, "{place}");
                if order != FaceOrder::Compacted {
                    assert!(set(&found, &own_positions) == set(expected, &positions), "{place}");
                }
                let different = different_pixels(&found.picture, &expected.picture);
                assert!(different <= TIES, "{place}: {different} pixels");
                let (drawn, live) = (found.drawn, expected.drawn);
                let without_area =
                    matches!(order, FaceOrder::SkipLists | FaceOrder::InPlace23 | FaceOrder::InPlace10);
                let expected = if without_area { live..2 * live } else { live..live + 1 };
                assert!(expected.contains(&drawn), "{place}: {drawn} of {live}");
            }
        }
    }
}

struct Shown {
    level: u32,
    drawn: u64,
    /// The drawn faces as numbers of vertices; `None` if only the device has the faces.
    faces: Option<Vec<[u32; 3]>>,
    picture: Vec<u8>,
}

fn shown(session: &mut Run<ProgressiveMeshes>, pose: &ortelius::math::camera::Pose, pixels: f64) -> Shown {
    session.technique.surfaces[0].set_error_pixels(pixels);
    session.frame(pose).unwrap();
    let picture = session.picture_bytes().unwrap();
    Shown {
        level: session.technique.surfaces[0].instances().next().unwrap().1,
        drawn: session.records.last().unwrap().change.faces,
        faces: session.technique.surfaces[0].faces(0),
        picture,
    }
}

#[test]
fn a_discrete_chain_draws_the_coarsest_mesh_that_has_the_levels_faces_and_copies_nothing() {
    let gpu = device();
    let scene = bunny("bunny", FaceOrder::Discrete, &[]);
    let pose = scene.camera("near").unwrap().pose();
    let mut session = open(&gpu, &scene);
    let mut meshes = Vec::new();
    for pixels in [20.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.0] {
        let found = shown(&mut session, &pose, pixels);
        let live = u64::from(session.technique.surfaces[0].program.levels()[found.level as usize].faces);
        assert!(
            live <= found.drawn && found.drawn < 3 * live,
            "{} of {live} at {pixels} pixels",
            found.drawn
        );
        assert_eq!(session.technique.surfaces[0].faces(0).unwrap().len() as u64, found.drawn);
        assert_eq!(session.records.last().unwrap().change.upload_bytes, 0);
        meshes.push(found.drawn);
    }
    assert!(meshes.is_sorted() && *meshes.last().unwrap() == 3674, "{meshes:?}");
    meshes.dedup();
    assert!(meshes.len() >= 4, "{meshes:?}");
}

#[test]
fn skip_lists_send_the_changed_blocks_or_a_whole_list_when_they_switch() {
    let gpu = device();
    // A level far above the coarsest, whose lists are no longer than a few of the blocks that are sent.
    let scene = bunny("bunny", FaceOrder::SkipLists, &["error_pixels=0.5"]);
    let pose = scene.camera("near").unwrap().pose();
    let (mut walked, mut fresh) = (open(&gpu, &scene), open(&gpu, &scene));
    fresh.frame(&pose).unwrap();
    let shown = fresh.technique.surfaces[0].instances().next().unwrap().1;
    walked.change_level(0, shown - 700).unwrap();
    let mut drawn = walked.technique.surfaces[0].faces(0).unwrap().len();
    let mut lists = 0;
    for level in (shown - 700..shown).rev().chain(shown - 700..shown).skip(1) {
        walked.change_level(0, level).unwrap();
        walked.drain().unwrap();
        let sent = walked.records.last().unwrap().change.upload_bytes;
        let now = walked.technique.surfaces[0].faces(0).unwrap().len();
        let whole = 6 * now as u64;
        match std::mem::replace(&mut drawn, now) == now {
            true => assert!(sent < whole / 2, "level {level}: {sent} of {whole} bytes"),
            false => assert_eq!(sent, whole, "level {level}"),
        }
        lists += u32::from(sent == whole);
    }
    assert!((2..20).contains(&lists), "{lists} lists were copied");
    // After one more split, the picture equals the picture of an instance that went to this level directly.
    walked.frame(&pose).unwrap();
    assert!(walked.picture_bytes().unwrap() == fresh.picture_bytes().unwrap());
}

#[test]
fn a_herd_drawn_by_a_baseline_after_a_walk_equals_a_fresh_one() {
    let gpu = device();
    for order in [FaceOrder::ReOptimised, FaceOrder::SkipLists, FaceOrder::Compacted, FaceOrder::Discrete] {
        let order_of = format!("order={}", order.name());
        let changes = ["instances=30", "aside_m=8", "pixels_per_second=1e6", &order_of];
        let scene = scene("herd", &changes.map(|change| format!("surface.herd.geometry.{change}")));
        let path = scene.path("walk").unwrap();
        let mut walked = open(&gpu, &scene);
        for frame in [0, 30, 60, 90, 120, 60, 20] {
            walked.frame(&path.pose(frame)).unwrap();
            if frame == 120 || frame == 20 {
                let mut fresh = open(&gpu, &scene);
                fresh.frame(&path.pose(frame)).unwrap();
                let same = walked.picture_bytes().unwrap() == fresh.picture_bytes().unwrap();
                assert!(same, "{}, frame {frame}", order.name());
            }
        }
        walked.frame(&path.pose(20)).unwrap();
        walked.drain().unwrap();
        assert_eq!(walked.records.last().unwrap().change.upload_bytes, 0, "{}", order.name());
    }
}

#[test]
fn a_baseline_adds_its_pass_and_its_memory_and_reports_both() {
    let added = |order: FaceOrder| {
        let renderer = Renderer::open(&bunny("bunny", order, &[]), &options()).unwrap();
        let memory = renderer.memory().into_iter().map(|(name, bytes)| (name, bytes > 0));
        let surface = &renderer.technique.meshes.as_ref().unwrap().surfaces[0];
        (renderer.technique.passes(), memory.collect::<Vec<_>>(), surface.of_an_instance())
    };
    let (passes, memory, words) = added(FaceOrder::Compacted);
    assert_eq!(passes, ["levels", "compact", "surfaces"]);
    assert!(memory.contains(&("bunny: faces by rank".into(), true)), "{memory:?}");
    assert!(words.contains("compacted"), "{words}");
    let (passes, _, words) = added(FaceOrder::SkipLists);
    assert_eq!(passes, ["levels", "surfaces"]);
    assert!(words.contains("skip-lists") && words.contains("lists of"), "{words}");
    assert!(!added(FaceOrder::Tail23).2.contains("lists"));
}

#[test]
fn a_scene_states_the_metric_and_a_file_keeps_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pmesh");
    let with = |source: &str, more: &[&str]| load(&bunny(source, FaceOrder::Classical, more));
    let of_model = |more: &[&str]| with("knot:6", more).unwrap().remove(0).mesh;
    let [plain, aware] = [of_model(&[]), of_model(&["metric=appearance"])];
    assert_eq!((plain.metric, aware.metric), (Some(ErrorMetric::Geometry), Some(ErrorMetric::Appearance)));
    assert!(plain.levels != aware.levels);
    aware.write(&path).unwrap();
    let file = path.to_str().unwrap();
    for more in [&[][..], &["metric=appearance"]] {
        assert_eq!(with(file, more).unwrap().remove(0).mesh, aware);
    }
    let error = |more: &[&str]| with(file, more).unwrap_err().to_string();
    let refused = error(&["metric=geometry"]);
    let words = ["surface.bunny.geometry.metric", "built with --metric appearance", "--metric geometry"];
    assert!(words.iter().all(|word| refused.contains(word)), "{refused}");
    ProgressiveMesh { metric: None, ..aware }.write(&path).unwrap();
    assert!(with(file, &[]).is_ok() && error(&["metric=appearance"]).contains("does not record"));
}

#[test]
fn a_baseline_rejects_a_file_with_tswaps() {
    let folder = tempfile::tempdir().unwrap();
    let file = |order| {
        let mesh = load(&bunny("sphere:6", order, &[])).unwrap().remove(0).mesh;
        let path = folder.path().join(format!("{}.pmesh", order.name()));
        mesh.write(&path).unwrap();
        path.display().to_string()
    };
    let of_file = |file: &str| load(&bunny(file, FaceOrder::ReOptimised, &[]));
    assert!(of_file(&file(FaceOrder::Classical)).is_ok());
    let error = of_file(&file(FaceOrder::Tail23)).unwrap_err().to_string();
    assert!(error.contains("surface.bunny.geometry.order") && error.contains("--order classical"), "{error}");
}

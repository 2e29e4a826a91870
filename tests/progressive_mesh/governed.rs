//! Frames under a governor.

use ortelius::picture::PixelFormat;
use ortelius::renderer::{Options, RenderError, Renderer};
use ortelius::scene::Scene;

const FACES: u64 = 3000;

fn open(set: &[&str], deterministic: bool) -> Result<(Scene, Renderer), RenderError> {
    let herd = ["surface.herd.geometry.instances=40", "surface.herd.geometry.error_pixels=0.1"];
    let changes: Vec<String> = herd.iter().chain(set).map(|change| change.to_string()).collect();
    let scene = Scene::load_with("herd", &changes).unwrap();
    let options = Options {
        target: PixelFormat::Srgb8,
        size: Some([160, 90]),
        device: None,
        validate: true,
        deterministic,
        stop: None,
    };
    let renderer = Renderer::open(&scene, &options)?;
    Ok((scene, renderer))
}

/// Faces, factor and picture of each frame of a walk.
fn walk(set: &[&str], deterministic: bool) -> Vec<(u64, f64, Vec<u8>)> {
    let (scene, mut renderer) = open(set, deterministic).unwrap();
    let path = scene.path("walk").unwrap();
    let mut pictures = Vec::new();
    for frame in (0..240).step_by(16) {
        renderer.frame(&path.pose(frame)).unwrap();
        pictures.push(renderer.picture_bytes().unwrap());
    }
    let messages = renderer.gpu.messages();
    assert!(messages.is_empty(), "{messages:#?}");
    let of_frame = |(record, picture): (&ortelius::paper::progressive_mesh::MeshFrameRecord, _)| {
        (record.change.faces, record.error_factor, picture)
    };
    renderer.records.iter().filter_map(|record| record.meshes.as_ref()).zip(pictures).map(of_frame).collect()
}

#[test]
fn a_budget_in_faces_is_kept_in_every_frame_and_two_runs_agree() {
    let budget = format!("governor.frame_faces={FACES}");
    let first = walk(&[&budget], true);
    assert!(
        first.iter().all(|(faces, ..)| *faces <= FACES),
        "{:?}",
        first.iter().map(|f| f.0).collect::<Vec<_>>()
    );
    assert!(first.iter().any(|(faces, factor, _)| *faces > FACES / 2 && *factor > 1.0), "the budget is used");
    assert!(first == walk(&[&budget], true));
    let free = walk(&["governor.frame_faces=4000000000"], true);
    assert!(
        free.iter().all(|(_, factor, _)| *factor == 1.0) && free.iter().any(|(faces, ..)| *faces > FACES)
    );
}

#[test]
fn a_budget_is_kept_while_the_errors_of_instances_follow_slowly() {
    let budget = format!("governor.frame_faces={FACES}");
    let slow = walk(&[&budget, "surface.herd.geometry.pixels_per_second=0.06"], true);
    assert!(slow.iter().all(|(faces, ..)| *faces <= FACES));
    assert!(slow.iter().any(|(faces, factor, _)| *faces > FACES / 2 && *factor > 1.0), "the budget is used");
    assert!(slow != walk(&[&budget], true));
}

#[test]
fn a_budget_in_milliseconds_alone_is_rejected_in_deterministic_runs() {
    let refused = open(&["governor.frame_ms=5"], true).err().unwrap().to_string();
    assert!(refused.contains("--deterministic") && refused.contains("governor.frame_faces"), "{refused}");
    assert!(open(&["governor.frame_ms=5"], false).is_ok());
}

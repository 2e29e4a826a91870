//! A window without a display: which changes happen at once, which on a thread, and which not at all.

use super::super::variants::own_variants;
use super::*;
use ortelius::frame::Records;
use ortelius::vk::{Feature, GpuOptions, Watched};

/// The variants that show the same picture.
fn methods(scene: &Scene) -> Vec<Variant> {
    let is_method = |variant: &Variant| !variant.changes.iter().any(|change| change.contains(".filter"));
    own_variants(scene).into_iter().filter(is_method).collect()
}

/// Waits for the thread that prepares a change.
fn opened(stage: &mut Stage) -> anyhow::Result<Option<Kept>> {
    loop {
        match stage.take_opened() {
            Some(opened) => return opened.kept,
            None => std::thread::yield_now(),
        }
    }
}

const BORDER: &str = "surface.land.texture.border";

#[test]
fn the_old_picture_stays_until_the_new_scene_is_open_and_later_requests_wait_or_cancel_it() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    let base = Scene::embedded("globe").unwrap();
    let (pose, variants) = (base.pose(0).unwrap(), methods(&base));
    let mut stage = Stage::new(&gpu, base, variants, [32, 18], true, &JobProgress::default()).unwrap();
    let has = |stage: &Stage, table: [&str; 2], key: &str, value: i64| {
        let at = match table {
            ["variant", _] => stage.scene.value(&["variant", key]),
            _ => stage.scene.value(&["surface", "land", "texture", key]),
        };
        at.and_then(|at| at.as_integer()) == Some(value)
    };
    let (texture, variant) = (["texture", ""], ["variant", ""]);
    let gated = |stage: &mut Stage| {
        let (go, gate) = std::sync::mpsc::channel();
        stage.gate = Some(gate);
        go
    };
    // Frames continue, and a request that needs the new scene waits.
    let go = gated(&mut stage);
    let before = stage.scene.clone();
    assert_eq!(stage.set(BORDER, "8").unwrap(), None);
    stage.renderer.settle(&pose).unwrap();
    stage.resize([48, 27]).unwrap();
    assert_eq!(stage.set("variant.level_bias", "1").unwrap(), None);
    assert!(stage.take_opened().is_none() && stage.is_opening() && stage.scene == before);
    go.send(()).unwrap();
    assert_eq!(opened(&mut stage).unwrap(), Some(Kept::Nothing));
    assert!(has(&stage, texture, "border", 8) && has(&stage, variant, "level_bias", 1));
    assert!(!stage.is_opening() && stage.renderer.size() == [48, 27]);
    stage.renderer.settle(&pose).unwrap();
    let picture = stage.renderer.picture_bytes().unwrap();

    // A request that is taken back shows nothing.
    let go = gated(&mut stage);
    assert_eq!(stage.set(BORDER, "4").unwrap(), None);
    assert_eq!(stage.set(BORDER, "8").unwrap(), Some(Kept::Everything));
    go.send(()).unwrap();
    assert_eq!(opened(&mut stage).unwrap(), None);
    let go = gated(&mut stage);
    assert_eq!(stage.toggle_second().unwrap(), None);
    assert_eq!(stage.toggle_second().unwrap(), Some(Kept::Everything));
    drop(go);
    assert_eq!(opened(&mut stage).unwrap(), None);
    assert!(stage.second.is_none() && has(&stage, texture, "border", 8));

    // A scene that cannot be opened leaves the picture unchanged. The next change does not request that scene again.
    let nowhere = "{kind='virtual', source='file', path='/nowhere.tiles'}";
    assert_eq!(stage.set("surface.land.texture", nowhere).unwrap(), None);
    let words = format!("{:#}", opened(&mut stage).unwrap_err());
    assert!(words.contains("/nowhere.tiles"), "{words}");
    assert_eq!(stage.set("variant.level_bias", "1").unwrap(), Some(Kept::Everything));
    stage.renderer.settle(&pose).unwrap();
    assert!(picture == stage.renderer.picture_bytes().unwrap());
}

#[test]
fn a_change_in_place_is_made_while_shaders_are_reloaded_and_stays_afterwards() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    let base = Scene::embedded("globe").unwrap();
    let variants = methods(&base);
    let mut stage = Stage::new(&gpu, base, variants, [32, 18], true, &JobProgress::default()).unwrap();
    let (go, gate) = std::sync::mpsc::channel();
    stage.gate = Some(gate);
    stage.reopen().unwrap();
    assert_eq!(stage.show(1).unwrap(), Some(Kept::Everything));
    let shown = stage.scene.clone();
    go.send(()).unwrap();
    assert_eq!(opened(&mut stage).unwrap(), Some(Kept::Nothing));
    assert_eq!((&stage.scene, stage.variant(), stage.is_opening()), (&shown, 1, false));
}

#[test]
fn a_setting_holds_for_every_variant_and_a_wrong_one_changes_nothing() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    let base = Scene::embedded("globe").unwrap();
    let variants = methods(&base);
    let mut stage = Stage::new(&gpu, base, variants, [32, 18], true, &JobProgress::default()).unwrap();
    let bias = |stage: &Stage| {
        let texture = stage.renderer.technique.texture.as_ref().unwrap();
        texture.settings.streaming.level_bias
    };
    assert_eq!(stage.toggle_second().unwrap(), None);
    assert_eq!(opened(&mut stage).unwrap(), Some(Kept::Everything), "the left side stays");
    assert_eq!(stage.set("variant.level_bias", "2").unwrap(), Some(Kept::Everything));
    assert_eq!((bias(&stage), stage.variant()), (2, 0));
    stage.show(1).unwrap();
    assert_eq!((bias(&stage), stage.variant()), (2, 1));
    let before = stage.scene.clone();
    for (key, value) in [("variant.level_bias", "-1"), ("variant.dedup", "none"), ("cache.tiles", "3")] {
        let refused = stage.set(key, value).unwrap_err().to_string();
        assert!(!refused.is_empty());
        assert_eq!((&stage.scene, stage.variant()), (&before, 1), "{key} = {value}");
    }
    stage.set("variant.level_bias", "0").unwrap();
    assert_eq!(bias(&stage), 0);
    let pose = stage.scene.pose(0).unwrap();
    stage.resize([20, 30]).unwrap();
    stage.renderer.settle(&pose).unwrap();
    let second = &mut stage.second.as_mut().unwrap().renderer;
    second.settle(&pose).unwrap();
    let (first, second) = (stage.renderer.picture_bytes().unwrap(), second.picture_bytes().unwrap());
    assert!(first == second, "both variants must render the same picture");
}

#[test]
fn another_variant_finds_the_caches_full() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    // Not `globe`: at this size, its resident mip tail would hold everything, and no tile would be loaded.
    let base = Scene::embedded("earth").unwrap();
    let pose = base.pose(0).unwrap();
    let variants = methods(&base);
    let mut stage = Stage::new(&gpu, base, variants, [64, 36], true, &JobProgress::default()).unwrap();
    let loads = |stage: &mut Stage| -> usize {
        stage.renderer.keep(Records::all());
        stage.renderer.settle(&pose).unwrap();
        stage.renderer.drain().unwrap();
        let records = stage.renderer.records.iter().filter_map(|record| record.texture.as_ref());
        records.map(|record| record.streaming.loads).sum()
    };
    assert!(loads(&mut stage) > 0);
    let first = stage.renderer.picture_bytes().unwrap();
    stage.show(1).unwrap();
    assert_eq!(loads(&mut stage), 0, "variant {}", stage.variants()[1].name);
    assert!(first == stage.renderer.picture_bytes().unwrap());
    stage.set("surface.land.filter.max_anisotropy", "4").unwrap();
    let fresh = open(&gpu, &stage.scene, [64, 36], true, &JobProgress::default()).unwrap();
    let old = std::mem::replace(&mut stage.renderer, fresh);
    assert!(loads(&mut stage) > 0, "a new renderer has empty caches");
    let opened = stage.renderer.picture_bytes().unwrap();
    stage.renderer = old;
    stage.renderer.settle(&pose).unwrap();
    assert!(
        opened == stage.renderer.picture_bytes().unwrap(),
        "a reconfigured renderer must equal a new one"
    );
}

#[test]
fn settings_change_in_place_and_show_the_picture_of_a_scene_that_was_just_opened() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    let base = Scene::embedded("earth").unwrap();
    let mesh = "surface.bunny={geometry={kind='progressive-mesh', source='sphere', size_m=9e4, latitude_deg=46.5, \
                longitude_deg=9.5}}";
    let base = base.with(&[mesh.to_owned()]).unwrap();
    let pose = base.pose(0).unwrap();
    let variants = methods(&base);
    let mut stage = Stage::new(&gpu, base, variants, [64, 36], false, &JobProgress::default()).unwrap();
    let loads = |renderer: &mut Renderer| -> usize {
        renderer.keep(Records::all());
        renderer.settle(&pose).unwrap();
        renderer.drain().unwrap();
        let records = renderer.records.iter().filter_map(|record| record.texture.as_ref());
        records.map(|record| record.streaming.loads).sum()
    };
    assert!(loads(&mut stage.renderer) > 0);
    stage.show_beside(1).unwrap();
    opened(&mut stage).unwrap();
    assert!(loads(&mut stage.second.as_mut().unwrap().renderer) > 0, "the right side has its own caches");
    let changes = [
        ("variant.level_bias", "1", Kept::Everything),
        ("variant.level_bias", "0", Kept::Everything),
        ("cache.gpu_tiles", "100", Kept::Everything),
        ("cache.host_tiles", "500", Kept::Everything),
        ("cache.host_tiles", "250", Kept::Everything),
        ("cache.prefetch_frames", "4", Kept::Everything),
        ("cache.upload_tiles_per_frame", "3", Kept::Everything),
        ("variant.dedup", "test-or", Kept::Everything),
        ("surface.land.filter.max_anisotropy", "4", Kept::Everything),
        ("surface.bunny.geometry.error_pixels", "6.0", Kept::Everything),
        ("surface.bunny.geometry.size_m", "6e4", Kept::Tiles),
        ("surface.land.lit", "true", Kept::Tiles),
        ("surface.land.texture.border", "8", Kept::Nothing),
        ("governor.frame_faces", "100", Kept::Everything),
    ];
    for (key, value, kept) in changes {
        let at_once = stage.set(key, value).unwrap();
        let made = at_once.or_else(|| opened(&mut stage).unwrap());
        assert_eq!(made, Some(kept), "{key} = {value}");
        assert_eq!(at_once.is_some(), kept == Kept::Everything, "{key} = {value}");
        let mut fresh = open(&gpu, &stage.scene, [64, 36], false, &JobProgress::default()).unwrap();
        fresh.settle(&pose).unwrap();
        let expected = fresh.picture_bytes().unwrap();
        let second = &mut stage.second.as_mut().unwrap().renderer;
        for (side, renderer) in [("left", &mut stage.renderer), ("right", second)] {
            let loaded = loads(renderer);
            match key {
                // These settings make tiles visible that were not visible before.
                "variant.level_bias" | "surface.land.filter.max_anisotropy" => {}
                _ => assert_eq!(loaded > 0, kept == Kept::Nothing, "{side}: {key} = {value}: {loaded} loads"),
            }
            // The governor's picture depends on its frames.
            let same = renderer.picture_bytes().unwrap() == expected;
            assert!(same || stage.scene.has(&["governor"]), "{side}: {key} = {value}");
        }
    }
}

#[test]
fn a_resting_window_draws_frames_until_its_meshes_have_arrived_and_counts_seconds_not_frames() {
    let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
    for (geomorph, deterministic) in [(false, false), (true, false), (true, true)] {
        let base =
            Scene::load_with("bunny", &[format!("surface.bunny.geometry.geomorph={geomorph}")]).unwrap();
        let [far, near] = ["far", "near"].map(|camera| base.camera(camera).unwrap().pose());
        let variants = own_variants(&base);
        let progress = JobProgress::default();
        let mut stage = Stage::new(&gpu, base, variants, [64, 36], deterministic, &progress).unwrap();
        let mut frames = |seconds| {
            stage.set_frame_seconds(seconds);
            stage.renderer.settle(&far).unwrap();
            stage.renderer.settle(&near).unwrap()
        };
        // After the jump, an error of one pixel remains, which falls by 2.58 pixels per second. A deterministic window
        // has frames of 1/60 second.
        let expected = if deterministic { [24; 3] } else { [4, 12, 47] };
        assert_eq!([0.1, 1.0 / 30.0, 1.0 / 120.0].map(&mut frames), expected, "{geomorph}");
    }
}

/// Only changes that the camera causes are slowed down.
#[test]
fn a_wanted_error_that_is_set_by_hand_is_drawn_at_once() {
    let gpu = Watched::open(&GpuOptions::default());
    let scene = Scene::embedded("bunny").unwrap();
    let near = scene.camera("near").unwrap().pose();
    let progress = JobProgress::default();
    let mut stage = Stage::new(&gpu, scene, Vec::new(), [64, 36], true, &progress).unwrap();
    stage.renderer.settle(&near).unwrap();
    let faces = |stage: &Stage| {
        let mesh = &stage.renderer.technique.meshes.as_ref().unwrap().surfaces[0];
        mesh.faces(0).unwrap().len()
    };
    let at_a_pixel = faces(&stage);
    stage.set("surface.bunny.geometry.error_pixels", "16.0").unwrap();
    stage.renderer.frame(&near).unwrap();
    let at_16_pixels = faces(&stage);
    assert!(at_16_pixels < at_a_pixel, "{at_16_pixels} of {at_a_pixel} faces");
    stage.renderer.settle(&near).unwrap();
    assert_eq!(faces(&stage), at_16_pixels);
}

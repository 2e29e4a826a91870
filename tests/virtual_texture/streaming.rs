//! Streaming on the device: caches that are too small, unreadable tiles, deterministic runs, fade-in.

use crate::TextureSession;
use crate::{device, open, open_with, pose, scene};
use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::virtual_texture::config::open_texture;
use ortelius::picture::PixelFormat;
use ortelius::texture::source::{TileError, TileFormat, TileSource};
use std::sync::Arc;

#[test]
fn caches_that_are_too_small_degrade_report_it_and_recover() {
    let gpu = device();
    let scene = scene("ruler");
    let mut renderer = open(&gpu, &scene, [320, 180], |settings| settings.streaming.gpu_tiles = 6);
    let (wide, narrow) = (pose(&scene, "corner-oblique"), pose(&scene, "antimeridian"));
    renderer.settle(&wide).unwrap();
    assert!(renderer.technique.bias() > 0);
    let verdicts = renderer.ruler_verdicts().unwrap();
    assert_eq!((verdicts.wrong, verdicts.not_resident), (0, 0), "a coarser picture, but a complete one");
    assert!(renderer.records.last().unwrap().streaming.oversubscribed);
    renderer.settle(&narrow).unwrap();
    assert_eq!(renderer.technique.bias(), 0, "the narrow view fits again");
    assert!(renderer.records.last().unwrap().visible.len() <= 6);
    // The picture stays right while the views alternate.
    for _ in 0..3 {
        renderer.settle(&wide).unwrap();
        renderer.settle(&narrow).unwrap();
    }
    let verdicts = renderer.ruler_verdicts().unwrap();
    assert_eq!((verdicts.wrong, verdicts.not_resident), (0, 0));
}

/// A texture with unreadable tiles.
pub struct Broken<F> {
    pub whole: Arc<dyn TileSource>,
    pub is_broken: F,
}

impl<F: Fn(TileId) -> bool + Send + Sync> TileSource for Broken<F> {
    fn describe(&self) -> String {
        format!("{}, broken", self.whole.describe())
    }
    fn pyramid(&self) -> Pyramid {
        self.whole.pyramid()
    }
    fn format(&self) -> TileFormat {
        self.whole.format()
    }
    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        match (self.is_broken)(tile) {
            true => Err(TileError::Refused { tile, reason: "broken on purpose".into() }),
            false => self.whole.read_tile(tile, bytes),
        }
    }
    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        self.whole.read_resident_level(level)
    }
}

#[test]
fn an_unreadable_tile_is_reported_once_and_shown_from_the_next_coarser() {
    let gpu = device();
    let scene = scene("ruler");
    let pose = pose(&scene, "corner");
    let mut renderer = open(&gpu, &scene, [320, 180], |_| ());
    renderer.settle(&pose).unwrap();
    renderer.drain().unwrap();
    let tile = renderer.records.last().unwrap().visible[0];
    drop(renderer);
    let is_broken = move |asked| asked == tile;
    let broken = Arc::new(Broken { whole: open_texture(&scene).unwrap(), is_broken });
    let mut renderer = open_with(&gpu, &scene, [320, 180], broken, |_| ());
    renderer.settle(&pose).unwrap();
    for _ in 0..4 {
        renderer.frame(&pose).unwrap();
    }
    let verdicts = renderer.ruler_verdicts().unwrap();
    assert_eq!(verdicts.wrong, 0, "the substitute is the right texel of a coarser tile");
    assert!(verdicts.not_resident > 0 && verdicts.not_resident < verdicts.covered);
    assert_eq!(verdicts.from_g1, 0, "the next coarser tile, not a resident level");
    let failures: Vec<_> = renderer.records.iter().flat_map(|record| &record.streaming.failures).collect();
    assert_eq!(failures.len(), 1);
    assert_eq!(failures[0].tile, tile);
    let unreadable = renderer.records.iter().map(|record| record.streaming.failures.len());
    assert_eq!(unreadable.sum::<usize>(), 1);
}

#[test]
fn a_deterministic_run_shows_the_same_frames_twice() {
    let gpu = device();
    let scene = scene("earth");
    let path = scene.path("teleport").unwrap();
    let run = || {
        let mut renderer = open(&gpu, &scene, [160, 90], |settings| settings.streaming.gpu_tiles = 12);
        let mut pictures = Vec::new();
        for frame in (0..path.frames).step_by(6) {
            renderer.frame(&path.pose(frame)).unwrap();
            if frame % 24 == 0 {
                pictures.push(renderer.picture_bytes().unwrap());
            }
        }
        renderer.drain().unwrap();
        let frames: Vec<_> = renderer
            .records
            .iter()
            .map(|r| (r.visible.clone(), r.streaming.uploads, r.streaming.gpu_evictions, r.streaming.pending))
            .collect();
        (frames, pictures)
    };
    let (first, second) = (run(), run());
    assert_eq!(first.0, second.0);
    assert!(first.1 == second.1, "pictures differ");
    assert!(first.0.iter().any(|(_, _, evictions, _)| *evictions > 0), "the caches evicted tiles");
}

/// Every channel of a linear-light picture.
fn floats(renderer: &mut TextureSession) -> Vec<f32> {
    renderer
        .picture_bytes()
        .unwrap()
        .chunks_exact(4)
        .map(|b| f32::from_ne_bytes(b.try_into().unwrap()))
        .collect()
}

#[test]
fn tiles_fade_in_over_the_previous_picture_in_equal_steps() {
    let gpu = device();
    let scene = scene("ruler");
    // All tiles have the same level. Otherwise a tile could substitute for another, and their weights would multiply.
    let pose = pose(&scene, "corner");
    let pictures = |fade_in_frames| {
        // All tiles arrive in one frame.
        let mut renderer = open(&gpu, &scene, [160, 90], |settings| {
            settings.target = PixelFormat::Linear32;
            settings.config.fade_in_frames = fade_in_frames;
            settings.streaming.upload_tiles_per_frame = 64;
            settings.streaming.load_tiles_per_frame = 64;
        });
        let mut pictures = Vec::new();
        while !renderer.settled() {
            renderer.frame(&pose).unwrap();
            pictures.push(floats(&mut renderer));
        }
        let uploads: Vec<usize> = renderer.records.iter().map(|r| r.streaming.uploads).collect();
        (pictures, uploads.iter().position(|&count| count > 0).unwrap())
    };
    let (at_once, arrival) = pictures(0);
    let (before, after) = (&at_once[arrival - 1], &at_once[arrival]);
    assert!(before != after);
    let (faded, same) = pictures(3);
    assert_eq!((same, faded.len()), (arrival, at_once.len() + 3), "not settled before the fade is over");
    assert!(faded.last() == at_once.last(), "a tile that has faded in equals one shown at once");
    for (picture, left) in faded[arrival..].iter().zip([192.0f32, 128.0, 64.0, 0.0]) {
        let mixed = before.iter().zip(after).map(|(b, a)| b * (left / 255.0) + a * (1.0 - left / 255.0));
        // The bound allows a few roundings of values up to 1.
        let worst = picture.iter().zip(mixed).map(|(p, m)| (p - m).abs()).fold(0.0, f32::max);
        assert!(worst <= 4.0 * f32::EPSILON, "{left}: {worst:e}");
    }
}

//! Tiles that cannot be read, and sources that misbehave.

use crate::source::{Bench, TestSource, block, counting, pyramid, tile, timed};
use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::virtual_texture::streaming::{Streaming, StreamingConfig, StreamingError, TileFailure};
use ortelius::texture::source::{TileError, TileFormat, TileSource};
use std::sync::Arc;

#[test]
fn a_broken_tile_is_reported_once_and_its_coarser_tile_shown() {
    let mut bench = Bench::new(TestSource::default(), counting(8, 8, 8, 8));
    let (broken, parent) = (tile(0, 2, 4), tile(1, 1, 2));
    bench.source.set_broken([broken]);
    let visible = [tile(0, 2, 3), broken];
    let reports = bench.settle(&visible, 4);
    let failures: Vec<&TileFailure> = reports.iter().flat_map(|report| &report.failures).collect();
    assert_eq!(failures.len(), 1);
    assert_eq!(failures[0].tile, broken);
    assert!(failures[0].reason.contains("broken on purpose"), "{}", failures[0].reason);
    assert!(bench.memory.display.contains_key(&parent));
    for _ in 0..5 {
        let report = bench.frame(&visible);
        assert_eq!((report.failures.len(), report.failed_tiles), (0, 1));
        assert!(bench.streaming.settled());
    }
    assert_eq!(bench.source.reads().iter().filter(|&&tile| tile == broken).count(), 1);
}

#[test]
fn with_every_level_broken_nothing_is_pending() {
    let mut bench = Bench::new(TestSource::default(), counting(8, 8, 8, 8));
    let finest = tile(0, 5, 9);
    bench.source.set_broken((0..5).map(|levels| finest.ancestor(levels)));
    let reports = bench.settle(&[finest], 7);
    assert_eq!(reports.last().unwrap().failed_tiles, 5);
    assert_eq!(reports.last().unwrap().wanted, 0);
    assert!(bench.memory.display.is_empty());
}

#[test]
fn a_failed_tile_is_not_requested_again_if_retries_are_off() {
    let mut bench = Bench::new(TestSource::default(), timed(8, 8));
    let broken = tile(0, 0, 0);
    bench.source.set_broken([broken]);
    bench.settle_timed(&[broken]);
    assert_eq!(bench.memory.display.keys().copied().collect::<Vec<_>>(), [tile(1, 0, 0)]);
    bench.source.set_broken([]);
    bench.frame(&[broken]);
    assert!(bench.streaming.settled());
}

#[test]
fn a_tile_that_was_read_and_fails_again_is_reported_again() {
    let config = StreamingConfig { retry_after_ms: 5.0, ..timed(8, 8) };
    let mut bench = Bench::new(TestSource::default(), config);
    let broken = tile(0, 0, 0);
    for _ in 0..2 {
        bench.source.set_broken([broken]);
        let reports = bench.until(&[broken], |_, report| report.failed_tiles == 1);
        assert_eq!(reports.iter().map(|report| report.failures.len()).sum::<usize>(), 1);
        bench.source.set_broken([]);
        bench.until(&[broken], |bench, _| bench.memory.display.contains_key(&broken));
        bench.streaming.reset();
    }
}

#[test]
fn a_recovered_disk_is_detected_automatically() {
    let config = StreamingConfig { retry_after_ms: 5.0, ..timed(8, 8) };
    let mut bench = Bench::new(TestSource::default(), config);
    let visible = block(2, 2);
    // No tile is readable, at any level.
    let chain = |tile: &TileId| {
        let tile = *tile;
        (0..5).map(move |levels| tile.ancestor(levels))
    };
    bench.source.set_broken(visible.iter().flat_map(chain));
    // The tiles and their four ancestors once, and then again.
    let reports = bench.until(&visible, |bench, _| bench.source.reads().len() > 2 * (4 + 4));
    let failed = reports.into_iter().flat_map(|report| report.failures);
    let reported: Vec<TileId> = failed.map(|failure| failure.tile).collect();
    let distinct: std::collections::BTreeSet<_> = reported.iter().collect();
    assert_eq!(distinct.len(), reported.len(), "each is reported once, however often it fails");
    bench.source.set_broken([]);
    bench.until(&visible, |bench, _| visible.iter().all(|tile| bench.memory.display.contains_key(tile)));
    // Ancestors that were not requested again keep their mark; the four visible tiles have lost theirs.
    let last = bench.frame(&visible);
    assert!(last.failures.is_empty() && last.failed_tiles <= 4, "{last:?}");
}

#[test]
fn a_broken_tile_returns_its_slot() {
    // The host cache has one slot, so every later load needs the slot of the failed ones.
    let mut bench = Bench::new(TestSource::default(), counting(16, 1, 1, 1));
    bench.source.set_broken(block(2, 2));
    bench.settle(&block(4, 4), 60);
    assert_eq!(bench.memory.display.len(), 16 - 4 + 1);
}

/// A source that violates its contract.
struct Panicking;

impl TileSource for Panicking {
    fn describe(&self) -> String {
        "panicking".to_owned()
    }
    fn pyramid(&self) -> Pyramid {
        pyramid()
    }
    fn format(&self) -> TileFormat {
        TileFormat::Rgba8
    }
    fn read_tile(&self, tile: TileId, _: &mut [u8]) -> Result<(), TileError> {
        panic!("a bug at {tile:?}");
    }
    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        unreachable!("level {level}")
    }
}

#[test]
#[should_panic(expected = "a bug at TileId { level: 0, row: 0, column: 0 }")]
fn a_panic_of_the_source_reaches_the_frame_and_does_not_hang() {
    let mut streaming = Streaming::new(Arc::new(Panicking), counting(1, 1, 1, 1)).unwrap();
    for _ in 0..2 {
        streaming.frame(&[tile(0, 0, 0)], &mut crate::source::VideoMemory::default());
    }
}

fn error(config: StreamingConfig) -> StreamingError {
    Streaming::new(Arc::new(TestSource::default()), config).err().expect("these settings must be rejected")
}

#[test]
fn settings_that_could_show_nothing_are_rejected_by_name() {
    for (config, text) in [
        (counting(0, 1, 1, 1), "gpu_tiles = 0: must be 1 ..= "),
        (counting(1, 0, 1, 1), "host_tiles = 0"),
        (counting(1, 1, 0, 1), "upload_tiles_per_frame = 0"),
        (counting(1, 1, 1, 0), "load_tiles_per_frame = 0"),
        (counting(u32::MAX, 1, 1, 1), "gpu_tiles = 4294967295"),
        (StreamingConfig { upload_budget_ms: 0.0, ..timed(1, 1) }, "upload_budget_ms = 0"),
        (StreamingConfig { load_budget_ms: 0.0, ..timed(1, 1) }, "load_budget_ms = 0"),
    ] {
        let message = error(config).to_string();
        assert!(message.contains(text), "{message}");
    }
}

#[test]
fn count_budgets_are_ignored_in_timed_mode_and_time_budgets_in_counting_mode() {
    let source = || Arc::new(TestSource::default());
    let timed = StreamingConfig { load_tiles_per_frame: 0, ..timed(1, 1) };
    Streaming::new(source(), timed.clone()).unwrap();
    // Uploads need staging memory in every mode.
    let unstaged = StreamingConfig { upload_tiles_per_frame: 0, ..timed };
    let error = Streaming::new(source(), unstaged).err().expect("no staging memory for a single tile");
    assert!(matches!(error, StreamingError::OutOfRange { setting: "upload_tiles_per_frame", .. }), "{error}");
    let counting = StreamingConfig { upload_budget_ms: 0.0, load_budget_ms: 0.0, ..counting(1, 1, 1, 1) };
    Streaming::new(source(), counting).unwrap();
}

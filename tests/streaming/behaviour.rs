//! Individual rules of caches, queues, budgets and threads.

use crate::source::{Bench, TestSource, block, counting, tile, timed};
use ortelius::math::pyramid::TileId;
use ortelius::paper::virtual_texture::streaming::{QUEUED, StreamingConfig};
use std::sync::Arc;
use std::time::Duration;

const A: TileId = TileId { level: 0, row: 0, column: 0 };
const B: TileId = TileId { level: 0, row: 9, column: 20 };

#[test]
fn a_tile_is_requested_loaded_and_uploaded_in_the_papers_order() {
    let mut bench = Bench::new(TestSource::default(), counting(4, 4, 4, 4));
    assert_eq!(bench.streaming.state(A), (-2, -2));
    let first = bench.frame(&[A, A]);
    assert_eq!((first.triples, first.tiles, first.hits, first.misses), (2, 1, 0, 1));
    assert_eq!(bench.streaming.state(A), (-2, -1));
    assert!(!bench.streaming.settled());
    let second = bench.frame(&[A]);
    assert_eq!((second.loads, second.uploads, second.pending), (1, 1, 0));
    assert_eq!(second.upload_bytes, 20 * 20 * 4 + 10 * 10 * 4);
    assert_eq!(second.display, [(A, Some(0))]);
    assert_eq!(bench.streaming.state(A), (0, 0));
    let third = bench.frame(&[A]);
    assert_eq!((third.hits, third.misses, third.uploads), (1, 0, 0));
    assert_eq!(third.display, []);
}

#[test]
fn a_tile_that_left_video_memory_comes_back_without_a_second_read() {
    let mut bench = Bench::new(TestSource::default(), counting(1, 2, 1, 1));
    bench.settle(&[A], 2);
    let replaced = bench.settle(&[B], 2).pop().unwrap();
    assert_eq!(replaced.gpu_evictions, 1);
    assert_eq!(replaced.display, [(A, None), (B, Some(0))]);
    assert_eq!(bench.streaming.state(A), (-2, 0));
    assert_eq!(bench.settle(&[A], 1).pop().unwrap().uploads, 1);
    assert_eq!(bench.source.reads(), [A, B]);
}

#[test]
fn uploads_left_in_the_queue_wait_for_the_next_frame() {
    let mut bench = Bench::new(TestSource::default(), counting(8, 8, 8, 8));
    bench.memory.room = Some(2);
    bench.frame(&block(2, 2));
    let report = bench.frame(&block(2, 2));
    assert_eq!((report.uploads, report.queued_uploads, report.pending), (2, 2, 2));
    assert_eq!(bench.streaming.state(tile(0, 1, 1)).0, QUEUED);
    bench.memory.room = None;
    let report = bench.frame(&block(2, 2));
    assert_eq!((report.uploads, report.pending), (2, 0));
}

#[test]
fn an_uploader_without_room_evicts_nothing() {
    let mut bench = Bench::new(TestSource::default(), counting(1, 2, 1, 1));
    bench.settle(&[A], 2);
    bench.memory.room = Some(0);
    for _ in 0..3 {
        assert_eq!(bench.frame(&[B]).gpu_evictions, 0);
    }
    assert!(bench.memory.display.contains_key(&A));
}

#[test]
fn an_upload_longer_than_the_budget_is_the_only_one_of_its_frame() {
    let config = StreamingConfig { upload_budget_ms: 1.0, ..timed(8, 8) };
    let mut bench = Bench::new(TestSource::default(), config);
    bench.memory.delay = Duration::from_millis(2);
    let reports = bench.settle_timed(&block(2, 2));
    assert!(reports.iter().all(|report| report.uploads <= 1));
    assert_eq!(reports.iter().map(|report| report.uploads).sum::<usize>(), 4);
}

#[test]
fn the_shortest_budget_still_uploads_one_tile() {
    let config = StreamingConfig { upload_budget_ms: 1e-6, ..timed(8, 8) };
    let mut bench = Bench::new(TestSource::default(), config);
    // Even the fastest upload takes longer than a nanosecond.
    let reports = bench.settle_timed(&block(2, 2));
    assert!(reports.iter().all(|report| report.uploads <= 1));
}

#[test]
fn loads_beyond_the_budget_wait_for_later_grants() {
    // The budget of all frames is 0.1 microseconds of CPU time, less than one load takes, so each thread (8 at most)
    // loads one tile and stops. The delay is no CPU time.
    let config = StreamingConfig { load_budget_ms: 5e-6, ..timed(32, 32) };
    let mut bench = Bench::new(TestSource::with_delay(|_| Duration::from_millis(5)), config);
    bench.until(&block(4, 4), |bench, _| !bench.source.reads().is_empty());
    // Time in which a thread that does not stop would load more.
    for _ in 0..20 {
        bench.frame(&block(4, 4));
        std::thread::sleep(Duration::from_millis(5));
    }
    let reads = bench.source.reads().len();
    assert!((1..=8).contains(&reads), "{reads} tiles read");
}

#[test]
fn lifted_budgets_limit_nothing_until_they_are_restored() {
    // As above. Within these budgets, 16 tiles take thousands of frames.
    let config = StreamingConfig { load_budget_ms: 5e-6, upload_budget_ms: 1e-6, ..timed(32, 32) };
    let mut bench = Bench::new(TestSource::with_delay(|_| Duration::from_millis(5)), config);
    bench.streaming.lift_budgets(true);
    bench.settle_timed(&block(4, 4));
    assert_eq!(bench.source.reads().len(), 16);
    bench.streaming.lift_budgets(false);
    let others: Vec<TileId> =
        block(4, 4).iter().map(|tile| TileId { column: tile.column + 4, ..*tile }).collect();
    for _ in 0..20 {
        bench.frame(&others);
        std::thread::sleep(Duration::from_millis(5));
    }
    let reads = bench.source.reads().len() - 16;
    assert!(reads <= 8, "{reads} tiles read");
}

#[test]
fn requests_no_longer_visible_are_not_read() {
    let mut bench = Bench::new(TestSource::default(), counting(32, 32, 1, 1));
    bench.frame(&block(4, 4));
    bench.settle(&[B], 3);
    assert_eq!(bench.source.reads(), [A, B]);
    assert_eq!(bench.streaming.state(tile(0, 3, 3)), (-2, -2));
}

#[test]
fn a_tile_that_arrives_when_no_longer_visible_stays_in_main_memory_only() {
    let mut bench = Bench::new(TestSource::default(), counting(4, 4, 4, 4));
    bench.frame(&[A]);
    let report = bench.frame(&[]);
    assert_eq!((report.loads, report.uploads), (1, 0));
    assert_eq!(bench.streaming.state(A), (-2, 0));
    assert_eq!(bench.frame(&[A]).uploads, 1);
    assert_eq!(bench.source.reads(), [A]);
}

#[test]
fn a_visible_set_larger_than_main_memory_still_arrives() {
    for host_tiles in [1, 2, 15] {
        let mut bench = Bench::new(TestSource::default(), counting(16, host_tiles, 4, 4));
        bench.settle(&block(4, 4), 40);
        let mut bench = Bench::new(TestSource::default(), timed(16, host_tiles));
        bench.settle_timed(&block(4, 4));
    }
}

#[test]
fn a_load_begun_before_a_reset_is_not_written_to_the_reused_slot() {
    let mut bench = Bench::new(TestSource::default(), timed(1, 1));
    bench.source.set_gate(true);
    bench.frame(&[A]);
    while bench.source.reads().is_empty() {
        std::thread::yield_now();
    }
    bench.streaming.reset();
    bench.frame(&[B]);
    assert_eq!(bench.streaming.host_tile(0), Some(B));
    bench.source.set_gate(false);
    // The bench compares the displayed bytes with the tile's. The two loads may end in either order.
    let mut stale = 0;
    let reports = bench.until(&[B], |bench, report| {
        stale += report.stale_loads;
        stale > 0 && bench.streaming.settled()
    });
    assert_eq!(stale, 1);
    assert_eq!(reports.iter().map(|report| report.loads).sum::<usize>(), 1);
    assert_eq!(bench.streaming.state(A), (-2, -2));
}

#[test]
fn a_load_no_longer_needed_loses_its_slot_to_a_visible_tile() {
    let mut bench = Bench::new(TestSource::default(), timed(1, 1));
    bench.source.set_gate(true);
    bench.frame(&[A]);
    assert_eq!(bench.streaming.state(A), (-2, -1));
    bench.frame(&[B]);
    assert_eq!(bench.streaming.state(A), (-2, -2));
    assert_eq!(bench.streaming.state(B), (-2, -1));
    // And back again: the second load of A has another generation than the first. Two loads are stale: the first load
    // of A, and that of B. The three loads may end in any order. The first may already have ended: if its thread starts
    // late, the load is cancelled before it has begun.
    let mut stale = bench.frame(&[A]).stale_loads;
    bench.source.set_gate(false);
    let reports = bench.until(&[A], |bench, report| {
        stale += report.stale_loads;
        stale >= 2 && bench.streaming.settled()
    });
    assert_eq!(stale, 2);
    assert_eq!(reports.iter().map(|report| report.loads).sum::<usize>(), 1);
}

/// 16 loads in flight against a closed gate; at least one has begun, at most 8 (one per thread).
fn stuck() -> Bench {
    let mut bench = Bench::new(TestSource::default(), timed(16, 16));
    bench.source.set_gate(true);
    let report = bench.frame(&block(2, 8));
    assert_eq!((report.loads_under_way, report.queued_loads), (16, 0));
    while bench.source.reads().is_empty() {
        std::thread::yield_now();
    }
    bench
}

#[test]
fn loads_cancelled_by_a_reset_before_they_began_are_not_read() {
    let mut bench = stuck();
    bench.streaming.reset();
    bench.source.set_gate(false);
    bench.settle_timed(&[B]);
    assert!(bench.source.reads().len() <= 8 + 1, "{:?}", bench.source.reads());
}

#[test]
fn the_latest_load_gives_up_its_slot_and_is_not_read() {
    let mut bench = stuck();
    bench.frame(&[B]);
    assert_eq!(bench.streaming.state(tile(0, 1, 7)), (-2, -2));
    assert_eq!(bench.streaming.state(tile(0, 1, 6)), (-2, -1));
    bench.source.set_gate(false);
    bench.settle_timed(&[B]);
    assert!(!bench.source.reads().contains(&tile(0, 1, 7)), "{:?}", bench.source.reads());
}

#[test]
fn a_reset_clears_the_display_with_the_next_frame() {
    let mut bench = Bench::new(TestSource::default(), counting(4, 4, 4, 4));
    bench.settle(&[A], 2);
    let generation = bench.streaming.gpu_generation(0);
    bench.streaming.reset();
    assert!(!bench.streaming.settled());
    assert_eq!(bench.frame(&[B]).display, [(A, None)]);
    bench.settle(&[B], 1);
    assert_eq!(bench.streaming.gpu_tile(0), Some(B));
    assert_eq!(bench.streaming.gpu_generation(0), generation + 1);
}

/// The loader's own test checks that loads which have not begun are dropped, because only the loader knows when the
/// drop begins.
#[test]
fn dropping_joins_the_threads_with_loads_under_way() {
    for load_budget_ms in [1e12, 1e-6] {
        let config = StreamingConfig { load_budget_ms, ..timed(32, 32) };
        let mut bench = Bench::new(TestSource::with_delay(|_| Duration::from_millis(5)), config);
        bench.frame(&block(4, 8));
        let Bench { source, streaming, .. } = bench;
        drop(streaming);
        assert_eq!(Arc::strong_count(&source), 1, "a thread still holds the source");
    }
}

#[test]
fn an_oversubscribed_cache_shows_a_coarser_level_and_reports_it() {
    let mut bench = Bench::new(TestSource::default(), counting(8, 8, 4, 4));
    for _ in 0..2 {
        let report = bench.settle(&block(4, 4), 20).pop().unwrap();
        assert_eq!((report.tiles, report.wanted, report.bias, report.oversubscribed), (16, 4, 1, true));
        // The bias is held for 30 frames.
        let report = bench.settle(&block(2, 4), 50).pop().unwrap();
        assert_eq!((report.tiles, report.wanted, report.bias, report.oversubscribed), (8, 8, 0, false));
    }
}

#[test]
fn the_users_bias_is_added_and_does_not_count_as_oversubscription() {
    let config = StreamingConfig { level_bias: 1, ..counting(4, 8, 4, 4) };
    let mut bench = Bench::new(TestSource::default(), config);
    let report = bench.settle(&block(4, 4), 20).pop().unwrap();
    assert_eq!((report.wanted, report.bias, report.oversubscribed), (4, 1, false));
    let report = bench.settle(&block(4, 8), 20).pop().unwrap();
    assert_eq!((report.wanted, report.bias, report.oversubscribed), (2, 2, true));
}

#[test]
fn a_still_camera_settles_at_any_cache_size() {
    for gpu_tiles in 1..40 {
        let mut bench = Bench::new(TestSource::default(), counting(gpu_tiles, 4, 2, 2));
        bench.settle(&block(6, 6), 60);
        for _ in 0..10 {
            let report = bench.frame(&block(6, 6));
            assert_eq!((report.uploads, report.gpu_evictions, report.loads), (0, 0, 0), "N1 = {gpu_tiles}");
        }
    }
}

#[test]
fn alternating_cameras_at_the_cache_size_do_not_livelock() {
    // 16 tiles fit exactly. 20 tiles do not: with bias 1 they become 6 coarser tiles, and the 16 become 4. The bias is
    // held, because 16 tiles leave no margin.
    let (fits, too_many) = (block(4, 4), block(4, 5));
    let mut bench = Bench::new(TestSource::default(), counting(16, 32, 4, 4));
    for _ in 0..20 {
        bench.frame(&fits);
        bench.frame(&too_many);
    }
    for _ in 0..20 {
        for (list, wanted, oversubscribed) in [(&fits, 4, false), (&too_many, 6, true)] {
            let report = bench.frame(list);
            assert_eq!((report.wanted, report.misses, report.bias), (wanted, 0, 1), "{report:?}");
            assert_eq!((report.oversubscribed, report.bias_held), (oversubscribed, !oversubscribed));
        }
    }
    for (list, wanted) in [(&fits, 16), (&too_many, 6)] {
        // After 31 frames at rest, 16 tiles arrive, 4 in a frame.
        assert_eq!(bench.settle(list, 40).pop().unwrap().wanted, wanted);
        assert_eq!(bench.frame(list).uploads, 0);
    }
}

#[test]
fn the_substitute_of_a_missing_tile_is_not_evicted_first() {
    // The coarse tile is older than B, but substitutes for A, which never arrives.
    let mut bench = Bench::new(TestSource::default(), counting(2, 4, 1, 1));
    let coarse = A.ancestor(2);
    bench.settle(&[coarse], 2);
    bench.settle(&[B], 2);
    bench.frame(&[A]);
    bench.settle(&[A], 1);
    assert!(bench.memory.display.contains_key(&coarse));
    assert!(!bench.memory.display.contains_key(&B));
}

//! Prefetched tiles, and the order of requests.

use crate::invariants::{visible_list, visible_path};
use crate::source::{Bench, TestSource, block, counting, pyramid, tile, timed};
use ortelius::math::pyramid::TileId;
use ortelius::paper::virtual_texture::streaming::{Order, StreamingConfig};
use proptest::prelude::*;
use std::collections::HashSet;

const A: TileId = TileId { level: 0, row: 0, column: 0 };
const B: TileId = TileId { level: 0, row: 9, column: 20 };
const C: TileId = TileId { level: 1, row: 7, column: 3 };

#[test]
fn a_prefetched_tile_is_resident_when_first_visible() {
    let mut bench = Bench::new(TestSource::default(), counting(4, 4, 4, 4));
    bench.frame_ahead(&[A], &[A, B]);
    let report = bench.frame_ahead(&[A], &[A, B]);
    assert_eq!((report.expected, report.uploads, report.ahead_uploads, report.pending), (1, 2, 1, 0));
    let report = bench.frame(&[B]);
    assert_eq!((report.hits, report.misses), (1, 0));
}

#[test]
fn visible_tiles_are_loaded_and_uploaded_before_prefetched_ones() {
    let mut bench = Bench::new(TestSource::default(), counting(8, 8, 1, 1));
    bench.frame_ahead(&[A], &[B]);
    assert_eq!(bench.streaming.state(A), (-2, -1));
    // C is requested after B, but is served before it.
    bench.frame_ahead(&[A, C], &[B]);
    bench.frame_ahead(&[A, C], &[B]);
    let report = bench.frame_ahead(&[A, C], &[B]);
    assert_eq!((report.uploads, report.ahead_uploads), (1, 1));
    assert_eq!(bench.source.reads(), [A, C, B]);
}

#[test]
fn a_prefetched_tile_never_evicts_a_visible_one() {
    let mut bench = Bench::new(TestSource::default(), counting(2, 2, 4, 4));
    bench.settle(&[A, C], 4);
    for _ in 0..4 {
        let report = bench.frame_ahead(&[A, C], &[B]);
        assert_eq!((report.expected, report.hits, report.gpu_evictions), (0, 2, 0));
    }
    // A cannot be read. Its substitute is in use as well.
    let mut bench = Bench::new(TestSource::default(), counting(2, 8, 4, 4));
    bench.settle(&[C], 4);
    let (below, coarser) = (tile(0, 14, 6), C);
    bench.streaming.frame(&[below], &mut NoRoom);
    let report = bench.frame_ahead(&[below], &[A, B]);
    assert_eq!(report.expected, 1, "one slot is for the visible tile");
    assert!(bench.memory.display.contains_key(&coarser));
}

#[test]
fn a_wrong_prediction_is_evicted_before_tiles_that_were_visible() {
    let mut bench = Bench::new(TestSource::default(), counting(3, 3, 4, 4));
    bench.settle(&[A, C], 4);
    bench.frame_ahead(&[A, C], &[B]);
    let report = bench.frame_ahead(&[A, C], &[B]);
    assert_eq!((report.uploads, report.ahead_uploads), (1, 1));
    let other = tile(0, 5, 5);
    bench.settle(&[other], 4);
    assert_eq!(bench.streaming.state(B), (-2, -2));
    for visible in [A, C, other] {
        let (gpu_state, host_state) = bench.streaming.state(visible);
        assert!(gpu_state >= 0 && host_state >= 0, "{visible:?}: {gpu_state}, {host_state}");
    }
}

#[test]
fn a_prediction_that_was_not_uploaded_leaves_main_memory_before_tiles_that_were_visible() {
    let mut bench = Bench::new(TestSource::default(), counting(3, 3, 4, 4));
    bench.settle(&[A, C], 4);
    bench.frame_ahead(&[A, C], &[B]);
    bench.streaming.frame_ahead(&[A, C], &[B], &mut NoRoom);
    assert!(bench.streaming.state(B).0 < 0 && bench.streaming.state(B).1 >= 0);
    bench.settle(&[tile(0, 5, 5)], 4);
    assert_eq!(bench.streaming.state(B).1, -2);
    assert!([A, C].iter().all(|&tile| bench.streaming.state(tile).1 >= 0));
}

/// Video memory that is never ready.
struct NoRoom;

impl ortelius::paper::virtual_texture::streaming::Uploader for NoRoom {
    fn upload(&mut self, _: u32, _: TileId, _: &[u8]) -> bool {
        false
    }
}

#[test]
fn a_prefetched_tile_pins_no_slot_of_main_memory() {
    // The tile pool is full of visible tiles, so B cannot be uploaded. B's slot in the host cache is the only
    // one available to C.
    let mut bench = Bench::new(TestSource::default(), counting(3, 1, 1, 1));
    bench.settle(&[A], 4);
    for _ in 0..3 {
        bench.frame_ahead(&[A], &[B]);
    }
    bench.settle(&[A, C], 4);
}

#[test]
fn only_a_few_prefetch_loads_are_in_flight_at_a_time() {
    let mut bench = Bench::new(TestSource::default(), timed(64, 64));
    bench.source.set_gate(true);
    let report = bench.frame_ahead(&[], &block(4, 8));
    assert_eq!((report.loads_under_way, report.queued_loads), (4, 28));
    let report = bench.frame_ahead(&[B, C], &block(4, 8));
    assert_eq!(report.loads_under_way, 6, "visible tiles do not wait for them");
    bench.source.set_gate(false);
}

#[test]
fn the_finest_or_coarsest_tile_is_requested_first_as_configured() {
    for (order, first) in [(Order::Finest, A), (Order::Coarsest, C)] {
        let config = StreamingConfig { order, ..counting(4, 4, 1, 1) };
        let mut bench = Bench::new(TestSource::default(), config);
        bench.settle(&[A, B, C], 8);
        assert_eq!(bench.source.reads()[0], first);
    }
}

/// The tile displayed for a visible tile: itself, or the nearest coarser one in the tile pool.
fn shown(bench: &Bench, visible: TileId) -> Option<TileId> {
    let coarser =
        (0..pyramid().first_resident_level() - visible.level).map(|levels| visible.ancestor(levels));
    coarser.into_iter().find(|&tile| bench.streaming.state(tile).0 >= 0)
}

fn run(bench: &mut Bench, path: &[Vec<TileId>], expected: &[Vec<TileId>]) -> Result<(), TestCaseError> {
    for (n, visible) in path.iter().enumerate() {
        let before: HashSet<TileId> = visible.iter().filter_map(|&tile| shown(bench, tile)).collect();
        let report = bench.frame_ahead(visible, &expected[n % expected.len()]);
        prop_assert!(report.wanted + report.expected <= bench.streaming.config().gpu_tiles as usize);
        if report.ahead_uploads > 0 {
            prop_assert_eq!(report.queued_uploads, 0, "a visible tile still waits");
        }
        if report.ahead_uploads == report.uploads {
            for tile in before {
                prop_assert!(bench.streaming.state(tile).0 >= 0, "{:?} was shown and has been evicted", tile);
            }
        }
    }
    if let Some(last) = path.last() {
        match bench.streaming.config().deterministic {
            true => bench.settle(last, 10_000),
            false => bench.settle_timed(last),
        };
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn the_invariants_hold_for_any_prefetch(
        gpu in 1u32..12, host in 1u32..12, uploads in 1u32..4, loads in 1u32..4, path in visible_path(),
        expected in prop::collection::vec(visible_list(), 1..8), broken in visible_list(), deterministic: bool,
    ) {
        let config = match deterministic {
            true => counting(gpu, host, uploads, loads),
            false => timed(gpu, host),
        };
        let mut bench = Bench::new(TestSource::default(), config);
        bench.source.set_broken(broken);
        run(&mut bench, &path, &expected)?;
    }
}

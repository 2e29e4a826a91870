//! Invariants after every frame, for all lists, sizes, budgets and thread timings.

use crate::source::{Bench, TestSource, VideoMemory, counting, pyramid, tile, timed};
use ortelius::math::pyramid::TileId;
use ortelius::paper::virtual_texture::streaming::{
    ABSENT, QUEUED, Streaming, StreamingConfig, StreamingCounts,
};
use proptest::prelude::*;
use std::collections::HashMap;
use std::time::Duration;

fn all_tiles() -> impl Iterator<Item = TileId> {
    (0..pyramid().first_resident_level()).flat_map(|level| {
        let [columns, rows] = pyramid().tile_grid(level);
        (0..rows).flat_map(move |row| (0..columns).map(move |column| tile(level, row, column)))
    })
}

/// The slot of each tile; an error if a tile is in two slots.
fn contents(slots: u32, held: impl Fn(u32) -> Option<TileId>) -> Result<HashMap<TileId, i32>, String> {
    let mut contents = HashMap::new();
    for slot in 0..slots {
        if let Some(tile) = held(slot)
            && let Some(other) = contents.insert(tile, slot as i32)
        {
            return Err(format!("{tile:?} is in slots {other} and {slot}"));
        }
    }
    Ok(contents)
}

/// No tile is in two slots, and the tile states agree with the slots. The page table names exactly the tiles in the
/// tile pool (J1), and each of their slots holds its tile's texels.
pub fn check(streaming: &Streaming, memory: &VideoMemory, report: &StreamingCounts) -> Result<(), String> {
    let config = streaming.config();
    let j1 = contents(config.gpu_tiles, |slot| streaming.gpu_tile(slot))?;
    let j2 = contents(config.host_tiles, |slot| streaming.host_tile(slot))?;
    let (mut queued_uploads, mut queued_loads) = (0, 0);
    for tile in all_tiles() {
        let (k1, k2) = streaming.state(tile);
        if k1 >= 0 && j1.get(&tile) != Some(&k1) || k1 < 0 && j1.contains_key(&tile) {
            return Err(format!("{tile:?} has state {k1}, but the tile pool has it in {:?}", j1.get(&tile)));
        }
        // A tile that is being loaded already has its slot.
        if k2 >= 0 && j2.get(&tile) != Some(&k2) || k2 == ABSENT && j2.contains_key(&tile) {
            return Err(format!(
                "{tile:?} has host state {k2}, but the host cache has it in {:?}",
                j2.get(&tile)
            ));
        }
        if k1 == QUEUED && k2 < 0 {
            return Err(format!("{tile:?} waits for its upload, but its host state is {k2}"));
        }
        queued_uploads += usize::from(k1 == QUEUED);
        queued_loads += usize::from(k2 == QUEUED && !j2.contains_key(&tile));
    }
    if (queued_uploads, queued_loads) != (report.queued_uploads, report.queued_loads) {
        return Err(format!("{queued_uploads}, {queued_loads} tiles queued; {report:?}"));
    }
    if memory.display.len() != j1.len() {
        return Err(format!("{} tiles displayed, {} in the tile pool", memory.display.len(), j1.len()));
    }
    for (&tile, &slot) in &memory.display {
        if j1.get(&tile) != Some(&(slot as i32)) {
            return Err(format!(
                "{tile:?} is displayed from slot {slot}, the pool has it in {:?}",
                j1.get(&tile)
            ));
        }
        if memory.slots.get(&slot) != Some(&TestSource::bytes(tile)) {
            return Err(format!("slot {slot} does not hold the texels of {tile:?}"));
        }
    }
    let missing = streaming.wanted().iter().filter(|tile| !j1.contains_key(tile)).count();
    match missing == report.pending && streaming.settled() == (missing == 0 && !report.bias_held) {
        true => Ok(()),
        false => Err(format!("{missing} tiles missing; {report:?}")),
    }
}

#[test]
fn the_check_rejects_a_display_that_differs() {
    let mut bench = Bench::new(TestSource::default(), counting(4, 4, 4, 4));
    let visible = [tile(0, 0, 0), tile(1, 0, 1)];
    let report = bench.settle(&visible, 3).pop().unwrap();
    let Bench { memory, streaming, .. } = &mut bench;
    check(streaming, memory, &report).unwrap();

    let slot = memory.display.remove(&visible[0]).unwrap();
    assert!(check(streaming, memory, &report).unwrap_err().contains("1 tiles displayed, 2 in the tile pool"));
    memory.display.insert(tile(0, 3, 3), slot);
    assert!(check(streaming, memory, &report).unwrap_err().contains("the pool has it in None"));
    memory.display.remove(&tile(0, 3, 3));
    memory.display.insert(visible[0], slot);

    memory.slots.get_mut(&slot).unwrap()[7] ^= 1;
    assert!(check(streaming, memory, &report).unwrap_err().contains("does not hold the texels"));
    memory.slots.get_mut(&slot).unwrap()[7] ^= 1;

    let wrong = StreamingCounts { pending: 1, ..report.clone() };
    assert!(check(streaming, memory, &wrong).unwrap_err().contains("0 tiles missing"));
    let wrong = StreamingCounts { queued_loads: 1, ..report };
    assert!(check(streaming, memory, &wrong).unwrap_err().contains("0, 0 tiles queued"));
}

#[test]
fn the_check_rejects_a_tile_in_two_slots() {
    let error = contents(3, |slot| (slot != 1).then_some(tile(0, 0, 0))).unwrap_err();
    assert!(error.contains("is in slots 0 and 2"), "{error}");
}

/// A list of visible tiles near one corner, so that lists overlap.
pub fn visible_list() -> impl Strategy<Value = Vec<TileId>> {
    let any_tile = (0u32..5, 0u32..6, 0u32..6).prop_map(|(level, row, column)| {
        let [columns, rows] = pyramid().tile_grid(level);
        tile(level, row.min(rows - 1), column.min(columns - 1))
    });
    prop::collection::vec(any_tile, 0..14)
}

/// A path: some lists repeat for a few frames, like a camera at rest.
pub fn visible_path() -> impl Strategy<Value = Vec<Vec<TileId>>> {
    prop::collection::vec((visible_list(), 1usize..4), 1..12)
        .prop_map(|path| path.into_iter().flat_map(|(list, frames)| vec![list; frames]).collect())
}

/// Runs the frames of a path; checks that no wanted tile leaves the tile pool.
fn run(bench: &mut Bench, path: &[Vec<TileId>]) -> Result<(), TestCaseError> {
    for visible in path {
        let before: HashMap<TileId, i32> =
            all_tiles().map(|tile| (tile, bench.streaming.state(tile).0)).collect();
        let report = bench.frame(visible);
        for &tile in bench.streaming.wanted() {
            let (was, is) = (before[&tile], bench.streaming.state(tile).0);
            prop_assert!(was < 0 || was == is, "{:?} was in {}, is in {}", tile, was, is);
        }
        prop_assert!(report.wanted <= bench.streaming.config().gpu_tiles as usize);
        prop_assert_eq!(report.hits + report.misses, report.wanted);
    }
    Ok(())
}

/// From 0 to 0.3 ms, so that loads overtake each other.
fn uneven(tile: TileId) -> Duration {
    Duration::from_micros(u64::from(tile.level * 7 + tile.row * 13 + tile.column * 29) % 4 * 100)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn the_invariants_hold_for_any_thread_timing(
        gpu in 1u32..12, host in 1u32..12, path in visible_path(), broken in visible_list(), reset in 0usize..40,
    ) {
        let config = StreamingConfig { upload_budget_ms: 0.05, ..timed(gpu, host) };
        let mut bench = Bench::new(TestSource::with_delay(uneven), config);
        bench.source.set_broken(broken);
        let reset = reset.min(path.len());
        run(&mut bench, &path[..reset])?;
        bench.streaming.reset();
        run(&mut bench, &path[reset..])?;
        if let Some(last) = path.last() {
            bench.settle_timed(last);
        }
    }

    #[test]
    fn the_invariants_hold_with_budgets_in_tiles(
        gpu in 1u32..12, host in 1u32..12, uploads in 1u32..4, loads in 1u32..4, bias in 0u32..3,
        path in visible_path(), broken in visible_list(),
    ) {
        let config = StreamingConfig { level_bias: bias, ..counting(gpu, host, uploads, loads) };
        let mut bench = Bench::new(TestSource::default(), config);
        bench.source.set_broken(broken);
        run(&mut bench, &path)?;
        if let Some(last) = path.last() {
            // A list has at most 13 tiles, and a tile that fails adds at most 4 coarser ones. In each frame at
            // least one tile is loaded and one uploaded. The rest is a margin.
            bench.settle(last, 14 * 5 + 4);
        }
    }

    #[test]
    fn the_same_lists_give_the_same_frames_for_any_thread_timing(
        gpu in 1u32..12, host in 1u32..12, path in visible_path(), broken in visible_list(),
    ) {
        let play = |source: TestSource| {
            let mut bench = Bench::new(source, counting(gpu, host, 2, 3));
            bench.source.set_broken(broken.iter().copied());
            path.iter().map(|visible| bench.frame(visible)).collect::<Vec<_>>()
        };
        prop_assert_eq!(play(TestSource::default()), play(TestSource::with_delay(uneven)));
    }
}

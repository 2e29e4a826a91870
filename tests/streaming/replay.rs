//! The replacement rule alone: with every tile in main memory, streaming agrees with the replay.

use crate::invariants::visible_path;
use crate::source::{Bench, TestSource, counting, pyramid};
use ortelius::math::pyramid::TileId;
use ortelius::paper::virtual_texture::streaming::Uploader;
use ortelius::paper::virtual_texture::streaming::replay::{FrameLists, Replacement, Replayed, replay};
use proptest::prelude::*;
use std::collections::BTreeSet;

/// Video memory that rejects every upload.
struct Closed;

impl Uploader for Closed {
    fn upload(&mut self, _: u32, _: TileId, _: &[u8]) -> bool {
        false
    }
}

/// The frames of streaming and those of the replay, on a path whose tiles are all in main memory. The replay gets the
/// tiles that streaming wants: its bias depends on earlier frames.
fn both(path: &[Vec<TileId>], slots: u32, rule: Replacement) -> (Vec<Replayed>, Vec<Replayed>) {
    let mut bench = Bench::new(TestSource::default(), counting(slots, 2000, 64, 64));
    let levels = 0..pyramid().first_resident_level();
    let with_coarser = path.iter().flatten().flat_map(|tile| {
        levels
            .clone()
            .filter(move |level| *level >= tile.level)
            .map(move |level| tile.ancestor(level - tile.level))
    });
    let all: Vec<TileId> = with_coarser.collect::<BTreeSet<_>>().into_iter().collect();
    for list in all.chunks(slots as usize) {
        // Requested and loaded; the upload is rejected.
        bench.streaming.frame(list, &mut Closed);
        bench.streaming.frame(list, &mut Closed);
    }
    bench.streaming.frame(&[], &mut Closed);
    let frame = |list: &Vec<TileId>| {
        let report = bench.frame(list);
        assert_eq!((report.loads, report.pending), (0, 0), "all tiles are in main memory");
        let wanted = bench.streaming.wanted().to_vec();
        let built =
            Replayed { wanted: report.wanted, faults: report.uploads, evictions: report.gpu_evictions };
        (built, FrameLists { visible: list.clone(), wanted, bias: report.bias })
    };
    let (built, lists): (Vec<Replayed>, Vec<FrameLists>) = path.iter().map(frame).unzip();
    (built, replay(&lists, slots, rule))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn streaming_agrees_with_the_replay(path in visible_path(), slots in 1u32..12) {
        let (built, replayed) = both(&path, slots, Replacement::LeastRecentlyShown);
        prop_assert_eq!(built, replayed);
    }
}

#[test]
fn another_rule_is_rejected() {
    let tiles: Vec<TileId> = (0..4).map(|column| TileId { level: 0, row: 0, column }).collect();
    // The first tile is used again, so only FIFO evicts it.
    let path: Vec<Vec<TileId>> = [0, 1, 0, 2, 0].iter().map(|&n| vec![tiles[n]]).collect();
    let (built, replayed) = both(&path, 2, Replacement::LeastRecentlyShown);
    assert_eq!(built, replayed);
    let (built, replayed) = both(&path, 2, Replacement::FirstIn);
    assert_ne!(built, replayed);
}

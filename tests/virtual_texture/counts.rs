//! The counts of stages 2 and 3 in figures, compared with the device: its list, and its pipeline statistics.

use crate::{bordered, open, pose};
use ortelius::paper::virtual_texture::counts::{ATOMICS, Requests, TESTS, TEXELS, WORDS, WRITTEN, of_list};
use ortelius::paper::virtual_texture::{Again, Compaction, Config, Dedup, PAPER, TileAddress, all_needs};
use ortelius::vk::{Feature, Gpu, GpuOptions, Watched, Work};
use std::collections::BTreeSet;

/// A variant's settled frame: its counts by quantity, its list, and the device's statistics of each pass.
struct Counted {
    config: Config,
    rows: Vec<(String, Option<f64>)>,
    triples: Vec<[u32; 3]>,
    works: Vec<(String, Work)>,
}

impl Counted {
    fn of(gpu: &Gpu, config: Config) -> Counted {
        let scene = bordered("earth", 16);
        let pose = pose(&scene, "oblique");
        // With 141 rows the last workgroups extend beyond the picture's edge.
        let mut session = open(gpu, &scene, [250, 141], |settings| settings.config = config);
        session.settle(&pose).unwrap();
        let requests = session.requests().unwrap();
        let pyramid = session.technique.source.pyramid();
        let requests = Requests { triples: &requests, size: [250, 141], pyramid: &pyramid };
        let rows = of_list(gpu, ("", &config), &requests, session.technique.stage1()).unwrap();
        gpu.count_work(true);
        let Again { triples, times, .. } = session.again(&pose).unwrap();
        gpu.count_work(false);
        let works = times.into_iter().filter_map(|pass| Some((pass.label, pass.work?))).collect();
        let rows = rows.into_iter().map(|row| (row.quantity, row.value.number())).collect();
        Counted { config, rows, triples, works }
    }

    fn count(&self, quantity: &str, stage: u32) -> Option<u64> {
        let name = format!("{quantity}, stage {stage}");
        let (_, count) = self.rows.iter().find(|(known, _)| *known == name).expect("a row of the list");
        count.map(|count| count as u64)
    }

    fn work(&self, pass: &str) -> Work {
        self.works.iter().find(|(label, _)| label == pass).expect("a pass of the frame").1
    }
}

#[test]
fn counts_of_the_list_are_those_of_the_device() {
    let wishes = &[Feature::PipelineStatistics];
    let gpu = Watched::open(&GpuOptions { needs: &all_needs(), wishes, ..GpuOptions::default() });
    assert!(gpu.has(Feature::PipelineStatistics), "the test needs a device that counts invocations");
    let of =
        |dedup, compact, address| Counted::of(&gpu, Config { dedup, compact, address, memo: false, ..PAPER });
    let all = [
        of(Dedup::Geometry, Compaction::TransformFeedback, TileAddress::Level0),
        of(Dedup::AtomicOr, Compaction::Append, TileAddress::Level0),
        of(Dedup::TestOr, Compaction::Append, TileAddress::OwnLevel),
        of(Dedup::TileMemo, Compaction::Append, TileAddress::OwnLevel),
        of(Dedup::Bitset, Compaction::Append, TileAddress::OwnLevel),
        of(Dedup::MarkBytes, Compaction::Append, TileAddress::OwnLevel),
        of(Dedup::FusedExact, Compaction::Append, TileAddress::OwnLevel),
        of(Dedup::FusedExact, Compaction::FusedAppend, TileAddress::OwnLevel),
    ];
    for counted in &all {
        let Config { dedup, compact, .. } = counted.config;
        let entry = if compact == Compaction::FusedAppend { 4 } else { 12 };
        let bytes = entry * counted.triples.len() as u64;
        assert_eq!(counted.count(WRITTEN, 3), Some(bytes), "{dedup:?}, {compact:?}");
        if compact == Compaction::Append {
            // An invocation reads a word; workgroups have 64.
            let words = counted.count(WORDS, 3).unwrap();
            assert_eq!(counted.work("compact").compute_invocations, words.next_multiple_of(64), "{dedup:?}");
        }
    }
    let [geometry, atomic_or, test_or, tile_memo, bitset, _, fused, _] = &all;
    // Without the memo a geometry shader emits a point for each pixel that other variants mark.
    let points = Some(geometry.work("dedup").geometry_primitives);
    assert_eq!([atomic_or.count(ATOMICS, 2), test_or.count(TESTS, 2), fused.count(TESTS, 2)], [points; 3]);
    // An invocation fetches one texel, or with tile-memo the texels of 8 x 8 pixels.
    for (counted, texels) in [(atomic_or, 1), (test_or, 1), (tile_memo, 64)] {
        let invocations = counted.work("dedup").compute_invocations;
        assert_eq!(counted.count(TEXELS, 2), Some(texels * invocations), "{:?}", counted.config.dedup);
    }
    // One addition for each word with a mark: a word for each cell of level 0's grid.
    let cells =
        |counted: &Counted| BTreeSet::from_iter(counted.triples.iter().map(|&[_, i, j]| [i, j])).len();
    for counted in [atomic_or, test_or] {
        assert_eq!(counted.count(ATOMICS, 3), Some(cells(counted) as u64));
    }
    // Near miss that must be rejected: in a mask of bits, neighbouring tiles share a word.
    assert!(bitset.count(ATOMICS, 3) < Some(cells(bitset) as u64), "{} tiles", cells(bitset));
}

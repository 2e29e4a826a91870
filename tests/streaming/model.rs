//! A second implementation of the streaming rules on plain lists, written from the module's documentation. Every search
//! is a loop, and every order follows from clock values.

use crate::invariants::{visible_list, visible_path};
use crate::source::{Bench, TestSource, counting, pyramid};
use ortelius::math::pyramid::TileId;
use ortelius::paper::virtual_texture::streaming::StreamingCounts;
use proptest::prelude::*;
use std::collections::BTreeSet;

/// A tile in a cache and the clock of its last use; `None`: pinned, or still loading.
type Held = (TileId, Option<u64>);

struct Model {
    n1: usize,
    n2: usize,
    uploads: usize,
    loads: usize,
    broken: Vec<TileId>,
    clock: u64,
    bias: u32,
    calm: usize,
    before: Vec<TileId>,
    j1: Vec<Held>,
    j2: Vec<Held>,
    q1: Vec<TileId>,
    q2: Vec<TileId>,
    loading: Vec<TileId>,
    failed: Vec<TileId>,
    evictions: [usize; 2],
}

fn position(cache: &[Held], tile: TileId) -> Option<usize> {
    cache.iter().position(|&(held, _)| held == tile)
}

impl Model {
    fn touch(cache: &mut [Held], clock: &mut u64, tile: TileId) {
        let index = position(cache, tile).unwrap();
        *clock += 1;
        cache[index].1 = Some(*clock);
    }

    fn evict(cache: &mut Vec<Held>, max: usize, kept: &[TileId]) -> Option<usize> {
        if cache.len() < max {
            return Some(0);
        }
        let (tile, _) = *cache
            .iter()
            .filter(|(tile, last_use)| last_use.is_some() && !kept.contains(tile))
            .min_by_key(|(_, last_use)| *last_use)?;
        cache.retain(|&(held, _)| held != tile);
        Some(1)
    }

    fn wanted(&mut self, visible: &[TileId]) -> Vec<TileId> {
        let coarsest = pyramid().first_resident_level();
        let at = |bias: u32| -> Vec<TileId> {
            visible
                .iter()
                .filter(|tile| tile.level + bias < coarsest)
                .map(|tile| tile.ancestor(bias))
                .collect()
        };
        let fitting =
            |max: usize| (0..).find(|&bias| at(bias).iter().collect::<BTreeSet<_>>().len() <= max).unwrap();
        // The bias rises at once. It falls after 30 frames in which a lower one suffices: at rest if the tiles fit,
        // otherwise if a tenth of the slots stays free.
        let rests = self.before == visible;
        self.before = visible.to_vec();
        let lower = fitting(if rests { self.n1 } else { self.n1 * 9 / 10 });
        self.calm = if lower < self.bias { self.calm + 1 } else { 0 };
        let falls = self.calm == 30;
        self.bias = if falls { lower } else { self.bias.max(fitting(self.n1)) };
        self.calm = if falls { 0 } else { self.calm };
        let bias = self.bias;
        let mut wanted = Vec::new();
        for mut tile in at(bias) {
            while tile.level < coarsest && self.failed.contains(&tile) {
                tile = tile.parent();
            }
            if tile.level < coarsest && !wanted.contains(&tile) {
                wanted.push(tile);
            }
        }
        wanted
    }

    fn frame(&mut self, visible: &[TileId]) -> usize {
        self.evictions = [0, 0];
        for tile in std::mem::take(&mut self.loading) {
            if self.broken.contains(&tile) {
                self.failed.push(tile);
                self.j2.retain(|&(held, _)| held != tile);
            } else {
                self.q1.push(tile);
            }
        }
        let wanted = self.wanted(visible);
        // Tiles that are no longer wanted are older than those of this frame.
        for tile in std::mem::take(&mut self.q1) {
            match wanted.contains(&tile) {
                true => self.q1.push(tile),
                false => Self::touch(&mut self.j2, &mut self.clock, tile),
            }
        }
        self.a1(visible, &wanted);
        let uploads = self.a2(&wanted);
        self.q2.retain(|tile| wanted.contains(tile));
        for _ in 0..self.loads {
            let Some(&tile) = self.q2.first() else { break };
            let Some(evicted) = Self::evict(&mut self.j2, self.n2, &[]) else { break };
            self.evictions[1] += evicted;
            self.q2.remove(0);
            self.j2.push((tile, None));
            self.loading.push(tile);
        }
        uploads
    }

    fn a1(&mut self, visible: &[TileId], wanted: &[TileId]) {
        for &tile in visible {
            let coarser =
                (0..pyramid().first_resident_level() - tile.level).map(|levels| tile.ancestor(levels));
            if let Some(shown) = coarser.into_iter().find(|&tile| position(&self.j1, tile).is_some()) {
                Self::touch(&mut self.j1, &mut self.clock, shown);
            }
        }
        for &tile in wanted {
            let in_j2 = position(&self.j2, tile);
            if position(&self.j1, tile).is_some() {
                Self::touch(&mut self.j1, &mut self.clock, tile);
                if in_j2.is_some_and(|index| self.j2[index].1.is_some()) {
                    Self::touch(&mut self.j2, &mut self.clock, tile);
                }
            } else if self.q1.contains(&tile) || self.q2.contains(&tile) || self.loading.contains(&tile) {
            } else if let Some(index) = in_j2 {
                self.j2[index].1 = None;
                self.q1.push(tile);
            } else {
                self.q2.push(tile);
            }
        }
    }

    fn a2(&mut self, wanted: &[TileId]) -> usize {
        let uploads = self.uploads.min(self.q1.len());
        for tile in self.q1.drain(..uploads).collect::<Vec<_>>() {
            self.evictions[0] += Self::evict(&mut self.j1, self.n1, wanted).unwrap();
            self.j1.push((tile, None));
            Self::touch(&mut self.j1, &mut self.clock, tile);
            Self::touch(&mut self.j2, &mut self.clock, tile);
        }
        uploads
    }

    /// The first difference between this model and streaming.
    fn compare(&self, bench: &Bench, report: &StreamingCounts, uploads: usize) -> Result<(), String> {
        let config = bench.streaming.config();
        let tiles = |cache: &[Held]| cache.iter().map(|&(tile, _)| tile).collect::<BTreeSet<_>>();
        let gpu = (0..config.gpu_tiles).filter_map(|slot| bench.streaming.gpu_tile(slot)).collect();
        let host = (0..config.host_tiles).filter_map(|slot| bench.streaming.host_tile(slot)).collect();
        let differences = [
            (tiles(&self.j1) != gpu, format!("the tile pool has {:?}, here {gpu:?}", tiles(&self.j1))),
            (tiles(&self.j2) != host, format!("the host cache has {:?}, here {host:?}", tiles(&self.j2))),
            (uploads != report.uploads, format!("{uploads} uploads, here {report:?}")),
            (
                self.evictions != [report.gpu_evictions, report.host_evictions],
                format!("{:?} evictions, here {report:?}", self.evictions),
            ),
            (self.failed.len() != report.failed_tiles, format!("failed {:?}, here {report:?}", self.failed)),
        ];
        match differences.into_iter().find(|(differs, _)| *differs) {
            Some((_, difference)) => Err(difference),
            None => Ok(()),
        }
    }
}

fn model(gpu: u32, host: u32, uploads: u32, loads: u32, broken: Vec<TileId>) -> Model {
    Model {
        n1: gpu as usize,
        n2: host as usize,
        uploads: uploads as usize,
        loads: loads as usize,
        broken,
        clock: 0,
        bias: 0,
        calm: 0,
        before: Vec::new(),
        j1: Vec::new(),
        j2: Vec::new(),
        q1: Vec::new(),
        q2: Vec::new(),
        loading: Vec::new(),
        failed: Vec::new(),
        evictions: [0, 0],
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn streaming_agrees_with_the_model_on_plain_lists(
        gpu in 1u32..12, host in 1u32..12, uploads in 1u32..5, loads in 1u32..5,
        path in visible_path(), broken in visible_list(),
    ) {
        let mut bench = Bench::new(TestSource::default(), counting(gpu, host, uploads, loads));
        bench.source.set_broken(broken.iter().copied());
        let mut model = model(gpu, host, uploads, loads, broken);
        for visible in &path {
            let report = bench.frame(visible);
            let expected = model.frame(visible);
            prop_assert_eq!(report.bias, model.bias);
            if let Err(difference) = model.compare(&bench, &report, expected) {
                return Err(TestCaseError::fail(format!("frame {}: {difference}", report.frame)));
            }
        }
    }
}

#[test]
fn the_comparison_rejects_another_order_of_replacement() {
    let mut bench = Bench::new(TestSource::default(), counting(2, 2, 1, 1));
    let mut model = model(2, 2, 1, 1, Vec::new());
    let (a, b, c) =
        (crate::source::tile(0, 0, 0), crate::source::tile(0, 0, 1), crate::source::tile(0, 0, 2));
    let mut play = |list: &[TileId], spoil: bool| {
        let report = bench.frame(list);
        if spoil {
            // FIFO instead: the oldest entry is evicted regardless of its last use.
            model.j1.iter_mut().enumerate().for_each(|(index, held)| held.1 = Some(index as u64));
        }
        let expected = model.frame(list);
        model.compare(&bench, &report, expected)
    };
    for list in [&[a][..], &[a], &[b], &[b], &[a], &[c]] {
        play(list, false).unwrap();
    }
    assert!(play(&[c], true).is_err(), "a was used after b, so b is evicted");
}

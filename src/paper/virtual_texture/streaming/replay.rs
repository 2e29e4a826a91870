//! Simulation of replacement policies: the faults of a cache with a given number of slots on a recorded path.
//!
//! Every missing tile arrives within its frame, so only the policies differ. Belady's optimum (L. A. Belady, "A study
//! of replacement algorithms for a virtual-storage computer", IBM Systems Journal, 1966) knows the future; no policy
//! has fewer faults. The paper uses LRU (section 3). In [`super::Streaming`] a coarser tile that is shown for a
//! missing one also counts as used. The code uses plain lists and linear searches.

use super::wanted::{fitting_bias, wanted_tiles};
use crate::math::pyramid::TileId;
use std::collections::{HashMap, HashSet};

/// Replacement policy: which tile is evicted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Replacement {
    /// Belady's optimum: a tile that is never used again, or else the tile whose next use is latest. Needs the whole
    /// path.
    Optimum,
    /// The tile that was wanted least recently.
    LeastRecent,
    /// The tile that was wanted or shown least recently: the policy of [`super::Streaming`].
    LeastRecentlyShown,
    /// The tile that was loaded first.
    FirstIn,
}

impl Replacement {
    pub const ALL: [Replacement; 4] = [
        Replacement::Optimum,
        Replacement::LeastRecent,
        Replacement::LeastRecentlyShown,
        Replacement::FirstIn,
    ];

    pub const fn name(self) -> &'static str {
        match self {
            Replacement::Optimum => "optimum (Belady)",
            Replacement::LeastRecent => "LRU",
            Replacement::LeastRecentlyShown => "LRU, stand-ins kept (as built)",
            Replacement::FirstIn => "FIFO",
        }
    }
}

/// The visible tiles of a frame, and the tiles that it wants: the visible tiles, or coarser ones if these do not fit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameLists {
    pub visible: Vec<TileId>,
    pub wanted: Vec<TileId>,
    /// Levels by which `wanted` is coarser than `visible`.
    pub bias: u32,
}

/// Tile counts of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Replayed {
    pub wanted: usize,
    /// Wanted tiles that were not in the cache.
    pub faults: usize,
    pub evictions: usize,
}

/// The frames of a recorded path for a cache of `slots` slots, each with the smallest bias that fits. In
/// [`super::Streaming`] the bias of a moving picture falls later ([`super::LevelBias`]); the policies are compared on
/// lists that depend on each frame alone.
pub fn steps(lists: &[Vec<TileId>], slots: u32, first_resident_level: u32) -> Vec<FrameLists> {
    let step = |visible: &Vec<TileId>| {
        let bias = fitting_bias(visible, 0, first_resident_level, slots);
        let wanted = wanted_tiles(visible, bias, first_resident_level, &HashSet::new());
        FrameLists { visible: visible.clone(), wanted, bias }
    };
    lists.iter().map(step).collect()
}

/// A tile in the cache, and the clock when it was loaded and last used.
struct Held {
    tile: TileId,
    loaded: u64,
    used: u64,
}

/// Replays a path from an empty cache. A tile that a frame wants is not evicted in that frame.
///
/// # Panics
/// A frame wants more than `slots` tiles; [`steps`] prevents that.
pub fn replay(steps: &[FrameLists], slots: u32, rule: Replacement) -> Vec<Replayed> {
    // The frames that want each tile, in order.
    let mut uses: HashMap<TileId, Vec<usize>> = HashMap::new();
    for (frame, step) in steps.iter().enumerate() {
        step.wanted.iter().for_each(|&tile| uses.entry(tile).or_default().push(frame));
    }
    let next_use = |tile: TileId, frame: usize| {
        uses.get(&tile)
            .and_then(|frames| frames.iter().find(|&&later| later > frame))
            .map_or(usize::MAX, |&f| f)
    };
    let mut held: Vec<Held> = Vec::new();
    let mut clock = 0;
    let mut replayed = Vec::with_capacity(steps.len());
    for (frame, FrameLists { visible, wanted, .. }) in steps.iter().enumerate() {
        assert!(wanted.len() <= slots as usize, "frame {frame} wants {} tiles, slots {slots}", wanted.len());
        if rule == Replacement::LeastRecentlyShown {
            visible.iter().for_each(|&tile| use_shown(&mut held, &mut clock, tile));
        }
        let missing: Vec<TileId> =
            wanted.iter().copied().filter(|&tile| !use_tile(&mut held, &mut clock, tile)).collect();
        let kept: HashSet<TileId> = wanted.iter().copied().collect();
        let mut evictions = 0;
        for &tile in &missing {
            if held.len() == slots as usize {
                let others = held.iter().enumerate().filter(|(_, other)| !kept.contains(&other.tile));
                let (victim, _) = others
                    .min_by_key(|(_, other)| match rule {
                        Replacement::Optimum => (usize::MAX - next_use(other.tile, frame)) as u64,
                        Replacement::LeastRecent | Replacement::LeastRecentlyShown => other.used,
                        Replacement::FirstIn => other.loaded,
                    })
                    .expect("the wanted tiles fit");
                held.remove(victim);
                evictions += 1;
            }
            clock += 1;
            held.push(Held { tile, loaded: clock, used: clock });
        }
        replayed.push(Replayed { wanted: wanted.len(), faults: missing.len(), evictions });
    }
    replayed
}

/// Marks a tile as used; returns false if it is not in the cache.
fn use_tile(held: &mut [Held], clock: &mut u64, tile: TileId) -> bool {
    let Some(found) = held.iter_mut().find(|held| held.tile == tile) else { return false };
    *clock += 1;
    found.used = *clock;
    true
}

/// Marks the tile that is shown for `tile` as used: itself, or the nearest coarser one in the cache.
fn use_shown(held: &mut [Held], clock: &mut u64, tile: TileId) {
    let coarsest = held.iter().map(|held| held.tile.level).max().unwrap_or(0);
    let mut levels = 0..=coarsest.saturating_sub(tile.level);
    levels.any(|levels| use_tile(held, clock, tile.ancestor(levels)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tile(column: u32) -> TileId {
        TileId { level: 0, row: 0, column }
    }

    fn path(columns: &[&[u32]]) -> Vec<FrameLists> {
        let lists: Vec<Vec<TileId>> =
            columns.iter().map(|list| list.iter().copied().map(tile).collect()).collect();
        steps(&lists, 64, 3)
    }

    fn faults(steps: &[FrameLists], slots: u32, rule: Replacement) -> usize {
        replay(steps, slots, rule).iter().map(|frame| frame.faults).sum()
    }

    #[test]
    fn the_rules_differ_as_in_the_textbook() {
        // Worked out by hand for three slots and one tile per frame. FIFO evicts tile 0, although every second frame
        // uses it.
        let steps = path(&[&[0], &[1], &[0], &[2], &[0], &[3], &[0], &[1], &[0], &[2]]);
        assert_eq!(faults(&steps, 3, Replacement::Optimum), 5);
        assert_eq!(faults(&steps, 3, Replacement::LeastRecent), 6);
        assert_eq!(faults(&steps, 3, Replacement::FirstIn), 7);
    }

    /// The least number of faults, by exhaustive search.
    fn min(steps: &[FrameLists], slots: usize, held: &HashSet<TileId>) -> usize {
        let Some((step, rest)) = steps.split_first() else { return 0 };
        let wanted: HashSet<TileId> = step.wanted.iter().copied().collect();
        let missing = wanted.difference(held).count();
        let others: Vec<TileId> = held.difference(&wanted).copied().collect();
        let room = slots - wanted.len();
        let fewest = (0u32..1 << others.len())
            .filter(|kept| kept.count_ones() as usize <= room)
            .map(|kept| {
                let mut next = wanted.clone();
                next.extend((0..others.len()).filter(|n| kept >> n & 1 == 1).map(|n| others[n]));
                min(rest, slots, &next)
            })
            .min();
        missing + fewest.expect("keeping no tile is always possible")
    }

    fn small_path() -> impl Strategy<Value = Vec<FrameLists>> {
        let list = prop::collection::btree_set(0u32..6, 0..3);
        prop::collection::vec(list, 0..7).prop_map(|lists| {
            let lists: Vec<Vec<u32>> = lists.into_iter().map(|list| list.into_iter().collect()).collect();
            path(&lists.iter().map(Vec::as_slice).collect::<Vec<_>>())
        })
    }

    proptest! {
        #[test]
        fn exhaustive_search_finds_no_fewer_faults_than_the_optimum(steps in small_path(), slots in 2u32..5) {
            prop_assert_eq!(
                faults(&steps, slots, Replacement::Optimum),
                min(&steps, slots as usize, &HashSet::new())
            );
        }

        #[test]
        fn no_policy_has_fewer_faults_than_the_optimum_or_more_than_all_lookups(
            lists in prop::collection::vec(prop::collection::vec(0u32..12, 0..6), 0..30), slots in 1u32..12,
        ) {
            let lists: Vec<Vec<TileId>> =
                lists.iter().map(|list| list.iter().map(|&column| tile(column)).collect()).collect();
            let steps = steps(&lists, slots, 3);
            let wanted: usize = steps.iter().map(|step| step.wanted.len()).sum();
            let best = faults(&steps, slots, Replacement::Optimum);
            for rule in Replacement::ALL {
                let faults = faults(&steps, slots, rule);
                prop_assert!((best..=wanted).contains(&faults), "{rule:?}: {faults}, the optimum {best} of {wanted}");
            }
        }
    }
}

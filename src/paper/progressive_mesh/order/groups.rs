//! Group ends: the levels that carry tswaps (paper 2, section 5). The paper does not say how groups are
//! chosen.

use crate::paper::progressive_mesh::simplify::Collapses;

/// How the splits are divided into groups.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Groups {
    /// This many groups, with the same number of splits each.
    Uniform(u32),
    /// Each group multiplies the number of faces by the same ratio, which is at most this number. The number must be
    /// above 1.
    Geometric(f64),
    /// Groups of equal ratio, as many as this budget allows. The budget is a number of moved faces per split, counted
    /// as if all live faces moved at every group's end.
    Budget(f64),
    /// As [`Groups::Budget`], but the first group may have a smaller ratio than the others, so that the ratio need not
    /// divide the growth of the whole mesh. The budget is then used up, instead of 96 to 99 % of it, and the ratio of
    /// the other groups is as small as the budget allows.
    WholeBudget(f64),
}

impl Groups {
    /// An upper bound on the faces that change their slot over all levels, from `base` faces to `faces`.
    pub fn moved_faces(self, base: usize, faces: usize) -> f64 {
        let (base, faces) = (base.min(faces) as f64, faces as f64);
        // Each split adds at least one face and is followed by at most one permutation of all live faces.
        let all = 0.5 * (faces - base) * (faces + base);
        match self {
            Groups::Uniform(count) => (0.5 * f64::from(count) * (faces + base) + 0.5 * faces).min(all),
            Groups::Geometric(ratio) => {
                let growth = (faces / base.max(1.0)).ln();
                let count = (growth / ratio.ln()).ceil().max(1.0);
                // A geometric sum; each group ends with at most one face too many.
                (faces / (1.0 - (-growth / count).exp()) + count).min(all)
            }
            Groups::Budget(moves) | Groups::WholeBudget(moves) => (moves * (faces - base)).min(all),
        }
    }
}

/// Bisection steps for the ratio: its logarithm is found to a millionth of the growth.
const HALVINGS: usize = 20;

/// The levels at which groups end, ascending. The last of these levels is the full mesh. Empty if there are no splits.
///
/// # Panics
/// If the parameter is invalid: no groups, a ratio not above 1, or a budget that is not positive.
pub(super) fn group_ends(groups: Groups, collapses: &Collapses, faces: usize) -> Vec<u32> {
    let last = collapses.faces.len();
    if last == 0 {
        return Vec::new();
    }
    let base = faces - collapses.faces.items().len();
    // If every component vanishes, the base has no faces and no ratio exists. The ratio is then computed as if the base
    // had one face.
    let growth = (faces as f64 / base.max(1) as f64).ln();
    let mut ends = match groups {
        Groups::Uniform(count) => {
            assert!(count > 0, "the number of groups is 0");
            // More groups than splits: one group per split.
            let count = u64::from(count).min(last as u64);
            (1..=count).map(|n| (n * last as u64 / count) as u32).collect()
        }
        Groups::Geometric(ratio) => {
            assert!(ratio > 1.0, "each group multiplies the faces by {ratio}, which is not above 1");
            // Above this count the last groups grow by less than a face: each split is a group already.
            let max = (faces as f64 * growth).max(1.0);
            geometric(collapses, base, (growth / ratio.ln()).clamp(1.0, max).ceil() as u32, growth)
        }
        Groups::Budget(moves) => {
            assert!(moves > 0.0, "a budget of {moves} moved faces per split");
            let moved = |count: u32| {
                let ends =
                    (1..=count).map(|n| base as f64 * (growth * f64::from(n) / f64::from(count)).exp());
                ends.sum::<f64>() / last as f64
            };
            let mut count = 1;
            while (count as usize) < last && moved(count + 1) <= moves {
                count += 1;
            }
            geometric(collapses, base, count, growth)
        }
        Groups::WholeBudget(moves) => {
            assert!(moves > 0.0, "a budget of {moves} moved faces per split");
            smallest_ratio(collapses, base, growth, moves)
        }
    };
    ends.retain(|&end| end > 0);
    ends.dedup();
    ends
}

/// `count` groups of equal ratio. Each group ends at the first level that reaches the group's number of faces.
fn geometric(collapses: &Collapses, base: usize, count: u32, growth: f64) -> Vec<u32> {
    let last = collapses.faces.len();
    let (mut level, mut faces) = (0, base);
    let mut ends = Vec::new();
    for n in 1..=count {
        let wanted = base.max(1) as f64 * (growth * f64::from(n) / f64::from(count)).exp();
        // Half a face of slack, because the power is not exact.
        while level < last && (n == count || faces as f64 + 0.5 < wanted) {
            level += 1;
            faces += collapses.faces.row(last - level).len();
        }
        ends.push(level as u32);
    }
    ends
}

/// Groups of the smallest ratio at which `moves` faces per split suffice, if all live faces move at every group's end.
/// The last group ends with the full mesh, and the first group has the rest of the growth.
fn smallest_ratio(collapses: &Collapses, base: usize, growth: f64, moves: f64) -> Vec<u32> {
    let last = collapses.faces.len();
    let mut faces_at = vec![base];
    faces_at.extend((1..=last).map(|level| collapses.faces.row(last - level).len()));
    (1..=last).for_each(|level| faces_at[level] += faces_at[level - 1]);
    let max = moves * last as f64;
    // The last level of each group, finest first, until the budget is spent.
    let ends = |log_ratio: f64| {
        let (mut ends, mut moved) = (Vec::new(), 0.0);
        for n in 0.. {
            let wanted = faces_at[last] as f64 * (-log_ratio * f64::from(n)).exp();
            let level = faces_at.partition_point(|&faces| faces as f64 <= wanted).saturating_sub(1);
            if ends.last() == Some(&(level as u32)) {
                continue;
            }
            moved += faces_at[level] as f64;
            if level == 0 || moved > max {
                break;
            }
            ends.push(level as u32);
        }
        (ends, moved <= max)
    };
    let (mut too_small, mut enough) = (0.0, growth);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (too_small + enough);
        if ends(middle).1 { enough = middle } else { too_small = middle }
    }
    let mut ends = ends(enough).0;
    // At least one group: every order ends with the full mesh.
    if ends.is_empty() {
        ends.push(last as u32);
    }
    ends.reverse();
    ends
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::ragged::Ragged;

    fn pairs(count: u32) -> Collapses {
        let faces: Ragged<u32> = (0..count).map(|n| [2 * n, 2 * n + 1]).collect();
        Collapses { faces, ..Collapses::default() }
    }

    #[test]
    fn groups_end_at_equal_steps_or_equal_ratios() {
        let collapses = pairs(150);
        assert_eq!(group_ends(Groups::Uniform(3), &collapses, 400), [50, 100, 150]);
        // 100, 200 and 400 faces.
        assert_eq!(group_ends(Groups::Geometric(2.0), &collapses, 400), [50, 150]);
        assert_eq!(group_ends(Groups::Geometric(9.0), &collapses, 400), [150]);
        assert_eq!(group_ends(Groups::Uniform(900), &collapses, 400).len(), 150);
        assert_eq!(group_ends(Groups::Geometric(1.1), &pairs(0), 400), [0; 0]);
    }

    #[test]
    fn more_groups_than_splits_are_one_for_each_split() {
        let all: Vec<u32> = (1..=150).collect();
        assert_eq!(group_ends(Groups::Uniform(u32::MAX), &pairs(150), 400), all);
        assert_eq!(group_ends(Groups::Geometric(1.0 + 1e-15), &pairs(150), 400), all);
    }

    #[test]
    fn moved_faces_are_known_from_above() {
        let collapses = pairs(5000);
        for groups in [
            Groups::Uniform(64),
            Groups::Uniform(u32::MAX),
            Groups::Geometric(1.1),
            Groups::Geometric(1.0 + 1e-15),
            Groups::Budget(23.0),
            Groups::Budget(1e300),
            Groups::WholeBudget(23.0),
            Groups::WholeBudget(1e300),
        ] {
            let max = groups.moved_faces(64, 10_064);
            let moved: f64 =
                group_ends(groups, &collapses, 10_064).iter().map(|end| f64::from(64 + 2 * end)).sum();
            assert!((0.15 * max..=max).contains(&moved), "{groups:?}: {moved} of {max}");
        }
    }

    #[test]
    fn a_budget_is_not_exceeded_even_if_every_face_moves() {
        for moves in [4.0, 10.0, 23.0] {
            let collapses = pairs(5000);
            let ends = group_ends(Groups::Budget(moves), &collapses, 10_064);
            let moved: u32 = ends.iter().map(|end| 64 + 2 * end).sum();
            let each = f64::from(moved) / 5000.0;
            assert!(each < moves * 1.01 && each > 0.8 * moves, "{each} of {moves}");
        }
    }

    #[test]
    fn a_whole_budget_is_used_up_by_groups_of_equal_ratio() {
        for (moves, splits) in [(4.0, 5000), (10.0, 5000), (10.0, 5150), (10.0, 1800), (23.0, 5000)] {
            let collapses = pairs(splits);
            let ends = group_ends(Groups::WholeBudget(moves), &collapses, 64 + 2 * splits as usize);
            let faces: Vec<f64> = ends.iter().map(|end| f64::from(64 + 2 * end)).collect();
            let each = faces.iter().sum::<f64>() / f64::from(splits);
            // A smaller ratio would need one more group, and so at least 64 more moved faces.
            let min = moves - 2.0 * 64.0 / f64::from(splits);
            assert!((min..=moves).contains(&each), "{each} of {moves} for {splits} splits");
            assert_eq!(ends.last(), Some(&splits));
            let ratios: Vec<f64> = faces.windows(2).map(|pair| pair[1] / pair[0]).collect();
            // A group's faces are even numbers; the smallest group has at least 64.
            let whole = ratios[ratios.len() - 1];
            assert!(ratios.iter().all(|ratio| (ratio / whole - 1.0).abs() < 4.0 / 64.0), "{ratios:?}");
        }
        assert_eq!(group_ends(Groups::WholeBudget(0.1), &pairs(150), 400), [150]);
    }
}

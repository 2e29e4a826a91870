//! The better of several orders of a group's faces: rollouts, and rings around vertices.
//!
//! Neither method is always better. On regular meshes, orders in rings need up to 0.04 fewer transforms per vertex in a
//! FIFO than rollouts, and up to 0.1 more in batches. On scans and near the features of solids, they need more in both.
//! The best order is the one with the least sum of [`FIFO_WEIGHT`] times the FIFO's transforms and those in batches of
//! 32 vertices and 32 triangles. The transforms of two levels are added: a quarter and three quarters of the way
//! through the group.

use crate::paper::progressive_mesh::cache::{Cache, Counter};

/// A transform in the FIFO counts as much as this many in batches. Selected by the FIFO alone, orders of the closed
/// models need 0.006 (in-place-23) and 0.009 (in-place-10) fewer transforms per vertex in the FIFO, but 0.03 and 0.04
/// more in batches.
pub(super) const FIFO_WEIGHT: i64 = 2;

/// A group's faces at some of its levels.
pub(super) struct Levels {
    /// The faces' corners at each level.
    pub corners: [Vec<[u32; 3]>; 2],
    /// All corners are below this.
    pub vertices: usize,
    /// Entries of the FIFO.
    pub entries: u32,
}

/// The best of `orders`; on a tie, the first.
///
/// # Panics
/// Without orders.
pub(super) fn best(levels: &Levels, orders: impl IntoIterator<Item = Vec<u32>>) -> Vec<u32> {
    let mut fifo = Counter::new(Cache::Fifo(levels.entries), levels.vertices);
    let mut batches = Counter::new(Cache::Batches, levels.vertices);
    let mut cost = |order: &Vec<u32>| -> i64 {
        let of_level = |corners: &Vec<[u32; 3]>| {
            let faces = || order.iter().map(|&face| corners[face as usize]);
            FIFO_WEIGHT * fifo.count(faces()).transforms as i64 + batches.count(faces()).transforms as i64
        };
        levels.corners.iter().map(of_level).sum()
    };
    orders.into_iter().min_by_key(|order| cost(order)).expect("there are orders")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::named;
    use crate::paper::progressive_mesh::cache::transforms;
    use crate::paper::progressive_mesh::order::rings::Rings;
    use crate::paper::progressive_mesh::order::rollout::{Simulated, rollouts};

    /// Twice a mesh, an order by rollouts, and the orders in rings.
    fn orders(name: &str) -> (Levels, Vec<Vec<u32>>) {
        let model = named(name).expect("a model");
        let faces: Vec<[u32; 3]> = (0..model.faces.len()).map(|face| model.face_positions(face)).collect();
        let vertices = model.positions.len();
        let fifo = Simulated { entries: 15, triangles: None, look_back: None };
        let rings = Rings::new(&faces, vertices, 15);
        let rings = rings.orders().map(|(order, _)| order);
        let orders = [rollouts(&faces, vertices, fifo)].into_iter().chain(rings).collect();
        (Levels { corners: [faces.clone(), faces], vertices, entries: 16 }, orders)
    }

    fn costs(levels: &Levels, order: &[u32]) -> [i64; 2] {
        let drawn: Vec<[u32; 3]> = order.iter().map(|&face| levels.corners[0][face as usize]).collect();
        [Cache::Fifo(16), Cache::Batches].map(|cache| transforms(cache, &drawn).transforms as i64)
    }

    #[test]
    fn rings_win_on_a_sphere_and_rollouts_on_solids_and_scans() {
        for (name, rings_win) in [("sphere", true), ("solid", false), ("bunny", false)] {
            let (levels, orders) = orders(name);
            let found = best(&levels, orders.clone());
            assert_eq!(found != orders[0], rings_win, "{name}");
            let sum = |order: &Vec<u32>| {
                let [fifo, batches] = costs(&levels, order);
                2 * fifo + batches
            };
            assert_eq!(sum(&found), orders.iter().map(sum).min().expect("orders"), "{name}");
        }
    }

    #[test]
    fn a_small_saving_in_the_fifo_does_not_pay_for_worse_batches() {
        for name in ["sphere", "solid"] {
            let (levels, orders) = orders(name);
            let lean = orders.iter().min_by_key(|order| costs(&levels, order)[0]).expect("orders").clone();
            let [lean_costs, found] =
                [costs(&levels, &lean), costs(&levels, &best(&levels, orders.into_iter().chain([lean])))];
            assert!(
                lean_costs[0] < found[0] && lean_costs[1] > found[1],
                "{name}: {lean_costs:?}, {found:?}"
            );
        }
    }

    #[test]
    fn on_a_tie_the_first_order_wins() {
        let corners = vec![[0, 1, 2], [3, 4, 5]];
        let levels = Levels { corners: [corners.clone(), corners], vertices: 6, entries: 16 };
        for order in [vec![0, 1], vec![1, 0]] {
            let other = order.iter().rev().copied().collect();
            assert_eq!(best(&levels, [order.clone(), other]), order);
        }
    }
}

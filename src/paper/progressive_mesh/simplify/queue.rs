//! A priority queue of positions whose keys change.

use crate::math::splitmix::SplitMix64;

/// Positions by key, smallest first; equal keys are ordered by [`Ties`]. An indexed heap with four children
/// per node, because four children fit into one or two CPU cache lines.
pub struct Queue {
    ties: Ties,
    heap: Vec<Entry>,
    /// The index of each position in the heap, or [`OUT`].
    places: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Entry {
    key: f64,
    /// (rank, position)
    tie: (u32, u32),
}

/// Breaks ties: with seed 0 the lower position comes first, with any other seed a random one.
#[derive(Clone, Copy)]
pub struct Ties {
    pub seed: u64,
}

impl Ties {
    /// Sort key, least first.
    pub fn rank(self, position: u32) -> (u32, u32) {
        let lot = if self.seed == 0 { 0 } else { SplitMix64::nth(self.seed, u64::from(position)) as u32 };
        (lot, position)
    }
}

const OUT: u32 = u32::MAX;

const CHILDREN: usize = 4;

impl Entry {
    fn is_before(self, other: Entry) -> bool {
        self.key < other.key || (self.key == other.key && self.tie < other.tie)
    }
}

impl Queue {
    /// Empty, for positions below `count`.
    pub fn new(count: usize, ties: Ties) -> Queue {
        Queue { ties, heap: Vec::with_capacity(count), places: vec![OUT; count] }
    }

    fn put(&mut self, place: usize, entry: Entry) {
        self.heap[place] = entry;
        self.places[entry.tie.1 as usize] = place as u32;
    }

    fn up(&mut self, mut place: usize, entry: Entry) {
        while place > 0 {
            let parent = (place - 1) / CHILDREN;
            if !entry.is_before(self.heap[parent]) {
                break;
            }
            self.put(place, self.heap[parent]);
            place = parent;
        }
        self.put(place, entry);
    }

    fn down(&mut self, mut place: usize, entry: Entry) {
        loop {
            let start = CHILDREN * place + 1;
            let children = &self.heap[start.min(self.heap.len())..self.heap.len().min(start + CHILDREN)];
            let [first, rest @ ..] = children else { break };
            let (mut child, mut min) = (start, *first);
            for (index, &other) in rest.iter().enumerate() {
                if other.is_before(min) {
                    (child, min) = (start + 1 + index, other);
                }
            }
            if !min.is_before(entry) {
                break;
            }
            self.put(place, min);
            place = child;
        }
        self.put(place, entry);
    }

    /// Inserts a position, or changes its key.
    pub fn set(&mut self, position: u32, key: f64) {
        assert!(!key.is_nan(), "the key of position {position} is NaN");
        let (entry, place) = (Entry { key, tie: self.ties.rank(position) }, self.places[position as usize]);
        if place == OUT {
            self.heap.push(entry);
            self.up(self.heap.len() - 1, entry);
        } else if key < self.heap[place as usize].key {
            self.up(place as usize, entry);
        } else {
            self.down(place as usize, entry);
        }
    }

    /// Removes a position if it is present.
    pub fn remove(&mut self, position: u32) {
        let place = std::mem::replace(&mut self.places[position as usize], OUT);
        if place == OUT {
            return;
        }
        let last = self.heap.pop().expect("a position with a place is in the heap");
        if last.tie.1 != position {
            let place = place as usize;
            if place > 0 && last.is_before(self.heap[(place - 1) / CHILDREN]) {
                self.up(place, last);
            } else {
                self.down(place, last);
            }
        }
    }

    /// Removes and returns the position with the least key.
    pub fn pop(&mut self) -> Option<u32> {
        let first = self.heap.first()?.tie.1;
        self.remove(first);
        Some(first)
    }

    /// The least key.
    pub fn min_key(&self) -> Option<f64> {
        self.heap.first().map(|entry| entry.key)
    }

    /// The key of a position, if it is present.
    pub fn key(&self, position: u32) -> Option<f64> {
        let place = self.places[position as usize];
        (place != OUT).then(|| self.heap[place as usize].key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_come_in_the_order_of_their_last_keys_without_removed_ones() {
        let mut queue = Queue::new(1000, Ties { seed: 0 });
        let key = |n: u32, round: u32| f64::from((n * 7919 + round * 104_729) % 257);
        for round in 0..3 {
            (0..1000).for_each(|n| queue.set(n, key(n, round)));
        }
        (0..1000).step_by(3).for_each(|n| queue.remove(n));
        let mut expected: Vec<u32> = (0..1000).filter(|n| n % 3 != 0).collect();
        expected.sort_by(|&a, &b| key(a, 2).total_cmp(&key(b, 2)).then(a.cmp(&b)));
        assert_eq!(queue.min_key(), Some(key(expected[0], 2)));
        assert_eq!((queue.key(0), queue.key(1)), (None, Some(key(1, 2))));
        assert_eq!(std::iter::from_fn(|| queue.pop()).collect::<Vec<_>>(), expected);
        assert!(queue.key(1).is_none() && queue.min_key().is_none());
    }
}

//! A priority queue of positions whose keys change.

/// Positions in the order of their keys, least first; equal keys in the order of the positions. A binary heap that
/// knows where each position stands in it.
pub struct Queue {
    heap: Vec<u32>,
    keys: Vec<f64>,
    /// Where each position stands in the heap, [`OUT`] if it does not.
    places: Vec<u32>,
}

const OUT: u32 = u32::MAX;

impl Queue {
    /// Empty, for positions below `count`.
    pub fn new(count: usize) -> Queue {
        Queue { heap: Vec::with_capacity(count), keys: vec![0.0; count], places: vec![OUT; count] }
    }

    fn before(&self, a: u32, b: u32) -> bool {
        let (key_a, key_b) = (self.keys[a as usize], self.keys[b as usize]);
        key_a < key_b || (key_a == key_b && a < b)
    }

    fn put(&mut self, place: usize, position: u32) {
        self.heap[place] = position;
        self.places[position as usize] = place as u32;
    }

    fn up(&mut self, mut place: usize, position: u32) {
        while place > 0 {
            let parent = (place - 1) / 2;
            if !self.before(position, self.heap[parent]) {
                break;
            }
            self.put(place, self.heap[parent]);
            place = parent;
        }
        self.put(place, position);
    }

    fn down(&mut self, mut place: usize, position: u32) {
        loop {
            let mut child = 2 * place + 1;
            if child >= self.heap.len() {
                break;
            }
            if child + 1 < self.heap.len() && self.before(self.heap[child + 1], self.heap[child]) {
                child += 1;
            }
            if !self.before(self.heap[child], position) {
                break;
            }
            self.put(place, self.heap[child]);
            place = child;
        }
        self.put(place, position);
    }

    /// Puts a position in, or gives it another key.
    pub fn set(&mut self, position: u32, key: f64) {
        assert!(!key.is_nan(), "the key of position {position} is no number");
        let place = self.places[position as usize];
        let old = std::mem::replace(&mut self.keys[position as usize], key);
        if place == OUT {
            self.heap.push(position);
            self.up(self.heap.len() - 1, position);
        } else if key < old {
            self.up(place as usize, position);
        } else {
            self.down(place as usize, position);
        }
    }

    /// Takes a position out, if it is in.
    pub fn remove(&mut self, position: u32) {
        let place = std::mem::replace(&mut self.places[position as usize], OUT);
        if place == OUT {
            return;
        }
        let last = self.heap.pop().expect("a position with a place is in the heap");
        if last != position {
            let place = place as usize;
            if place > 0 && self.before(last, self.heap[(place - 1) / 2]) {
                self.up(place, last);
            } else {
                self.down(place, last);
            }
        }
    }

    /// The position with the least key, taken out.
    pub fn pop(&mut self) -> Option<u32> {
        let first = *self.heap.first()?;
        self.remove(first);
        Some(first)
    }

    /// The least key.
    pub fn least_key(&self) -> Option<f64> {
        self.heap.first().map(|&position| self.keys[position as usize])
    }

    /// Whether the position is in.
    pub fn contains(&self, position: u32) -> bool {
        self.places[position as usize] != OUT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_come_in_the_order_of_their_last_keys_and_removed_ones_do_not() {
        let mut queue = Queue::new(1000);
        let key = |n: u32, round: u32| f64::from((n * 7919 + round * 104_729) % 257);
        for round in 0..3 {
            (0..1000).for_each(|n| queue.set(n, key(n, round)));
        }
        (0..1000).step_by(3).for_each(|n| queue.remove(n));
        let mut expected: Vec<u32> = (0..1000).filter(|n| n % 3 != 0).collect();
        expected.sort_by(|&a, &b| key(a, 2).total_cmp(&key(b, 2)).then(a.cmp(&b)));
        assert_eq!(queue.least_key(), Some(key(expected[0], 2)));
        assert_eq!(std::iter::from_fn(|| queue.pop()).collect::<Vec<_>>(), expected);
        assert!(!queue.contains(1) && queue.least_key().is_none());
    }
}

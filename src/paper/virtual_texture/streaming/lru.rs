//! Least recently used order, as a doubly linked list in an array of slots. Paper 1, section 3: "the pair with the
//! least t gives up its slot". The list is in order of t, so each operation takes constant time; the paper's priority
//! queue takes log N.

const NONE: u32 = u32::MAX;

#[derive(Clone, Copy)]
struct Link {
    older: u32,
    newer: u32,
    /// The paper's t, the time of the last use; valid while `listed`.
    last_use: u64,
    listed: bool,
}

/// Slots `0 .. capacity` in order of their last use. A free or pinned slot is outside the list, and [`Lru::oldest`]
/// never returns it.
pub struct Lru {
    links: Vec<Link>,
    oldest: u32,
    newest: u32,
}

impl Lru {
    /// All slots are outside the list.
    pub fn new(capacity: u32) -> Self {
        let link = Link { older: NONE, newer: NONE, last_use: 0, listed: false };
        Self { links: vec![link; capacity as usize], oldest: NONE, newest: NONE }
    }

    /// Makes `slot` the most recently used and adds it to the list if needed. `last_use` must be at least that of every
    /// listed slot.
    pub fn touch(&mut self, slot: u32, last_use: u64) {
        self.remove(slot);
        if self.newest != NONE {
            let latest = self.links[self.newest as usize].last_use;
            assert!(last_use >= latest, "slot {slot} used at {last_use}, before the latest use {latest}");
            self.links[self.newest as usize].newer = slot;
        } else {
            self.oldest = slot;
        }
        self.links[slot as usize] = Link { older: self.newest, newer: NONE, last_use, listed: true };
        self.newest = slot;
    }

    /// Takes `slot` out of the list, if it is in it.
    pub fn remove(&mut self, slot: u32) {
        let link = self.links[slot as usize];
        if !link.listed {
            return;
        }
        match link.older {
            NONE => self.oldest = link.newer,
            older => self.links[older as usize].newer = link.newer,
        }
        match link.newer {
            NONE => self.newest = link.older,
            newer => self.links[newer as usize].older = link.older,
        }
        self.links[slot as usize].listed = false;
    }

    /// The listed slots, the least recently used first.
    pub fn in_order(&self) -> impl Iterator<Item = u32> {
        let listed = |slot: u32| (slot != NONE).then_some(slot);
        std::iter::successors(listed(self.oldest), move |slot| listed(self.links[*slot as usize].newer))
    }

    /// When `slot` was last used; `None` if it is outside the list.
    pub fn last_use(&self, slot: u32) -> Option<u64> {
        let link = self.links[slot as usize];
        link.listed.then_some(link.last_use)
    }

    /// The least recently used slot, and when it was last used.
    pub fn oldest(&self) -> Option<(u32, u64)> {
        (self.oldest != NONE).then(|| (self.oldest, self.links[self.oldest as usize].last_use))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn drain(mut list: Lru) -> Vec<u32> {
        let mut order = Vec::new();
        while let Some((slot, _)) = list.oldest() {
            order.push(slot);
            list.remove(slot);
        }
        order
    }

    #[test]
    fn the_least_recently_used_slot_comes_first() {
        let mut list = Lru::new(4);
        for (time, slot) in [0, 1, 2, 0].into_iter().enumerate() {
            list.touch(slot, time as u64);
        }
        assert_eq!(list.oldest(), Some((1, 1)));
        assert_eq!([1, 3].map(|slot| list.last_use(slot)), [Some(1), None]);
        assert_eq!(list.in_order().collect::<Vec<_>>(), [1, 2, 0]);
        assert_eq!(drain(list), [1, 2, 0]);
    }

    #[test]
    fn an_empty_list_has_no_oldest() {
        let mut list = Lru::new(1);
        assert_eq!(list.oldest(), None);
        list.touch(0, 5);
        list.remove(0);
        assert_eq!(list.oldest(), None);
    }

    #[test]
    #[should_panic(expected = "before the latest use 9")]
    fn time_does_not_run_backwards() {
        let mut list = Lru::new(2);
        list.touch(0, 9);
        list.touch(1, 8);
    }

    proptest! {
        /// Compares with the crate `lru`, which keeps keys in a hash map.
        #[test]
        fn the_order_is_that_of_the_crate_lru(
            steps in prop::collection::vec((0u32..8, prop::bool::weighted(0.25)), 0..200),
        ) {
            let mut list = Lru::new(8);
            let mut model = lru::LruCache::unbounded();
            for (time, (slot, remove)) in steps.into_iter().enumerate() {
                if remove {
                    list.remove(slot);
                    model.pop(&slot);
                } else {
                    list.touch(slot, time as u64);
                    model.put(slot, time as u64);
                }
                prop_assert_eq!(list.oldest(), model.peek_lru().map(|(slot, time)| (*slot, *time)));
            }
            let newest_first: Vec<u32> = model.iter().map(|(slot, _)| *slot).collect();
            let mut order = drain(list);
            order.reverse();
            prop_assert_eq!(order, newest_first);
        }
    }
}

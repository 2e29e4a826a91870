//! Least recently used order, as a doubly linked list in an array of slots. Paper 1, section 3: "the pair with the
//! least t gives up its slot". The list is sorted by t, so each operation takes constant time. The exception is a use
//! whose t is earlier than the latest t in the list: it must pass all later uses. The paper's priority queue takes log
//! N.

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

    /// Sets the time of use of `slot` and puts it at its position in the list: newer than all slots with the same or
    /// an earlier time.
    pub fn touch(&mut self, slot: u32, last_use: u64) {
        self.remove(slot);
        let (mut older, mut newer) = (self.newest, NONE);
        while older != NONE && self.links[older as usize].last_use > last_use {
            (older, newer) = (self.links[older as usize].older, older);
        }
        match older {
            NONE => self.oldest = slot,
            older => self.links[older as usize].newer = slot,
        }
        match newer {
            NONE => self.newest = slot,
            newer => self.links[newer as usize].older = slot,
        }
        self.links[slot as usize] = Link { older, newer, last_use, listed: true };
    }

    /// Takes `slot` out of the list if the list contains it.
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
    fn an_earlier_use_comes_before_all_later_ones_and_after_equal_ones() {
        let mut list = Lru::new(5);
        for (slot, time) in [(0, 5), (1, 9), (2, 9), (3, 5), (4, 1), (2, 4), (1, 9)] {
            list.touch(slot, time);
        }
        assert_eq!(list.in_order().collect::<Vec<_>>(), [4, 2, 0, 3, 1]);
        assert_eq!(list.oldest(), Some((4, 1)));
        assert_eq!(drain(list), [4, 2, 0, 3, 1]);
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

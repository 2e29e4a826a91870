//! Storage for the records of frames.

/// The number of records that are kept by default: two seconds at 60 frames per second.
pub const HISTORY: usize = 120;

type Tap<R> = Box<dyn FnMut(&R) + Send>;

/// The records of frames, in order: all of them, or the last ones. A tap can pass each record on (to a JSON
/// Lines file, for example).
pub struct Records<R> {
    kept: Vec<R>,
    max: usize,
    tap: Option<Tap<R>>,
}

/// Keeps the last [`HISTORY`] records, so that memory does not grow with the number of frames.
impl<R> Default for Records<R> {
    fn default() -> Records<R> {
        Records::last_ones(HISTORY)
    }
}

impl<R> Records<R> {
    /// Keeps every record.
    pub fn all() -> Records<R> {
        Records::last_ones(usize::MAX)
    }

    /// Keeps the last `max` records.
    pub fn last_ones(max: usize) -> Records<R> {
        Records { kept: Vec::new(), max, tap: None }
    }

    /// Also passes each record to `tap` when its frame has ended.
    pub fn with_tap(self, tap: impl FnMut(&R) + Send + 'static) -> Records<R> {
        Records { tap: Some(Box::new(tap)), ..self }
    }

    pub(super) fn push(&mut self, record: R) {
        if let Some(tap) = &mut self.tap {
            tap(&record);
        }
        if self.max == 0 {
            return;
        }
        if self.kept.len() == self.max {
            self.kept.remove(0);
        }
        self.kept.push(record);
    }

    /// Removes and returns the kept records.
    pub fn take(&mut self) -> Vec<R> {
        std::mem::take(&mut self.kept)
    }
}

/// The kept records, in frame order.
impl<R> std::ops::Deref for Records<R> {
    type Target = [R];
    fn deref(&self) -> &[R] {
        &self.kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    #[test]
    fn a_ring_keeps_the_last_records_and_the_tap_sees_all() {
        let (sender, receiver) = mpsc::channel();
        let mut records = Records::last_ones(2).with_tap(move |n: &u32| sender.send(*n).unwrap());
        (0..5).for_each(|n| records.push(n));
        assert_eq!(records.iter().copied().collect::<Vec<_>>(), [3, 4]);
        assert_eq!(receiver.try_iter().collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        let mut none = Records::last_ones(0);
        none.push(1);
        assert!(none.is_empty());
        let [mut few, mut all] = [Records::default(), Records::all()];
        for n in 0..=HISTORY {
            few.push(n);
            all.push(n);
        }
        assert_eq!((few.len(), few[0], few.last()), (HISTORY, 1, Some(&HISTORY)));
        assert_eq!((all.len(), all.last(), all[1]), (HISTORY + 1, Some(&HISTORY), 1));
        assert_eq!(all.take().len(), HISTORY + 1);
    }
}

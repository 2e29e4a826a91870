//! Rows of different lengths, stored back to back in one vector.

/// Rows of different lengths, without one allocation for each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ragged<T> {
    /// Row i is `items[ends[i - 1] .. ends[i]]`.
    ends: Vec<u32>,
    items: Vec<T>,
}

impl<T> Default for Ragged<T> {
    fn default() -> Self {
        Self { ends: Vec::new(), items: Vec::new() }
    }
}

impl<T> Ragged<T> {
    /// Appends a row.
    ///
    /// # Panics
    /// If there are 2^32 items or more.
    pub fn push(&mut self, row: impl IntoIterator<Item = T>) {
        self.items.extend(row);
        self.ends.push(u32::try_from(self.items.len()).expect("2^32 items of a ragged table"));
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Row `index`.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, index: usize) -> &[T] {
        &self.items[self.range(index)]
    }

    /// Range of row `index` within [`Self::items`].
    ///
    /// # Panics
    /// If there is no such row.
    pub fn range(&self, index: usize) -> std::ops::Range<usize> {
        let start = if index == 0 { 0 } else { self.ends[index - 1] };
        start as usize..self.ends[index] as usize
    }

    /// All rows in order.
    pub fn rows(&self) -> impl DoubleEndedIterator<Item = &[T]> + ExactSizeIterator {
        (0..self.len()).map(|index| self.row(index))
    }

    /// The items of all rows.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// Bytes of main memory used.
    pub fn bytes(&self) -> usize {
        size_of_val(self.ends.as_slice()) + size_of_val(self.items.as_slice())
    }
}

impl<T, R: IntoIterator<Item = T>> FromIterator<R> for Ragged<T> {
    fn from_iter<I: IntoIterator<Item = R>>(rows: I) -> Self {
        let mut ragged = Ragged::default();
        rows.into_iter().for_each(|row| ragged.push(row));
        ragged
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_returned_unchanged_including_empty_ones() {
        let rows = [vec![], vec![1, 2, 3], vec![], vec![4]];
        let ragged: Ragged<u32> = rows.iter().cloned().collect();
        assert_eq!(ragged.len(), 4);
        assert_eq!(ragged.rows().map(<[u32]>::to_vec).collect::<Vec<_>>(), rows);
        assert_eq!((ragged.items(), ragged.range(1)), ([1, 2, 3, 4].as_slice(), 0..3));
    }
}

//! Rows that can grow, stored in one vector.

/// Rows whose items can be added and removed. Rows are not allocated one by one, so hundreds of thousands of short rows
/// are cheap.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    rows: Vec<Row>,
    items: Vec<u32>,
}

/// Position and capacity of a row within the items.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    start: usize,
    length: u32,
    room: u32,
}

/// Minimum capacity of a row that is moved: a vertex of a triangle mesh has about six faces.
const MIN_ROOM: u32 = 8;

impl Rows {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Appends empty rows up to this number.
    pub fn grow(&mut self, rows: usize) {
        self.rows.resize(rows.max(self.rows.len()), Row::default());
    }

    /// Row `index`.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, index: usize) -> &[u32] {
        let Row { start, length, .. } = self.rows[index];
        &self.items[start..][..length as usize]
    }

    /// Appends an item to row `index`. A row that outgrows its capacity moves, and its old space is never
    /// reused. All old spaces of a row together are smaller than its capacity.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn push(&mut self, index: usize, item: u32) {
        let row = &mut self.rows[index];
        if row.length == row.room {
            let from = std::mem::replace(&mut row.start, self.items.len());
            row.room = MIN_ROOM.max(2 * row.room);
            self.items.extend_from_within(from..from + row.length as usize);
            self.items.resize(row.start + row.room as usize, 0);
        }
        self.items[row.start + row.length as usize] = item;
        row.length += 1;
    }

    /// Removes the items of row `index` that `keep` rejects; the others keep their order.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn retain(&mut self, index: usize, mut keep: impl FnMut(u32) -> bool) {
        let row = &mut self.rows[index];
        let items = &mut self.items[row.start..][..row.length as usize];
        let mut kept = 0;
        for at in 0..items.len() {
            if keep(items[at]) {
                items[kept] = items[at];
                kept += 1;
            }
        }
        row.length = kept as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_grow_and_shrink_independently() {
        let mut rows = Rows::default();
        rows.grow(2);
        let mut wanted = [Vec::new(), Vec::new()];
        for n in 0..100 {
            let row = usize::from(n % 3 == 0);
            rows.push(row, n);
            wanted[row].push(n);
        }
        rows.retain(1, |item| item % 2 == 0);
        wanted[1].retain(|item| item % 2 == 0);
        rows.grow(3);
        rows.push(1, 7);
        wanted[1].push(7);
        assert_eq!([rows.row(0), rows.row(1), rows.row(2)], [&*wanted[0], &*wanted[1], &[]]);
        assert_eq!(rows.len(), 3);
    }
}

//! Weight maps (paper 3, step D). A table holds the weight `exp(-alpha r^2)` by the texel's position in the unit disc.
//!
//! Formula (5) of the thesis computes this position from the Jacobian's entries. The position of formula (5) and the
//! weight of formula (4) are exact only where the Jacobian is diagonal or a similarity. The corrected position is a
//! square root of `V^-1` times the texel's offset. `Axes` of paper 3 selects the printed or the corrected position, as
//! it does for formula (4). Formula (6) is the map's scale. The tables are here because the surfaces of paper 1 use
//! them, too.

/// The index of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapShape {
    /// x and y: `entries` x `entries` values.
    Square,
    /// |x| and |y|: a quarter of the size at the same resolution.
    Quadrant,
    /// r.
    Radial,
    /// r^2: needs no square root (pbrt's table).
    SquaredRadius,
}

/// A table's shape and precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WeightMap {
    pub shape: MapShape,
    /// Entries along each side; a power of two.
    pub entries: u32,
    /// 8 or 16: entries are multiples of 1 / (2^bits - 1).
    pub bits: u32,
    /// Interpolates the two nearest entries, as a sampler of a one-dimensional texture does; otherwise the nearest
    /// entry is taken. Two-dimensional maps always take the nearest entry.
    pub linear: bool,
}

/// The largest r in a weight map. r is the distance from the footprint's centre, 1 on the ellipse. With `edge_weights`,
/// a texel that the ellipse cuts counts even if the texel's centre is outside the ellipse.
pub fn map_reach(edge_weights: bool) -> f64 {
    if edge_weights { 1.5 } else { 1.0 }
}

impl MapShape {
    /// True if the table has one row. Only such tables can be interpolated.
    pub fn is_one_dimensional(self) -> bool {
        matches!(self, MapShape::Radial | MapShape::SquaredRadius)
    }
}

impl WeightMap {
    /// Specialization constants of `weight_map.glsl`.
    pub fn constants(&self, reach: f64) -> [(&'static str, u32); 5] {
        [
            ("MAP", self.shape as u32 + 1),
            ("MAP_ENTRIES", self.entries),
            ("MAP_BITS", self.bits),
            ("MAP_LINEAR", u32::from(self.linear)),
            ("MAP_REACH", (reach as f32).to_bits()),
        ]
    }

    /// The table of `exp(-alpha r^2)` up to r = `reach` (in two-dimensional maps, up to x = y = `reach`), packed into
    /// words from the least significant bits.
    pub fn words(&self, alpha: f32, reach: f64) -> Vec<u32> {
        assert!(matches!(self.bits, 8 | 16), "{} bits", self.bits);
        let (side, alpha) = (f64::from(self.entries), f64::from(alpha));
        let middle = |n: u32| (f64::from(n) + 0.5) / side;
        let rows = if self.shape.is_one_dimensional() { 1 } else { self.entries };
        let square_of = |row: u32, column: u32| match self.shape {
            MapShape::Square => (2.0 * middle(column) - 1.0).powi(2) + (2.0 * middle(row) - 1.0).powi(2),
            MapShape::Quadrant => middle(column).powi(2) + middle(row).powi(2),
            MapShape::Radial => middle(column).powi(2),
            MapShape::SquaredRadius => middle(column),
        };
        let max = f64::from((1u32 << self.bits) - 1);
        let entries: Vec<u32> = (0..rows)
            .flat_map(|row| (0..self.entries).map(move |column| square_of(row, column)))
            .map(|square| ((-alpha * reach * reach * square).exp() * max).round() as u32)
            .collect();
        let each = (32 / self.bits) as usize;
        let packed =
            |of: &[u32]| of.iter().rev().fold(0, |word: u32, entry| word.wrapping_shl(self.bits) | entry);
        entries.chunks(each).map(packed).collect()
    }

    /// Entries read for each weight.
    pub fn entries_read(&self) -> u32 {
        if self.linear { 2 } else { 1 }
    }

    /// Bytes of the table.
    pub fn bytes(&self) -> u32 {
        let rows = if self.shape.is_one_dimensional() { 1 } else { self.entries };
        rows * self.entries * self.bits / 8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_packed_from_the_least_significant_bits() {
        let map = WeightMap { shape: MapShape::SquaredRadius, entries: 4, bits: 8, linear: false };
        let entry = |n: u32| ((-2.0 * (f64::from(n) + 0.5) / 4.0).exp() * 255.0).round() as u32;
        assert_eq!(map.words(2.0, 1.0), [entry(0) | entry(1) << 8 | entry(2) << 16 | entry(3) << 24]);
        let map = WeightMap { bits: 16, ..map };
        assert_eq!(map.words(2.0, 1.0).len() as u32 * 4, map.bytes());
        assert_eq!(map.words(0.0, 1.5), [u32::MAX; 2]);
    }

    #[test]
    fn a_square_map_is_symmetric_and_a_quadrant_is_its_corner() {
        let square =
            WeightMap { shape: MapShape::Square, entries: 8, bits: 16, linear: false }.words(3.0, 1.0);
        let quadrant =
            WeightMap { shape: MapShape::Quadrant, entries: 4, bits: 16, linear: false }.words(3.0, 1.0);
        let entry = |words: &[u32], n: usize| words[n / 2] >> (16 * (n % 2)) & 0xffff;
        for row in 0..4 {
            for column in 0..4 {
                let corner = entry(&quadrant, row * 4 + column);
                assert_eq!(entry(&square, (4 + row) * 8 + 4 + column), corner);
                assert_eq!(entry(&square, (3 - row) * 8 + 3 - column), corner);
            }
        }
    }
}

//! Points of a new face, from which those that are near a triangle are dropped several at a time.

use super::triangle::DistanceTriangle;
use glam::DVec3;

/// Upper limit of the points of a lattice.
const MAX_POINTS: usize = 80;

/// Points of a face, a column for each coordinate, so that the compiler computes several distances at a time.
pub struct Lattice {
    columns: [[f64; MAX_POINTS]; 3],
    count: usize,
    /// Bounds of the points' squared distances from a triangle.
    bounds: [f64; MAX_POINTS],
}

impl Default for Lattice {
    fn default() -> Self {
        Lattice { columns: [[0.0; MAX_POINTS]; 3], count: 0, bounds: [0.0; MAX_POINTS] }
    }
}

impl Lattice {
    /// Sets the points to those of a triangle whose sides are divided into `parts`, without its corners and the side
    /// from `a` to `b`.
    pub fn fill(&mut self, [to, a, b]: [DVec3; 3], parts: u32) {
        let part = |count: u32| f64::from(count) / f64::from(parts);
        self.count = 0;
        for i in 0..parts {
            for j in u32::from(i == 0)..parts - i {
                let point = to + (a - to) * part(i) + (b - to) * part(j);
                for (column, coordinate) in self.columns.iter_mut().zip(point.to_array()) {
                    column[self.count] = coordinate;
                }
                self.count += 1;
            }
        }
    }

    /// Takes the last point.
    pub fn pop(&mut self) -> Option<DVec3> {
        self.count = self.count.checked_sub(1)?;
        Some(DVec3::from_array([0, 1, 2].map(|axis| self.columns[axis][self.count])))
    }

    /// Drops the points whose squared distance from a triangle is certainly less than `squared`.
    pub fn drop_within(&mut self, triangle: &DistanceTriangle, squared: f64) {
        if squared == 0.0 || self.count == 0 {
            return;
        }
        let [x, y, z] = &self.columns;
        for (((bound, x), y), z) in self.bounds.iter_mut().zip(x).zip(y).zip(z).take(self.count) {
            *bound = triangle.at_most(DVec3::new(*x, *y, *z));
        }
        let all = std::mem::take(&mut self.count);
        for at in 0..all {
            for column in &mut self.columns {
                column[self.count] = column[at];
            }
            self.count += usize::from(self.bounds[at] >= squared);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::original::{FINE_PARTS, PARTS};
    use super::*;

    /// A lattice over half of a square of side 1, at a height of 0.25.
    fn lattice(parts: u32) -> Lattice {
        let mut lattice = Lattice::default();
        lattice.fill([DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| corner + DVec3::Z * 0.25), parts);
        lattice
    }

    fn all(mut lattice: Lattice) -> Vec<DVec3> {
        std::iter::from_fn(|| lattice.pop()).collect()
    }

    #[test]
    fn a_lattice_has_the_points_between_the_corners_except_those_of_the_last_side() {
        for (parts, count) in [(PARTS, 20), (FINE_PARTS, 77)] {
            let points = all(lattice(parts));
            assert_eq!(points.len(), count);
            assert!(points.iter().all(|p| p.x >= 0.0 && p.y >= 0.0 && p.x + p.y < 1.0 - 1e-9 && p.z == 0.25));
            assert!(points.iter().all(|p| p.x + p.y > 0.0));
        }
    }

    #[test]
    fn points_beyond_a_triangle_stay_and_all_others_are_dropped() {
        let triangle = DistanceTriangle::new([DVec3::ZERO, DVec3::X * 0.5, DVec3::Y]);
        for parts in [PARTS, FINE_PARTS] {
            let (mut points, before) = (lattice(parts), all(lattice(parts)));
            points.drop_within(&triangle, 0.0);
            assert_eq!(points.count, before.len(), "nothing is nearer than 0");
            let squared: f64 = 0.27 * 0.27;
            points.drop_within(&triangle, squared);
            let expected: Vec<DVec3> =
                before.into_iter().filter(|point| triangle.at_most(*point) >= squared).collect();
            assert!(
                !expected.is_empty()
                    && expected.iter().all(|point| triangle.squared_to(*point) > 0.0625 + 1e-6)
            );
            assert_eq!(all(points), expected);
        }
    }
}

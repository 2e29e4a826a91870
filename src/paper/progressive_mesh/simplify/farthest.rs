//! The distance of a new face from the model. It is at most the distance to an old face plus that face's
//! distance from the model. It is also at most the distance to a vanished position, which belongs to the
//! model.
//!
//! Over one old face the distance from its plane is linear, so the maximum lies at the ends of old edges or where old
//! edges cross new ones. Both are measured. A lattice of points is measured too, because each old face adds its own
//! distance.

use super::sequence::Sequence;
use glam::DVec3;

/// Parts into which a new face's sides are divided: the lattice has 20 points. With 6 points, 3 of 155 stated
/// errors were below the measured distance, at worst 0.93 of it.
const PARTS: u32 = 6;

impl Sequence<'_> {
    /// The larger of `most` and the largest measured distance of new face `index` from the model.
    pub(super) fn off_model(&self, index: usize, most: f64) -> f64 {
        let own = self.shape.parent(index);
        let [to, a, b] = self.shape.new[index].1.corners();
        let part = |parts: u32| f64::from(parts) / f64::from(PARTS);
        let mut most = most;
        for i in 0..PARTS {
            for j in u32::from(i == 0)..PARTS - i {
                most = self.raised_off(most, to + (a - to) * part(i) + (b - to) * part(j), own);
            }
        }
        for old in &self.shape.old {
            let [hub, end, _] = old.corners();
            for side in [a, b] {
                if let Some(point) = crossing([to, side], [hub, end]) {
                    most = self.raised_off(most, point, own);
                }
            }
        }
        most
    }

    /// The larger of `most` and a point's distance from the model. The search starts at `own`, the old
    /// triangle that is probably nearest.
    fn raised_off(&self, most: f64, point: DVec3, own: usize) -> f64 {
        let mut least = f64::INFINITY;
        for at in (own..self.shape.old.len()).chain(0..own) {
            let known = self.off_model[self.hub.corners[at].face as usize];
            least = least.min(self.shape.old[at].squared_to(point).sqrt() + known);
            if least <= most {
                return most;
            }
        }
        let points = self.points.iter().map(|near| near.point.distance_squared(point));
        most.max(least.min(points.fold(f64::INFINITY, f64::min).sqrt()))
    }
}

/// The point of the first segment that is nearest to the second, if the nearest points of both lines lie between the
/// ends of their segments.
fn crossing([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> Option<DVec3> {
    let (ab, cd, ca) = (b - a, d - c, a - c);
    let (e, f, g) = (ab.length_squared(), cd.length_squared(), ab.dot(cd));
    let (h, i) = (ab.dot(ca), cd.dot(ca));
    let determinant = e * f - g * g;
    let along = (g * i - f * h) / determinant;
    let other = (e * i - g * h) / determinant;
    let between = |at: f64| at > 0.0 && at < 1.0;
    (between(along) && between(other)).then(|| a + ab * along)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_cross_between_their_ends_or_not_at_all() {
        let other = |x: f64, y: f64| [DVec3::new(x, -1.0, 2.0), DVec3::new(x, y, 2.0)];
        let segment = [DVec3::ZERO, DVec3::X * 4.0];
        assert_eq!(crossing(segment, other(1.0, 3.0)), Some(DVec3::X));
        for (x, y) in [(5.0, 3.0), (-1.0, 3.0), (1.0, -0.5)] {
            assert_eq!(crossing(segment, other(x, y)), None, "{x} {y}");
        }
        assert_eq!(
            crossing(segment, [DVec3::Y, DVec3::Y + DVec3::X]),
            None,
            "parallel segments have no unique nearest point"
        );
    }
}

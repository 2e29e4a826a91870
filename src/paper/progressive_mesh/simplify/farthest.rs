//! The distance of a new face from the model. It is at most the distance to an old face plus that face's distance from
//! the model. It is also at most the distance to any of the model's faces. With one pass, only the distances to
//! vanished positions are measured. With two passes, the distances to the model's faces around the two positions
//! nearest to the point are measured. Without these faces the sum of distances grows with each collapse. Stated errors
//! are then up to 3 times the measured errors on smooth models, and a second pass that orders collapses by stated
//! errors delays the wrong ones. In pm.continuity the Hausdorff distance of two passes is 0.79 times that of one pass;
//! without these faces, with 20 points and a quantile of 0.6, it is 0.91 times that of one pass.
//!
//! Over one old face the distance from its plane is linear, so the maximum lies at the ends of old edges or where old
//! edges cross new ones. Both are measured. A lattice of points is measured too, because each old face adds its own
//! distance.

use super::original::ModelFaces;
use super::sequence::Sequence;
use super::triangle::DistanceTriangle;
use glam::DVec3;

/// Factors on a distance that is only compared, so that rounding never changes the result.
const NARROWER: f64 = 1.0 - 1e-9;
const WIDER: f64 = 1.0 + 1e-9;

impl Sequence<'_> {
    /// The larger of `max` and the largest measured distance of new face `index` from the model. Its sides are
    /// divided into `parts`.
    pub(super) fn off_model(&self, index: usize, max: f64, parts: u32) -> f64 {
        let own = self.shape.parent(index);
        let [to, a, b] = self.shape.new[index].1.corners();
        let part = |count: u32| f64::from(count) / f64::from(parts);
        let mut max = max;
        // First the points that are probably farthest: the others are then only compared with them.
        for old in &self.shape.old {
            let [hub, end, _] = old.corners();
            for side in [a, b] {
                if let Some(point) = crossing([to, side], [hub, end]) {
                    max = self.raised_off(max, point, own);
                }
            }
        }
        for i in 0..parts {
            for j in u32::from(i == 0)..parts - i {
                max = self.raised_off(max, to + (a - to) * part(i) + (b - to) * part(j), own);
            }
        }
        max
    }

    /// The larger of `max` and a point's distance from the model. The search starts at `own`, the old
    /// triangle that is probably nearest.
    fn raised_off(&self, max: f64, point: DVec3, own: usize) -> f64 {
        let (before, after) = self.old_off.split_at(own);
        let (old_before, old_after) = self.shape.old.split_at(own);
        let is_within = |(old, known): (&DistanceTriangle, &f64)| {
            let reach = max * NARROWER - known;
            reach > 0.0 && old.at_most(point) <= reach * reach
        };
        // Most points are nearer than `max`, so their exact distances are not needed.
        if old_after.iter().zip(after).any(is_within) || old_before.iter().zip(before).any(is_within) {
            return max;
        }
        let mut min = f64::INFINITY;
        for (old, known) in old_after.iter().zip(after).chain(old_before.iter().zip(before)) {
            let reach = min * WIDER - known;
            if reach >= 0.0 && !old.is_beyond(point, reach * reach) {
                min = min.min(old.squared_to(point).sqrt() + known);
            }
            if min <= max {
                return max;
            }
        }
        if let Some(faces) = &self.model_faces {
            return self.raised_off_faces(max, point, min, faces);
        }
        let points = self.points.iter().map(|near| near.point.distance_squared(point));
        max.max(min.min(points.fold(f64::INFINITY, f64::min).sqrt()))
    }

    /// The larger of `max` and a point's distance from the model. `min` is an upper bound of this distance.
    fn raised_off_faces(&self, max: f64, point: DVec3, min: f64, faces: &ModelFaces) -> f64 {
        let mut nearest = [(f64::INFINITY, self.hub.position); 2];
        for &(position, at) in &self.model_points {
            let squared = at.distance_squared(point);
            if squared < nearest[0].0 {
                nearest = [(squared, position), nearest[0]];
            } else if squared < nearest[1].0 {
                nearest[1] = (squared, position);
            }
        }
        let mut min = min;
        for triangle in nearest.iter().flat_map(|&(_, position)| faces.around(&self.surface, position)) {
            if !triangle.is_beyond(point, min * min) {
                min = min.min(triangle.squared_to(point).sqrt());
            }
            if min <= max {
                return max;
            }
        }
        max.max(min)
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

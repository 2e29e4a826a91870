//! The distance of a new face from the model. It is at most the distance to an old face plus that face's distance from
//! the model. It is also at most the distance to any of the model's faces. With one pass, only the distances to
//! vanished positions are measured. With two passes, the distances to the model's faces around the two positions
//! nearest to the point are measured, or to such a face of a point measured before. Without these faces the sum of
//! distances grows with each collapse. Stated errors are then up to 3 times the measured errors on smooth models, and a
//! second pass that orders collapses by stated errors delays the wrong ones. In pm.continuity the Hausdorff distance of
//! two passes is 0.79 times that of one pass; without these faces, with 20 points and a quantile of 0.6, it is 0.91
//! times that of one pass.
//!
//! Over one old face the distance from its plane is linear, so the maximum lies at the ends of old edges or where old
//! edges cross new ones. Both are measured. A lattice of points is measured too, because each old face adds its own
//! distance.

use super::sequence::Sequence;
use glam::DVec3;
use std::ops::Range;

/// Factors on a distance that is only compared, so that rounding never changes the result.
const NARROWER: f64 = 1.0 - 1e-9;
const WIDER: f64 = 1.0 + 1e-9;

impl Sequence<'_> {
    /// The larger of `max` and the largest measured distance of new face `index` from the model. Its sides are
    /// divided into `parts`. Stops early once the distance exceeds `limit`.
    pub(super) fn off_model(&mut self, index: usize, max: f64, parts: u32, limit: f64) -> f64 {
        let [to, a, b] = self.shape.new[index].1.corners();
        let mut max = max;
        // First the points that are probably farthest: the others are then only compared with them.
        for old in 0..self.shape.old.len() {
            let [hub, end, _] = self.shape.old[old].corners();
            for side in [a, b] {
                if max <= limit
                    && let Some(point) = crossing([to, side], [hub, end])
                {
                    max = self.raised_off(max, point).0;
                }
            }
        }
        if max > limit {
            return max;
        }
        // Most points are nearer than `max`, so their exact distances are not needed.
        self.lattice.fill([to, a, b], parts);
        let own = self.shape.parent(index);
        for old in (own..self.shape.old.len()).chain(0..own) {
            self.lattice.drop_within(&self.shape.old[old], squared_reach(max, self.old_off[old]));
        }
        while max <= limit
            && let Some(point) = self.lattice.pop()
        {
            let (raised, near) = self.raised_off(max, point);
            max = raised;
            // The next points are probably near the same triangle.
            let (triangle, known) = match near {
                NearTriangle::Old(old) => (&self.shape.old[old], self.old_off[old]),
                NearTriangle::OfModel(face) => (&self.near_faces.triangles[face], 0.0),
            };
            self.lattice.drop_within(triangle, squared_reach(max, known));
        }
        max
    }

    /// The larger of `max` and a point's distance from the model, and a triangle near the point.
    fn raised_off(&mut self, max: f64, point: DVec3) -> (f64, NearTriangle) {
        for (index, (old, &known)) in self.shape.old.iter().zip(&self.old_off).enumerate() {
            if old.at_most(point) < squared_reach(max, known) {
                return (max, NearTriangle::Old(index));
            }
        }
        let nearest = self.nearest_model_faces(point);
        let faces = &self.near_faces.triangles;
        let around = || nearest.iter().flat_map(|row| row.clone());
        let squared = squared_reach(max, 0.0);
        if squared > 0.0
            && let Some(face) = around().find(|face| faces[*face].at_most(point) < squared)
        {
            return (max, NearTriangle::OfModel(face));
        }
        let mut min = (f64::INFINITY, NearTriangle::Old(0));
        for (index, (old, &known)) in self.shape.old.iter().zip(&self.old_off).enumerate() {
            let reach = min.0 * WIDER - known;
            if reach >= 0.0 && !old.is_beyond(point, reach * reach) {
                let distance = old.squared_to(point).sqrt() + known;
                if distance < min.0 {
                    min = (distance, NearTriangle::Old(index));
                }
            }
        }
        for face in around() {
            if !faces[face].is_beyond(point, min.0 * min.0) {
                let distance = faces[face].squared_to(point).sqrt();
                if distance < min.0 {
                    min = (distance, NearTriangle::OfModel(face));
                }
            }
        }
        if self.model_faces.is_none() {
            let points = self.points.iter().map(|near| near.point.distance_squared(point));
            min.0 = min.0.min(points.fold(f64::INFINITY, f64::min).sqrt());
        }
        (max.max(min.0), min.1)
    }

    /// The model's faces around the two of the positions near the hub that are nearest to a point: ranges of
    /// [`Self::near_faces`]. Empty with one pass.
    fn nearest_model_faces(&mut self, point: DVec3) -> [Range<usize>; 2] {
        let Some(faces) = &self.model_faces else { return [0..0, 0..0] };
        let mut nearest = [(f64::INFINITY, 0); 2];
        for (index, (_, at)) in self.model_points.iter().enumerate() {
            let squared = at.distance_squared(point);
            if squared < nearest[0].0 {
                nearest = [(squared, index), nearest[0]];
            } else if squared < nearest[1].0 {
                nearest[1] = (squared, index);
            }
        }
        nearest.map(|(_, index)| {
            let position = self.model_points[index].0;
            self.near_faces.row(index, || faces.around(&self.surface, position))
        })
    }
}

/// The squared distance from a triangle within which no point raises `max`, if the triangle's own distance from the
/// model is `known`.
fn squared_reach(max: f64, known: f64) -> f64 {
    let reach = (max * NARROWER - known).max(0.0);
    reach * reach
}

/// An index of the old triangles, or of the model's triangles in [`Sequence::near_faces`].
enum NearTriangle {
    Old(usize),
    OfModel(usize),
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

//! Faces without area in the plane of texture coordinates: the texture varies in one direction only, or not at all. Such
//! a face shows a texel along an isoline, or everywhere, so the texel's nearest place counts.

use super::lost::squared_to_segment;
use super::triangle::DistanceTriangle;
use glam::{DVec2, DVec3};

/// Coordinates are rounded to f32: to 2^-24 of their size. The sum of four such errors counts as no distance.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;

/// Factor on a squared distance, so that rounding never ends a search on a side.
const WIDER: f64 = 1.0 + 1e-9;

/// The points of a face that show a texel.
pub struct Isoline {
    corners: [DVec3; 3],
    /// How far each corner's coordinates lie from the texel on the line of the face's coordinates.
    along: [f64; 3],
    /// The texel's distance from this line.
    beside: f64,
}

/// How near a side's coordinates come to the texel, and the squared distance in space from the wanted point to the
/// nearest point of the side where they do. A search crosses the side with the lowest pair.
pub type ToSide = (f64, f64);

impl Isoline {
    /// True if a face with these coordinates has no area in their plane.
    pub fn is_flat(coordinates: [DVec2; 3]) -> bool {
        let (from, line) = longest(coordinates);
        let height = |at: DVec2| (at - from).perp_dot(line).abs();
        coordinates.map(height).into_iter().fold(0.0, f64::max) <= rounding(coordinates)
    }

    /// The points that show a texel, of a face without area in the plane.
    pub fn of(corners: [DVec3; 3], coordinates: [DVec2; 3], texel: DVec2) -> Isoline {
        let (from, line) = longest(coordinates);
        let rounding = rounding(coordinates).max(ROUNDING * texel.abs().max_element());
        let snapped = |x: f64| if x.abs() <= rounding { 0.0 } else { x };
        let along = coordinates.map(|at| snapped((at - texel).dot(line)));
        // Where all coordinates are equal, any direction is that of the line.
        let beside = if line == DVec2::ZERO { from.distance(texel) } else { (texel - from).perp_dot(line) };
        Isoline { corners, along, beside: snapped(beside).abs() }
    }

    /// The squared distance from a point to the nearest one that shows the texel; infinite if none does.
    pub fn squared_to(&self, p: DVec3) -> f64 {
        if self.beside > 0.0 {
            return f64::INFINITY;
        }
        if self.along == [0.0; 3] {
            return DistanceTriangle::new(self.corners).squared_to(p);
        }
        let showing = SIDES.map(|side| Some(self.nearest_of_side(side, p)).filter(|(gap, _)| *gap == 0.0));
        let pairs = SIDES.map(|[a, b]| showing[a].zip(showing[b]));
        let squared = |((_, a), (_, b))| squared_to_segment(p, [a, b]);
        pairs.into_iter().flatten().map(squared).fold(f64::INFINITY, f64::min)
    }

    /// How near the side opposite to each corner comes. `None` if a search need not cross the side: the face's own
    /// nearest point, at the squared distance `own` from the wanted one, is nearer than the side's, or the texel lies
    /// beside the line of the coordinates.
    pub fn to_sides(&self, p: DVec3, own: f64) -> [Option<ToSide>; 3] {
        SIDES.map(|side| {
            let (gap, point) = self.nearest_of_side(side, p);
            let squared = point.distance_squared(p);
            let is_nearer = own == f64::INFINITY || (gap == 0.0 && squared <= own * WIDER);
            (self.beside == 0.0 && is_nearer).then_some((gap, squared))
        })
    }

    /// How near a side's coordinates come to the texel, and the nearest point to `p` of those where they do.
    fn nearest_of_side(&self, [a, b]: [usize; 2], p: DVec3) -> (f64, DVec3) {
        let ([from, to], [start, end]) = ([self.corners[a], self.corners[b]], [self.along[a], self.along[b]]);
        if start == end {
            let part = (p - from).dot(to - from) / from.distance_squared(to);
            // A side without length is a point.
            return (start.abs(), from.lerp(to, if part.is_nan() { 0.0 } else { part.clamp(0.0, 1.0) }));
        }
        let part = (start / (start - end)).clamp(0.0, 1.0);
        (if start * end <= 0.0 { 0.0 } else { start.abs().min(end.abs()) }, from.lerp(to, part))
    }
}

/// The side opposite to each corner.
const SIDES: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// The start of the longest side, and its direction; zero if all coordinates are equal.
fn longest(coordinates: [DVec2; 3]) -> (DVec2, DVec2) {
    let sides = SIDES.map(|[a, b]| (coordinates[a], coordinates[b] - coordinates[a]));
    let (from, line) = sides
        .into_iter()
        .max_by(|x, y| x.1.length_squared().total_cmp(&y.1.length_squared()))
        .expect("three sides");
    (from, line.normalize_or_zero())
}

fn rounding(coordinates: [DVec2; 3]) -> f64 {
    ROUNDING * coordinates.iter().map(|at| at.abs().max_element()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coordinates on an oblique line, rounded to f32.
    fn on_line(along: f64) -> DVec2 {
        DVec2::new((0.2 + 0.6 * along) as f32 as f64, (0.9 - 0.8 * along) as f32 as f64)
    }

    #[test]
    fn no_point_of_a_face_that_shows_the_texel_is_nearer_than_the_distance() {
        let corners = [DVec3::ZERO, DVec3::new(3.0, 1.0, 0.0), DVec3::new(1.0, 2.0, 1.0)];
        // A corner, a side, an oblique line through the face, and the whole face.
        for along in [[0.5, 0.0, 1.0], [0.5, 0.5, 1.0], [0.2, 0.9, 0.6], [0.5, 0.5, 0.5]] {
            let coordinates = along.map(on_line);
            assert!(Isoline::is_flat(coordinates));
            let isoline = Isoline::of(corners, coordinates, on_line(0.5));
            for p in
                (0..27).map(|n| DVec3::new(f64::from(n % 3), f64::from(n / 3 % 3), f64::from(n / 9) - 1.0))
            {
                let found = isoline.squared_to(p).sqrt();
                let points =
                    (0..=200).flat_map(|i| (0..=200 - i).map(move |j| [i, j].map(|n| f64::from(n) / 200.0)));
                let shown = points.filter_map(|[v, w]| {
                    let at = |[a, b, c]: [f64; 3]| a + (b - a) * v + (c - a) * w;
                    let point = corners[0] + (corners[1] - corners[0]) * v + (corners[2] - corners[0]) * w;
                    ((at(along) - 0.5).abs() < 1e-3).then(|| point.distance(p))
                });
                let nearest = shown.fold(f64::INFINITY, f64::min);
                // The points are up to 0.02 apart, and beside the line.
                assert!((nearest - found).abs() < 0.03, "{along:?} {p}: {found}, {nearest}");
            }
        }
    }

    #[test]
    fn a_search_goes_on_beyond_sides_nearer_to_the_texel_or_to_the_point() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let isoline = |along: [f64; 3], texel| Isoline::of(corners, along.map(on_line), texel);
        // The line of points runs from the middle of the side along y = 0 to (0, 1, 0).
        let middle = isoline([0.0, 1.0, 0.5], on_line(0.5));
        let south = DVec3::new(0.5, -1.0, 0.0);
        let own = middle.squared_to(south);
        assert!((own - 1.0).abs() < 1e-6);
        let passed = middle.to_sides(south, own).map(|side| side.is_some());
        assert_eq!(passed, [false, false, true], "only beyond the southern side may be nearer points");
        // No point shows the texel: all sides may be crossed, and those at the highest corner come nearest to it.
        let below = isoline([0.0, 1.0, 0.5], on_line(1.5));
        assert_eq!(below.squared_to(south), f64::INFINITY);
        let [a, b, c] = below.to_sides(south, f64::INFINITY).map(|side| side.unwrap().0);
        assert!((a - 0.5).abs() < 1e-6 && (b - 1.0).abs() < 1e-6 && (c - 0.5).abs() < 1e-6, "{a} {b} {c}");
        // A texel beside the line is not shown.
        let beside = isoline([0.0, 1.0, 0.5], DVec2::new(0.2, 0.0));
        assert_eq!(
            (beside.squared_to(south), beside.to_sides(south, f64::INFINITY)),
            (f64::INFINITY, [None; 3])
        );
        assert!(!Isoline::is_flat([DVec2::ZERO, DVec2::X, DVec2::new(0.5, 1e-3)]));
    }
}

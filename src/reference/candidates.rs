//! The triangles that a pixel may show if its centre is shifted slightly. A GPU snaps vertices to 1/256 pixel and
//! rounds in f32. So near an edge or a silhouette it may show another triangle than the reference. The pixel is
//! correct if that triangle is one of these candidates.

use super::raster::{MARGIN_PX, ReferenceView, Sample, Setup};
use glam::{DVec2, DVec3};

/// The triangles, and perhaps background, that a pixel may show.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidates {
    /// One sample for each triangle visible in the neighbourhood, in the mesh's order. Values are taken at the pixel's
    /// own centre. If the triangle does not cover the centre, its values are extrapolated and may not be finite.
    pub samples: Vec<Sample>,
    /// True if part of the neighbourhood shows no triangle.
    pub background: bool,
}

/// Relative depth differences below this count as equal: f32 cannot order them (2^-24, and a few roundings).
const DEPTH_SLACK: f64 = 1e-6;
/// Pieces of less than this fraction of the neighbourhood are slivers from rounding: f64 rounds the corners of
/// a cut by about 1e-16 of the neighbourhood's side, far below this bound.
const MIN_PART: f64 = 1e-12;

/// A linear function of the position relative to the pixel's centre, in pixels: dot product with `(x, y, 1)`.
type LinearForm = DVec3;
/// A convex polygon, corners in order.
type Polygon = Vec<DVec2>;

impl ReferenceView {
    /// All triangles visible at pixel (x, y) if its centre moves by up to `radius_px` horizontally and
    /// vertically. Computed from exact areas of the square, not from samples.
    pub fn candidates(&self, x: u32, y: u32, radius_px: f64) -> Candidates {
        assert!(
            radius_px > 0.0 && radius_px <= MARGIN_PX,
            "a radius of {radius_px} is outside 0 .. {MARGIN_PX} pixels"
        );
        let square: Polygon = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| DVec2::new(x, y) * radius_px)
            .to_vec();
        let min_area = MIN_PART * 4.0 * radius_px * radius_px;
        let regions: Vec<Region> = self
            .near([x as i32, y as i32], radius_px)
            .filter_map(|setup| Region::new(self, setup, x, y, &square))
            .collect();
        let samples = regions
            .iter()
            .filter(|region| region.is_visible(&regions, min_area))
            .map(|region| self.sample_of(region.setup, x, y))
            .collect();
        let empty = regions.iter().fold(vec![square], |empty, region| subtract(empty, &region.sides));
        Candidates { samples, background: total_area(&empty) > min_area }
    }
}

/// The part of the neighbourhood covered by one triangle.
struct Region<'a> {
    setup: &'a Setup,
    /// All are >= 0 inside.
    sides: Vec<LinearForm>,
    polygon: Polygon,
    inverse_w: LinearForm,
}

impl<'a> Region<'a> {
    /// `None` if the triangle does not touch the neighbourhood.
    fn new(view: &ReferenceView, setup: &'a Setup, x: u32, y: u32, square: &Polygon) -> Option<Region<'a>> {
        let centre = view.centre(i64::from(x), i64::from(y));
        let [width, height] = view.size().map(f64::from);
        let around = |linear: DVec3| {
            LinearForm::new(linear.x * 2.0 / width, linear.y * 2.0 / height, linear.dot(centre))
        };
        let [inverse_w, depth] = setup.inverse_w_and_depth().map(around);
        let sides: Vec<LinearForm> = setup
            .edges
            .iter()
            .map(|&edge| around(edge))
            .chain([inverse_w, depth, LinearForm::Z - depth])
            .collect();
        let mut polygon = square.clone();
        for &side in &sides {
            polygon = keep(&polygon, side);
        }
        (polygon.len() >= 3).then_some(Region { setup, sides, polygon, inverse_w })
    }

    /// True if more than `min_area` of the region remains after all regions that are surely in front are
    /// cut out.
    fn is_visible(&self, regions: &[Region], min_area: f64) -> bool {
        let mut visible = vec![self.polygon.clone()];
        for other in regions.iter().filter(|other| other.setup.triangle != self.setup.triangle) {
            let nearer = other.inverse_w - self.inverse_w * (1.0 + DEPTH_SLACK);
            visible = subtract(visible, &[&other.sides[..], &[nearer]].concat());
            if total_area(&visible) <= min_area {
                return false;
            }
        }
        true
    }
}

fn value(linear: LinearForm, place: DVec2) -> f64 {
    linear.dot(place.extend(1.0))
}

/// The part of a convex polygon where a linear function is >= 0 (I. Sutherland and G. Hodgman, "Reentrant Polygon
/// Clipping", Communications of the ACM, 1974).
fn keep(polygon: &Polygon, side: LinearForm) -> Polygon {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (index, &from) in polygon.iter().enumerate() {
        let to = polygon[(index + 1) % polygon.len()];
        let (at_from, at_to) = (value(side, from), value(side, to));
        if at_from >= 0.0 {
            kept.push(from);
        }
        if (at_from >= 0.0) != (at_to >= 0.0) {
            kept.push(from + (to - from) * (at_from / (at_from - at_to)));
        }
    }
    kept
}

/// Cuts the convex region where all `sides` are >= 0 out of convex polygons. The results are convex, too.
fn subtract(polygons: Vec<Polygon>, sides: &[LinearForm]) -> Vec<Polygon> {
    let mut left = Vec::with_capacity(polygons.len());
    for polygon in polygons {
        let mut pieces = Vec::new();
        let mut inside = polygon.clone();
        for &side in sides {
            let piece = keep(&inside, -side);
            if area(&piece) > 0.0 {
                pieces.push(piece);
            }
            inside = keep(&inside, side);
            if inside.len() < 3 {
                break;
            }
        }
        // A polygon outside the region stays whole: cutting it along the region's sides would only multiply the
        // pieces.
        if inside.len() < 3 { left.push(polygon) } else { left.append(&mut pieces) }
    }
    left
}

fn area(polygon: &Polygon) -> f64 {
    let Some(&first) = polygon.first() else { return 0.0 };
    let twice: f64 = polygon.windows(2).map(|edge| (edge[0] - first).perp_dot(edge[1] - first)).sum();
    twice.abs() / 2.0
}

fn total_area(polygons: &[Polygon]) -> f64 {
    polygons.iter().map(area).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Polygon {
        [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(DVec2::from).to_vec()
    }

    #[test]
    fn a_half_plane_keeps_its_part() {
        assert_eq!(area(&keep(&square(), LinearForm::new(1.0, 0.0, -0.5))), 3.0);
        assert_eq!(area(&keep(&square(), LinearForm::new(1.0, 1.0, -2.0))), 2.0);
        assert!(keep(&square(), LinearForm::new(1.0, 0.0, -3.0)).is_empty());
    }

    #[test]
    fn the_removed_and_remaining_areas_add_up() {
        let triangle = [
            LinearForm::new(1.0, 0.0, -0.5),
            LinearForm::new(0.0, 1.0, -0.5),
            LinearForm::new(-1.0, -1.0, 2.5),
        ];
        let rest = subtract(vec![square()], &triangle);
        assert!((total_area(&rest) - (4.0 - 1.125)).abs() < 1e-15);
        assert_eq!(total_area(&subtract(rest.clone(), &triangle)), total_area(&rest), "cut once");
        let elsewhere = [LinearForm::new(1.0, 0.0, -9.0)];
        assert_eq!(total_area(&subtract(vec![square()], &elsewhere)), 4.0);
    }
}

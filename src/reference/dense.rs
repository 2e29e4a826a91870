//! Takes many samples of a dense mesh. Each pixel has a list of the triangles that may cover a part of it.
//! [`ReferenceView::coordinate`] has no such lists: for each sample it tests all triangles of a bin. If a pixel has
//! hundreds of triangles, a bin has thousands.

use super::ReferenceView;
use super::raster::{Setup, nearest};
use glam::DVec3;
use rayon::prelude::*;

/// The triangles of each pixel of a picture, and of the pixels around the picture.
pub struct PixelTriangles<'a> {
    view: &'a ReferenceView,
    lists: Vec<Vec<&'a Setup>>,
}

impl<'a> PixelTriangles<'a> {
    pub fn new(view: &'a ReferenceView) -> PixelTriangles<'a> {
        let [width, height] = view.size().map(|side| side as i32);
        let list = |n: i32| {
            let [x, y] = [n % (width + 2) - 1, n / (width + 2) - 1];
            let corners = [[0, 0], [1, 0], [0, 1], [1, 1]]
                .map(|[a, b]: [i32; 2]| view.place([f64::from(x + a), f64::from(y + b)]));
            view.near([x, y], 0.0).filter(|setup| !setup.misses_all(&corners)).collect()
        };
        let lists = (0..(width + 2) * (height + 2)).into_par_iter().map(list).collect();
        PixelTriangles { view, lists }
    }

    /// As [`ReferenceView::coordinate`], up to a pixel beyond the picture.
    pub fn coordinate(&self, x: f64, y: f64) -> Option<[f64; 2]> {
        self.visible(x, y).map(|(setup, place)| setup.coordinate(place))
    }

    /// Distance of the visible surface along the eye's forward axis, in metres.
    pub fn distance_m(&self, x: f64, y: f64) -> Option<f64> {
        self.visible(x, y).map(|(setup, place)| setup.distance_m(place))
    }

    /// The index of the visible triangle in the mesh.
    pub fn triangle(&self, x: f64, y: f64) -> Option<u32> {
        self.visible(x, y).map(|(setup, _)| setup.triangle)
    }

    fn visible(&self, x: f64, y: f64) -> Option<(&'a Setup, DVec3)> {
        let [width, height] = self.view.size().map(f64::from);
        let [column, row] =
            [x.clamp(-1.0, width), y.clamp(-1.0, height)].map(|at| (at.floor() + 1.0) as usize);
        let list = &self.lists[row * (width as usize + 2) + column];
        let place = self.view.place([x, y]);
        Some((nearest(list.iter().copied(), place)?, place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::splitmix::SplitMix64;
    use crate::model::mesh::SourceMesh;
    use glam::{DMat4, DVec2, DVec4};

    #[test]
    fn the_lists_show_what_all_triangles_show() {
        let mut random = SplitMix64(5);
        let mut unit = || random.unit();
        let count = 600u32;
        let mut mesh = SourceMesh::default();
        for n in 0..count {
            let middle = DVec3::new(6.0 * unit() - 3.0, 6.0 * unit() - 3.0, -2.0 - 6.0 * unit());
            for _ in 0..3 {
                mesh.positions.push(middle + DVec3::new(unit(), unit(), unit()) - 0.5);
                mesh.coordinates.push(DVec2::new(unit(), unit()));
            }
            mesh.triangles.push([3 * n, 3 * n + 1, 3 * n + 2]);
        }
        // w is the distance, depth 0.1 / w.
        let clip = DMat4::from_rows(1.5 * DVec4::X, 1.5 * DVec4::Y, 0.1 * DVec4::W, -DVec4::Z);
        let view = ReferenceView::new(&mesh, &clip, DVec3::ZERO, [24, 16]);
        let dense = PixelTriangles::new(&view);
        let mut covered = 0;
        for _ in 0..4000 {
            let [x, y] = [26.0 * unit() - 1.0, 18.0 * unit() - 1.0];
            let (found, right) = (dense.coordinate(x, y), view.coordinate(x, y));
            assert_eq!(found, right, "{x} {y}");
            covered += u32::from(right.is_some());
        }
        assert!((500..3900).contains(&covered), "{covered} of 4000 positions");
        let longest = dense.lists.iter().map(Vec::len).max().unwrap();
        assert!(longest * 4 < count as usize, "a pixel lists {longest} of {count} triangles");
        let sample = (0..24).find_map(|x| Some((x, view.sample(x, 8)?))).unwrap();
        let distance = dense.distance_m(f64::from(sample.0) + 0.5, 8.5).unwrap();
        assert!((distance - sample.1.w_m).abs() < 1e-9 * distance, "{distance} {}", sample.1.w_m);
    }
}

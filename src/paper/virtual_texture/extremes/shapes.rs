//! Synthetic meshes for one picture each, with values that mesh files may not contain or that no real camera sees.
//!
//! The eye is at (0, 0, 1) and looks down on the plane z = 0 with a vertical field of view of 90 degrees. All points
//! have the same depth, so pixel positions map linearly to positions in the world.

use crate::math::camera::Pose;
use crate::math::pyramid::{Pyramid, TileId};
use crate::model::mesh::SourceMesh;
use glam::{DVec2, DVec3};

/// The camera of all these meshes.
pub fn eye() -> Pose {
    Pose {
        eye: DVec3::Z,
        right: DVec3::X,
        up: DVec3::Y,
        forward: -DVec3::Z,
        vertical_fov_rad: std::f64::consts::FRAC_PI_2,
        near_m: 0.5,
        height_m: f64::INFINITY,
    }
}

/// Collects triangles given in pixel coordinates.
struct Canvas {
    size: [u32; 2],
    mesh: SourceMesh,
}

impl Canvas {
    fn new(size: [u32; 2]) -> Canvas {
        Canvas { size, mesh: SourceMesh::default() }
    }

    fn triangle(&mut self, places_px: [DVec2; 3], coordinates: [DVec2; 3]) {
        let [width, height] = self.size.map(f64::from);
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(
            places_px.map(|p| DVec3::new((2.0 * p.x - width) / height, 1.0 - 2.0 * p.y / height, 0.0)),
        );
        self.mesh.coordinates.extend(coordinates);
        self.mesh.triangles.push([first, first + 1, first + 2]);
    }

    /// Two triangles; corners in the order north-west, north-east, south-west, south-east.
    fn patch(&mut self, at_px: DVec2, side_px: DVec2, [nw, ne, sw, se]: [DVec2; 4]) {
        let place = |x: f64, y: f64| at_px + side_px * DVec2::new(x, y);
        let [a, b, c, d] = [place(0.0, 0.0), place(1.0, 0.0), place(0.0, 1.0), place(1.0, 1.0)];
        self.triangle([a, c, b], [nw, sw, ne]);
        self.triangle([b, c, d], [ne, sw, se]);
    }

    /// Patches side by side that fill the picture.
    fn strip(size: [u32; 2], patches: &[[DVec2; 4]]) -> SourceMesh {
        let mut canvas = Canvas::new(size);
        let side = DVec2::new(f64::from(size[0]) / patches.len() as f64, f64::from(size[1]));
        for (n, corners) in patches.iter().enumerate() {
            canvas.patch(DVec2::new(n as f64 * side.x, 0.0), side, *corners);
        }
        canvas.mesh
    }
}

fn rectangle(west_north: [f64; 2], east_south: [f64; 2]) -> [DVec2; 4] {
    let ([w, n], [e, s]) = (west_north, east_south);
    [DVec2::new(w, n), DVec2::new(e, n), DVec2::new(w, s), DVec2::new(e, s)]
}

/// Points and slivers at the texture's four corners. All but the first two include s = 1 and t = 1 exactly.
pub fn corners(pyramid: &Pyramid, size: [u32; 2]) -> SourceMesh {
    let texel = pyramid.level_size(0).map(|side| 1.0 / f64::from(side));
    let [s, t] = [1.0 - 40.0 * texel[0], 1.0 - 40.0 * texel[1]];
    let patches = [
        rectangle([0.0; 2], [0.0; 2]),
        rectangle([0.0; 2], [1.0 - s, 1.0 - t]),
        rectangle([1.0; 2], [1.0; 2]),
        rectangle([s, t], [1.0; 2]),
        // The seam in the opposite direction: s = 1 in the west, decreasing to the east.
        rectangle([1.0, t], [s, 1.0]),
        rectangle([1.0, 0.0], [1.0, 1.0]),
        rectangle([0.0, 1.0], [1.0, 1.0]),
    ];
    Canvas::strip(size, &patches)
}

/// Patches with constant coordinates: every derivative is exactly 0, and dmax / dmin is 0 / 0.
pub fn points(pyramid: &Pyramid, size: [u32; 2]) -> SourceMesh {
    let [columns, rows] = pyramid.tile_grid(0).map(f64::from);
    let point = |n: u32| {
        let at = DVec2::new((f64::from(n) * 37.0 + 0.5) / columns, (f64::from(n) * 19.0 + 0.5) / rows);
        [at; 4]
    };
    let mut patches: Vec<_> = (0..6).map(point).collect();
    // Lines: only one derivative is 0, so dmin = 0 and dmax > 0.
    patches.push(rectangle([0.25, 0.5], [0.25 + 300.0 / (columns * 512.0), 0.5]));
    patches.push(rectangle([0.75, 0.5], [0.75, 0.5 + 300.0 / (rows * 512.0)]));
    Canvas::strip(size, &patches)
}

/// Coordinates that are NaN, infinite, or far outside the texture, with ordinary patches between them.
pub fn not_finite(_: &Pyramid, size: [u32; 2]) -> SourceMesh {
    let ordinary = rectangle([0.3, 0.3], [0.301, 0.301]);
    let all = |value: f64| [DVec2::splat(value); 4];
    let one = |value: f64| {
        let mut corners = ordinary;
        corners[1].x = value;
        corners
    };
    let (nan, infinity) = (f64::NAN, f64::INFINITY);
    let patches = [
        all(nan),
        ordinary,
        all(infinity),
        all(-infinity),
        ordinary,
        one(nan),
        one(infinity),
        rectangle([-infinity; 2], [infinity; 2]),
        ordinary,
        // These values are finite, but their squares overflow f32.
        one(1e30),
        one(-1e30),
        ordinary,
    ];
    Canvas::strip(size, &patches)
}

/// A patch for each level, all in tile (0, 0), with footprints of 1.5 x 2^q texels, for q from -2 to one level beyond
/// the first resident one. With level-0 tile addresses, one texel of the tile mask then has all bits that this
/// pyramid can set.
pub fn every_level(pyramid: &Pyramid, size: [u32; 2]) -> SourceMesh {
    let [w, h] = pyramid.level_size(0).map(f64::from);
    let levels = pyramid.first_resident_level() as i32;
    let patch_px = f64::from(size[0]) / f64::from(levels + 4);
    let patch = |q: i32| {
        let texels = 1.5 * 2f64.powi(q) * DVec2::new(patch_px, f64::from(size[1]));
        rectangle([0.0; 2], [texels.x / w, texels.y / h])
    };
    Canvas::strip(size, &(-2..=levels + 1).map(patch).collect::<Vec<_>>())
}

/// The tile of pixel `n` of [`noise`]: a different tile for each pixel, up to the number of tiles.
pub fn noise_tile(pyramid: &Pyramid, n: u64) -> TileId {
    // A prime step modulo the number of tiles reaches every tile before it repeats one.
    let mut index = n * 2_654_435_761 % pyramid.tile_count();
    for level in 0..pyramid.first_resident_level() {
        let [columns, rows] = pyramid.tile_grid(level).map(u64::from);
        if index < columns * rows {
            return TileId { level, row: (index / columns) as u32, column: (index % columns) as u32 };
        }
        index -= columns * rows;
    }
    unreachable!("index {index} beyond all tiles")
}

/// A triangle in each pixel, each in a different tile: as many distinct tiles as the picture has pixels.
pub fn noise(pyramid: &Pyramid, size: [u32; 2]) -> SourceMesh {
    let [columns, rows] = pyramid.tile_grid(0).map(f64::from);
    let texel = DVec2::from_array(pyramid.level_size(0).map(|side| 1.0 / f64::from(side)));
    // Each triangle covers the centre of its own pixel and of no other.
    let corners = [DVec2::new(-0.4, -0.3), DVec2::new(0.0, 0.45), DVec2::new(0.4, -0.3)];
    let mut canvas = Canvas::new(size);
    for pixel in 0..u64::from(size[0]) * u64::from(size[1]) {
        let tile = noise_tile(pyramid, pixel);
        let scale = 2f64.powi(tile.level as i32);
        let cell = DVec2::new(f64::from(tile.column) * scale + 0.5, f64::from(tile.row) * scale + 0.5);
        let at = cell / DVec2::new(columns, rows);
        let centre =
            DVec2::new((pixel % u64::from(size[0])) as f64 + 0.5, (pixel / u64::from(size[0])) as f64 + 0.5);
        // A footprint of 1.5 texels of the tile's level.
        canvas.triangle(corners.map(|c| centre + c), corners.map(|c| at + c * texel * (1.5 * scale)));
    }
    canvas.mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_pixel_of_the_noise_has_its_own_tile() {
        let pyramid = Pyramid::new(20, 19, 9, 4, None).unwrap();
        let tiles: BTreeSet<TileId> = (0..1 << 20).map(|n| noise_tile(&pyramid, n)).collect();
        assert_eq!(tiles.len(), 1 << 20);
        assert!(tiles.iter().all(|&tile| pyramid.contains(tile)));
        let levels: BTreeSet<u32> = tiles.iter().map(|tile| tile.level).collect();
        assert_eq!(levels.len(), pyramid.first_resident_level() as usize, "tiles of every level");
    }
}

//! Silhouettes inside a picture: where a surface hides a part of itself, a pixel's kernel shows two pieces of it that
//! are not connected. A filter that uses one footprint per pixel cannot average both.

use crate::model::mesh::SourceMesh;
use crate::reference::PixelTriangles;
use rayon::prelude::*;

/// Distance of neighbouring samples, in pixels. If a triangle is so narrow that neighbouring samples skip it, the pixel
/// may count as one with a silhouette although it has none.
const STEP_PX: f64 = 0.125;

/// For each pixel, row by row: true if the square of `radius_px` around its centre shows one piece of the surface.
/// Neighbouring samples then show the same triangle, or triangles with a common corner.
pub fn shows_one_piece(
    triangles: &PixelTriangles<'_>,
    mesh: &SourceMesh,
    [width, height]: [u32; 2],
    radius_px: f64,
) -> Vec<bool> {
    let touch = |a: u32, b: u32| {
        let corners = |n: u32| mesh.triangles[n as usize].map(|vertex| mesh.positions[vertex as usize]);
        a == b || corners(a).iter().any(|corner| corners(b).contains(corner))
    };
    let connected = |pair: [Option<u32>; 2]| match pair {
        [Some(a), Some(b)] => touch(a, b),
        [a, b] => a == b,
    };
    let steps = (2.0 * radius_px / STEP_PX).ceil() as usize;
    let pixel = |n: u32| {
        let [left, top] = [n % width, n / width].map(|at| f64::from(at) + 0.5 - radius_px);
        let row = |row: usize| -> Vec<Option<u32>> {
            let y = top + STEP_PX * row as f64;
            (0..=steps).map(|column| triangles.triangle(left + STEP_PX * column as f64, y)).collect()
        };
        let mut above = row(0);
        let is_connected = |row: &[Option<u32>]| row.windows(2).all(|pair| connected([pair[0], pair[1]]));
        is_connected(&above)
            && (1..=steps).all(|n| {
                let last = std::mem::replace(&mut above, row(n));
                is_connected(&above) && last.iter().zip(&above).all(|(a, b)| connected([*a, *b]))
            })
    };
    (0..width * height).into_par_iter().map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::ReferenceView;
    use glam::{DMat4, DVec2, DVec3, DVec4};

    /// A wall below the horizon, and a second one above it that is `gap_m` farther away. Both fill the picture's width.
    fn walls(gap_m: f64) -> SourceMesh {
        let corners = |[bottom, z]: [f64; 2]| {
            [[-9.0, bottom], [9.0, bottom], [-9.0, bottom + 9.0], [9.0, bottom + 9.0]]
                .map(|[x, y]| DVec3::new(x, y, z))
        };
        SourceMesh {
            positions: [[-9.0, -2.0], [0.0, -2.0 - gap_m]].into_iter().flat_map(corners).collect(),
            coordinates: vec![DVec2::ZERO; 8],
            triangles: vec![[0, 1, 2], [2, 1, 3], [4, 5, 6], [6, 5, 7]],
            ..SourceMesh::default()
        }
    }

    #[test]
    fn only_a_step_in_depth_separates_two_pieces() {
        let clip = DMat4::from_rows(DVec4::X, DVec4::Y, 0.1 * DVec4::W, -DVec4::Z);
        // The horizon lies between the rows 5 and 6, whose squares reach across it.
        for (gap_m, whole) in [(0.0, 12 * 12), (1.0, 12 * 10)] {
            let mesh = walls(gap_m);
            let view = ReferenceView::new(&mesh, &clip, DVec3::ZERO, [12, 12]);
            let found = shows_one_piece(&PixelTriangles::new(&view), &mesh, [12, 12], 1.0);
            assert_eq!(found.iter().filter(|one| **one).count(), whole, "{gap_m}");
        }
    }
}

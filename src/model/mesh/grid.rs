//! Grids of quads: the earth, a plane, and the inside of a cylinder.

use super::SourceMesh;
use crate::math::geodesy;
use glam::{DVec2, DVec3};

/// The WGS84 ellipsoid: `columns` meridians, `rows` bands of latitude, `s = (longitude + 180) / 360`, `t = (90 -
/// latitude) / 180`. The meridian 180 appears twice (s = 0 and s = 1, equal positions). Each pole has one vertex for
/// each column, in the column's middle. 388 x 194 are the paper's "about 150 000 polygons" (149 768).
///
/// # Panics
/// Unless there are at least 3 columns and 2 rows.
pub fn earth(columns: u32, rows: u32) -> SourceMesh {
    assert!(columns >= 3 && rows >= 2, "an earth of {columns} x {rows} quads");
    let mut mesh = SourceMesh { curvature: 1.0 / geodesy::MEAN_RADIUS_M, ..SourceMesh::default() };
    let mut vertex = |position: DVec3, s: f64, t: f64| {
        mesh.positions.push(position);
        mesh.coordinates.push(DVec2::new(s, t));
    };
    for column in 0..columns {
        let s = (f64::from(column) + 0.5) / f64::from(columns);
        vertex(DVec3::new(0.0, 0.0, geodesy::POLE_RADIUS_M), s, 0.0);
    }
    for row in 1..rows {
        let t = f64::from(row) / f64::from(rows);
        for column in 0..=columns {
            // The modulo gives both sides of the seam the same bits.
            let turn = f64::from(column % columns) / f64::from(columns);
            let position = geodesy::geodetic_to_ecef(90.0 - 180.0 * t, 360.0 * turn - 180.0, 0.0);
            vertex(position, f64::from(column) / f64::from(columns), t);
        }
    }
    for column in 0..columns {
        let s = (f64::from(column) + 0.5) / f64::from(columns);
        vertex(DVec3::new(0.0, 0.0, -geodesy::POLE_RADIUS_M), s, 1.0);
    }
    let ring = |row: u32, column: u32| columns + (row - 1) * (columns + 1) + column;
    let south = columns + (rows - 1) * (columns + 1);
    for [row, column] in blocks(columns, rows) {
        if row == 0 {
            mesh.triangles.push([column, ring(1, column), ring(1, column + 1)]);
        } else if row == rows - 1 {
            mesh.triangles.push([ring(row, column), south + column, ring(row, column + 1)]);
        } else {
            let [nw, ne] = [ring(row, column), ring(row, column + 1)];
            let [sw, se] = [ring(row + 1, column), ring(row + 1, column + 1)];
            mesh.triangles.extend([[nw, sw, ne], [ne, sw, se]]);
        }
    }
    mesh
}

/// A rectangle in the plane z = 0 around the origin, x to the east and y to the north; s from west to east, t from
/// north to south.
///
/// # Panics
/// Unless the sides are positive and there are quads.
pub fn plane(width_m: f64, height_m: f64, columns: u32, rows: u32) -> SourceMesh {
    assert!(width_m > 0.0 && height_m > 0.0, "a plane of {width_m} x {height_m} m");
    assert!(columns > 0 && rows > 0, "a plane of {columns} x {rows} quads");
    let mut mesh = SourceMesh::default();
    for row in 0..=rows {
        let t = f64::from(row) / f64::from(rows);
        for column in 0..=columns {
            let s = f64::from(column) / f64::from(columns);
            mesh.positions.push(DVec3::new((s - 0.5) * width_m, (0.5 - t) * height_m, 0.0));
            mesh.coordinates.push(DVec2::new(s, t));
        }
    }
    let corner = |row: u32, column: u32| row * (columns + 1) + column;
    for [row, column] in blocks(columns, rows) {
        let [nw, ne] = [corner(row, column), corner(row, column + 1)];
        let [sw, se] = [corner(row + 1, column), corner(row + 1, column + 1)];
        mesh.triangles.extend([[nw, sw, ne], [ne, sw, se]]);
    }
    mesh
}

/// The inside of a cylinder that lies on the plane z = 0 along the y axis, from y = 0 to the north. The coordinate s
/// runs once around from the top, counter-clockwise seen from the south; t runs from north to south. At the floor both
/// run as on a [`plane`]. The top appears twice (s = 0 and s = 1, equal positions).
///
/// # Panics
/// As [`plane`], and unless there are at least 3 columns.
pub fn cylinder(radius_m: f64, length_m: f64, columns: u32, rows: u32) -> SourceMesh {
    assert!(columns >= 3, "a cylinder of {columns} quads around");
    // A plane, rolled up.
    let mut mesh = plane(std::f64::consts::TAU * radius_m, length_m, columns, rows);
    for (position, coordinate) in mesh.positions.iter_mut().zip(&mesh.coordinates) {
        // The fraction gives both sides of the seam the same bits.
        let (sin, cos) = (std::f64::consts::TAU * coordinate.x.fract()).sin_cos();
        *position = DVec3::new(-radius_m * sin, (1.0 - coordinate.y) * length_m, radius_m * (1.0 + cos));
    }
    mesh
}

/// Every (row, column) of a grid, in blocks of 8 x 8. A block has 81 corners for 128 triangles; a cache of 32
/// vertices (more than two rows of 9) loads each corner once.
fn blocks(columns: u32, rows: u32) -> impl Iterator<Item = [u32; 2]> {
    const SIDE: u32 = 8;
    (0..rows).step_by(SIDE as usize).flat_map(move |top| {
        (0..columns).step_by(SIDE as usize).flat_map(move |left| {
            (top..rows.min(top + SIDE))
                .flat_map(move |row| (left..columns.min(left + SIDE)).map(move |column| [row, column]))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    fn corners(mesh: &SourceMesh, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| mesh.positions[vertex as usize])
    }

    #[test]
    fn the_papers_earth_has_149_768_triangles_all_facing_outward() {
        let mesh = earth(388, 194);
        assert_eq!(mesh.triangles.len(), 149_768);
        for &triangle in &mesh.triangles {
            let [a, b, c] = corners(&mesh, triangle);
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "{triangle:?}");
        }
    }

    #[test]
    fn a_cylinder_is_seen_from_inside_and_closed_at_its_seam() {
        let mesh = cylinder(3.0, 10.0, 12, 5);
        assert_eq!(mesh.triangles.len(), 120);
        for &triangle in &mesh.triangles {
            let [a, b, c] = corners(&mesh, triangle);
            let axis = DVec3::new(0.0, a.y, 3.0);
            assert!((b - a).cross(c - a).dot(axis - a) > 0.0, "{triangle:?}");
        }
        let seam = |at: f64| -> Vec<DVec3> {
            let vertices = mesh.positions.iter().zip(&mesh.coordinates);
            vertices.filter(|(_, coordinate)| coordinate.x == at).map(|(position, _)| *position).collect()
        };
        assert_eq!(seam(0.0), seam(1.0));
        assert_eq!(seam(0.0)[0], DVec3::new(0.0, 10.0, 6.0));
    }

    #[test]
    fn the_earth_is_closed_with_poles_and_seam() {
        let mesh = earth(12, 6);
        // By position, every directed edge has exactly one partner in the opposite direction.
        let mut edges: HashMap<[[u64; 3]; 2], i32> = HashMap::new();
        for &triangle in &mesh.triangles {
            let bits = corners(&mesh, triangle).map(|p| p.to_array().map(f64::to_bits));
            for i in 0..3 {
                *edges.entry([bits[i], bits[(i + 1) % 3]]).or_default() += 1;
            }
        }
        for (&[from, to], &count) in &edges {
            assert_eq!((count, edges.get(&[to, from])), (1, Some(&1)));
        }
    }

    #[test]
    fn coordinates_are_longitude_and_latitude_and_no_triangle_wraps() {
        let mesh = earth(24, 12);
        for (position, coordinate) in mesh.positions.iter().zip(&mesh.coordinates) {
            let place = geodesy::ecef_to_geodetic(*position);
            assert!((coordinate.y - (90.0 - place.latitude_deg) / 180.0).abs() < 1e-12);
            if place.latitude_deg.abs() < 89.0 {
                let turns = coordinate.x - (place.longitude_deg + 180.0) / 360.0;
                assert!((turns - turns.round()).abs() < 1e-12, "{place:?} {coordinate}");
            }
        }
        for triangle in &mesh.triangles {
            let s = triangle.map(|vertex| mesh.coordinates[vertex as usize].x);
            let width = s.iter().fold(0f64, |w, a| s.iter().fold(w, |w, b| w.max(a - b)));
            assert!(width <= 1.0 / 24.0 + 1e-12, "{triangle:?}: {s:?}");
        }
    }

    #[test]
    fn every_quad_is_drawn_once_on_any_grid() {
        for [columns, rows] in [[1, 1], [8, 8], [9, 17], [20, 3]] {
            let mut seen: Vec<[u32; 2]> = blocks(columns, rows).collect();
            seen.sort_unstable();
            let all: Vec<[u32; 2]> = (0..rows).flat_map(|r| (0..columns).map(move |c| [r, c])).collect();
            assert_eq!(seen, all);
        }
    }

    #[test]
    fn the_planes_north_west_corner_is_s_0_t_0_and_it_faces_up() {
        let mesh = plane(200.0, 100.0, 4, 2);
        assert_eq!(mesh.positions[0], DVec3::new(-100.0, 50.0, 0.0));
        assert_eq!(mesh.coordinates[0], DVec2::ZERO);
        assert_eq!(*mesh.coordinates.last().unwrap(), DVec2::ONE);
        for &triangle in &mesh.triangles {
            let [a, b, c] = corners(&mesh, triangle);
            assert!((b - a).cross(c - a).z > 0.0);
        }
    }
}

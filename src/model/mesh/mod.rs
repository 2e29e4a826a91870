//! Surfaces as triangles: the exact source mesh in f64, and its GPU form.
//!
//! One f32 is too coarse for a position on the earth (ulp 0.5 m) and for a texture coordinate on 2^20 texels (ulp
//! 1/16 texel). So a GPU vertex stores its position as the sum of two floats, and its coordinate as a small offset
//! from an origin shared by the three vertices of its triangle.

mod clusters;
mod positions;

pub use clusters::{CLUSTER_TRIANGLES, Cluster};
pub use positions::MeshPosition;

use crate::math::geodesy;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use thiserror::Error;

/// Origins are multiples of 2^-10 of the texture. With 388 x 194 quads on the earth, an offset in s stays below 2^-8
/// and rounds by at most 2^-33; an offset in t stays below 2^-7 and rounds by at most 2^-32. Both are 2^-13 texel of
/// 2^20 x 2^19.
const ORIGIN_CELLS_LOG2: u32 = 10;

/// A mesh that cannot be drawn and textured.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MeshError {
    #[error("{what} of {columns} columns x {rows} rows: it needs {needs}")]
    Grid { what: &'static str, columns: u32, rows: u32, needs: &'static str },
    #[error("vertex {vertex}: position {position} is not finite, or beyond 1e30 m")]
    Position { vertex: usize, position: DVec3 },
    #[error("vertex {vertex}: texture coordinate {coordinate} is outside 0 ..= 1")]
    Coordinate { vertex: usize, coordinate: DVec2 },
    #[error("{positions} positions, but {coordinates} texture coordinates")]
    Lengths { positions: usize, coordinates: usize },
    #[error("triangle {triangle} refers to vertex {vertex}, but there are only {count}")]
    Index { triangle: usize, vertex: u32, count: usize },
}

/// The exact mesh in f64, with one texture coordinate (s, t) for each vertex: s from west to east, t from north to
/// south, both in 0 ..= 1. Seams consist of duplicated vertices, so no triangle wraps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SourceMesh {
    /// World metres.
    pub positions: Vec<DVec3>,
    pub coordinates: Vec<DVec2>,
    /// Counter-clockwise seen from outside (above).
    pub triangles: Vec<[u32; 3]>,
    /// 1 / radius, per metre, if the mesh approximates a sphere whose (s, t) are longitude and latitude. 0 for other
    /// shapes.
    pub curvature: f64,
}

/// A vertex as the GPU reads it, 40 bytes, no padding.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MeshVertex {
    /// World metres, rounded to the nearest float.
    pub position_high: [f32; 3],
    /// The rounding error. The sum of both has a relative error of at most 2^-48 (2e-8 m on the earth).
    pub position_low: [f32; 3],
    /// Corner (s, t) of the triangle's cell in units of 2^-32: a multiple of 2^22, shared by the triangle's vertices.
    pub origin: [u32; 2],
    /// (s, t) - origin / 2^32, rounded by at most 2^-25 of the power of two above it.
    pub offset: [f32; 2],
}

impl MeshVertex {
    /// The vertex's texture coordinate, without further rounding.
    pub fn coordinate(&self) -> DVec2 {
        let axis = |i: usize| f64::from(self.origin[i]) / 4_294_967_296.0 + f64::from(self.offset[i]);
        DVec2::new(axis(0), axis(1))
    }
}

/// A triangle list for the GPU, in the source mesh's order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    pub vertices: Vec<MeshVertex>,
    pub indices: Vec<u32>,
    /// As [`SourceMesh::curvature`].
    pub curvature: f64,
}

impl Mesh {
    /// A unit vector for each vertex: the area-weighted mean of the normals of the faces around its position. Seams
    /// are smooth, because equal positions share one sum.
    pub fn normals(&self) -> Vec<[f32; 3]> {
        let place = |vertex: &MeshVertex| -> [u64; 3] {
            std::array::from_fn(|n| {
                let [high, low] =
                    [vertex.position_high[n], vertex.position_low[n]].map(|x| (x + 0.0).to_bits());
                u64::from(high) << 32 | u64::from(low)
            })
        };
        let position = |index: u32| {
            let MeshVertex { position_high, position_low, .. } = self.vertices[index as usize];
            DVec3::from(position_high.map(f64::from)) + DVec3::from(position_low.map(f64::from))
        };
        let mut sums: HashMap<[u64; 3], DVec3> = HashMap::new();
        for face in self.indices.chunks_exact(3) {
            let [a, b, c] = [face[0], face[1], face[2]].map(position);
            let twice_area = (b - a).cross(c - a);
            for &index in face {
                *sums.entry(place(&self.vertices[index as usize])).or_default() += twice_area;
            }
        }
        // A vertex without faces is not drawn; any direction will do.
        let unit = |vertex| sums.get(&place(vertex)).copied().unwrap_or_default().normalize_or(DVec3::Z);
        self.vertices.iter().map(|vertex| unit(vertex).as_vec3().to_array()).collect()
    }
}

impl SourceMesh {
    /// Checks that every value can be drawn.
    ///
    /// # Errors
    /// [`MeshError`] names the first invalid vertex or triangle.
    pub fn check(&self) -> Result<(), MeshError> {
        if self.positions.len() != self.coordinates.len() {
            return Err(MeshError::Lengths {
                positions: self.positions.len(),
                coordinates: self.coordinates.len(),
            });
        }
        for (vertex, &position) in self.positions.iter().enumerate() {
            // f32 ends at 3e38; 1e30 leaves room for the projection.
            if !(position.abs().max_element() <= 1e30 && position.is_finite()) {
                return Err(MeshError::Position { vertex, position });
            }
        }
        for (vertex, &coordinate) in self.coordinates.iter().enumerate() {
            if !((0.0..=1.0).contains(&coordinate.x) && (0.0..=1.0).contains(&coordinate.y)) {
                return Err(MeshError::Coordinate { vertex, coordinate });
            }
        }
        let count = self.positions.len();
        for (triangle, vertices) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = vertices.iter().find(|&&vertex| vertex as usize >= count) {
                return Err(MeshError::Index { triangle, vertex, count });
            }
        }
        Ok(())
    }
}

/// Converts a mesh to its GPU form: splits positions, gives each triangle its origin (the cell of its smallest s and
/// t), and shares a vertex among triangles with equal (vertex, origin).
/// # Errors
/// As [`SourceMesh::check`].
pub fn gpu_mesh(source: &SourceMesh) -> Result<Mesh, MeshError> {
    source.check()?;
    let mut mesh = Mesh {
        vertices: Vec::new(),
        indices: Vec::with_capacity(source.triangles.len() * 3),
        curvature: source.curvature,
    };
    let mut known: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
    for triangle in &source.triangles {
        let smallest = triangle
            .iter()
            .map(|&vertex| source.coordinates[vertex as usize])
            .reduce(DVec2::min)
            .expect("a triangle has three vertices");
        let origin = smallest.to_array().map(origin_of);
        for &vertex in triangle {
            let index = *known.entry((vertex, origin)).or_insert_with(|| {
                mesh.vertices.push(gpu_vertex(source, vertex, origin));
                u32::try_from(mesh.vertices.len() - 1).expect("2^32 vertices fill 160 GiB")
            });
            mesh.indices.push(index);
        }
    }
    Ok(mesh)
}

/// Corner of the cell that contains a coordinate in 0 ..= 1, in units of 2^-32; 1 itself is in the last cell.
fn origin_of(coordinate: f64) -> u32 {
    let cells = 1u32 << ORIGIN_CELLS_LOG2;
    let cell = (coordinate * f64::from(cells)).floor() as u32;
    cell.min(cells - 1) << (32 - ORIGIN_CELLS_LOG2)
}

fn gpu_vertex(source: &SourceMesh, vertex: u32, origin: [u32; 2]) -> MeshVertex {
    let position = source.positions[vertex as usize].to_array();
    let coordinate = source.coordinates[vertex as usize].to_array();
    let position_high = position.map(|metres| metres as f32);
    MeshVertex {
        position_high,
        position_low: std::array::from_fn(|i| (position[i] - f64::from(position_high[i])) as f32),
        origin,
        // The difference is exact in f64: both are multiples of the coordinate's ulp and at most 1.
        offset: std::array::from_fn(|i| (coordinate[i] - f64::from(origin[i]) / 4_294_967_296.0) as f32),
    }
}

/// The WGS84 ellipsoid: `columns` meridians, `rows` bands of latitude, `s = (longitude + 180) / 360`, `t = (90 -
/// latitude) / 180`. The meridian 180 appears twice (s = 0 and s = 1, equal positions). Each pole has one vertex for
/// each column, in the column's middle. 388 x 194 are the paper's "about 150 000 polygons" (149 768).
/// # Errors
/// [`MeshError::Grid`] unless there are at least 3 columns and 2 rows, and at most 2^26 quads.
pub fn earth(columns: u32, rows: u32) -> Result<SourceMesh, MeshError> {
    if columns < 3 || rows < 2 || u64::from(columns) * u64::from(rows) > MOST_QUADS {
        let needs = "at least 3 columns and 2 rows, at most 67108864 quads";
        return Err(MeshError::Grid { what: "earth", columns, rows, needs });
    }
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
    Ok(mesh)
}

/// A rectangle in the plane z = 0 around the origin, x to the east and y to the north; s from west to east, t from
/// north to south.
///
/// # Errors
/// [`MeshError::Grid`] unless the sides are positive and at most 10^30 m, and there are 1 to 2^26 quads.
pub fn plane(width_m: f64, height_m: f64, columns: u32, rows: u32) -> Result<SourceMesh, MeshError> {
    let sides_fit = |side_m: f64| side_m > 0.0 && side_m <= 1e30;
    let quads = u64::from(columns) * u64::from(rows);
    if !sides_fit(width_m) || !sides_fit(height_m) || !(1..=MOST_QUADS).contains(&quads) {
        let needs = "sides in 0 .. 1e30 m, and 1 .. 67108864 quads";
        return Err(MeshError::Grid { what: "plane", columns, rows, needs });
    }
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
    Ok(mesh)
}

/// The inside of a cylinder that lies on the plane z = 0 along the y axis, from y = 0 to the north. s runs once around
/// from the top, counter-clockwise seen from the south; t runs from north to south. At the floor both run as on a
/// [`plane`]. The top appears twice (s = 0 and s = 1, equal positions).
///
/// # Errors
/// As [`plane`]; [`MeshError::Grid`] unless there are at least 3 columns.
pub fn cylinder(radius_m: f64, length_m: f64, columns: u32, rows: u32) -> Result<SourceMesh, MeshError> {
    // A plane, rolled up.
    let mut mesh = plane(std::f64::consts::TAU * radius_m, length_m, columns, rows)?;
    if columns < 3 {
        let needs = "at least 3 columns";
        return Err(MeshError::Grid { what: "cylinder", columns, rows, needs });
    }
    for (position, coordinate) in mesh.positions.iter_mut().zip(&mesh.coordinates) {
        // The fraction gives both sides of the seam the same bits.
        let (sin, cos) = (std::f64::consts::TAU * coordinate.x.fract()).sin_cos();
        *position = DVec3::new(-radius_m * sin, (1.0 - coordinate.y) * length_m, radius_m * (1.0 + cos));
    }
    Ok(mesh)
}

/// 2^26 quads are 2^27 triangles and up to 10 GiB of vertices; more is a typing error.
const MOST_QUADS: u64 = 1 << 26;

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

    #[test]
    fn normals_point_outward_including_the_seam_and_the_poles() {
        let mesh = gpu_mesh(&earth(64, 32).unwrap()).unwrap();
        for (vertex, normal) in mesh.vertices.iter().zip(mesh.normals()) {
            let [up, normal] =
                [vertex.position_high, normal].map(|v| DVec3::from(v.map(f64::from)).normalize());
            // A quad spans 5.6 degrees, and the ellipsoid's normal differs by 0.2 degrees from the direction away from
            // the centre.
            assert!(up.dot(normal) > 4f64.to_radians().cos(), "{vertex:?}: {normal}");
        }
    }

    fn corners(mesh: &SourceMesh, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| mesh.positions[vertex as usize])
    }

    #[test]
    fn the_papers_earth_has_149_768_triangles_all_facing_outward() {
        let mesh = earth(388, 194).unwrap();
        assert_eq!(mesh.triangles.len(), 149_768);
        for &triangle in &mesh.triangles {
            let [a, b, c] = corners(&mesh, triangle);
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "{triangle:?}");
        }
    }

    #[test]
    fn a_cylinder_is_seen_from_inside_and_closed_at_its_seam() {
        let mesh = cylinder(3.0, 10.0, 12, 5).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.check()), (120, Ok(())));
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
        for wrong in [cylinder(0.0, 1.0, 8, 1), cylinder(1.0, -1.0, 8, 1), cylinder(1.0, 1.0, 2, 1)] {
            assert!(wrong.is_err());
        }
    }

    #[test]
    fn the_earth_is_closed_with_poles_and_seam() {
        let mesh = earth(12, 6).unwrap();
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
        let mesh = earth(24, 12).unwrap();
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
        let mesh = plane(200.0, 100.0, 4, 2).unwrap();
        assert_eq!(mesh.positions[0], DVec3::new(-100.0, 50.0, 0.0));
        assert_eq!(mesh.coordinates[0], DVec2::ZERO);
        assert_eq!(*mesh.coordinates.last().unwrap(), DVec2::ONE);
        for &triangle in &mesh.triangles {
            let [a, b, c] = corners(&mesh, triangle);
            assert!((b - a).cross(c - a).z > 0.0);
        }
    }

    #[test]
    fn the_gpu_keeps_the_earths_coordinates_to_2_pow_minus_13_texel_and_positions_to_a_micrometre() {
        let source = earth(388, 194).unwrap();
        let mesh = gpu_mesh(&source).unwrap();
        for (&index, &vertex) in mesh.indices.iter().zip(source.triangles.as_flattened()) {
            let (gpu, vertex) = (&mesh.vertices[index as usize], vertex as usize);
            let error = (gpu.coordinate() - source.coordinates[vertex]).abs();
            assert!(error.x <= 2f64.powi(-33) && error.y <= 2f64.powi(-32), "vertex {vertex}: {error}");
            let position = DVec3::from_array(std::array::from_fn(|i| {
                f64::from(gpu.position_high[i]) + f64::from(gpu.position_low[i])
            }));
            // 2^-48 of 6.4e6 m is 2e-8 m.
            assert!(position.distance(source.positions[vertex]) < 1e-7);
        }
    }

    #[test]
    fn a_single_float_would_miss_that_bound() {
        let s = 387.0 / 388.0_f64;
        assert!((f64::from(s as f32) - s).abs() > 2f64.powi(-33));
    }

    #[test]
    fn a_triangle_has_one_origin_and_small_positive_offsets() {
        let source = earth(388, 194).unwrap();
        let mesh = gpu_mesh(&source).unwrap();
        for triangle in mesh.indices.chunks_exact(3) {
            let origins: Vec<[u32; 2]> =
                triangle.iter().map(|&index| mesh.vertices[index as usize].origin).collect();
            assert!(origins.iter().all(|origin| *origin == origins[0]));
            assert!(origins[0].iter().all(|origin| origin % (1 << 22) == 0));
            for &index in triangle {
                let offset = mesh.vertices[index as usize].offset;
                assert!(offset.iter().all(|offset| (0.0..0.0078).contains(offset)), "{offset:?}");
            }
        }
    }

    #[test]
    fn the_last_texel_edge_stays_in_the_last_cell() {
        assert_eq!(origin_of(1.0), 1023 << 22);
        assert_eq!(origin_of(0.0), 0);
        assert_eq!(origin_of(0.5), 1 << 31);
    }

    #[test]
    fn a_bad_vertex_is_named() {
        let mut mesh = plane(1.0, 1.0, 1, 1).unwrap();
        mesh.coordinates[2].y = 1.000_001;
        assert!(matches!(gpu_mesh(&mesh), Err(MeshError::Coordinate { vertex: 2, .. })));
        mesh.coordinates[2].y = f64::NAN;
        assert!(matches!(gpu_mesh(&mesh), Err(MeshError::Coordinate { vertex: 2, .. })));
        mesh.coordinates[2].y = 1.0;
        mesh.positions[3].x = f64::INFINITY;
        assert!(matches!(gpu_mesh(&mesh), Err(MeshError::Position { vertex: 3, .. })));
        mesh.positions[3].x = 0.0;
        mesh.triangles[1][2] = 4;
        let wrong_index = MeshError::Index { triangle: 1, vertex: 4, count: 4 };
        assert_eq!(gpu_mesh(&mesh), Err(wrong_index));
    }

    #[test]
    fn an_empty_grid_is_refused() {
        assert!(earth(2, 10).is_err());
        assert!(earth(3, 2).is_ok());
        assert!(plane(1.0, f64::NAN, 1, 1).is_err());
        assert!(plane(1.0, 1.0, 0, 1).is_err());
        assert!(plane(1.0, 1.0, 1 << 14, 1 << 13).is_err());
    }
}

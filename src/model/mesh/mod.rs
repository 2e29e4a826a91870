//! Surfaces as triangles: the exact source mesh in f64, and its GPU form.
//!
//! One f32 is too coarse for a position on the earth (ulp 0.5 m) and for a texture coordinate on 2^20 texels (ulp 1/16
//! texel). So a GPU vertex stores its position as the sum of two floats. It stores its coordinate as a small offset
//! from an origin, which the three vertices of a triangle share.

mod clusters;
mod grid;
mod positions;

pub use clusters::{CLUSTER_TRIANGLES, Cluster};
pub use grid::{cylinder, earth, plane};
pub use positions::MeshPosition;

use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Origins are multiples of 2^-10 of the texture. With 388 x 194 quads on the earth, an offset in s stays below 2^-8
/// and rounds by at most 2^-33; an offset in t stays below 2^-7 and rounds by at most 2^-32. Both are 2^-13 texel of a
/// texture of 2^20 x 2^19 texels.
const ORIGIN_CELLS_LOG2: u32 = 10;

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
    /// shapes: a plane and the inside of a cylinder have no limb, and the curvature of other meshes is not known.
    pub curvature: f64,
}

/// A vertex as the GPU reads it, 40 bytes, no padding.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MeshVertex {
    /// World metres, rounded to the nearest float.
    pub position_high: [f32; 3],
    /// The rounding error of `position_high`. The sum of the two has a relative error of at most 2^-48 (2e-8 m on the
    /// earth).
    pub position_low: [f32; 3],
    /// Corner (s, t) of the triangle's cell in units of 2^-32: a multiple of 2^22, shared by the triangle's vertices.
    pub origin: [u32; 2],
    /// (s, t) - origin / 2^32. The rounding error is at most 2^-25 of the next larger power of two.
    pub offset: [f32; 2],
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
        let mut sums: HashMap<[u64; 3], DVec3> = HashMap::new();
        for face in self.indices.chunks_exact(3) {
            let [a, b, c] = [face[0], face[1], face[2]].map(|index| self.position(index));
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

/// Converts a mesh to its GPU form. It splits positions and gives each triangle its origin, the cell of its smallest s
/// and t. Triangles with equal (vertex, origin) share a vertex. Values are not checked: coordinates outside 0 ..= 1 and
/// values that are not finite are converted as they are.
///
/// # Panics
/// If a triangle names a vertex without a position or coordinate.
pub fn gpu_mesh(source: &SourceMesh) -> Mesh {
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
    mesh
}

/// Corner of the cell that contains a coordinate, in units of 2^-32; 1 and beyond are in the last cell. The cast
/// saturates, and NaN becomes 0.
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
        // For coordinates in 0 ..= 1 the difference is exact in f64: both are multiples of the coordinate's ulp.
        offset: std::array::from_fn(|i| (coordinate[i] - f64::from(origin[i]) / 4_294_967_296.0) as f32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_point_outward_including_the_seam_and_the_poles() {
        let mesh = gpu_mesh(&earth(64, 32));
        for (vertex, normal) in mesh.vertices.iter().zip(mesh.normals()) {
            let [up, normal] =
                [vertex.position_high, normal].map(|v| DVec3::from(v.map(f64::from)).normalize());
            // A quad spans 5.6 degrees, and the ellipsoid's normal differs by 0.2 degrees from the direction away from
            // the centre.
            assert!(up.dot(normal) > 4f64.to_radians().cos(), "{vertex:?}: {normal}");
        }
    }

    #[test]
    fn the_gpu_keeps_the_earths_coordinates_to_2_pow_minus_13_texel_and_positions_to_a_micrometre() {
        let source = earth(388, 194);
        let mesh = gpu_mesh(&source);
        for (&index, &vertex) in mesh.indices.iter().zip(source.triangles.as_flattened()) {
            let (gpu, vertex) = (&mesh.vertices[index as usize], vertex as usize);
            let axis = |i: usize| f64::from(gpu.origin[i]) / 4_294_967_296.0 + f64::from(gpu.offset[i]);
            let error = (DVec2::new(axis(0), axis(1)) - source.coordinates[vertex]).abs();
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
        let source = earth(388, 194);
        let mesh = gpu_mesh(&source);
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
}

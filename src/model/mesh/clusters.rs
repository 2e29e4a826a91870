//! Splits the mesh into clusters of consecutive triangles of the index buffer. A cluster has bounds of its positions
//! and normals, so a pass can cull it with one test (Shirman and Abi-Ezzi, "The cone of normals technique for fast
//! processing of curved patches", 1993).

use super::Mesh;
use glam::DVec3;

/// Two rows of 8 quads of our grids. Smaller clusters have tighter bounds, but there are more to test.
pub const CLUSTER_TRIANGLES: usize = 32;

/// Bounds of some triangles. If a position is not finite, the sphere's radius is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    pub first_index: u32,
    pub count: u32,
    /// Bounding sphere of all vertices, world metres.
    pub centre: DVec3,
    pub radius_m: f64,
    /// Unit vector; the normal of each triangle is at most [`Cluster::spread_rad`] from it.
    pub axis: DVec3,
    /// Above pi / 2 if the cone cannot cull anything.
    pub spread_rad: f64,
    /// Smallest altitude of the triangles (twice the area over the longest side), metres; 0 if one has no
    /// area.
    pub min_height_m: f64,
}

impl Mesh {
    /// All triangles in order, [`CLUSTER_TRIANGLES`] in each cluster except perhaps the last.
    pub fn clusters(&self) -> Vec<Cluster> {
        let runs = self.indices.chunks(3 * CLUSTER_TRIANGLES).enumerate();
        runs.map(|(n, run)| {
            let triangles: Vec<[DVec3; 3]> =
                run.chunks_exact(3).map(|t| [0, 1, 2].map(|c| self.position(t[c]))).collect();
            Cluster {
                first_index: (3 * CLUSTER_TRIANGLES * n) as u32,
                count: run.len() as u32,
                ..Cluster::about(&triangles)
            }
        })
        .collect()
    }

    /// A vertex's position as the GPU has it, without further rounding.
    pub(super) fn position(&self, index: u32) -> DVec3 {
        let vertex = &self.vertices[index as usize];
        DVec3::from_array(vertex.position_high.map(f64::from))
            + DVec3::from_array(vertex.position_low.map(f64::from))
    }
}

impl Cluster {
    fn about(triangles: &[[DVec3; 3]]) -> Cluster {
        let places = triangles.as_flattened();
        let (low, high) = places
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
        let centre = 0.5 * (low + high);
        // f64::max ignores NaN.
        let finite = places.iter().all(|place| place.is_finite());
        let radius = places.iter().map(|place| place.distance(centre)).fold(0.0, f64::max);
        let crosses = triangles.iter().map(|&[a, b, c]| (b - a).cross(c - a));
        let normals: Vec<DVec3> = crosses.map(DVec3::normalize_or_zero).collect();
        let axis = normals.iter().sum::<DVec3>().normalize_or_zero();
        let min_cosine = normals.iter().map(|normal| normal.dot(axis)).fold(1.0, f64::min);
        let heights = triangles.iter().map(min_height);
        Cluster {
            first_index: 0,
            count: 0,
            centre: if finite { centre } else { DVec3::ZERO },
            radius_m: if finite { radius } else { f64::INFINITY },
            axis,
            // The margin covers acos: near 1, a rounding error of 1e-16 in the cosine changes the angle by
            // about 1e-8.
            spread_rad: min_cosine.clamp(-1.0, 1.0).acos() + 1e-7,
            min_height_m: if finite { heights.fold(f64::INFINITY, f64::min) } else { 0.0 },
        }
    }
}

/// Smallest altitude: twice the area over the longest side; 0 without area.
fn min_height(&[a, b, c]: &[DVec3; 3]) -> f64 {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    if longest > 0.0 { (b - a).cross(c - a).length() / longest } else { 0.0 }
}

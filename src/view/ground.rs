//! The terrain height below the camera, for scenes on a plane whose ground is a progressive mesh. The camera
//! stays above the terrain.

use glam::{DVec2, DVec3};
use ortelius::paper::progressive_mesh::cache::live_faces;
use ortelius::paper::progressive_mesh::place::{Bounds, Placement};
use ortelius::paper::progressive_mesh::{self, LoadedMesh};
use ortelius::scene::camera::{Camera, Ground, GroundPoint};
use ortelius::scene::{Geometry, Scene};
use std::sync::Arc;
use std::sync::OnceLock;

/// Cells per side. In the shipped terrain a cell is 97 m wide, less than the smallest spacing of vertices (130 m).
const CELLS: usize = 1024;

/// The heights of a scene. A thread computes them once from the meshes.
pub struct GroundHeights {
    /// The scene, until the thread starts. The thread starts at the first motion of the camera, so that the window
    /// opens without delay.
    unread: Option<Scene>,
    heights: Arc<OnceLock<Vec<Heights>>>,
}

/// A grid of heights that are never below the mesh: for each cell, the highest vertex of all triangles whose bounding
/// boxes overlap it.
struct Heights {
    min: DVec2,
    cell: DVec2,
    /// Row by row from the south-west; -infinity for a cell without triangles.
    max_m: Vec<f64>,
}

impl GroundHeights {
    pub fn of(scene: &Scene) -> GroundHeights {
        let is_plane = scene.cameras.values().any(|camera| camera.place.ground() == Ground::Plane);
        let has_meshes =
            scene.surfaces.values().any(|surface| matches!(surface.geometry, Geometry::Other(_)));
        let unread = (is_plane && has_meshes).then(|| scene.clone());
        GroundHeights { unread, heights: Arc::default() }
    }

    /// On its first call, starts a thread that reads the meshes. Only meshes with a single instance count as
    /// ground.
    pub fn begin(&mut self) {
        let Some(scene) = self.unread.take() else { return };
        let heights = self.heights.clone();
        let read = move || {
            // A scene that fails to load is reported by the renderer.
            let models = progressive_mesh::load(&scene).unwrap_or_default();
            let grounds = models.iter().filter(|model| model.stands.len() == 1);
            let _set_once = heights.set(grounds.map(Heights::of).collect());
        };
        if let Err(error) = std::thread::Builder::new().name("terrain".to_owned()).spawn(read) {
            tracing::warn!("cannot compute the terrain's heights: {error}");
        }
    }

    /// Height of the terrain below a camera, in metres above the plane z = 0. It is 0 outside the meshes, and until
    /// the heights have been computed.
    pub fn height_m(&self, camera: &Camera) -> f64 {
        let GroundPoint::Plane { east_m, north_m } = camera.place else { return 0.0 };
        let heights = self.heights.get().into_iter().flatten();
        heights.map(|heights| heights.at(DVec2::new(east_m, north_m))).fold(0.0, f64::max)
    }
}

impl Heights {
    fn of(model: &LoadedMesh) -> Heights {
        let positions = &model.mesh.vertices.positions;
        let place = Placement::new(&model.surface, &Bounds::of(positions), &model.stands[0]);
        let world: Vec<DVec3> =
            positions.iter().map(|position| place.to_world(DVec3::from(position.map(f64::from)))).collect();
        Heights::new(&world, &live_faces(&model.mesh, model.mesh.last_level()))
    }

    fn new(vertices: &[DVec3], faces: &[[u32; 3]]) -> Heights {
        let min = vertices.iter().fold(DVec2::INFINITY, |min, at| min.min(at.truncate()));
        let max = vertices.iter().fold(DVec2::NEG_INFINITY, |max, at| max.max(at.truncate()));
        let cell = ((max - min) / CELLS as f64).max(DVec2::splat(f64::MIN_POSITIVE));
        let mut heights = Heights { min, cell, max_m: vec![f64::NEG_INFINITY; CELLS * CELLS] };
        for face in faces {
            let corners = face.map(|vertex| vertices[vertex as usize]);
            let min = corners.iter().fold(DVec3::INFINITY, |min, corner| min.min(*corner));
            let max = corners.iter().fold(DVec3::NEG_INFINITY, |max, corner| max.max(*corner));
            let [from, to] = [min, max].map(|corner| heights.cell_of(corner.truncate()));
            for row in from[1]..=to[1] {
                for cell in &mut heights.max_m[row * CELLS..][from[0]..=to[0]] {
                    *cell = cell.max(max.z);
                }
            }
        }
        heights
    }

    fn cell_of(&self, at: DVec2) -> [usize; 2] {
        // The cast clamps negative values to 0.
        ((at - self.min) / self.cell).to_array().map(|cells| (cells as usize).min(CELLS - 1))
    }

    fn at(&self, at: DVec2) -> f64 {
        let size = self.cell * CELLS as f64;
        let within = (at - self.min).cmpge(DVec2::ZERO).all() && (at - self.min).cmple(size).all();
        let [column, row] = self.cell_of(at);
        if within { self.max_m[row * CELLS + column] } else { f64::NEG_INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_never_below_the_triangles_and_minus_infinity_outside_them() {
        let corner = |x: f64, y: f64| DVec3::new(x, y, 100.0 * (0.01 * x).sin() + 0.3 * y);
        let vertices: Vec<DVec3> =
            (0..21 * 21).map(|n| corner(f64::from(n % 21) * 50.0, f64::from(n / 21) * 50.0)).collect();
        let square = |n: u32| [[n, n + 1, n + 21], [n + 1, n + 22, n + 21]];
        let faces: Vec<[u32; 3]> = (0..20 * 20).flat_map(|n| square(n / 20 * 21 + n % 20)).collect();
        let heights = Heights::new(&vertices, &faces);
        for face in &faces {
            let [a, b, c] = face.map(|vertex| vertices[vertex as usize]);
            for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.3], [0.5, 0.5]] {
                let at = a + (b - a) * u + (c - a) * v;
                assert!(heights.at(at.truncate()) >= at.z - 1e-9, "{at}");
            }
        }
        assert_eq!(heights.at(DVec2::new(-1.0, 5.0)), f64::NEG_INFINITY);
        assert_eq!(heights.at(DVec2::new(1001.0, 5.0)), f64::NEG_INFINITY);
    }
}

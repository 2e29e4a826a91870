//! Places instances on another surface, at the exact heights of that surface's full mesh.

use super::cache::live_faces;
use super::mesh::ProgressiveMesh;
use super::place::Placement;
use super::stand::Stand;
use glam::{DMat3, DVec2, DVec3};

/// The heights of a full mesh: its triangles in the mesh's own east-north-up frame, in a grid of cells.
pub struct Heights {
    origin: DVec3,
    axes: DMat3,
    corners: Vec<[DVec3; 3]>,
    min: DVec3,
    max: DVec3,
    /// Cells per side.
    side: usize,
    /// For each cell the triangles whose bounding box overlaps it.
    cells: Vec<Vec<u32>>,
}

impl Heights {
    pub fn new(mesh: &ProgressiveMesh, place: &Placement, stand: &Stand) -> Heights {
        let positions = &mesh.vertices.positions;
        let to_local = stand.axes.transpose();
        let local: Vec<DVec3> = positions
            .iter()
            .map(|position| {
                let world = place.to_world(DVec3::from(position.map(f64::from)));
                to_local * (world - stand.foot)
            })
            .collect();
        let faces = live_faces(mesh, mesh.last_level());
        let corners: Vec<[DVec3; 3]> =
            faces.iter().map(|face| face.map(|vertex| local[vertex as usize])).collect();
        let min = local.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let max = local.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        // About one triangle per cell.
        let side = ((corners.len() as f64).sqrt().ceil() as usize).clamp(1, 1024);
        let cells = vec![Vec::new(); side * side];
        let mut heights = Heights { origin: stand.foot, axes: stand.axes, corners, min, max, side, cells };
        for triangle in 0..heights.corners.len() {
            let [a, b, c] = heights.corners[triangle];
            for cell in heights.cells_of(a.min(b).min(c), a.max(b).max(c)) {
                heights.cells[cell].push(triangle as u32);
            }
        }
        heights
    }

    /// The cells that a box overlaps.
    fn cells_of(&self, min: DVec3, max: DVec3) -> impl Iterator<Item = usize> + use<> {
        let side = self.side;
        let cell = |at: f64, min: f64, max: f64| {
            let cells = (at - min) / (max - min) * side as f64;
            // The cast saturates, and turns NaN (0 / 0, if the mesh has no width) into cell 0.
            (cells as usize).min(side - 1)
        };
        let columns = cell(min.x, self.min.x, self.max.x)..=cell(max.x, self.min.x, self.max.x);
        let rows = cell(min.y, self.min.y, self.max.y)..=cell(max.y, self.min.y, self.max.y);
        rows.flat_map(move |row| columns.clone().map(move |column| row * side + column))
    }

    /// The foot of an instance at height `up_m` above the highest point of the mesh on the vertical through
    /// `stand`. `None` if the vertical misses the mesh.
    pub fn foot(&self, stand: &Stand, up_m: f64) -> Option<DVec3> {
        let to_local = self.axes.transpose();
        let (point, up) = (to_local * (stand.foot - self.origin), to_local * stand.axes.z_axis);
        // On an ellipsoid, the verticals of the instance and of the mesh differ. If they differ by more than 60
        // degrees, there is no foot.
        if up.z < 0.5 {
            return None;
        }
        // Projects along the vertical to the plane z = 0 of the mesh's own frame.
        let flat = |at: DVec3| (at - up * (at.z / up.z)).truncate();
        let [low, high] = [self.min.z, self.max.z].map(|z| point + up * ((z - point.z) / up.z));
        let (min, max) = (low.min(high), low.max(high));
        if max.x < self.min.x || max.y < self.min.y || min.x > self.max.x || min.y > self.max.y {
            return None;
        }
        let at = flat(point);
        let above = |triangle: &u32| {
            let corners = self.corners[*triangle as usize];
            let [a, b, c] = corners.map(flat);
            // Twice the signed area of the triangle between an edge and the point. Swapping the edge's ends negates the
            // area exactly, so no point falls between two neighbouring triangles.
            let area = |from: DVec2, to: DVec2| (from - at).perp_dot(to - at);
            let areas = DVec3::new(area(b, c), area(c, a), area(a, b));
            let inside = areas.min_element() >= 0.0 || areas.max_element() <= 0.0;
            let whole = areas.element_sum();
            (inside && whole != 0.0).then(|| {
                let z = areas.dot(DVec3::from(corners.map(|corner| corner.z))) / whole;
                (z - point.z) / up.z
            })
        };
        let triangles = self.cells_of(min, max).flat_map(|cell| &self.cells[cell]);
        let rise_m = triangles.filter_map(above).max_by(f64::total_cmp)?;
        Some(stand.foot + stand.axes.z_axis * (rise_m + up_m))
    }
}

//! The triangles around a hub, before a collapse and after it.

use super::hub::Hub;
use super::surface::{HubCorner, WorkingMesh};
use super::triangle::DistanceTriangle;
use glam::DVec3;

/// Cosine of the largest angle by which a face may turn, in one collapse and relative to the model: about 75 degrees.
const MIN_COSINE: f64 = 0.25;

/// The triangles against which every vanished position is tested. The lists are reused.
#[derive(Default)]
pub struct CollapseShape {
    /// The triangle of each of the hub's corners, the hub first.
    pub old: Vec<DistanceTriangle>,
    /// The normals of the old triangles, with length twice the area, and the unit normals of these faces in
    /// the model.
    normals: Vec<[DVec3; 2]>,
    /// The triangles after the collapse, by face: the fan around the end. If the fan is empty, the
    /// other faces at the end.
    pub new: Vec<(u32, DistanceTriangle)>,
    /// How many of [`Self::new`] are the fan.
    pub fan: usize,
    /// True if a face of the fan turns too far, or loses its area.
    pub flips: bool,
    /// For each corner the index in [`Self::new`] at which the search for the nearest triangle starts.
    heirs: Vec<u32>,
    /// For each face of the fan, the hub's corner that it replaces.
    parents: Vec<u32>,
}

impl CollapseShape {
    /// Reads the triangles around the hub. `normals` are those of the model's faces.
    pub fn look(&mut self, hub: &Hub, surface: &WorkingMesh, normals: &[DVec3]) {
        let point = surface.point(hub.position);
        self.old.clear();
        self.normals.clear();
        for &HubCorner { face, a, b, .. } in &hub.corners {
            let (a, b) = (surface.point(a), surface.point(b));
            let cross = (a - point).cross(b - point);
            self.old.push(DistanceTriangle::with_cross([point, a, b], cross));
            self.normals.push([cross, normals[face as usize]]);
        }
    }

    /// Computes the triangles after a collapse onto `end`.
    pub fn spread(&mut self, hub: &Hub, surface: &WorkingMesh, end: u32) {
        let to = surface.point(end);
        self.new.clear();
        self.heirs.clear();
        self.parents.clear();
        self.flips = false;
        for (index, corner) in hub.corners.iter().enumerate() {
            self.heirs.push(self.new.len() as u32);
            if corner.a == end || corner.b == end {
                continue;
            }
            let [_, a, b] = self.old[index].corners();
            let cross = (a - to).cross(b - to);
            let [old, first] = self.normals[index];
            self.flips |= (old != DVec3::ZERO && turns(old, cross, old.length_squared()))
                || (first != DVec3::ZERO && turns(first, cross, 1.0));
            self.new.push((corner.face, DistanceTriangle::with_cross([to, a, b], cross)));
            self.parents.push(index as u32);
        }
        self.fan = self.new.len();
        if self.fan == 0 {
            let beside = surface.corners(end).filter(|x| hub.is_not(x));
            self.new.extend(beside.map(|x| (x.face, DistanceTriangle::new(surface.triangle(x.face)))));
        }
        let last = self.new.len().saturating_sub(1) as u32;
        self.heirs.iter_mut().for_each(|heir| *heir = last.min(*heir));
    }

    /// The larger of `max` and the squared distance from a point near a corner to the nearest new triangle.
    pub fn raised_by_point(&self, max: f64, point: DVec3, corner: u32) -> f64 {
        raised(max, point, &self.new, self.heirs[corner as usize], |(_, triangle)| triangle)
    }

    /// The larger of `max` and the squared distance from a sample of a fan triangle to the nearest old
    /// triangle.
    pub fn raised_by_sample(&self, max: f64, sample: DVec3, index: usize) -> f64 {
        raised(max, sample, &self.old, self.parents[index], |triangle| triangle)
    }

    /// The old triangle that a face of the fan replaces.
    pub fn parent(&self, index: usize) -> usize {
        self.parents[index] as usize
    }

    /// The new face that inherits a corner's vanished positions, and the largest distance of the old face
    /// from it. The distance is convex, so a corner is farthest.
    pub fn heir(&self, corner: usize) -> (u32, f64) {
        let (face, triangle) = &self.new[self.heirs[corner] as usize];
        let squared = self.old[corner].corners().map(|point| triangle.squared_to(point));
        (*face, squared.into_iter().fold(0.0, f64::max).sqrt())
    }

    /// The squared distance from a point near a corner to the nearest new face (on a tie, the first), and its index in
    /// [`Self::new`].
    pub fn nearest(&self, point: DVec3, corner: u32) -> (f64, usize) {
        let heir = self.heirs[corner as usize] as usize;
        let mut min = (self.new[heir].1.squared_to(point), heir);
        for (index, (_, triangle)) in self.new.iter().enumerate() {
            if index != heir && !triangle.is_beyond(point, min.0) {
                let squared = triangle.squared_to(point);
                if squared < min.0 || (squared == min.0 && index < min.1) {
                    min = (squared, index);
                }
            }
        }
        min
    }

    /// The total area of the old triangles.
    pub fn area(&self) -> f64 {
        self.normals.iter().map(|[cross, _]| cross.length() / 2.0).sum()
    }
}

/// Points where a new triangle may be far from the old ones. The triangle's first corner is the target of the
/// collapse.
pub fn samples(triangle: &DistanceTriangle) -> [DVec3; 2] {
    let [to, a, b] = triangle.corners();
    [(to + a + b) / 3.0, (to + a) / 2.0]
}

/// The larger of `max` and the squared distance from a point to the nearest triangle. The search starts at
/// `first`, which is probably nearest.
fn raised<T>(
    max: f64,
    point: DVec3,
    triangles: &[T],
    first: u32,
    of: impl Fn(&T) -> &DistanceTriangle,
) -> f64 {
    let (before, after) = triangles.split_at(first as usize);
    // Nine of ten points are nearer than `max`, so their exact distances are not needed.
    if after.iter().chain(before).any(|item| of(item).at_most(point) <= max) {
        return max;
    }
    let mut min = f64::INFINITY;
    for triangle in after.iter().chain(before).map(of) {
        if !triangle.is_beyond(point, min) {
            min = min.min(triangle.squared_to(point));
        }
        if min <= max {
            return max;
        }
    }
    if min < f64::INFINITY { min } else { max }
}

/// True if the angle between two directions is too large, or the second has no length.
fn turns(first: DVec3, second: DVec3, first_squared: f64) -> bool {
    let dot = first.dot(second);
    dot <= 0.0 || dot * dot <= MIN_COSINE * MIN_COSINE * first_squared * second.length_squared()
}

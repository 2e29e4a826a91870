//! The triangles around a hub, before a collapse and after it.

use super::hub::Hub;
use super::lost::squared_to_triangle;
use super::surface::{Blade, Surface};
use glam::DVec3;

/// Triangles that are looked at many times, once for each vanished position; its lists are reused.
#[derive(Default)]
pub struct Shape {
    /// Of each of the hub's blades, the hub first.
    pub old: Vec<[DVec3; 3]>,
    /// What takes their place, by face: the fan around the end; or where a corner vanishes and leaves no fan, the faces
    /// beside it.
    pub new: Vec<(u32, [DVec3; 3])>,
    /// How many of [`Self::new`] are the fan.
    pub fan: usize,
    /// For each blade the first place in [`Self::new`] to look for what was near it.
    heirs: Vec<u32>,
}

impl Shape {
    /// Looks at the hub as it is.
    pub fn look(&mut self, hub: &Hub, surface: &Surface) {
        let point = surface.point(hub.position);
        let triangle = |x: &Blade| [point, surface.point(x.a), surface.point(x.b)];
        self.old.clear();
        self.old.extend(hub.blades.iter().map(triangle));
    }

    /// Looks at what a collapse onto `end` would leave.
    pub fn spread(&mut self, hub: &Hub, surface: &Surface, end: u32) {
        let to = surface.point(end);
        self.new.clear();
        self.heirs.clear();
        for (blade, [_, a, b]) in hub.blades.iter().zip(&self.old) {
            self.heirs.push(self.new.len() as u32);
            if blade.a != end && blade.b != end {
                self.new.push((blade.face, [to, *a, *b]));
            }
        }
        self.fan = self.new.len();
        if self.fan == 0 {
            let beside = surface.blades(end).filter(|x| hub.is_not(x));
            self.new.extend(beside.map(|x| (x.face, surface.triangle(x.face))));
        }
        let last = self.new.len().saturating_sub(1) as u32;
        self.heirs.iter_mut().for_each(|heir| *heir = last.min(*heir));
    }

    /// The larger of `most` and the squared distance from a point near a blade to the nearest new triangle.
    pub fn raised_by_point(&self, most: f64, point: DVec3, blade: u32) -> f64 {
        let heir = self.heirs[blade as usize] as usize;
        raised(most, point, self.new[heir..].iter().chain(&self.new[..heir]).map(|(_, triangle)| triangle))
    }

    /// The larger of `most` and the squared distance from a point to the nearest old triangle.
    pub fn raised_by_sample(&self, most: f64, sample: DVec3) -> f64 {
        raised(most, sample, self.old.iter())
    }

    /// The new face that is nearest to a point, and the squared distance.
    pub fn nearest(&self, point: DVec3) -> (f64, u32) {
        let near = self.new.iter().map(|&(face, triangle)| (squared_to_triangle(point, triangle), face));
        near.min_by(|x, y| x.0.total_cmp(&y.0)).expect("a collapse leaves faces around")
    }

    /// Half the sum of the old triangles' cross products.
    pub fn area(&self) -> f64 {
        self.old.iter().map(|[hub, a, b]| (a - hub).cross(b - hub).length() / 2.0).sum()
    }
}

/// Where a new triangle, whose first corner is the one that others moved to, may stand off the old ones.
pub fn samples([to, a, b]: [DVec3; 3]) -> [DVec3; 2] {
    [(to + a + b) / 3.0, (to + a) / 2.0]
}

fn raised<'a>(most: f64, point: DVec3, triangles: impl Iterator<Item = &'a [DVec3; 3]>) -> f64 {
    let mut least = f64::INFINITY;
    for &triangle in triangles {
        least = least.min(squared_to_triangle(point, triangle));
        if least <= most {
            return most;
        }
    }
    if least < f64::INFINITY { least } else { most }
}

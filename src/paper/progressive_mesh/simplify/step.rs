//! One collapse: whether it may be done, what it costs, and how far it leads away from the model.

use super::hub::{Kind, Link, Path, Spoke, WedgePairs};
use super::lost::{squared_to_segment, squared_to_triangle};
use super::sequence::{Rules, Sequence};
use super::surface::Blade;
use glam::DVec3;

/// Cosine of the most that a face may turn, in one collapse and from where it was in the model: about 75 degrees.
const LEAST_COSINE: f64 = 0.25;

/// How often the squared deviation, times the area that moves, counts beside the quadrics: 0, 0.3, 1, 3 and 10 give mean
/// errors of 0.97, 0.83, 0.82, 0.81 and 0.80 of `meshopt_simplify`'s on closed meshes; the Hausdorff distance is least from
/// 1 to 3.
const DEVIATION_WEIGHT: f64 = 3.0;

/// How many times dearer a collapse is that makes two sheets touch.
const PINCH_FACTOR: f64 = 4.0;

/// And one that turns a face too far, where that is allowed at all.
const FLIP_FACTOR: f64 = 100.0;

/// A collapse that may be done.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    pub spoke: Spoke,
    pub cost: f64,
    pub pairs: WedgePairs,
    pub link: Link,
    pub flips: bool,
}

/// What a position may do.
pub enum Found {
    Step(Step),
    /// Nothing that costs less; more was not asked.
    AtLeast(f64),
    Nothing,
}

impl Sequence<'_> {
    pub(super) fn quadric_cost(&self, from: u32, to: u32) -> f64 {
        let along = self.surface.point(to) - self.surface.point(from);
        self.quadrics[from as usize].at(along) + self.quadrics[to as usize].at_origin()
    }

    /// Where the hub may go.
    pub(super) fn path(&self) -> Path {
        if self.rules == Rules::Crossing { Path::Anywhere } else { self.hub.path() }
    }

    /// The cheapest collapse of a position; if all cost more than `patience`, only a bound.
    pub(super) fn best(&mut self, position: u32, patience: f64) -> Found {
        self.hub.look(&mut self.surface, position);
        let path = self.path();
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        for spoke in self.hub.spokes.iter().filter(|spoke| path.allows(spoke.kind)) {
            candidates.push((self.quadric_cost(position, spoke.end), *spoke));
        }
        candidates.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.end.cmp(&y.1.end)));
        self.gather_points();
        let (mut best, mut floor): (Option<Step>, _) = (None, f64::INFINITY);
        let area = self.area();
        for (least, spoke) in &candidates {
            let dearest = best.map_or(f64::INFINITY, |best| best.cost);
            if dearest <= *least {
                break;
            }
            let flips = self.flips(spoke.end);
            if flips && self.rules == Rules::Strict {
                continue;
            }
            let factor = if flips { FLIP_FACTOR } else { 1.0 };
            let limit = dearest.min(patience);
            let cost = factor * self.with_deviation(spoke, *least, area, limit / factor);
            if cost >= dearest {
                continue;
            }
            match self.allowed(spoke, cost, flips) {
                Some(step) if step.cost > patience => floor = floor.min(step.cost),
                Some(step) if step.cost < dearest => best = Some(step),
                _ => {}
            }
        }
        self.candidates = candidates;
        match best {
            Some(best) => Found::Step(best),
            None if floor < f64::INFINITY => Found::AtLeast(floor),
            None => Found::Nothing,
        }
    }

    pub(super) fn gather_points(&mut self) {
        let position = self.hub.position;
        let of = |p: u32| (p, self.surface.point(p));
        self.points.clear();
        self.points.push(of(position));
        for blade in &self.hub.blades {
            self.points.extend(self.lost.of_face(blade.face).map(of));
        }
        self.border_points.clear();
        if let Some([into, _]) = self.hub.border() {
            self.border_points.push(of(position));
            self.border_points.extend(self.lost.of_border(position).map(of));
            self.border_points.extend(self.lost.of_border(into.end).map(of));
        }
    }

    /// The collapse along a spoke, if it may be done.
    pub(super) fn allowed(&self, spoke: &Spoke, cost: f64, flips: bool) -> Option<Step> {
        let link = self.hub.link(&self.surface, spoke);
        let cost = if link == Link::Pinches { cost * PINCH_FACTOR } else { cost };
        let pairs = self.hub.wedge_pairs(&self.surface, spoke.end, self.rules == Rules::Crossing)?;
        (link != Link::Forbidden).then_some(Step { spoke: *spoke, cost, pairs, link, flips })
    }

    fn area(&self) -> f64 {
        let at = |p: u32| self.surface.point(p);
        let hub = at(self.hub.position);
        self.hub.blades.iter().map(|x| (at(x.a) - hub).cross(at(x.b) - hub).length() / 2.0).sum()
    }

    /// Whether a face that stays would turn too far, or lose its area.
    pub(super) fn flips(&self, end: u32) -> bool {
        let at = |p: u32| self.surface.point(p);
        let (hub, to) = (at(self.hub.position), at(end));
        self.hub.blades.iter().filter(|x| x.a != end && x.b != end).any(|x| {
            let (a, b) = (at(x.a), at(x.b));
            let (old, new) = ((a - hub).cross(b - hub), (a - to).cross(b - to));
            let lengths = (old.length_squared() * new.length_squared()).sqrt();
            let first = self.normals[x.face as usize];
            (old != DVec3::ZERO && old.dot(new) <= LEAST_COSINE * lengths)
                || (first != DVec3::ZERO && first.dot(new) <= LEAST_COSINE * new.length())
        })
    }

    /// The triangles that take the place of the hub's faces.
    fn fan(&self, end: u32) -> impl Iterator<Item = (u32, [DVec3; 3])> + Clone + '_ {
        let at = |p: u32| self.surface.point(p);
        let stays = move |x: &&Blade| x.a != end && x.b != end;
        self.hub.blades.iter().filter(stays).map(move |x| (x.face, [at(end), at(x.a), at(x.b)]))
    }

    /// Where the hub's points may go: the fan, or where a corner vanishes and leaves none, the faces beside it.
    pub(super) fn fan_or_beside(&self, end: u32) -> impl Iterator<Item = (u32, [DVec3; 3])> + Clone + '_ {
        let none = self.hub.blades.iter().all(|x| x.a == end || x.b == end);
        let beside = self.surface.blades(end).filter(move |x| none && self.hub.is_not(x));
        self.fan(end).chain(beside.map(|x| (x.face, self.surface.triangle(x.face))))
    }

    /// What a collapse costs with its deviation; stops where that exceeds `limit`.
    fn with_deviation(&self, spoke: &Spoke, least: f64, area: f64, limit: f64) -> f64 {
        let end = spoke.end;
        let factor = DEVIATION_WEIGHT * area;
        let enough = |most: f64| least + factor * most > limit;
        let mut most: f64 = 0.0;
        if let (Kind::Border, Some([into, out])) = (spoke.kind, self.hub.border()) {
            let edge = [into.end, out.end].map(|p| self.surface.point(p));
            most =
                self.border_points.iter().fold(most, |most, &(_, p)| most.max(squared_to_segment(p, edge)));
        }
        for &(_, point) in &self.points {
            if enough(most) {
                break;
            }
            most = raised(most, point, self.fan_or_beside(end).map(|(_, triangle)| triangle));
        }
        for sample in self.fan(end).flat_map(|(_, triangle)| samples(triangle)) {
            if enough(most) {
                break;
            }
            most = raised(most, sample, self.hub.blades.iter().map(|x| self.surface.triangle(x.face)));
        }
        least + factor * most
    }

    /// How far off the model the new faces are, each: as far as they are off the old ones and those were off the model,
    /// but no farther than to the vanished positions, which are the model's own.
    pub(super) fn off_model(&self, end: u32, off: &mut Vec<(u32, f64)>) {
        off.clear();
        for (face, triangle) in self.fan(end) {
            let of_sample = |sample: DVec3| {
                let old = self.hub.blades.iter().map(|x| {
                    let distance = squared_to_triangle(sample, self.surface.triangle(x.face)).sqrt();
                    distance + self.off_model[x.face as usize]
                });
                let points = self.points.iter().map(|(_, point)| point.distance(sample));
                old.chain(points).fold(f64::INFINITY, f64::min)
            };
            off.push((face, samples(triangle).into_iter().map(of_sample).fold(0.0, f64::max)));
        }
    }
}

/// Where a new triangle, whose first corner is the one that others moved to, may stand off the old ones.
fn samples([to, a, b]: [DVec3; 3]) -> [DVec3; 2] {
    [(to + a + b) / 3.0, (to + a) / 2.0]
}

/// The larger of `most` and the squared distance from a point to the nearest of some triangles.
fn raised(most: f64, point: DVec3, triangles: impl Iterator<Item = [DVec3; 3]>) -> f64 {
    let mut least = f64::INFINITY;
    for triangle in triangles {
        least = least.min(squared_to_triangle(point, triangle));
        if least <= most {
            return most;
        }
    }
    if least < f64::INFINITY { least } else { most }
}

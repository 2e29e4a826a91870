//! The sequence of collapses: the cheapest first, always.

use super::hub::{Hub, Kind, Spoke, WedgePairs};
use super::lost::{Lost, squared_to_segment, squared_to_triangle};
use super::quadric::Quadric;
use super::queue::Queue;
use super::surface::{Blade, Frame, Surface};
use super::{Collapses, Report, Simplified, SimplifyOptions};
use crate::scene::model::Model;
use glam::DVec3;

/// Of the planes that hold a border in place: times the squared length of its edge.
const BORDER_WEIGHT: f64 = 10.0;

/// Of those that hold a seam.
const SEAM_WEIGHT: f64 = 1.0;

/// Cosine of the most that a face may turn in one collapse, about 75 degrees.
const LEAST_COSINE: f64 = 0.25;

/// Above so many faces at a position its key is not renewed after each collapse beside it.
const MANY: usize = 64;

pub struct Sequence {
    options: SimplifyOptions,
    surface: Surface,
    frame: Frame,
    quadrics: Vec<Quadric>,
    lost: Lost,
    queue: Queue,
    hub: Hub,
    /// Vanished positions of the hub's faces, and the hub.
    points: Vec<(u32, DVec3)>,
    /// Those of the hub's border.
    border_points: Vec<(u32, DVec3)>,
    candidates: Vec<(f64, Spoke)>,
    /// Wedges of each position: `wedges[wedge_ends[p - 1] .. wedge_ends[p]]`.
    wedge_ends: Vec<u32>,
    wedges: Vec<u32>,
    /// Squared, in the simplifier's units.
    worst: f64,
    collapses: Collapses,
}

/// A collapse that may be done.
#[derive(Clone, Copy, Debug)]
struct Step {
    spoke: Spoke,
    cost: f64,
    /// Squared distance of the farthest vanished position.
    deviation: f64,
    pairs: WedgePairs,
}

impl Sequence {
    pub fn new(model: &Model, options: &SimplifyOptions) -> Sequence {
        let (surface, frame) = Surface::new(model);
        let positions = model.positions.len();
        let (wedge_ends, wedges) = wedges_of_positions(model);
        let mut sequence = Sequence {
            options: *options,
            quadrics: vec![Quadric::default(); positions],
            lost: Lost::new(positions, model.faces.len()),
            queue: Queue::new(positions),
            hub: Hub::new(positions),
            points: Vec::new(),
            border_points: Vec::new(),
            candidates: Vec::new(),
            surface,
            frame,
            wedge_ends,
            wedges,
            worst: 0.0,
            collapses: Collapses::default(),
        };
        sequence.start();
        sequence
    }

    fn start(&mut self) {
        for face in 0..self.surface.faces() as u32 {
            let [a, b, c] = self.surface.triangle(face);
            let normal = (b - a).cross(c - a);
            let double_area = normal.length();
            if double_area > 0.0 {
                for position in self.surface.face(face) {
                    let to_plane = a - self.surface.point(position);
                    let plane = Quadric::plane(normal / double_area, to_plane, double_area / 6.0);
                    self.quadrics[position as usize].add(&plane);
                }
            }
        }
        for position in 0..self.quadrics.len() as u32 {
            self.hub.look(&mut self.surface, position);
            let marked = self.hub.spokes.iter().filter(|spoke| spoke.kind != Kind::Plain);
            for spoke in marked {
                let weight = if spoke.kind == Kind::Seam { SEAM_WEIGHT } else { BORDER_WEIGHT };
                let along = self.surface.point(spoke.end) - self.surface.point(position);
                for blade in self.hub.blades.iter().filter(|x| x.a == spoke.end || x.b == spoke.end) {
                    let [a, b, c] = self.surface.triangle(blade.face);
                    let across = (b - a).cross(c - a).cross(along).normalize_or_zero();
                    let plane = Quadric::plane(across, DVec3::ZERO, weight * along.length_squared());
                    self.quadrics[position as usize].add(&plane);
                }
            }
        }
        (0..self.quadrics.len() as u32).for_each(|position| self.renew(position));
    }

    /// Gives a position the key that no collapse of it can fall below.
    fn renew(&mut self, position: u32) {
        self.hub.look(&mut self.surface, position);
        let path = self.hub.path();
        let allowed = self.hub.spokes.iter().filter(|spoke| path.allows(spoke.kind));
        let least = allowed.map(|spoke| self.quadric_cost(position, spoke.end)).min_by(f64::total_cmp);
        match least {
            Some(least) => self.queue.set(position, least),
            None => self.queue.remove(position),
        }
    }

    fn quadric_cost(&self, from: u32, to: u32) -> f64 {
        let along = self.surface.point(to) - self.surface.point(from);
        self.quadrics[from as usize].at(along) + self.quadrics[to as usize].at_origin()
    }

    /// The cheapest collapse of a position.
    fn best(&mut self, position: u32) -> Option<Step> {
        self.hub.look(&mut self.surface, position);
        let path = self.hub.path();
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        for spoke in self.hub.spokes.iter().filter(|spoke| path.allows(spoke.kind)) {
            candidates.push((self.quadric_cost(position, spoke.end), *spoke));
        }
        candidates.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.end.cmp(&y.1.end)));
        self.gather_points();
        let mut best: Option<Step> = None;
        for (least, spoke) in &candidates {
            if best.is_some_and(|best| best.cost <= *least) {
                break;
            }
            if let Some(step) = self.step(spoke, *least)
                && best.is_none_or(|best| step.cost < best.cost)
            {
                best = Some(step);
            }
        }
        self.candidates = candidates;
        best
    }

    fn gather_points(&mut self) {
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
    fn step(&self, spoke: &Spoke, least: f64) -> Option<Step> {
        let pairs = self.hub.wedge_pairs(&self.surface, spoke)?;
        if !self.hub.keeps_surface(&self.surface, spoke) || self.flips(spoke.end) {
            return None;
        }
        let deviation = self.deviation(spoke);
        Some(Step { spoke: *spoke, cost: least, deviation, pairs })
    }

    /// Whether a face that stays would turn too far, or lose its area.
    fn flips(&self, end: u32) -> bool {
        let at = |p: u32| self.surface.point(p);
        let (hub, to) = (at(self.hub.position), at(end));
        self.hub.blades.iter().filter(|x| x.a != end && x.b != end).any(|x| {
            let (a, b) = (at(x.a), at(x.b));
            let (old, new) = ((a - hub).cross(b - hub), (a - to).cross(b - to));
            let lengths = (old.length_squared() * new.length_squared()).sqrt();
            old != DVec3::ZERO && old.dot(new) <= LEAST_COSINE * lengths
        })
    }

    /// The triangles that take the place of the hub's faces.
    fn fan(&self, end: u32) -> impl Iterator<Item = (u32, [DVec3; 3])> + '_ {
        let at = |p: u32| self.surface.point(p);
        let stays = move |x: &&Blade| x.a != end && x.b != end;
        self.hub.blades.iter().filter(stays).map(move |x| (x.face, [at(end), at(x.a), at(x.b)]))
    }

    /// Squared distance to the farthest vanished position after a collapse along a spoke.
    fn deviation(&self, spoke: &Spoke) -> f64 {
        let end = spoke.end;
        let mut most: f64 = 0.0;
        for &(_, point) in &self.points {
            let nearest = self.fan(end).map(|(_, triangle)| squared_to_triangle(point, triangle));
            most = most.max(nearest.min_by(f64::total_cmp).unwrap_or(0.0));
        }
        if let (Kind::Border, Some([into, out])) = (spoke.kind, self.hub.border()) {
            let edge = [into.end, out.end].map(|p| self.surface.point(p));
            most =
                self.border_points.iter().fold(most, |most, &(_, p)| most.max(squared_to_segment(p, edge)));
        }
        most
    }

    /// Collapses until there are few enough faces, or nothing is left that may collapse.
    pub fn run(&mut self, progress: &mut dyn FnMut(usize, usize)) {
        let total = self.surface.faces().saturating_sub(self.options.target_faces);
        let mut told = 0;
        while self.surface.live() > self.options.target_faces {
            let Some(position) = self.queue.pop() else { break };
            let Some(step) = self.best(position) else { continue };
            if self.queue.least_key().is_some_and(|key| key < step.cost) {
                self.queue.set(position, step.cost);
                continue;
            }
            self.execute(&step);
            let removed = self.surface.faces() - self.surface.live();
            if removed - told > total / 256 {
                progress(removed, total);
                told = removed;
            }
        }
    }

    /// Does the collapse that was found at the hub just looked at.
    fn execute(&mut self, step: &Step) {
        let (position, end) = (self.hub.position, step.spoke.end);
        self.move_points(step);
        let (gone, stay): (Vec<Blade>, Vec<Blade>) =
            self.hub.blades.iter().partition(|x| x.a == end || x.b == end);
        gone.iter().for_each(|blade| self.surface.remove(blade.face));
        let wedge = |wedge| step.pairs.target(wedge).expect("a wedge of the hub lies on the spoke's faces");
        self.surface.replace(position, end, &stay, wedge);
        let along = self.surface.point(end) - self.surface.point(position);
        let moved = self.quadrics[position as usize].about(along);
        self.quadrics[end as usize].add(&moved);
        self.worst = self.worst.max(step.deviation);
        self.collapses.errors.push(self.frame.outside(self.worst.sqrt()));
        let fallback = step.pairs.any();
        let wedges =
            self.wedges_at(position).map(|wedge| [wedge, step.pairs.target(wedge).unwrap_or(fallback)]);
        let wedges: Vec<[u32; 2]> = wedges.collect();
        self.collapses.wedges.push(wedges);
        self.collapses.faces.push(gone.iter().map(|blade| blade.face));
        let around: Vec<u32> = self.hub.spokes.iter().map(|spoke| spoke.end).collect();
        for neighbour in around {
            if self.surface.valence(neighbour) <= MANY || !self.queue.contains(neighbour) {
                self.renew(neighbour);
            }
        }
    }

    fn wedges_at(&self, position: u32) -> impl Iterator<Item = u32> + '_ {
        let start = if position == 0 { 0 } else { self.wedge_ends[position as usize - 1] };
        self.wedges[start as usize..self.wedge_ends[position as usize] as usize].iter().copied()
    }

    /// Vanished positions, and the hub, go to the faces that are nearest.
    fn move_points(&mut self, step: &Step) {
        let end = step.spoke.end;
        self.hub.blades.iter().for_each(|blade| self.lost.clear_face(blade.face));
        for index in 0..self.points.len() {
            let (position, point) = self.points[index];
            let near = self.fan(end).map(|(face, triangle)| (squared_to_triangle(point, triangle), face));
            if let Some((_, face)) = near.min_by(|x, y| x.0.total_cmp(&y.0)) {
                self.lost.give_to_face(position, face);
            }
        }
        if let (Kind::Border, Some([into, _])) = (step.spoke.kind, self.hub.border()) {
            self.lost.clear_border(self.hub.position);
            self.lost.clear_border(into.end);
            let start = if into.end == end { end } else { into.end };
            self.border_points.iter().for_each(|&(position, _)| self.lost.give_to_border(position, start));
        }
    }

    pub fn finish(self) -> Simplified {
        let report = Report { target_faces: self.options.target_faces, faces: self.surface.live() };
        Simplified { collapses: self.collapses, report }
    }
}

/// The wedges of each position, one position's after the other's, and where each position's end.
fn wedges_of_positions(model: &Model) -> (Vec<u32>, Vec<u32>) {
    let mut ends = vec![0; model.positions.len()];
    model.wedge_positions.iter().for_each(|&position| ends[position as usize] += 1);
    let mut sum = 0;
    for end in &mut ends {
        sum += *end;
        *end = sum;
    }
    let mut wedges = vec![0; model.wedge_positions.len()];
    let mut next = ends.clone();
    for (wedge, &position) in model.wedge_positions.iter().enumerate().rev() {
        next[position as usize] -= 1;
        wedges[next[position as usize] as usize] = wedge as u32;
    }
    (ends, wedges)
}

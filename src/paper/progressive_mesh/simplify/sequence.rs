//! The sequence of collapses, cheapest first. A collapse changes costs nearby; they are recomputed lazily, when the old
//! cost reaches the head of the queue. Costs rarely fall, so few collapses come late. Lazy updates need three fifths of
//! the cost evaluations of immediate updates.

use super::borders::BorderRadii;
use super::components::{Component, lesser_components};
use super::curve::Curve;
use super::hub::{Hub, Link, RingEdge, WedgePairs};
use super::lattice::Lattice;
use super::lost::{LostPositions, MAX_AT_BORDER};
use super::original::{ModelFaces, NearFaces};
use super::pace::DeviationKeys;
use super::quadric::Quadric;
use super::queue::{Queue, Ties};
use super::shape::CollapseShape;
use super::start::{ShadingAttributes, SpecialEdges, normals, quadrics};
use super::stated::stated;
use super::surface::{HubCorner, Normalisation, WorkingMesh};
use super::wedges::{WedgeLists, nearest_wedge};
use super::{Collapses, NOWHERE, Simplified, SimplifyOptions, SimplifyReport};
use crate::model::Model;
use crate::paper::progressive_mesh::choices::{BuildEffort, ErrorMetric};
use glam::DVec3;
use std::hint::black_box;

/// Why a target was not reached.
pub const SHORTFALL: &str =
    "only the largest component is left, and every further collapse would merge two faces or leave no face";

/// The simplifier's state. Positions and faces are numbered along the curve; the result has the model's
/// numbers.
pub struct Sequence<'a> {
    pub(super) model: &'a Model,
    curve: Curve,
    pub(super) options: SimplifyOptions,
    pub(super) rules: Rules,
    pub(super) surface: WorkingMesh,
    units: Normalisation,
    /// Each face's normal in the model; zero if it has no area.
    pub(super) normals: Vec<DVec3>,
    pub(super) quadrics: Vec<Quadric>,
    /// Set if errors count normals and texture coordinates.
    pub(super) shading: Option<ShadingAttributes>,
    /// Vanished positions and points of special edges by face, and vanished positions by border edge.
    pub(super) lost: LostPositions,
    pub(super) lost_of_border: LostPositions,
    /// For each face an upper bound of its distance from the model.
    pub(super) off_model: Vec<f64>,
    /// Set with [`BuildEffort::Best`]: distances from the model are measured to its own faces.
    pub(super) model_faces: Option<ModelFaces>,
    queue: Queue,
    /// Positions that have more collapses from a deviation on, which is their key here.
    waiting: Queue,
    /// For each position the collapse whose cost is its key.
    exact: Vec<ExactKey>,
    pub(super) hub: Hub,
    /// The hub, and the vanished positions of its faces.
    pub(super) points: Vec<Near>,
    /// [`Self::points`] and the hub's neighbours; empty without [`Self::model_faces`].
    pub(super) model_points: Vec<(u32, DVec3)>,
    /// The model's faces around each of [`Self::model_points`].
    pub(super) near_faces: NearFaces,
    /// The points of a new face that may be farther from the model than all points before.
    pub(super) lattice: Lattice,
    /// Parts into which the sides of a new face are divided when its distance is measured: see `original.rs`.
    pub(super) parts: u32,
    /// For each of the hub's corners the face's value of [`Self::off_model`].
    pub(super) old_off: Vec<f64>,
    pub(super) shape: CollapseShape,
    /// The hub, and the vanished positions of its border edges.
    pub(super) border_points: Vec<(u32, DVec3)>,
    pub(super) candidates: Vec<(f64, RingEdge)>,
    pub(super) off: Vec<(u32, f64)>,
    /// Positions whose keys must be renewed.
    around: Vec<u32>,
    pub(super) wedges: WedgeLists,
    /// The components that have not vanished, in order of decreasing extent, without the largest one.
    components: Vec<Component>,
    /// Faces left after each collapse.
    left: Vec<usize>,
    /// Set in the second pass (see `pace.rs`).
    pub(super) pace: Option<DeviationKeys>,
    /// For each collapse the largest key so far and the deviation.
    log: Vec<[f64; 2]>,
    collapses: Collapses,
    pub(super) report: SimplifyReport,
}

/// The collapse whose cost is a position's key.
#[derive(Clone, Copy)]
struct ExactKey {
    /// The collapse's target; [`NOWHERE`] if the key is only a bound.
    to: u32,
    /// True if the key counts the new faces' distances from the model and the shift of the texture at many of their
    /// points (second pass only). They are computed last, because most keys become invalid before their positions reach
    /// the head of the queue.
    is_paced: bool,
    /// The quadric part of the cost.
    quadrics: f64,
}

impl ExactKey {
    const NONE: ExactKey = ExactKey { to: NOWHERE, is_paced: false, quadrics: 0.0 };
}

/// The permitted collapses. Each phase permits more than the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rules {
    /// Only collapses whose damage is measured as a deviation.
    Strict,
    /// Also collapses that turn faces too far.
    Folding,
    /// Also collapses that leave a border or seam, and collapses of positions where borders or seams end or
    /// cross.
    Crossing,
    /// Also collapses that make two sheets share an edge where they are far apart, or that uncover a long edge; every
    /// other collapse comes first.
    Pinching,
}

/// The least key of a collapse that comes last. Costs are squared distances times areas, in units in which the model
/// has a size of about 1, and far less than this.
const MIN_LAST: f64 = 1e50;

/// A collapse that is allowed, or one that was not checked.
#[derive(Clone, Copy, Debug)]
pub struct CollapseCandidate {
    pub edge: RingEdge,
    pub cost: f64,
    pub flips: bool,
    /// No pairs if not checked.
    pub pairs: WedgePairs,
    /// [`Link::Unchanged`] if not checked.
    pub link: Link,
    /// True if it pinches a loop that is wider than the deviation, or uncovers an edge by more than the deviation.
    /// False if not checked.
    pub comes_last: bool,
}

impl CollapseCandidate {
    pub fn unchecked(edge: &RingEdge, cost: f64, flips: bool) -> CollapseCandidate {
        let (pairs, link, comes_last) = (WedgePairs::NONE, Link::Unchanged, false);
        CollapseCandidate { edge: *edge, cost, flips, pairs, link, comes_last }
    }

    /// The key in the queue: the cost. Collapses that come last are in order of their costs.
    pub fn key(&self) -> f64 {
        if self.comes_last { self.cost.max(1e-50) * (MIN_LAST * 1e50) } else { self.cost }
    }
}

/// What [`Sequence::best`] examines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Examined {
    /// Costs alone: the collapse may not be allowed.
    Cost,
    /// Also whether a collapse is allowed.
    Allowed,
    /// Also the distances of the new faces from the model: see [`Sequence::paced`].
    Paced,
}

/// A position that has vanished or is about to, or a point of a special edge.
#[derive(Clone, Copy, Debug)]
pub struct Near {
    pub position: u32,
    pub point: DVec3,
    /// The corner of the hub to which it is assigned; arbitrary for the hub itself.
    pub corner: u32,
}

impl<'a> Sequence<'a> {
    pub fn new(
        model: &'a Model,
        options: &SimplifyOptions,
        parts: u32,
        pace: Option<DeviationKeys>,
    ) -> Sequence<'a> {
        let curve = Curve::of(model);
        let (mut surface, units) = WorkingMesh::new(model, &curve);
        let positions = model.positions.len();
        let mut hub = Hub::new(positions);
        let normals = normals(&surface);
        let edges = SpecialEdges::of(&mut surface, &mut hub, positions, &normals);
        let quadrics = quadrics(&mut surface, &mut hub, positions);
        hub.borders = BorderRadii::new(&edges.borders, &surface, positions);
        let wedges = WedgeLists::new(model, &curve);
        surface.add_points(edges.points.iter().map(|(_, point)| *point));
        let mut sequence = Sequence {
            model,
            options: *options,
            rules: Rules::Strict,
            quadrics,
            shading: (options.metric == ErrorMetric::Appearance)
                .then(|| ShadingAttributes::of(model, &surface, &wedges, positions)),
            lost: LostPositions::at_faces(positions, model.faces.len(), &edges.points),
            lost_of_border: LostPositions::new(positions, positions, MAX_AT_BORDER),
            off_model: vec![0.0; model.faces.len()],
            model_faces: (options.effort == BuildEffort::Best).then(|| ModelFaces::of(&surface, positions)),
            queue: Queue::new(positions, Ties { seed: options.seed }),
            waiting: Queue::new(positions, Ties { seed: options.seed }),
            exact: vec![ExactKey::NONE; positions],
            hub,
            points: Vec::new(),
            model_points: Vec::new(),
            near_faces: NearFaces::default(),
            lattice: Lattice::default(),
            parts,
            old_off: Vec::new(),
            shape: CollapseShape::default(),
            border_points: Vec::new(),
            candidates: Vec::new(),
            off: Vec::new(),
            around: Vec::new(),
            wedges,
            curve,
            components: lesser_components(&surface, positions),
            normals,
            surface,
            units,
            left: Vec::new(),
            pace,
            log: Vec::new(),
            collapses: Collapses { metric: Some(options.metric), ..Collapses::default() },
            report: SimplifyReport {
                target_faces: options.target_faces,
                seed: options.seed,
                ..SimplifyReport::default()
            },
        };
        edges.borders.iter().for_each(|&[position, _]| sequence.wait(position, f64::INFINITY));
        sequence.renew_all();
        sequence
    }

    /// Has a position renewed once the deviation reaches `enough` or the radius of its borders.
    pub(super) fn wait(&mut self, position: u32, enough: f64) {
        let radius = Some(self.hub.borders.at(position)).filter(|radius| *radius > self.deviation());
        let enough = enough.min(radius.unwrap_or(f64::INFINITY));
        if enough < f64::INFINITY {
            self.waiting.set(position, enough);
        }
    }

    /// The largest deviation so far, in the simplifier's units.
    pub(super) fn deviation(&self) -> f64 {
        self.hub.borders.deviation
    }

    fn raise_deviation(&mut self, deviation: f64) {
        let max = &mut self.hub.borders.deviation;
        *max = max.max(deviation);
    }

    fn renew_all(&mut self) {
        for position in 0..self.quadrics.len() as u32 {
            if self.surface.valence(position) > 0 {
                self.renew(position);
            }
        }
    }

    /// Sets a position's key to a lower bound of the costs of its collapses.
    fn renew(&mut self, position: u32) {
        self.exact[position as usize] = ExactKey::NONE;
        if self.is_heavy(position) {
            return self.queue.remove(position);
        }
        self.hub.look(&mut self.surface, position);
        self.report.looks += self.hub.corners.len();
        match self.ways().map(|edge| self.quadric_cost(position, edge.end)).min_by(f64::total_cmp) {
            Some(min) => self.queue.set(position, min),
            None => {
                self.queue.remove(position);
                self.wait(position, f64::INFINITY);
            }
        }
    }

    /// Collapses until the target is reached or no collapse is possible.
    pub fn run(&mut self, progress: &mut dyn FnMut(usize, usize)) {
        let total = self.surface.faces().saturating_sub(self.options.target_faces);
        let mut reported = 0;
        while self.surface.live() > self.options.target_faces {
            if !self.next() {
                break;
            }
            let removed = self.surface.faces() - self.surface.live();
            if removed - reported > total / 256 {
                progress(removed.min(total), total);
                reported = removed;
            }
        }
    }

    /// One step towards the target; false if none is possible.
    fn next(&mut self) -> bool {
        if self.components.last().is_some_and(|component| component.extent <= self.deviation()) {
            self.remove_component();
            return true;
        }
        if self.waiting.min_key().is_some_and(|enough| enough <= self.deviation()) {
            let waiting = self.waiting.pop().filter(|&position| self.surface.valence(position) > 0);
            waiting.into_iter().for_each(|position| self.renew(position));
            return true;
        }
        let key = self.queue.min_key();
        let (Some(position), Some(key)) = (self.queue.pop(), key) else { return self.relax() };
        let next_key = self.queue.min_key().unwrap_or(f64::INFINITY);
        self.touch(position);
        let known = self.known(position, key);
        let mut is_paced = known.is_some() && self.exact[position as usize].is_paced;
        let mut step = known.or_else(|| self.cheapest(position, next_key));
        if !is_paced && step.is_some_and(|step| step.key() <= next_key && !self.keeps_pace(&step, next_key)) {
            is_paced = true;
            step = self.best(position, Examined::Paced);
        }
        match step {
            Some(step) if step.key() <= next_key => self.execute(&step),
            Some(step) => {
                let to = step.edge.end;
                let quadrics = self.quadric_cost(position, to);
                self.exact[position as usize] = ExactKey { to, is_paced, quadrics };
                self.queue.set(position, step.key());
            }
            None => {}
        }
        true
    }

    /// Reads what the next steps need of the position's faces and neighbours. Most of it is not in the CPU cache. Here the
    /// reads are independent, so the core waits for all of them at once; later it would wait for one after the other.
    /// One pass over the dragon takes an eighth less time.
    fn touch(&self, position: u32) {
        let (mut numbers, mut indices) = (self.quadrics[position as usize].touch(), 0);
        for HubCorner { face, a, .. } in self.surface.corners(position) {
            numbers += self.normals[face as usize].x + self.off_model[face as usize];
            numbers += self.quadrics[a as usize].touch() + self.surface.point(a).x;
            indices ^= self.lost.touch(face) ^ self.surface.touch(a);
        }
        black_box((numbers, indices));
    }

    /// The collapse whose cost is the position's key, if it is allowed. The position's own faces are
    /// unchanged, but the faces around them may have changed.
    fn known(&mut self, position: u32, key: f64) -> Option<CollapseCandidate> {
        let ExactKey { to, quadrics, .. } = self.exact[position as usize];
        if to == NOWHERE
            || key >= MIN_LAST
            || self.is_heavy(position)
            || self.quadric_cost(position, to) != quadrics
        {
            return None;
        }
        self.look(position);
        let edge = *self.hub.edge_to(to)?;
        self.shape.spread(&self.hub, &self.surface, to);
        let step = self.allowed(&edge, key, self.shape.flips).ok()?;
        self.gather_points();
        (step.link == Link::Unchanged && !step.comes_last).then_some(step)
    }

    /// Called when no collapse is allowed: relaxes the rules, or removes the smallest component. False at the end.
    fn relax(&mut self) -> bool {
        self.rules = match self.rules {
            Rules::Strict => Rules::Folding,
            Rules::Folding => Rules::Crossing,
            Rules::Crossing => Rules::Pinching,
            Rules::Pinching if self.components.is_empty() => {
                self.report.shortfall = Some(SHORTFALL);
                return false;
            }
            Rules::Pinching => {
                self.remove_component();
                return true;
            }
        };
        self.renew_all();
        true
    }

    fn push_deviation(&mut self) {
        self.collapses.errors.push(self.deviation());
        self.left.push(self.surface.live());
    }

    /// For each collapse of a position onto another: the largest key so far, and the deviation.
    pub fn log(&self) -> &[[f64; 2]] {
        &self.log
    }

    /// Removes the smallest component.
    fn remove_component(&mut self) {
        let component = self.components.pop().expect("the caller checked that a component is left");
        let live: Vec<u32> = component.faces.into_iter().filter(|&face| self.surface.is_live(face)).collect();
        let mut positions: Vec<u32> = live.iter().flat_map(|&face| self.surface.face(face)).collect();
        positions.sort_unstable();
        positions.dedup();
        let wedges = positions.iter().flat_map(|&position| self.wedges.of(position));
        self.collapses.wedges.push(wedges.map(|&wedge| [wedge, NOWHERE]));
        live.iter().for_each(|&face| self.surface.remove(face));
        positions.iter().for_each(|&position| self.queue.remove(position));
        self.collapses.faces.push(live.iter().map(|&face| self.curve.faces[face as usize]));
        self.raise_deviation(component.extent);
        self.push_deviation();
        self.report.components += 1;
    }

    /// Executes a collapse at the current hub.
    fn execute(&mut self, step: &CollapseCandidate) {
        let (position, end) = (self.hub.position, step.edge.end);
        let deviation = self.measure(step);
        self.raise_deviation(deviation);
        let key = self.log.last().map_or(0.0, |last| last[0]);
        self.log.push([key.max(step.cost), deviation]);
        let (gone, stay): (Vec<HubCorner>, Vec<HubCorner>) =
            self.hub.corners.iter().partition(|x| x.a == end || x.b == end);
        gone.iter().for_each(|corner| self.surface.remove(corner.face));
        let choices = self.wedges.of(end);
        let target =
            |wedge| step.pairs.target(wedge).unwrap_or_else(|| nearest_wedge(self.model, wedge, choices));
        self.surface.replace(position, end, &stay, target);
        let along = self.surface.point(end) - self.surface.point(position);
        let moved = self.quadrics[position as usize].about(along);
        self.quadrics[end as usize].add(&moved);
        self.collapses.wedges.push(self.wedges.of(position).iter().map(|&wedge| [wedge, target(wedge)]));
        self.collapses.faces.push(gone.iter().map(|corner| self.curve.faces[corner.face as usize]));
        self.push_deviation();
        self.hub.borders.pass_on(position, end);
        self.report.count(step, self.rules);
        self.around.extend(self.hub.edges.iter().map(|edge| edge.end));
        while let Some(neighbour) = self.around.pop() {
            match self.queue.key(neighbour) {
                // Costs rarely fall, so the neighbour's cost is recomputed only when it reaches the head of the
                // queue. A neighbour whose collapse comes last, or that has none, is renewed at once, because another
                // collapse may have become possible.
                Some(key) if key < MIN_LAST => self.exact[neighbour as usize] = ExactKey::NONE,
                _ => self.renew(neighbour),
            }
        }
    }

    pub fn finish(mut self) -> Simplified {
        self.report.faces = self.surface.live();
        let stated = stated(&self.collapses.errors, &self.left);
        self.collapses.errors = stated.into_iter().map(|error| self.units.outside(error)).collect();
        Simplified { collapses: self.collapses, report: self.report }
    }
}

impl SimplifyReport {
    fn count(&mut self, step: &CollapseCandidate, rules: Rules) {
        self.collapses += 1;
        self.closed_holes += usize::from(step.link == Link::Closes);
        self.pinches += usize::from(step.link == Link::Pinches);
        self.flips += usize::from(step.flips);
        self.crossing += usize::from(rules >= Rules::Crossing);
    }
}

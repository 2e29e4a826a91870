//! The mesh during simplification: its faces, and the corners at each position.

use super::curve::Curve;
use crate::model::Model;
use glam::DVec3;

/// End of a list of corners.
const END: u32 = u32::MAX;

/// Marks a face that has been removed.
const GONE: [u32; 3] = [u32::MAX; 3];

/// Any set of triangles over the model's positions. Positions and faces are numbered along a [`Curve`].
/// Corner `3 f + k` is corner k of face f.
pub struct WorkingMesh {
    /// First the positions, then points of [`Self::add_points`], in the simplifier's own units: see [`Normalisation`].
    points: Vec<DVec3>,
    /// Positions of each face's corners.
    faces: Vec<[u32; 3]>,
    /// Wedges of each face's corners.
    wedges: Vec<[u32; 3]>,
    /// The first corner at each position. Corners of removed faces stay in the list until [`Self::gather`].
    first: Vec<u32>,
    /// The next corner at the same position.
    next: Vec<u32>,
    /// Live faces at each position.
    valence: Vec<u32>,
    /// How many faces are live.
    live: usize,
    /// True if some position has several wedges.
    has_seams: bool,
}

/// Conversion from object units to the simplifier's units, in which the mesh has a size of about 1 around its
/// median position. A distant origin, a tiny or huge scale, or a distant outlier then costs no precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    origin: DVec3,
    /// Half of the simplifier's unit, in object units.
    half: f64,
}

/// The corner of a live face at a hub, with the face's other two positions, counter-clockwise from the hub.
#[derive(Clone, Copy, Debug)]
pub struct HubCorner {
    pub face: u32,
    /// Which corner of the face is the hub.
    pub index: u8,
    pub a: u32,
    pub b: u32,
}

impl Normalisation {
    fn of(positions: &[DVec3]) -> Normalisation {
        let median = |axis: usize| {
            let mut values: Vec<f64> = positions.iter().map(|p| p[axis]).collect();
            let middle = values.len() / 2;
            *values.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        if positions.is_empty() {
            return Normalisation { origin: DVec3::ZERO, half: 1.0 };
        }
        let origin = DVec3::new(median(0), median(1), median(2));
        // Halved, because the difference of two finite numbers may overflow.
        let half =
            positions.iter().fold(0.0, |max: f64, p| max.max((*p * 0.5 - origin * 0.5).abs().max_element()));
        Normalisation { origin, half: if half > 0.0 { half } else { 1.0 } }
    }

    fn inside(&self, position: DVec3) -> DVec3 {
        (position * 0.5 - self.origin * 0.5) / self.half
    }

    /// Converts a length to object units.
    pub fn outside(&self, length: f64) -> f64 {
        (length * self.half * 2.0).min(f64::MAX)
    }
}

impl WorkingMesh {
    pub fn new(model: &Model, curve: &Curve) -> (WorkingMesh, Normalisation) {
        let units = Normalisation::of(&model.positions);
        let places =
            |&face: &u32| model.face_positions(face as usize).map(|position| curve.places[position as usize]);
        let faces: Vec<[u32; 3]> = curve.faces.iter().map(places).collect();
        let point = |&position: &u32| units.inside(model.positions[position as usize]);
        let mut surface = WorkingMesh {
            points: curve.positions.iter().map(point).collect(),
            first: vec![END; model.positions.len()],
            next: vec![END; 3 * faces.len()],
            valence: vec![0; model.positions.len()],
            live: faces.len(),
            has_seams: model.wedge_positions.len() > model.positions.len(),
            wedges: curve.faces.iter().map(|&face| model.faces[face as usize]).collect(),
            faces,
        };
        // Backwards, so that each list begins with its first face.
        for corner in (0..surface.next.len()).rev() {
            let position = surface.faces[corner / 3][corner % 3] as usize;
            surface.next[corner] = std::mem::replace(&mut surface.first[position], corner as u32);
            surface.valence[position] += 1;
        }
        (surface, units)
    }

    /// Adds points that belong to no face, numbered from the positions on.
    pub fn add_points(&mut self, points: impl Iterator<Item = DVec3>) {
        self.points.extend(points);
    }

    /// True for a position, false for an added point.
    pub fn is_position(&self, point: u32) -> bool {
        (point as usize) < self.valence.len()
    }

    /// The number of live faces.
    pub fn live(&self) -> usize {
        self.live
    }

    pub fn is_live(&self, face: u32) -> bool {
        self.faces[face as usize] != GONE
    }

    /// Positions of a live face's corners.
    pub fn face(&self, face: u32) -> [u32; 3] {
        self.faces[face as usize]
    }

    /// The wedge in a corner of a live face.
    pub fn wedge(&self, face: u32, corner: u8) -> u32 {
        self.wedges[face as usize][corner as usize]
    }

    /// True if any position has several wedges.
    pub fn has_seams(&self) -> bool {
        self.has_seams
    }

    /// The number of the model's faces.
    pub fn faces(&self) -> usize {
        self.faces.len()
    }

    /// The number of live faces at a position.
    pub fn valence(&self, position: u32) -> usize {
        self.valence[position as usize] as usize
    }

    pub fn point(&self, position: u32) -> DVec3 {
        self.points[position as usize]
    }

    /// The corner points of a live face.
    pub fn triangle(&self, face: u32) -> [DVec3; 3] {
        self.face(face).map(|position| self.point(position))
    }

    /// The corners of live faces at a position, in unspecified order.
    pub fn corners(&self, hub: u32) -> impl Iterator<Item = HubCorner> + Clone + '_ {
        let mut corner = self.first[hub as usize];
        std::iter::from_fn(move || {
            while corner != END {
                let (face, k) = (corner / 3, (corner % 3) as usize);
                corner = self.next[corner as usize];
                let positions = self.faces[face as usize];
                if positions != GONE {
                    let (a, b) = (positions[(k + 1) % 3], positions[(k + 2) % 3]);
                    return Some(HubCorner { face, index: k as u8, a, b });
                }
            }
            None
        })
    }

    /// Like [`Self::corners`], into `corners`; also drops removed faces from the position's list.
    pub fn gather(&mut self, hub: u32, corners: &mut Vec<HubCorner>) {
        corners.clear();
        let mut corner = self.first[hub as usize];
        let mut last = END;
        while corner != END {
            let (face, k) = (corner / 3, (corner % 3) as usize);
            let following = self.next[corner as usize];
            let positions = self.faces[face as usize];
            if positions != GONE {
                let (a, b) = (positions[(k + 1) % 3], positions[(k + 2) % 3]);
                corners.push(HubCorner { face, index: k as u8, a, b });
                last = corner;
            } else if last == END {
                self.first[hub as usize] = following;
            } else {
                self.next[last as usize] = following;
            }
            corner = following;
        }
    }

    /// Reads what the mesh knows about a position, without its point.
    pub fn touch(&self, position: u32) -> u32 {
        self.first[position as usize] ^ self.valence[position as usize]
    }

    /// Removes a live face.
    pub fn remove(&mut self, face: u32) {
        let positions = std::mem::replace(&mut self.faces[face as usize], GONE);
        assert!(positions != GONE, "face {face} is removed twice");
        positions.into_iter().for_each(|position| self.valence[position as usize] -= 1);
        self.live -= 1;
    }

    /// Replaces `hub` by `to` in all of the hub's faces, `corners`; none of them may contain `to`. `wedge` maps the
    /// hub's wedges to those of `to`.
    pub fn replace(&mut self, hub: u32, to: u32, corners: &[HubCorner], mut wedge: impl FnMut(u32) -> u32) {
        for corner in corners {
            let (face, index) = (corner.face as usize, corner.index as usize);
            assert!(self.faces[face][index] == hub && corner.a != to && corner.b != to);
            self.faces[face][index] = to;
            self.wedges[face][index] = wedge(self.wedges[face][index]);
            let at = 3 * corner.face + u32::from(corner.index);
            self.next[at as usize] = std::mem::replace(&mut self.first[to as usize], at);
        }
        self.first[hub as usize] = END;
        self.valence[hub as usize] = 0;
        self.valence[to as usize] += corners.len() as u32;
    }
}

//! A position that may vanish, with the edges and faces around it: where it may go, and where not.

use super::surface::{Blade, Surface};

/// An edge at a hub.
#[derive(Clone, Copy, Debug)]
pub struct Spoke {
    pub end: u32,
    pub kind: Kind,
    /// Faces along the edge.
    pub faces: u32,
    /// The blade in which `end` follows the hub, and the one in which it comes before; the last of each if there
    /// are several.
    ahead: Option<u32>,
    behind: Option<u32>,
}

/// What an edge is to those who want to collapse another onto it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Two faces, which agree on the wedges at both ends.
    Plain,
    /// Two faces that do not: attributes break here.
    Seam,
    /// One face.
    Border,
    /// Something else: no manifold.
    Complex,
}

/// So many spokes are searched one by one.
const FEW: usize = 16;

/// The neighbourhood of a position; its lists are reused.
pub struct Hub {
    pub position: u32,
    pub blades: Vec<Blade>,
    pub spokes: Vec<Spoke>,
    /// Of the spokes, packed.
    ends: Vec<u32>,
    /// For each position the hub at which it was seen last, and its spoke there.
    seen: Vec<(u32, u32)>,
    turn: u32,
}

impl Hub {
    /// For positions below `count`.
    pub fn new(count: usize) -> Hub {
        Hub {
            position: 0,
            blades: Vec::new(),
            spokes: Vec::new(),
            ends: Vec::new(),
            seen: vec![(0, 0); count],
            turn: 0,
        }
    }

    /// Looks at a position.
    pub fn look(&mut self, surface: &mut Surface, position: u32) {
        self.position = position;
        surface.gather(position, &mut self.blades);
        self.spokes.clear();
        self.ends.clear();
        if self.turn == u32::MAX {
            self.seen.fill((0, 0));
            self.turn = 0;
        }
        self.turn += 1;
        for index in 0..self.blades.len() as u32 {
            let Blade { a, b, .. } = self.blades[index as usize];
            let spoke = self.spoke_for(a);
            spoke.faces += 1;
            spoke.ahead = Some(index);
            let spoke = self.spoke_for(b);
            spoke.faces += 1;
            spoke.behind = Some(index);
        }
        for index in 0..self.spokes.len() {
            self.spokes[index].kind = self.kind(surface, &self.spokes[index]);
        }
    }

    fn spoke_for(&mut self, end: u32) -> &mut Spoke {
        let seen = &mut self.seen[end as usize];
        if seen.0 != self.turn {
            *seen = (self.turn, self.spokes.len() as u32);
            self.ends.push(end);
            self.spokes.push(Spoke { end, kind: Kind::Plain, faces: 0, ahead: None, behind: None });
        }
        &mut self.spokes[seen.1 as usize]
    }

    /// The spoke that ends at a position.
    pub fn spoke_to(&self, end: u32) -> Option<&Spoke> {
        // Few ends stand in one or two lines of the CPU's cache, `seen` of all positions in none.
        if self.ends.len() <= FEW {
            return self.ends.iter().position(|&known| known == end).map(|at| &self.spokes[at]);
        }
        let (turn, spoke) = self.seen[end as usize];
        (turn == self.turn).then(|| &self.spokes[spoke as usize])
    }

    fn kind(&self, surface: &Surface, spoke: &Spoke) -> Kind {
        match (spoke.faces, spoke.ahead, spoke.behind) {
            (1, ..) => Kind::Border,
            (2, Some(_), Some(_)) if !surface.has_seams() => Kind::Plain,
            (2, Some(ahead), Some(behind)) => {
                let along = |blade| self.wedges_along(surface, blade, spoke.end);
                if along(ahead) == along(behind) { Kind::Plain } else { Kind::Seam }
            }
            _ => Kind::Complex,
        }
    }

    /// The wedges of the hub and of `end` in a blade.
    fn wedges_along(&self, surface: &Surface, blade: u32, end: u32) -> [u32; 2] {
        let Blade { face, corner, a, .. } = self.blades[blade as usize];
        let other = if a == end { (corner + 1) % 3 } else { (corner + 2) % 3 };
        [surface.wedge(face, corner), surface.wedge(face, other)]
    }

    /// The border's edges into the hub and out of it, in the faces' direction, if it has just one of each.
    pub fn border(&self) -> Option<[Spoke; 2]> {
        let mut found = [None; 2];
        for spoke in self.spokes.iter().filter(|spoke| spoke.kind == Kind::Border) {
            let side = &mut found[usize::from(spoke.ahead.is_some())];
            if side.replace(*spoke).is_some() {
                return None;
            }
        }
        Some([found[0]?, found[1]?])
    }

    /// What a collapse along a spoke may be, from the kinds of edges alone: a position inside may go anywhere, one on a
    /// border or seam only along it, and where they end, cross or branch, nowhere.
    pub fn path(&self) -> Path {
        let mut marked = self.spokes.iter().filter(|spoke| spoke.kind != Kind::Plain).map(|spoke| spoke.kind);
        match (marked.next(), marked.next(), marked.next()) {
            (None, ..) => Path::Anywhere,
            // Where two sheets came to share one edge, they part again when that edge goes.
            (Some(Kind::Complex), None, _) => Path::Along(Kind::Complex),
            (Some(one), Some(two), None) if one == two => Path::Along(one),
            _ => Path::Nowhere,
        }
    }

    /// For the hub's wedges in the faces along a spoke, the wedges at its end. None if one wedge would have to become
    /// two, unless `torn`: then the first counts.
    pub fn wedge_pairs(&self, surface: &Surface, end: u32, torn: bool) -> Option<WedgePairs> {
        let mut pairs = WedgePairs { pairs: [[0; 2]; MOST_PAIRS], count: 0 };
        for (index, blade) in self.blades.iter().enumerate() {
            if blade.a != end && blade.b != end {
                continue;
            }
            let [from, to] = self.wedges_along(surface, index as u32, end);
            match pairs.target(from) {
                Some(other) if other != to && !torn => return None,
                Some(_) => {}
                None if pairs.count == MOST_PAIRS => return None,
                None => {
                    pairs.pairs[pairs.count] = [from, to];
                    pairs.count += 1;
                }
            }
        }
        Some(pairs)
    }

    /// What collapsing along a spoke does to the surface (the link condition): hub and end may have no neighbours in
    /// common but those of the edge's faces, no face may become another one, and no position lose its last face.
    pub fn link(&self, surface: &Surface, spoke: &Spoke) -> Link {
        let end = spoke.end;
        let known = |position: u32| position != self.position && self.spoke_to(position).is_some();
        let common = |position: u32| known(position) && !self.has_blade(end, position);
        let stays = surface.valence(end) + self.blades.len() > 2 * spoke.faces as usize;
        if !stays || self.opposites(end).any(|position| surface.valence(position) < 2) {
            return Link::Forbidden;
        }
        let (mut meets, mut closes) = (false, self.closing(surface, spoke));
        for blade in surface.blades(end).filter(|x| self.is_not(x)) {
            if known(blade.a) && known(blade.b) && self.has_blade(blade.a, blade.b) {
                return Link::Forbidden;
            }
            for position in [blade.a, blade.b].into_iter().filter(|&position| common(position)) {
                meets = true;
                closes = closes.filter(|&last| last == position);
            }
        }
        match (meets, closes) {
            (false, _) => Link::Surface,
            (true, Some(_)) => Link::Closes,
            (true, None) => Link::Pinches,
        }
    }

    /// The third corner of a hole of three edges, two of which are the spoke and the border's other edge at the hub.
    fn closing(&self, surface: &Surface, spoke: &Spoke) -> Option<u32> {
        let [into, out] = if spoke.kind == Kind::Border { self.border()? } else { return None };
        let (last, ahead) = if spoke.end == out.end { (into.end, true) } else { (out.end, false) };
        let mut along = surface.blades(spoke.end).filter(|x| x.a == last || x.b == last);
        let one = along.next().filter(|x| (x.a == last) == ahead)?;
        (along.next().is_none() && self.is_not(&one)).then_some(last)
    }

    /// Whether a face at another position has no corner at the hub.
    pub fn is_not(&self, blade: &Blade) -> bool {
        blade.a != self.position && blade.b != self.position
    }

    /// Whether a face of the hub has both positions.
    fn has_blade(&self, p: u32, q: u32) -> bool {
        self.blades.iter().any(|x| (x.a == p && x.b == q) || (x.a == q && x.b == p))
    }

    /// Third positions of the faces along the spoke to `end`.
    fn opposites(&self, end: u32) -> impl Iterator<Item = u32> + '_ {
        self.blades.iter().filter_map(move |x| match end {
            _ if end == x.a => Some(x.b),
            _ if end == x.b => Some(x.a),
            _ => None,
        })
    }
}

/// Where a hub may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    Anywhere,
    /// Only along edges of this kind.
    Along(Kind),
    Nowhere,
}

impl Path {
    pub fn allows(self, kind: Kind) -> bool {
        match self {
            Path::Anywhere => true,
            Path::Along(only) => kind == only,
            Path::Nowhere => false,
        }
    }
}

/// What a collapse does to the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// Leaves it one, as it was.
    Surface,
    /// Closes a hole of three edges.
    Closes,
    /// Makes two sheets share an edge: a handle or a neck becomes a pinch.
    Pinches,
    /// Would make one face of two, or leave a position without any.
    Forbidden,
}

/// Wedges along one edge: two, unless sheets share it.
const MOST_PAIRS: usize = 4;

/// Some wedges of a position, each with the one that takes its place.
#[derive(Clone, Copy, Debug)]
pub struct WedgePairs {
    pairs: [[u32; 2]; MOST_PAIRS],
    count: usize,
}

impl WedgePairs {
    /// What takes the place of a wedge, if it is one of them.
    pub fn target(&self, wedge: u32) -> Option<u32> {
        self.pairs[..self.count].iter().find(|pair| pair[0] == wedge).map(|pair| pair[1])
    }
}

//! Checks the invariants of a [`Model`] one by one. Shares no code with the cleaning.

use super::Model;
use std::collections::{HashMap, HashSet};

impl Model {
    /// Checks all invariants of [`Model`].
    ///
    /// # Errors
    /// The first violated invariant, and where.
    pub fn check(&self) -> Result<(), String> {
        self.check_values()?;
        self.check_indices()?;
        let mut faces = HashSet::new();
        let mut sides: HashMap<[u32; 2], usize> = HashMap::new();
        for face in 0..self.faces.len() {
            let corners = self.face_positions(face);
            let mut sorted = corners;
            sorted.sort_unstable();
            if sorted[0] == sorted[1] || sorted[1] == sorted[2] {
                return Err(format!("face {face} is degenerate: its positions are {corners:?}"));
            }
            if !faces.insert(sorted) {
                return Err(format!("face {face} has the positions of an earlier face: {corners:?}"));
            }
            for k in 0..3 {
                let side = [corners[k], corners[(k + 1) % 3]];
                if let Some(other) = sides.insert(side, face) {
                    return Err(format!(
                        "faces {other} and {face} traverse the edge {side:?} in the same direction"
                    ));
                }
            }
        }
        self.check_fans()
    }

    fn check_values(&self) -> Result<(), String> {
        let bad = self.positions.iter().position(|position| !position.is_finite());
        if let Some(position) = bad {
            return Err(format!("position {position} is not finite: {}", self.positions[position]));
        }
        let wedges = self.wedge_positions.len();
        let attributes = &self.attributes;
        for (what, length) in [
            ("normals", attributes.normals.len()),
            ("coordinates", attributes.coordinates.len()),
            ("colors", attributes.colors.len()),
        ] {
            if length != 0 && length != wedges {
                return Err(format!("{length} {what}, but {wedges} wedges"));
            }
        }
        let unit = |normal: &[f32; 3]| {
            let length = normal.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>();
            // Each of the three components, at most 1, is rounded to f32 by at most 2^-25. The square doubles
            // the error.
            (length - 1.0).abs() <= 1e-6
        };
        if let Some(wedge) = attributes.normals.iter().position(|normal| !unit(normal)) {
            return Err(format!(
                "the normal of wedge {wedge} is not a unit vector: {:?}",
                attributes.normals[wedge]
            ));
        }
        let bad = attributes.coordinates.iter().position(|st| st.iter().any(|x| !x.is_finite()));
        bad.map_or(Ok(()), |wedge| {
            Err(format!("the coordinate of wedge {wedge} is not finite: {:?}", attributes.coordinates[wedge]))
        })
    }

    fn check_indices(&self) -> Result<(), String> {
        let mut used_positions = vec![false; self.positions.len()];
        for (wedge, &position) in self.wedge_positions.iter().enumerate() {
            match used_positions.get_mut(position as usize) {
                Some(used) => *used = true,
                None => {
                    return Err(format!("wedge {wedge} refers to position {position}, which does not exist"));
                }
            }
        }
        let mut used_wedges = vec![false; self.wedge_positions.len()];
        for (face, wedges) in self.faces.iter().enumerate() {
            for &wedge in wedges {
                match used_wedges.get_mut(wedge as usize) {
                    Some(used) => *used = true,
                    None => return Err(format!("face {face} refers to wedge {wedge}, which does not exist")),
                }
            }
        }
        for (what, used) in [("position", used_positions), ("wedge", used_wedges)] {
            if let Some(index) = used.iter().position(|used| !used) {
                return Err(format!("{what} {index} is not used"));
            }
        }
        Ok(())
    }

    /// The faces at each position are connected through edges at that position.
    fn check_fans(&self) -> Result<(), String> {
        // For each position, the opposite sides of its faces: (from, to). A fan is one chain of them.
        let mut links: Vec<Vec<[u32; 2]>> = vec![Vec::new(); self.positions.len()];
        for face in 0..self.faces.len() {
            let [a, b, c] = self.face_positions(face);
            links[a as usize].push([b, c]);
            links[b as usize].push([c, a]);
            links[c as usize].push([a, b]);
        }
        for (position, link) in links.iter().enumerate() {
            let next: HashMap<u32, u32> = link.iter().map(|&[from, to]| (from, to)).collect();
            let ends: HashSet<u32> = link.iter().map(|&[_, to]| to).collect();
            let start = link.iter().map(|&[from, _]| from).find(|from| !ends.contains(from));
            let start = start.unwrap_or(link[0][0]);
            let mut length = 0;
            let mut at = start;
            while let Some(&to) = next.get(&at) {
                length += 1;
                at = to;
                if at == start {
                    break;
                }
            }
            if length != link.len() {
                return Err(format!("position {position} has {} faces in several fans", link.len()));
            }
        }
        Ok(())
    }
}
